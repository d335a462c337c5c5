/* Direct light at one point, sampled in five ways. */
#ifndef RENDER_INTEGRATE_H
#define RENDER_INTEGRATE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "environment.h"
#include "light.h"
#include "scene.h"
#include "vec3.h"

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

/* What each thread owns. */
typedef struct Workspace {
    wis_sampler *sampler; /* from malloc */
    wis_visibility_cache *visibility; /* what rays of earlier passes saw; NULL: not known */
    float (*u)[2];
    float *pdf;
    wis_drawn *drawn;
    wis_ray *ray;
} Workspace;

/* A direction and what it adds to the estimate if nothing blocks it. */
typedef struct LightSample {
    Vec3 wi;
    Vec3 radiance;
} LightSample;

/* Makes room for `capacity` samples at a point, at most 4096. wis_direct chooses each ray among `candidates`; 0: the library's number.
 * Free the workspace even on failure. */
wis_status workspace_init(Workspace *workspace, uint32_t capacity, uint32_t candidates);

void workspace_free(Workspace *workspace);

/* The pixel and the place of a point, as wis knows them. */
wis_point visibility_point(const Workspace *workspace, const ShadingPoint *point, uint32_t pass);

/* Fills out[0 .. count - 1], whose radiances add up to an unbiased estimate of the unshadowed light;
 * count <= the workspace's capacity. Each pass gives a pixel independent random numbers; MIS uses two passes. */
wis_status integrate(Method method, const Lighting *lighting, Workspace *workspace, const ShadingPoint *point,
                     uint32_t pass, uint32_t count, LightSample *out);

/* The sum of the radiances that reach the point; samples that carry nothing need no ray. */
Vec3 sum_visible(const ShadingPoint *point, const LightSample *samples, uint32_t count);

/* The sum of the radiances as if nothing blocked them. */
Vec3 sum_unshadowed(const LightSample *samples, uint32_t count);

#endif
