/* The converged light at the points of a view, with its own uncertainty. */
#ifndef RENDER_REFERENCE_H
#define RENDER_REFERENCE_H

#include <stddef.h>
#include <stdint.h>

#include "integrate.h"
#include "view.h"

#define REFERENCE_BATCHES 16u

typedef struct Reference {
    size_t count; /* that of the view */
    Vec3 *shadowed, *unshadowed;
    float *shadowed_error, *unshadowed_error; /* standard errors of the luminances */
} Reference;

/* Compensated MIS with random numbers of its own, in REFERENCE_BATCHES independent batches; spp is a multiple of twice
 * that number. Free the reference even on failure. */
wis_status reference_render(Reference *out, const Lighting *lighting, const View *view, uint32_t spp,
                            unsigned threads);

void reference_free(Reference *reference);

#endif
