/* Reading files of lat-long maps. What fails answers a sentence about what was found, in static memory; NULL is success. */
#ifndef RENDER_READ_H
#define RENDER_READ_H

#include <stdio.h>

#include "light.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Formats a sentence; what is not printable becomes a question mark. */
const char *read_fault(const char *format, ...);

/* Checks the size of a map and makes its texels, all of them 0. */
const char *read_begin(Light *light, long width, long height);

/* A Radiance file, from its beginning. */
const char *hdr_read(Light *light, FILE *file);

const char *exr_read(Light *light, const char *path);

#ifdef __cplusplus
}
#endif

#endif
