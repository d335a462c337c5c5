/* Relights every vertex of a scene while the light turns: triple products of BRDF, light and visibility
 * (Ng et al. 2004, "Triple Product Wavelet Integrals for All-Frequency Relighting").
 *
 *     relight <folder for frames> [frames] [map.hdr]
 *
 * A vertex stands where the camera sees the scene, one for each pixel, so that a frame needs no rasteriser. What does
 * not change is made once: for each vertex the tree of its visibility and the largest wavelets of its BRDF x cosine. A
 * frame is three trees of the turned light, their largest wavelets, and three sums for each vertex. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "render/image.h"
#include "render/light.h"
#include "render/material.h"
#include "render/parallel.h"
#include "render/view.h"
#include "wis.h"

#define WIDTH 400u
#define HEIGHT 170u
#define DEPTH 6u
#define SIDE 64u
#define PIXELS (SIDE * SIDE)
#define KEPT 96u /* wavelets of 4095 */
#define THREADS 8u
#define BLOCK 64u /* vertices of a job */
#define EXPOSURE 1.0f

/* What is made once for a vertex. */
typedef struct Vertex {
    void *visibility; /* a wis_tree, from malloc */
    float colour[3];  /* the BRDF's, where its luminance is 1 */
    double average;   /* of the BRDF x cosine */
    uint32_t count;
    wis_wavelets brdf[KEPT];
} Vertex;

typedef struct LightTree {
    void *tree; /* from malloc */
    uint32_t count;
    wis_wavelets kept[KEPT];
} LightTree;

typedef struct Scene {
    View view;
    Vertex *vertices;
    float (*directions)[3];
    Light map;
    LightTree light[3];
    Vec3 *radiance;
} Scene;

/* The direction of a point of the octahedral square: equal areas are equal solid angles (WIS_LAYOUT_OCTAHEDRAL). */
static Vec3 octahedral(float u, float v) {
    float x = 2.0f * u - 1.0f, y = 2.0f * v - 1.0f;
    float a = fabsf(x), b = fabsf(y);
    bool south = a + b > 1.0f;
    float fa = south ? 1.0f - b : a, fb = south ? 1.0f - a : b;
    float radius = fa + fb, angle = radius > 0.0f ? 0.5f * PI * fb / radius : 0.0f;
    float z = 1.0f - radius * radius, across = radius * sqrtf(2.0f - radius * radius);
    return vec3_make(copysignf(across * cosf(angle), x), copysignf(across * sinf(angle), y), south ? -z : z);
}

/* Builds a tree of SIDE x SIDE numbers and gives back what it does not need. */
static wis_status build_tree(const float *pixels, void **tree) {
    wis_tree_config config = {sizeof config, 2, DEPTH, 0.0f, pixels};
    wis_tree_info info = {sizeof info, 0, 0, 0, 0, 0, 0, 0};
    wis_memory_size size;
    const wis_tree *handle;
    void *scratch;
    wis_status status = wis_tree_size(&config, &size, NULL);
    *tree = NULL;
    if (status != WIS_OK) {
        return status;
    }
    *tree = malloc(size.bytes);
    scratch = malloc(size.scratch_bytes);
    status = WIS_MEMORY_TOO_SMALL;
    if (*tree != NULL && scratch != NULL) {
        status = wis_tree_init(&config, *tree, size.bytes, scratch, size.scratch_bytes, &handle, &info, NULL);
    }
    free(scratch);
    if (status == WIS_OK) {
        void *shorter = realloc(*tree, info.bytes); /* a tree may be moved: it has no pointers */
        *tree = shorter != NULL ? shorter : *tree;
    }
    return status;
}

/* The BRDF x cosine of a vertex: its colour, and the largest wavelets of its luminance. */
static wis_status make_brdf(Vertex *vertex, const ShadingPoint *point, const float (*directions)[3]) {
    static const float dark = 1e-12f;
    Bsdf bsdf = bsdf_begin(scene_material(point->object), point->normal, point->wo);
    wis_query query = bsdf_query(&bsdf);
    float(*f)[3] = malloc(PIXELS * sizeof *f), *luminances = malloc(PIXELS * sizeof *luminances);
    void *tree = NULL;
    double sum[3] = {0}, average = 0.0;
    wis_status status = f == NULL || luminances == NULL ? WIS_MEMORY_TOO_SMALL : WIS_OK;
    if (status == WIS_OK) {
        status = wis_query_eval(&query, PIXELS, directions[0], 0, f[0], 0);
    }
    for (uint32_t i = 0; status == WIS_OK && i < PIXELS; i++) {
        luminances[i] = luminance(vec3_load(f[i]));
        average += luminances[i] / PIXELS;
        for (int c = 0; c < 3; c++) {
            sum[c] += f[i][c] / PIXELS;
        }
    }
    for (int c = 0; c < 3; c++) {
        vertex->colour[c] = average > dark ? (float)(sum[c] / average) : 0.0f;
    }
    vertex->average = average;
    if (status == WIS_OK) {
        status = build_tree(luminances, &tree);
    }
    if (status == WIS_OK) {
        status = wis_triple_select(tree, KEPT, vertex->brdf, &vertex->count);
    }
    free(tree);
    free(luminances);
    free(f);
    return status;
}

