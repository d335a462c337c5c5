/* Direct light at one point: the light, a sampler, a material, and the rays to trace. */
#include <stdio.h>
#include <stdlib.h>

#include "direct.h"

#define WIDTH 64u
#define HEIGHT 32u
#define RAYS 4u
#define HITS 4096u

static wis_diagnostic fault; /* of calls on a sampler: wis_sampler_fault(sampler) */

static void check(wis_status status) {
    if (status != WIS_OK) {
        const char *field = fault.field != NULL ? fault.field : "";
        fprintf(stderr, "%s: argument %u %s\n", wis_status_string(status), (unsigned)fault.argument, field);
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

/* The renderer's own side: its map, its BSDF and its shadow rays. */
static float map[HEIGHT][WIDTH];

static void make_map(void) {
    for (uint32_t y = 0; y < HEIGHT; y++) {
        for (uint32_t x = 0; x < WIDTH; x++) {
            map[y][x] = 1.0f;
        }
    }
}

static float radiance(const float wi[3]) {
    (void)wi;
    return 1.0f; /* what make_map put into every texel */
}

static float bsdf_times_cosine(const float normal[3], const float wi[3]) {
    const float cosine = normal[0] * wi[0] + normal[1] * wi[1] + normal[2] * wi[2];
    return cosine > 0.0f ? 0.8f / 3.14159265f * cosine : 0.0f;
}

/* A wall hides the half of the sky with x < 0. */
static int occluded(const float wi[3]) { return wi[0] < 0.0f; }

struct Reflected {
    const wis_point *point;
    double light;
};

static void add_light(Reflected *sum, const float wi[3], float weight) {
    if (!occluded(wi)) {
        sum->light += bsdf_times_cosine(sum->point->normal, wi) * radiance(wi) * weight;
    }
}

int main(void) {
    /* What describes the light, a thread's sampler, a material and a hit. */
    make_map();
    wis_environment_config light = {0};
    light.size = sizeof light;
    light.layout = WIS_LAYOUT_LATLONG;
    light.width = WIDTH;
    light.height = HEIGHT;
    light.channels = 1;
    light.format = WIS_FORMAT_F32;
    light.filter = WIS_FILTER_BILINEAR;
    light.pixels = map;
    wis_sampler_config config = {0};
    config.size = sizeof config;
    wis_material material = {0};
    material.size = sizeof material;
    material.lobe_count = 1;
    material.lobe[0].kind = WIS_LOBE_LAMBERT;
    wis_point point = {0};
    point.size = sizeof point;
    point.normal[2] = 1.0f;
    point.wo[0] = 0.6f;
    point.wo[2] = 0.8f;
    point.weight[0][0] = point.weight[0][1] = point.weight[0][2] = 0.8f;

    const wis_environment *environment;
    wis_sampler *sampler;
    wis_memory_size size;
    wis_ray ray[RAYS];
    uint32_t pixel = 7;
    Reflected sum = {&point, 0.0};

    /* Once the light, in your memory; for each thread a sampler; for each material the shapes of its lobes. */
    check(wis_environment_size(&light, &size, &fault));
    void *memory = allocate(size.bytes), *scratch = allocate(size.scratch_bytes); /* scratch: for the build alone */
    check(wis_environment_init(&light, memory, size.bytes, scratch, size.scratch_bytes, &environment, &fault));
    check(wis_sampler_size(&config, &size, &fault));
    void *sampler_memory = allocate(size.bytes);
    check(wis_sampler_init(&config, sampler_memory, size.bytes, &sampler, &fault));
    check(wis_material_init(&material, &fault));
    check(wis_sampler_begin_pixel(sampler)); /* for each pixel */
    point.seed = pixel;                      /* any number that tells pixels apart */
    point.material = &material;              /* at each hit, with normal, wo, and weight and f0 of each lobe */
    for (point.sample = 0; point.sample < HITS; point.sample++) /* the hits of this pixel, over all its samples */
        check(direct_light(sampler, environment, &point, RAYS, ray, &sum));
    printf("reflected light: %.3f (exactly 0.400)\n", sum.light / HITS);

    free(scratch);
    free(sampler_memory);
    free(memory);
    return EXIT_SUCCESS;
}
