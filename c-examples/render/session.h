/* Everything that one run of the program holds. */
#ifndef RENDER_SESSION_H
#define RENDER_SESSION_H

#include "environment.h"
#include "integrate.h"
#include "light.h"
#include "options.h"
#include "reference.h"
#include "render.h"
#include "view.h"

typedef struct Session {
    Options options;
    Light light;
    Environment environment;
    Lighting lighting;
    View view;
    Estimate estimates[METHOD_COUNT];
    Reference reference;
    Vec3 *product_estimates; /* for each point of the view that has a reference; grey, of wis' luminance */
    float *difference;       /* room for one number per reference point */
} Session;

#endif
