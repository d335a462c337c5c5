/* What each method cost and how far it is from the reference, for all points and for each material. */
#include "report.h"

#include <stdio.h>

#include "metrics.h"

static double ns_per_sample(const Session *s, double seconds) {
    return 1e9 * seconds / ((double)s->view.count * s->options.spp);
}

static void print_setup(const Session *s) {
    const Options *o = &s->options;
    printf("light      %s, %ux%u, looked up %s\n", o->env != NULL ? o->env : "built-in sky", s->light.width,
           s->light.height, o->nearest ? "without filtering" : "bilinearly");
    printf("view       %ux%u pixels, %zu shading points, %u samples each\n", o->width, o->height, s->view.count,
           o->spp);
    printf("reference  compensated MIS, %u samples each\n\n", o->reference_spp);
}

static void print_errors(double unshadowed, double relative, double absolute) {
    printf(" %11.4f %9.4f %9.4f\n", unshadowed, relative, absolute);
}

static void print_method(const Session *s, int m) {
    const Estimate *e = &s->estimates[m];
    const Reference *r = &s->reference;
    double unshadowed, relative, absolute;
    metrics_difference(r, e->unshadowed, r->unshadowed, s->difference);
    unshadowed = metrics_absolute(r, r->unshadowed, s->difference);
    metrics_difference(r, e->shadowed, r->shadowed, s->difference);
    relative = metrics_relative(r, r->shadowed, s->difference);
    absolute = metrics_absolute(r, r->shadowed, s->difference);
    printf("%-16s %7.2f %11.1f %7.1f", method_name((Method)m), e->sampling_seconds + e->shadow_seconds,
           ns_per_sample(s, e->sampling_seconds), ns_per_sample(s, e->shadow_seconds));
    print_errors(unshadowed, relative, absolute);
}

static void print_methods(const Session *s) {
    const Reference *r = &s->reference;
    printf("%-16s %7s %11s %7s %11s\n", "", "CPU", "ns / sample", "", "error");
    printf("%-16s %7s %11s %7s %11s %9s %9s\n", "method", "seconds", "sampling", "shadow", "unshadowed", "relative",
           "absolute");
    for (int m = 0; m < METHOD_COUNT; m++) {
        print_method(s, m);
    }
    printf("%-16s %7s %11s %7s", "reference itself", "", "", "");
    print_errors(metrics_absolute(r, r->unshadowed, r->unshadowed_error),
                 metrics_relative(r, r->shadowed, r->shadowed_error),
                 metrics_absolute(r, r->shadowed, r->shadowed_error));
    puts("\nEqual numbers of samples, not equal time. Seconds are CPU time of all threads. Sampling: random\n"
         "numbers, preparation, directions, densities, BRDF and light; shadow: rays against these few spheres,\n"
         "far cheaper than in a real scene. Errors are of luminance: unshadowed and absolute = RMSE / mean,\n"
         "relative = sqrt(mean d^2 / (ref^2 + (0.01 mean)^2)). The last row is the reference's standard error,\n"
         "the floor of what can be measured.\n");
}

static void print_material_row(const Session *s, const char *name, const float *difference) {
    printf("%-16s", name);
    for (uint32_t object = 0; object < SCENE_OBJECTS; object++) {
        printf(" %9.4f", metrics_of_object(&s->reference, &s->view, object, s->reference.unshadowed, difference));
    }
    putchar('\n');
}

static void print_materials(const Session *s) {
    const Reference *r = &s->reference;
    printf("%-16s", "unshadowed error");
    for (uint32_t object = 0; object < SCENE_OBJECTS; object++) {
        printf(" %9s", scene_material(object)->name);
    }
    putchar('\n');
    for (int m = 0; m < METHOD_COUNT; m++) {
        metrics_difference(r, s->estimates[m].unshadowed, r->unshadowed, s->difference);
        print_material_row(s, method_name((Method)m), s->difference);
    }
    print_material_row(s, "reference itself", r->unshadowed_error);
}

void report_print(const Session *s) {
    print_setup(s);
    print_methods(s);
    print_materials(s);
}

size_t report_not_finite(const Session *s) {
    const Reference *r = &s->reference;
    size_t bad = metrics_not_finite(r->shadowed, r->count) + metrics_not_finite(r->unshadowed, r->count);
    for (int m = 0; m < METHOD_COUNT; m++) {
        bad += metrics_not_finite(s->estimates[m].shadowed, s->view.count);
        bad += metrics_not_finite(s->estimates[m].unshadowed, s->view.count);
    }
    return bad;
}
