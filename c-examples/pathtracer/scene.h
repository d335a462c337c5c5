/* Geometry: a disc, three spheres and a smooth knot of 115,200 triangles, and what they are made of. */
#ifndef PATHTRACER_SCENE_H
#define PATHTRACER_SCENE_H

#include <float.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

#include "../render/material.h"

enum { TRIANGLES = 2 * 1200 * 48, OBJECTS = 5, MATERIALS = OBJECTS + 4 };
enum { THE_MESH = 1, THE_METAL = 2, THE_DISC = 4 }; /* what a scene may be without, as a sum */

typedef struct Hit {
    float distance;
    Vec3 position, normal; /* the normal on the side where the ray comes from */
    int object, material;
} Hit;

static const Material materials[MATERIALS] = {
    {"the disc", 1, {{WIS_LOBE_LAMBERT, {0.5f, 0.5f, 0.45f}, {0}, 0}}},
    {"the knot", 2, {{WIS_LOBE_LAMBERT, {0.25f, 0.4f, 0.2f}, {0}, 0}, {WIS_LOBE_GGX, {1, 1, 1}, {0.05f, 0.05f, 0.05f}, 0.3f}}},
    {"varnish", 2, {{WIS_LOBE_LAMBERT, {0.6f, 0.25f, 0.15f}, {0}, 0}, {WIS_LOBE_GGX, {1, 1, 1}, {0.04f, 0.04f, 0.04f}, 0.15f}}},
    {"metal", 1, {{WIS_LOBE_GGX, {1, 1, 1}, {0.95f, 0.75f, 0.45f}, 0.05f}}},
    {"clay", 1, {{WIS_LOBE_LAMBERT, {0.14f, 0.28f, 0.42f}, {0}, 0}}},
    /* One of these may take the place of all. */
    {"Lambert", 1, {{WIS_LOBE_LAMBERT, {0.5f, 0.5f, 0.5f}, {0}, 0}}},
    {"GGX 0.2", 1, {{WIS_LOBE_GGX, {1, 1, 1}, {0.9f, 0.9f, 0.9f}, 0.2f}}},
    {"GGX 0.05", 1, {{WIS_LOBE_GGX, {1, 1, 1}, {0.9f, 0.9f, 0.9f}, 0.05f}}},
    {"pattern", 1, {{WIS_LOBE_LAMBERT, {0.5f, 0.5f, 0.5f}, {0}, 0}}}};
static const float patterns[MATERIALS] = {9, 20, 15, 0, 0, 0, 0, 0, 20}; /* their frequencies in the diffuse albedo; 0: none */
static wis_material shapes[MATERIALS];                       /* the lobes as wis knows them */
static const struct { Vec3 centre; float radius; } spheres[3] = {
    {{-1.25f, 0.6f, 0.2f}, 0.6f}, {{1.25f, 0.6f, 0.1f}, 0.6f}, {{0.5f, 0.3f, 1.2f}, 0.3f}};

static void check(wis_status status) {
    if (status != WIS_OK) {
        fprintf(stderr, "pathtracer: %s\n", wis_status_string(status));
        exit(EXIT_FAILURE);
    }
}

/* Triangles in the order of the tube, halved again and again, are a tree of boxes: node n has the children 2n + 1 and 2n + 2. */
static struct Vertex { Vec3 position, normal; } triangles[TRIANGLES][3];
static Vec3 boxes[TRIANGLES][2];
static int triangle_count, along = 1200, around = 48; /* triangles, and how the tube is cut */
static unsigned without, everywhere;                   /* objects that are not there; the material of all objects, from 1 on */

/* A tube along a trefoil. */
static Vec3 knot(float s, float t) {
    float r = 2 + cosf(1.5f * s) + 0.45f * cosf(t);
    return vec3_scale(vec3_make(r * cosf(s), r * sinf(s) + 3.45f, sinf(1.5f * s) + 0.45f * sinf(t)), 0.24f);
}

static struct Vertex knot_vertex(int i, int j) {
    float s = 4 * PI * (float)i / (float)along, t = 2 * PI * (float)j / (float)around, step = 0.005f;
    Vec3 ds = vec3_sub(knot(s + step, t), knot(s - step, t)), dt = vec3_sub(knot(s, t + step), knot(s, t - step));
    return (struct Vertex){knot(s, t), vec3_normalise(vec3_cross(ds, dt))};
}

static void scene_build(int node, int first, int count) {
    Vec3 low = {FLT_MAX, FLT_MAX, FLT_MAX}, high = {-FLT_MAX, -FLT_MAX, -FLT_MAX};
    for (int i = first; i < first + count; i++) {
        int s = i / 2 / around, t = i / 2 % around;
        if (node == 0) {
            triangles[i][0] = knot_vertex(s, t);
            triangles[i][1] = knot_vertex(s + 1, t + i % 2);
            triangles[i][2] = knot_vertex(s + 1 - i % 2, t + 1);
        }
        for (int k = 0; k < 3; k++) {
            low = vec3_min(low, triangles[i][k].position);
            high = vec3_max(high, triangles[i][k].position);
        }
    }
    boxes[node][0] = low;
    boxes[node][1] = high;
    if (count > 4) {
        scene_build(2 * node + 1, first, count / 2);
        scene_build(2 * node + 2, first + count / 2, count - count / 2);
    }
}

