/* Meshes by Assimp, and a knot for those who have none. */
#include "mesh.h"

#include <stdlib.h>
#include <string.h>

#include <assimp/cimport.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

/* Vertices along an edge of the ground, and half its length. */
#define GROUND_SIDE 160u
#define GROUND_HALF 1.6f
/* Vertices along and around the knot. */
#define KNOT_LENGTH 480u
#define KNOT_AROUND 32u

static const char *const no_memory = "out of memory";

/* Makes room for an object and the ground. */
static bool allocate(Mesh *mesh, uint32_t vertices, uint32_t triangles) {
    uint32_t squares = (GROUND_SIDE - 1) * (GROUND_SIDE - 1);
    mesh->object_vertices = vertices;
    mesh->vertex_count = vertices + GROUND_SIDE * GROUND_SIDE;
    mesh->triangle_count = triangles + 2 * squares;
    mesh->positions = malloc(mesh->vertex_count * sizeof *mesh->positions);
    mesh->normals = malloc(mesh->vertex_count * sizeof *mesh->normals);
    mesh->triangles = malloc(mesh->triangle_count * sizeof *mesh->triangles);
    return mesh->positions != NULL && mesh->normals != NULL && mesh->triangles != NULL;
}

static void set_triangle(Mesh *mesh, uint32_t index, uint32_t a, uint32_t b, uint32_t c) {
    mesh->triangles[index][0] = a;
    mesh->triangles[index][1] = b;
    mesh->triangles[index][2] = c;
}

/* Fills in the ground behind an object of so many triangles. */
static void add_ground(Mesh *mesh, uint32_t triangles) {
    uint32_t first = mesh->object_vertices;
    for (uint32_t i = 0; i < GROUND_SIDE * GROUND_SIDE; i++) {
        float x = (float)(i % GROUND_SIDE) / (GROUND_SIDE - 1), z = (float)(i / GROUND_SIDE) / (GROUND_SIDE - 1);
        mesh->positions[first + i] = vec3_make(GROUND_HALF * (2.0f * x - 1.0f), 0.0f, GROUND_HALF * (2.0f * z - 1.0f));
        mesh->normals[first + i] = vec3_make(0.0f, 1.0f, 0.0f);
    }
    for (uint32_t row = 0; row + 1 < GROUND_SIDE; row++) {
        for (uint32_t column = 0; column + 1 < GROUND_SIDE; column++) {
            uint32_t corner = first + row * GROUND_SIDE + column;
            set_triangle(mesh, triangles++, corner, corner + GROUND_SIDE, corner + 1);
            set_triangle(mesh, triangles++, corner + 1, corner + GROUND_SIDE, corner + GROUND_SIDE + 1);
        }
    }
}

/* Scales the object to a height of 1 and puts it on the ground. */
static void stand(Mesh *mesh) {
    Vec3 low = mesh->positions[0], high = low, foot;
    float height;
    for (uint32_t i = 0; i < mesh->object_vertices; i++) {
        Vec3 v = mesh->positions[i];
        low = vec3_make(fminf(low.x, v.x), fminf(low.y, v.y), fminf(low.z, v.z));
        high = vec3_make(fmaxf(high.x, v.x), fmaxf(high.y, v.y), fmaxf(high.z, v.z));
    }
    foot = vec3_make(0.5f * (low.x + high.x), low.y, 0.5f * (low.z + high.z));
    height = high.y > low.y ? high.y - low.y : 1.0f;
    for (uint32_t i = 0; i < mesh->object_vertices; i++) {
        mesh->positions[i] = vec3_scale(vec3_sub(mesh->positions[i], foot), 1.0f / height);
    }
}

static Vec3 from_assimp(struct aiVector3D v) {
    return vec3_make(v.x, v.y, v.z);
}

