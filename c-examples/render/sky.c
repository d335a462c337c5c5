/* The built-in light: hard for every way of sampling, for it has a sun that only the light's density finds,
 * windows that only some lobes see, and a dim sky that fills the shadows. */
#include "light.h"

#include <stddef.h>
#include <stdlib.h>

#define WIDTH 1024u
#define HEIGHT 512u
#define DEGREE (PI / 180.0f)

/* A bright rectangle: centre and half size in degrees of azimuth and elevation. */
typedef struct Window {
    float azimuth, elevation, half_width, half_height;
    Vec3 radiance;
} Window;

/* In the scene's frame azimuth 90 lies behind the spheres, 270 behind the camera, 0 to the right. */
static const Window windows[] = {
    {325.0f, 24.0f, 15.0f, 11.0f, {2.6f, 3.0f, 3.8f}},  {262.0f, 34.0f, 3.0f, 20.0f, {7.0f, 6.4f, 5.5f}},
    {150.0f, 38.0f, 1.6f, 2.6f, {90.0f, 62.0f, 34.0f}}, {28.0f, 66.0f, 9.0f, 5.0f, {5.0f, 6.5f, 9.0f}},
    {77.0f, 2.0f, 0.9f, 0.9f, {1.8f, 1.3f, 0.6f}},      {80.0f, 2.0f, 0.9f, 0.9f, {1.8f, 1.3f, 0.6f}},
    {86.5f, 2.0f, 0.9f, 0.9f, {0.5f, 0.8f, 1.5f}},      {99.0f, 2.0f, 0.9f, 0.9f, {1.8f, 1.3f, 0.6f}},
};

static const float sun_azimuth = 216.0f, sun_elevation = 31.0f, sun_radius = 0.4f;
static const Vec3 sun_radiance = {17000.0f, 14500.0f, 11500.0f};

static Vec3 direction(float azimuth, float elevation) {
    float a = azimuth * DEGREE, e = elevation * DEGREE;
    return vec3_make(cosf(e) * cosf(a), cosf(e) * sinf(a), sinf(e));
}

static Vec3 gradient(float elevation) {
    Vec3 horizon = {0.16f, 0.14f, 0.15f}, zenith = {0.02f, 0.03f, 0.07f}, ground = {0.03f, 0.03f, 0.03f};
    float t = sqrtf(fmaxf(0.0f, elevation / 90.0f));
    return elevation < 0.0f ? ground : vec3_axpy(vec3_scale(horizon, 1.0f - t), t, zenith);
}

/* Share of a texel that the sun covers, by the distance of its centre from the sun's rim. */
static float sun_coverage(float azimuth, float elevation) {
    float cosine = vec3_dot(direction(azimuth, elevation), direction(sun_azimuth, sun_elevation));
    float distance = acosf(fminf(1.0f, cosine)) / DEGREE;
    return fminf(1.0f, fmaxf(0.0f, (sun_radius - distance) * (float)HEIGHT / 180.0f + 0.5f));
}

static Vec3 sky_radiance(float azimuth, float elevation) {
    Vec3 radiance = gradient(elevation);
    for (size_t i = 0; i < sizeof windows / sizeof windows[0]; i++) {
        const Window *w = &windows[i];
        if (fabsf(azimuth - w->azimuth) < w->half_width && fabsf(elevation - w->elevation) < w->half_height) {
            radiance = w->radiance;
        }
    }
    return vec3_axpy(radiance, sun_coverage(azimuth, elevation), sun_radiance);
}

const char *light_make_sky(Light *light) {
    float *texels = malloc(3 * WIDTH * HEIGHT * sizeof *texels);
    if (texels == NULL) {
        return "out of memory";
    }
    for (uint32_t y = 0; y < HEIGHT; y++) {
        for (uint32_t x = 0; x < WIDTH; x++) {
            float azimuth = ((float)x + 0.5f) * 360.0f / (float)WIDTH;
            float elevation = 90.0f - ((float)y + 0.5f) * 180.0f / (float)HEIGHT;
            vec3_store(sky_radiance(azimuth, elevation), texels + 3 * (y * WIDTH + x));
        }
    }
    light->width = WIDTH;
    light->height = HEIGHT;
    light->texels = texels;
    return NULL;
}
