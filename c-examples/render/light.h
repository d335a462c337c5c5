/* The environment light: a lat-long RGB map and its look-up, as a client of wis owns them. */
#ifndef RENDER_LIGHT_H
#define RENDER_LIGHT_H

#include <stdbool.h>
#include <stdint.h>

#include "vec3.h"

/* Columns are azimuth, rows are the polar angle from map +z, as WIS_LAYOUT_LATLONG. */
typedef struct Light {
    uint32_t width, height;
    float *texels; /* RGB, packed, from malloc */
} Light;

/* The world is y-up and the map z-up: row-major 3x3, world (x, y, z) = map (x, z, -y). */
extern const float light_world_from_map[9];

/* Reads a Radiance or OpenEXR file, and clamps it to 0 to 1e30: no channel is negative, NaN or infinite. Returns NULL, or the path, what was
 * found and what is wanted. Free the light even on failure. */
const char *light_read(Light *light, const char *path);

/* Makes the built-in map: a dim sky, a small sun and bright windows. Returns NULL, or why it cannot. */
const char *light_make_sky(Light *light);

void light_free(Light *light);

/* RGB radiance from world direction wi. */
Vec3 light_radiance(const Light *light, Vec3 wi);

#endif
