/* Allocating and freeing the threads' memory. */
#include "workers.h"

#include <stdlib.h>

static wis_status worker_init(Worker *worker, uint32_t spp, size_t samples) {
    wis_status status = workspace_init(&worker->workspace, spp, 0);
    worker->samples = malloc(samples * sizeof *worker->samples);
    if (status == WIS_OK && worker->samples == NULL) {
        status = WIS_MEMORY_TOO_SMALL;
    }
    return status;
}

wis_status workers_init(Worker **out, unsigned threads, uint32_t spp, size_t samples) {
    wis_status status = WIS_OK;
    Worker *workers = calloc(threads, sizeof *workers);
    *out = workers;
    if (workers == NULL) {
        return WIS_MEMORY_TOO_SMALL;
    }
    for (unsigned i = 0; i < threads && status == WIS_OK; i++) {
        status = worker_init(&workers[i], spp, samples);
    }
    return status;
}

void workers_free(Worker *workers, unsigned threads) {
    for (unsigned i = 0; workers != NULL && i < threads; i++) {
        workspace_free(&workers[i].workspace);
        free(workers[i].samples);
    }
    free(workers);
}
