// wis_wavelets.hpp stands alone, may be included twice, and each member of its classes compiles.
#include <wis_wavelets.hpp>
#include <wis_wavelets.hpp>

int use_trees(const wis::wavelets::environment &environment, wis::wavelets::tree &tree, wis::wavelets::visibility &visibility, wis::pool &pool);
int use_trees(const wis::wavelets::environment &environment, wis::wavelets::tree &tree, wis::wavelets::visibility &visibility, wis::pool &pool) {
    const wis_tree *const trees[] = {tree.get()};
    const wis_tree *const both[] = {tree.get(), tree.get()};
    const double weights[] = {1.0};
    const float wi[] = {0.0f, 0.0f, 1.0f}, weight[] = {1.0f}, u[] = {0.5f, 0.5f};
    float point[2], pdf = 0.0f;
    double integral = 0.0;
    wis::wavelets::tree blend, product, rotated, approximation;
    auto config = wis::sized<wis_tree_config>(), sum = config, factors = config, map = config, list = config;
    sum.source = WIS_TREE_BLEND;
    sum.tree_count = 1;
    sum.trees = trees;
    sum.weight = weights;
    factors.source = WIS_TREE_PRODUCT;
    factors.tree_count = 2;
    factors.trees = both;
    map.source = WIS_TREE_ENVIRONMENT;
    map.environment = environment.get();
    list.source = WIS_TREE_WAVELETS;
    list.average = 1.0;
    const wis::status answers[] = {
        tree.init(config),
        approximation.init(list),
        rotated.init(map),
        blend.init(sum),
        product.init(factors),
        product.average(integral),
        product.sample(u, point, pdf),
        product.pdf(point, pdf),
        visibility.init(tree),
        visibility.product_integral(product, integral),
        pool.pick(wi, weight, 1, 1, 0.5f),
    };
    int failures = 0;
    for (const wis::status answer : answers) failures += answer != WIS_OK;
    for (const wis_pick &pick : pool) failures += pick.candidate != 0;
    return failures;
}

int use_wrapper(wis::wavelets::environment &environment, wis::wavelets::product &product);
int use_wrapper(wis::wavelets::environment &environment, wis::wavelets::product &product) {
    const float u[2] = {0.5f, 0.5f};
    float pdf = 0.0f, back[2];
    wis_drawn sample;
    auto info = wis::sized<wis_wavelet_product_info>();
    const auto query = wis::sized<wis_wavelet_query>();
    auto brdf = wis::sized<wis_wavelet_callback>();
    auto table = wis::sized<wis_wavelet_table>();
    product.set_table(&table);
    product.set_callback(&brdf);
    const wis::status answers[] = {
        environment.init(wis::sized<wis_wavelet_light_config>()),
        environment.sample(u, sample),
        environment.pdf(sample.wi, pdf),
        environment.invert(sample.wi, back),
        product.init(wis::sized<wis_wavelet_product_config>()),
        product.prepare(environment, query),
        product.describe(environment, info),
        product.sample(environment, u, sample),
        product.pdf(environment, sample.wi, pdf),
        product.invert(environment, sample.wi, back),
    };
    int failures = 0;
    for (const wis::status answer : answers) failures += answer != WIS_OK;
    return failures;
}
