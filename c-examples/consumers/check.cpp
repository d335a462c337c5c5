// The consumer of check.c in C++11, through wis.hpp.
#include <wis.hpp>

#include <cstdio>
#include <vector>

namespace {

const unsigned width = 16, height = 8, samples = 64;

wis::status build_environment(const std::vector<float> &pixels, wis::environment &environment) {
    auto config = wis::sized<wis_environment_config>();
    config.layout = WIS_LAYOUT_LATLONG;
    config.width = width;
    config.height = height;
    config.channels = 3;
    config.format = WIS_FORMAT_F32;
    config.storage = WIS_STORAGE_PYRAMID;
    config.pixels = pixels.data();
    return environment.init(config);
}

wis_query lambert() {
    auto query = wis::sized<wis_query>();
    query.lobe_count = 1;
    query.normal[2] = 1.0f;
    query.tangent[0] = 1.0f;
    query.wo[0] = 0.6f;
    query.wo[2] = 0.8f;
    query.lobe[0].kind = WIS_LOBE_LAMBERT;
    for (float &weight : query.lobe[0].weight) weight = 0.8f;
    return query;
}

bool densities_agree(const wis::environment &environment, const wis::product &product) {
    for (unsigned i = 0; i < samples; i++) {
        const float u[2] = {(i + 0.5f) / samples, (i * 37 % samples + 0.5f) / samples};
        wis_sample sample;
        float pdf = 0.0f;
        if (product.sample(environment, u, sample) != WIS_OK) return false;
        if (product.pdf(environment, sample.wi, pdf) != WIS_OK) return false;
        if (!(sample.pdf > 0.0f) || sample.pdf != pdf) return false;
    }
    return true;
}

} // namespace

int main() {
    std::vector<float> pixels(3 * width * height, 0.5f);
    for (unsigned c = 0; c < 3; c++) pixels[3 * (2 * width + 5) + c] = 100.0f;

    wis::environment environment;
    wis::product product;
    const auto config = wis::sized<wis_product_config>();
    const bool passed = build_environment(pixels, environment) == WIS_OK && product.init(config) == WIS_OK &&
                        product.prepare(environment, lambert()) == WIS_OK && densities_agree(environment, product);
    std::puts(passed ? "sample and pdf agree" : "FAILED");
    return passed ? 0 : 1;
}
