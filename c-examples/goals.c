/* Calls for a machine that counts: goals WIDTH lambert|ggx|narrow|mix CALLS FILE direct|prepare|sample|pdf BATCH
 *
 * wis_direct: one ray of 16 (Lambert) or 32 (GGX 0.2) candidates under a sky with a sun, WIDTH x WIDTH / 2 texels. The others: a product
 * at as many points, and BATCH directions of each. The environment is built once and kept in FILE, so that what is counted is calls.
 * Prints where environment and sampler stand. scripts/check-instructions.sh runs it. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "wis.h"

static void fail(const char *why) {
    fprintf(stderr, "goals: %s\n", why);
    exit(EXIT_FAILURE);
}

static void check(wis_status status) {
    if (status != WIS_OK) fail(wis_status_string(status));
}

/* At the beginning of a page, so that lines are the same in every run. */
static void *allocate(size_t bytes) {
    const size_t page = 4096;
    char *memory = malloc(bytes + page);
    if (memory == NULL) fail("out of memory");
    return memory + (page - (uintptr_t)memory % page);
}

/* A number in [0, 1): a generator of Numerical Recipes. */
static float uniform(uint32_t *state) {
    *state = *state * 1664525u + 1013904223u;
    return (float)(*state >> 8) / 16777216.0f;
}

/* A sky with clouds that grows brighter to the horizon, a darker ground, and a sun of 3 x 3 texels. */
static float *sky(uint32_t width) {
    const uint32_t height = width / 2;
    uint32_t state = 1;
    float *map = allocate((size_t)width * height * sizeof *map);
    for (uint32_t y = 0; y < height; y++) {
        const float up = 1.0f - 2.0f * ((float)y + 0.5f) / (float)height;
        for (uint32_t x = 0; x < width; x++) {
            const int is_sun = y - height / 5 < 3 && x - width / 3 < 3;
            const float clear = up > 0.0f ? 1.5f - up : 0.3f;
            map[(size_t)y * width + x] = is_sun ? 2e4f : clear * (0.7f + 0.6f * uniform(&state));
        }
    }
    return map;
}

/* What an earlier run kept, or else a new environment. */
static const wis_environment *environment(uint32_t width, const char *name, size_t *bytes) {
    const wis_environment *handle;
    const wis_environment_config config = {.size = sizeof config, .layout = WIS_LAYOUT_LATLONG, .width = width, .height = width / 2,
                                           .channels = 1, .format = WIS_FORMAT_F32, .filter = WIS_FILTER_BILINEAR, .pixels = sky(width)};
    wis_memory_size size;
    check(wis_environment_size(&config, &size, NULL));
    void *memory = allocate(size.bytes), *scratch = allocate(size.scratch_bytes);
    FILE *file = fopen(name, "rb");
    *bytes = size.bytes;
    if (file == NULL) {
        check(wis_environment_init(&config, memory, size.bytes, scratch, size.scratch_bytes, &handle, NULL));
        file = fopen(name, "wb");
        if (file == NULL || fwrite(memory, 1, size.bytes, file) != size.bytes) fail("the file cannot be written");
    } else if (fread(memory, 1, size.bytes, file) != size.bytes) {
        fail("the file is too short");
    } else {
        check(wis_environment_open(memory, size.bytes, &handle, NULL));
    }
    fclose(file);
    return handle;
}

/* A normal and a view above it. Their lengths are 1 within the header's tolerance, without a square root of the C library. */
static void unit(float v[3]) {
    const float square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    float length = 1.0f;
    for (int i = 0; i < 20; i++) {
        length = 0.5f * (length + square / length);
    }
    for (int k = 0; k < 3; k++) {
        v[k] /= length;
    }
}

static void place(wis_point *point, uint32_t *state) {
    float cosine;
    do {
        cosine = 0.0f;
        for (int k = 0; k < 3; k++) {
            point->normal[k] = 2.0f * uniform(state) - 1.0f;
            point->wo[k] = 2.0f * uniform(state) - 1.0f;
        }
        unit(point->normal);
        unit(point->wo);
        for (int k = 0; k < 3; k++) {
            cosine += point->normal[k] * point->wo[k];
        }
    } while (cosine < 0.1f);
    point->seed = *state;
}

