/* With references a and b, (y - a)(y - b) estimates the squared error of y without the noise of a and b. */
#include "judge.h"

#define FLOOR 1e-4 /* of the relative error: a hundredth of the mean, squared */

bool judge_covers(const Films *films, size_t pixel) {
    bool covers = true;
    for (uint32_t m = 0; m < METHODS; m++) {
        covers = covers && films->method[m].taken[pixel] > 0 && films->method[m].escaped[pixel] == 0;
    }
    for (uint32_t r = 0; r < REFERENCES; r++) {
        covers = covers && films->reference[r].taken[pixel] > 0 && films->reference[r].escaped[pixel] == 0;
    }
    return covers;
}

Vec3 judge_truth(const Films *films, size_t pixel) {
    return vec3_scale(vec3_add(film_mean(&films->reference[0], pixel), film_mean(&films->reference[1], pixel)), 0.5f);
}

double judge_mean(const Films *films) {
    double sum = 0.0, count = 0.0;
    for (size_t i = 0; i < films->reference[0].count; i++) {
        if (judge_covers(films, i)) {
            sum += luminance(judge_truth(films, i));
            count += 1.0;
        }
    }
    return count > 0.0 ? sum / count : 0.0;
}

const char *judge_light(const Result *result) {
    return result->other_map != NULL ? result->other_map : result->has_map ? result->picture->light : "a sun and windows";
}

static double luminance_of(const Film *film, size_t pixel) {
    return luminance(film_mean(film, pixel));
}

/* A black picture has no error. */
static void add(Score *score, double squared, double truth, double mean) {
    if (mean <= 0.0) {
        return;
    }
    score->relative += squared / (truth * truth + FLOOR * mean * mean);
    score->absolute += squared / (mean * mean);
}

static Score divided(Score score, double count) {
    Score mean = {score.relative / count, score.absolute / count};
    return mean;
}

void judge(const Films *films, Result *result) {
    double mean = judge_mean(films), covered = 0.0;
    for (size_t i = 0; i < films->reference[0].count; i++) {
        double a = luminance_of(&films->reference[0], i), b = luminance_of(&films->reference[1], i);
        if (!judge_covers(films, i)) {
            continue;
        }
        covered += 1.0;
        for (uint32_t m = 0; m < METHODS; m++) {
            double y = luminance_of(&films->method[m], i);
            add(&result->score[m], (y - a) * (y - b), 0.5 * (a + b), mean);
            result->samples[m] += (double)films->method[m].samples * films->method[m].taken[i];
        }
        add(&result->reference, 0.25 * (a - b) * (a - b), 0.5 * (a + b), mean);
    }
    covered = fmax(covered, 1.0);
    for (uint32_t m = 0; m < METHODS; m++) {
        result->seconds[m] = films->method[m].seconds;
        result->score[m] = divided(result->score[m], covered);
        result->samples[m] /= covered;
    }
    result->reference = divided(result->reference, covered);
}
