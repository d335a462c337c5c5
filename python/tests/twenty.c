/* Twenty rays, samples and pdfs by calls of the C library one by one: what tests/test_bits.py expects, bit by bit. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "wis.h"

enum { WIDTH = 64, HEIGHT = 32, POINTS = 5, RAYS = 4 };

static float map[HEIGHT][WIDTH][3];

static void check(wis_status status) {
    if (status != WIS_OK) {
        fprintf(stderr, "%s\n", wis_status_string(status));
        exit(EXIT_FAILURE);
    }
}

static void *block(size_t bytes) {
    void *memory = calloc(1, bytes + 1);
    if (memory == NULL) exit(EXIT_FAILURE);
    return memory;
}

static void print(const float *numbers, size_t count) {
    for (size_t i = 0; i < count; i++) {
        uint32_t bits;
        memcpy(&bits, &numbers[i], sizeof bits);
        printf("%08x%c", (unsigned)bits, i + 1 < count ? ' ' : '\n');
    }
}

int main(void) {
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++)
            for (int c = 0; c < 3; c++) map[y][x][c] = (float)((7 * x + 13 * y + 5 * c) % 32 + (x == 20 && y == 9 ? 4096 : 1)) / 32;

    wis_environment_config config = {0};
    config.size = sizeof config;
    config.layout = WIS_LAYOUT_LATLONG;
    config.width = WIDTH;
    config.height = HEIGHT;
    config.channels = 3;
    config.format = WIS_FORMAT_F32;
    config.pixels = map;
    wis_memory_size size;
    check(wis_environment_size(&config, &size, NULL));
    void *memory = block(size.bytes), *scratch = block(size.scratch_bytes);
    const wis_environment *light;
    check(wis_environment_init(&config, memory, size.bytes, scratch, size.scratch_bytes, &light, NULL));

    wis_sampler_config own = {sizeof own, WIS_CPU_DETECT, RAYS, 0, 0, 0};
    check(wis_sampler_size(&own, &size, NULL));
    void *room = block(size.bytes);
    wis_sampler *sampler;
    check(wis_sampler_init(&own, room, size.bytes, &sampler, NULL));

    wis_material material = {sizeof material, 2, {{WIS_LOBE_LAMBERT, 0, 0, 0}, {WIS_LOBE_GGX, 0.25f, 0.25f, 0}}, 0};
    check(wis_material_init(&material, NULL));
    wis_point point;
    for (uint32_t i = 0; i < POINTS; i++) {
        memset(&point, 0, sizeof point);
        point.size = sizeof point;
        point.material = &material;
        point.normal[2] = 1;
        point.wo[i % 2] = 0.6f;
        point.wo[2] = 0.8f;
        for (int c = 0; c < 3; c++) {
            point.weight[0][c] = 0.125f * (float)(i + 1);
            point.weight[1][c] = 1;
            point.f0[1][c] = 0.0625f;
        }
        point.seed = i;
        point.sample = 3;
        wis_ray ray[RAYS];
        uint32_t count;
        check(wis_sampler_begin_pixel(sampler));
        check(wis_direct(sampler, light, &point, RAYS, ray, &count));
        if (count != RAYS) return EXIT_FAILURE;
        for (int r = 0; r < RAYS; r++) print(ray[r].wi, 4);
    }

    float u[8][2];
    wis_drawn drawn[8];
    check(wis_points_sobol(7, 0, 8, u[0], 0));
    check(wis_sample(sampler, light, NULL, 8, u[0], 0, drawn, 0));
    for (int k = 0; k < 8; k++) print(drawn[k].wi, 4);
    wis_product_config product = {sizeof product, 0, 0, 0};
    size_t offset, used;
    check(wis_product_size(&product, &size, NULL));
    void *made = block(size.bytes);
    check(wis_product_prepare(sampler, light, &product, 1, &point, made, size.bytes, &offset, &used));
    check(wis_sample(sampler, light, (const wis_product *)((char *)made + offset), 8, u[0], 0, drawn, 0));
    for (int k = 0; k < 8; k++) print(drawn[k].wi, 4);
    free(memory), free(scratch), free(room), free(made);
    return EXIT_SUCCESS;
}
