/* The radiance of the vertices of a mesh under a light that turns, seen from anywhere: triple products of light, BRDF and
 * visibility (Ng et al. 2004, "Triple Product Wavelet Integrals for All-Frequency Relighting").
 *
 * Visibility is made once, in 8 bits. A frame multiplies the turned light by the lobe of each normal and of each reflected
 * direction that some vertex has, on grids of directions, and a vertex adds up what it sees of the nearest four of both. */
#ifndef RELIGHT_FIELD_H
#define RELIGHT_FIELD_H

#include "../render/light.h"
#include "../render/parallel.h"
#include "tracer.h"
#include "wis_wavelets.h"

/* Lobes about the directions of a grid. */
typedef struct Grid {
    uint32_t side;
    bool glossy;
    bool *used;        /* cells that some vertex asks for */
    void **product[3]; /* red, green, blue: for each used cell a wis_tree of the light times its lobe */
} Grid;

/* The cells of a grid about a direction. */
typedef struct Place {
    uint32_t cell[4];
    float weight[4];
} Place;

typedef struct Field {
    const Mesh *mesh;
    const Tracer *tracer;
    float (*directions)[3]; /* of the pixels of the octahedral square */
    void **visibility;      /* for each vertex a wis_visibility */
    size_t bytes[PARALLEL_MAX_THREADS]; /* of visibility, by the thread that made it */
    Grid normals, reflected;
    Place *by_normal, *by_reflection; /* for each vertex */
    float *light[3];                  /* pixels */
    Vec3 *radiance;                   /* for each vertex: the result */
} Field;

/* Traces visibility. The mesh and the tracer must live as long. Free the field even on failure. */
wis_status field_init(Field *field, const Mesh *mesh, const Tracer *tracer, unsigned threads);

void field_free(Field *field);

/* Megabytes of all visibility. */
double field_megabytes(const Field *field);

/* Turns the light by an angle about the axis that points up. */
void field_turn_light(Field *field, const Light *light, float angle);

/* Where the vertices reflect to, seen from a place. */
wis_status field_look_from(Field *field, Vec3 eye);

/* Fills radiance. */
wis_status field_shade(Field *field, unsigned threads);

#endif
