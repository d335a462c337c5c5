/* The tables of errors, and the other parts of the page that shows the pictures. */
#ifndef GALLERY_PAGE_H
#define GALLERY_PAGE_H

#include "../render/judge.h"
#include "picture.h"

enum { MIS, COMPENSATED, DIRECT, REMEMBERING, METHODS }; /* the last: wis_direct with a visibility cache */

/* How many samples at a hit the last table compares. */
#define COUNTS 4u

typedef struct Result {
    const Picture *picture;
    bool has_mesh, has_map; /* those of the data, not the project's own */
    const char *other_map;  /* in place of both, or NULL */
    Verdict verdict;
} Result;

typedef struct Page {
    const Result *results;
    uint32_t count;
    uint32_t width, height, samples; /* of a picture; at each hit */
    double seconds, reference_seconds;
    const Result (*small)[COUNTS]; /* each picture in small, by samples at a hit; NULL: not rendered */
    const uint32_t *counts;        /* those numbers of samples */
} Page;

/* What the light is, in words. */
const char *page_light(const Result *result);

/* The parts of page.md, each behind a line "=== NAME", to a file or, without a path, to stdout. Returns false if they cannot be written. */
bool page_write(const Page *page, const char *path);

#endif
