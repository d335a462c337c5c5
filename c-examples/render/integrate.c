/* The estimators. All use the same BRDF and the same look-up, and each evaluates only what its own weights need. */
#include "integrate.h"

#include <stdlib.h>

#include "../direct.h"

const char *method_name(Method method) {
    static const char *const names[METHOD_COUNT] = {
        "environment", "BRDF", "MIS", "compensated MIS", "wis_direct",
    };
    return names[method];
}

wis_status lighting_init(Lighting *out, const Light *light, unsigned threads) {
    wis_status status;
    out->light = light;
    status = environment_build(&out->environment, light, 0, threads);
    if (status == WIS_OK) {
        status = environment_build(&out->compensated, light, WIS_ENVIRONMENT_COMPENSATED, threads);
    }
    for (uint32_t i = 0; i < SCENE_OBJECTS && status == WIS_OK; i++) {
        status = material_shape(scene_material(i), &out->shapes[i]);
    }
    return status;
}

void lighting_free(Lighting *lighting) {
    environment_free(&lighting->environment);
    environment_free(&lighting->compensated);
}

wis_status workspace_init(Workspace *w, uint32_t capacity, uint32_t candidates) {
    wis_sampler_config config = {0};
    wis_memory_size size;
    wis_status status;
    void *memory;
    w->visibility = NULL;
    config.size = sizeof config;
    config.rays = capacity;
    config.candidates_per_ray = candidates;
    status = wis_sampler_size(&config, &size, NULL);
    if (status != WIS_OK) {
        return status;
    }
    memory = malloc(size.bytes);
    w->u = malloc(capacity * sizeof *w->u);
    w->pdf = malloc(capacity * sizeof *w->pdf);
    w->drawn = malloc(capacity * sizeof *w->drawn);
    w->ray = malloc(capacity * sizeof *w->ray);
    if (memory == NULL || w->u == NULL || w->pdf == NULL || w->drawn == NULL || w->ray == NULL) {
        free(memory);
        return WIS_MEMORY_TOO_SMALL;
    }
    return wis_sampler_init(&config, memory, size.bytes, &w->sampler, NULL);
}

void workspace_free(Workspace *w) {
    free(w->sampler);
    free(w->u);
    free(w->pdf);
    free(w->drawn);
    free(w->ray);
}

/* f L cos x weight; the light is looked up only where it counts. */
static LightSample weigh(const Lighting *l, Vec3 wi, Vec3 f_cos, float weight) {
    LightSample sample = {wi, {0.0f, 0.0f, 0.0f}};
    if (f_cos.x + f_cos.y + f_cos.z > 0.0f) {
        sample.radiance = vec3_scale(vec3_mul(f_cos, light_radiance(l->light, wi)), weight);
    }
    return sample;
}

/* Hits of a pixel go on in one sequence. */
static wis_status draw_points(Workspace *w, const ShadingPoint *point, uint32_t pass, uint32_t count) {
    uint32_t seed = wis_pixel_seed(point->x, point->y, pass);
    return wis_points_sobol(seed, point->sample * count, count, w->u[0], 0);
}

static wis_status draw_light(const Environment *e, Workspace *w, uint32_t count) {
    return wis_sample(w->sampler, e->handle, NULL, count, w->u[0], 0, w->drawn, 0);
}

static wis_status by_environment(const Lighting *l, Workspace *w, const Bsdf *b, uint32_t count, LightSample *out) {
    wis_status status = draw_light(&l->environment, w, count);
    for (uint32_t i = 0; i < count && status == WIS_OK; i++) {
        Vec3 wi = vec3_load(w->drawn[i].wi);
        /* The pdf is 0 where the map is black: such a sample counts, and brings nothing. */
        float weight = w->drawn[i].pdf > 0.0f ? 1.0f / (w->drawn[i].pdf * (float)count) : 0.0f;
        out[i] = weigh(l, wi, bsdf_eval(b, wi, NULL), weight);
    }
    return status;
}

static wis_status by_bsdf(const Lighting *l, Workspace *w, const Bsdf *b, uint32_t count, LightSample *out) {
    for (uint32_t i = 0; i < count; i++) {
        float pdf;
        Vec3 wi = bsdf_sample(b, w->u[i]);
        Vec3 f_cos = bsdf_eval(b, wi, &pdf);
        out[i] = weigh(l, wi, f_cos, 1.0f / (pdf * (float)count));
    }
    return WIS_OK;
}

/* Balance heuristic: n_light samples of the light's density in w->pdf and n_bsdf of the BRDF's, whichever drew the
 * directions in w->drawn. */
