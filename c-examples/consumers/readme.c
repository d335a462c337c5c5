/* The README's loop as it is printed there, in loop.inc, with the map, BSDF and shadow rays of minimal.c about it. */
#define main minimal
#include "../minimal.c"
#undef main

int main(void) {
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
    wis_memory_size size;
    const wis_environment *environment;
    wis_sampler *sampler;
    wis_ray ray[RAYS];
    uint32_t count, pixel = 7;
    double sum = 0.0;
#include "loop.inc"
    free(scratch);
    free(memory);
    free(sampler);
    printf("reflected light: %.3f (exactly 0.400)\n", sum / HITS);
    return sum / HITS > 0.3995 && sum / HITS < 0.4005 ? EXIT_SUCCESS : EXIT_FAILURE;
}