/* The vertex behind the last one of a job. */
static size_t job_end(const Scene *scene, size_t job) {
    size_t end = (job + 1) * BLOCK;
    return end < scene->view.count ? end : scene->view.count;
}

static wis_status make_vertices(void *shared, unsigned worker, size_t job) {
    Scene *scene = shared;
    size_t end = job_end(scene, job);
    (void)worker;
    for (size_t i = job * BLOCK; i < end; i++) {
        float seen[PIXELS];
        const ShadingPoint *point = &scene->view.points[i];
        wis_status status;
        for (uint32_t k = 0; k < PIXELS; k++) {
            Vec3 wi = vec3_load(scene->directions[k]);
            seen[k] = vec3_dot(wi, point->normal) > 0.0f && !scene_occluded(point, wi) ? 1.0f : 0.0f;
        }
        status = build_tree(seen, &scene->vertices[i].visibility);
        if (status == WIS_OK) {
            status = make_brdf(&scene->vertices[i], point, (const float(*)[3])scene->directions);
        }
        if (status != WIS_OK) {
            return status;
        }
    }
    return WIS_OK;
}

/* Radiance of the light, turned about the axis that points up. */
static Vec3 turned_radiance(const Scene *scene, float angle, Vec3 wi) {
    float c = cosf(angle), s = sinf(angle);
    return light_radiance(&scene->map, vec3_make(c * wi.x + s * wi.z, wi.y, c * wi.z - s * wi.x));
}

/* The trees of the light. */
static wis_status turn_light(Scene *scene, float angle) {
    static const uint32_t fine = 4;
    float *pixels = calloc(3 * PIXELS, sizeof *pixels);
    wis_status status = pixels == NULL ? WIS_MEMORY_TOO_SMALL : WIS_OK;
    for (uint32_t i = 0; status == WIS_OK && i < PIXELS; i++) {
        for (uint32_t k = 0; k < fine * fine; k++) {
            float u = ((float)(i % SIDE) + ((float)(k % fine) + 0.5f) / (float)fine) / SIDE;
            float v = ((float)(i / SIDE) + ((float)(k / fine) + 0.5f) / (float)fine) / SIDE;
            float rgb[3];
            vec3_store(turned_radiance(scene, angle, octahedral(u, v)), rgb);
            for (uint32_t channel = 0; channel < 3; channel++) {
                pixels[channel * PIXELS + i] += rgb[channel] / (float)(fine * fine);
            }
        }
    }
    for (uint32_t channel = 0; status == WIS_OK && channel < 3; channel++) {
        LightTree *light = &scene->light[channel];
        free(light->tree);
        status = build_tree(pixels + channel * PIXELS, &light->tree);
        if (status == WIS_OK) {
            status = wis_triple_select(light->tree, KEPT, light->kept, &light->count);
        }
    }
    free(pixels);
    return status;
}

static wis_status light_vertices(void *shared, unsigned worker, size_t job) {
    Scene *scene = shared;
    size_t end = job_end(scene, job);
    (void)worker;
    for (size_t i = job * BLOCK; i < end; i++) {
        const Vertex *vertex = &scene->vertices[i];
        float rgb[3];
        for (uint32_t channel = 0; channel < 3; channel++) {
            const LightTree *light = &scene->light[channel];
            double integral;
            wis_status status = wis_triple_sublinear(vertex->average, vertex->count, vertex->brdf, light->count,
                                                     light->kept, light->tree, vertex->visibility, &integral);
            if (status != WIS_OK) {
                return status;
            }
            /* The square has area 1, the sphere 4 pi; an approximation may be a little below 0. */
            integral = integral > 0.0 ? integral : 0.0;
            rgb[channel] = (float)(4.0 * PI * integral) * vertex->colour[channel];
        }
        scene->radiance[i] = vec3_load(rgb);
    }
    return WIS_OK;
}

