/* How far films are from two references that do not depend on one another. */
#ifndef GALLERY_JUDGE_H
#define GALLERY_JUDGE_H

#include "film.h"

enum { MIS, COMPENSATED, DIRECT, REMEMBERING, METHODS }; /* the last: wis_direct with a visibility cache */
#define REFERENCES 2u

typedef struct Score {
    double relative; /* mean of d^2 / (truth^2 + 1e-4 mean^2), d of luminance */
    double absolute; /* mean of d^2 / mean^2 */
} Score;

typedef struct Result {
    const Picture *picture;
    bool has_mesh, has_map; /* those of the data, not the project's own */
    const char *other_map;  /* in place of both, or NULL */
    double seconds[METHODS], samples[METHODS]; /* processor time; mean number at a pixel */
    Score score[METHODS], reference; /* the reference's own: its error is part of no score */
} Result;

typedef struct Films {
    Film method[METHODS], reference[REFERENCES];
} Films;

/* Is the pixel covered in all films? The others mix in the map itself, which all methods see alike. */
bool judge_covers(const Films *films, size_t pixel);

Vec3 judge_truth(const Films *films, size_t pixel);

/* Mean luminance of the truth where judge_covers. */
double judge_mean(const Films *films);

/* What the light is, in words. */
const char *judge_light(const Result *result);

/* Fills times, samples and scores. */
void judge(const Films *films, Result *result);

#endif
