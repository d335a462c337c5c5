/* The set of a picture: thing, ground and room as triangles, and the camera. Its scene is what render/scene.h asks. */
#ifndef GALLERY_SET_H
#define GALLERY_SET_H

#include "../render/camera.h"
#include "picture.h"

/* Makes a picture's set the scene, with a mesh from `path` (NULL: a knot). Returns NULL, or why it cannot. */
const char *set_build(const Picture *picture, const char *path);

void set_free(void);

Camera set_camera(const Picture *picture, uint32_t width, uint32_t height);

#endif
