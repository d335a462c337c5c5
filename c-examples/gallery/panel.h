/* Drawing films: two panels side by side, the truth, and a magnified part. */
#ifndef GALLERY_PANEL_H
#define GALLERY_PANEL_H

#include "../render/light.h"
#include "judge.h"

/* What a picture's drawings share. */
typedef struct Easel {
    const Picture *picture;
    const Camera *camera;
    const Light *light;
    const Films *films;
    const Result *result;
    float exposure;
} Easel;

/* Room that a picture of two panels needs beside them, in pixels. */
#define PANEL_GUTTER 4u
#define PANEL_CAPTION 24u

/* The exposure of all panels, from the logarithms of the truth. */
float panel_exposure(const Picture *picture, const Films *films);

/* MIS to the left and wis_direct to the right. Returns false if the file cannot be written; so do the others. */
bool panel_write_pair(const Easel *easel, const char *path);

/* The truth alone. */
bool panel_write_truth(const Easel *easel, const char *path);

/* A part of both panels, each of its pixels three wide. */
bool panel_write_crop(const Easel *easel, const char *path);

#endif
