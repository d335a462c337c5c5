/* A host with a malloc of its own, which fails the test if it is called while the library works. */
#include <stdio.h>

#include "work.h"

static unsigned char heap[1 << 22];
static size_t taken;
static int forbidden, calls;

void *malloc(size_t bytes) {
    calls += forbidden;
    const size_t first = (taken + 63) & ~(size_t)63;
    if (first > sizeof heap || bytes > sizeof heap - first) return NULL;
    taken = first + bytes;
    return heap + first;
}
void free(void *block) {
    calls += forbidden && block != NULL;
}
void *calloc(size_t count, size_t bytes) {
    void *block = malloc(count * bytes);
    return block ? memset(block, 0, count * bytes) : NULL;
}
void *realloc(void *block, size_t bytes) {
    void *moved = malloc(bytes);
    /* The old block lies before the new one. */
    if (moved && block) memmove(moved, block, bytes);
    return moved;
}

int main(void) {
    const work_library wis = WORK_LIBRARY;
    work_memory memory;
    memset(&memory, 0, sizeof memory);
    work_paint();
    if (!work_allocate(&wis, &memory)) return 2;
    forbidden = 1;
    const wis_environment *environment = work_build(&wis, &memory);
    const uint64_t hash = environment && work_compare(&wis, environment, &memory) ? work_render(&wis, environment, &memory) : 0;
    forbidden = 0;
    puts(hash && calls == 0 ? "a host's own malloc: never called" : "FAILED");
    return hash && calls == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
