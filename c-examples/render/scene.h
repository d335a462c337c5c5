/* The scene: five spheres of different materials on a plane, in a y-up world. */
#ifndef RENDER_SCENE_H
#define RENDER_SCENE_H

#include <stdbool.h>
#include <stdint.h>

#include "material.h"
#include "vec3.h"

#define SCENE_SPHERES 5
#define SCENE_OBJECTS (SCENE_SPHERES + 1) /* the last one is the plane */

/* Where a camera ray met the scene. */
typedef struct ShadingPoint {
    uint32_t x, y; /* pixel */
    uint32_t sample; /* number of this hit among those of its pixel: 0, 1, 2 ... */
    uint32_t object;
    Vec3 position, normal, wo;
} ShadingPoint;

const Material *scene_material(uint32_t object);

/* Fills the object, position, normal and wo of *out and returns true if the ray meets something. */
bool scene_first_hit(Vec3 origin, Vec3 direction, ShadingPoint *out);

/* true if light from direction wi, above the horizon of the point, is blocked by an object. */
bool scene_occluded(const ShadingPoint *point, Vec3 wi);

/* Writes the portals that light comes through, relative to a point, and answers how many; 0: light comes from everywhere. */
uint32_t scene_portals(const ShadingPoint *point, wis_portal out[WIS_MAX_PORTALS]);

#endif
