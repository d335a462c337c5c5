/* Laying the panels out. */
#include "sheet.h"

#include "image.h"

#define COLUMNS 2u
#define ROWS ((METHOD_COUNT + COLUMNS) / COLUMNS)
#define GUTTER 4u
#define CAPTION 22u

/* A log-average point is drawn this bright (1 = about mid white). */
#define KEY 0.35f

typedef struct Corner {
    uint32_t x, y;
} Corner;

static Corner panel_corner(const View *view, uint32_t index) {
    Corner c = {GUTTER + index % COLUMNS * (view->width + GUTTER),
                GUTTER + CAPTION + index / COLUMNS * (view->height + GUTTER + CAPTION)};
    return c;
}

/* One exposure for all panels, from the log-average of the reference. */
static float exposure_of(const Reference *r) {
    double mean = 0.0, logs = 0.0, n = (double)r->count;
    for (size_t i = 0; i < r->count; i++) {
        mean += luminance(r->shadowed[i]) / n;
    }
    for (size_t i = 0; i < r->count; i++) {
        logs += log(luminance(r->shadowed[i]) + 1e-3 * mean) / n;
    }
    return mean > 0.0 ? (float)(KEY / exp(logs)) : 1.0f;
}

static void draw_background(Image *image, Corner c, const Light *light, const View *view, float exposure) {
    for (uint32_t y = 0; y < view->height; y++) {
        for (uint32_t x = 0; x < view->width; x++) {
            Vec3 radiance = light_radiance(light, view_direction(view->width, view->height, x, y));
            image_set(image, c.x + x, c.y + y, radiance, exposure);
        }
    }
}

static void draw_points(Image *image, Corner c, const View *view, const Vec3 *radiance, float exposure) {
    for (size_t i = 0; i < view->count; i++) {
        image_set(image, c.x + view->points[i].x, c.y + view->points[i].y, radiance[i], exposure);
    }
}

static void draw_caption(Image *image, Corner c, const char *caption) {
    image_text(image, c.x + 2, c.y - CAPTION + 4, caption);
}

bool sheet_write(const char *path, const SheetPanel panels[METHOD_COUNT], const char *reference_caption,
                 const Light *light, const View *view, const Reference *reference) {
    Image image;
    bool written;
    float exposure = exposure_of(reference);
    Corner last = panel_corner(view, METHOD_COUNT);
    if (!image_init(&image, COLUMNS * (view->width + GUTTER) + GUTTER,
                    ROWS * (view->height + GUTTER + CAPTION) + GUTTER)) {
        return false;
    }
    for (uint32_t i = 0; i < METHOD_COUNT; i++) {
        Corner c = panel_corner(view, i);
        draw_background(&image, c, light, view, exposure);
        draw_points(&image, c, view, panels[i].radiance, exposure);
        draw_caption(&image, c, panels[i].caption);
    }
    draw_background(&image, last, light, view, exposure);
    draw_points(&image, last, view, reference->shadowed, exposure);
    draw_caption(&image, last, reference_caption);
    written = image_write_png(&image, path);
    image_free(&image);
    return written;
}
