/* Everything that one run of the program holds. */
#ifndef RENDER_SESSION_H
#define RENDER_SESSION_H

#include "integrate.h"
#include "light.h"
#include "options.h"
#include "reference.h"
#include "render.h"
#include "view.h"

typedef struct Session {
    Options options;
    Light light;
    Lighting lighting;
    View view;
    Estimate estimates[METHOD_COUNT];
    Reference reference;
    float *difference;       /* room for one number per point */
} Session;

#endif
