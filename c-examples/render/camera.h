/* A pinhole camera. */
#ifndef RENDER_CAMERA_H
#define RENDER_CAMERA_H

#include <stdint.h>

#include "vec3.h"

typedef struct Camera {
    Vec3 eye, forward, right, up; /* right and up: a pixel's width */
    uint32_t width, height;
} Camera;

/* half_width: of the picture at distance 1. */
static inline Camera camera_make(Vec3 eye, Vec3 target, float half_width, uint32_t width, uint32_t height) {
    float pixel = 2.0f * half_width / (float)width;
    Vec3 forward = vec3_normalise(vec3_sub(target, eye)), right = vec3_normalise(vec3_cross(forward, vec3_make(0.0f, 1.0f, 0.0f)));
    Camera c = {eye, forward, vec3_scale(right, pixel), vec3_scale(vec3_cross(right, forward), pixel), width, height};
    return c;
}

/* Unit direction through a place of the picture, in pixels from its upper left corner. */
static inline Vec3 camera_direction(const Camera *c, float x, float y) {
    Vec3 d = vec3_axpy(c->forward, x - 0.5f * (float)c->width, c->right);
    return vec3_normalise(vec3_axpy(d, 0.5f * (float)c->height - y, c->up));
}

#endif
