/* Renders one scene by several methods and prints how far each is from a reference, in which time. */
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "../render/environment.h"
#include "../render/image.h"
#include "../render/options.h"
#include "../render/score.h"
#include "path.h"

/* Of wis_direct: beside BSDF rays that bring the light up to the mean of the map, and alone. */
static const Method METHODS[] = {{"mis", BY_LIGHT, BALANCE, 0, false},
                                 {"compensated", BY_LIGHT, BALANCE, WIS_ENVIRONMENT_COMPENSATED, false},
                                 {"direct", BY_DIRECT, BASE, WIS_ENVIRONMENT_COMPENSATED, false},
                                 {"alone", BY_DIRECT, NOTHING, 0, false},
                                 {"unshared", BY_DIRECT, BASE, WIS_ENVIRONMENT_COMPENSATED, true}};
#define COUNT (sizeof METHODS / sizeof METHODS[0])

typedef struct Options {
    unsigned width, height, least, most, reference, repeats, rays, depth, stride, seed, stratified, coarse;
    const char *map, *methods, *out;
} Options;

typedef struct Result {
    double seconds, mean;
    Score score, seen[OBJECTS]; /* of all pixels, and of those that see each object */
} Result;

/* Rows of images that were rendered, of how many. */
typedef struct Progress {
    size_t done, total;
} Progress;

static const char HELP[] =
    "pathtracer: the light of an environment map by MIS, by products and by wis_direct\n\n"
    "  --map FILE        a lat-long map, .hdr or .exr (default: a sky with a sun and windows)\n"
    "  --width N --height N --seed N (default: 96 x 54, seed 1)\n"
    "  --least N         1, 4, 16 ... samples per pixel, from so many (default: 1)\n"
    "  --most N          up to so many (default: 16)\n"
    "  --rays N          rays for light at each hit, 1 to 4 (default: 1)\n"
    "  --depth N         hits of a path, 1 to 4; 1: direct light alone (default: 4)\n"
    "  --stride N        every Nth pixel of an image that is N times as wide and as high (default: 1)\n"
    "  --stratified 1    a (0,2)-sequence in place of random numbers\n"
    "  --without N       without the mesh (1), the metal sphere (2), the disc (4), or several (their sum)\n"
    "  --material N      1 to 4: all of Lambert, GGX 0.2, GGX 0.05, patterned Lambert (default 0: of several)\n"
    "  --coarse 1        a mesh of 960 triangles in place of 115,200\n"
    "  --methods LIST    of mis,compensated,direct,alone,unshared (default: the first four)\n"
    "  --out FILE.png    the last image\n"
    "  --reference N     samples per pixel of each of two references (default: 32)\n"
    "  --repeats N       images of most samples per pixel, and the same samples in more images of fewer (default: 2)";

static bool parse(Options *o, int count, char **arguments) {
    const Option known[] = {{.name = "--map", .text = &o->map},
                            {.name = "--methods", .text = &o->methods},
                            {.name = "--out", .text = &o->out},
                            {.name = "--width", .count = &o->width, .least = 1, .most = 8192},
                            {.name = "--height", .count = &o->height, .least = 1, .most = 8192},
                            {.name = "--least", .count = &o->least, .least = 1, .most = 65536},
                            {.name = "--most", .count = &o->most, .least = 1, .most = 65536},
                            {.name = "--rays", .count = &o->rays, .least = 1, .most = MAX_RAYS},
                            {.name = "--depth", .count = &o->depth, .least = 1, .most = MAX_DEPTH},
                            {.name = "--stride", .count = &o->stride, .least = 1, .most = 8192},
                            {.name = "--seed", .count = &o->seed, .most = 1000000},
                            {.name = "--stratified", .count = &o->stratified, .most = 1},
                            {.name = "--without", .count = &without, .most = THE_MESH + THE_METAL + THE_DISC},
                            {.name = "--material", .count = &everywhere, .most = MATERIALS - OBJECTS},
                            {.name = "--coarse", .count = &o->coarse, .most = 1},
                            {.name = "--reference", .count = &o->reference, .least = 1, .most = 65536},
                            {.name = "--repeats", .count = &o->repeats, .least = 1, .most = 65536}};
    return options_parse(known, sizeof known / sizeof known[0], HELP, count, arguments);
}

