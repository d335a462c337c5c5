// The consumer of check.c in C++11, through wis_wavelets.hpp.
#include <wis_wavelets.hpp>

#include <cstdio>
#include <vector>

#include "scene.hpp"

namespace {

const unsigned samples = 64;

bool densities_agree(const wis::wavelets::environment &environment, const wis::wavelets::product &product) {
    for (unsigned i = 0; i < samples; i++) {
        const float u[2] = {(i + 0.5f) / samples, (i * 37 % samples + 0.5f) / samples};
        wis_drawn sample;
        float pdf = 0.0f;
        if (product.sample(environment, u, sample) != WIS_OK) return false;
        if (product.pdf(environment, sample.wi, pdf) != WIS_OK) return false;
        if (!(sample.pdf > 0.0f) || sample.pdf != pdf) return false;
    }
    return true;
}

bool lights_carry_the_power(const std::vector<float> &pixels, const wis::wavelets::environment &environment) {
    const wis_wavelet_light_config same = map_config(pixels);
    auto map = wis::sized<wis_environment_config>();
    map.layout = same.layout;
    map.width = same.width;
    map.height = same.height;
    map.channels = same.channels;
    map.format = same.format;
    map.pixels = same.pixels;
    auto config = wis::sized<wis_strata_config>();
    config.count = 20;
    wis::lights lights;
    double sum = 0.0;
    if (lights.init(map, config) != WIS_OK) return false;
    const double power = environment.info().power;
    for (const wis_light &light : lights) sum += light.luminance;
    return lights.size() > 0 && sum > 0.999 * power && sum < 1.001 * power;
}

bool product_is_that_of_averages() {
    const float values[4] = {1.0f, 2.0f, 3.0f, 4.0f}, halves[2] = {1.0f, 3.0f};
    auto plane = wis::sized<wis_tree_config>(), line = wis::sized<wis_tree_config>();
    plane.dimensions = 2;
    line.dimensions = 1;
    plane.depth = line.depth = 1;
    plane.pixels = values;
    line.pixels = halves;
    wis::wavelets::tree e, f, product;
    double average = 0.0;
    if (e.init(plane) != WIS_OK || f.init(line) != WIS_OK) return false;
    const wis_tree *const factors[2] = {e.get(), f.get()};
    auto config = wis::sized<wis_tree_config>();
    config.source = WIS_TREE_PRODUCT;
    config.tree_count = 2;
    config.trees = factors;
    return product.init(config) == WIS_OK && product.average(average) == WIS_OK &&
           average == (1.0 + 2.0 + 3.0 * 3.0 + 3.0 * 4.0) / 4.0;
}

} // namespace

int main() {
    const std::vector<float> pixels = paint();

    wis::wavelets::environment environment;
    wis::wavelets::product product;
    const auto config = wis::sized<wis_wavelet_product_config>();
    const bool passed = environment.init(map_config(pixels)) == WIS_OK && product.init(config) == WIS_OK &&
                        product.prepare(environment, lambert()) == WIS_OK && densities_agree(environment, product) &&
                        lights_carry_the_power(pixels, environment) && product_is_that_of_averages();
    std::puts(passed ? "sample and pdf agree" : "FAILED");
    return passed ? 0 : 1;
}
