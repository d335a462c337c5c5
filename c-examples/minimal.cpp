// minimal.c in C++11: wis.hpp owns the memory, and a result holds a value or a status.
#include "wis.hpp"

#include <cstdio>
#include <cstdlib>
#include <vector>

static const std::uint32_t width = 64, height = 32, rays = 4, hits = 4096;

static void check(wis::status status) {
    if (status == WIS_OK) return;
    std::fprintf(stderr, "%s\n", wis::message(status));
    std::exit(EXIT_FAILURE);
}

template <class T> static T value(wis::result<T> made) {
    check(made.code());
    return std::move(*made);
}

// The renderer's own side: its map, its BSDF and its shadow rays.
static float radiance(const float (&)[3]) { return 1.0f; } // what run puts into every texel

static float bsdf_times_cosine(const float (&normal)[3], const float (&wi)[3]) {
    const float cosine = normal[0] * wi[0] + normal[1] * wi[1] + normal[2] * wi[2];
    return cosine > 0.0f ? 0.8f / 3.14159265f * cosine : 0.0f;
}

// A wall hides the half of the sky with x < 0.
static bool occluded(const float (&wi)[3]) { return wi[0] < 0.0f; }

int main() {
    // 1. The light, once: built from your map, then shared by all threads.
    const std::vector<float> map(width * height, 1.0f);
    auto config = wis::sized<wis_environment_config>();
    config.layout = WIS_LAYOUT_LATLONG;
    config.width = width;
    config.height = height;
    config.channels = 1;
    config.format = WIS_FORMAT_F32;
    config.filter = WIS_FILTER_BILINEAR;
    config.pixels = map.data();
    const wis::environment environment = value(wis::environment::build(config));

    // 2. A sampler for each thread.
    wis::sampler sampler = value(wis::sampler::make());

    // 3. A material: the shapes of its lobes.
    wis_lobe lambert = wis_lobe();
    lambert.kind = WIS_LOBE_LAMBERT;
    const wis_material material = value(wis::make_material(&lambert, 1));

    // 4. A hit: normal, view, and how strongly each lobe reflects there.
    auto point = wis::sized<wis_point>();
    point.material = &material;
    point.normal[2] = 1.0f;
    point.wo[0] = 0.6f;
    point.wo[2] = 0.8f;
    for (float &weight : point.weight[0]) weight = 0.8f;

    // 5. The rays to trace, each with its weight. Here as for many hits of one pixel.
    double sum = 0.0;
    point.seed = 7; // the pixel
    check(sampler.begin_pixel());
    for (std::uint32_t hit = 0; hit < hits; hit++) {
        wis_ray ray[rays];
        point.sample = hit;
        const std::uint32_t count = value(sampler.direct(environment, point, rays, ray));
        for (std::uint32_t i = 0; i < count; i++) {
            if (!occluded(ray[i].wi))
                sum += bsdf_times_cosine(point.normal, ray[i].wi) * radiance(ray[i].wi) * ray[i].weight;
        }
    }
    std::printf("reflected light: %.3f (exactly 0.400)\n", sum / hits);
    return EXIT_SUCCESS;
}
