// wis.hpp stands alone, may be included twice, and each member of its classes compiles.
#include <wis.hpp>
#include <wis.hpp>

int use_wrapper(wis::environment &environment, wis::product &product);
int use_wrapper(wis::environment &environment, wis::product &product) {
    const float u[2] = {0.5f, 0.5f};
    float pdf = 0.0f, back[2];
    double luminance = 0.0;
    wis_sample sample;
    const auto query = wis::sized<wis_query>();
    const auto brdf = wis::sized<wis_callback_brdf>();
    const wis::status answers[] = {
        environment.init(wis::sized<wis_environment_config>()),
        environment.sample(u, sample),
        environment.pdf(sample.wi, pdf),
        environment.invert(sample.wi, back),
        product.init(wis::sized<wis_product_config>()),
        product.prepare(environment, query),
        product.prepare(environment, brdf),
        product.prepare(environment, wis::sized<wis_table>(), query),
        product.estimate(environment, luminance),
        product.sample(environment, u, sample),
        product.pdf(environment, sample.wi, pdf),
        product.invert(environment, sample.wi, back),
    };
    int failures = 0;
    for (const wis::status answer : answers) failures += answer != WIS_OK;
    return failures;
}
