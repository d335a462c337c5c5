/* Files are told apart by their first bytes, whatever their names. */
#include "read.h"

#include <ctype.h>
#include <errno.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#define MAX_SIDE 32768    /* as wis has it */
#define INFINITE 65504.0f /* the largest half float: what +Inf counts as, like WIS_ENVIRONMENT_SANITISE */
#define MOST 1e30f        /* sums of samples stay finite */

const char *read_fault(const char *format, ...) {
    static char text[512];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    for (char *c = text; *c != '\0'; c++) {
        *c = isprint((unsigned char)*c) ? *c : '?';
    }
    return text;
}

const char *read_begin(Light *light, long width, long height) {
    if (width < 1 || height < 1 || width > MAX_SIDE || height > MAX_SIDE) {
        return read_fault("a map of %ld x %ld texels, but sides have 1 to %d", width, height, MAX_SIDE);
    }
    if (2 * width < 3 * height || width > 3 * height) {
        return read_fault("a map of %ld x %ld texels, but a lat-long map is about twice as wide as high", width, height);
    }
    light->width = (uint32_t)width;
    light->height = (uint32_t)height;
    light->texels = calloc((size_t)width * (size_t)height, 3 * sizeof *light->texels);
    return light->texels != NULL ? NULL : read_fault("a map of %ld x %ld texels, for which memory is out", width, height);
}

/* What begins with bytes of another kind of file. */
static const char *other_kind(const unsigned char *head, size_t count) {
    static const struct { const char *bytes; size_t count; const char *kind; } known[] = {
        {"\x89PNG", 4, "a PNG picture, whose 8 or 16 bits hold no radiance"},
        {"\xff\xd8\xff", 3, "a JPEG picture, whose 8 bits hold no radiance"},
        {"II*\0", 4, "a TIFF picture"}, {"MM\0*", 4, "a TIFF picture"}, {"PF\n", 3, "a PFM picture"},
        {"GIF8", 4, "a GIF picture"}, {"RIFF", 4, "a WebP picture"}, {"DDS ", 4, "a DDS texture"},
        {"PK", 2, "a ZIP archive"}, {"<", 1, "a page of HTML or XML"}};
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        if (count >= known[i].count && memcmp(head, known[i].bytes, known[i].count) == 0) {
            return known[i].kind;
        }
    }
    return "neither a Radiance nor an OpenEXR file";
}

static const char *read_any(Light *light, const char *path, FILE *file) {
    unsigned char head[4];
    size_t count = fread(head, 1, sizeof head, file);
    if (ferror(file)) {
        return read_fault("%s", strerror(errno)); /* a folder */
    }
    if (count == 0) {
        return "an empty file";
    }
    if (count == sizeof head && memcmp(head, "\x76\x2f\x31\x01", sizeof head) == 0) {
        return exr_read(light, path);
    }
    if (count >= 2 && memcmp(head, "#?", 2) == 0) {
        rewind(file);
        return hdr_read(light, file);
    }
    return other_kind(head, count);
}

/* As the light is built: negative channels, which resamplers leave, and NaN are 0, and so no look-up is below 0. */
static void clamp(Light *light) {
    float *texels = light->texels;
    for (size_t i = 0; i < (size_t)light->width * light->height * 3; i++) {
        texels[i] = texels[i] > 0.0f ? isinf(texels[i]) ? INFINITE : fminf(texels[i], MOST) : 0.0f;
    }
}

const char *light_read(Light *light, const char *path) {
    static char text[640];
    FILE *file = fopen(path, "rb");
    const char *fault = file != NULL ? read_any(light, path, file) : strerror(errno);
    if (file != NULL) {
        fclose(file);
    }
    if (fault == NULL) {
        clamp(light);
        return NULL;
    }
    light_free(light);
    snprintf(text, sizeof text, "%s: %s; wanted is a lat-long map, whole, as a Radiance (.hdr) or OpenEXR (.exr) file", path, fault);
    return text;
}
