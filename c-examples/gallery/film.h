/* A picture that grows pass by pass, one camera ray and one hit in each pixel, until its processor time is spent. */
#ifndef GALLERY_FILM_H
#define GALLERY_FILM_H

#include "../render/integrate.h"
#include "set.h"

typedef struct Film {
    Method method;
    uint32_t samples; /* at each hit: an even number */
    uint32_t number;  /* tells random numbers of films apart */
    uint32_t turn;    /* passes so far */
    double seconds;   /* processor time so far, of all threads */
    size_t count;     /* pixels */
    Vec3 *sum;        /* from malloc, and so are the others */
    uint32_t *taken, *escaped; /* camera rays of each pixel, and those that met nothing */
    wis_visibility_cache *visibility; /* from malloc; NULL: rays of earlier passes are forgotten */
} Film;

/* Returns false if out of memory. Free the film even then. */
bool film_init(Film *film, Method method, uint32_t samples, uint32_t number, const Camera *camera);

/* Lets wis_direct know what rays of earlier passes saw. Returns false if out of memory. */
bool film_remember(Film *film);

void film_free(Film *film);

/* One more pass, which ends early, unless it is the first, where the film's time reaches `budget` seconds. */
wis_status film_pass(Film *film, const Lighting *lighting, const Camera *camera, double budget, unsigned threads);

/* The mean over the hits of a pixel, or black. */
Vec3 film_mean(const Film *film, size_t pixel);

#endif