enum { MOST = 64 };

/* One call of wis_product_prepare, wis_sample or wis_pdf; wis_pdf at the product's own samples. Answers a number to print. */
static double product_call(wis_sampler *sampler, const wis_environment *light, const wis_point *point, const char *call, size_t batch,
                           uint32_t *state) {
    static char *memory;
    static float u[MOST][2], pdf[MOST];
    static wis_drawn drawn[MOST];
    const wis_product_config config = {.size = sizeof config};
    wis_memory_size size;
    check(wis_product_size(&config, &size, NULL));
    memory = memory == NULL ? allocate(size.bytes) : memory;
    size_t offset, used;
    check(wis_product_prepare(sampler, light, &config, 1, point, memory, size.bytes, &offset, &used));
    if (strcmp(call, "prepare") == 0) {
        return (double)used;
    }
    for (size_t i = 0; i < 2 * batch; i++) u[i / 2][i % 2] = uniform(state);
    const wis_product *product = (const wis_product *)(memory + offset);
    check(wis_sample(sampler, light, product, batch, u[0], 0, drawn, 0));
    if (strcmp(call, "pdf") == 0) {
        check(wis_pdf(sampler, light, product, batch, drawn[0].wi, sizeof drawn[0], pdf, 0));
    }
    return drawn[0].pdf;
}

int main(int count, char **argument) {
    if (count != 7) fail("WIDTH lambert|ggx|narrow|mix CALLS FILE direct|prepare|sample|pdf BATCH");
    const uint32_t width = (uint32_t)atoi(argument[1]), calls = (uint32_t)atoi(argument[3]);
    const size_t batch = (size_t)atoi(argument[6]);
    const int is_direct = strcmp(argument[5], "direct") == 0;
    if (batch < 1 || batch > MOST) fail("a batch of 1 to 64");
    const int is_narrow = strcmp(argument[2], "narrow") == 0, is_mix = strcmp(argument[2], "mix") == 0;
    const int is_glossy = is_narrow || strcmp(argument[2], "ggx") == 0;
    const float alpha = is_narrow ? 0.05f : 0.2f;
    size_t bytes;
    const wis_environment *light = environment(width, argument[4], &bytes);

    const wis_sampler_config config = {.size = sizeof config, .rays = 1, .candidates_per_ray = is_glossy ? 32 : 16};
    wis_memory_size size;
    wis_sampler *sampler;
    check(wis_sampler_size(&config, &size, NULL));
    void *memory = allocate(size.bytes);
    check(wis_sampler_init(&config, memory, size.bytes, &sampler, NULL));

    wis_material material = {.size = sizeof material, .lobe_count = is_mix ? 2 : 1,
                             .lobe = {{is_glossy ? WIS_LOBE_GGX : WIS_LOBE_LAMBERT, alpha, alpha, 0}, {WIS_LOBE_GGX, 0.2f, 0.2f, 0}}};
    check(wis_material_init(&material, NULL));
    wis_point point = {.size = sizeof point, .material = &material, .weight = {{0.8f, 0.8f, 0.8f}, {1, 1, 1}},
                       .f0 = {{0.9f, 0.9f, 0.9f}, {0.04f, 0.04f, 0.04f}}};

    fprintf(stderr, "environment %zx %zx\nsampler %zx %zx\n", (size_t)light, (size_t)light + bytes, (size_t)memory, (size_t)memory + size.bytes);
    double sum = 0.0;
    uint32_t state = 7;
    for (uint32_t i = 0; i < calls; i++) {
        wis_ray ray;
        uint32_t rays;
        place(&point, &state);
        if (!is_direct) {
            sum += product_call(sampler, light, &point, argument[5], batch, &state);
            continue;
        }
        check(wis_direct(sampler, light, &point, 1, &ray, &rays));
        sum += rays > 0 ? ray.weight : 0.0;
    }
    printf("mean %g\n", sum / calls);
    return EXIT_SUCCESS;
}
