/* One loop over a table of options. */
#include "options.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "parallel.h"

bool complain(const char *what, const char *why) {
    fprintf(stderr, "%s: %s\n", what, why);
    return false;
}

unsigned processors(void) {
    long online = sysconf(_SC_NPROCESSORS_ONLN);
    return online < 1 ? 1 : online > (long)PARALLEL_MAX_THREADS ? PARALLEL_MAX_THREADS : (unsigned)online;
}

static bool in_range(const Option *o, unsigned value) {
    return value >= o->least && value <= o->most;
}

static bool set(const Option *o, const char *value) {
    char more;
    if (o->text != NULL) {
        *o->text = value;
        return true;
    }
    if (o->number != NULL) {
        return sscanf(value, "%lf%c", o->number, &more) == 1 && *o->number > 0.0;
    }
    if (o->second != NULL) {
        return sscanf(value, "%ux%u%c", o->count, o->second, &more) == 2 && in_range(o, *o->count) && in_range(o, *o->second);
    }
    return sscanf(value, "%u%c", o->count, &more) == 1 && in_range(o, *o->count);
}

bool options_parse(const Option *known, size_t known_count, const char *help, int count, char **arguments) {
    for (int i = 1; i < count; i += 2) {
        size_t k = 0;
        while (k < known_count && strcmp(known[k].name, arguments[i]) != 0) {
            k++;
        }
        if (k == known_count || i + 1 == count || !set(&known[k], arguments[i + 1])) {
            return complain(arguments[i], help);
        }
    }
    return true;
}
