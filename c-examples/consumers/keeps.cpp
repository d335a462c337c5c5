// What a class of wis_wavelets.hpp was given at init may change or go away afterwards, and objects may be moved.
#include <wis_wavelets.hpp>

#include <cstdio>
#include <cstring>
#include <memory>
#include <utility>
#include <vector>

#include "scene.hpp"

namespace {

int failures = 0;

void expect(bool holds, const char *what) {
    if (holds) return;
    std::printf("FAILED: %s\n", what);
    failures++;
}

std::vector<char> bytes_of(const wis::wavelets::environment &light, const wis::wavelets::product &product) {
    auto info = wis::sized<wis_wavelet_product_info>();
    if (wis_wavelet_product_describe(light.get(), product.get(), &info) != WIS_OK) return {};
    const char *const start = reinterpret_cast<const char *>(product.get());
    return std::vector<char>(start, start + info.bytes);
}

// A matrix that dies, spoiled, before the first preparation.
void init_with_what_dies(wis::wavelets::product &product) {
    const float turned[9] = {0.0f, -1.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 0.0f, 1.0f};
    const std::unique_ptr<float[]> matrix(new float[9]);
    std::memcpy(matrix.get(), turned, sizeof turned);
    auto config = wis::sized<wis_wavelet_product_config>();
    config.world_from_map = matrix.get();
    expect(product.init(config) == WIS_OK, "a product with a matrix");
    std::memset(matrix.get(), 0x7f, sizeof turned);
}

// Without init, or after one that failed, a preparation says that nothing is built.
void products_need_init(const wis::wavelets::environment &light) {
    wis::wavelets::product product;
    expect(product.prepare(light, lambert()) == WIS_NOT_BUILT, "a forgotten init");
    expect(product.init(wis::sized<wis_wavelet_product_config>()) == WIS_OK, "an init");
    expect(product.prepare(light, lambert()) == WIS_OK, "a preparation");
    auto wrong = wis::sized<wis_wavelet_product_config>();
    wrong.max_squares = WIS_MAX_SQUARES + 1;
    wis_diagnostic diagnostic = wis_diagnostic();
    expect(product.init(wrong, &diagnostic) == WIS_INVALID_ARGUMENT, "an init that fails");
    expect(diagnostic.field && std::strcmp(diagnostic.field, "max_squares") == 0, "the field at fault");
    expect(product.prepare(light, lambert(), &diagnostic) == WIS_NOT_BUILT, "a preparation after it");
    expect(diagnostic.argument == 0 && !diagnostic.field, "no argument is at fault");
}

void products_keep_the_matrix(const wis::wavelets::environment &light) {
    wis::wavelets::product plain, kept;
    expect(plain.init(wis::sized<wis_wavelet_product_config>()) == WIS_OK, "a plain product");
    expect(plain.prepare(light, lambert()) == WIS_OK, "a plain preparation");
    init_with_what_dies(kept);
    expect(kept.prepare(light, lambert()) == WIS_OK, "a preparation after the matrix is gone");
    const std::vector<char> first = bytes_of(light, kept);
    expect(!first.empty() && first != bytes_of(light, plain), "the matrix counts");

    wis::wavelets::product moved(std::move(kept));
    expect(bytes_of(light, moved) == first, "a product that was moved");
    expect(moved.prepare(light, lambert()) == WIS_OK && bytes_of(light, moved) == first, "its next preparation");
    expect(kept.get() == nullptr, "nothing is left of it");
    expect(kept.prepare(light, lambert()) != WIS_OK, "what is left prepares nothing");
}

void pools_own_what_they_write_to() {
    const float wi[6] = {0.0f, 0.0f, 1.0f, 1.0f, 0.0f, 0.0f}, weight[2] = {1.0f, 1.0f};
    wis::pool pool;
    expect(pool.pick(wi, weight, 2, 2, 0.5f) == WIS_OK && pool.size() == 2, "a pool");
    const wis::pool moved(std::move(pool));
    const wis_pick before = *moved.begin();
    expect(pool.size() == 0 && pool.begin() == pool.end(), "nothing is left of it");
    expect(pool.pick(wi + 3, weight, 1, 1, 0.5f) == WIS_OK && pool.begin() != moved.begin(), "a pool of its own again");
    expect(std::memcmp(&before, moved.begin(), sizeof before) == 0, "the picks that were moved");
}

} // namespace

int main() {
    wis::wavelets::environment light;
    expect(light.init(map_config(paint())) == WIS_OK, "an environment");
    products_need_init(light);
    products_keep_the_matrix(light);
    pools_own_what_they_write_to();
    const wis::wavelets::environment moved(std::move(light));
    float pdf = 0.0f;
    const float up[3] = {0.0f, 0.0f, 1.0f};
    expect(moved.pdf(up, pdf) == WIS_OK && light.get() == nullptr, "an environment that was moved");
    std::puts(failures ? "FAILED" : "what was given is kept");
    return failures ? 1 : 0;
}