static wis_status on_all_vertices(Scene *scene, const char *task, parallel_job run) {
    size_t jobs = (scene->view.count + BLOCK - 1) / BLOCK;
    Progress progress = progress_begin(task, jobs);
    wis_status status = parallel_for(THREADS, jobs, run, scene, &progress);
    progress_end(&progress);
    return status;
}

static wis_status write_frame(const Scene *scene, float angle, const char *folder, unsigned frame) {
    char path[512];
    Image image;
    bool written;
    if (!image_init(&image, WIDTH, HEIGHT)) {
        return WIS_MEMORY_TOO_SMALL;
    }
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
        Vec3 wi = view_direction(WIDTH, HEIGHT, i % WIDTH, i / WIDTH);
        image_set(&image, i % WIDTH, i / WIDTH, turned_radiance(scene, angle, wi), EXPOSURE);
    }
    for (size_t i = 0; i < scene->view.count; i++) {
        image_set(&image, scene->view.points[i].x, scene->view.points[i].y, scene->radiance[i], EXPOSURE);
    }
    snprintf(path, sizeof path, "%s/relight-%02u.png", folder, frame);
    written = image_write_png(&image, path);
    image_free(&image);
    return written ? WIS_OK : WIS_INVALID_ARGUMENT;
}

static wis_status run(Scene *scene, const char *folder, unsigned frames) {
    double start = wall_seconds(), spent = 0.0;
    wis_status status = view_trace(&scene->view, WIDTH, HEIGHT);
    scene->vertices = calloc(scene->view.count, sizeof *scene->vertices);
    scene->radiance = calloc(scene->view.count, sizeof *scene->radiance);
    scene->directions = malloc(PIXELS * sizeof *scene->directions);
    if (status == WIS_OK && (scene->vertices == NULL || scene->radiance == NULL || scene->directions == NULL)) {
        status = WIS_MEMORY_TOO_SMALL;
    }
    for (uint32_t i = 0; status == WIS_OK && i < PIXELS; i++) {
        float u = ((float)(i % SIDE) + 0.5f) / SIDE, v = ((float)(i / SIDE) + 0.5f) / SIDE;
        vec3_store(octahedral(u, v), scene->directions[i]);
    }
    if (status == WIS_OK) {
        status = on_all_vertices(scene, "vertices", make_vertices);
    }
    if (status == WIS_OK) {
        printf("%zu vertices in %.1f s\n", scene->view.count, wall_seconds() - start);
    }
    for (unsigned frame = 0; status == WIS_OK && frame < frames; frame++) {
        float angle = 2.0f * PI * (float)frame / (float)frames;
        start = wall_seconds();
        status = turn_light(scene, angle);
        if (status == WIS_OK) {
            status = on_all_vertices(scene, "frame", light_vertices);
        }
        spent += wall_seconds() - start;
        if (status == WIS_OK) {
            status = write_frame(scene, angle, folder, frame);
        }
    }
    if (status == WIS_OK && frames > 0) {
        printf("%u frames, %.0f ms each: %s/relight-00.png and on\n", frames, 1e3 * spent / frames, folder);
    }
    return status;
}

static void free_all(Scene *scene) {
    for (size_t i = 0; scene->vertices != NULL && i < scene->view.count; i++) {
        free(scene->vertices[i].visibility);
    }
    for (int channel = 0; channel < 3; channel++) {
        free(scene->light[channel].tree);
    }
    free(scene->vertices);
    free(scene->radiance);
    free(scene->directions);
    view_free(&scene->view);
    light_free(&scene->map);
}

int main(int count, char **arguments) {
    Scene scene;
    const char *why = NULL;
    wis_status status;
    memset(&scene, 0, sizeof scene);
    if (count < 2) {
        fprintf(stderr, "usage: relight <folder for frames> [frames] [map.hdr]\n");
        return 2;
    }
    why = count > 3 ? light_read(&scene.map, arguments[3]) : light_make_sky(&scene.map);
    if (why != NULL) {
        fprintf(stderr, "relight: %s\n", why);
        return 1;
    }
    status = run(&scene, arguments[1], count > 2 ? (unsigned)strtoul(arguments[2], NULL, 10) : 8);
    if (status != WIS_OK) {
        fprintf(stderr, "relight: %s\n", wis_status_string(status));
    }
    free_all(&scene);
    return status == WIS_OK ? 0 : 1;
}
