/* What the consumers in C sample: a dim sky with one bright texel. Needs no C library. */
#ifndef SCENE_H
#define SCENE_H
#include <wis_wavelets.h>

enum { SCENE_WIDTH = 16, SCENE_HEIGHT = 8, SCENE_FLOATS = 3 * SCENE_WIDTH * SCENE_HEIGHT, SCENE_SAMPLES = 64 };

static void scene_paint(float pixels[SCENE_FLOATS]) {
    for (int i = 0; i < SCENE_FLOATS; i++) pixels[i] = 0.5f;
    for (int c = 0; c < 3; c++) pixels[3 * (2 * SCENE_WIDTH + 5) + c] = 100.0f;
}

static wis_environment_config scene_environment(const float pixels[SCENE_FLOATS]) {
    wis_environment_config config = {0};
    config.size = sizeof config;
    config.layout = WIS_LAYOUT_LATLONG;
    config.width = SCENE_WIDTH;
    config.height = SCENE_HEIGHT;
    config.channels = 3;
    config.format = WIS_FORMAT_F32;
    config.pixels = pixels;
    return config;
}

/* The light over the octahedral square of the world. */
static wis_tree_config scene_tree(const wis_environment *environment) {
    wis_tree_config config = {0};
    config.size = sizeof config;
    config.source = WIS_TREE_ENVIRONMENT;
    config.depth = 4;
    config.environment = environment;
    return config;
}

/* 1 if each sample has a positive pdf, its direction leads back, and its point has the same bits of pdf. */
static int scene_densities_agree(const wis_tree *tree) {
    for (int i = 0; i < SCENE_SAMPLES; i++) {
        const float u[2] = {(i + 0.5f) / SCENE_SAMPLES, (i * 37 % SCENE_SAMPLES + 0.5f) / SCENE_SAMPLES};
        float point[2], back[2], wi[3], pdf = 0.0f, again = 0.0f;
        if (wis_tree_sample(tree, u, point, &pdf) != WIS_OK) return 0;
        if (wis_tree_pdf(tree, point, &again) != WIS_OK) return 0;
        if (wis_square_direction(point, 0, wi) != WIS_OK || wis_square_point(wi, 0, back) != WIS_OK) return 0;
        for (int k = 0; k < 2; k++) {
            const float off = back[k] - point[k];
            if (off > 1e-5f || off < -1e-5f) return 0;
        }
        if (!(pdf > 0.0f) || pdf != again) return 0;
    }
    return 1;
}

#endif
