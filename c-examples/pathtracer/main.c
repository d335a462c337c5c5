/* Renders one scene by several methods and prints how far each is from a reference, in which time. */
#include <string.h>
#include <time.h>

#include "../render/image.h"
#include "path.h"

#define RELATIVE_FLOOR 1e-4 /* relative squared error: d^2 / (reference^2 + this mean^2) */

typedef struct Options {
    unsigned width, height, spp, reference, repeats, seed;
    const char *map, *method, *out;
} Options;

typedef struct Result {
    double seconds, mean, absolute, relative;
} Result;

static Options parse(int argc, char **argv) {
    Options o = {160, 90, 16, 256, 4, 1, NULL, NULL, NULL};
    const char *names[] = {"--width", "--height", "--spp", "--reference", "--repeats", "--seed"};
    unsigned *values[] = {&o.width, &o.height, &o.spp, &o.reference, &o.repeats, &o.seed};
    for (int i = 1; i < argc; i += 2) {
        size_t k = 0;
        while (k < 6 && strcmp(argv[i], names[k]) != 0) {
            k++;
        }
        if (i + 1 < argc && k < 6 && atoi(argv[i + 1]) > 0) {
            *values[k] = (unsigned)atoi(argv[i + 1]);
        } else if (i + 1 < argc && strcmp(argv[i], "--map") == 0) {
            o.map = argv[i + 1];
        } else if (i + 1 < argc && strcmp(argv[i], "--method") == 0) {
            o.method = argv[i + 1];
        } else if (i + 1 < argc && strcmp(argv[i], "--out") == 0) {
            o.out = argv[i + 1];
        } else {
            puts("pathtracer: the light of an environment map by MIS and by wis_direct\n\n"
                 "  --map FILE.hdr  a lat-long map (default: a sky with a sun and windows)\n"
                 "  --width N --height N --seed N\n"
                 "  --spp N         1, 4, 16 ... samples per pixel up to so many (default: 16)\n"
                 "  --method NAME   only that one beside MIS\n"
                 "  --out FILE.png  the last image\n"
                 "  --reference N   samples per pixel of each of two references (default: 256)\n"
                 "  --repeats N     images of N samples per pixel, and the same samples in more images of fewer (default: 4)");
            exit(EXIT_FAILURE);
        }
    }
    return o;
}

static const wis_environment *build_environment(const Light *light, uint32_t flags) {
    wis_environment_config config = {0};
    const wis_environment *environment;
    wis_memory_size size;
    void *scratch;
    config.size = sizeof config;
    config.layout = WIS_LAYOUT_LATLONG;
    config.width = light->width;
    config.height = light->height;
    config.channels = 3;
    config.format = WIS_FORMAT_F32;
    config.filter = WIS_FILTER_BILINEAR;
    config.flags = flags;
    config.pixels = light->texels;
    config.world_from_map = light_world_from_map;
    check(wis_environment_size(&config, &size, NULL));
    scratch = malloc(size.scratch_bytes);
    check(wis_environment_init(&config, malloc(size.bytes), size.bytes, scratch, size.scratch_bytes, &environment, NULL));
    free(scratch);
    return environment;
}

/* Answers the seconds it took. */
static double render(Tracer *t, const Options *o, const Method *method, uint32_t spp, uint32_t seed, Vec3 *image) {
    clock_t start = clock();
    t->method = method;
    for (uint32_t i = 0; i < o->width * o->height; i++) {
        image[i] = vec3_make(0, 0, 0);
        memset(t->hits, 0, sizeof t->hits);
        t->pixel = (seed * 0x9e3779b1u) ^ i;
        t->random = ((uint64_t)seed << 32) + i * 0x632be59bd9b4e019u;
        check(wis_sampler_begin_pixel(t->sampler));
        for (uint32_t s = 0; s < spp; s++) {
            float x = (float)(i % o->width) + uniform(t), y = (float)(i / o->width) + uniform(t);
            Vec3 color;
            x = (x - 0.5f * (float)o->width) * 0.62f / (float)o->height;
            y = (0.5f * (float)o->height - y) * 0.62f / (float)o->height;
            color = path(t, vec3_make(0, 2.6f, 5.5f), vec3_normalise(vec3_make(x, y - 0.43f, -1)));
            image[i] = vec3_axpy(image[i], 1 / (float)spp, color);
        }
    }
    return (double)(clock() - start) / CLOCKS_PER_SEC;
}

