/* The estimators. All use the same BRDF, the same look-up and the same rays. */
#include "integrate.h"

#include <stdlib.h>

#include "../direct.h"

/* Width of the cells that share what rays saw: a tenth of the height of a thing. */
#define VISIBILITY_CELL 0.1f

const char *method_name(Method method) {
    static const char *const names[METHOD_COUNT] = {"environment", "BRDF", "MIS", "compensated MIS", "wis_direct"};
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

wis_status workspace_init(Workspace *w, uint32_t capacity) {
    wis_sampler_config config = {.size = sizeof config, .rays = capacity};
    wis_memory_size size;
    wis_status status = wis_sampler_size(&config, &size, NULL);
    void *memory = status == WIS_OK ? malloc(size.bytes) : NULL;
    if (memory == NULL) {
        return status == WIS_OK ? WIS_MEMORY_TOO_SMALL : status;
    }
    return wis_sampler_init(&config, memory, size.bytes, &w->sampler, NULL);
}

void workspace_free(Workspace *w) {
    free(w->sampler);
    w->sampler = NULL;
}

/* A hit, and the light that it reflects. */
struct Reflected {
    const Lighting *lighting;
    const ShadingPoint *at;
    const Bsdf *bsdf;
    const wis_point *notes; /* where rays are noted for the passes that follow; NULL: nowhere */
    Vec3 light;
};

/* BSDF x cosine x radiance x weight, if nothing blocks the direction. What brings nothing needs no ray. */
static void add(Reflected *sum, const float wi[3], Vec3 f_cos, float weight) {
    Vec3 direction = vec3_load(wi), light = {0.0f, 0.0f, 0.0f};
    uint8_t reached;
    if (luminance(f_cos) > 0.0f) {
        light = vec3_scale(vec3_mul(f_cos, light_radiance(sum->lighting->light, direction)), weight);
    }
    if (luminance(light) > 0.0f) {
        reached = !scene_occluded(sum->at, direction);
        sum->light = reached ? vec3_add(sum->light, light) : sum->light;
        if (sum->notes != NULL) {
            wis_visibility_cache_record(sum->notes, 1, wi, 0, &reached);
        }
    }
}

static void add_light(Reflected *sum, const float wi[3], float weight) {
    add(sum, wi, bsdf_eval(sum->bsdf, vec3_load(wi), NULL), weight);
}

/* Hits of a pixel go on in one sequence. */
static wis_status draw_points(Workspace *w, const ShadingPoint *point, uint32_t pass, uint32_t count) {
    return wis_points_sobol(pixel_seed(point->x, point->y, pass), point->sample * count, count, w->u[0], 0);
}

/* Balance heuristic. The density may be 0 where the map is black: such a sample counts, and brings nothing. */
static void add_drawn(Reflected *sum, Workspace *w, uint32_t count, uint32_t n_light, uint32_t n_bsdf) {
    for (uint32_t i = 0; i < count; i++) {
        float pdf, density = n_light > 0 ? (float)n_light * w->pdf[i] : 0.0f;
        Vec3 f_cos = bsdf_eval(sum->bsdf, vec3_load(w->drawn[i].wi), n_bsdf > 0 ? &pdf : NULL);
        density += n_bsdf > 0 ? (float)n_bsdf * pdf : 0.0f;
        add(sum, w->drawn[i].wi, f_cos, density > 0.0f ? 1.0f / density : 0.0f);
    }
}

static wis_status from_light(Reflected *sum, const Environment *e, Workspace *w, uint32_t pass, uint32_t n_light, uint32_t n_bsdf) {
    wis_status status = draw_points(w, sum->at, pass, n_light);
    if (status == WIS_OK) {
        status = wis_sample(w->sampler, e->handle, NULL, n_light, w->u[0], 0, w->drawn, 0);
    }
    for (uint32_t i = 0; i < n_light && status == WIS_OK; i++) {
        w->pdf[i] = w->drawn[i].pdf;
    }
    if (status == WIS_OK) {
        add_drawn(sum, w, n_light, n_light, n_bsdf);
    }
    return status;
}

static wis_status from_bsdf(Reflected *sum, const Environment *e, Workspace *w, uint32_t pass, uint32_t n_light, uint32_t n_bsdf) {
    wis_status status = draw_points(w, sum->at, pass, n_bsdf);
    for (uint32_t i = 0; i < n_bsdf && status == WIS_OK; i++) {
        vec3_store(bsdf_sample(sum->bsdf, w->u[i]), w->drawn[i].wi);
    }
    if (status == WIS_OK && n_light > 0) {
        status = wis_pdf(w->sampler, e->handle, NULL, n_bsdf, w->drawn[0].wi, sizeof w->drawn[0], w->pdf, 0);
    }
    if (status == WIS_OK) {
        add_drawn(sum, w, n_bsdf, n_light, n_bsdf);
    }
    return status;
}

/* The rays that wis chooses. */
static wis_status by_wis(Reflected *sum, Workspace *w, uint32_t pass, uint32_t count) {
    const ShadingPoint *at = sum->at;
    wis_point point = bsdf_point(sum->bsdf, &sum->lighting->shapes[at->object]);
    wis_portal portals[WIS_MAX_PORTALS];
    float position[3], normal[3];
    point.seed = pixel_seed(at->x, at->y, pass);
    point.sample = at->sample;
    point.portals = portals;
    point.portal_count = scene_portals(at, portals);
    point.visibility = w->visibility;
    if (w->visibility != NULL) {
        vec3_store(at->position, position);
        vec3_store(at->normal, normal);
        wis_visibility_key(position, normal, VISIBILITY_CELL, &point.visibility_key);
        sum->notes = &point;
    }
    return direct_light(w->sampler, sum->lighting->environment.handle, &point, count, w->ray, sum);
}

wis_status integrate(Method method, const Lighting *l, Workspace *w, const ShadingPoint *point, uint32_t pass, uint32_t count, Vec3 *sum) {
    Bsdf b = bsdf_begin(scene_material(point->object), point->normal, point->wo);
    Reflected light = {l, point, &b, NULL, *sum};
    const Environment *e = method == METHOD_MIS_COMPENSATED ? &l->compensated : &l->environment;
    uint32_t n_bsdf = method == METHOD_BRDF ? count : method == METHOD_ENVIRONMENT ? 0 : count / 2, n_light = count - n_bsdf;
    wis_status status = WIS_OK;
    if (method == METHOD_WIS) {
        status = by_wis(&light, w, pass, count);
    } else {
        status = n_light > 0 ? from_light(&light, e, w, pass, n_light, n_bsdf) : WIS_OK;
        if (status == WIS_OK && n_bsdf > 0) {
            status = from_bsdf(&light, e, w, pass + 1, n_light, n_bsdf);
        }
    }
    *sum = light.light;
    return status;
}
