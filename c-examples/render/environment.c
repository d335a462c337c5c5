/* Building the environment: begin says how many items each of its three passes has, threads share the items. */
#include "environment.h"

#include <stdlib.h>

#include "parallel.h"

#define ITEMS_PER_JOB 16u
#define PASSES 3u

typedef struct Build {
    wis_environment_config config;
    wis_memory_size size;
    void *memory, *scratch;
    uint32_t items[PASSES];
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

static wis_status run_items(void *shared, unsigned worker, size_t job) {
    Build *b = shared;
    uint32_t first = (uint32_t)job * ITEMS_PER_JOB;
    uint32_t left = b->items[b->pass] - first;
    uint32_t count = left < ITEMS_PER_JOB ? left : ITEMS_PER_JOB;
    /* Only the last pass writes the environment itself. */
    bool writes = b->pass == PASSES - 1;
    (void)worker;
    return wis_environment_run(&b->config, writes ? b->memory : NULL, writes ? b->size.bytes : 0, b->scratch,
                               b->size.scratch_bytes, b->pass, first, count, NULL);
}

static wis_status build_in(Build *b, const wis_environment **handle, unsigned threads) {
    wis_status status = wis_environment_begin(&b->config, b->scratch, b->size.scratch_bytes, b->items, NULL);
    for (b->pass = 0; b->pass < PASSES && status == WIS_OK; b->pass++) {
        size_t jobs = (b->items[b->pass] + ITEMS_PER_JOB - 1) / ITEMS_PER_JOB;
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
