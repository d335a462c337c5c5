/* Jobs are runs of points. A job writes only its own points and all random numbers come from the pixel, so
 * the pictures do not depend on the number of threads. */
#include "render.h"

#include <stdlib.h>
#include <time.h>

#include "parallel.h"
#include "workers.h"

#define POINTS_PER_JOB 64u

typedef struct Task {
    const Lighting *lighting;
    const View *view;
    Method method;
    uint32_t spp;
    Worker *workers;
    Estimate *estimate;
} Task;

static double cpu_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Samples a whole job first and traces its rays afterwards, so that the clock is read three times a job. */
static wis_status render_job(void *shared, unsigned index, size_t job) {
    const Task *t = shared;
    Worker *w = &t->workers[index];
    size_t first = job * POINTS_PER_JOB;
    size_t left = t->view->count - first;
    size_t count = left < POINTS_PER_JOB ? left : POINTS_PER_JOB;
    const ShadingPoint *points = t->view->points + first;
    wis_status status = WIS_OK;
    double sampled, start = cpu_seconds();
    for (size_t i = 0; i < count && status == WIS_OK; i++) {
        status = integrate(t->method, t->lighting, &w->workspace, &points[i], 0, t->spp, w->samples + i * t->spp);
    }
    if (status != WIS_OK) {
        return status;
    }
    sampled = cpu_seconds();
    for (size_t i = 0; i < count; i++) {
        t->estimate->shadowed[first + i] = sum_visible(&points[i], w->samples + i * t->spp, t->spp);
    }
    w->shadow_seconds += cpu_seconds() - sampled;
    w->sampling_seconds += sampled - start;
    for (size_t i = 0; i < count; i++) {
        t->estimate->unshadowed[first + i] = sum_unshadowed(w->samples + i * t->spp, t->spp);
    }
    return WIS_OK;
}

static wis_status render_jobs(Task *t, unsigned threads) {
    size_t jobs = (t->view->count + POINTS_PER_JOB - 1) / POINTS_PER_JOB;
    Progress bar = progress_begin(method_name(t->method), jobs);
    wis_status status = parallel_for(threads, jobs, render_job, t, &bar);
    progress_end(&bar);
    for (unsigned i = 0; i < threads; i++) {
        t->estimate->sampling_seconds += t->workers[i].sampling_seconds;
        t->estimate->shadow_seconds += t->workers[i].shadow_seconds;
    }
    return status;
}

wis_status estimate_render(Estimate *out, Method method, const Lighting *lighting, const View *view, uint32_t spp,
                           unsigned threads) {
    Task t = {lighting, view, method, spp, NULL, out};
    wis_status status = workers_init(&t.workers, threads, spp, (size_t)POINTS_PER_JOB * spp);
    out->shadowed = calloc(view->count, sizeof *out->shadowed);
    out->unshadowed = calloc(view->count, sizeof *out->unshadowed);
    if (status == WIS_OK) {
        status = out->shadowed && out->unshadowed ? render_jobs(&t, threads) : WIS_MEMORY_TOO_SMALL;
    }
    workers_free(t.workers, threads);
    return status;
}

void estimate_free(Estimate *estimate) {
    free(estimate->shadowed);
    free(estimate->unshadowed);
}