/* On a terminal, says how much is done. */
static void step(Progress *progress) {
    if (isatty(STDERR_FILENO)) {
        fprintf(stderr, "\r%3u %%\r", (unsigned)(100 * ++progress->done / progress->total));
    }
}

/* The direction of a place of the picture, in pixels. */
static Vec3 view(const Options *o, uint32_t pixel, float x, float y) {
    float all = (float)(o->height * o->stride);
    x = ((float)(pixel % o->width * o->stride) + x - 0.5f * (float)(o->width * o->stride)) * 0.62f / all;
    y = (0.5f * all - (float)(pixel / o->width * o->stride) - y) * 0.62f / all;
    return vec3_normalise(vec3_make(x, y - 0.42f, -1));
}

static const Vec3 EYE = {0, 2.4f, 4.6f};

/* Answers the seconds it took. */
static double render(Tracer *t, const Options *o, const Method *method, const wis_environment *const lights[2], uint32_t spp, uint32_t seed, Vec3 *image,
                     Progress *progress) {
    wis_sampler_config config = {.size = sizeof config, .rays = t->rays, .hits_per_pixel = method->unshared ? 0 : spp};
    wis_memory_size size;
    void *memory;
    clock_t start;
    check(wis_sampler_size(&config, &size, NULL));
    memory = malloc(size.bytes);
    check(wis_sampler_init(&config, memory, size.bytes, &t->sampler, NULL));
    t->method = *method;
    t->environment = lights[method->flags != 0];
    start = clock();
    for (uint32_t i = 0; i < o->width * o->height; i++) {
        if (i % o->width == 0) {
            step(progress);
        }
        image[i] = vec3_make(0, 0, 0);
        memset(t->hits, 0, sizeof t->hits);
        t->pixel = pixel_seed(i % o->width, i / o->width, seed);
        t->random = ((uint64_t)seed << 32) + i * 0x632be59bd9b4e019u;
        check(wis_sampler_begin_pixel(t->sampler));
        for (t->sample = 0; t->sample < spp; t->sample++) {
            float u[2];
            numbers(t, 0, 1, u);
            image[i] = vec3_axpy(image[i], 1 / (float)spp, path(t, EYE, view(o, i, u[0], u[1])));
        }
    }
    start = clock() - start;
    free(memory);
    return (double)start / CLOCKS_PER_SEC;
}

static void add_error(Result *result, const Options *o, const Vec3 *image, Vec3 *const reference[2], double mean, double share) {
    size_t pixels = (size_t)o->width * o->height;
    for (size_t i = 0; i < pixels; i++) {
        double y = luminance(image[i]), a = luminance(reference[0][i]), b = luminance(reference[1][i]);
        Hit hit;
        score_add_sample(&result->score, y, a, b, mean, share / (double)pixels);
        if (scene_trace(EYE, view(o, (uint32_t)i, 0.5f, 0.5f), &hit)) {
            score_add_sample(&result->seen[hit.object], y, a, b, mean, share / (double)pixels);
        }
        result->mean += mean > 0 ? y / mean * share / (double)pixels : 0;
    }
}

/* What `time` and `error` are worth beside the first method's; two without an error are alike. */
static double efficiency(double first_error, double first_seconds, double error, double seconds) {
    return error == first_error ? first_seconds / seconds : first_error * first_seconds / (error * seconds);
}

static bool write_picture(const Options *o, const Vec3 *image, double mean) {
    Image picture;
    bool written = image_init(&picture, o->width, o->height);
    for (uint32_t i = 0; written && i < o->width * o->height; i++) {
        image_set(&picture, i % o->width, i / o->width, image[i], (float)(0.5 / mean));
    }
    written = written && image_write_png(&picture, o->out);
    image_free(&picture);
    return written;
}

