/* A pinhole camera in front of the row of spheres. */
#include "view.h"

#include <stdlib.h>

static const Vec3 eye = {0.0f, 2.7f, 18.0f};
static const Vec3 target = {0.0f, 1.4f, 0.0f};
static const float half_width = 0.34f; /* of the image at distance 1 */

Vec3 view_direction(uint32_t width, uint32_t height, uint32_t x, uint32_t y) {
    Vec3 forward = vec3_normalise(vec3_sub(target, eye));
    Vec3 right = vec3_normalise(vec3_cross(forward, vec3_make(0.0f, 1.0f, 0.0f)));
    Vec3 up = vec3_cross(right, forward);
    float pixel = 2.0f * half_width / (float)width;
    float sx = ((float)x + 0.5f - 0.5f * (float)width) * pixel;
    float sy = (0.5f * (float)height - (float)y - 0.5f) * pixel;
    return vec3_normalise(vec3_axpy(vec3_axpy(forward, sx, right), sy, up));
}

wis_status view_trace(View *view, uint32_t width, uint32_t height) {
    view->width = width;
    view->height = height;
    view->count = 0;
    view->points = malloc((size_t)width * height * sizeof *view->points);
    if (view->points == NULL) {
        return WIS_MEMORY_TOO_SMALL;
    }
    for (uint32_t y = 0; y < height; y++) {
        for (uint32_t x = 0; x < width; x++) {
            ShadingPoint *point = &view->points[view->count];
            point->x = x;
            point->y = y;
            point->sample = 0;
            view->count += scene_first_hit(eye, view_direction(width, height, x, y), point);
        }
    }
    return WIS_OK;
}

void view_free(View *view) {
    free(view->points);
}