static void weigh_mis(const Lighting *l, const Workspace *w, const Bsdf *b, uint32_t count, uint32_t n_light,
                      uint32_t n_bsdf, LightSample *out) {
    for (uint32_t i = 0; i < count; i++) {
        float bsdf_pdf;
        Vec3 wi = vec3_load(w->drawn[i].wi);
        Vec3 f_cos = bsdf_eval(b, wi, &bsdf_pdf);
        out[i] = weigh(l, wi, f_cos, 1.0f / (w->pdf[i] * (float)n_light + bsdf_pdf * (float)n_bsdf));
    }
}

/* The first half from the light with the points already drawn, the second from the BRDF with fresh ones. */
static wis_status by_mis(const Lighting *l, const Environment *e, Workspace *w, const Bsdf *b,
                         const ShadingPoint *point, uint32_t pass, uint32_t count, LightSample *out) {
    uint32_t n_light = count / 2, n_bsdf = count - n_light;
    wis_status status = draw_light(e, w, n_light);
    if (status == WIS_OK) {
        for (uint32_t i = 0; i < n_light; i++) {
            w->pdf[i] = w->drawn[i].pdf;
        }
        weigh_mis(l, w, b, n_light, n_light, n_bsdf, out);
        status = draw_points(w, point, pass + 1, n_bsdf);
    }
    if (status == WIS_OK) {
        for (uint32_t i = 0; i < n_bsdf; i++) {
            vec3_store(bsdf_sample(b, w->u[i]), w->drawn[i].wi);
        }
        status = wis_pdf(w->sampler, e->handle, NULL, n_bsdf, w->drawn[0].wi, sizeof w->drawn[0], w->pdf, 0);
    }
    if (status == WIS_OK) {
        weigh_mis(l, w, b, n_bsdf, n_light, n_bsdf, out + n_light);
    }
    return status;
}

/* Width of the cells that share what rays saw: a tenth of the height of a thing. */
#define VISIBILITY_CELL 0.1f

wis_point visibility_point(const Workspace *w, const ShadingPoint *at, uint32_t pass) {
    wis_point point = {0};
    float position[3], normal[3];
    vec3_store(at->position, position);
    vec3_store(at->normal, normal);
    point.size = sizeof point;
    point.seed = wis_pixel_seed(at->x, at->y, pass);
    point.visibility = w->visibility;
    if (w->visibility != NULL) {
        wis_visibility_key(position, normal, VISIBILITY_CELL, &point.visibility_key);
    }
    return point;
}

/* The samples of a hit, one after the other. */
struct Reflected {
    const Lighting *lighting;
    const Bsdf *bsdf;
    LightSample *next;
};

static void add_light(Reflected *sum, const float wi[3], float weight) {
    Vec3 direction = vec3_load(wi);
    *sum->next++ = weigh(sum->lighting, direction, bsdf_eval(sum->bsdf, direction, NULL), weight);
}

/* The rays that wis chooses. There may be fewer than `count`: the others add nothing. */
static wis_status by_wis(const Lighting *l, Workspace *w, const Bsdf *b, const ShadingPoint *at, uint32_t pass,
                         uint32_t count, LightSample *out) {
    const LightSample nothing = {{0.0f, 0.0f, 1.0f}, {0.0f, 0.0f, 0.0f}};
    wis_point point = bsdf_point(b, &l->shapes[at->object]);
    wis_point place = visibility_point(w, at, pass);
    Reflected sum = {l, b, out};
    wis_status status;
    point.seed = place.seed;
    point.visibility = place.visibility;
    point.visibility_key = place.visibility_key;
    point.sample = at->sample;
    status = direct_light(w->sampler, l->environment.handle, &point, count, w->ray, &sum);
    while (sum.next < out + count) {
        *sum.next++ = nothing;
    }
    return status;
}

wis_status integrate(Method method, const Lighting *l, Workspace *w, const ShadingPoint *point, uint32_t pass,
                     uint32_t count, LightSample *out) {
    Bsdf b = bsdf_begin(scene_material(point->object), point->normal, point->wo);
    bool mis = method == METHOD_MIS || method == METHOD_MIS_COMPENSATED;
    wis_status status;
    if (method == METHOD_WIS) {
        return by_wis(l, w, &b, point, pass, count, out);
    }
    status = draw_points(w, point, pass, mis ? count / 2 : count);
    if (status != WIS_OK) {
        return status;
    }
    switch (method) {
    case METHOD_ENVIRONMENT:
        return by_environment(l, w, &b, count, out);
    case METHOD_BRDF:
        return by_bsdf(l, w, &b, count, out);
    case METHOD_MIS:
        return by_mis(l, &l->environment, w, &b, point, pass, count, out);
    default:
        return by_mis(l, &l->compensated, w, &b, point, pass, count, out);
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
