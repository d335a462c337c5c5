/* Options, their defaults and their ranges. */
#include "options.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "parallel.h"

#define MAX_SIZE 8192u
#define MAX_SPP 65536u

void options_help(void) {
    puts("render: direct light from an environment map, sampled in five ways at equal sample counts\n"
         "\n"
         "  --env FILE             lat-long light, .hdr or .exr (default: $ENV, else a built-in sky)\n"
         "  --out FILE.png         the picture (default: render.png)\n"
         "  --spp N                samples per shading point, 2 to 4096 (default: 16)\n"
         "  --size WxH             pixels of one panel (default: 640x240)\n"
         "  --threads N            (default: one per processor)\n"
         "  --nearest              look the light up without filtering\n"
         "  --reference-spp N      samples per pixel of the reference (default: 512)\n"
         "  --help");
}

static uint32_t processors(void) {
#ifdef _SC_NPROCESSORS_ONLN
    long online = sysconf(_SC_NPROCESSORS_ONLN);
    if (online >= 1) {
        return online < (long)PARALLEL_MAX_THREADS ? (uint32_t)online : PARALLEL_MAX_THREADS;
    }
#endif
    return 1;
}

static Options defaults(void) {
    Options o = {0};
    const char *env = getenv("ENV");
    o.env = env != NULL && env[0] != '\0' ? env : NULL;
    o.out = "render.png";
    o.width = 640;
    o.height = 240;
    o.spp = 16;
    o.reference_spp = 512;
    o.threads = processors();
    return o;
}

/* Numbers separated by the characters of `separators`, each from 0 to MAX_SPP. */
static bool parse_numbers(const char *text, const char *separators, uint32_t *out) {
    for (size_t i = 0;; i++) {
        char *end;
        unsigned long value;
        errno = 0;
        value = strtoul(text, &end, 10);
        if (end == text || *text == '-' || errno != 0 || value > MAX_SPP || *end != separators[i]) {
            return false;
        }
        out[i] = (uint32_t)value;
        if (separators[i] == '\0') {
            return true;
        }
        text = end + 1;
    }
}

static bool parse_size(const char *text, Options *o) {
    uint32_t n[2];
    if (!parse_numbers(text, "x", n)) {
        return false;
    }
    o->width = n[0];
    o->height = n[1];
    return true;
}

/* Sets the option called name; returns false if there is none or the value is not one of its. */
static bool parse_value(Options *o, const char *name, const char *value) {
    if (strcmp(name, "--env") == 0) {
        o->env = value;
    } else if (strcmp(name, "--out") == 0) {
        o->out = value;
    } else if (strcmp(name, "--spp") == 0) {
        return parse_numbers(value, "", &o->spp);
    } else if (strcmp(name, "--reference-spp") == 0) {
        return parse_numbers(value, "", &o->reference_spp);
    } else if (strcmp(name, "--threads") == 0) {
        return parse_numbers(value, "", &o->threads);
    } else if (strcmp(name, "--size") == 0) {
        return parse_size(value, o);
    } else {
        return false;
    }
    return true;
}

static bool parse_flag(Options *o, const char *name) {
    if (strcmp(name, "--nearest") == 0) {
        o->nearest = true;
    } else if (strcmp(name, "--help") == 0) {
        o->help = true;
    } else {
        return false;
    }
    return true;
}

/* Fills what depends on other options and returns what is out of range, or NULL. */
static const char *complete(Options *o) {
    uint32_t batch = 2 * REFERENCE_BATCHES;
    o->reference_spp = (o->reference_spp + batch - 1) / batch * batch;
    if (o->width < 16 || o->height < 16 || o->width > MAX_SIZE || o->height > MAX_SIZE) {
        return "--size must be from 16x16 to 8192x8192";
    }
    if (o->spp < 2 || o->spp > 4096 || o->reference_spp < batch) {
        return "--spp must be from 2 to 4096, and --reference-spp at least 2";
    }
    if (o->threads < 1 || o->threads > PARALLEL_MAX_THREADS) {
        return "--threads must be from 1 to 256";
    }
    return NULL;
}

bool options_parse(Options *out, int argc, char **argv) {
    const char *fault;
    *out = defaults();
    for (int i = 1; i < argc; i++) {
        if (parse_flag(out, argv[i])) {
            continue;
        }
        if (i + 1 >= argc || !parse_value(out, argv[i], argv[i + 1])) {
            fprintf(stderr, "render: cannot use '%s'; see --help\n", argv[i]);
            return false;
        }
        i++;
    }
    fault = complete(out);
    if (fault != NULL) {
        fprintf(stderr, "render: %s\n", fault);
    }
    return fault == NULL;
}
