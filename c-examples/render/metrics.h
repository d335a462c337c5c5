/* Errors of luminance against the reference, over all points of the view. */
#ifndef RENDER_METRICS_H
#define RENDER_METRICS_H

#include "reference.h"
#include "view.h"

/* out[i] = luminance of the estimate minus that of the truth (shadowed or unshadowed), i < reference->count. */
void metrics_difference(const Reference *reference, const Vec3 *estimate, const Vec3 *truth, float *out);

/* sqrt(mean d^2) / mean truth: ruled by bright points. */
double metrics_absolute(const Reference *reference, const Vec3 *truth, const float *difference);

/* sqrt(mean d^2 / (truth^2 + (0.01 mean truth)^2)): ruled by points in shadow. */
double metrics_relative(const Reference *reference, const Vec3 *truth, const float *difference);

/* metrics_absolute over one object's points alone. */
double metrics_of_object(const Reference *reference, const View *view, uint32_t object, const Vec3 *truth,
                         const float *difference);

/* How many colours have a channel that is NaN or infinite. */
size_t metrics_not_finite(const Vec3 *values, size_t count);

#endif
