/* Threads that load the library, work and unload it, again and again. */
#include <pthread.h>
#include <stdio.h>

#include "loaded.h"

enum { THREADS = 8, ROUNDS = 25 };

static const char *path;
static uint64_t expected;

static void *rounds(void *failed) {
    for (int i = 0; i < ROUNDS; i++) {
        work_library wis;
        void *handle = load(path, &wis);
        if (!handle || work_all(&wis) != expected || dlclose(handle) != 0) *(int *)failed = 1;
    }
    return NULL;
}

int main(int count, char **argument) {
    const work_library linked = WORK_LIBRARY;
    pthread_t thread[THREADS];
    int failed[THREADS] = {0}, all = 0;
    if (count != 2) return 2;
    path = argument[1];
    work_paint();
    expected = work_all(&linked);
    for (int i = 0; i < THREADS; i++)
        if (pthread_create(&thread[i], NULL, rounds, &failed[i]) != 0) return 2;
    for (int i = 0; i < THREADS; i++) {
        pthread_join(thread[i], NULL);
        all |= failed[i];
    }
    all |= expected == 0;
    puts(all ? "FAILED" : "8 threads, 25 times loaded and unloaded each: the same bits");
    return all;
}
