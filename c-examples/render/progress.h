/* A progress bar on stderr; one plain line per task if stderr is not a terminal. */
#ifndef RENDER_PROGRESS_H
#define RENDER_PROGRESS_H

#include <stdbool.h>
#include <stddef.h>

typedef struct Progress {
    const char *task;
    size_t total, done;
    int percent; /* last one drawn */
    bool terminal;
    double start; /* wall clock, seconds */
} Progress;

Progress progress_begin(const char *task, size_t total);

/* Counts one more step. The caller serialises the calls. */
void progress_step(Progress *progress);

void progress_end(const Progress *progress);

/* Wall clock in seconds. */
double wall_seconds(void);

#endif