/* Copies the triangles of all parts. */
static const char *copy(Mesh *mesh, const struct aiScene *scene) {
    uint32_t vertices = 0, triangles = 0;
    for (unsigned m = 0; m < scene->mNumMeshes; m++) {
        vertices += scene->mMeshes[m]->mNumVertices;
        triangles += scene->mMeshes[m]->mNumFaces;
    }
    if (vertices == 0 || triangles == 0) {
        return "no triangle in it";
    }
    if (!allocate(mesh, vertices, triangles)) {
        return no_memory;
    }
    vertices = triangles = 0;
    for (unsigned m = 0; m < scene->mNumMeshes; m++) {
        const struct aiMesh *part = scene->mMeshes[m];
        for (unsigned i = 0; i < part->mNumFaces; i++) {
            const unsigned *corner = part->mFaces[i].mIndices;
            set_triangle(mesh, triangles++, vertices + corner[0], vertices + corner[1], vertices + corner[2]);
        }
        for (unsigned i = 0; i < part->mNumVertices; i++) {
            Vec3 normal = from_assimp(part->mNormals[i]);
            float squared = vec3_dot(normal, normal);
            mesh->positions[vertices] = from_assimp(part->mVertices[i]);
            mesh->normals[vertices++] = squared > 0.5f ? vec3_normalise(normal) : vec3_make(0.0f, 1.0f, 0.0f);
        }
    }
    stand(mesh);
    add_ground(mesh, triangles);
    return NULL;
}

const char *mesh_read(Mesh *mesh, const char *path) {
    unsigned steps = aiProcess_RemoveComponent | aiProcess_Triangulate | aiProcess_SortByPType |
                     aiProcess_PreTransformVertices | aiProcess_JoinIdenticalVertices | aiProcess_GenSmoothNormals;
    struct aiPropertyStore *properties = aiCreatePropertyStore();
    const struct aiScene *scene;
    const char *why = "not a mesh that can be read";
    memset(mesh, 0, sizeof *mesh);
    /* Vertices are joined where nothing but their texture coordinates differ; points and lines are left out. */
    aiSetImportPropertyInteger(properties, AI_CONFIG_PP_RVC_FLAGS,
                               aiComponent_NORMALS | aiComponent_TEXCOORDS | aiComponent_COLORS);
    aiSetImportPropertyInteger(properties, AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
    scene = aiImportFileExWithProperties(path, steps, NULL, properties);
    aiReleasePropertyStore(properties);
    if (scene != NULL) {
        why = copy(mesh, scene);
        aiReleaseImport(scene);
    }
    return why;
}

/* The middle of the knot at an angle in [0, 4 pi), upright. */
static Vec3 knot(float angle) {
    float radius = 2.0f + cosf(1.5f * angle);
    return vec3_make(radius * cosf(angle), radius * sinf(angle), sinf(1.5f * angle));
}

const char *mesh_make(Mesh *mesh) {
    uint32_t count = KNOT_LENGTH * KNOT_AROUND, triangle = 0;
    memset(mesh, 0, sizeof *mesh);
    if (!allocate(mesh, count, 2 * count)) {
        return no_memory;
    }
    for (uint32_t i = 0; i < KNOT_LENGTH; i++) {
        float step = 4.0f * PI / KNOT_LENGTH, angle = step * (float)i;
        Vec3 middle = knot(angle), along = vec3_normalise(vec3_sub(knot(angle + step), middle));
        Vec3 across = vec3_normalise(vec3_cross(along, vec3_make(0.0f, 0.0f, 1.0f))), up = vec3_cross(across, along);
        for (uint32_t j = 0; j < KNOT_AROUND; j++) {
            float turn = 2.0f * PI * (float)j / KNOT_AROUND;
            Vec3 normal = vec3_axpy(vec3_scale(across, cosf(turn)), sinf(turn), up);
            uint32_t next = (i + 1) % KNOT_LENGTH * KNOT_AROUND, side = (j + 1) % KNOT_AROUND, here = i * KNOT_AROUND;
            mesh->positions[here + j] = vec3_axpy(middle, 0.45f, normal);
            mesh->normals[here + j] = normal;
            set_triangle(mesh, triangle++, here + j, here + side, next + j);
            set_triangle(mesh, triangle++, here + side, next + side, next + j);
        }
    }
    stand(mesh);
    add_ground(mesh, triangle);
    return NULL;
}

void mesh_free(Mesh *mesh) {
    free(mesh->positions);
    free(mesh->normals);
    free(mesh->triangles);
    memset(mesh, 0, sizeof *mesh);
}
