/* A consumer in C99: builds an environment and a tree of it on the heap and compares the pdf of each sample with pdf(point). */
#include <wis_wavelets.h>

#include <stdio.h>
#include <stdlib.h>

#include "scene.h"

static const wis_environment *build_environment(const float *pixels, void **memory) {
    const wis_environment_config config = scene_environment(pixels);
    wis_memory_size need;
    if (wis_environment_size(&config, &need, NULL) != WIS_OK) return NULL;
    *memory = malloc(need.bytes);
    void *scratch = malloc(need.scratch_bytes);
    const wis_environment *environment = NULL;
    if (*memory && scratch)
        (void)wis_environment_init(&config, *memory, need.bytes, scratch, need.scratch_bytes, &environment, NULL);
    free(scratch);
    return environment;
}

static const wis_tree *build_tree(const wis_environment *environment, void **memory) {
    const wis_tree_config config = scene_tree(environment);
    wis_memory_size need;
    if (wis_tree_size(&config, &need, NULL) != WIS_OK) return NULL;
    *memory = malloc(need.bytes);
    void *scratch = malloc(need.scratch_bytes);
    const wis_tree *tree = NULL;
    if (*memory && scratch)
        (void)wis_tree_init(&config, *memory, need.bytes, scratch, need.scratch_bytes, &tree, NULL, NULL);
    free(scratch);
    return tree;
}

int main(void) {
    float pixels[SCENE_FLOATS];
    void *environment_memory = NULL, *tree_memory = NULL;
    scene_paint(pixels);
    const wis_environment *environment = build_environment(pixels, &environment_memory);
    const wis_tree *tree = environment ? build_tree(environment, &tree_memory) : NULL;
    const int passed = tree && scene_densities_agree(tree);
    puts(passed ? "sample and pdf agree" : "FAILED");
    free(tree_memory);
    free(environment_memory);
    return passed ? EXIT_SUCCESS : EXIT_FAILURE;
}
