// wis_wavelets.hpp stands alone, may be included twice, and each member of its classes compiles.
#include <wis_wavelets.hpp>
#include <wis_wavelets.hpp>

int use_trees(const wis::environment &environment, wis::wavelets::tree &tree, wis::wavelets::visibility &visibility);
int use_trees(const wis::environment &environment, wis::wavelets::tree &tree, wis::wavelets::visibility &visibility) {
    const wis_tree *const trees[] = {tree.get()};
    const wis_tree *const both[] = {tree.get(), tree.get()};
    const double weights[] = {1.0};
    const float u[] = {0.5f, 0.5f};
    float point[2], back[2], points[2] = {0.5f, 0.5f}, pdf = 0.0f;
    std::uint32_t index[1] = {0};
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
        product.sample(u, point, pdf),
        product.pdf(point, pdf),
        product.invert(point, back),
        product.warp(points, index, 1),
        product.product_integral(tree, integral),
        visibility.init(tree),
        visibility.product_integral(product, integral),
    };
    int failures = 0;
    for (const wis::status answer : answers) failures += answer != WIS_OK;
    return failures;
}
