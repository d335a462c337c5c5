/* Three floats as a position, a direction or linear RGB. */
#ifndef RENDER_VEC3_H
#define RENDER_VEC3_H

#include <math.h>

#define PI 3.14159265358979f

typedef struct Vec3 {
    float x, y, z;
} Vec3;

static inline Vec3 vec3_make(float x, float y, float z) {
    Vec3 v = {x, y, z};
    return v;
}

static inline Vec3 vec3_load(const float v[3]) {
    return vec3_make(v[0], v[1], v[2]);
}

static inline void vec3_store(Vec3 v, float out[3]) {
    out[0] = v.x;
    out[1] = v.y;
    out[2] = v.z;
}

static inline Vec3 vec3_add(Vec3 a, Vec3 b) {
    return vec3_make(a.x + b.x, a.y + b.y, a.z + b.z);
}

static inline Vec3 vec3_sub(Vec3 a, Vec3 b) {
    return vec3_make(a.x - b.x, a.y - b.y, a.z - b.z);
}

static inline Vec3 vec3_mul(Vec3 a, Vec3 b) {
    return vec3_make(a.x * b.x, a.y * b.y, a.z * b.z);
}

static inline Vec3 vec3_scale(Vec3 v, float s) {
    return vec3_make(v.x * s, v.y * s, v.z * s);
}

/* a + s b */
static inline Vec3 vec3_axpy(Vec3 a, float s, Vec3 b) {
    return vec3_make(a.x + s * b.x, a.y + s * b.y, a.z + s * b.z);
}

static inline float vec3_dot(Vec3 a, Vec3 b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline Vec3 vec3_cross(Vec3 a, Vec3 b) {
    return vec3_make(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

static inline Vec3 vec3_normalise(Vec3 v) {
    return vec3_scale(v, 1.0f / sqrtf(vec3_dot(v, v)));
}

static inline Vec3 vec3_min(Vec3 a, Vec3 b) {
    return vec3_make(a.x < b.x ? a.x : b.x, a.y < b.y ? a.y : b.y, a.z < b.z ? a.z : b.z);
}

static inline Vec3 vec3_max(Vec3 a, Vec3 b) {
    return vec3_make(a.x > b.x ? a.x : b.x, a.y > b.y ? a.y : b.y, a.z > b.z ? a.z : b.z);
}

/* Rec. 709 luminance of linear RGB. */
static inline float luminance(Vec3 rgb) {
    return 0.2126f * rgb.x + 0.7152f * rgb.y + 0.0722f * rgb.z;
}

#endif
