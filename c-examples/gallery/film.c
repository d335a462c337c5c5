/* Threads share the rows. Between two passes only one thread runs, so the processor time of the process is that of the pass. */
#include "film.h"

#include <stdlib.h>
#include <time.h>

#include "../render/parallel.h"

/* Of the visibility cache: about as many as cells that the surfaces of a set meet. 4.7 MB. */
#define PLACES 4096u

/* Rays are cheap here, and a pixel has many: more camera rays gain more than a better choice at each hit. */
#define CANDIDATES_PER_RAY 4u

typedef struct Pass {
    Film *film;
    const Lighting *lighting;
    const Camera *camera;
    Workspace *workspaces;
    LightSample *samples; /* film->samples for each thread */
    double start, budget;
} Pass;

static double processor_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

bool film_init(Film *film, Method method, uint32_t samples, uint32_t number, const Camera *camera) {
    Film f = {.method = method, .samples = samples, .number = number, .count = (size_t)camera->width * camera->height};
    f.sum = calloc(f.count, sizeof *f.sum);
    f.taken = calloc(f.count, sizeof *f.taken);
    f.escaped = calloc(f.count, sizeof *f.escaped);
    *film = f;
    return f.sum != NULL && f.taken != NULL && f.escaped != NULL;
}

bool film_remember(Film *film) {
    wis_memory_size size;
    void *memory;
    wis_visibility_cache_size(PLACES, &size, NULL);
    memory = malloc(size.bytes);
    return memory != NULL && wis_visibility_cache_init(PLACES, memory, size.bytes, &film->visibility, NULL) == WIS_OK;
}

void film_free(Film *film) {
    free(film->sum);
    free(film->taken);
    free(film->escaped);
    free(film->visibility);
}

/* The light that reaches a point, and a note of which rays did. */
static Vec3 sum_and_record(const Workspace *w, const ShadingPoint *point, uint32_t pass, const LightSample *samples, uint32_t count) {
    wis_point place = visibility_point(w, point, pass);
    Vec3 sum = {0.0f, 0.0f, 0.0f};
    for (uint32_t i = 0; i < count; i++) {
        float wi[3];
        uint8_t reached;
        if (luminance(samples[i].radiance) > 0.0f) {
            reached = !scene_occluded(point, samples[i].wi);
            sum = reached ? vec3_add(sum, samples[i].radiance) : sum;
            vec3_store(samples[i].wi, wi);
            wis_visibility_cache_record(&place, 1, wi, 0, &reached);
        }
    }
    return sum;
}

/* Each film has three sequences of its own: of places in the pixel, and the two passes of `integrate`. */
static wis_status expose(const Pass *pass, unsigned worker, uint32_t x, uint32_t y) {
    Film *f = pass->film;
    Workspace *w = &pass->workspaces[worker];
    size_t pixel = (size_t)y * pass->camera->width + x;
    uint32_t numbers = 3 * f->number + 1;
    LightSample *samples = pass->samples + (size_t)worker * f->samples;
    ShadingPoint point = {.x = x, .y = y, .sample = f->taken[pixel] - f->escaped[pixel]};
    float u[2];
    Vec3 direction;
    wis_status status = wis_points_sobol(wis_pixel_seed(x, y, numbers - 1), f->taken[pixel], 1, u, 0);
    f->taken[pixel]++;
    direction = camera_direction(pass->camera, (float)x + u[0], (float)y + u[1]);
    if (status != WIS_OK || !scene_first_hit(pass->camera->eye, direction, &point)) {
        f->escaped[pixel]++;
        return status;
    }
    status = integrate(f->method, pass->lighting, w, &point, numbers, f->samples, samples);
    if (status == WIS_OK) {
        Vec3 light = f->visibility == NULL ? sum_visible(&point, samples, f->samples)
                                           : sum_and_record(w, &point, numbers, samples, f->samples);
        f->sum[pixel] = vec3_add(f->sum[pixel], light);
    }
    return status;
}

static wis_status expose_row(void *shared, unsigned worker, size_t row) {
    const Pass *pass = shared;
    wis_status status = WIS_OK;
    if (pass->film->turn > 0 && pass->film->seconds + processor_seconds() - pass->start >= pass->budget) {
        return WIS_OK;
    }
    for (uint32_t x = 0; x < pass->camera->width && status == WIS_OK; x++) {
        status = expose(pass, worker, x, (uint32_t)row);
    }
    return status;
}

static wis_status run(Pass *pass, unsigned threads) {
    wis_status status = WIS_OK;
    for (unsigned i = 0; i < threads && status == WIS_OK; i++) {
        status = workspace_init(&pass->workspaces[i], pass->film->samples, CANDIDATES_PER_RAY);
        pass->workspaces[i].visibility = pass->film->visibility;
    }
    if (status == WIS_OK) {
        pass->start = processor_seconds();
        status = parallel_for(threads, pass->camera->height, expose_row, pass, NULL);
        if (status == WIS_OK && pass->film->visibility != NULL) {
            status = wis_visibility_cache_end_pass(pass->film->visibility);
        }
        pass->film->seconds += processor_seconds() - pass->start;
        pass->film->turn++;
    }
    for (unsigned i = 0; i < threads; i++) {
        workspace_free(&pass->workspaces[i]);
    }
    return status;
}

wis_status film_pass(Film *film, const Lighting *lighting, const Camera *camera, double budget, unsigned threads) {
    Pass pass = {film, lighting, camera, calloc(threads, sizeof(Workspace)),
                 malloc((size_t)threads * film->samples * sizeof(LightSample)), 0.0, budget};
    wis_status status = WIS_MEMORY_TOO_SMALL;
    if (pass.workspaces != NULL && pass.samples != NULL) {
        status = run(&pass, threads);
    }
    free(pass.workspaces);
    free(pass.samples);
    return status;
}

Vec3 film_mean(const Film *film, size_t pixel) {
    uint32_t hits = film->taken[pixel] - film->escaped[pixel];
    return vec3_scale(film->sum[pixel], hits > 0 ? 1.0f / (float)hits : 0.0f);
}
