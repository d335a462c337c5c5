/* Renders the pictures of the gallery by MIS, by compensated MIS and by wis_direct, with equal processor time. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "../render/options.h"
#include "../render/panel.h"
#include "page.h"
#include "set.h"

/* Seconds of the methods, and of each reference, for a picture. */
#define SECONDS 7.0
#define REFERENCE_SECONDS 14.0
/* At each hit, as in the loop of the README: the two halves of MIS are blocks of the Sobol sequence. */
#define SAMPLES 4u
/* The magnified part, in pixels: three of them are 1280 wide. */
#define CROP_WIDTH 210
#define CROP_HEIGHT 180

typedef struct Options {
    const char *out, *data, *map, *only, *page;
    double seconds, reference_seconds;
    unsigned width, height, threads, samples;
} Options;

typedef struct Studio {
    Light light;
    Lighting lighting;
    Camera camera;
    Films films;
} Studio;

static const char HELP[] =
    "gallery: six pictures by MIS and by wis_direct, with equal processor time\n\n"
    "  --out FOLDER       of the pictures (default: gallery)\n"
    "  --data FOLDER      with envmaps/ and meshes/ (default: a sky and a knot are made)\n"
    "  --map FILE         a lat-long map, .hdr or .exr, in place of those of the data\n"
    "  --only NAME        one picture\n"
    "  --page FILE        of the tables (default: the terminal)\n"
    "  --seconds S        processor time of each method in each picture (default: 7)\n"
    "  --reference S      of each of two references (default: 14)\n"
    "  --samples N        at each hit, even (default: 4)\n"
    "  --size WxH         of a picture (default: 1280x720)";

static bool parse(Options *o, int count, char **arguments) {
    const Option known[] = {{.name = "--out", .text = &o->out},
                            {.name = "--data", .text = &o->data},
                            {.name = "--map", .text = &o->map},
                            {.name = "--only", .text = &o->only},
                            {.name = "--page", .text = &o->page},
                            {.name = "--seconds", .number = &o->seconds},
                            {.name = "--reference", .number = &o->reference_seconds},
                            {.name = "--samples", .count = &o->samples, .least = 2, .most = MAX_SAMPLES},
                            {.name = "--size", .count = &o->width, .second = &o->height, .least = 240, .most = 8192}};
    return options_parse(known, sizeof known / sizeof known[0], HELP, count, arguments) &&
           (o->samples % 2 == 0 || complain("--samples", HELP));
}

/* The path of a file of the data, or NULL if it is not there. */
static const char *find(const Options *o, const char *kind, const char *name, char path[512]) {
    snprintf(path, 512, "%s/%s/%s", o->data != NULL ? o->data : "", kind, name);
    return o->data != NULL && access(path, R_OK) == 0 ? path : NULL;
}

static bool prepare(Studio *s, const Options *o, const Picture *p, Result *r) {
    static const Method methods[METHODS] = {METHOD_MIS, METHOD_MIS_COMPENSATED, METHOD_WIS, METHOD_WIS};
    char mesh[512], map[512];
    const char *mesh_path = find(o, "meshes", p->mesh, mesh), *map_path = find(o, "envmaps", p->map, map), *why;
    map_path = o->map != NULL ? o->map : map_path;
    r->picture = p;
    r->has_mesh = mesh_path != NULL;
    r->has_map = map_path != NULL;
    r->other_map = o->map;
    why = map_path != NULL ? light_read(&s->light, map_path) : light_make_sky(&s->light);
    if (why == NULL) {
        why = set_build(p, mesh_path);
    }
    if (why != NULL) {
        return complain(p->name, why);
    }
    if (lighting_init(&s->lighting, &s->light, o->threads) != WIS_OK) {
        return complain(p->name, "the environment cannot be built");
    }
    s->camera = set_camera(p, (o->width - 3 * PANEL_GUTTER) / 2, o->height - 2 * PANEL_CAPTION - PANEL_GUTTER);
    s->films.count = METHODS;
    for (int m = 0; m < METHODS; m++) {
        Film film = {.method = methods[m], .samples = o->samples, .budget = o->seconds, .most = UINT32_MAX};
        s->films.method[m] = film;
    }
    return (films_init(&s->films, &s->camera, o->reference_seconds, UINT32_MAX) && film_remember(&s->films.method[REMEMBERING])) ||
           complain(p->name, "out of memory");
}

static uint32_t placed(float share, uint32_t size, uint32_t part) {
    float first = share * (float)size - 0.5f * (float)part;
    return (uint32_t)fmaxf(0.0f, fminf(first, (float)(size - part)));
}

