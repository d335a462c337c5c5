/* What the camera sees: the points to be shaded, one per pixel, traced once and shared by all methods. */
#ifndef RENDER_VIEW_H
#define RENDER_VIEW_H

#include <stddef.h>
#include <stdint.h>

#include "scene.h"

typedef struct View {
    uint32_t width, height;
    size_t count;
    ShadingPoint *points; /* in the order of the pixels, from malloc */
} View;

/* Unit direction through the centre of pixel (x, y). */
Vec3 view_direction(uint32_t width, uint32_t height, uint32_t x, uint32_t y);

/* Free the view even on failure. */
wis_status view_trace(View *view, uint32_t width, uint32_t height);

void view_free(View *view);

#endif
