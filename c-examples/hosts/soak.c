/* Eight threads on one environment, sharing chunks of work as they come: the bits are those of one thread. soak [millions of samples
   [seconds]]: the eight work until both are reached, the one does the same again. */
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <time.h>

#include "work.h"

enum { THREADS = 8, SAMPLES = 4096, HITS = 64 };

static const work_library wis = WORK_LIBRARY;
static const wis_environment *environment;
static uint32_t chunks; /* that are done at least, */
static time_t until;    /* and so long */
static atomic_uint next;
static atomic_int failed;
static _Atomic uint64_t sum;

/* Samples of the light and of a product, their pdfs, and rays at hits, all by the number of the chunk; 0: a call failed. */
static uint64_t chunk(wis_sampler *sampler, work_memory *memory, uint32_t number) {
    static _Thread_local float u[SAMPLES][2], pdf[SAMPLES];
    static _Thread_local wis_drawn drawn[SAMPLES];
    const wis_product *product = (const wis_product *)memory->product;
    wis_material material = {.size = sizeof material, .lobe_count = 1, .lobe = {{WIS_LOBE_GGX, 0.2f, 0.2f, 0.0f}}};
    wis_point point = {.size = sizeof point, .material = &material, .weight = {{1, 1, 1}}, .seed = number};
    size_t offset = 0, used = 0;
    point.normal[number % 3] = 1.0f;
    point.wo[number % 3] = 0.8f;
    point.wo[(number + 1) % 3] = 0.6f;
    if (wis_material_init(&material, NULL) != WIS_OK || wis_points_sobol(number, 0, SAMPLES, &u[0][0], 0) != WIS_OK ||
        wis_product_prepare(sampler, environment, &work_preparing, 1, &point, memory->product, memory->product_size.bytes, &offset,
                            &used) != WIS_OK)
        return 0;
    uint64_t hash = work_hash(14695981039346656037u, &number, sizeof number);
    for (int half = 0; half < 2; half++) {
        const size_t count = SAMPLES / 2;
        const float *first = &u[half * count][0];
        const wis_product *of = half ? product : NULL;
        if (wis_sample(sampler, environment, of, count, first, 0, drawn, 0) != WIS_OK ||
            wis_pdf(sampler, environment, of, count, drawn[0].wi, sizeof drawn[0], pdf, 0) != WIS_OK)
            return 0;
        for (size_t i = 0; i < count; i++)
            if (pdf[i] != drawn[i].pdf) return 0;
        hash = work_hash(hash, drawn, count * sizeof drawn[0]);
    }
    if (wis_sampler_begin_pixel(sampler) != WIS_OK) return 0;
    for (uint32_t hit = 0; hit < HITS; hit++) {
        wis_ray ray[WORK_RAYS];
        uint32_t count = 0;
        point.sample = hit;
        if (wis_direct(sampler, environment, &point, 1 + hit % WORK_RAYS, ray, &count) != WIS_OK) return 0;
        hash = work_hash(hash, ray, count * sizeof ray[0]);
    }
    return hash;
}

static void *work(void *unused) {
    work_memory memory;
    wis_sampler *sampler = NULL;
    (void)unused;
    memset(&memory, 0, sizeof memory);
    if (!work_allocate(&wis, &memory) || !(sampler = work_sampler(&wis, &memory))) {
        failed = 1;
        return NULL;
    }
    /* Every number that is taken is done, so that they are those from 0 on. */
    while (!failed && (next < chunks || time(NULL) < until)) {
        const uint64_t hash = chunk(sampler, &memory, next++);
        if (hash == 0) failed = 1;
        sum += hash;
    }
    work_release(&memory);
    return NULL;
}

/* The sum of all hashes, and the seconds that it took: the sum does not depend on who did what when. */
static uint64_t all(int threads, int *seconds) {
    const time_t begin = time(NULL);
    pthread_t thread[THREADS];
    next = 0;
    sum = 0;
    for (int i = 0; i < threads; i++)
        if (pthread_create(&thread[i], NULL, work, NULL) != 0) failed = 1;
    for (int i = 0; i < threads && !failed; i++) pthread_join(thread[i], NULL);
    *seconds = (int)(time(NULL) - begin);
    return sum;
}

int main(int count, char **argument) {
    const double millions = count > 1 ? atof(argument[1]) : 1.0;
    work_memory memory;
    memset(&memory, 0, sizeof memory);
    chunks = (uint32_t)(1e6 * millions / SAMPLES) + 1;
    work_paint();
    if (!work_allocate(&wis, &memory) || !(environment = work_build(&wis, &memory))) return 2;
    int seconds[2];
    until = time(NULL) + (count > 2 ? atoi(argument[2]) : 0);
    const uint64_t eight = all(THREADS, &seconds[1]);
    chunks = next;
    until = 0;
    const uint64_t one = all(1, &seconds[0]);
    failed |= one != eight;
    printf("%s: %llu samples, as many pdfs and %llu hits by 8 threads (%d s) and by one (%d s)\n",
           failed ? "FAILED" : "the same bits", (unsigned long long)chunks * SAMPLES, (unsigned long long)chunks * HITS,
           seconds[1], seconds[0]);
    work_release(&memory);
    return failed;
}
