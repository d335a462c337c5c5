/* The wis environment of a light, built by several threads. */
#ifndef RENDER_ENVIRONMENT_H
#define RENDER_ENVIRONMENT_H

#include "light.h"
#include "wis.h"

typedef struct Environment {
    void *memory; /* what the handle points into, from malloc */
    const wis_environment *handle;
} Environment;

/* flags: WIS_ENVIRONMENT_*. Free the environment even on failure. */
wis_status environment_build(Environment *out, const Light *light, uint32_t flags, unsigned threads);

void environment_free(Environment *environment);

#endif
