/* One exposure for all panels of a picture. */
#include "panel.h"

#include <stdio.h>

#include "../render/image.h"

/* A log-average point is drawn this bright (1 = about mid white). */
#define KEY 0.35f
/* Light that is seen directly is clipped here, so that the edge before a lamp stays smooth. White is 6. */
#define CLIP 6.0f
/* Places in a pixel along an axis, at which the map behind it is looked up. */
#define FINE 3u
#define MAGNIFIED 2
#define CROP_WIDTH 240
#define CROP_HEIGHT 160

typedef Vec3 (*Look)(const Easel *easel, const void *what, size_t pixel);

float panel_exposure(const Picture *picture, const Films *films) {
    double mean = judge_mean(films), logs = 0.0, count = 0.0;
    for (size_t i = 0; i < films->reference[0].count; i++) {
        if (judge_covers(films, i)) {
            logs += log(luminance(judge_truth(films, i)) + 1e-2 * mean);
            count += 1.0;
        }
    }
    return mean > 0.0 ? picture->exposure * (float)(KEY / exp(logs / count)) : 1.0f;
}

static Vec3 clipped(Vec3 v, float most) {
    return vec3_make(fminf(v.x, most), fminf(v.y, most), fminf(v.z, most));
}

static Vec3 background(const Easel *e, size_t pixel) {
    Vec3 sum = {0.0f, 0.0f, 0.0f};
    float x = (float)(pixel % e->camera->width), y = (float)(pixel / e->camera->width);
    for (uint32_t i = 0; i < FINE * FINE; i++) {
        float u = ((float)(i % FINE) + 0.5f) / FINE, v = ((float)(i / FINE) + 0.5f) / FINE;
        Vec3 seen = light_radiance(e->light, camera_direction(e->camera, x + u, y + v));
        sum = vec3_add(sum, clipped(seen, CLIP / e->exposure));
    }
    return vec3_scale(sum, 1.0f / (FINE * FINE));
}

static Vec3 look_at_film(const Easel *e, const void *what, size_t pixel) {
    const Film *film = what;
    float escaped = film->taken[pixel] > 0 ? (float)film->escaped[pixel] / (float)film->taken[pixel] : 1.0f;
    Vec3 light = vec3_scale(film_mean(film, pixel), 1.0f - escaped);
    return escaped > 0.0f ? vec3_axpy(light, escaped, background(e, pixel)) : light;
}

static Vec3 look_at_truth(const Easel *e, const void *what, size_t pixel) {
    (void)what;
    return vec3_scale(vec3_add(look_at_film(e, &e->films->reference[0], pixel), look_at_film(e, &e->films->reference[1], pixel)), 0.5f);
}

/* A part of the view from pixel (left, top), `times` as large, at (x, y) of the image. */
typedef struct Window {
    uint32_t left, top, width, height, times;
} Window;

static void draw(const Easel *e, Image *image, uint32_t x, uint32_t y, Window w, Look look, const void *what) {
    for (uint32_t row = 0; row < w.height * w.times; row++) {
        for (uint32_t column = 0; column < w.width * w.times; column++) {
            size_t pixel = (size_t)(w.top + row / w.times) * e->camera->width + w.left + column / w.times;
            image_set(image, x + column, y + row, look(e, what, pixel), e->exposure);
        }
    }
}

static bool finish(Image *image, const char *path) {
    bool written = image_write_png(image, path);
    image_free(image);
    return written;
}

/* Two windows side by side under a caption each, and room for `below` more lines. */
static bool pair(const Easel *e, Image *image, Window w, char captions[2][128], uint32_t below) {
    static const int methods[2] = {MIS, DIRECT};
    uint32_t width = w.width * w.times, height = w.height * w.times;
    if (!image_init(image, 2 * width + 3 * PANEL_GUTTER, height + (1 + below) * PANEL_CAPTION + PANEL_GUTTER)) {
        return false;
    }
    for (uint32_t i = 0; i < 2; i++) {
        uint32_t x = PANEL_GUTTER + i * (width + PANEL_GUTTER);
        draw(e, image, x, PANEL_CAPTION, w, look_at_film, &e->films->method[methods[i]]);
        image_text(image, x + 2, 5, captions[i]);
    }
    return true;
}

bool panel_write_pair(const Easel *e, const char *path) {
    static const char *const names[2] = {"MIS", "wis_direct"};
    static const int methods[2] = {MIS, DIRECT};
    const Result *r = e->result;
    Window all = {0, 0, e->camera->width, e->camera->height, 1};
    char captions[2][128], below[256];
    Image image;
    for (int i = 0; i < 2; i++) {
        snprintf(captions[i], sizeof captions[i], "%s, %.1f s, %.0f samples, relMSE %.4f", names[i],
                 r->seconds[methods[i]], r->samples[methods[i]], r->score[methods[i]].relative);
    }
    snprintf(below, sizeof below, "%s: %s; %s. Left and right took the same time.", e->picture->name, e->picture->surface,
             judge_light(r));
    if (!pair(e, &image, all, captions, 1)) {
        return false;
    }
    image_text(&image, PANEL_GUTTER + 2, image.height - PANEL_CAPTION + 3, below);
    return finish(&image, path);
}

bool panel_write_truth(const Easel *e, const char *path) {
    Window all = {0, 0, e->camera->width, e->camera->height, 1};
    Image image;
    if (!image_init(&image, all.width, all.height)) {
        return false;
    }
    draw(e, &image, 0, 0, all, look_at_truth, NULL);
    return finish(&image, path);
}

static uint32_t placed(float share, uint32_t size, uint32_t part) {
    float first = share * (float)size - 0.5f * (float)part;
    return (uint32_t)fmaxf(0.0f, fminf(first, (float)(size - part)));
}

bool panel_write_crop(const Easel *e, const char *path) {
    uint32_t width = e->camera->width < CROP_WIDTH ? e->camera->width : CROP_WIDTH;
    uint32_t height = e->camera->height < CROP_HEIGHT ? e->camera->height : CROP_HEIGHT;
    Window part = {placed(e->picture->crop_x, e->camera->width, width), placed(e->picture->crop_y, e->camera->height, height),
                   width, height, MAGNIFIED};
    char captions[2][128];
    Image image;
    snprintf(captions[0], sizeof captions[0], "MIS, %.1f s", e->result->seconds[MIS]);
    snprintf(captions[1], sizeof captions[1], "wis_direct, %.1f s", e->result->seconds[DIRECT]);
    return pair(e, &image, part, captions, 0) && finish(&image, path);
}
