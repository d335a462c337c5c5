/* How far films are from two references that do not depend on one another. */
#ifndef RENDER_JUDGE_H
#define RENDER_JUDGE_H

#include "film.h"
#include "score.h"

#define MAX_METHODS 5u
#define REFERENCES 2u

typedef struct Films {
    uint32_t count; /* of methods */
    Film method[MAX_METHODS], reference[REFERENCES];
} Films;

typedef struct Verdict {
    double seconds[MAX_METHODS], samples[MAX_METHODS]; /* processor time; mean number at a pixel */
    Score score[MAX_METHODS], reference; /* the reference's own: its error is part of no score */
} Verdict;

/* Films of the methods, which are set but for their pictures, and two references of so many seconds or passes. Returns false if out of
 * memory. Free them even then. */
bool films_init(Films *films, const Camera *camera, double budget, uint32_t most);

void films_free(Films *films);

/* Is the pixel covered in all films? The others mix in the map itself, which all methods see alike. */
bool judge_covers(const Films *films, size_t pixel);

Vec3 judge_truth(const Films *films, size_t pixel);

/* Mean luminance of the truth where judge_covers. */
double judge_mean(const Films *films);

Verdict judge(const Films *films);

#endif
