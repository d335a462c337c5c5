/* The estimators. All use the same Sobol points per pixel, the same BRDF and the same look-up, and each
 * evaluates only what its own weights need. */
#include "integrate.h"

#include <stdlib.h>

const char *method_name(Method method) {
    static const char *const names[METHOD_COUNT] = {
        "environment", "BRDF", "MIS balance", "MIS compensated", "wis",
    };
    return names[method];
}

wis_status workspace_init(Workspace *w, const Lighting *lighting, size_t capacity) {
    wis_memory_size size;
    wis_status status = wis_wavelet_product_size(&lighting->product, &size, NULL);
    if (status != WIS_OK) {
        return status;
    }
    w->product_bytes = size.bytes;
    w->product = malloc(size.bytes);
    w->u = malloc(capacity * sizeof *w->u);
    w->wi = malloc(capacity * sizeof *w->wi);
    w->pdf = malloc(capacity * sizeof *w->pdf);
    return w->product && w->u && w->wi && w->pdf ? WIS_OK : WIS_MEMORY_TOO_SMALL;
}

void workspace_free(Workspace *w) {
    free(w->product);
    free(w->u);
    free(w->wi);
    free(w->pdf);
}

/* f L cos / density; the light is looked up only where it counts. */
static LightSample weigh(const Lighting *l, Vec3 wi, Vec3 f_cos, float density) {
    LightSample sample = {wi, {0.0f, 0.0f, 0.0f}};
    if (density > 0.0f && f_cos.x + f_cos.y + f_cos.z > 0.0f) {
        Vec3 radiance = vec3_mul(f_cos, light_radiance(l->light, wi));
        sample.radiance = vec3_scale(radiance, 1.0f / density);
    }
    return sample;
}

static wis_status draw_points(Workspace *w, const ShadingPoint *point, uint32_t pass, uint32_t count) {
    uint32_t seed = wis_pixel_seed(point->x, point->y, pass);
    return wis_points_sobol(seed, 0, count, w->u[0], sizeof w->u[0]);
}

static wis_status draw_environment(const Lighting *l, Workspace *w, uint32_t distribution, uint32_t count) {
    return wis_wavelet_light_sample_lanes(l->environment, distribution, light_world_from_map, l->product.cpu_level, count,
                                        w->u[0], sizeof w->u[0], w->wi[0], sizeof w->wi[0], w->pdf,
                                        sizeof w->pdf[0]);
}

static void draw_bsdf(Workspace *w, const Bsdf *b, uint32_t count) {
    for (uint32_t i = 0; i < count; i++) {
        vec3_store(bsdf_sample(b, w->u[i]), w->wi[i]);
    }
}

/* Weighs directions that were drawn with the densities in w->pdf. */
static void weigh_all(const Lighting *l, const Workspace *w, const Bsdf *b, uint32_t count, LightSample *out) {
    for (uint32_t i = 0; i < count; i++) {
        Vec3 wi = vec3_load(w->wi[i]);
        Vec3 f_cos = bsdf_eval(b, wi, NULL);
        out[i] = weigh(l, wi, f_cos, w->pdf[i] * (float)count);
    }
}

/* Balance heuristic: n_light samples of the density in w->pdf and n_bsdf of the BRDF's, whichever drew wi. */
static void weigh_mis(const Lighting *l, const Workspace *w, const Bsdf *b, uint32_t count, uint32_t n_light,
                      uint32_t n_bsdf, LightSample *out) {
    for (uint32_t i = 0; i < count; i++) {
        float bsdf_pdf;
        Vec3 wi = vec3_load(w->wi[i]);
        Vec3 f_cos = bsdf_eval(b, wi, &bsdf_pdf);
        out[i] = weigh(l, wi, f_cos, w->pdf[i] * (float)n_light + bsdf_pdf * (float)n_bsdf);
    }
}

static wis_status by_environment(const Lighting *l, Workspace *w, const Bsdf *b, uint32_t count,
                                 LightSample *out) {
    wis_status status = draw_environment(l, w, WIS_DISTRIBUTION_PLAIN, count);
    if (status == WIS_OK) {
        weigh_all(l, w, b, count, out);
    }
    return status;
}

static wis_status by_bsdf(const Lighting *l, Workspace *w, const Bsdf *b, uint32_t count, LightSample *out) {
    draw_bsdf(w, b, count);
    for (uint32_t i = 0; i < count; i++) {
        float pdf;
        Vec3 wi = vec3_load(w->wi[i]);
        Vec3 f_cos = bsdf_eval(b, wi, &pdf);
        out[i] = weigh(l, wi, f_cos, pdf * (float)count);
    }
    return WIS_OK;
}

