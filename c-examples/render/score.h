/* The error of a picture against two references, which do not depend on one another. */
#ifndef RENDER_SCORE_H
#define RENDER_SCORE_H

typedef struct Score {
    double relative; /* mean of d^2 / (truth^2 + 1e-4 mean^2), d of luminance */
    double absolute; /* mean of d^2 / mean^2 */
} Score;

/* Adds `share` of a squared error where the truth and the mean of the picture are known. A black picture has no error. */
static inline void score_add(Score *score, double squared, double truth, double mean, double share) {
    const double floor = 1e-4; /* a hundredth of the mean, squared */
    if (mean > 0.0) {
        score->relative += share * squared / (truth * truth + floor * mean * mean);
        score->absolute += share * squared / (mean * mean);
    }
}

/* With references a and b, (y - a)(y - b) estimates the squared error of y without the noise of a and b. */
static inline void score_add_sample(Score *score, double y, double a, double b, double mean, double share) {
    score_add(score, (y - a) * (y - b), 0.5 * (a + b), mean, share);
}

#endif
