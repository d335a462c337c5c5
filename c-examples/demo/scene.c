/* Analytic rays, spheres and plane. All objects are convex, so a shadow ray skips the one it starts from
 * and needs no offset. */
#include "../render/scene.h"

#define PLANE SCENE_SPHERES

static const Vec3 centres[SCENE_SPHERES] = {
    {-4.5f, 1.0f, 0.1f}, {-2.25f, 1.0f, -0.5f}, {0.0f, 1.0f, 0.1f}, {2.25f, 1.0f, -0.5f}, {4.5f, 1.0f, 0.1f},
};
static const float radius = 1.0f;

static const Material materials[SCENE_OBJECTS] = {
    {"Lambert", 1, {{WIS_LOBE_LAMBERT, {0.75f, 0.68f, 0.60f}, {0}, 0}}},
    {"GGX .5", 1, {{WIS_LOBE_GGX, {1, 1, 1}, {0.95f, 0.64f, 0.54f}, 0.5f}}},
    {"GGX .2", 1, {{WIS_LOBE_GGX, {1, 1, 1}, {1.00f, 0.78f, 0.34f}, 0.2f}}},
    {"GGX .05", 1, {{WIS_LOBE_GGX, {1, 1, 1}, {0.91f, 0.92f, 0.92f}, 0.05f}}},
    {"mix", 2,
     {{WIS_LOBE_LAMBERT, {0.12f, 0.30f, 0.42f}, {0}, 0},
      {WIS_LOBE_GGX, {1, 1, 1}, {0.06f, 0.06f, 0.06f}, 0.15f}}},
    {"plane", 1, {{WIS_LOBE_LAMBERT, {0.5f, 0.5f, 0.5f}, {0}, 0}}},
};

const Material *scene_material(uint32_t object) {
    return &materials[object];
}

/* Distance to the nearer intersection with a sphere from outside, INFINITY if missed. */
static float sphere_distance(Vec3 centre, Vec3 origin, Vec3 direction) {
    Vec3 to_centre = vec3_sub(centre, origin);
    float along = vec3_dot(to_centre, direction);
    Vec3 offset = vec3_axpy(to_centre, -along, direction);
    float rest = radius * radius - vec3_dot(offset, offset);
    return along > 0.0f && rest > 0.0f ? along - sqrtf(rest) : INFINITY;
}

bool scene_first_hit(Vec3 origin, Vec3 direction, ShadingPoint *out) {
    float nearest = direction.y < 0.0f ? -origin.y / direction.y : INFINITY;
    uint32_t object = PLANE;
    for (uint32_t i = 0; i < SCENE_SPHERES; i++) {
        float distance = sphere_distance(centres[i], origin, direction);
        if (distance < nearest) {
            nearest = distance;
            object = i;
        }
    }
    if (isinf(nearest)) {
        return false;
    }
    out->object = object;
    out->position = vec3_axpy(origin, nearest, direction);
    out->normal = vec3_make(0.0f, 1.0f, 0.0f);
    if (object != PLANE) {
        out->normal = vec3_normalise(vec3_sub(out->position, centres[object]));
    }
    out->wo = vec3_scale(direction, -1.0f);
    return true;
}

static bool sphere_blocks(Vec3 centre, Vec3 origin, Vec3 direction) {
    Vec3 to_centre = vec3_sub(centre, origin);
    float along = vec3_dot(to_centre, direction);
    Vec3 offset = vec3_axpy(to_centre, -along, direction);
    return along > 0.0f && vec3_dot(offset, offset) < radius * radius;
}

uint32_t scene_portals(const ShadingPoint *point, wis_portal out[WIS_MAX_PORTALS]) {
    (void)point;
    (void)out;
    return 0;
}

bool scene_occluded(const ShadingPoint *point, Vec3 wi) {
    if (wi.y < 0.0f) {
        return true;
    }
    for (uint32_t i = 0; i < SCENE_SPHERES; i++) {
        if (i != point->object && sphere_blocks(centres[i], point->position, wi)) {
            return true;
        }
    }
    return false;
}
