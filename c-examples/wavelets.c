/* Wavelet importance sampling: the light as a sparse tree, its product with a BRDF, samples, estimate. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "wis_wavelets.h"

#define WIDTH 64u
#define HEIGHT 32u
#define SAMPLES 8u

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

int main(void) {
    /* 1. A light: a lat-long map of luminance, +z up. Here a dim sky with one bright texel. */
    static float map[HEIGHT][WIDTH];
    for (uint32_t y = 0; y < HEIGHT; y++) {
        for (uint32_t x = 0; x < WIDTH; x++) {
            map[y][x] = y < HEIGHT / 2 ? 0.5f : 0.1f;
        }
    }
    map[8][12] = 500.0f;

    /* 2. Its environment, built once in your memory and then shared by all threads. */
    wis_wavelet_light_config config = {0};
    config.size = sizeof config;
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

    /* 3. A shading point in world space: normal, direction to the eye, BRDF. */
    wis_wavelet_query query = {0};
    query.size = sizeof query;
    query.lobe_count = 1;
    query.normal[2] = 1.0f;
    query.tangent[0] = 1.0f;
    query.wo[0] = -0.6f;
    query.wo[2] = 0.8f;
    query.lobe[0].kind = WIS_WAVELET_LOBE_GGX;
    query.lobe[0].a = query.lobe[0].b = 0.3f;
    for (int c = 0; c < 3; c++) {
        query.lobe[0].weight[c] = 1.0f;
        query.lobe[0].f0[c] = 0.9f;
    }

    /* 4. The product of light, BRDF and cosine at that point, in memory of this thread. */
    wis_wavelet_product_config product_config = {0};
    product_config.size = sizeof product_config;
    check(wis_wavelet_product_size(&product_config, &size, NULL));
    void *product_memory = allocate(size.bytes);
    const wis_wavelet_product *product;
    check(wis_wavelet_product_prepare(environment, &product_config, 1, &query, product_memory, size.bytes, &product, NULL));

    /* 5. Samples: directions in world space and their densities per solid angle. */
    float u[SAMPLES][2];
    check(wis_points_sobol(wis_pixel_seed(0, 0, 0), 0, SAMPLES, u[0], sizeof u[0]));
    wis_drawn drawn[SAMPLES];
    float pdf[SAMPLES];
    check(wis_wavelet_sample(environment, product, NULL, SAMPLES, u[0], 0, drawn, 0));
    check(wis_wavelet_pdf(environment, product, NULL, SAMPLES, drawn[0].wi, sizeof drawn[0], pdf, 0));
    for (uint32_t i = 0; i < SAMPLES; i++) {
        const wis_drawn *sample = &drawn[i];
        printf("wi (% .4f, % .4f, % .4f)  pdf %9.4f  pdf(wi) %s\n", sample->wi[0], sample->wi[1], sample->wi[2],
               sample->pdf, memcmp(&pdf[i], &sample->pdf, sizeof pdf[i]) == 0 ? "the same bits" : "differs");
    }

    /* 6. The light that the point would reflect if nothing cast a shadow. */
    wis_wavelet_product_info info = {0};
    info.size = sizeof info;
    check(wis_wavelet_product_describe(environment, product, &info));
    printf("estimate of the reflected luminance: %.4f\n", info.estimate);

    free(product_memory);
    free(memory);
    return EXIT_SUCCESS;
}
