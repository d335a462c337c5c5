/* An 8-bit picture: tone-mapped pixels, text, PNG. */
#ifndef RENDER_IMAGE_H
#define RENDER_IMAGE_H

#include <stdbool.h>
#include <stdint.h>

#include "vec3.h"

typedef struct Image {
    uint32_t width, height;
    unsigned char *rgb; /* packed, from malloc */
} Image;

/* Black. Returns false if out of memory. */
bool image_init(Image *image, uint32_t width, uint32_t height);

void image_free(Image *image);

/* Draws linear radiance times exposure. */
void image_set(Image *image, uint32_t x, uint32_t y, Vec3 radiance, float exposure);

/* Draws a line of ASCII text on black below (x, y), 17 pixels high; none on a machine without the font. */
void image_text(Image *image, uint32_t x, uint32_t y, const char *text);

bool image_write_png(const Image *image, const char *path);

#endif
