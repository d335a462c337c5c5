/* The picture that compares the methods: one panel each, and the reference. */
#ifndef RENDER_SHEET_H
#define RENDER_SHEET_H

#include <stdbool.h>

#include "light.h"
#include "reference.h"
#include "render.h"

typedef struct SheetPanel {
    const Vec3 *radiance; /* for each point of the view */
    char caption[96];
} SheetPanel;

/* Writes the panels, and the reference as the last one, in two columns. Returns false if it cannot. */
bool sheet_write(const char *path, const SheetPanel panels[METHOD_COUNT], const char *reference_caption,
                 const Light *light, const View *view, const Reference *reference);

#endif
