/* What every host makes the library do: an environment, rays at a hit, products, samples; and a hash of all results. */
#ifndef WORK_H
#define WORK_H
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <wis.h>

enum { WORK_WIDTH = 64, WORK_HEIGHT = 32, WORK_RAYS = 4, WORK_HITS = 64, WORK_SAMPLES = 64 };

/* The functions of one copy of the library: linked, or found by dlsym. */
#define WORK_FUNCTIONS(X)                                                                                              \
    X(wis_environment_size) X(wis_environment_init) X(wis_environment_open) X(wis_sampler_size) X(wis_sampler_init)    \
    X(wis_sampler_begin_pixel) X(wis_material_init) X(wis_direct) X(wis_product_size) X(wis_product_prepare)           \
    X(wis_sample) X(wis_pdf) X(wis_invert) X(wis_check) X(wis_status_string)
#define WORK_FIELD(name) __typeof__(name) *name;
typedef struct work_library { WORK_FUNCTIONS(WORK_FIELD) } work_library;

/* All memory that the work needs, given by the host. */
typedef struct work_memory {
    void *environment, *scratch, *sampler, *product;
    wis_memory_size environment_size, sampler_size, product_size;
} work_memory;

static float work_map[WORK_HEIGHT][WORK_WIDTH];

static void work_paint(void) {
    for (int y = 0; y < WORK_HEIGHT; y++)
        for (int x = 0; x < WORK_WIDTH; x++) work_map[y][x] = 0.25f + (float)((x * 7 + y * 13) % 5);
    work_map[6][9] = 5000.0f;
}

static const wis_environment_config work_light = {
    .size = sizeof(wis_environment_config), .layout = WIS_LAYOUT_LATLONG, .width = WORK_WIDTH, .height = WORK_HEIGHT, .channels = 1,
    .format = WIS_FORMAT_F32, .filter = WIS_FILTER_NEAREST, .pixels = work_map};
static const wis_sampler_config work_sampling = {.size = sizeof(wis_sampler_config)};
static const wis_product_config work_preparing = {.size = sizeof(wis_product_config)};

/* The sizes of the blocks; 0 if a call failed. */
static int work_measure(const work_library *wis, work_memory *memory) {
    return wis->wis_environment_size(&work_light, &memory->environment_size, NULL) == WIS_OK &&
           wis->wis_sampler_size(&work_sampling, &memory->sampler_size, NULL) == WIS_OK &&
           wis->wis_product_size(&work_preparing, &memory->product_size, NULL) == WIS_OK;
}

static inline int work_allocate(const work_library *wis, work_memory *memory) {
    if (!work_measure(wis, memory)) return 0;
    memory->environment = malloc(memory->environment_size.bytes);
    memory->scratch = malloc(memory->environment_size.scratch_bytes);
    memory->sampler = malloc(memory->sampler_size.bytes);
    memory->product = malloc(memory->product_size.bytes);
    return memory->environment && memory->scratch && memory->sampler && memory->product;
}

static inline void work_release(work_memory *memory) {
    free(memory->environment);
    free(memory->scratch);
    free(memory->sampler);
    free(memory->product);
}

static uint64_t work_hash(uint64_t hash, const void *bytes, size_t count) {
    const unsigned char *byte = (const unsigned char *)bytes;
    for (size_t i = 0; i < count; i++) hash = (hash ^ byte[i]) * 1099511628211u;
    return hash;
}

/* The light as it was built, to be compared with itself. */
static inline int work_white(void *user, size_t count, const float *wi, float *rgb) {
    (void)user;
    (void)wi;
    for (size_t i = 0; i < 3 * count; i++) rgb[i] = 1.0f;
    return 0;
}

static const wis_environment *work_build(const work_library *wis, work_memory *memory) {
    const wis_environment *environment = NULL;
    (void)wis->wis_environment_init(&work_light, memory->environment, memory->environment_size.bytes, memory->scratch,
                                    memory->environment_size.scratch_bytes, &environment, NULL);
    return environment;
}

