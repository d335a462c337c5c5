/* Building the environment: begin says how many rows each of its two passes has, threads share the rows. */
#include "environment.h"

#include <stdlib.h>

#include "parallel.h"

#define ROWS_PER_JOB 16u

typedef struct Build {
    wis_wavelet_light_config config;
    wis_memory_size size;
    void *scratch;
    uint32_t rows[2];
    uint32_t pass;
} Build;

static wis_wavelet_light_config describe(const Light *light) {
    wis_wavelet_light_config config = {0};
    config.size = sizeof config;
    config.layout = WIS_LAYOUT_LATLONG;
    config.width = light->width;
    config.height = light->height;
    config.channels = 3;
    config.format = WIS_FORMAT_F32;
    config.flags = WIS_WAVELET_LIGHT_COMPENSATED | (light->nearest ? WIS_WAVELET_LIGHT_NEAREST : 0u);
    config.storage = WIS_STORAGE_PYRAMID;
    config.pixels = light->texels;
    return config;
}

static wis_status run_rows(void *shared, unsigned worker, size_t job) {
    Build *b = shared;
    uint32_t first = (uint32_t)job * ROWS_PER_JOB;
    uint32_t left = b->rows[b->pass] - first;
    uint32_t count = left < ROWS_PER_JOB ? left : ROWS_PER_JOB;
    (void)worker;
    return wis_wavelet_light_run(&b->config, b->scratch, b->size.scratch_bytes, b->pass, first, count, NULL);
}

static wis_status run_passes(Build *b, unsigned threads, Progress *bar) {
    wis_status status = WIS_OK;
    for (b->pass = 0; b->pass < 2 && status == WIS_OK; b->pass++) {
        size_t jobs = (b->rows[b->pass] + ROWS_PER_JOB - 1) / ROWS_PER_JOB;
        status = parallel_for(threads, jobs, run_rows, b, bar);
    }
    return status;
}

static wis_status build_in(Environment *out, Build *b, unsigned threads) {
    Progress bar;
    wis_status status = wis_wavelet_light_begin(&b->config, b->scratch, b->size.scratch_bytes, b->rows, NULL);
    if (status != WIS_OK) {
        return status;
    }
    bar = progress_begin("building the environment", (b->rows[0] + b->rows[1]) / ROWS_PER_JOB);
    status = run_passes(b, threads, &bar);
    if (status == WIS_OK) {
        status = wis_wavelet_light_finish(&b->config, out->memory, b->size.bytes, b->scratch,
                                        b->size.scratch_bytes, &out->handle, &out->info, NULL);
    }
    progress_end(&bar);
    return status;
}

wis_status environment_build(Environment *out, const Light *light, unsigned threads) {
    Build b = {0};
    wis_status status;
    b.config = describe(light);
    status = wis_wavelet_light_size(&b.config, &b.size, NULL);
    if (status != WIS_OK) {
        return status;
    }
    out->info.size = sizeof out->info;
    out->memory = malloc(b.size.bytes);
    b.scratch = malloc(b.size.scratch_bytes);
    status = WIS_MEMORY_TOO_SMALL;
    if (out->memory != NULL && b.scratch != NULL) {
        status = build_in(out, &b, threads);
    }
    free(b.scratch);
    return status;
}

void environment_free(Environment *environment) {
    free(environment->memory);
    environment->memory = NULL;
}
