// wavelets.c in C++11: wis_wavelets.hpp owns the memory, and a failure is an exception.
#define WIS_HPP_THROW
#include "wis_wavelets.hpp"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <vector>

static const std::uint32_t width = 64, height = 32, samples = 8;

// A lat-long map of luminance, +z up: a dim sky with one bright texel.
static std::vector<float> make_map() {
    std::vector<float> map(width * height, 0.1f);
    std::fill(map.begin(), map.begin() + width * height / 2, 0.5f);
    map[8 * width + 12] = 500.0f;
    return map;
}

static wis_wavelet_query make_query() {
    wis_wavelet_query query = wis::sized<wis_wavelet_query>();
    query.lobe_count = 1;
    query.normal[2] = 1.0f;
    query.tangent[0] = 1.0f;
    query.wo[0] = -0.6f;
    query.wo[2] = 0.8f;
    query.lobe[0] = wis_wavelet_lobe{WIS_WAVELET_LOBE_GGX, {1.0f, 1.0f, 1.0f}, {0.9f, 0.9f, 0.9f}, 0.3f, 0.3f};
    return query;
}

static void run() {
    // 1. A light, and its environment: built once, then shared by all threads.
    const std::vector<float> map = make_map();
    wis_wavelet_light_config config = wis::sized<wis_wavelet_light_config>();
    config.layout = WIS_LAYOUT_LATLONG;
    config.width = width;
    config.height = height;
    config.channels = 1;
    config.format = WIS_FORMAT_F32;
    config.storage = WIS_STORAGE_PYRAMID;
    config.pixels = map.data();
    wis::wavelets::environment environment;
    environment.init(config);

    // 2. The product of light, BRDF and cosine at a shading point; one object for each thread.
    wis::wavelets::product product;
    product.init(wis::sized<wis_wavelet_product_config>());
    product.prepare(environment, make_query());

    // 3. Samples: directions in world space and their densities per solid angle.
    float u[samples][2];
    wis::pass(wis_points_sobol(wis_pixel_seed(0, 0, 0), 0, samples, u[0], sizeof u[0]));
    for (const auto &point : u) {
        wis_drawn sample;
        float pdf;
        product.sample(environment, point, sample);
        product.pdf(environment, sample.wi, pdf);
        std::printf("wi (% .4f, % .4f, % .4f)  pdf %9.4f  pdf(wi) %s\n", sample.wi[0], sample.wi[1], sample.wi[2],
                    sample.pdf, std::memcmp(&pdf, &sample.pdf, sizeof pdf) == 0 ? "the same bits" : "differs");
    }

    // 4. The light that the point would reflect if nothing cast a shadow.
    auto info = wis::sized<wis_wavelet_product_info>();
    product.describe(environment, info);
    std::printf("estimate of the reflected luminance: %.4f\n", info.estimate);
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
