/* A consumer in C99: builds an environment and a product on the heap and compares the pdf of each sample with pdf(wi). */
#include <wis_wavelets.h>

#include <stdio.h>
#include <stdlib.h>

#include "scene.h"

static const wis_wavelet_light *build_environment(const float *pixels, void **memory) {
    const wis_wavelet_light_config config = scene_environment(pixels);
    wis_memory_size need;
    if (wis_wavelet_light_size(&config, &need, NULL) != WIS_OK) return NULL;
    *memory = malloc(need.bytes);
    void *scratch = malloc(need.scratch_bytes);
    const wis_wavelet_light *environment = NULL;
    if (*memory && scratch)
        (void)wis_wavelet_light_init(&config, *memory, need.bytes, scratch, need.scratch_bytes, &environment, NULL, NULL);
    free(scratch);
    return environment;
}

static const wis_wavelet_product *prepare_product(const wis_wavelet_light *environment, void **memory) {
    const wis_wavelet_query query = scene_query();
    const wis_wavelet_product_config config = scene_product();
    wis_memory_size need;
    if (wis_wavelet_product_size(&config, &need, NULL) != WIS_OK) return NULL;
    *memory = malloc(need.bytes);
    const wis_wavelet_product *product = NULL;
    if (*memory) (void)wis_wavelet_product_prepare(environment, &config, 1, &query, *memory, need.bytes, &product, NULL);
    return product;
}

int main(void) {
    float pixels[SCENE_FLOATS];
    void *environment_memory = NULL, *product_memory = NULL;
    scene_paint(pixels);
    const wis_wavelet_light *environment = build_environment(pixels, &environment_memory);
    const wis_wavelet_product *product = environment ? prepare_product(environment, &product_memory) : NULL;
    const int passed = product && scene_densities_agree(environment, product);
    puts(passed ? "sample and pdf agree" : "FAILED");
    free(product_memory);
    free(environment_memory);
    return passed ? EXIT_SUCCESS : EXIT_FAILURE;
}
