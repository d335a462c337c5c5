/* A picture that grows pass by pass, one camera ray and one hit in each pixel. */
#ifndef RENDER_FILM_H
#define RENDER_FILM_H

#include "camera.h"
#include "integrate.h"

typedef struct Film {
    Method method;
    uint32_t samples;    /* at each hit: an even number */
    double budget;       /* processor time, of all threads */
    uint32_t most;       /* passes */
    bool is_still;       /* camera rays meet the middle of the pixel */
    uint32_t number;     /* tells random numbers of films apart */

    uint32_t passes;
    double seconds;
    size_t count; /* pixels */
    Vec3 *sum;    /* from malloc, and so are the others */
    uint32_t *taken, *escaped;        /* camera rays of each pixel, and those that met nothing */
    wis_visibility_cache *visibility; /* from malloc; NULL: rays of earlier passes are forgotten */
} Film;

/* Makes room for the picture of a film whose first six fields are set. Returns false if out of memory. Free the film even then. */
bool film_init(Film *film, const Camera *camera);

/* Lets wis_direct know what rays of earlier passes saw. Returns false if out of memory. */
bool film_remember(Film *film);

void film_free(Film *film);

/* Passes until each film has spent its budget, or has its most. Films take turns, so that what disturbs the machine disturbs all. */
wis_status films_expose(Film *films, uint32_t count, const Lighting *lighting, const Camera *camera, unsigned threads);

/* The mean over the hits of a pixel, or black. */
Vec3 film_mean(const Film *film, size_t pixel);

#endif
