/* A counter under a mutex hands the jobs out: they are coarse, so the lock is hardly ever contended. */
#include "parallel.h"

#include <pthread.h>

typedef struct Queue {
    pthread_mutex_t lock;
    size_t next, count;
    wis_status status;
    parallel_job run;
    void *shared;
} Queue;

typedef struct Worker {
    pthread_t thread;
    Queue *queue;
    unsigned index;
} Worker;

/* Records how the previous job ended and returns the next one, or count if there is none. */
static size_t take(Queue *q, wis_status previous) {
    size_t job = q->count;
    pthread_mutex_lock(&q->lock);
    if (q->status == WIS_OK) {
        q->status = previous;
    }
    if (q->status == WIS_OK && q->next < q->count) {
        job = q->next++;
    }
    pthread_mutex_unlock(&q->lock);
    return job;
}

static void *work(void *argument) {
    Worker *self = argument;
    Queue *q = self->queue;
    size_t job = take(q, WIS_OK);
    while (job < q->count) {
        job = take(q, q->run(q->shared, self->index, job));
    }
    return NULL;
}

wis_status parallel_for(unsigned threads, size_t count, parallel_job run, void *shared) {
    Queue q = {PTHREAD_MUTEX_INITIALIZER, 0, count, WIS_OK, run, shared};
    Worker workers[PARALLEL_MAX_THREADS];
    unsigned started = 1;
    workers[0].queue = &q;
    workers[0].index = 0;
    for (; started < threads && started < PARALLEL_MAX_THREADS; started++) {
        workers[started].queue = &q;
        workers[started].index = started;
        if (pthread_create(&workers[started].thread, NULL, work, &workers[started]) != 0) {
            break;
        }
    }
    work(&workers[0]);
    for (unsigned i = 1; i < started; i++) {
        pthread_join(workers[i].thread, NULL);
    }
    pthread_mutex_destroy(&q.lock);
    return q.status;
}
