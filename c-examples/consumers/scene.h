/* What the consumers in C sample: a dim sky with one bright texel above a Lambert surface. Needs no C library. */
#ifndef SCENE_H
#define SCENE_H
#include <wis_wavelets.h>

enum { SCENE_WIDTH = 16, SCENE_HEIGHT = 8, SCENE_FLOATS = 3 * SCENE_WIDTH * SCENE_HEIGHT, SCENE_SAMPLES = 64 };

static void scene_paint(float pixels[SCENE_FLOATS]) {
    for (int i = 0; i < SCENE_FLOATS; i++) pixels[i] = 0.5f;
    for (int c = 0; c < 3; c++) pixels[3 * (2 * SCENE_WIDTH + 5) + c] = 100.0f;
}

static wis_wavelet_light_config scene_environment(const float pixels[SCENE_FLOATS]) {
    wis_wavelet_light_config config = {0};
    config.size = sizeof config;
    config.layout = WIS_LAYOUT_LATLONG;
    config.width = SCENE_WIDTH;
    config.height = SCENE_HEIGHT;
    config.channels = 3;
    config.format = WIS_FORMAT_F32;
    config.storage = WIS_STORAGE_PYRAMID;
    config.pixels = pixels;
    return config;
}

static wis_wavelet_query scene_query(void) {
    wis_wavelet_query query = {0};
    query.size = sizeof query;
    query.lobe_count = 1;
    query.normal[2] = 1.0f;
    query.tangent[0] = 1.0f;
    query.wo[0] = 0.6f;
    query.wo[2] = 0.8f;
    query.lobe[0].kind = WIS_WAVELET_LOBE_LAMBERT;
    for (int c = 0; c < 3; c++) query.lobe[0].weight[c] = 0.8f;
    return query;
}

static wis_wavelet_product_config scene_product(void) {
    wis_wavelet_product_config config = {0};
    config.size = sizeof config;
    return config;
}

/* 1 if each sample has a positive pdf and pdf(wi) answers the same bits. */
static int scene_densities_agree(const wis_wavelet_light *environment, const wis_wavelet_product *product) {
    for (int i = 0; i < SCENE_SAMPLES; i++) {
        const float u[2] = {(i + 0.5f) / SCENE_SAMPLES, (i * 37 % SCENE_SAMPLES + 0.5f) / SCENE_SAMPLES};
        wis_drawn sample;
        float pdf = 0.0f;
        if (wis_wavelet_sample(environment, product, 0, 1, u, 0, &sample, 0) != WIS_OK) return 0;
        if (wis_wavelet_pdf(environment, product, 0, 1, sample.wi, 0, &pdf, 0) != WIS_OK) return 0;
        if (!(sample.pdf > 0.0f) || sample.pdf != pdf) return 0;
    }
    return 1;
}

#endif
