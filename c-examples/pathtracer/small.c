/* A small path tracer under a map of two parts: BSDF rays bring the map up to its mean, wis_direct brings the rest.
 * small.cpp and examples/pathtracer.rs print the same numbers. */
#include <float.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

#include "../direct.h"
#include "../render/vec3.h"

#define WIDTH 64
#define HEIGHT 32
#define DEPTH 3
#define SAMPLES 64

static float map[WIDTH * HEIGHT], mean;
static const Vec3 centre = {0, 0, 0.5f};
static uint64_t state;

static void check(wis_status status) {
    if (status != WIS_OK) {
        fprintf(stderr, "%s\n", wis_status_string(status));
        exit(EXIT_FAILURE);
    }
}

static float uniform(void) { /* SplitMix64 */
    uint64_t z = state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (float)((z ^ (z >> 31)) >> 40) / 16777216.0f;
}

/* The nearest texel. */
static float radiance(Vec3 wi) {
    float turn = atan2f(wi.y, wi.x) / (2 * PI), polar = acosf(fmaxf(-1, fminf(1, wi.z))) / PI;
    int x = (int)((turn < 0 ? turn + 1 : turn) * WIDTH), y = (int)(polar * HEIGHT);
    return map[(y < HEIGHT ? y : HEIGHT - 1) * WIDTH + (x < WIDTH ? x : WIDTH - 1)];
}

/* The share of the map that BSDF rays bring. */
static float base(float light) {
    return fminf(1, mean / light);
}

/* A floor z = 0 and a sphere upon it: the distance, or 0. */
static float trace(Vec3 o, Vec3 d, Vec3 *normal) {
    float nearest = FLT_MAX;
    Vec3 to = vec3_sub(centre, o);
    float along = vec3_dot(to, d), square = along * along - vec3_dot(to, to) + 0.25f, floor = -o.z / d.z;
    if (square > 0 && along - sqrtf(square) > 1e-3f) {
        nearest = along - sqrtf(square);
        *normal = vec3_normalise(vec3_sub(vec3_scale(d, nearest), to));
    }
    if (floor > 1e-3f && floor < nearest) {
        nearest = floor;
        *normal = vec3_make(0, 0, 1);
    }
    return nearest < FLT_MAX ? nearest : 0;
}

/* The hit, what the camera sees of its light, and the light of all hits. */
struct Reflected { Vec3 position, normal; float beta, color; };

static void add_light(Reflected *sum, const float wi[3], float weight) {
    Vec3 direction = vec3_load(wi), hidden;
    float light = radiance(direction), cosine = vec3_dot(sum->normal, direction);
    if (cosine > 0 && trace(sum->position, direction, &hidden) == 0) {
        sum->color += sum->beta * (0.6f / PI) * cosine * light * (1 - base(light)) * weight;
    }
}

static float path(wis_sampler *sampler, const wis_environment *environment, wis_point point, Vec3 o, Vec3 d) {
    Reflected sum = {o, {0, 0, 1}, 1, 0};
    for (uint32_t bounce = 0;; bounce++) {
        Vec3 normal, tangent;
        float distance = trace(sum.position, d, &sum.normal), phi, r;
        wis_ray ray[1];
        if (distance == 0) {
            float light = radiance(d);
            return sum.color + sum.beta * light * (bounce == 0 ? 1 : base(light));
        }
        if (bounce == DEPTH) {
            return sum.color;
        }
        sum.position = vec3_axpy(sum.position, distance, d);
        normal = sum.normal;
        vec3_store(normal, point.normal);
        vec3_store(vec3_scale(d, -1), point.wo);
        point.bounce = bounce;
        check(direct_light(sampler, environment, &point, 1, ray, &sum));
        sum.beta *= 0.6f;
        phi = 2 * PI * uniform();
        r = uniform();
        tangent = vec3_normalise(vec3_cross(fabsf(normal.x) < 0.7f ? vec3_make(1, 0, 0) : vec3_make(0, 1, 0), normal));
        d = vec3_axpy(vec3_scale(tangent, sqrtf(r) * cosf(phi)), sqrtf(r) * sinf(phi), vec3_cross(normal, tangent));
        d = vec3_normalise(vec3_axpy(d, sqrtf(1 - r), normal));
    }
}

int main(void) {
    wis_environment_config config = {.size = sizeof config, .layout = WIS_LAYOUT_LATLONG, .width = WIDTH, .height = HEIGHT,
                                     .channels = 1, .format = WIS_FORMAT_F32, .filter = WIS_FILTER_NEAREST,
                                     .pixels = map};
    wis_environment_info info = {.size = sizeof info};
    wis_sampler_config thread = {.size = sizeof thread, .rays = 1};
    wis_material material = {.size = sizeof material, .lobe_count = 1, .lobe = {{.kind = WIS_LOBE_LAMBERT}}};
    wis_point point = {.size = sizeof point, .flags = WIS_POINT_COMPENSATED, .material = &material, .weight = {{0.6f, 0.6f, 0.6f}}};
    const wis_environment *environment;
    wis_sampler *sampler;
    wis_memory_size size;
    void *memory[3];
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        int x = i % WIDTH, y = i / WIDTH;
        map[i] = x >= 20 && x < 24 && y >= 6 && y < 9 ? 40 : 0.25f + 0.015625f * (float)y;
    }
    check(wis_environment_size(&config, &size, NULL));
    memory[0] = malloc(size.bytes);
    memory[1] = malloc(size.scratch_bytes);
    check(wis_environment_init(&config, memory[0], size.bytes, memory[1], size.scratch_bytes, &environment, NULL));
    check(wis_environment_describe(environment, &info));
    mean = (float)info.mean;
    check(wis_sampler_size(&thread, &size, NULL));
    memory[2] = malloc(size.bytes);
    check(wis_sampler_init(&thread, memory[2], size.bytes, &sampler, NULL));
    check(wis_material_init(&material, NULL));
    for (uint32_t pixel = 0; pixel < 32; pixel++) {
        double sum = 0;
        state = pixel;
        point.seed = pixel;
        check(wis_sampler_begin_pixel(sampler));
        for (point.sample = 0; point.sample < SAMPLES; point.sample++) {
            float x = ((float)(pixel % 8) + uniform() - 4) / 4;
            float z = (2 - (float)(pixel / 8)) / 4 - uniform() / 4;
            sum += path(sampler, environment, point, vec3_make(0, -3, 1), vec3_normalise(vec3_make(x, 2, z - 0.4f)));
        }
        printf("%.4f%c", sum / SAMPLES, pixel % 8 == 7 ? '\n' : ' ');
    }
    for (int i = 0; i < 3; i++) {
        free(memory[i]);
    }
    return 0;
}
