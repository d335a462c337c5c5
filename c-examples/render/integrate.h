/* Direct light at one point, sampled in five ways. */
#ifndef RENDER_INTEGRATE_H
#define RENDER_INTEGRATE_H

#include "environment.h"
#include "scene.h"
#include "seed.h"

typedef enum Method {
    METHOD_ENVIRONMENT,     /* the light's density alone */
    METHOD_BRDF,            /* the BRDF's density alone */
    METHOD_MIS,             /* half of each, balance heuristic (Veach 1997) */
    METHOD_MIS_COMPENSATED, /* the same with the compensated light density (Karlik et al. 2019) */
    METHOD_WIS,             /* the rays that wis_direct chooses */
    METHOD_COUNT
} Method;

const char *method_name(Method method);

/* What all threads read. */
typedef struct Lighting {
    const Light *light;
    Environment environment, compensated;
    wis_material shapes[SCENE_OBJECTS];
} Lighting;

/* Builds both environments and the shapes of all materials. Free the lighting even on failure. */
wis_status lighting_init(Lighting *out, const Light *light, unsigned threads);

void lighting_free(Lighting *lighting);

#define MAX_SAMPLES 64 /* at a point */

/* What each thread owns. */
typedef struct Workspace {
    wis_sampler *sampler;             /* from malloc */
    wis_visibility_cache *visibility; /* what rays of earlier passes saw; NULL: not known */
    float u[MAX_SAMPLES][2], pdf[MAX_SAMPLES];
    wis_drawn drawn[MAX_SAMPLES];
    wis_ray ray[MAX_SAMPLES];
} Workspace;

/* For `capacity` samples at a point. Free the workspace even on failure. */
wis_status workspace_init(Workspace *workspace, uint32_t capacity);

void workspace_free(Workspace *workspace);

/* Adds an unbiased estimate of the light at a point, of `count` samples, an even number of at most the workspace's capacity. Each pass
 * gives a pixel independent random numbers; MIS uses two passes. */
wis_status integrate(Method method, const Lighting *lighting, Workspace *workspace, const ShadingPoint *point, uint32_t pass,
                     uint32_t count, Vec3 *sum);

#endif
