/* One set at a time: the renderer's scene has no argument for it. */
#include "set.h"

#include <stdlib.h>

#include "tracer.h"

#define DEGREE (PI / 180.0f)
#define SQUARES 5.0f /* of the ground, along a unit */
#define ROOM 1.6f    /* half its width: the ground's edge */
#define CEILING 1.9f
/* Rays leave a surface from this far above it: a ten-thousandth of the thing's height. */
#define OFFSET 1e-4f
/* A shading normal is bent until it sees the viewer at this cosine. */
#define LEAST_COSINE 0.02f

/* A rectangle with an axis that does not change: 0 is x, 1 is y, 2 is z. */
typedef struct Part {
    int axis;
    float place, low[2], high[2]; /* along the two other axes, in their order */
} Part;

/* Four parts around each opening; the wall to the right, the one behind the thing and the one behind the camera are whole. */
static const Part parts[] = {
    {0, -ROOM, {0.0f, -ROOM}, {0.3f, ROOM}},      {0, -ROOM, {1.6f, -ROOM}, {CEILING, ROOM}},
    {0, -ROOM, {0.3f, -ROOM}, {1.6f, -1.0f}},     {0, -ROOM, {0.3f, 1.0f}, {1.6f, ROOM}},
    {1, CEILING, {-ROOM, -ROOM}, {ROOM, -0.9f}},  {1, CEILING, {-ROOM, 0.3f}, {ROOM, ROOM}},
    {1, CEILING, {-ROOM, -0.9f}, {-0.3f, 0.3f}},  {1, CEILING, {0.9f, -0.9f}, {ROOM, 0.3f}},
    {0, ROOM, {0.0f, -ROOM}, {CEILING, ROOM}},    {2, -ROOM, {-ROOM, 0.0f}, {ROOM, CEILING}},
    {2, ROOM, {-ROOM, 0.0f}, {ROOM, CEILING}},
};

/* One in each opening: of the left wall and of the ceiling. */
static const struct { Vec3 corner, edges[2]; } portals[] = {
    {{-ROOM, 0.3f, -1.0f}, {{0.0f, 1.3f, 0.0f}, {0.0f, 0.0f, 2.0f}}},
    {{-0.3f, CEILING, -0.9f}, {{1.2f, 0.0f, 0.0f}, {0.0f, 0.0f, 1.2f}}},
};

static const Material wall = {"wall", 1, {{WIS_LOBE_LAMBERT, {0.60f, 0.56f, 0.50f}, {0}, 0}}};

static struct {
    const Picture *picture;
    Mesh mesh;
    Tracer tracer;
    uint32_t first_of_room; /* vertex */
} set;

static Vec3 rotated(Vec3 v, float degrees) {
    float c = cosf(degrees * DEGREE), s = sinf(degrees * DEGREE);
    return vec3_make(c * v.x + s * v.z, v.y, c * v.z - s * v.x);
}

static Vec3 corner(const Part *part, int index) {
    float a = index & 1 ? part->high[0] : part->low[0], b = index & 2 ? part->high[1] : part->low[1];
    return part->axis == 0 ? vec3_make(part->place, a, b)
                           : part->axis == 1 ? vec3_make(a, part->place, b) : vec3_make(a, b, part->place);
}

static Vec3 inward(const Part *part) {
    float side = part->place > 0.0f ? -1.0f : 1.0f;
    return vec3_make(part->axis == 0 ? side : 0.0f, part->axis == 1 ? -1.0f : 0.0f, part->axis == 2 ? side : 0.0f);
}

static const char *add_room(Mesh *mesh) {
    uint32_t count = (uint32_t)(sizeof parts / sizeof parts[0]);
    uint32_t vertices = mesh->vertex_count + 4 * count, triangles = mesh->triangle_count + 2 * count;
    Vec3 *positions = realloc(mesh->positions, vertices * sizeof *positions);
    Vec3 *normals = positions != NULL ? realloc(mesh->normals, vertices * sizeof *normals) : NULL;
    uint32_t(*corners)[3] = normals != NULL ? realloc(mesh->triangles, triangles * sizeof *corners) : NULL;
    mesh->positions = positions != NULL ? positions : mesh->positions;
    mesh->normals = normals != NULL ? normals : mesh->normals;
    if (corners == NULL) {
        return "out of memory";
    }
    mesh->triangles = corners;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t first = mesh->vertex_count, t = mesh->triangle_count;
        for (int k = 0; k < 4; k++) {
            positions[first + (uint32_t)k] = corner(&parts[i], k);
            normals[first + (uint32_t)k] = inward(&parts[i]);
        }
        for (uint32_t k = 0; k < 2; k++) {
            corners[t + k][0] = first + 3 * k;
            corners[t + k][1] = first + 1;
            corners[t + k][2] = first + 2;
        }
        mesh->vertex_count += 4;
        mesh->triangle_count += 2;
    }
    return NULL;
}

