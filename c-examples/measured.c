/* A BRDF that only the renderer can evaluate, as a table, and a wave of hits that is sampled in one call. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "wis_wavelets.h"

#define WIDTH 128u
#define HEIGHT 64u
#define SLICES 16u
#define DEPTH 6u
#define PIXELS (1u << (2u * DEPTH))
#define HITS 64u
#define PASSES 256u
#define PI 3.14159265f

static float map[HEIGHT][WIDTH];

static void check(wis_status status) {
    if (status != WIS_OK) {
        fprintf(stderr, "%s\n", wis_status_string(status));
        exit(EXIT_FAILURE);
    }
}

static void *allocate(size_t bytes) {
    void *memory = malloc(bytes);
    if (memory == NULL && bytes > 0) {
        fputs("out of memory\n", stderr);
        exit(EXIT_FAILURE);
    }
    return memory;
}

/* BRDF x cosine in a frame whose normal is +z: yours, measured; here a lobe about the mirror direction. */
static float brdf(const float wo[3], const float wi[3]) {
    const float mirror = wi[2] * wo[2] - wi[0] * wo[0] - wi[1] * wo[1];
    if (wi[2] <= 0.0f || wo[2] <= 0.0f) return 0.0f;
    return (0.2f + 3.0f * powf(mirror > 0.0f ? mirror : 0.0f, 40.0f)) * wi[2];
}

/* One tree for each elevation of the view; returns the bytes of all. */
static size_t tabulate(const wis_tree *slice[SLICES]) {
    float *wi = allocate(PIXELS * 3 * sizeof(float)), *pixels = allocate(PIXELS * sizeof(float));
    size_t bytes = 0;
    for (uint32_t k = 0; k < SLICES; k++) {
        const float middle[2] = {0.5f, 0.5f};
        float wo[3];
        check(wis_wavelet_table_directions(k, SLICES, DEPTH, middle, wo, wi, 0));
        for (uint32_t i = 0; i < PIXELS; i++) pixels[i] = brdf(wo, wi + 3 * i);
        wis_tree_config config = {0};
        config.size = sizeof config;
        config.dimensions = 2;
        config.depth = DEPTH;
        config.error_budget = 0.001f;
        config.pixels = pixels;
        wis_memory_size size;
        wis_tree_info info = {sizeof info, 0, 0, 0, 0, 0, 0, 0};
        check(wis_tree_size(&config, &size, NULL));
        void *memory = allocate(size.bytes), *scratch = allocate(size.scratch_bytes);
        check(wis_tree_init(&config, memory, size.bytes, scratch, size.scratch_bytes, &slice[k], &info, NULL));
        free(scratch);
        bytes += info.bytes;
    }
    free(wi);
    free(pixels);
    return bytes;
}

static const wis_wavelet_light *build_light(void) {
    for (uint32_t y = 0; y < HEIGHT; y++) {
        for (uint32_t x = 0; x < WIDTH; x++) map[y][x] = y < HEIGHT / 2 ? 0.5f : 0.1f;
    }
    map[14][30] = 800.0f;
    wis_wavelet_light_config config = {0};
    config.size = sizeof config;
    config.flags = WIS_WAVELET_LIGHT_NEAREST;
    config.layout = WIS_LAYOUT_LATLONG;
    config.width = WIDTH;
    config.height = HEIGHT;
    config.channels = 1;
    config.format = WIS_FORMAT_F32;
    config.storage = WIS_STORAGE_PYRAMID;
    config.pixels = map;
    wis_memory_size size;
    check(wis_wavelet_light_size(&config, &size, NULL));
    void *memory = allocate(size.bytes), *scratch = allocate(size.scratch_bytes);
    const wis_wavelet_light *environment;
    check(wis_wavelet_light_init(&config, memory, size.bytes, scratch, size.scratch_bytes, &environment, NULL, NULL));
    free(scratch);
    return environment;
}