static void scene_init(bool is_coarse) {
    for (int i = 0; i < MATERIALS; i++) {
        check(material_shape(&materials[i], &shapes[i]));
    }
    along = is_coarse ? 60 : along;
    around = is_coarse ? 8 : around;
    triangle_count = without & THE_MESH ? 0 : 2 * along * around;
    scene_build(0, 0, triangle_count);
}

/* Keeps a hit that is nearer than the one before. */
static void offer(Hit *hit, float distance, Vec3 normal, int object) {
    if (distance > 1e-3f && distance < hit->distance) {
        hit->distance = distance;
        hit->normal = normal;
        hit->object = object;
    }
}

/* Moeller and Trumbore 1997. */
static void hit_triangle(const struct Vertex v[3], Vec3 o, Vec3 d, Hit *hit) {
    Vec3 a = vec3_sub(v[1].position, v[0].position), b = vec3_sub(v[2].position, v[0].position);
    Vec3 p = vec3_cross(d, b), s = vec3_sub(o, v[0].position), q = vec3_cross(s, a);
    float inverse = 1 / vec3_dot(a, p), x = vec3_dot(s, p) * inverse, y = vec3_dot(d, q) * inverse;
    if (x >= 0 && y >= 0 && x + y <= 1) {
        Vec3 normal = vec3_axpy(vec3_axpy(vec3_scale(v[0].normal, 1 - x - y), x, v[1].normal), y, v[2].normal);
        offer(hit, vec3_dot(b, q) * inverse, normal, 1);
    }
}

static void hit_node(int node, int first, int count, Vec3 o, Vec3 inverse, Vec3 d, Hit *hit) {
    Vec3 a = vec3_mul(vec3_sub(boxes[node][0], o), inverse), b = vec3_mul(vec3_sub(boxes[node][1], o), inverse);
    Vec3 near = vec3_min(a, b), far = vec3_max(a, b);
    if (fmaxf(fmaxf(near.x, near.y), fmaxf(near.z, 0)) > fminf(fminf(far.x, far.y), fminf(far.z, hit->distance))) {
        return;
    }
    if (count > 4) {
        hit_node(2 * node + 1, first, count / 2, o, inverse, d, hit);
        hit_node(2 * node + 2, first + count / 2, count - count / 2, o, inverse, d, hit);
    }
    for (int i = first; count <= 4 && i < first + count; i++) {
        hit_triangle(triangles[i], o, d, hit);
    }
}

/* The nearest hit along a ray; false if there is none. */
static bool scene_trace(Vec3 o, Vec3 d, Hit *hit) {
    hit->distance = FLT_MAX;
    if (!(without & THE_DISC) && hypotf(o.x - d.x * o.y / d.y, o.z - d.z * o.y / d.y) < 3) {
        offer(hit, -o.y / d.y, vec3_make(0, 1, 0), 0);
    }
    for (int i = 0; i < 3; i++) {
        if (i == 1 && without & THE_METAL) {
            continue;
        }
        Vec3 to = vec3_sub(spheres[i].centre, o);
        float along = vec3_dot(to, d), r = spheres[i].radius, square = along * along - vec3_dot(to, to) + r * r;
        for (int side = -1; square > 0 && side <= 1; side += 2) {
            float distance = along + (float)side * sqrtf(square);
            offer(hit, distance, vec3_sub(vec3_scale(d, distance), to), 2 + i);
        }
    }
    hit_node(0, 0, triangle_count, o, vec3_make(1 / d.x, 1 / d.y, 1 / d.z), d, hit);
    hit->position = vec3_axpy(o, hit->distance, d);
    hit->normal = vec3_normalise(hit->normal);
    hit->normal = vec3_dot(hit->normal, d) > 0 ? vec3_scale(hit->normal, -1) : hit->normal;
    hit->material = everywhere > 0 ? OBJECTS + (int)everywhere - 1 : hit->object;
    return hit->distance < FLT_MAX;
}

/* The material of a hit with its pattern. */
static Material material_at(const Hit *hit) {
    Material material = materials[hit->material];
    Vec3 p = vec3_scale(hit->position, patterns[hit->material]);
    for (int i = 0; patterns[hit->material] > 0 && i < 3; i++) {
        material.lobes[0].weight[i] *= 0.7f + 0.3f * sinf(p.x) * sinf(p.y + 1) * sinf(p.z);
    }
    return material;
}

#endif
