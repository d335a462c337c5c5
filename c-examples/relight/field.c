/* Visibility, products and what the vertices see of them. */
#include "field.h"

#include <stdlib.h>
#include <string.h>

#include "../render/progress.h"

#define DEPTH 6u
#define SIDE 64u
#define PIXELS (SIDE * SIDE)
#define FINE 4u /* look-ups of the light along an axis of a pixel */
#define NORMALS 16u
#define REFLECTED 32u
#define BLOCK 64u /* vertices of a job */
#define EXPONENT 64
#define OFFSET 1e-3f /* of shadow rays, along the normal */

static const Vec3 ground_diffuse = {0.45f, 0.45f, 0.45f};
static const Vec3 object_diffuse = {0.20f, 0.17f, 0.15f};
static const Vec3 object_glossy = {0.5f, 0.5f, 0.5f};

static Vec3 turned(Vec3 v, float angle) {
    float c = cosf(angle), s = sinf(angle);
    return vec3_make(c * v.x + s * v.z, v.y, c * v.z - s * v.x);
}

/* Builds a tree of PIXELS numbers from malloc; NULL if that fails. */
static void *make_tree(const float *pixels) {
    wis_tree_config config = {0};
    wis_tree_info info = {sizeof info, 0, 0, 0, 0, 0, 0, 0};
    wis_memory_size size;
    const wis_tree *handle;
    void *tree, *scratch;
    config.size = sizeof config;
    config.dimensions = 2;
    config.depth = DEPTH;
    config.pixels = pixels;
    if (wis_tree_size(&config, &size, NULL) != WIS_OK) {
        return NULL;
    }
    tree = malloc(size.bytes);
    scratch = malloc(size.scratch_bytes);
    if (tree == NULL || scratch == NULL ||
        wis_tree_init(&config, tree, size.bytes, scratch, size.scratch_bytes, &handle, &info, NULL) != WIS_OK) {
        free(tree);
        tree = NULL;
    }
    free(scratch);
    if (tree != NULL) {
        void *shorter = realloc(tree, info.bytes); /* a tree may be moved: it has no pointers */
        tree = shorter != NULL ? shorter : tree;
    }
    return tree;
}

/* A third of the size of the tree that it is made of; adds up its bytes. */
static void *make_visibility(const wis_tree *tree, size_t *bytes) {
    wis_memory_size size;
    const wis_visibility *handle;
    void *visibility = NULL;
    if (wis_visibility_size(tree, &size, NULL) == WIS_OK) {
        visibility = malloc(size.bytes);
        *bytes += size.bytes;
    }
    if (visibility != NULL && wis_visibility_init(tree, visibility, size.bytes, &handle, NULL) != WIS_OK) {
        free(visibility);
        visibility = NULL;
    }
    return visibility;
}

static size_t block_end(const Field *field, size_t job) {
    size_t end = (job + 1) * BLOCK;
    return end < field->mesh->vertex_count ? end : field->mesh->vertex_count;
}

static size_t blocks(const Field *field) {
    return (field->mesh->vertex_count + BLOCK - 1) / BLOCK;
}

static wis_status trace_block(void *shared, unsigned worker, size_t job) {
    Field *field = shared;
    for (size_t i = job * BLOCK; i < block_end(field, job); i++) {
        Vec3 normal = field->mesh->normals[i], origin = vec3_axpy(field->mesh->positions[i], OFFSET, normal);
        float seen[PIXELS];
        void *tree;
        for (uint32_t k = 0; k < PIXELS; k++) {
            Vec3 wi = vec3_load(field->directions[k]);
            seen[k] = vec3_dot(wi, normal) > 0.0f && !tracer_occluded(field->tracer, origin, wi) ? 1.0f : 0.0f;
        }
        tree = make_tree(seen);
        field->visibility[i] = tree != NULL ? make_visibility(tree, &field->bytes[worker]) : NULL;
        free(tree);
        if (field->visibility[i] == NULL) {
            return WIS_MEMORY_TOO_SMALL;
        }
    }
    return WIS_OK;
}

