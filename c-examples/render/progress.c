/* Drawing progress and telling the time. */
#include "progress.h"

#include <stdio.h>
#include <time.h>
#include <unistd.h>

#define BAR_WIDTH 40

double wall_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

Progress progress_begin(const char *task, size_t total) {
    Progress p = {0};
    p.task = task;
    p.total = total;
    p.percent = -1;
    p.terminal = isatty(STDERR_FILENO) != 0;
    p.start = wall_seconds();
    return p;
}

static void draw(const Progress *p) {
    char bar[BAR_WIDTH + 1] = {0};
    for (int i = 0; i < BAR_WIDTH; i++) {
        bar[i] = i * 100 < p->percent * BAR_WIDTH ? '#' : '.';
    }
    fprintf(stderr, "\r%-24s [%s] %3d %%", p->task, bar, p->percent);
}

void progress_step(Progress *p) {
    int percent = 100;
    p->done++;
    if (p->done < p->total) {
        percent = (int)(100 * p->done / p->total);
    }
    if (p->terminal && percent != p->percent) {
        p->percent = percent;
        draw(p);
    }
}

void progress_end(const Progress *p) {
    const char *clear = p->terminal ? "\r\033[K" : "";
    fprintf(stderr, "%s%-24s %6.2f s\n", clear, p->task, wall_seconds() - p->start);
}
