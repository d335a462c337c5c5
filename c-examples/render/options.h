/* The command line of a program: names, each with a value. */
#ifndef RENDER_OPTIONS_H
#define RENDER_OPTIONS_H

#include <stdbool.h>
#include <stddef.h>

/* An option: a text, a number above 0, or one or two ("WxH") whole numbers from `least` to `most`. What it is not, is NULL. */
typedef struct Option {
    const char *name, **text;
    double *number;
    unsigned *count, *second, least, most;
} Option;

/* Reads all arguments. Returns false after it has printed what cannot be used, or the help. */
bool options_parse(const Option *known, size_t known_count, const char *help, int count, char **arguments);

/* Prints a sentence on what went wrong and returns false. */
bool complain(const char *what, const char *why);

/* As many threads as there are processors. */
unsigned processors(void);

#endif
