/* Sums in double, in the order of the pixels. */
#include "metrics.h"

typedef struct Sums {
    size_t count;
    double truth, squares;
} Sums;

static Sums add(Sums s, Vec3 truth, float difference) {
    s.count++;
    s.truth += luminance(truth);
    s.squares += (double)difference * difference;
    return s;
}

static double rmse_over_mean(Sums s) {
    return s.truth > 0.0 ? sqrt(s.squares * (double)s.count) / s.truth : 0.0;
}

void metrics_difference(const Reference *r, const Vec3 *estimate, const Vec3 *truth, float *out) {
    for (size_t i = 0; i < r->count; i++) {
        out[i] = luminance(estimate[i]) - luminance(truth[i]);
    }
}

double metrics_absolute(const Reference *r, const Vec3 *truth, const float *difference) {
    Sums s = {0};
    for (size_t i = 0; i < r->count; i++) {
        s = add(s, truth[i], difference[i]);
    }
    return rmse_over_mean(s);
}

double metrics_of_object(const Reference *r, const View *view, uint32_t object, const Vec3 *truth,
                         const float *difference) {
    Sums s = {0};
    for (size_t i = 0; i < r->count; i++) {
        if (view->points[i].object == object) {
            s = add(s, truth[i], difference[i]);
        }
    }
    return rmse_over_mean(s);
}

double metrics_relative(const Reference *r, const Vec3 *truth, const float *difference) {
    double mean = 0.0, sum = 0.0;
    for (size_t i = 0; i < r->count; i++) {
        mean += luminance(truth[i]) / (double)r->count;
    }
    for (size_t i = 0; i < r->count && mean > 0.0; i++) {
        double t = luminance(truth[i]), d = difference[i];
        sum += d * d / (t * t + 1e-4 * mean * mean);
    }
    return r->count > 0 ? sqrt(sum / (double)r->count) : 0.0;
}

size_t metrics_not_finite(const Vec3 *values, size_t count) {
    size_t bad = 0;
    for (size_t i = 0; i < count; i++) {
        bad += !(isfinite(values[i].x) && isfinite(values[i].y) && isfinite(values[i].z));
    }
    return bad;
}
