/* Rays against a mesh, by Embree. */
#ifndef GALLERY_TRACER_H
#define GALLERY_TRACER_H

#include <embree3/rtcore.h>

#include "mesh.h"

typedef struct Tracer {
    RTCDevice device;
    RTCScene scene;
} Tracer;

/* Where a ray meets a triangle: its number, and the weights of its second and third corner. */
typedef struct Hit {
    uint32_t triangle;
    float u, v;
} Hit;

/* The mesh may be freed afterwards. Returns false if Embree cannot. Free the tracer even then. */
bool tracer_init(Tracer *tracer, const Mesh *mesh);

void tracer_free(Tracer *tracer);

bool tracer_hit(const Tracer *tracer, Vec3 origin, Vec3 direction, Hit *hit);

bool tracer_occluded(const Tracer *tracer, Vec3 origin, Vec3 direction);

#endif
