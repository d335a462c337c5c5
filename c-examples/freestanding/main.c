/* The library without a C library or a heap: builds, prepares and samples in static arrays; answers the exit code. */
#include <wis_wavelets.h>

#include "../consumers/scene.h"

#define ALIGNED __attribute__((aligned(16)))

enum { BYTES = 1 << 22 };

static unsigned char environment_memory[BYTES] ALIGNED;
static unsigned char product_memory[BYTES] ALIGNED;
static unsigned char scratch[BYTES] ALIGNED;

/* Each step that may fail has an exit code of its own. */
enum { PASSED, NO_ENVIRONMENT, NO_PRODUCT, DENSITIES_DIFFER };

static const wis_wavelet_light *build_environment(void) {
    static float pixels[SCENE_FLOATS];
    scene_paint(pixels);
    const wis_wavelet_light_config config = scene_environment(pixels);
    const wis_wavelet_light *environment = 0;
    (void)wis_wavelet_light_init(&config, environment_memory, BYTES, scratch, BYTES, &environment, 0, 0);
    return environment;
}

static const wis_wavelet_product *prepare_product(const wis_wavelet_light *environment) {
    const wis_wavelet_query query = scene_query();
    const wis_wavelet_product_config config = scene_product();
    const wis_wavelet_product *product = 0;
    (void)wis_wavelet_product_prepare(environment, &config, 1, &query, product_memory, BYTES, &product, 0);
    return product;
}

int freestanding_main(void);
int freestanding_main(void) {
    const wis_wavelet_light *environment = build_environment();
    if (!environment) return NO_ENVIRONMENT;
    const wis_wavelet_product *product = prepare_product(environment);
    if (!product) return NO_PRODUCT;
    return scene_densities_agree(environment, product) ? PASSED : DENSITIES_DIFFER;
}
