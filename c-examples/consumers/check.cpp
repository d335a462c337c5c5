// The consumer of check.c in C++11, through wis_wavelets.hpp.
#include <wis_wavelets.hpp>

#include <cstdio>
#include <vector>

#include "scene.hpp"

namespace {

const unsigned samples = 64;

bool densities_agree(const wis::wavelets::tree &tree) {
    for (unsigned i = 0; i < samples; i++) {
        const float u[2] = {(i + 0.5f) / samples, (i * 37 % samples + 0.5f) / samples};
        float point[2], pdf = 0.0f, again = 0.0f;
        if (tree.sample(u, point, pdf) != WIS_OK || tree.pdf(point, again) != WIS_OK) return false;
        if (!(pdf > 0.0f) || pdf != again) return false;
    }
    return true;
}

// Lights and a tree carry the power of the map.
bool power_is_kept(const std::vector<float> &pixels, const wis::wavelets::tree &tree) {
    auto config = wis::sized<wis_strata_config>();
    config.count = 20;
    wis::lights lights;
    double sum = 0.0;
    if (lights.init(map_config(pixels), config) != WIS_OK) return false;
    const double power = 12.566370614359172 * tree.info().average;
    for (const wis_light &light : lights) sum += light.luminance;
    return lights.size() > 0 && sum > 0.999 * power && sum < 1.001 * power;
}

bool product_is_that_of_averages() {
    const float values[4] = {1.0f, 2.0f, 3.0f, 4.0f}, others[4] = {1.0f, 1.0f, 3.0f, 3.0f};
    auto config = wis::sized<wis_tree_config>();
    config.dimensions = 2;
    config.depth = 1;
    wis::wavelets::tree e, f, product;
    config.pixels = values;
    if (e.init(config) != WIS_OK) return false;
    config.pixels = others;
    if (f.init(config) != WIS_OK) return false;
    const wis_tree *const factors[2] = {e.get(), f.get()};
    config = wis::sized<wis_tree_config>();
    config.source = WIS_TREE_PRODUCT;
    config.tree_count = 2;
    config.trees = factors;
    return product.init(config) == WIS_OK && product.info().average == (1.0 + 2.0 + 3.0 * 3.0 + 3.0 * 4.0) / 4.0;
}

} // namespace

int main() {
    const std::vector<float> pixels = paint();

    const auto environment = wis::environment::build(map_config(pixels));
    wis::wavelets::tree tree;
    const bool passed = environment && tree.init(tree_config(environment->get())) == WIS_OK && densities_agree(tree) &&
                        power_is_kept(pixels, tree) && product_is_that_of_averages();
    std::puts(passed ? "sample and pdf agree" : "FAILED");
    return passed ? 0 : 1;
}
