/* Drawing films: panels under captions, with one exposure. */
#ifndef RENDER_PANEL_H
#define RENDER_PANEL_H

#include "judge.h"

/* What the drawings of one scene share. */
typedef struct Easel {
    const Camera *camera;
    const Light *light;
    const Films *films;
    float exposure;
} Easel;

/* A part of the view from pixel (left, top), each of its pixels `times` as wide and high. */
typedef struct Window {
    uint32_t left, top, width, height, times;
} Window;

typedef struct Panel {
    const Film *film; /* NULL: the truth */
    char caption[128];
} Panel;

/* Room that a picture needs beside and above each panel, in pixels. */
#define PANEL_GUTTER 4u
#define PANEL_CAPTION 24u

/* The exposure from the logarithms of the truth, times `factor`. */
float panel_exposure(const Films *films, float factor);

/* The whole view. */
Window panel_all(const Camera *camera);

/* Panels in so many columns, and a line below them unless it is NULL. Returns false if the file cannot be written. */
bool panel_write(const Easel *easel, Window window, const Panel *panels, uint32_t count, uint32_t columns, const char *below,
                 const char *path);

#endif
