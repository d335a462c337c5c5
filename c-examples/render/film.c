/* Threads share the rows. Between two passes only one thread runs, so the processor time of the process is that of the pass. */
#include "film.h"

#include <stdlib.h>
#include <time.h>

#include "parallel.h"

/* Of the visibility cache: about as many as cells that the surfaces of a set meet. 4.7 MB. */
#define PLACES 4096u

typedef struct Pass {
    Film *film;
    const Lighting *lighting;
    const Camera *camera;
    Workspace *workspaces;
    double start;
} Pass;

static double processor_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

bool film_init(Film *film, const Camera *camera) {
    film->count = (size_t)camera->width * camera->height;
    film->sum = calloc(film->count, sizeof *film->sum);
    film->taken = calloc(film->count, sizeof *film->taken);
    film->escaped = calloc(film->count, sizeof *film->escaped);
    return film->sum != NULL && film->taken != NULL && film->escaped != NULL;
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

/* Each film has three sequences of its own: of places in the pixel, and the two passes of `integrate`. */
static wis_status expose(const Pass *pass, Workspace *w, uint32_t x, uint32_t y) {
    Film *f = pass->film;
    size_t pixel = (size_t)y * pass->camera->width + x;
    uint32_t numbers = 3 * f->number + 1;
    ShadingPoint point = {.x = x, .y = y, .sample = f->taken[pixel] - f->escaped[pixel]};
    float u[2] = {0.5f, 0.5f};
    Vec3 direction;
    wis_status status = f->is_still ? WIS_OK : wis_points_sobol(pixel_seed(x, y, numbers - 1), f->taken[pixel], 1, u, 0);
    f->taken[pixel]++;
    direction = camera_direction(pass->camera, (float)x + u[0], (float)y + u[1]);
    if (status != WIS_OK || !scene_first_hit(pass->camera->eye, direction, &point)) {
        f->escaped[pixel]++;
        return status;
    }
    return integrate(f->method, pass->lighting, w, &point, numbers, f->samples, &f->sum[pixel]);
}

/* A pass, but for the first, ends early where the film's time reaches its budget. */
static wis_status expose_row(void *shared, unsigned worker, size_t row) {
    const Pass *pass = shared;
    wis_status status = WIS_OK;
    if (pass->film->passes > 0 && pass->film->seconds + processor_seconds() - pass->start >= pass->film->budget) {
        return WIS_OK;
    }
    for (uint32_t x = 0; x < pass->camera->width && status == WIS_OK; x++) {
        status = expose(pass, &pass->workspaces[worker], x, (uint32_t)row);
    }
    return status;
}

static wis_status run(Pass *pass, unsigned threads) {
    Film *film = pass->film;
    wis_status status = WIS_OK;
    for (unsigned i = 0; i < threads && status == WIS_OK; i++) {
        status = workspace_init(&pass->workspaces[i], film->samples);
        pass->workspaces[i].visibility = film->visibility;
    }
    if (status == WIS_OK) {
        pass->start = processor_seconds();
        status = parallel_for(threads, pass->camera->height, expose_row, pass);
        if (status == WIS_OK && film->visibility != NULL) {
            status = wis_visibility_cache_end_pass(film->visibility);
        }
        film->seconds += processor_seconds() - pass->start;
        film->passes++;
    }
    for (unsigned i = 0; i < threads; i++) {
        workspace_free(&pass->workspaces[i]);
    }
    return status;
}

wis_status films_expose(Film *films, uint32_t count, const Lighting *lighting, const Camera *camera, unsigned threads) {
    Pass pass = {NULL, lighting, camera, calloc(threads, sizeof(Workspace)), 0.0};
    wis_status status = pass.workspaces != NULL ? WIS_OK : WIS_MEMORY_TOO_SMALL;
    for (bool is_done = false; !is_done && status == WIS_OK;) {
        is_done = true;
        for (uint32_t i = 0; i < count && status == WIS_OK; i++) {
            if (films[i].seconds < films[i].budget && films[i].passes < films[i].most) {
                is_done = false;
                pass.film = &films[i];
                status = run(&pass, threads);
            }
        }
    }
    free(pass.workspaces);
    return status;
}

Vec3 film_mean(const Film *film, size_t pixel) {
    uint32_t hits = film->taken[pixel] - film->escaped[pixel];
    return vec3_scale(film->sum[pixel], hits > 0 ? 1.0f / (float)hits : 0.0f);
}
