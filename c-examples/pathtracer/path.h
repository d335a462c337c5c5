/* A path tracer under an environment map, whose light it gathers in one of several ways. */
#ifndef PATHTRACER_PATH_H
#define PATHTRACER_PATH_H

#include "../render/light.h"
#include "scene.h"

#define DEPTH 4

/* ---- The BSDF of a hit: albedo / pi + Trowbridge-Reitz (GGX) with height-correlated Smith shadowing. ---- */

typedef struct Bsdf {
    Vec3 tangent, bitangent, normal, wo, albedo, f0;
    float alpha, cos_o, layer; /* the share of samples that the GGX layer gets */
} Bsdf;

static Bsdf bsdf_begin(const Hit *hit, Vec3 wo) {
    const Material *m = hit->material;
    Bsdf b = {{0, 0, 0}, {0, 0, 0}, hit->normal, wo, m->albedo, m->f0, m->alpha, vec3_dot(hit->normal, wo), 0};
    Vec3 p = vec3_scale(hit->position, m->frequency);
    b.albedo = vec3_scale(b.albedo, 0.7f + 0.3f * sinf(p.x) * sinf(p.y + 1) * sinf(p.z));
    b.tangent = vec3_normalise(vec3_cross(fabsf(b.normal.x) < 0.7f ? vec3_make(1, 0, 0) : vec3_make(0, 1, 0), b.normal));
    b.bitangent = vec3_cross(b.normal, b.tangent);
    b.layer = b.alpha > 0 ? luminance(b.f0) : 0;
    b.layer = b.layer > 0 ? fmaxf(0.25f, b.layer / (b.layer + luminance(b.albedo))) : 0;
    return b;
}

/* f cos, and the density of bsdf_sample. */
static Vec3 bsdf_eval(const Bsdf *b, Vec3 wi, float *pdf) {
    float cos_i = vec3_dot(b->normal, wi), a2 = b->alpha * b->alpha;
    Vec3 f = vec3_scale(b->albedo, cos_i / PI);
    *pdf = (1 - b->layer) * cos_i / PI;
    if (cos_i > 0 && b->layer > 0) {
        Vec3 half = vec3_normalise(vec3_add(wi, b->wo)), white = {1, 1, 1};
        float d = 1 + (a2 - 1) * powf(vec3_dot(b->normal, half), 2), c5 = powf(1 - vec3_dot(b->wo, half), 5);
        float root_o = sqrtf(a2 + (1 - a2) * b->cos_o * b->cos_o), root_i = sqrtf(a2 + (1 - a2) * cos_i * cos_i);
        float facets = 0.5f * a2 / (PI * d * d);
        Vec3 fresnel = vec3_axpy(vec3_scale(b->f0, 1 - c5), c5, white);
        f = vec3_axpy(f, facets * cos_i / (b->cos_o * root_i + cos_i * root_o), fresnel);
        *pdf += b->layer * facets / (b->cos_o + root_o);
    }
    return vec3_scale(f, cos_i > 0);
}

static Vec3 bsdf_sample(const Bsdf *b, const float u[3]) {
    float phi = 2 * PI * u[0], x = cosf(phi), y = sinf(phi), r = sqrtf(u[1]), z = sqrtf(1 - u[1]);
    Vec3 w = vec3_axpy(vec3_axpy(vec3_scale(b->tangent, r * x), r * y, b->bitangent), z, b->normal);
    if (u[2] < b->layer) { /* a visible normal by a spherical cap (Dupuy and Benyoub 2023), and the reflection at it */
        Vec3 o = {b->alpha * vec3_dot(b->tangent, b->wo), b->alpha * vec3_dot(b->bitangent, b->wo), b->cos_o};
        o = vec3_normalise(o);
        z = (1 - u[1]) * (1 + o.z) - o.z;
        r = sqrtf(fmaxf(0, 1 - z * z));
        w = vec3_axpy(vec3_scale(b->tangent, b->alpha * (r * x + o.x)), b->alpha * (r * y + o.y), b->bitangent);
        w = vec3_normalise(vec3_axpy(w, z + o.z, b->normal));
        w = vec3_sub(vec3_scale(w, 2 * vec3_dot(b->wo, w)), b->wo);
    }
    return w;
}

/* ---- Light at a hit. ---- */

typedef struct Method {
    const char *name;
    bool is_mis;    /* one sample of the light and one of the BSDF at each hit; else the rays of wis_direct */
    uint32_t flags; /* of the environment */
    const wis_environment *environment;
} Method;

typedef struct Tracer {
    Light light;
    const Method *method;
    wis_sampler *sampler;
    uint64_t random;
    uint32_t pixel, hits[DEPTH]; /* of this pixel, by bounce */
} Tracer;

