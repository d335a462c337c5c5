/* A path tracer under an environment map, whose light it gathers in one of several ways. */
#ifndef PATHTRACER_PATH_H
#define PATHTRACER_PATH_H

#include "../direct.h"
#include "../render/light.h"
#include "../render/seed.h"
#include "scene.h"

enum { MAX_DEPTH = 4, MAX_RAYS = 4 };

typedef struct Method {
    const char *name;
    enum { BY_LIGHT, BY_DIRECT } kind; /* samples of the light, or wis_direct */
    /* What BSDF rays bring that leave the scene: their share by the balance heuristic, or light up to the mean of the map. */
    enum { NOTHING, BALANCE, BASE } escape;
    uint32_t flags; /* of the environment */
    bool unshared;  /* first hits of a pixel share no products */
} Method;

typedef struct Tracer {
    Light light;
    float mean; /* luminance of the map */
    Method method;
    const wis_environment *environment;
    wis_sampler *sampler;
    bool stratified;
    uint64_t random;
    uint32_t depth, pixel, sample, rays, hits[MAX_DEPTH]; /* hits of this pixel, by bounce */
} Tracer;

/* Points in the unit square: independent ones, or those of this sample in a (0,2)-sequence for each pixel and dimension. */
static void numbers(Tracer *t, uint32_t dimension, uint32_t count, float *u) {
    if (t->stratified) {
        check(wis_points_sobol(pixel_seed(t->pixel, dimension, 0), t->sample * count, count, u, 0));
    }
    for (uint32_t i = 0; !t->stratified && i < 2 * count; i++) { /* SplitMix64 */
        uint64_t z = t->random += 0x9e3779b97f4a7c15u;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        u[i] = (float)((z ^ (z >> 31)) >> 40) / 16777216.0f;
    }
}

/* The map as rays for light see it, or BSDF rays that leave the scene: two parts where those bring the light up to the mean. */
static Vec3 radiance(const Tracer *t, Vec3 wi, bool escapes) {
    Vec3 light = light_radiance(&t->light, wi);
    float base = t->method.escape == BASE ? fminf(1, t->mean / luminance(light)) : escapes;
    return vec3_scale(light, escapes ? base : 1 - base);
}

struct Reflected { const Tracer *t; const Hit *hit; const Bsdf *b; Vec3 light; }; /* a hit, and the light that it reflects */

/* BSDF x cosine x light x visibility. */
static Vec3 reflected(const Reflected *at, const float wi[3], float *pdf) {
    Vec3 direction = vec3_load(wi), f = bsdf_eval(at->b, direction, pdf);
    Hit blocker;
    bool is_black = luminance(f) <= 0 || scene_trace(at->hit->position, direction, &blocker);
    return is_black ? vec3_make(0, 0, 0) : vec3_mul(f, radiance(at->t, direction, false));
}

static void add_light(Reflected *sum, const float wi[3], float weight) {
    sum->light = vec3_axpy(sum->light, weight, reflected(sum, wi, NULL));
}

/* BSDF samples of a hit: as many as rays for light where no path goes on. */
static uint32_t scattered(const Tracer *t) {
    return t->depth == 1 ? t->rays : 1;
}

/* The light at a hit: by the rays that wis_direct asks for, or by samples of the map. */
static Vec3 gather(Tracer *t, const Hit *hit, const Bsdf *b, const wis_point *point, const float *u) {
    Reflected sum = {t, hit, b, {0, 0, 0}};
    wis_ray rays[MAX_RAYS];
    wis_drawn drawn[MAX_RAYS];
    bool direct = t->method.kind == BY_DIRECT;
    check(direct ? direct_light(t->sampler, t->environment, point, t->rays, rays, &sum)
                 : wis_sample(t->sampler, t->environment, NULL, t->rays, u, 0, drawn, 0));
    for (uint32_t i = 0; i < t->rays && !direct; i++) {
        float pdf, density = (float)t->rays * drawn[i].pdf;
        Vec3 light = reflected(&sum, drawn[i].wi, &pdf);
        density += t->method.escape == BALANCE ? (float)scattered(t) * pdf : 0;
        sum.light = density > 0 ? vec3_axpy(sum.light, 1 / density, light) : sum.light;
    }
    return sum.light;
}

/* The share of a BSDF sample: its part by the balance heuristic, or all, over their number. */
static float share_of_bsdf(Tracer *t, Vec3 direction, float pdf) {
    float wi[3], other, count = (float)scattered(t);
    if (t->method.escape != BALANCE) {
        return 1 / count;
    }
    vec3_store(direction, wi);
    check(wis_pdf(t->sampler, t->environment, NULL, 1, wi, 0, &other, 0));
    return pdf / (count * pdf + (float)t->rays * other);
}

/* What a BSDF sample adds that leaves the scene. */
static Vec3 escaped(Tracer *t, const Bsdf *b, Vec3 origin, const float *u) {
    float pdf;
    Vec3 direction = bsdf_sample(b, u), f = bsdf_eval(b, direction, &pdf);
    Hit blocker;
    if (luminance(f) <= 0 || scene_trace(origin, direction, &blocker)) {
        return vec3_make(0, 0, 0);
    }
    return vec3_scale(vec3_mul(f, radiance(t, direction, true)), share_of_bsdf(t, direction, pdf) / pdf);
}

static Vec3 path(Tracer *t, Vec3 origin, Vec3 direction) {
    Vec3 color = {0, 0, 0}, beta = {1, 1, 1};
    float pdf = 0, share = 1; /* of the last BSDF sample: all that MIS needs to know of it when its ray leaves the scene */
    uint32_t bounce = 0;
    const Method *m = &t->method;
    Hit hit;
    for (; scene_trace(origin, direction, &hit); bounce++) {
        if (bounce == t->depth) {
            return color;
        }
        float u[2 * MAX_RAYS];
        Material material = material_at(&hit);
        Bsdf b = bsdf_begin(&material, hit.normal, vec3_scale(direction, -1));
        wis_point point = bsdf_point(&b, &shapes[hit.material]);
        point.seed = t->pixel;
        point.sample = t->hits[bounce]++;
        point.bounce = bounce;
        point.flags = m->kind == BY_DIRECT && m->escape == BASE ? WIS_POINT_COMPENSATED : 0;
        if (m->kind != BY_DIRECT) {
            numbers(t, 1 + 2 * bounce, t->rays, u);
        }
        color = vec3_add(color, vec3_mul(beta, gather(t, &hit, &b, &point, u)));
        if (bounce == t->depth - 1 && m->escape == NOTHING) {
            return color;
        }
        numbers(t, 2 + 2 * bounce, scattered(t), u);
        for (uint32_t i = 1; i < scattered(t); i++) {
            color = vec3_add(color, vec3_mul(beta, escaped(t, &b, hit.position, u + 2 * i)));
        }
        direction = bsdf_sample(&b, u);
        beta = vec3_mul(beta, bsdf_eval(&b, direction, &pdf));
        if (luminance(beta) <= 0) {
            return color;
        }
        beta = vec3_scale(beta, 1 / pdf);
        share = m->escape != NOTHING;
        origin = hit.position;
    }
    share = bounce > 0 && share > 0 ? share_of_bsdf(t, direction, pdf) : share;
    beta = vec3_mul(beta, bounce == 0 ? light_radiance(&t->light, direction) : radiance(t, direction, true));
    return share > 0 ? vec3_axpy(color, share, beta) : color;
}

#endif
