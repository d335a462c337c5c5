/* Renders five spheres with five ways to sample an environment light, at equal numbers of samples, and prints how far each is from a
 * reference. */
#include <stdio.h>
#include <stdlib.h>

#include "../render/options.h"
#include "../render/panel.h"

#define SAMPLES 4u /* at a hit, of each pass */
#define REFERENCE_SAMPLES 16u

typedef struct Options {
    const char *map, *out;
    unsigned width, height, spp, reference_spp, threads;
} Options;

static const char HELP[] =
    "demo: direct light from an environment map, sampled in five ways with equal numbers of samples\n\n"
    "  --map FILE             a lat-long map, .hdr or .exr (default: a sky with a sun and windows)\n"
    "  --out FILE.png         the picture (default: demo.png)\n"
    "  --spp N                samples per pixel, a multiple of 4 (default: 16)\n"
    "  --reference-spp N      of each of two references, a multiple of 16 (default: 512)\n"
    "  --size WxH             pixels of one panel (default: 640x240)\n"
    "  --threads N            (default: one per processor)";

static bool parse(Options *o, int count, char **arguments) {
    const Option known[] = {{.name = "--map", .text = &o->map},
                            {.name = "--out", .text = &o->out},
                            {.name = "--spp", .count = &o->spp, .least = SAMPLES, .most = 65536},
                            {.name = "--reference-spp", .count = &o->reference_spp, .least = REFERENCE_SAMPLES, .most = 65536},
                            {.name = "--size", .count = &o->width, .second = &o->height, .least = 16, .most = 8192},
                            {.name = "--threads", .count = &o->threads, .least = 1, .most = 256}};
    return options_parse(known, sizeof known / sizeof known[0], HELP, count, arguments);
}

static bool report(const Options *o, const Light *light, const Camera *camera, const Films *films) {
    Easel easel = {camera, light, films, panel_exposure(films, 1.0f)};
    Panel panels[METHOD_COUNT + 1] = {{NULL, {0}}};
    Verdict v = judge(films);
    bool is_sound = true;
    printf("%-16s %9s %12s %12s %12s\n", "method", "seconds", "ns / sample", "relative MSE", "absolute MSE");
    for (uint32_t m = 0; m < films->count; m++) {
        const char *name = method_name(films->method[m].method);
        double samples = (double)films->method[m].count * o->spp;
        printf("%-16s %9.2f %12.1f %12.5f %12.5f\n", name, v.seconds[m], 1e9 * v.seconds[m] / samples, v.score[m].relative, v.score[m].absolute);
        panels[m].film = &films->method[m];
        snprintf(panels[m].caption, sizeof panels[m].caption, "%s, %u samples, relative MSE %.4f", name, o->spp, v.score[m].relative);
        is_sound = is_sound && isfinite(v.score[m].relative) && isfinite(v.score[m].absolute);
    }
    printf("%-16s %9s %12s %12.5f %12.5f\n", "reference itself", "", "", v.reference.relative, v.reference.absolute);
    puts("\nEqual numbers of samples, not equal time. Seconds are processor time of all threads, rays against these few spheres\n"
         "included. Relative MSE is the mean of d^2 / (truth^2 + 1e-4 mean^2), absolute MSE that of d^2 / mean^2.");
    snprintf(panels[METHOD_COUNT].caption, sizeof panels[0].caption, "reference, %u samples", 2 * o->reference_spp);
    return (panel_write(&easel, panel_all(camera), panels, METHOD_COUNT + 1, 2, NULL, o->out) || complain(o->out, "cannot be written")) &&
           (is_sound || complain("demo", "NaN or infinite colours"));
}

int main(int count, char **arguments) {
    Options o = {NULL, "demo.png", 640, 240, 16, 512, processors()};
    Light light = {0};
    Lighting lighting = {0};
    Films films = {.count = METHOD_COUNT};
    Camera camera;
    const char *why;
    bool done = parse(&o, count, arguments);
    if (!done) {
        return EXIT_FAILURE;
    }
    why = o.map != NULL ? light_read(&light, o.map) : light_make_sky(&light);
    camera = camera_make(vec3_make(0.0f, 2.7f, 18.0f), vec3_make(0.0f, 1.4f, 0.0f), 0.34f, o.width, o.height);
    for (uint32_t m = 0; m < METHOD_COUNT; m++) {
        Film film = {.method = (Method)m, .samples = SAMPLES, .budget = INFINITY, .most = o.spp / SAMPLES, .is_still = true};
        films.method[m] = film;
    }
    done = why == NULL || complain("light", why);
    done = done && (lighting_init(&lighting, &light, o.threads) == WIS_OK || complain("light", "the environment cannot be built"));
    done = done && (films_init(&films, &camera, INFINITY, o.reference_spp / REFERENCE_SAMPLES) || complain("demo", "out of memory"));
    if (done) {
        wis_status status = films_expose(films.method, films.count, &lighting, &camera, o.threads);
        status = status == WIS_OK ? films_expose(films.reference, REFERENCES, &lighting, &camera, o.threads) : status;
        done = status == WIS_OK ? report(&o, &light, &camera, &films) : complain("demo", wis_status_string(status));
    }
    films_free(&films);
    lighting_free(&lighting);
    light_free(&light);
    return done ? EXIT_SUCCESS : EXIT_FAILURE;
}