static bool grid_init(Grid *grid, uint32_t side, bool glossy) {
    size_t cells = (size_t)side * side;
    bool complete;
    grid->side = side;
    grid->glossy = glossy;
    grid->used = calloc(cells, sizeof *grid->used);
    complete = grid->used != NULL;
    for (int c = 0; c < 3; c++) {
        grid->product[c] = calloc(cells, sizeof *grid->product[c]);
        complete = complete && grid->product[c] != NULL;
    }
    return complete;
}

static void grid_free(Grid *grid) {
    for (int c = 0; c < 3; c++) {
        for (size_t cell = 0; grid->product[c] != NULL && cell < (size_t)grid->side * grid->side; cell++) {
            free(grid->product[c][cell]);
        }
        free(grid->product[c]);
    }
    free(grid->used);
}

static wis_status find_place(Grid *grid, Vec3 direction, Place *place) {
    float wi[3];
    wis_status status;
    vec3_store(direction, wi);
    status = wis_grid_cells(grid->side, wi, place->cell, place->weight);
    for (int k = 0; status == WIS_OK && k < 4; k++) {
        grid->used[place->cell[k]] |= place->weight[k] > 0.0f;
    }
    return status;
}

wis_status field_init(Field *field, const Mesh *mesh, const Tracer *tracer, unsigned threads) {
    size_t count = mesh->vertex_count;
    Progress progress;
    wis_status status = WIS_OK;
    memset(field, 0, sizeof *field);
    field->mesh = mesh;
    field->tracer = tracer;
    field->directions = malloc(PIXELS * sizeof *field->directions);
    field->visibility = calloc(count, sizeof *field->visibility);
    field->by_normal = malloc(count * sizeof *field->by_normal);
    field->by_reflection = malloc(count * sizeof *field->by_reflection);
    field->radiance = malloc(count * sizeof *field->radiance);
    for (int c = 0; c < 3; c++) {
        field->light[c] = malloc(PIXELS * sizeof *field->light[c]);
    }
    if (field->directions == NULL || field->visibility == NULL || field->by_normal == NULL ||
        field->by_reflection == NULL || field->radiance == NULL || field->light[0] == NULL ||
        field->light[1] == NULL || field->light[2] == NULL || !grid_init(&field->normals, NORMALS, false) ||
        !grid_init(&field->reflected, REFLECTED, true)) {
        return WIS_MEMORY_TOO_SMALL;
    }
    /* The cells of a grid are the pixels of the octahedral square. */
    for (uint32_t i = 0; status == WIS_OK && i < PIXELS; i++) {
        status = wis_grid_direction(SIDE, i, field->directions[i]);
    }
    for (size_t i = 0; status == WIS_OK && i < count; i++) {
        status = find_place(&field->normals, mesh->normals[i], &field->by_normal[i]);
    }
    if (status == WIS_OK) {
        progress = progress_begin("visibility", blocks(field));
        status = parallel_for(threads, blocks(field), trace_block, field, &progress);
        progress_end(&progress);
    }
    return status;
}

void field_free(Field *field) {
    for (size_t i = 0; field->visibility != NULL && i < field->mesh->vertex_count; i++) {
        free(field->visibility[i]);
    }
    for (int c = 0; c < 3; c++) {
        free(field->light[c]);
    }
    grid_free(&field->normals);
    grid_free(&field->reflected);
    free(field->directions);
    free(field->visibility);
    free(field->by_normal);
    free(field->by_reflection);
    free(field->radiance);
}

double field_megabytes(const Field *field) {
    double bytes = 0.0;
    for (unsigned worker = 0; worker < PARALLEL_MAX_THREADS; worker++) {
        bytes += (double)field->bytes[worker];
    }
    return bytes * 1e-6;
}

void field_turn_light(Field *field, const Light *light, float angle) {
    for (uint32_t i = 0; i < PIXELS; i++) {
        Vec3 sum = {0.0f, 0.0f, 0.0f};
        for (uint32_t k = 0; k < FINE * FINE; k++) {
            uint32_t row = i / SIDE * FINE + k / FINE, column = i % SIDE * FINE + k % FINE;
            float direction[3];
            if (wis_grid_direction(SIDE * FINE, row * SIDE * FINE + column, direction) == WIS_OK) {
                sum = vec3_add(sum, light_radiance(light, turned(vec3_load(direction), angle)));
            }
        }
        field->light[0][i] = sum.x / (FINE * FINE);
        field->light[1][i] = sum.y / (FINE * FINE);
        field->light[2][i] = sum.z / (FINE * FINE);
    }
}

