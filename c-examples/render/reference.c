/* Independent batches give the reference and, from their spread, its standard error. */
#include "reference.h"

#include <stdlib.h>

#include "parallel.h"
#include "workers.h"

#define POINTS_PER_JOB 16u

/* The compared methods use passes 0 and 1. */
#define FIRST_PASS 2u

typedef struct Task {
    const Lighting *lighting;
    const View *view;
    uint32_t batch_spp;
    Worker *workers;
    Reference *reference;
} Task;

static bool allocate(Reference *r, size_t capacity) {
    r->shadowed = calloc(capacity, sizeof *r->shadowed);
    r->unshadowed = calloc(capacity, sizeof *r->unshadowed);
    r->shadowed_error = calloc(capacity, sizeof *r->shadowed_error);
    r->unshadowed_error = calloc(capacity, sizeof *r->unshadowed_error);
    return r->shadowed && r->unshadowed && r->shadowed_error && r->unshadowed_error;
}

/* Mean colour of the batches and the standard error of its luminance. */
static void average(const Vec3 batches[REFERENCE_BATCHES], Vec3 *mean, float *error) {
    const float n = (float)REFERENCE_BATCHES;
    Vec3 sum = {0.0f, 0.0f, 0.0f};
    double squares = 0.0;
    for (uint32_t i = 0; i < REFERENCE_BATCHES; i++) {
        sum = vec3_add(sum, batches[i]);
    }
    *mean = vec3_scale(sum, 1.0f / n);
    for (uint32_t i = 0; i < REFERENCE_BATCHES; i++) {
        double deviation = luminance(batches[i]) - luminance(*mean);
        squares += deviation * deviation;
    }
    *error = (float)sqrt(squares / (n * (n - 1.0)));
}

static wis_status render_point(const Task *t, Worker *w, size_t index) {
    Reference *r = t->reference;
    const ShadingPoint *point = &t->view->points[index];
    Vec3 shadowed[REFERENCE_BATCHES], unshadowed[REFERENCE_BATCHES];
    for (uint32_t batch = 0; batch < REFERENCE_BATCHES; batch++) {
        uint32_t pass = FIRST_PASS + 2 * batch;
        wis_status status =
            integrate(METHOD_MIS_COMPENSATED, t->lighting, &w->workspace, point, pass, t->batch_spp, w->samples);
        if (status != WIS_OK) {
            return status;
        }
        shadowed[batch] = sum_visible(point, w->samples, t->batch_spp);
        unshadowed[batch] = sum_unshadowed(w->samples, t->batch_spp);
    }
    average(shadowed, &r->shadowed[index], &r->shadowed_error[index]);
    average(unshadowed, &r->unshadowed[index], &r->unshadowed_error[index]);
    return WIS_OK;
}

static wis_status render_job(void *shared, unsigned index, size_t job) {
    const Task *t = shared;
    size_t first = job * POINTS_PER_JOB;
    wis_status status = WIS_OK;
    for (size_t i = 0; i < POINTS_PER_JOB && first + i < t->reference->count && status == WIS_OK; i++) {
        status = render_point(t, &t->workers[index], first + i);
    }
    return status;
}

static wis_status render_jobs(Task *t, unsigned threads) {
    size_t jobs = (t->reference->count + POINTS_PER_JOB - 1) / POINTS_PER_JOB;
    Progress bar = progress_begin("reference", jobs);
    wis_status status = parallel_for(threads, jobs, render_job, t, &bar);
    progress_end(&bar);
    return status;
}

wis_status reference_render(Reference *out, const Lighting *lighting, const View *view, uint32_t spp,
                            unsigned threads) {
    Task t = {lighting, view, spp / REFERENCE_BATCHES, NULL, out};
    wis_status status = workers_init(&t.workers, threads, t.batch_spp, t.batch_spp);
    out->count = view->count;
    if (status == WIS_OK && !allocate(out, view->count)) {
        status = WIS_MEMORY_TOO_SMALL;
    }
    if (status == WIS_OK) {
        status = render_jobs(&t, threads);
    }
    workers_free(t.workers, threads);
    return status;
}

void reference_free(Reference *reference) {
    free(reference->shadowed);
    free(reference->unshadowed);
    free(reference->shadowed_error);
    free(reference->unshadowed_error);
}
