/* The pages that show the pictures and their errors. */
#ifndef GALLERY_PAGE_H
#define GALLERY_PAGE_H

#include "judge.h"

/* How many samples at a hit the last table compares. */
#define COUNTS 4u

typedef struct Page {
    const Result *results;
    uint32_t count;
    uint32_t width, height, samples; /* of a picture; at each hit */
    double seconds, reference_seconds;
    const Result (*small)[COUNTS]; /* each picture in small, by samples at a hit; NULL: not rendered */
    const uint32_t *counts;        /* those numbers of samples */
} Page;

/* index.html in `folder`, beside the pictures. Returns false if it cannot be written; so do the others. */
bool page_write_html(const Page *page, const char *folder);

/* Markdown, with the crops in the folder `gallery` beside it. */
bool page_write_markdown(const Page *page, const char *path);

/* The table alone. */
void page_print(const Page *page);

#endif
