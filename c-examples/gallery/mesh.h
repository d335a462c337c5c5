/* Triangles to be lit: a mesh file or a knot made here, standing on a ground of small squares. */
#ifndef GALLERY_MESH_H
#define GALLERY_MESH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "../render/vec3.h"

/* The world is y-up. The object is 1 high; its vertices and triangles come first, the ground's after them. */
typedef struct Mesh {
    uint32_t vertex_count, triangle_count;
    uint32_t object_vertices; /* the others are the ground's */
    Vec3 *positions, *normals;  /* of unit length; from malloc */
    uint32_t (*triangles)[3];
} Mesh;

/* Reads any file that Assimp reads, scales it and puts it on a ground. Returns NULL, or why it cannot. Free it even then. */
const char *mesh_read(Mesh *mesh, const char *path);

/* A trefoil knot on a ground. Returns NULL, or why it cannot. Free it even then. */
const char *mesh_make(Mesh *mesh);

void mesh_free(Mesh *mesh);

#endif
