/* The converged light at some points of a view, with its own uncertainty. */
#ifndef RENDER_REFERENCE_H
#define RENDER_REFERENCE_H

#include <stddef.h>
#include <stdint.h>

#include "integrate.h"
#include "view.h"

#define REFERENCE_BATCHES 16u

/* Every stride-th pixel, in x and y, of a rectangle. */
typedef struct Crop {
    uint32_t x, y, width, height, stride;
} Crop;

typedef struct Reference {
    size_t count;
    size_t *points; /* indices into the view */
    Vec3 *shadowed, *unshadowed;
    float *shadowed_error, *unshadowed_error; /* standard errors of the luminances */
} Reference;

/* MIS with random numbers of its own, in REFERENCE_BATCHES independent batches; spp is a multiple of twice
 * that number. Free the reference even on failure. */
wis_status reference_render(Reference *out, const Lighting *lighting, const View *view, const Crop *crop,
                            uint32_t spp, unsigned threads);

void reference_free(Reference *reference);

#endif