const char *set_build(const Picture *picture, const char *path) {
    Mesh *mesh = &set.mesh;
    const char *why = path != NULL ? mesh_read(mesh, path) : mesh_make(mesh);
    set.picture = picture;
    if (why == NULL) {
        set.first_of_room = mesh->vertex_count;
        why = picture->room ? add_room(mesh) : NULL;
    }
    for (uint32_t i = 0; why == NULL && i < mesh->vertex_count; i++) {
        float angle = picture->set_angle + (i < mesh->object_vertices ? picture->thing_angle : 0.0f);
        mesh->positions[i] = rotated(mesh->positions[i], angle);
        mesh->normals[i] = rotated(mesh->normals[i], angle);
    }
    return why != NULL ? why : tracer_init(&set.tracer, mesh) ? NULL : "Embree cannot trace it";
}

void set_free(void) {
    tracer_free(&set.tracer);
    mesh_free(&set.mesh);
}

Camera set_camera(const Picture *p, uint32_t width, uint32_t height) {
    Vec3 eye = rotated(vec3_make(0.0f, p->eye_height, p->eye_distance), p->set_angle + p->eye_angle);
    return camera_make(eye, vec3_make(0.0f, p->target_height, 0.0f), p->half_width, width, height);
}

const Material *scene_material(uint32_t object) {
    switch (object) {
    case THING: return &set.picture->thing;
    case LIGHT_SQUARE: return &set.picture->light_square;
    case DARK_SQUARE: return &set.picture->dark_square;
    default: return &wall;
    }
}

static uint32_t object_at(uint32_t vertex, Vec3 position) {
    Vec3 local = rotated(position, -set.picture->set_angle);
    int square = ((int)floorf(SQUARES * local.x) + (int)floorf(SQUARES * local.z)) & 1;
    if (vertex >= set.first_of_room) {
        return WALL;
    }
    return vertex < set.mesh.object_vertices ? THING : square ? DARK_SQUARE : LIGHT_SQUARE;
}

bool scene_first_hit(Vec3 origin, Vec3 direction, ShadingPoint *out) {
    Hit hit;
    const uint32_t *t;
    Vec3 a, b, c, side, normal;
    float cosine;
    if (!tracer_hit(&set.tracer, origin, direction, &hit)) {
        return false;
    }
    t = set.mesh.triangles[hit.triangle];
    a = set.mesh.positions[t[0]];
    b = vec3_sub(set.mesh.positions[t[1]], a);
    c = vec3_sub(set.mesh.positions[t[2]], a);
    side = vec3_normalise(vec3_cross(b, c));
    side = vec3_dot(side, direction) > 0.0f ? vec3_scale(side, -1.0f) : side;
    normal = vec3_scale(set.mesh.normals[t[0]], 1.0f - hit.u - hit.v);
    normal = vec3_axpy(vec3_axpy(normal, hit.u, set.mesh.normals[t[1]]), hit.v, set.mesh.normals[t[2]]);
    normal = vec3_normalise(vec3_dot(normal, side) < 0.0f ? vec3_scale(normal, -1.0f) : normal);
    cosine = -vec3_dot(normal, direction);
    if (cosine < LEAST_COSINE) {
        normal = vec3_normalise(vec3_axpy(normal, cosine - LEAST_COSINE, direction));
    }
    out->position = vec3_axpy(vec3_axpy(vec3_axpy(a, hit.u, b), hit.v, c), OFFSET, side);
    out->object = object_at(t[0], out->position);
    out->normal = normal;
    out->wo = vec3_scale(direction, -1.0f);
    return true;
}

bool scene_occluded(const ShadingPoint *point, Vec3 wi) {
    return tracer_occluded(&set.tracer, point->position, wi);
}

uint32_t scene_portals(const ShadingPoint *point, wis_portal out[WIS_MAX_PORTALS]) {
    uint32_t count = set.picture->room ? sizeof portals / sizeof portals[0] : 0;
    for (uint32_t i = 0; i < count; i++) {
        vec3_store(vec3_sub(rotated(portals[i].corner, set.picture->set_angle), point->position), out[i].corner);
        for (int k = 0; k < 2; k++) {
            vec3_store(rotated(portals[i].edges[k], set.picture->set_angle), out[i].edges[k]);
        }
    }
    return count;
}
