/* One exposure for all panels of a picture. */
#include "panel.h"

#include "image.h"

/* A log-average point is drawn this bright (1 = about mid white). */
#define KEY 0.35f
/* Light that is seen directly is clipped here, so that the edge before a lamp stays smooth. White is 6. */
#define CLIP 6.0f
/* Places in a pixel along an axis, at which the map behind it is looked up. */
#define FINE 3u

float panel_exposure(const Films *films, float factor) {
    double mean = judge_mean(films), logs = 0.0, count = 0.0;
    for (size_t i = 0; i < films->reference[0].count; i++) {
        if (judge_covers(films, i)) {
            logs += log(luminance(judge_truth(films, i)) + 1e-2 * mean);
            count += 1.0;
        }
    }
    return mean > 0.0 ? factor * (float)(KEY / exp(logs / count)) : 1.0f;
}

Window panel_all(const Camera *camera) {
    Window all = {0, 0, camera->width, camera->height, 1};
    return all;
}

static Vec3 background(const Easel *e, size_t pixel) {
    Vec3 sum = {0.0f, 0.0f, 0.0f}, most = vec3_scale(vec3_make(1.0f, 1.0f, 1.0f), CLIP / e->exposure);
    float x = (float)(pixel % e->camera->width), y = (float)(pixel / e->camera->width);
    for (uint32_t i = 0; i < FINE * FINE; i++) {
        float u = ((float)(i % FINE) + 0.5f) / FINE, v = ((float)(i / FINE) + 0.5f) / FINE;
        sum = vec3_add(sum, vec3_min(light_radiance(e->light, camera_direction(e->camera, x + u, y + v)), most));
    }
    return vec3_scale(sum, 1.0f / (FINE * FINE));
}

static Vec3 look(const Easel *e, const Film *film, size_t pixel) {
    float escaped;
    Vec3 light;
    if (film == NULL) {
        return vec3_scale(vec3_add(look(e, &e->films->reference[0], pixel), look(e, &e->films->reference[1], pixel)), 0.5f);
    }
    escaped = film->taken[pixel] > 0 ? (float)film->escaped[pixel] / (float)film->taken[pixel] : 1.0f;
    light = vec3_scale(film_mean(film, pixel), 1.0f - escaped);
    return escaped > 0.0f ? vec3_axpy(light, escaped, background(e, pixel)) : light;
}

static void draw(const Easel *e, Image *image, uint32_t x, uint32_t y, Window w, const Film *film) {
    for (uint32_t row = 0; row < w.height * w.times; row++) {
        for (uint32_t column = 0; column < w.width * w.times; column++) {
            size_t pixel = (size_t)(w.top + row / w.times) * e->camera->width + w.left + column / w.times;
            image_set(image, x + column, y + row, look(e, film, pixel), e->exposure);
        }
    }
}

bool panel_write(const Easel *e, Window w, const Panel *panels, uint32_t count, uint32_t columns, const char *below, const char *path) {
    uint32_t width = w.width * w.times, height = w.height * w.times, rows = (count + columns - 1) / columns;
    Image image;
    bool written;
    if (!image_init(&image, columns * (width + PANEL_GUTTER) + PANEL_GUTTER,
                    rows * (height + PANEL_CAPTION) + PANEL_GUTTER + (below != NULL ? PANEL_CAPTION : 0))) {
        return false;
    }
    for (uint32_t i = 0; i < count; i++) {
        uint32_t x = PANEL_GUTTER + i % columns * (width + PANEL_GUTTER), y = i / columns * (height + PANEL_CAPTION) + PANEL_CAPTION;
        draw(e, &image, x, y, w, panels[i].film);
        image_text(&image, x + 2, y - PANEL_CAPTION + 3, panels[i].caption);
    }
    if (below != NULL) {
        image_text(&image, PANEL_GUTTER + 2, image.height - PANEL_CAPTION + 3, below);
    }
    written = image_write_png(&image, path);
    image_free(&image);
    return written;
}