static float radiance(const float wi[3]) {
    const float phi = atan2f(wi[1], wi[0]), u = phi < 0.0f ? phi / (2.0f * PI) + 1.0f : phi / (2.0f * PI);
    const uint32_t x = (uint32_t)(u * WIDTH), y = (uint32_t)(acosf(fminf(fmaxf(wi[2], -1.0f), 1.0f)) / PI * HEIGHT);
    return map[y < HEIGHT ? y : HEIGHT - 1][x < WIDTH ? x : WIDTH - 1];
}

/* The integral for one hit, by all texels in 8 x 8 parts. */
static double sum_over_map(const float wo[3]) {
    double sum = 0.0;
    for (uint32_t i = 0; i < 8 * HEIGHT; i++) {
        const float theta = PI * ((float)i + 0.5f) / (8 * HEIGHT);
        for (uint32_t j = 0; j < 8 * WIDTH; j++) {
            const float phi = 2.0f * PI * ((float)j + 0.5f) / (8 * WIDTH);
            const float wi[3] = {sinf(theta) * cosf(phi), sinf(theta) * sinf(phi), cosf(theta)};
            sum += (double)(map[i / 8][j / 8] * brdf(wo, wi) * sinf(theta));
        }
    }
    return sum * 2.0 * (double)(PI * PI) / (64.0 * WIDTH * HEIGHT);
}

int main(void) {
    const wis_wavelet_light *environment = build_light();
    const wis_tree *slice[SLICES];
    const size_t table_bytes = tabulate(slice);
    const wis_wavelet_table table = {sizeof table, SLICES, slice, {NULL, NULL, NULL}};

    /* A wave of hits: their products in one block. */
    wis_wavelet_product_config config = {0};
    config.size = sizeof config;
    config.table = &table;
    wis_memory_size size;
    check(wis_wavelet_product_size(&config, &size, NULL));
    char *memory = allocate(HITS * size.bytes);
    const wis_wavelet_product *product[HITS];
    wis_wavelet_query query = {0};
    query.size = sizeof query;
    query.lobe_count = 1;
    query.normal[2] = 1.0f;
    query.lobe[0].kind = WIS_WAVELET_LOBE_TABLE;
    for (int c = 0; c < 3; c++) query.lobe[0].weight[c] = 1.0f;
    float wo[HITS][3];
    double expected = 0.0;
    for (uint32_t i = 0; i < HITS; i++) {
        const float theta = 0.1f + 1.2f * (float)i / HITS, phi = 0.4f * (float)i;
        wo[i][0] = sinf(theta) * cosf(phi);
        wo[i][1] = sinf(theta) * sinf(phi);
        wo[i][2] = cosf(theta);
        for (int c = 0; c < 3; c++) query.wo[c] = wo[i][c];
        check(wis_wavelet_product_prepare(environment, &config, 1, &query, memory + i * size.bytes, size.bytes, &product[i],
                                          NULL));
        expected += i % 8 == 0 ? sum_over_map(wo[i]) : 0.0;
    }

    /* Samples of some of them, all passes of a hit in one call. */
    double estimate = 0.0;
    for (uint32_t i = 0; i < HITS; i += 8) {
        static float u[PASSES][2];
        static wis_drawn drawn[PASSES];
        check(wis_points_sobol(wis_pixel_seed(i, 0, 0), 0, PASSES, u[0], 0));
        check(wis_wavelet_sample(environment, product[i], NULL, PASSES, u[0], 0, drawn, 0));
        for (uint32_t pass = 0; pass < PASSES; pass++) {
            const wis_drawn *d = &drawn[pass];
            if (d->pdf > 0.0f) estimate += (double)(brdf(wo[i], d->wi) * radiance(d->wi) / d->pdf) / PASSES;
        }
    }
    printf("a table of %u slices takes %lu kB; estimate %.4f, sum over the map %.4f\n", SLICES,
           (unsigned long)(table_bytes / 1000), estimate / 8.0, expected / 8.0);
    const int close = fabs(estimate / expected - 1.0) < 0.05;
    for (uint32_t k = 0; k < SLICES; k++) free((void *)slice[k]);
    free(memory);
    free((void *)environment);
    return close ? EXIT_SUCCESS : EXIT_FAILURE;
}
