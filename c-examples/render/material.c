/* BRDF evaluation and sampling. GGX uses height-correlated Smith shadowing and samples the visible normals
 * by spherical caps (Dupuy and Benyoub, "Sampling Visible GGX Normals with Spherical Caps", 2023). */
#include "material.h"

#include <stddef.h>

static float square(float x) {
    return x * x;
}

static Vec3 fresnel_schlick(const float f0[3], float cos_d) {
    float c = 1.0f - cos_d;
    float c5 = square(square(c)) * c;
    Vec3 base = vec3_load(f0);
    return vec3_axpy(vec3_scale(base, 1.0f - c5), c5, vec3_make(1.0f, 1.0f, 1.0f));
}

/* sqrt(a^2 + (1 - a^2) cos^2), the root in Smith's masking function. */
static float smith_root(float alpha, float cosine) {
    return sqrtf(square(alpha) + (1.0f - square(alpha)) * square(cosine));
}

/* Duff et al., "Building an Orthonormal Basis, Revisited", 2017. */
static void basis(Vec3 n, Vec3 *tangent, Vec3 *bitangent) {
    float sign = copysignf(1.0f, n.z);
    float a = -1.0f / (sign + n.z);
    float b = n.x * n.y * a;
    *tangent = vec3_make(1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x);
    *bitangent = vec3_make(b, sign + n.y * n.y * a, -n.y);
}

/* Share of the reflected light that a lobe is expected to carry. */
static float lobe_albedo(const Lobe *lobe, float cos_o) {
    Vec3 weight = vec3_load(lobe->weight);
    if (lobe->kind == WIS_LOBE_GGX) {
        weight = vec3_mul(weight, fresnel_schlick(lobe->f0, cos_o));
    }
    return luminance(weight);
}

Bsdf bsdf_begin(const Material *material, Vec3 normal, Vec3 wo) {
    Bsdf b = {0};
    float total = 0.0f;
    b.material = material;
    b.normal = normal;
    b.wo = wo;
    b.cos_o = vec3_dot(normal, wo);
    basis(normal, &b.tangent, &b.bitangent);
    for (uint32_t i = 0; i < material->lobe_count; i++) {
        b.choice[i] = lobe_albedo(&material->lobes[i], b.cos_o);
        b.root_o[i] = smith_root(material->lobes[i].alpha, b.cos_o);
        total += b.choice[i];
    }
    for (uint32_t i = 0; i < material->lobe_count; i++) {
        b.choice[i] /= total;
    }
    return b;
}

/* Adds a GGX lobe's f cos to *f_cos and returns its density of visible normals, reflected. */
static float eval_ggx(const Bsdf *b, uint32_t i, Vec3 wi, float cos_i, Vec3 *f_cos) {
    const Lobe *lobe = &b->material->lobes[i];
    float a2 = square(lobe->alpha);
    Vec3 half = vec3_normalise(vec3_add(wi, b->wo));
    float cos_h = vec3_dot(b->normal, half);
    float d = square(cos_h) * (a2 - 1.0f) + 1.0f;
    float distribution = a2 / (PI * square(d));
    float root_i = smith_root(lobe->alpha, cos_i);
    float visibility = 0.5f / (b->cos_o * root_i + cos_i * b->root_o[i]);
    Vec3 fresnel = fresnel_schlick(lobe->f0, vec3_dot(b->wo, half));
    Vec3 reflectance = vec3_mul(vec3_load(lobe->weight), fresnel);
    *f_cos = vec3_axpy(*f_cos, distribution * visibility * cos_i, reflectance);
    return 0.5f * distribution / (b->cos_o + b->root_o[i]);
}

Vec3 bsdf_eval(const Bsdf *b, Vec3 wi, float *pdf) {
    Vec3 f_cos = {0.0f, 0.0f, 0.0f};
    float density = 0.0f;
    float cos_i = vec3_dot(b->normal, wi);
    for (uint32_t i = 0; cos_i > 0.0f && i < b->material->lobe_count; i++) {
        const Lobe *lobe = &b->material->lobes[i];
        if (lobe->kind == WIS_LOBE_GGX) {
            density += b->choice[i] * eval_ggx(b, i, wi, cos_i, &f_cos);
        } else {
            f_cos = vec3_axpy(f_cos, cos_i / PI, vec3_load(lobe->weight));
            density += b->choice[i] * cos_i / PI;
        }
    }
    if (pdf != NULL) {
        *pdf = density;
    }
    return f_cos;
}

