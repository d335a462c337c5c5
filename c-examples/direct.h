/* The client's loop around wis_direct. README.md prints it; minimal.c, the demo, the path tracers and the report's harness run it.
 * A file that includes it defines `struct Reflected` and `add_light`. */
#ifndef DIRECT_H
#define DIRECT_H

#include "wis.h"

/* A sum of reflected light, and what add_light must know of the hit. */
typedef struct Reflected Reflected;

/* Adds BSDF x cosine x radiance x weight, if nothing blocks the direction wi. */
static void add_light(Reflected *sum, const float wi[3], float weight);

/* Adds the light at a point, by at most `rays` rays. `ray` has room for them; The status is that of wis_direct. If that call fails, nothing
 * is added. */
static wis_status direct_light(wis_sampler *sampler, const wis_environment *environment, const wis_point *point, uint32_t rays,
                               wis_ray *ray, Reflected *sum) {
    uint32_t count = 0;
    wis_status status = wis_direct(sampler, environment, point, rays, ray, &count);
    for (uint32_t i = 0; i < count; i++) {
        add_light(sum, ray[i].wi, ray[i].weight); /* yours: BSDF x cosine x radiance x weight, if nothing blocks wi */
    }
    return status;
}

#endif
