/* Headers may be included in any order and twice. */
#include <wis_wavelets.h>
#include <wis.h>
#include <wis.h>
#include <wis_lights.h>
#include <wis_lights.h>
#include <wis_wavelets.h>

/* A use of each kind of declaration: constant, enumerator, struct, opaque type and function. */
int use_header(const wis_tree *tree, wis_tree_config *config);
int use_header(const wis_tree *tree, wis_tree_config *config) {
    float pdf = 0.0f, point[2] = {0.5f, 0.5f};
    config->source = WIS_TREE_PIXELS;
    return wis_tree_pdf(tree, point, &pdf) == WIS_OK;
}
