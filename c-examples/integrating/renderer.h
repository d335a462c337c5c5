/* The renderer that the pages' code belongs to: what stands here is yours. Read by scripts/check-integrating.sh. */
#ifndef RENDERER_H
#define RENDERER_H
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <wis.h>
#include <wis_lights.h>

typedef struct rgb { float r, g, b; } rgb;
typedef struct hit { float position[3], normal[3], tangent[3], wo[3]; const wis_material *material; rgb albedo, f0; } hit;
typedef struct path { uint32_t pixel, bounce, sample; int after_mirror; } path;

rgb bsdf_eval(const hit *at, const float wi[3]);                 /* with the cosine */
float bsdf_sample(const hit *at, float wi[3], rgb *value);       /* the pdf; value: BSDF x cosine / pdf */
float bsdf_pdf(const hit *at, const float wi[3]);
rgb radiance(const float wi[3]);                                 /* the map, as the integrator looks it up */
int occluded(const hit *at, const float wi[3]);
float random_number(void);
void next_2d(float u[2]);                                        /* of your own sampler */
void failed(wis_status status);
rgb add(rgb a, rgb b);
rgb times(rgb a, rgb b);
rgb scaled(rgb a, float factor);

static inline void check(wis_status status) {
    if (status != WIS_OK) failed(status);
}

#endif
