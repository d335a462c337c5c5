/* Renders the pictures of the gallery by MIS, by compensated MIS and by wis_direct, with equal processor time. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "../render/image.h"
#include "page.h"
#include "panel.h"

/* Seconds of the methods, and of each reference, for a picture. */
#define SECONDS 7.0
#define REFERENCE_SECONDS 14.0
/* At each hit, as in the loop of the README: the two halves of MIS are blocks of the Sobol sequence. */
#define SAMPLES 4u
#define REFERENCE_SAMPLES 16u
#define MAX_THREADS 256u

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
    "  --out FOLDER       of pictures and index.html (default: gallery)\n"
    "  --data FOLDER      with envmaps/ and meshes/ (default: a sky and a knot are made)\n"
    "  --map FILE         a lat-long map, .hdr or .exr, in place of those of the data\n"
    "  --only NAME        one picture\n"
    "  --page FILE.md     also write this page\n"
    "  --seconds S        processor time of each method in each picture (default: 7)\n"
    "  --reference S      of each of two references (default: 14)\n"
    "  --samples N        at each hit, even (default: 4)\n"
    "  --size WxH         of a picture (default: 1280x720)";

static bool complain(const char *what, const char *why) {
    fprintf(stderr, "gallery: %s: %s\n", what, why);
    return false;
}

static unsigned processors(void) {
    long online = sysconf(_SC_NPROCESSORS_ONLN);
    return online < 1 ? 1 : online > (long)MAX_THREADS ? MAX_THREADS : (unsigned)online;
}

static bool set_option(Options *o, const char *name, const char *value) {
    const struct { const char *name, **text; double *number; unsigned *count; } known[] = {
        {"--out", &o->out, NULL, NULL}, {"--data", &o->data, NULL, NULL}, {"--map", &o->map, NULL, NULL},
        {"--only", &o->only, NULL, NULL}, {"--page", &o->page, NULL, NULL}, {"--seconds", NULL, &o->seconds, NULL},
        {"--reference", NULL, &o->reference_seconds, NULL}, {"--samples", NULL, NULL, &o->samples}};
    if (strcmp(name, "--size") == 0) {
        return sscanf(value, "%ux%u", &o->width, &o->height) == 2;
    }
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        if (strcmp(name, known[i].name) == 0 && known[i].text != NULL) {
            *known[i].text = value;
            return true;
        }
        if (strcmp(name, known[i].name) == 0 && known[i].number != NULL) {
            *known[i].number = atof(value);
            return *known[i].number > 0.0;
        }
        if (strcmp(name, known[i].name) == 0) {
            *known[i].count = (unsigned)atoi(value);
            return *known[i].count >= 2 && *known[i].count <= 64 && *known[i].count % 2 == 0;
        }
    }
    return false;
}

static bool parse(Options *o, int count, char **arguments) {
    for (int i = 1; i < count; i += 2) {
        if (i + 1 == count || !set_option(o, arguments[i], arguments[i + 1])) {
            return complain(arguments[i], HELP);
        }
    }
    return (o->width >= 256 && o->height >= 240 && o->width <= 8192 && o->height <= 8192) || complain("--size", "out of range");
}

/* The path of a file of the data, or NULL if it is not there. */
static const char *find(const Options *o, const char *kind, const char *name, char path[512]) {
    snprintf(path, 512, "%s/%s/%s", o->data != NULL ? o->data : "", kind, name);
    return o->data != NULL && access(path, R_OK) == 0 ? path : NULL;
}

static bool prepare(Studio *s, const Options *o, const Picture *p, Result *r) {
    char mesh[512], map[512];
    const char *mesh_path = find(o, "meshes", p->mesh, mesh), *map_path = find(o, "envmaps", p->map, map), *why;
    uint32_t number = 0;
    bool made = true;
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
    for (int m = 0; m < METHODS; m++) {
        static const Method methods[METHODS] = {METHOD_MIS, METHOD_MIS_COMPENSATED, METHOD_WIS, METHOD_WIS};
        made = film_init(&s->films.method[m], methods[m], o->samples, number++, &s->camera) && made;
    }
    made = film_remember(&s->films.method[REMEMBERING]) && made;
    made = film_init(&s->films.reference[0], METHOD_MIS_COMPENSATED, REFERENCE_SAMPLES, number++, &s->camera) && made;
    made = film_init(&s->films.reference[1], METHOD_WIS, REFERENCE_SAMPLES, number++, &s->camera) && made;
    return made || complain(p->name, "out of memory");
}

/* Films take turns, a pass each, so that what disturbs the machine disturbs them alike. */
static bool expose(Studio *s, Film *films, uint32_t count, double budget, unsigned threads) {
    bool done = false;
    while (!done) {
        done = true;
        for (uint32_t i = 0; i < count; i++) {
            wis_status status = WIS_OK;
            if (films[i].seconds < budget) {
                status = film_pass(&films[i], &s->lighting, &s->camera, budget, threads);
                done = false;
            }
            if (status != WIS_OK) {
                return complain(method_name(films[i].method), wis_status_string(status));
            }
        }
    }
    return true;
}

static bool write_pictures(const Studio *s, const Options *o, const Result *r) {
    const Picture *p = r->picture;
    Easel easel = {p, &s->camera, &s->light, &s->films, r, panel_exposure(p, &s->films)};
    char path[512];
    bool written;
    snprintf(path, sizeof path, "%s/%s.png", o->out, p->name);
    written = panel_write_pair(&easel, path);
    snprintf(path, sizeof path, "%s/%s-truth.png", o->out, p->name);
    written = panel_write_truth(&easel, path) && written;
    snprintf(path, sizeof path, "%s/%s-crop.png", o->out, p->name);
    return (panel_write_crop(&easel, path) && written) || complain(o->out, "cannot be written");
}

static bool render(const Options *o, const Picture *p, Result *r) {
    Studio s = {0};
    bool done = prepare(&s, o, p, r) && expose(&s, s.films.method, METHODS, o->seconds, o->threads) &&
                expose(&s, s.films.reference, REFERENCES, o->reference_seconds, o->threads);
    if (done) {
        judge(&s.films, r);
        done = o->out == NULL || write_pictures(&s, o, r);
    }
    for (uint32_t i = 0; i < METHODS + REFERENCES; i++) {
        film_free(i < METHODS ? &s.films.method[i] : &s.films.reference[i - METHODS]);
    }
    lighting_free(&s.lighting);
    light_free(&s.light);
    set_free();
    return done;
}

/* NaN, or an error that is not above 0, says that something is wrong, but for a black map. */
static bool sound(const Result *r) {
    bool is_sound = true;
    if (r->reference.absolute == 0.0) {
        return true;
    }
    for (int m = 0; m < METHODS; m++) {
        is_sound = is_sound && r->score[m].relative > 0.0 && isfinite(r->score[m].absolute);
    }
    return is_sound || complain(r->picture->name, "an error is not a number above 0");
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
        page_print(&page);
        done = (page_write_html(&page, o.out) && (o.page == NULL || page_write_markdown(&page, o.page))) ||
               complain(o.out, "pages cannot be written");
    }
    return done ? EXIT_SUCCESS : EXIT_FAILURE;
}
