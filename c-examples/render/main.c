/* Renders one view with five ways to sample an environment light and prints how far each is from a reference. */
#include <stdio.h>
#include <stdlib.h>

#include "metrics.h"
#include "progress.h"
#include "report.h"
#include "session.h"
#include "sheet.h"

static bool complain(const char *what, const char *why) {
    fprintf(stderr, "render: %s: %s\n", what, why);
    return false;
}

static bool check(wis_status status, const char *what) {
    return status == WIS_OK || complain(what, wis_status_string(status));
}

static bool load(Session *s) {
    const Options *o = &s->options;
    const char *fault = o->env != NULL ? light_read(&s->light, o->env) : light_make_sky(&s->light);
    if (fault != NULL) {
        return complain("light", fault);
    }
    s->light.nearest = o->nearest;
    return check(lighting_init(&s->lighting, &s->light, o->threads), "building the environment") &&
           check(view_trace(&s->view, o->width, o->height), "tracing the view");
}

static bool render(Session *s) {
    const Options *o = &s->options;
    for (int m = 0; m < METHOD_COUNT; m++) {
        wis_status status =
            estimate_render(&s->estimates[m], (Method)m, &s->lighting, &s->view, o->spp, o->threads);
        if (!check(status, method_name((Method)m))) {
            return false;
        }
    }
    return check(reference_render(&s->reference, &s->lighting, &s->view, o->reference_spp, o->threads), "reference");
}

static bool write_sheet(const Session *s) {
    const Options *o = &s->options;
    const Reference *r = &s->reference;
    SheetPanel panels[METHOD_COUNT];
    char caption[96];
    for (int m = 0; m < METHOD_COUNT; m++) {
        metrics_difference(r, s->estimates[m].shadowed, r->shadowed, s->difference);
        panels[m].radiance = s->estimates[m].shadowed;
        snprintf(panels[m].caption, sizeof panels[m].caption, "%s, %u samples, relative error %.3f",
                 method_name((Method)m), o->spp, metrics_relative(r, r->shadowed, s->difference));
    }
    snprintf(caption, sizeof caption, "reference, compensated MIS with %u samples", o->reference_spp);
    return sheet_write(o->out, panels, caption, &s->light, &s->view, r) ||
           complain(o->out, "cannot be written");
}

static bool report(Session *s) {
    size_t bad = report_not_finite(s);
    s->difference = calloc(s->reference.count, sizeof *s->difference);
    if (s->difference == NULL) {
        return complain("comparing", "out of memory");
    }
    report_print(s);
    printf("\nNaN or infinite colours: %zu\n", bad);
    return write_sheet(s) && bad == 0;
}

static void free_all(Session *s) {
    for (int m = 0; m < METHOD_COUNT; m++) {
        estimate_free(&s->estimates[m]);
    }
    free(s->difference);
    reference_free(&s->reference);
    view_free(&s->view);
    lighting_free(&s->lighting);
    light_free(&s->light);
}

int main(int argc, char **argv) {
    Session s = {0};
    double start = wall_seconds();
    bool done;
    if (!options_parse(&s.options, argc, argv)) {
        return EXIT_FAILURE;
    }
    if (s.options.help) {
        options_help();
        return EXIT_SUCCESS;
    }
    done = load(&s) && render(&s) && report(&s);
    free_all(&s);
    if (done) {
        printf("%s written; %.1f s on %u threads\n", s.options.out, wall_seconds() - start, s.options.threads);
    }
    return done ? EXIT_SUCCESS : EXIT_FAILURE;
}
