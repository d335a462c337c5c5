/* Sums in double, in the order of the pixels. */
#include "judge.h"

#define REFERENCE_SAMPLES 16u /* at a hit */

bool films_init(Films *films, const Camera *camera, double budget, uint32_t most) {
    static const Method references[REFERENCES] = {METHOD_MIS_COMPENSATED, METHOD_WIS};
    bool made = true;
    for (uint32_t i = 0; i < films->count; i++) {
        films->method[i].number = i;
        made = film_init(&films->method[i], camera) && made;
    }
    for (uint32_t r = 0; r < REFERENCES; r++) {
        Film film = {.method = references[r], .samples = REFERENCE_SAMPLES, .budget = budget, .most = most,
                     .is_still = films->method[0].is_still, .number = films->count + r};
        films->reference[r] = film;
        made = film_init(&films->reference[r], camera) && made;
    }
    return made;
}

void films_free(Films *films) {
    for (uint32_t i = 0; i < films->count; i++) {
        film_free(&films->method[i]);
    }
    for (uint32_t r = 0; r < REFERENCES; r++) {
        film_free(&films->reference[r]);
    }
}

static bool is_covered(const Film *film, size_t pixel) {
    return film->taken[pixel] > 0 && film->escaped[pixel] == 0;
}

bool judge_covers(const Films *films, size_t pixel) {
    bool covers = true;
    for (uint32_t m = 0; m < films->count; m++) {
        covers = covers && is_covered(&films->method[m], pixel);
    }
    return covers && is_covered(&films->reference[0], pixel) && is_covered(&films->reference[1], pixel);
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

static double luminance_of(const Film *film, size_t pixel) {
    return luminance(film_mean(film, pixel));
}

Verdict judge(const Films *films) {
    Verdict v = {{0}, {0}, {{0, 0}}, {0, 0}};
    double mean = judge_mean(films), covered = 0.0;
    for (size_t i = 0; i < films->reference[0].count; i++) {
        covered += judge_covers(films, i);
    }
    covered = fmax(covered, 1.0);
    for (size_t i = 0; i < films->reference[0].count; i++) {
        double a = luminance_of(&films->reference[0], i), b = luminance_of(&films->reference[1], i);
        for (uint32_t m = 0; m < films->count && judge_covers(films, i); m++) {
            score_add_sample(&v.score[m], luminance_of(&films->method[m], i), a, b, mean, 1.0 / covered);
            v.samples[m] += (double)films->method[m].samples * films->method[m].taken[i] / covered;
        }
        if (judge_covers(films, i)) {
            score_add(&v.reference, 0.25 * (a - b) * (a - b), 0.5 * (a + b), mean, 1.0 / covered);
        }
    }
    for (uint32_t m = 0; m < films->count; m++) {
        v.seconds[m] = films->method[m].seconds;
    }
    return v;
}
