/* The library without a C library or a heap: builds and samples in static arrays; answers the exit code. */
#include <wis_wavelets.h>

#include "../consumers/scene.h"

#define ALIGNED __attribute__((aligned(16)))

enum { BYTES = 1 << 22 };

static unsigned char environment_memory[BYTES] ALIGNED;
static unsigned char tree_memory[BYTES] ALIGNED;
static unsigned char scratch[BYTES] ALIGNED;

/* Each step that may fail has an exit code of its own. */
enum { PASSED, NO_ENVIRONMENT, NO_TREE, DENSITIES_DIFFER };

static const wis_environment *build_environment(void) {
    static float pixels[SCENE_FLOATS];
    scene_paint(pixels);
    const wis_environment_config config = scene_environment(pixels);
    const wis_environment *environment = 0;
    (void)wis_environment_init(&config, environment_memory, BYTES, scratch, BYTES, &environment, 0);
    return environment;
}

int freestanding_main(void);
int freestanding_main(void) {
    const wis_environment *environment = build_environment();
    if (!environment) return NO_ENVIRONMENT;
    const wis_tree_config config = scene_tree(environment);
    const wis_tree *tree = 0;
    if (wis_tree_init(&config, tree_memory, BYTES, scratch, BYTES, &tree, 0, 0) != WIS_OK) return NO_TREE;
    return scene_densities_agree(tree) ? PASSED : DENSITIES_DIFFER;
}
