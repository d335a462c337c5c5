/* Building the environment: begin says how many items each of its passes has, threads share the items. */
#include "environment.h"

#include <stdlib.h>

#include "parallel.h"

#define ITEMS_PER_JOB 16u

typedef struct Build {
    wis_environment_config config;
    wis_memory_size size;
    void *memory, *scratch;
    uint32_t items[WIS_ENVIRONMENT_PASSES];
    uint32_t pass;
} Build;

static wis_environment_config describe(const Light *light, uint32_t flags) {
    wis_environment_config config = {0};
    config.size = sizeof config;
    config.layout = WIS_LAYOUT_LATLONG;
    config.width = light->width;
    config.height = light->height;
    config.channels = 3;
    config.format = WIS_FORMAT_F32;
    config.filter = WIS_FILTER_BILINEAR;
    config.flags = flags;
    config.pixels = light->texels;
    config.world_from_map = light_world_from_map;
    return config;
}

/* Items of the last pass are few and long. */
static uint32_t items_per_job(const Build *b) { return b->pass + 1 < WIS_ENVIRONMENT_PASSES ? ITEMS_PER_JOB : 1; }

static wis_status run_items(void *shared, unsigned worker, size_t job) {
    Build *b = shared;
    uint32_t first = (uint32_t)job * items_per_job(b);
    uint32_t left = b->items[b->pass] - first;
    uint32_t count = left < items_per_job(b) ? left : items_per_job(b);
    /* From the third pass on the environment itself is used. */
    bool writes = b->pass >= 2;
    (void)worker;
    return wis_environment_run(&b->config, writes ? b->memory : NULL, writes ? b->size.bytes : 0, b->scratch,
                               b->size.scratch_bytes, b->pass, first, count, NULL);
}

static wis_status build_in(Build *b, const wis_environment **handle, unsigned threads) {
    wis_status status = wis_environment_begin(&b->config, b->scratch, b->size.scratch_bytes, b->items, NULL);
    for (b->pass = 0; b->pass < WIS_ENVIRONMENT_PASSES && status == WIS_OK; b->pass++) {
        size_t jobs = (b->items[b->pass] + items_per_job(b) - 1) / items_per_job(b);
        status = parallel_for(threads, jobs, run_items, b);
    }
    if (status == WIS_OK) {
        status = wis_environment_finish(&b->config, b->memory, b->size.bytes, b->scratch, b->size.scratch_bytes, handle,
                                        NULL);
    }
    return status;
}

wis_status environment_build(Environment *out, const Light *light, uint32_t flags, unsigned threads) {
    Build b = {0};
    wis_status status;
    b.config = describe(light, flags);
    status = wis_environment_size(&b.config, &b.size, NULL);
    if (status != WIS_OK) {
        return status;
    }
    b.memory = out->memory = malloc(b.size.bytes);
    b.scratch = malloc(b.size.scratch_bytes);
    status = WIS_MEMORY_TOO_SMALL;
    if (b.memory != NULL && b.scratch != NULL) {
        status = build_in(&b, &out->handle, threads);
    }
    free(b.scratch);
    return status;
}

void environment_free(Environment *environment) {
    free(environment->memory);
    environment->memory = NULL;
}
