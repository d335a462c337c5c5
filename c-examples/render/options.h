/* The command line. */
#ifndef RENDER_OPTIONS_H
#define RENDER_OPTIONS_H

#include <stdbool.h>
#include <stdint.h>

#include "reference.h"

typedef struct Options {
    const char *env; /* NULL: the built-in sky */
    const char *out;
    uint32_t width, height;
    uint32_t spp, reference_spp;
    uint32_t threads;
    bool nearest, help;
} Options;

/* Fills *out from the defaults, the variable ENV and the arguments; on failure says why on stderr. */
bool options_parse(Options *out, int argc, char **argv);

void options_help(void);

#endif
