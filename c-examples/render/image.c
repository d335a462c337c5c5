/* Tone mapping, a bitmap font and PNG output through the stb libraries. */
#include "image.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

#include <stb/stb_easy_font.h>
#include <stb/stb_image_write.h>

#define TEXT_SCALE 2.0f
#define TEXT_GREY 225
#define MAX_QUADS 2048

/* The radiance, times exposure, that is drawn white. */
#define WHITE 6.0f

/* As stb_easy_font lays its vertices out. */
typedef struct Vertex {
    float x, y, z;
    unsigned char colour[4];
} Vertex;

bool image_init(Image *image, uint32_t width, uint32_t height) {
    image->width = width;
    image->height = height;
    image->rgb = calloc((size_t)width * height, 3);
    return image->rgb != NULL;
}

void image_free(Image *image) {
    free(image->rgb);
}

/* Reinhard et al., "Photographic Tone Reproduction", 2002, Eq. 4, then the sRGB curve. */
static unsigned char tone_map(float exposure, float radiance) {
    /* The exposure of a map of 1e-40 is beyond a float. */
    float x = fminf(fminf(exposure, FLT_MAX) * radiance, FLT_MAX);
    float c = x * (1.0f + x / (WHITE * WHITE)) / (1.0f + x);
    c = fminf(1.0f, fmaxf(0.0f, c));
    c = c <= 0.0031308f ? 12.92f * c : 1.055f * powf(c, 1.0f / 2.4f) - 0.055f;
    return (unsigned char)(255.0f * c + 0.5f);
}

static unsigned char *pixel(Image *image, uint32_t x, uint32_t y) {
    return image->rgb + 3 * ((size_t)y * image->width + x);
}

void image_set(Image *image, uint32_t x, uint32_t y, Vec3 radiance, float exposure) {
    unsigned char *rgb = pixel(image, x, y);
    rgb[0] = tone_map(exposure, radiance.x);
    rgb[1] = tone_map(exposure, radiance.y);
    rgb[2] = tone_map(exposure, radiance.z);
}

static uint32_t clip(float value, uint32_t limit) {
    return value < (float)limit ? (uint32_t)value : limit;
}

static void fill(Image *image, float left, float top, float right, float bottom) {
    for (uint32_t y = clip(top, image->height); y < clip(bottom, image->height); y++) {
        for (uint32_t x = clip(left, image->width); x < clip(right, image->width); x++) {
            memset(pixel(image, x, y), TEXT_GREY, 3);
        }
    }
}

void image_text(Image *image, uint32_t x, uint32_t y, const char *text) {
    Vertex vertices[4 * MAX_QUADS];
    char copy[256] = {0};
    int quads;
    strncpy(copy, text, sizeof copy - 1);
    quads = stb_easy_font_print(0, 0, copy, NULL, vertices, (int)sizeof vertices);
    for (int i = 0; i < quads; i++) {
        const Vertex *upper_left = &vertices[4 * i], *lower_right = &vertices[4 * i + 2];
        fill(image, (float)x + TEXT_SCALE * upper_left->x, (float)y + TEXT_SCALE * upper_left->y,
             (float)x + TEXT_SCALE * lower_right->x, (float)y + TEXT_SCALE * lower_right->y);
    }
}

bool image_write_png(const Image *image, const char *path) {
    return stbi_write_png(path, (int)image->width, (int)image->height, 3, image->rgb, 3 * (int)image->width) != 0;
}
