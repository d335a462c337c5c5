/* Sharing independent jobs among POSIX threads. */
#ifndef RENDER_PARALLEL_H
#define RENDER_PARALLEL_H

#include <stddef.h>

#include "wis.h"

#define PARALLEL_MAX_THREADS 256u

/* Does one job; worker < threads tells which thread runs it. Jobs must not depend on one another. */
typedef wis_status (*parallel_job)(void *shared, unsigned worker, size_t job);

/* Runs jobs 0 .. count - 1 and returns the first failure; after one, no further job starts. */
wis_status parallel_for(unsigned threads, size_t count, parallel_job run, void *shared);

#endif