/* The sampler of a block, or null. */
static inline wis_sampler *work_sampler(const work_library *wis, work_memory *memory) {
    wis_sampler *sampler = NULL;
    (void)wis->wis_sampler_init(&work_sampling, memory->sampler, memory->sampler_size.bytes, &sampler, NULL);
    return sampler;
}

/* What a renderer does at hits, with an environment that any copy of the library built; 0: a call failed. */
static uint64_t work_render(const work_library *wis, const wis_environment *environment, work_memory *memory) {
    wis_material material = {.size = sizeof material, .lobe_count = 2,
                             .lobe = {{.kind = WIS_LOBE_LAMBERT}, {.kind = WIS_LOBE_GGX, .a = 0.1f, .b = 0.1f}}};
    wis_point point = {.size = sizeof point, .material = &material, .normal = {0, 0, 1}, .wo = {0.6f, 0, 0.8f},
                       .weight = {{0.5f, 0.5f, 0.5f}, {0.5f, 0.5f, 0.5f}}, .f0 = {{0}, {0.04f, 0.04f, 0.04f}}};
    wis_sampler *sampler = work_sampler(wis, memory);
    uint64_t hash = 14695981039346656037u;
    if (!sampler || wis->wis_material_init(&material, NULL) != WIS_OK || wis->wis_sampler_begin_pixel(sampler) != WIS_OK)
        return 0;
    for (uint32_t hit = 0; hit < WORK_HITS; hit++) {
        wis_ray ray[WORK_RAYS];
        uint32_t count = 0;
        point.sample = hit;
        if (wis->wis_direct(sampler, environment, &point, WORK_RAYS, ray, &count) != WIS_OK) return 0;
        hash = work_hash(hash, ray, count * sizeof ray[0]);
    }
    size_t offset = 0, used = 0;
    if (wis->wis_product_prepare(sampler, environment, &work_preparing, 1, &point, memory->product, memory->product_size.bytes,
                                 &offset, &used) != WIS_OK)
        return 0;
    const wis_product *product = (const wis_product *)memory->product;
    for (int i = 0; i < WORK_SAMPLES; i++) {
        const float u[2] = {(i + 0.5f) / WORK_SAMPLES, (i * 37 % WORK_SAMPLES + 0.5f) / WORK_SAMPLES};
        wis_drawn drawn;
        float pdf = 0.0f, back[2] = {0.0f, 0.0f};
        uint8_t status = WIS_OK;
        if (wis->wis_sample(sampler, environment, product, 1, u, 0, &drawn, 0) != WIS_OK ||
            wis->wis_pdf(sampler, environment, product, 1, drawn.wi, 0, &pdf, 0) != WIS_OK ||
            wis->wis_invert(sampler, environment, NULL, 1, drawn.wi, 0, back, 0, &status) != WIS_OK || pdf != drawn.pdf)
            return 0;
        hash = work_hash(hash, &drawn, sizeof drawn);
    }
    return hash;
}

/* A comparison with a light that is not the one that was built: it needs more stack than a fiber has. */
static inline int work_compare(const work_library *wis, const wis_environment *environment, work_memory *memory) {
    const wis_check_config compared = {.size = sizeof compared, .radiance = work_white};
    wis_check_info found = {.size = sizeof found};
    wis_sampler *sampler = work_sampler(wis, memory);
    return sampler && wis->wis_check(sampler, environment, &compared, &found) == WIS_OK && found.cause == WIS_CAUSE_OTHER;
}

/* Everything, on the heap; 0: a call failed. */
static inline uint64_t work_all(const work_library *wis) {
    work_memory memory;
    uint64_t hash = 0;
    memset(&memory, 0, sizeof memory);
    if (work_allocate(wis, &memory)) {
        const wis_environment *environment = work_build(wis, &memory);
        if (environment && work_compare(wis, environment, &memory)) hash = work_render(wis, environment, &memory);
    }
    work_release(&memory);
    return hash;
}

/* The copy that is linked. */
#define WORK_LINKED(name) name,
#define WORK_LIBRARY {WORK_FUNCTIONS(WORK_LINKED)}

#endif
