/* Tone mapping; text and PNG output through the stb libraries. */
#include "image.h"

#include <float.h>
#include <stdio.h>
#include <stdlib.h>

#include <stb/stb_image_write.h>
#include <stb/stb_truetype.h>

/* Of the Debian package fonts-dejavu-core, which scripts/setup.sh installs. */
#ifndef FONT
#define FONT "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf"
#endif
#define TEXT_HEIGHT 17.0f
#define TEXT_GREY 230

/* The radiance, times exposure, that is drawn white. */
#define WHITE 6.0f

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

/* The bytes of the font, from malloc; NULL if it is not there. */
static unsigned char *read_font(void) {
    FILE *f = fopen(FONT, "rb");
    unsigned char *bytes = NULL;
    long size;
    if (f == NULL) {
        return NULL;
    }
    if (fseek(f, 0, SEEK_END) == 0 && (size = ftell(f)) > 0 && fseek(f, 0, SEEK_SET) == 0) {
        bytes = malloc((size_t)size);
        if (bytes != NULL && fread(bytes, 1, (size_t)size, f) != (size_t)size) {
            free(bytes);
            bytes = NULL;
        }
    }
    fclose(f);
    return bytes;
}

/* Blends a glyph's coverage over black, as far as it lies in the image. */
static void blend(Image *image, int left, int top, const unsigned char *coverage, int width, int height) {
    for (int j = 0; j < height; j++) {
        for (int i = 0; i < width; i++) {
            int x = left + i, y = top + j;
            if (x >= 0 && y >= 0 && (uint32_t)x < image->width && (uint32_t)y < image->height) {
                unsigned char *rgb = pixel(image, (uint32_t)x, (uint32_t)y), grey = (unsigned char)(coverage[j * width + i] * TEXT_GREY / 255);
                rgb[0] = rgb[0] > grey ? rgb[0] : grey;
                rgb[1] = rgb[1] > grey ? rgb[1] : grey;
                rgb[2] = rgb[2] > grey ? rgb[2] : grey;
            }
        }
    }
}

void image_text(Image *image, uint32_t x, uint32_t y, const char *text) {
    unsigned char *bytes = read_font();
    stbtt_fontinfo font;
    if (bytes != NULL && stbtt_InitFont(&font, bytes, stbtt_GetFontOffsetForIndex(bytes, 0))) {
        float scale = stbtt_ScaleForPixelHeight(&font, TEXT_HEIGHT), at = (float)x;
        int ascent, descent, gap;
        stbtt_GetFontVMetrics(&font, &ascent, &descent, &gap);
        for (; *text != '\0'; text++) {
            int width, height, left, top, advance, bearing;
            unsigned char *glyph = stbtt_GetCodepointBitmapSubpixel(&font, scale, scale, at - floorf(at), 0.0f, *text, &width, &height, &left, &top);
            blend(image, (int)floorf(at) + left, (int)((float)y + scale * (float)ascent) + top, glyph, width, height);
            stbtt_FreeBitmap(glyph, NULL);
            stbtt_GetCodepointHMetrics(&font, *text, &advance, &bearing);
            at += scale * (float)(advance + stbtt_GetCodepointKernAdvance(&font, text[0], text[1]));
        }
    }
    free(bytes);
}

bool image_write_png(const Image *image, const char *path) {
    return stbi_write_png(path, (int)image->width, (int)image->height, 3, image->rgb, 3 * (int)image->width) != 0;
}
