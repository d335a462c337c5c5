/* Wavelet importance sampling at a shading point: a rotated map x a tabulated BRDF as trees, their product, and samples of it. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "wis_wavelets.h"

#define WIDTH 64u
#define HEIGHT 32u
#define DEPTH 6u
#define CELLS (1u << 2 * DEPTH)
#define SLICES 16u
#define SAMPLES 8u
#define FOUR_PI 12.5663706f

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

/* A tree in memory of its own, which begins where the tree does; `average` may be null. */
static const wis_tree *build(const wis_tree_config *config, double *average) {
    wis_memory_size size;
    check(wis_tree_size(config, &size, NULL));
    void *memory = allocate(size.bytes), *scratch = allocate(size.scratch_bytes);
    const wis_tree *tree;
    wis_tree_info info = {sizeof info, 0, 0, 0, 0, 0, 0, 0};
    check(wis_tree_init(config, memory, size.bytes, scratch, size.scratch_bytes, &tree, &info, NULL));
    free(scratch);
    if (average) *average = info.average;
    return tree;
}

static float dot(const float a[3], const float b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* A glossy BRDF x cosine about a normal of +z: Phong's lobe over a little of Lambert's. */
static float brdf_cosine(const float wo[3], const float wi[3]) {
    const float mirror[3] = {-wo[0], -wo[1], wo[2]};
    const float cosine = dot(mirror, wi);
    if (wi[2] <= 0.0f) return 0.0f;
    return wi[2] * (0.1f + (cosine > 0.0f ? 2.0f * powf(cosine, 40.0f) : 0.0f));
}

/* A slice of the table: BRDF x cosine of a view over the square about its mirror direction (Clarberg et al. 2005, Section 5). */
static const wis_tree *build_slice(uint32_t slice) {
    static float values[CELLS];
    const float angle = ((float)slice + 0.5f) / SLICES * 1.57079633f, up[3] = {0.0f, 0.0f, 1.0f};
    const float wo[3] = {sinf(angle), 0.0f, cosf(angle)};
    uint32_t slices[2];
    double weights[2];
    float frame[9], wi[3];
    check(wis_table_view(SLICES, up, wo, slices, weights, frame));
    for (uint32_t k = 0; k < CELLS; k++) {
        const float point[2] = {((float)(k >> DEPTH) + 0.5f) / (1u << DEPTH), ((float)(k % (1u << DEPTH)) + 0.5f) / (1u << DEPTH)};
        check(wis_square_direction(point, frame, wi));
        values[k] = 1e-4f + brdf_cosine(wo, wi);
    }
    wis_tree_config config = {0};
    config.size = sizeof config;
    config.source = WIS_TREE_PIXELS;
    config.dimensions = 2;
    config.depth = DEPTH;
    config.error_budget = 0.001f;
    config.pixels = values;
    return build(&config, NULL);
}

int main(void) {
    /* 1. A light of wis.h: a lat-long map of luminance, +z up. Here a dim sky with one bright texel. */
    static float map[HEIGHT][WIDTH];
    for (uint32_t y = 0; y < HEIGHT; y++) {
        for (uint32_t x = 0; x < WIDTH; x++) {
            map[y][x] = y < HEIGHT / 2 ? 0.5f : 0.1f;
        }
    }
    map[8][12] = 500.0f;
    wis_environment_config light = {0};
    light.size = sizeof light;
    light.layout = WIS_LAYOUT_LATLONG;
    light.filter = WIS_FILTER_BILINEAR;
    light.width = WIDTH;
    light.height = HEIGHT;
    light.channels = 1;
    light.format = WIS_FORMAT_F32;
    light.pixels = map;
    wis_memory_size size;
    check(wis_environment_size(&light, &size, NULL));
    void *memory = allocate(size.bytes), *scratch = allocate(size.scratch_bytes);
    const wis_environment *environment;
    check(wis_environment_init(&light, memory, size.bytes, scratch, size.scratch_bytes, &environment, NULL));
    free(scratch);

    /* 2. A shading point: the slices beside its view, and the frame of the trees about its mirror direction. */
    const float normal[3] = {0.0f, 0.0f, 1.0f}, wo[3] = {0.6f, 0.0f, 0.8f};
    uint32_t slice[2];
    double weights[2];
    float world_from_tree[9];
    check(wis_table_view(SLICES, normal, wo, slice, weights, world_from_tree));

    /* 3. The map about that direction, and the BRDF between the two tabulated views beside wo. */
    wis_tree_config config = {0};
    config.size = sizeof config;
    config.source = WIS_TREE_ENVIRONMENT;
    config.depth = DEPTH;
    config.error_budget = 0.001f;
    config.environment = environment;
    config.world_from_tree = world_from_tree;
    const wis_tree *rotated = build(&config, NULL);
    const wis_tree *slices[2] = {build_slice(slice[0]), build_slice(slice[1])};
    config.source = WIS_TREE_BLEND;
    config.tree_count = 2;
    config.trees = slices;
    config.weight = weights;
    const wis_tree *brdf = build(&config, NULL);

    /* 4. Their product. Its average over the square, times 4 pi, is the light that the point reflects if nothing casts a shadow. */
    const wis_tree *factors[2] = {rotated, brdf};
    config.source = WIS_TREE_PRODUCT;
    config.trees = factors;
    double average, integral;
    const wis_tree *product = build(&config, &average);
    check(wis_tree_product_integral(rotated, brdf, &integral));
    printf("reflected luminance: %.4f, as an inner product: %.4f\n", FOUR_PI * average, FOUR_PI * integral);

    /* 5. Points of a well-spread set are warped in place: samples of the product, as points of the square. */
    float points[SAMPLES][2];
    uint32_t index[SAMPLES];
    for (uint32_t i = 0; i < SAMPLES; i++) index[i] = i;
    check(wis_points_sobol(0, 0, SAMPLES, points[0], sizeof points[0]));
    check(wis_warp_in_place(product, points[0], index, SAMPLES, NULL));

    /* 6. Their directions, densities per steradian, and the way back. */
    for (uint32_t i = 0; i < SAMPLES; i++) {
        float wi[3], point[2], pdf, found, u[2];
        check(wis_square_direction(points[i], world_from_tree, wi));
        check(wis_tree_pdf(product, points[i], &pdf));
        check(wis_square_point(wi, world_from_tree, point));
        check(wis_tree_pdf(product, point, &found));
        check(wis_tree_invert(product, points[i], u));
        printf("%u: wi (% .4f, % .4f, % .4f)  pdf %9.4f  pdf(wi) %9.4f  u (%.4f, %.4f)\n", (unsigned)index[i], wi[0], wi[1],
               wi[2], pdf / FOUR_PI, found / FOUR_PI, u[0], u[1]);
    }
    free((void *)(uintptr_t)product);
    free((void *)(uintptr_t)brdf);
    for (uint32_t k = 0; k < 2; k++) free((void *)(uintptr_t)slices[k]);
    free((void *)(uintptr_t)rotated);
    free(memory);
    return EXIT_SUCCESS;
}