/* A sampler for this thread. */
static void tracer_init(Tracer *t) {
    wis_sampler_config config = {0};
    wis_memory_size size;
    config.size = sizeof config;
    config.rays = 1;
    check(wis_sampler_size(&config, &size, NULL));
    check(wis_sampler_init(&config, malloc(size.bytes), size.bytes, &t->sampler, NULL));
}

/* SplitMix64. */
static float uniform(Tracer *t) {
    uint64_t z = t->random += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (float)((z ^ (z >> 31)) >> 40) / 16777216.0f;
}

/* BSDF x cosine x light x visibility. */
static Vec3 reflected(const Tracer *t, const Hit *hit, const Bsdf *b, Vec3 wi, float *pdf) {
    Vec3 f = bsdf_eval(b, wi, pdf);
    Hit blocker;
    bool is_black = luminance(f) <= 0 || scene_trace(hit->position, wi, &blocker);
    return is_black ? vec3_make(0, 0, 0) : vec3_mul(f, light_radiance(&t->light, wi));
}

/* All light of the environment, by the rays that wis asks for. */
static Vec3 direct(Tracer *t, const Hit *hit, const Bsdf *b, uint32_t bounce) {
    Vec3 sum = {0, 0, 0};
    float pdf;
    wis_point point = {0};
    wis_ray ray[1];
    uint32_t count;
    point.size = sizeof point;
    point.material = &hit->material->lobes;
    vec3_store(b->normal, point.normal);
    vec3_store(b->wo, point.wo);
    vec3_store(b->albedo, point.weight[0]);
    vec3_store(vec3_make(1, 1, 1), point.weight[1]);
    vec3_store(b->f0, point.f0[1]);
    point.seed = t->pixel;
    point.stream = bounce;
    point.turn = t->hits[bounce]++;
    check(wis_direct(t->sampler, t->method->environment, &point, 1, NULL, ray, &count));
    for (uint32_t i = 0; i < count; i++) {
        sum = vec3_axpy(sum, ray[i].weight, reflected(t, hit, b, vec3_load(ray[i].wi), &pdf));
    }
    return sum;
}

/* What a sample of the light adds; the BSDF's adds the rest when its ray leaves the scene. */
static Vec3 sample_light(Tracer *t, const Hit *hit, const Bsdf *b) {
    float u[2] = {uniform(t), uniform(t)}, pdf;
    wis_drawn drawn;
    Vec3 sum;
    check(wis_sample(t->sampler, t->method->environment, NULL, 1, u, 0, &drawn, 0));
    sum = reflected(t, hit, b, vec3_load(drawn.wi), &pdf);
    return vec3_scale(sum, 1 / (drawn.pdf + pdf));
}

/* The balance heuristic's share of a BSDF sample whose ray leaves the scene. */
static float share_of_bsdf(Tracer *t, Vec3 direction, float pdf) {
    float wi[3], light_pdf;
    vec3_store(direction, wi);
    check(wis_pdf(t->sampler, t->method->environment, NULL, 1, wi, 0, &light_pdf, 0));
    return pdf / (pdf + light_pdf);
}

/* ---- A path. ---- */

static Vec3 path(Tracer *t, Vec3 origin, Vec3 direction) {
    Vec3 color = {0, 0, 0}, beta = {1, 1, 1};
    bool is_mis = t->method->is_mis;
    float pdf = 0;
    for (uint32_t bounce = 0;; bounce++) {
        Hit hit;
        Bsdf b;
        if (!scene_trace(origin, direction, &hit)) {
            /* wis_direct has already brought this light, but to the camera. */
            float share = bounce == 0 ? 1 : is_mis ? share_of_bsdf(t, direction, pdf) : 0;
            return share > 0 ? vec3_axpy(color, share, vec3_mul(beta, light_radiance(&t->light, direction))) : color;
        }
        if (bounce == DEPTH) {
            return color;
        }
        b = bsdf_begin(&hit, vec3_scale(direction, -1));
        color = vec3_add(color, vec3_mul(beta, is_mis ? sample_light(t, &hit, &b) : direct(t, &hit, &b, bounce)));
        if (bounce == DEPTH - 1 && !is_mis) {
            return color;
        }
        direction = bsdf_sample(&b, (float[3]){uniform(t), uniform(t), uniform(t)});
        beta = vec3_mul(beta, bsdf_eval(&b, direction, &pdf));
        if (luminance(beta) <= 0) {
            return color;
        }
        beta = vec3_scale(beta, 1 / pdf);
        origin = hit.position;
    }
}

#endif
