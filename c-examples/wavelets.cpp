// wavelets.c in C++11: wis_wavelets.hpp owns the memory, and a failure is an exception.
#define WIS_HPP_THROW
#include "wis_wavelets.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

using wis::wavelets::tree;

static const std::uint32_t width = 64, height = 32, depth = 6, cells = 1u << 2 * depth, slices = 16, samples = 8;
static const float four_pi = 12.5663706f;

// A lat-long map of luminance, +z up: a dim sky with one bright texel.
static std::vector<float> make_map() {
    std::vector<float> map(width * height, 0.1f);
    std::fill(map.begin(), map.begin() + width * height / 2, 0.5f);
    map[8 * width + 12] = 500.0f;
    return map;
}

// A glossy BRDF x cosine about a normal of +z: Phong's lobe over a little of Lambert's.
static float brdf_cosine(const float (&wo)[3], const float *wi) {
    const float cosine = -wo[0] * wi[0] + -wo[1] * wi[1] + wo[2] * wi[2];
    if (wi[2] <= 0.0f) return 0.0f;
    return wi[2] * (0.1f + (cosine > 0.0f ? 2.0f * std::pow(cosine, 40.0f) : 0.0f));
}

// A slice of the table: BRDF x cosine of a view over the square about its mirror direction (Clarberg et al. 2005, Section 5).
static tree build_slice(std::uint32_t slice) {
    std::vector<float> values(cells);
    const float angle = (static_cast<float>(slice) + 0.5f) / slices * 1.57079633f, up[3] = {0.0f, 0.0f, 1.0f};
    const float wo[3] = {std::sin(angle), 0.0f, std::cos(angle)};
    std::uint32_t beside[2];
    double weights[2];
    float frame[9], wi[3];
    wis::pass(wis_table_view(slices, up, wo, beside, weights, frame));
    for (std::uint32_t k = 0; k < cells; k++) {
        const std::uint32_t side = 1u << depth;
        const float point[2] = {(static_cast<float>(k / side) + 0.5f) / side, (static_cast<float>(k % side) + 0.5f) / side};
        wis::pass(wis_square_direction(point, frame, wi));
        values[k] = 1e-4f + brdf_cosine(wo, wi);
    }
    auto config = wis::sized<wis_tree_config>();
    config.source = WIS_TREE_PIXELS;
    config.dimensions = 2;
    config.depth = depth;
    config.error_budget = 0.001f;
    config.pixels = values.data();
    tree built;
    built.init(config);
    return built;
}

static void run() {
    // 1. A light of wis.h.
    const std::vector<float> map = make_map();
    auto light = wis::sized<wis_environment_config>();
    light.layout = WIS_LAYOUT_LATLONG;
    light.filter = WIS_FILTER_BILINEAR;
    light.width = width;
    light.height = height;
    light.channels = 1;
    light.format = WIS_FORMAT_F32;
    light.pixels = map.data();
    const wis::result<wis::environment> environment = wis::environment::build(light);

    // 2. A shading point: the slices beside its view, and the frame of the trees about its mirror direction.
    const float normal[3] = {0.0f, 0.0f, 1.0f}, wo[3] = {0.6f, 0.0f, 0.8f};
    std::uint32_t slice[2];
    double weights[2];
    float world_from_tree[9];
    wis::pass(wis_table_view(slices, normal, wo, slice, weights, world_from_tree));

    // 3. The map about that direction, the BRDF between the two views beside wo, and their product.
    auto config = wis::sized<wis_tree_config>();
    config.source = WIS_TREE_ENVIRONMENT;
    config.depth = depth;
    config.error_budget = 0.001f;
    config.environment = environment->get();
    config.world_from_tree = world_from_tree;
    tree rotated, brdf, product;
    rotated.init(config);
    const tree first = build_slice(slice[0]), second = build_slice(slice[1]);
    const wis_tree *const views[2] = {first.get(), second.get()};
    config.source = WIS_TREE_BLEND;
    config.tree_count = 2;
    config.trees = views;
    config.weight = weights;
    brdf.init(config);
    const wis_tree *const factors[2] = {rotated.get(), brdf.get()};
    config.source = WIS_TREE_PRODUCT;
    config.trees = factors;
    product.init(config);
    double integral = 0.0;
    rotated.product_integral(brdf, integral);
    std::printf("reflected luminance: %.4f, as an inner product: %.4f\n", four_pi * product.info().average, four_pi * integral);

    // 4. Well-spread points become samples in place; their directions, densities per steradian, and the way back.
    float points[samples][2];
    std::uint32_t index[samples];
    for (std::uint32_t i = 0; i < samples; i++) index[i] = i;
    wis::pass(wis_points_sobol(0, 0, samples, points[0], sizeof points[0]));
    product.warp(points[0], index, samples);
    for (std::uint32_t i = 0; i < samples; i++) {
        float wi[3], point[2], pdf = 0.0f, found = 0.0f, u[2];
        wis::pass(wis_square_direction(points[i], world_from_tree, wi));
        product.pdf(points[i], pdf);
        wis::pass(wis_square_point(wi, world_from_tree, point));
        product.pdf(point, found);
        product.invert(points[i], u);
        std::printf("%u: wi (% .4f, % .4f, % .4f)  pdf %9.4f  pdf(wi) %9.4f  u (%.4f, %.4f)\n", static_cast<unsigned>(index[i]),
                    wi[0], wi[1], wi[2], pdf / four_pi, found / four_pi, u[0], u[1]);
    }
}

int main() {
    try {
        run();
    } catch (const std::exception &failure) {
        std::fprintf(stderr, "%s\n", failure.what());
        return EXIT_FAILURE;
    }
    return EXIT_SUCCESS;
}
