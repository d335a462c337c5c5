/* The wis environment of a light, built by several threads. */
#ifndef RENDER_ENVIRONMENT_H
#define RENDER_ENVIRONMENT_H

#include "light.h"
#include "wis_wavelets.h"

typedef struct Environment {
    void *memory; /* what the handle points into, from malloc */
    const wis_wavelet_light *handle;
    wis_wavelet_light_info info;
} Environment;

wis_status environment_build(Environment *out, const Light *light, unsigned threads);

void environment_free(Environment *environment);

#endif
