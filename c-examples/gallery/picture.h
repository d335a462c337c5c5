/* The six pictures of the gallery: what stands where, made of what, under which light. */
#ifndef GALLERY_PICTURE_H
#define GALLERY_PICTURE_H

#include <stdbool.h>
#include <stddef.h>

#include "../render/scene.h"

/* The objects of a set, as scene_material knows them. */
enum { THING, LIGHT_SQUARE, DARK_SQUARE, WALL };

/* Angles are degrees about the vertical axis. The thing is 1 high and stands in the middle of the ground. */
typedef struct Picture {
    const char *name;   /* of its file */
    const char *mesh, *map; /* files of the data */
    const char *surface, *light; /* in words */
    Material thing, light_square, dark_square;
    float set_angle;    /* of thing, ground and room against the map */
    float thing_angle;  /* of the thing on the ground */
    float eye_angle, eye_height, eye_distance; /* of the camera, in the frame of the set */
    float target_height, half_width; /* half width of a panel at distance 1 */
    float exposure;     /* times the automatic one */
    bool room;          /* walls and a ceiling, with one window and one skylight */
    float crop_x, crop_y; /* middle of the magnified part, as shares of width and height */
    bool in_page;       /* whether docs/gallery.md shows that part */
} Picture;

#define PICTURES 6u

extern const Picture pictures[PICTURES];

#endif
