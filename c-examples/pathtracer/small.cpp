// small.c in C++11: the same map, scene and numbers, with wis.hpp.
#include "wis.hpp"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

namespace {

const std::uint32_t width = 64, height = 32, depth = 3, samples = 64;
const float pi = 3.14159265358979f;

struct Vec3 {
    float x, y, z;
};
Vec3 operator+(Vec3 a, Vec3 b) { return Vec3{a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec3 operator-(Vec3 a, Vec3 b) { return Vec3{a.x - b.x, a.y - b.y, a.z - b.z}; }
Vec3 operator*(float s, Vec3 a) { return Vec3{a.x * s, a.y * s, a.z * s}; }
float dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec3 cross(Vec3 a, Vec3 b) { return Vec3{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
Vec3 normalise(Vec3 a) { return (1 / std::sqrt(dot(a, a))) * a; }
void store(Vec3 a, float (&out)[3]) {
    out[0] = a.x;
    out[1] = a.y;
    out[2] = a.z;
}

void check(wis::status status) {
    if (status == WIS_OK) return;
    std::fprintf(stderr, "%s\n", wis::message(status));
    std::exit(EXIT_FAILURE);
}

template <class T> T value(wis::result<T> made) {
    check(made.code());
    return std::move(*made);
}

// SplitMix64.
struct Random {
    std::uint64_t state;
    float operator()() {
        std::uint64_t z = state += 0x9e3779b97f4a7c15u;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return static_cast<float>((z ^ (z >> 31)) >> 40) / 16777216.0f;
    }
};

struct Map {
    std::vector<float> texels;
    float mean;

    Map() : texels(width * height), mean(0) {
        for (std::uint32_t i = 0; i < width * height; i++) {
            const std::uint32_t x = i % width, y = i / width;
            texels[i] = x >= 20 && x < 24 && y >= 6 && y < 9 ? 40 : 0.25f + 0.015625f * static_cast<float>(y);
        }
    }
    // The nearest texel.
    float operator()(Vec3 wi) const {
        const float turn = std::atan2(wi.y, wi.x) / (2 * pi);
        const float polar = std::acos(std::max(-1.0f, std::min(1.0f, wi.z))) / pi;
        const auto x = static_cast<std::uint32_t>((turn < 0 ? turn + 1 : turn) * width);
        const auto y = static_cast<std::uint32_t>(polar * height);
        return texels[std::min(y, height - 1) * width + std::min(x, width - 1)];
    }
    // The share of it that BSDF rays bring.
    float base(float light) const { return std::min(1.0f, mean / light); }
};

// A floor z = 0 and a sphere upon it: the distance, or 0.
float trace(Vec3 o, Vec3 d, Vec3 &normal) {
    float nearest = FLT_MAX;
    const Vec3 to = Vec3{0, 0, 0.5f} - o;
    const float along = dot(to, d), square = along * along - dot(to, to) + 0.25f, floor = -o.z / d.z;
    if (square > 0 && along - std::sqrt(square) > 1e-3f) {
        nearest = along - std::sqrt(square);
        normal = normalise(nearest * d - to);
    }
    if (floor > 1e-3f && floor < nearest) {
        nearest = floor;
        normal = Vec3{0, 0, 1};
    }
    return nearest < FLT_MAX ? nearest : 0;
}

// A direction with a cosine distribution.
Vec3 diffuse(Vec3 normal, Random &random) {
    const float phi = 2 * pi * random(), r = random();
    const Vec3 tangent = normalise(cross(std::fabs(normal.x) < 0.7f ? Vec3{1, 0, 0} : Vec3{0, 1, 0}, normal));
    const Vec3 across = std::sqrt(r) * std::cos(phi) * tangent + std::sqrt(r) * std::sin(phi) * cross(normal, tangent);
    return normalise(across + std::sqrt(1 - r) * normal);
}

float path(wis::sampler &sampler, const wis::environment &environment, const Map &map, wis_point point, Random &random,
           Vec3 o, Vec3 d) {
    float color = 0, beta = 1;
    for (point.bounce = 0;; point.bounce++) {
        Vec3 normal = {0, 0, 1}, hidden;
        const float distance = trace(o, d, normal);
        if (distance == 0) {
            const float light = map(d);
            return color + beta * light * (point.bounce == 0 ? 1 : map.base(light));
        }
        if (point.bounce == depth) return color;
        o = o + distance * d;
        store(normal, point.normal);
        store(-1.0f * d, point.wo);
        wis_ray ray[1];
        const std::uint32_t count = value(sampler.direct(environment, point, 1, ray));
        for (std::uint32_t i = 0; i < count; i++) {
            const Vec3 wi = {ray[i].wi[0], ray[i].wi[1], ray[i].wi[2]};
            const float light = map(wi), cosine = dot(normal, wi);
            if (cosine > 0 && trace(o, wi, hidden) == 0)
                color += beta * (0.6f / pi) * cosine * light * (1 - map.base(light)) * ray[i].weight;
        }
        beta *= 0.6f;
        d = diffuse(normal, random);
    }
}

} // namespace

int main() {
    Map map;
    auto config = wis::sized<wis_environment_config>();
    config.layout = WIS_LAYOUT_LATLONG;
    config.width = width;
    config.height = height;
    config.channels = 1;
    config.format = WIS_FORMAT_F32;
    config.filter = WIS_FILTER_NEAREST;
    config.pixels = map.texels.data();
    const wis::environment environment = value(wis::environment::build(config));
    map.mean = static_cast<float>(value(environment.describe()).mean);

    auto thread = wis::sized<wis_sampler_config>();
    thread.rays = 1;
    wis::sampler sampler = value(wis::sampler::make(thread));
    wis_lobe lambert = wis_lobe();
    lambert.kind = WIS_LOBE_LAMBERT;
    const wis_material material = value(wis::make_material(&lambert, 1));
    auto point = wis::sized<wis_point>();
    point.flags = WIS_POINT_COMPENSATED;
    point.material = &material;
    for (float &weight : point.weight[0]) weight = 0.6f;

    for (std::uint32_t pixel = 0; pixel < 32; pixel++) {
        double sum = 0;
        Random random = {pixel};
        point.seed = pixel;
        check(sampler.begin_pixel());
        for (point.sample = 0; point.sample < samples; point.sample++) {
            const float x = (static_cast<float>(pixel % 8) + random() - 4) / 4;
            const float z = (2 - static_cast<float>(pixel / 8)) / 4 - random() / 4;
            sum += path(sampler, environment, map, point, random, Vec3{0, -3, 1}, normalise(Vec3{x, 2, z - 0.4f}));
        }
        std::printf("%.4f%c", sum / samples, pixel % 8 == 7 ? '\n' : ' ');
    }
    return EXIT_SUCCESS;
}
