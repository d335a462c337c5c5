/* Looking radiance up in a lat-long map. */
#include "light.h"

#include <stddef.h>
#include <stdlib.h>

const float light_world_from_map[9] = {1, 0, 0, 0, 0, 1, 0, -1, 0};

void light_free(Light *light) {
    free(light->texels);
    light->texels = NULL;
}

static Vec3 lerp(Vec3 a, Vec3 b, float t) {
    return vec3_axpy(vec3_scale(a, 1.0f - t), t, b);
}

/* Texel (x, y) of a row that is there; columns wrap. */
static Vec3 inner_texel(const Light *light, int32_t x, int32_t y) {
    int32_t width = (int32_t)light->width;
    x = x < 0 ? x + width : x;
    x = x >= width ? x - width : x;
    return vec3_load(light->texels + 3 * ((size_t)y * light->width + (size_t)x));
}

/* A row beyond a pole is the row before it, half a turn on: between two texels if their number is odd. */
static Vec3 texel(const Light *light, int32_t x, int32_t y) {
    int32_t width = (int32_t)light->width, height = (int32_t)light->height;
    if (y < 0 || y >= height) {
        y = y < 0 ? 0 : height - 1;
        return lerp(inner_texel(light, (x + width / 2) % width, y), inner_texel(light, (x + (width + 1) / 2) % width, y), 0.5f);
    }
    return inner_texel(light, x, y);
}

static Vec3 bilinear(const Light *light, float column, float row) {
    float x = floorf(column - 0.5f), y = floorf(row - 0.5f);
    float s = column - 0.5f - x, t = row - 0.5f - y;
    int32_t x0 = (int32_t)x, y0 = (int32_t)y;
    Vec3 upper = lerp(texel(light, x0, y0), texel(light, x0 + 1, y0), s);
    Vec3 lower = lerp(texel(light, x0, y0 + 1), texel(light, x0 + 1, y0 + 1), s);
    return lerp(upper, lower, t);
}

Vec3 light_radiance(const Light *light, Vec3 wi) {
    const float *m = light_world_from_map;
    float x = m[0] * wi.x + m[3] * wi.y + m[6] * wi.z;
    float y = m[1] * wi.x + m[4] * wi.y + m[7] * wi.z;
    float z = m[2] * wi.x + m[5] * wi.y + m[8] * wi.z;
    float turn = atan2f(y, x) / (2.0f * PI);
    float polar = atan2f(sqrtf(x * x + y * y), z) / PI;
    float column = (turn < 0.0f ? turn + 1.0f : turn) * (float)light->width;
    float row = polar * (float)light->height;
    return bilinear(light, column, row);
}