int main(int argc, char **argv) {
    Options o = {96, 54, 1, 16, 32, 2, 1, MAX_DEPTH, 1, 1, 0, 0, NULL, "mis,compensated,direct,alone", NULL};
    static Tracer t;
    if (!parse(&o, argc, argv)) {
        return EXIT_FAILURE;
    }
    size_t pixels = (size_t)o.width * o.height, count = 0;
    Vec3 *image = malloc(pixels * sizeof *image), *reference[2];
    const char *fault = o.map != NULL ? light_read(&t.light, o.map) : light_make_sky(&t.light);
    Environment environments[2] = {{NULL, NULL}};
    const wis_environment *lights[2];
    bool written;
    Progress progress = {0, 2 * (size_t)o.height};
    wis_environment_info info = {.size = sizeof info};
    Method methods[COUNT];
    double mean = 0;
    if (fault != NULL) {
        complain("pathtracer", fault);
        return EXIT_FAILURE;
    }
    scene_init(o.coarse != 0);
    for (int k = 0; k < 2; k++) {
        check(environment_build(&environments[k], &t.light, k == 0 ? 0 : WIS_ENVIRONMENT_COMPENSATED, 1));
        lights[k] = environments[k].handle;
    }
    check(wis_environment_describe(lights[1], &info));
    t.mean = (float)info.mean;
    for (const char *name = o.methods; *name != '\0'; name += strcspn(name, ","), name += *name == ',') {
        for (size_t k = 0; k < COUNT && count < COUNT; k++) {
            if (strlen(METHODS[k].name) == strcspn(name, ",") && strncmp(name, METHODS[k].name, strcspn(name, ",")) == 0) {
                methods[count++] = METHODS[k];
            }
        }
    }
    t.depth = o.depth;
    for (int k = 0; k < 2; k++) {
        reference[k] = malloc(pixels * sizeof *image);
        t.rays = MAX_RAYS;
        t.stratified = true;
        render(&t, &o, &METHODS[3], lights, o.reference, o.seed + 1000000 + (uint32_t)k, reference[k], &progress);
    }
    for (size_t i = 0; i < pixels; i++) {
        mean += 0.5 * (double)luminance(vec3_add(reference[0][i], reference[1][i])) / (double)pixels;
    }
    t.rays = o.rays;
    t.stratified = o.stratified != 0;
    printf("%s, %u x %u, %u rays at a hit, %s\n", o.map != NULL ? o.map : "the built-in sky", o.width, o.height, o.rays,
           t.stratified ? "(0,2)-sequence" : "random numbers");
    printf("                                                                      efficiency over %s, share of disc and mesh\n", methods[0].name);
    puts("samples method             seconds    mean          MSE relative MSE  absolute  relative      disc      mesh");
    for (uint32_t spp = o.least; spp <= o.most; spp *= 4) {
        Result first, results[COUNT] = {{0, 0, {0, 0}, {{0, 0}}}};
        uint32_t repeats = o.repeats * o.most / spp;
        progress = (Progress){0, repeats * count * o.height};
        /* Methods in turns: what disturbs the machine disturbs all. */
        for (uint32_t k = 0; k < repeats; k++) {
            for (size_t m = 0; m < count; m++) {
                results[m].seconds += render(&t, &o, &methods[m], lights, spp, o.seed + k, image, &progress) / repeats;
                add_error(&results[m], &o, image, reference, mean, 1.0 / repeats);
            }
        }
        first = results[0];
        for (size_t m = 0; m < count; m++) {
            Result r = results[m];
            printf("%7u %-16s %9.6f %7.4f %12.4e %12.4e %9.2f %9.2f", spp, methods[m].name, r.seconds, r.mean, r.score.absolute,
                   r.score.relative, efficiency(first.score.absolute, first.seconds, r.score.absolute, r.seconds),
                   efficiency(first.score.relative, first.seconds, r.score.relative, r.seconds));
            for (int object = 0; object < 2; object++) {
                printf(" %9.5f", r.score.relative > 0 ? r.seen[object].relative / r.score.relative : 0);
            }
            puts("");
        }
        fflush(stdout);
    }
    written = o.out == NULL || write_picture(&o, image, mean);
    for (int k = 0; k < 2; k++) {
        environment_free(&environments[k]);
        free(reference[k]);
    }
    free(image);
    return written ? EXIT_SUCCESS : EXIT_FAILURE;
}