/* The first half from the light with the points already drawn, the second from the BRDF with fresh ones. */
static wis_status by_mis(const Lighting *l, Workspace *w, const Bsdf *b, uint32_t distribution,
                         const ShadingPoint *point, uint32_t pass, uint32_t count, LightSample *out) {
    uint32_t n_light = count / 2, n_bsdf = count - n_light;
    wis_status status = draw_environment(l, w, distribution, n_light);
    if (status == WIS_OK) {
        weigh_mis(l, w, b, n_light, n_light, n_bsdf, out);
        status = draw_points(w, point, pass + 1, n_bsdf);
    }
    if (status == WIS_OK) {
        draw_bsdf(w, b, n_bsdf);
        status = wis_wavelet_light_pdf_lanes(l->environment, distribution, light_world_from_map, l->product.cpu_level,
                                           n_bsdf, w->wi[0], sizeof w->wi[0], w->pdf, sizeof w->pdf[0]);
    }
    if (status == WIS_OK) {
        weigh_mis(l, w, b, n_bsdf, n_light, n_bsdf, out + n_light);
    }
    return status;
}

static wis_status prepare(const Lighting *l, Workspace *w, const Bsdf *b, const wis_wavelet_product **product) {
    wis_wavelet_query query = bsdf_query(b);
    return wis_wavelet_product_prepare(l->environment, &query, &l->product, w->product, w->product_bytes, product, NULL);
}

static wis_status by_product(const Lighting *l, Workspace *w, const Bsdf *b, uint32_t count, LightSample *out) {
    const wis_wavelet_product *product;
    wis_status status = prepare(l, w, b, &product);
    if (status == WIS_OK) {
        status = wis_wavelet_product_sample_lanes(l->environment, product, l->product.cpu_level, count, w->u[0], sizeof w->u[0],
                                          w->wi[0], sizeof w->wi[0], w->pdf, sizeof w->pdf[0]);
    }
    if (status == WIS_OK) {
        weigh_all(l, w, b, count, out);
    }
    return status;
}

wis_status integrate(Method method, const Lighting *l, Workspace *w, const ShadingPoint *point, uint32_t pass,
                     uint32_t count, LightSample *out) {
    Bsdf b = bsdf_begin(scene_material(point->object), point->normal, point->wo);
    bool mis = method == METHOD_MIS || method == METHOD_MIS_COMPENSATED;
    wis_status status = draw_points(w, point, pass, mis ? count / 2 : count);
    if (status != WIS_OK) {
        return status;
    }
    switch (method) {
    case METHOD_ENVIRONMENT:
        return by_environment(l, w, &b, count, out);
    case METHOD_BRDF:
        return by_bsdf(l, w, &b, count, out);
    case METHOD_MIS:
        return by_mis(l, w, &b, WIS_DISTRIBUTION_PLAIN, point, pass, count, out);
    case METHOD_MIS_COMPENSATED:
        return by_mis(l, w, &b, WIS_DISTRIBUTION_COMPENSATED, point, pass, count, out);
    default:
        return by_product(l, w, &b, count, out);
    }
}

static bool is_black(Vec3 rgb) {
    return rgb.x == 0.0f && rgb.y == 0.0f && rgb.z == 0.0f;
}

Vec3 sum_visible(const ShadingPoint *point, const LightSample *samples, uint32_t count) {
    Vec3 sum = {0.0f, 0.0f, 0.0f};
    for (uint32_t i = 0; i < count; i++) {
        if (!is_black(samples[i].radiance) && !scene_occluded(point, samples[i].wi)) {
            sum = vec3_add(sum, samples[i].radiance);
        }
    }
    return sum;
}

Vec3 sum_unshadowed(const LightSample *samples, uint32_t count) {
    Vec3 sum = {0.0f, 0.0f, 0.0f};
    for (uint32_t i = 0; i < count; i++) {
        sum = vec3_add(sum, samples[i].radiance);
    }
    return sum;
}

wis_status integrate_estimate(const Lighting *l, Workspace *w, const ShadingPoint *point, double *out) {
    Bsdf b = bsdf_begin(scene_material(point->object), point->normal, point->wo);
    const wis_wavelet_product *product;
    wis_status status = prepare(l, w, &b, &product);
    return status == WIS_OK ? wis_wavelet_product_estimate(l->environment, product, out) : status;
}