/* The error of an image, unbiased by the noise of the two references, which are independent of one another. */
static void add_error(Result *result, const Options *o, const Vec3 *image, Vec3 *const reference[2], double mean,
                      double share) {
    size_t pixels = (size_t)o->width * o->height;
    for (size_t i = 0; i < pixels; i++) {
        double y = luminance(image[i]), a = luminance(reference[0][i]), b = luminance(reference[1][i]);
        double truth = 0.5 * (a + b), squared = (y - a) * (y - b);
        result->mean += y / mean * share / (double)pixels;
        result->absolute += squared / (mean * mean) * share / (double)pixels;
        result->relative += squared / (truth * truth + RELATIVE_FLOOR * mean * mean) * share / (double)pixels;
    }
}

static bool write_picture(const Options *o, const Vec3 *image, double mean) {
    Image picture;
    bool written = image_init(&picture, o->width, o->height);
    for (uint32_t i = 0; written && i < o->width * o->height; i++) {
        image_set(&picture, i % o->width, i / o->width, image[i], (float)(0.5 / mean));
    }
    return written && image_write_png(&picture, o->out);
}

int main(int argc, char **argv) {
    Options o = parse(argc, argv);
    Method methods[] = {{"MIS", true, 0, NULL},
                        {"compensated", true, WIS_ENVIRONMENT_COMPENSATED, NULL},
                        {"direct", false, 0, NULL}};
    size_t pixels = (size_t)o.width * o.height, count = sizeof methods / sizeof methods[0];
    Vec3 *image = malloc(pixels * sizeof *image), *reference[2];
    Tracer t = {0};
    const char *fault = o.map != NULL ? light_read(&t.light, o.map) : light_make_sky(&t.light);
    double mean = 0;
    if (fault != NULL) {
        fprintf(stderr, "pathtracer: %s\n", fault);
        return EXIT_FAILURE;
    }
    scene_init();
    tracer_init(&t);
    for (size_t i = 0; i < count; i++) {
        methods[i].environment = build_environment(&t.light, methods[i].flags);
    }
    for (int k = 0; k < 2; k++) {
        reference[k] = malloc(pixels * sizeof *image);
        render(&t, &o, &methods[1 + k], o.reference, o.seed + 1000000 + (uint32_t)k, reference[k]);
    }
    for (size_t i = 0; i < pixels; i++) {
        mean += 0.5 * (double)luminance(vec3_add(reference[0][i], reference[1][i])) / (double)pixels;
    }
    printf("%s, %u x %u\n", o.map != NULL ? o.map : "the built-in sky", o.width, o.height);
    puts("                                                                 efficiency over MIS");
    puts("samples method        seconds    mean          MSE relative MSE  absolute  relative");
    for (uint32_t spp = 1; spp <= o.spp; spp *= 4) {
        Result mis = {0, 0, 0, 0};
        for (size_t m = 0; m < count; m++) {
            Result r = {0, 0, 0, 0};
            uint32_t repeats = o.repeats * o.spp / spp;
            if (m > 0 && o.method != NULL && strcmp(o.method, methods[m].name) != 0) {
                continue;
            }
            for (uint32_t k = 0; k < repeats; k++) {
                r.seconds += render(&t, &o, &methods[m], spp, o.seed + k, image) / repeats;
                add_error(&r, &o, image, reference, mean, 1.0 / repeats);
            }
            mis = m == 0 ? r : mis;
            printf("%7u %-12s %8.3f %7.4f %12.4e %12.4e %9.2f %9.2f\n", spp, methods[m].name, r.seconds, r.mean, r.absolute,
                   r.relative, mis.absolute * mis.seconds / (r.absolute * r.seconds),
                   mis.relative * mis.seconds / (r.relative * r.seconds));
            fflush(stdout);
        }
    }
    return o.out == NULL || write_picture(&o, image, mean) ? EXIT_SUCCESS : EXIT_FAILURE;
}