wis_status field_look_from(Field *field, Vec3 eye) {
    wis_status status = WIS_OK;
    memset(field->reflected.used, 0, (size_t)REFLECTED * REFLECTED * sizeof *field->reflected.used);
    for (uint32_t i = 0; status == WIS_OK && i < field->mesh->object_vertices; i++) {
        Vec3 normal = field->mesh->normals[i], wo = vec3_normalise(vec3_sub(eye, field->mesh->positions[i]));
        Vec3 reflected = vec3_sub(vec3_scale(normal, 2.0f * vec3_dot(normal, wo)), wo);
        status = find_place(&field->reflected, vec3_normalise(reflected), &field->by_reflection[i]);
    }
    return status;
}

/* The products of light and the lobe of a cell, if anybody asks for it. */
static wis_status make_products(void *shared, unsigned worker, size_t job) {
    Field *field = shared;
    Grid *grid = job < NORMALS * NORMALS ? &field->normals : &field->reflected;
    size_t cell = job < NORMALS * NORMALS ? job : job - NORMALS * NORMALS;
    float axis[3], lobe[PIXELS], pixels[PIXELS];
    wis_status status = wis_grid_direction(grid->side, (uint32_t)cell, axis);
    (void)worker;
    if (status != WIS_OK || !grid->used[cell]) {
        return status;
    }
    for (uint32_t i = 0; i < PIXELS; i++) {
        float cosine = fmaxf(vec3_dot(vec3_load(axis), vec3_load(field->directions[i])), 0.0f);
        lobe[i] = grid->glossy ? (EXPONENT + 1) / (2.0f * PI) * powf(cosine, EXPONENT) : cosine / PI;
    }
    for (int c = 0; c < 3; c++) {
        for (uint32_t i = 0; i < PIXELS; i++) {
            pixels[i] = lobe[i] * field->light[c][i];
        }
        free(grid->product[c][cell]);
        grid->product[c][cell] = make_tree(pixels);
        if (grid->product[c][cell] == NULL) {
            return WIS_MEMORY_TOO_SMALL;
        }
    }
    return WIS_OK;
}

/* Adds up what a vertex sees of the products about a place. The square has area 1, the sphere 4 pi. */
static wis_status gather(const Grid *grid, const Place *place, const wis_visibility *visibility, Vec3 *sum) {
    float rgb[3] = {0};
    for (int k = 0; k < 4; k++) {
        for (int c = 0; c < 3 && place->weight[k] > 0.0f; c++) {
            double integral;
            wis_status status =
                wis_visibility_product_integral(grid->product[c][place->cell[k]], visibility, &integral);
            if (status != WIS_OK) {
                return status;
            }
            rgb[c] += place->weight[k] * (float)(4.0 * PI * integral);
        }
    }
    *sum = vec3_load(rgb);
    return WIS_OK;
}

static wis_status shade_block(void *shared, unsigned worker, size_t job) {
    Field *field = shared;
    wis_status status = WIS_OK;
    (void)worker;
    for (size_t i = job * BLOCK; status == WIS_OK && i < block_end(field, job); i++) {
        bool object = i < field->mesh->object_vertices;
        Vec3 sum, glossy;
        status = gather(&field->normals, &field->by_normal[i], field->visibility[i], &sum);
        field->radiance[i] = vec3_mul(object ? object_diffuse : ground_diffuse, sum);
        if (status == WIS_OK && object) {
            status = gather(&field->reflected, &field->by_reflection[i], field->visibility[i], &glossy);
            field->radiance[i] = vec3_add(field->radiance[i], vec3_mul(object_glossy, glossy));
        }
    }
    return status;
}

wis_status field_shade(Field *field, unsigned threads) {
    size_t cells = NORMALS * NORMALS + REFLECTED * REFLECTED;
    wis_status status = parallel_for(threads, cells, make_products, field, NULL);
    return status == WIS_OK ? parallel_for(threads, blocks(field), shade_block, field, NULL) : status;
}