/* Shirley and Chiu's concentric map from the square to the disc, lifted to the hemisphere: density cos / pi. */
static Vec3 sample_cosine(float u, float v) {
    float x = 2.0f * u - 1.0f, y = 2.0f * v - 1.0f;
    float r = 0.0f, phi = 0.0f;
    if (fabsf(x) > fabsf(y)) {
        r = x;
        phi = (PI / 4.0f) * (y / x);
    } else if (y != 0.0f) {
        r = y;
        phi = PI / 2.0f - (PI / 4.0f) * (x / y);
    }
    return vec3_make(r * cosf(phi), r * sinf(phi), sqrtf(fmaxf(0.0f, 1.0f - r * r)));
}

/* A visible normal of GGX for wo in the local frame (normal = z). */
static Vec3 sample_visible_normal(float alpha, Vec3 wo, float u, float v) {
    Vec3 stretched = vec3_normalise(vec3_make(alpha * wo.x, alpha * wo.y, wo.z));
    float phi = 2.0f * PI * u;
    float z = (1.0f - v) * (1.0f + stretched.z) - stretched.z;
    float r = sqrtf(fmaxf(0.0f, 1.0f - z * z));
    Vec3 cap = vec3_make(r * cosf(phi), r * sinf(phi), z);
    Vec3 half = vec3_add(cap, stretched);
    return vec3_normalise(vec3_make(alpha * half.x, alpha * half.y, fmaxf(half.z, 1e-6f)));
}

static Vec3 to_local(const Bsdf *b, Vec3 w) {
    return vec3_make(vec3_dot(b->tangent, w), vec3_dot(b->bitangent, w), vec3_dot(b->normal, w));
}

static Vec3 to_world(const Bsdf *b, Vec3 w) {
    Vec3 sum = vec3_scale(b->tangent, w.x);
    sum = vec3_axpy(sum, w.y, b->bitangent);
    return vec3_axpy(sum, w.z, b->normal);
}

/* Picks a lobe with u and stretches the part of [0, 1) that chose it back to [0, 1). */
static uint32_t choose_lobe(const Bsdf *b, float *u) {
    float first = b->choice[0];
    if (b->material->lobe_count == 1) {
        return 0;
    }
    if (*u < first) {
        *u /= first;
        return 0;
    }
    *u = (*u - first) / (1.0f - first);
    return 1;
}

Vec3 bsdf_sample(const Bsdf *b, const float u[2]) {
    float u0 = u[0];
    const Lobe *lobe = &b->material->lobes[choose_lobe(b, &u0)];
    Vec3 wo, half;
    if (lobe->kind != WIS_LOBE_GGX) {
        return to_world(b, sample_cosine(u0, u[1]));
    }
    wo = to_local(b, b->wo);
    half = sample_visible_normal(lobe->alpha, wo, u0, u[1]);
    return to_world(b, vec3_sub(vec3_scale(half, 2.0f * vec3_dot(wo, half)), wo));
}

wis_status material_shape(const Material *material, wis_material *out) {
    wis_material shape = {0};
    shape.size = sizeof shape;
    shape.lobe_count = material->lobe_count;
    for (uint32_t i = 0; i < material->lobe_count; i++) {
        shape.lobe[i].kind = material->lobes[i].kind;
        shape.lobe[i].a = shape.lobe[i].b = material->lobes[i].alpha;
    }
    *out = shape;
    return wis_material_init(out, NULL);
}

wis_point bsdf_point(const Bsdf *b, const wis_material *shape) {
    wis_point point = {0};
    point.size = sizeof point;
    point.material = shape;
    vec3_store(b->normal, point.normal);
    vec3_store(b->wo, point.wo);
    for (uint32_t i = 0; i < b->material->lobe_count; i++) {
        vec3_store(vec3_load(b->material->lobes[i].weight), point.weight[i]);
        vec3_store(vec3_load(b->material->lobes[i].f0), point.f0[i]);
    }
    return point;
}
