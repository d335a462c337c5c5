/* The BSDF of a hit: albedo / pi + Trowbridge-Reitz (GGX) with height-correlated Smith shadowing. */
#ifndef PATHTRACER_BSDF_H
#define PATHTRACER_BSDF_H

#include "scene.h"

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
        float cos_h = vec3_dot(b->normal, half), d = 1 + (a2 - 1) * cos_h * cos_h, c = 1 - vec3_dot(b->wo, half);
        float root_o = sqrtf(a2 + (1 - a2) * b->cos_o * b->cos_o), root_i = sqrtf(a2 + (1 - a2) * cos_i * cos_i);
        float facets = 0.5f * a2 / (PI * d * d), c5 = c * c * c * c * c;
        Vec3 fresnel = vec3_axpy(vec3_scale(b->f0, 1 - c5), c5, white);
        f = vec3_axpy(f, facets * cos_i / (b->cos_o * root_i + cos_i * root_o), fresnel);
        *pdf += b->layer * facets / (b->cos_o + root_o);
    }
    return vec3_scale(f, cos_i > 0);
}

static Vec3 bsdf_sample(const Bsdf *b, const float u[2]) {
    bool glossy = u[0] < b->layer;
    float x = glossy ? u[0] / b->layer : (u[0] - b->layer) / (1 - b->layer), phi = 2 * PI * u[1];
    float r = sqrtf(x), z = sqrtf(fmaxf(0, 1 - x));
    Vec3 w;
    if (glossy) { /* a visible normal by a spherical cap (Dupuy and Benyoub 2023), and the reflection at it */
        Vec3 o = {b->alpha * vec3_dot(b->tangent, b->wo), b->alpha * vec3_dot(b->bitangent, b->wo), b->cos_o};
        o = vec3_normalise(o);
        z = (1 - x) * (1 + o.z) - o.z;
        r = sqrtf(fmaxf(0, 1 - z * z));
        w = vec3_axpy(vec3_scale(b->tangent, b->alpha * (r * cosf(phi) + o.x)), b->alpha * (r * sinf(phi) + o.y), b->bitangent);
        w = vec3_normalise(vec3_axpy(w, z + o.z, b->normal));
        return vec3_sub(vec3_scale(w, 2 * vec3_dot(b->wo, w)), b->wo);
    }
    w = vec3_axpy(vec3_scale(b->tangent, r * cosf(phi)), r * sinf(phi), b->bitangent);
    return vec3_axpy(w, z, b->normal);
}

#endif
