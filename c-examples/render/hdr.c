/* Radiance files: rows of pixels that share an exponent, plain or in runs. stb_image does not know the old runs, and does not end where
 * a file is cut off. Format: Ward, "Real Pixels", Graphics Gems II, 1991, and color.c of Radiance. */
#include "read.h"

#include <stdlib.h>
#include <string.h>

#define PARTS 4 /* red, green, blue, exponent */
#define LINE 128

typedef unsigned char Pixel[PARTS];

static const char cut_off[] = "is cut off", wrong_run[] = "holds a run that does not fit into it";

/* The next line without its end, shortened to LINE; false at the end of the file. */
static bool next_line(FILE *file, char line[LINE]) {
    size_t length = 0;
    int c;
    while ((c = getc(file)) != EOF && c != '\n') {
        if (length + 1 < LINE) {
            line[length++] = (char)c;
        }
    }
    line[length] = '\0';
    return c != EOF;
}

/* Each part of the pixels by itself, in runs and spans of different bytes. */
static const char *read_new_runs(FILE *file, Pixel *row, uint32_t width) {
    for (int part = 0; part < PARTS; part++) {
        for (uint32_t x = 0; x < width;) {
            int code = getc(file), value = 0;
            uint32_t count = code > 128 ? (uint32_t)code - 128 : (uint32_t)code;
            if (code == EOF) {
                return cut_off;
            }
            if (count == 0 || count > width - x) {
                return wrong_run;
            }
            for (uint32_t i = 0; i < count; i++) {
                value = i == 0 || code <= 128 ? getc(file) : value;
                if (value == EOF) {
                    return cut_off;
                }
                row[x++][part] = (unsigned char)value;
            }
        }
    }
    return NULL;
}

/* Pixels; 1 1 1 n repeats the one before n times, and n counts 256 times as much in each such pixel that follows. */
static const char *read_old_runs(FILE *file, Pixel *row, uint32_t width, Pixel pixel) {
    static const Pixel run = {1, 1, 1, 0};
    int shift = 0;
    for (uint32_t x = 0;;) {
        if (memcmp(pixel, run, 3) != 0) {
            memcpy(row[x++], pixel, PARTS);
            shift = 0;
        } else {
            uint32_t count = shift < 24 ? (uint32_t)pixel[3] << shift : width;
            if (x == 0 || count > width - x) {
                return wrong_run;
            }
            for (; count > 0; count--, x++) {
                memcpy(row[x], row[x - 1], PARTS);
            }
            shift += 8;
        }
        if (x == width) {
            return NULL;
        }
        if (fread(pixel, PARTS, 1, file) != 1) {
            return cut_off;
        }
    }
}

static const char *read_row(FILE *file, Pixel *row, uint32_t width) {
    Pixel first;
    if (fread(first, PARTS, 1, file) != 1) {
        return cut_off;
    }
    if (width < 8 || width > 0x7fff || first[0] != 2 || first[1] != 2 || first[2] > 127) {
        return read_old_runs(file, row, width, first);
    }
    return ((uint32_t)first[2] << 8 | first[3]) == width ? read_new_runs(file, row, width) : "has another width than the map";
}

static const char *read_rows(Light *light, FILE *file, Pixel *row, bool upwards, bool leftwards) {
    uint32_t width = light->width, height = light->height;
    for (uint32_t y = 0; y < height; y++) {
        const char *fault = read_row(file, row, width);
        float *out = light->texels + 3 * (size_t)width * (upwards ? height - 1 - y : y);
        if (fault != NULL) {
            return read_fault("a Radiance file whose row %u of %u %s", y + 1, height, fault);
        }
        for (uint32_t x = 0; x < width; x++) {
            const unsigned char *pixel = row[leftwards ? width - 1 - x : x];
            float unit = pixel[3] > 0 ? ldexpf(1.0f, pixel[3] - (128 + 8)) : 0.0f;
            for (int k = 0; k < 3; k++) {
                *out++ = unit * (float)pixel[k];
            }
        }
    }
    return NULL;
}

const char *hdr_read(Light *light, FILE *file) {
    static const char format[] = "FORMAT=", rgb[] = "FORMAT=32-bit_rle_rgbe";
    char line[LINE], vertical, horizontal;
    long width, height;
    const char *fault;
    Pixel *row;
    do {
        if (!next_line(file, line)) {
            return "a Radiance file that is cut off in its header";
        }
        if (strncmp(line, format, sizeof format - 1) == 0 && strcmp(line, rgb) != 0) {
            return read_fault("a Radiance file with %s in place of %s", line, rgb);
        }
    } while (line[0] != '\0');
    if (!next_line(file, line)) {
        return "a Radiance file that is cut off in its header";
    }
    if (sscanf(line, "%cY %9ld %cX %9ld", &vertical, &height, &horizontal, &width) != 4) {
        return read_fault("a Radiance file with \"%s\" in place of a size such as -Y 512 +X 1024", line);
    }
    fault = read_begin(light, width, height);
    if (fault != NULL) {
        return fault;
    }
    row = malloc(light->width * sizeof *row);
    fault = row != NULL ? read_rows(light, file, row, vertical == '+', horizontal == '-') : "a file for which memory is out";
    free(row);
    return fault;
}