/* MIS beside wis_direct, the truth, and a part of all three, magnified. */
static bool write_pictures(const Studio *s, const Options *o, const Result *r) {
    const Picture *p = r->picture;
    const Verdict *v = &r->verdict;
    const Camera *c = &s->camera;
    Easel easel = {c, &s->light, &s->films, panel_exposure(&s->films, p->exposure)};
    uint32_t width = c->width < CROP_WIDTH ? c->width : CROP_WIDTH, height = c->height < CROP_HEIGHT ? c->height : CROP_HEIGHT;
    Window part = {placed(p->crop_x, c->width, width), placed(p->crop_y, c->height, height), width, height, 2};
    Panel panels[3] = {{&s->films.method[MIS], {0}}, {&s->films.method[DIRECT], {0}}, {NULL, "reference"}};
    static const int methods[2] = {MIS, DIRECT};
    static const char *const names[2] = {"MIS", "wis_direct"};
    char path[512], below[256];
    bool written;
    for (int i = 0; i < 2; i++) {
        int m = methods[i];
        snprintf(panels[i].caption, sizeof panels[i].caption, "%s, %.1f s, %.0f samples, relMSE %.4f", names[i], v->seconds[m], v->samples[m],
                 v->score[m].relative);
    }
    snprintf(below, sizeof below, "%s: %s; %s. Left and right took the same time.", p->name, p->surface, page_light(r));
    snprintf(path, sizeof path, "%s/%s.png", o->out, p->name);
    written = panel_write(&easel, panel_all(c), panels, 2, 2, below, path);
    snprintf(path, sizeof path, "%s/%s-truth.png", o->out, p->name);
    written = panel_write(&easel, panel_all(c), panels + 2, 1, 1, NULL, path) && written;
    for (int i = 0; i < 2; i++) {
        snprintf(panels[i].caption, sizeof panels[i].caption, "%s, %.1f s, relative MSE %.4f", names[i], v->seconds[methods[i]],
                 v->score[methods[i]].relative);
    }
    snprintf(path, sizeof path, "%s/%s-crop.png", o->out, p->name);
    return (panel_write(&easel, part, panels, 3, 3, NULL, path) && written) || complain(o->out, "cannot be written");
}

static bool render(const Options *o, const Picture *p, Result *r) {
    Studio s = {0};
    bool done = prepare(&s, o, p, r);
    if (done) {
        wis_status status = films_expose(s.films.method, METHODS, &s.lighting, &s.camera, o->threads);
        status = status == WIS_OK ? films_expose(s.films.reference, REFERENCES, &s.lighting, &s.camera, o->threads) : status;
        done = status == WIS_OK || complain(p->name, wis_status_string(status));
    }
    if (done) {
        r->verdict = judge(&s.films);
        done = o->out == NULL || write_pictures(&s, o, r);
    }
    films_free(&s.films);
    lighting_free(&s.lighting);
    light_free(&s.light);
    set_free();
    return done;
}

/* NaN, or an error that is not above 0, says that something is wrong, but for a black map. */
static bool sound(const Result *r) {
    bool is_sound = true;
    for (int m = 0; m < METHODS; m++) {
        is_sound = is_sound && r->verdict.score[m].relative > 0.0 && isfinite(r->verdict.score[m].absolute);
    }
    return is_sound || r->verdict.reference.absolute == 0.0 || complain(r->picture->name, "an error is not a number above 0");
}

/* The pictures a quarter as wide and high, with as much time for a pixel, at several numbers of samples at a hit. */
static bool render_small(const Options *options, Result results[PICTURES][COUNTS], const uint32_t counts[COUNTS]) {
    Options o = *options;
    bool done = true;
    o.out = NULL;
    o.width /= 4;
    o.height /= 4;
    o.seconds /= 16.0;
    o.reference_seconds /= 16.0;
    fprintf(stderr, "gallery: small pictures\n");
    for (uint32_t i = 0; i < PICTURES * COUNTS && done; i++) {
        o.samples = counts[i % COUNTS];
        done = render(&o, &pictures[i / COUNTS], &results[i / COUNTS][i % COUNTS]);
    }
    return done;
}

int main(int count, char **arguments) {
    Options o = {"gallery", NULL, NULL, NULL, NULL, SECONDS, REFERENCE_SECONDS, 1280, 720, processors(), SAMPLES};
    static const uint32_t counts[COUNTS] = {2, 4, 8, 16};
    static Result results[PICTURES], small[PICTURES][COUNTS];
    Page page;
    uint32_t rendered = 0;
    bool done = parse(&o, count, arguments) && (mkdir(o.out, 0777) == 0 || errno == EEXIST || complain(o.out, strerror(errno)));
    for (uint32_t i = 0; done && i < PICTURES; i++) {
        if (o.only == NULL || strcmp(o.only, pictures[i].name) == 0) {
            fprintf(stderr, "gallery: %s\n", pictures[i].name);
            done = render(&o, &pictures[i], &results[rendered]) && sound(&results[rendered]);
            rendered++;
        }
    }
    done = done && (o.only != NULL || render_small(&o, small, counts));
    page = (Page){results, rendered, o.width, o.height, o.samples, o.seconds, o.reference_seconds,
                  o.only == NULL ? (const Result(*)[COUNTS])small : NULL, counts};
    if (done) {
        done = page_write(&page, o.page) || complain("--page", "cannot be written");
    }
    return done ? EXIT_SUCCESS : EXIT_FAILURE;
}
