/* A renderer's calls on fibers with stacks of 16 kB, with a page behind each that must not be touched. */
#define _GNU_SOURCE
#include <stdio.h>
#include <sys/mman.h>
#include <ucontext.h>
#include <unistd.h>

#include "work.h"

enum { FIBERS = 8, STACK = 16 * 1024 };

static const work_library wis = WORK_LIBRARY;
static ucontext_t host, fiber[FIBERS];
static work_memory memory[FIBERS];
static const wis_environment *environment;
static uint64_t hash[FIBERS];
/* What changes while fibers run must not live in registers. */
static size_t most;
static int failed;

static void run(int i) {
    hash[i] = work_render(&wis, environment, &memory[i]);
}

int main(void) {
    const size_t page = (size_t)sysconf(_SC_PAGESIZE);
    work_paint();
    for (int i = 0; i < FIBERS; i++) {
        memset(&memory[i], 0, sizeof memory[i]);
        if (!work_allocate(&wis, &memory[i])) return 2;
    }
    environment = work_build(&wis, &memory[0]);
    const uint64_t expected = environment ? work_render(&wis, environment, &memory[0]) : 0;
    for (int i = 0; i < FIBERS; i++) {
        unsigned char *block =
            mmap(NULL, page + STACK, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (block == MAP_FAILED || mprotect(block, page, PROT_NONE) != 0) return 2;
        memset(block + page, 0xa5, STACK);
        if (getcontext(&fiber[i]) != 0) return 2;
        fiber[i].uc_stack.ss_sp = block + page;
        fiber[i].uc_stack.ss_size = STACK;
        fiber[i].uc_link = &host;
        makecontext(&fiber[i], (void (*)(void))run, 1, i);
        if (swapcontext(&host, &fiber[i]) != 0) return 2;
        size_t untouched = 0;
        while (untouched < STACK && block[page + untouched] == 0xa5) untouched++;
        if (STACK - untouched > most) most = STACK - untouched;
        failed |= hash[i] != expected;
    }
    failed |= expected == 0;
    printf("%s: fibers of 16 kB, of which %zu bytes were used\n", failed ? "FAILED" : "the same bits", most);
    return failed;
}
