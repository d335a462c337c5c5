/* The BRDFs of the scene: sums of Lambert and isotropic GGX lobes, as a client of wis owns them. */
#ifndef RENDER_MATERIAL_H
#define RENDER_MATERIAL_H

#include "vec3.h"
#include "wis.h"

#define MATERIAL_LOBES 2

typedef struct Lobe {
    uint32_t kind; /* WIS_LOBE_LAMBERT or WIS_LOBE_GGX */
    float weight[3], f0[3], alpha;
} Lobe;

typedef struct Material {
    const char *name;
    uint32_t lobe_count;
    Lobe lobes[MATERIAL_LOBES];
} Material;

/* A material seen from wo at a point: everything that does not depend on wi. */
typedef struct Bsdf {
    const Material *material;
    Vec3 tangent, bitangent, normal, wo;
    float cos_o;
    float choice[MATERIAL_LOBES]; /* probability to sample the lobe */
    float root_o[MATERIAL_LOBES]; /* GGX: sqrt(a^2 + (1 - a^2) cos_o^2) */
} Bsdf;

Bsdf bsdf_begin(const Material *material, Vec3 normal, Vec3 wo);

/* f cos for light from wi, 0 below the horizon; *pdf (if not NULL) is the density of bsdf_sample at wi. */
Vec3 bsdf_eval(const Bsdf *bsdf, Vec3 wi, float *pdf);

/* A direction from two numbers in [0, 1); it may lie below the horizon, where f is 0. */
Vec3 bsdf_sample(const Bsdf *bsdf, const float u[2]);

/* The shapes of a material's lobes, once. */
wis_status material_shape(const Material *material, wis_material *out);

/* A hit as wis knows it: directions, and what the lobes weigh there. `shape` is of material_shape. */
wis_point bsdf_point(const Bsdf *bsdf, const wis_material *shape);

#endif
