/* Rendering a view with one of the compared methods. */
#ifndef RENDER_RENDER_H
#define RENDER_RENDER_H

#include <stdint.h>

#include "integrate.h"
#include "view.h"

/* Direct light at each point of a view, with and without shadows. */
typedef struct Estimate {
    Vec3 *shadowed, *unshadowed; /* from malloc */
    double sampling_seconds;     /* CPU time of all threads: points, preparation, sampling, BRDF, look-up */
    double shadow_seconds;       /* CPU time of all threads: shadow rays */
} Estimate;

/* Free the estimate even on failure. */
wis_status estimate_render(Estimate *out, Method method, const Lighting *lighting, const View *view, uint32_t spp,
                           unsigned threads);

void estimate_free(Estimate *estimate);

#endif
