/* What each rendering thread owns. */
#ifndef RENDER_WORKERS_H
#define RENDER_WORKERS_H

#include <stddef.h>
#include <stdint.h>

#include "integrate.h"

typedef struct Worker {
    Workspace workspace;
    LightSample *samples;
    double sampling_seconds, shadow_seconds; /* CPU time spent so far */
} Worker;

/* Gives every thread a workspace for spp samples a point and room for `samples` samples in all.
 * Free the workers even on failure. */
wis_status workers_init(Worker **out, unsigned threads, uint32_t spp, size_t samples);

void workers_free(Worker *workers, unsigned threads);

#endif
