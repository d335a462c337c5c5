/* Relights every vertex of a mesh while the light turns and the camera walks, and writes the frames.
 *
 *     relight <folder for frames> [frames] [map.hdr | -] [mesh | -]
 *
 * In the first half of the frames the light turns once, in the second the camera walks once around. "-" is the light or
 * the mesh that is made here. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../render/image.h"
#include "../render/parallel.h"
#include "field.h"

#define WIDTH 480u
#define HEIGHT 300u
#define THREADS 8u
#define FINE 3u /* rays along an axis of a pixel */
#define HALF_WIDTH 0.42f /* of the picture, at distance 1 */
#define DISTANCE 2.7f
#define EYE_HEIGHT 1.3f
#define CHECKS 6.0f /* squares of the ground's texture along a unit */

typedef struct Frame {
    const Mesh *mesh;
    const Tracer *tracer;
    const Field *field;
    const Light *light;
    Image image;
    Vec3 eye, forward, right, up;
    float light_angle, exposure;
} Frame;

/* The exposure at which a light's mean is a middle grey. */
static float find_exposure(const Light *light) {
    double sum = 0.0, weight = 0.0;
    for (uint32_t y = 0; y < light->height; y++) {
        double solid_angle = sin(PI * ((double)y + 0.5) / light->height);
        for (uint32_t x = 0; x < light->width; x++) {
            sum += solid_angle * luminance(vec3_load(light->texels + 3 * ((size_t)y * light->width + x)));
            weight += solid_angle;
        }
    }
    return sum > 0.0 ? (float)(0.5 * weight / sum) : 1.0f;
}

static void walk(Frame *frame, float angle) {
    Vec3 target = {0.0f, 0.42f, 0.0f};
    frame->eye = vec3_make(DISTANCE * sinf(angle), EYE_HEIGHT, DISTANCE * cosf(angle));
    frame->forward = vec3_normalise(vec3_sub(target, frame->eye));
    frame->right = vec3_normalise(vec3_cross(frame->forward, vec3_make(0.0f, 1.0f, 0.0f)));
    frame->up = vec3_cross(frame->right, frame->forward);
}

/* What a ray sees: radiance between that of three vertices, a texture on the ground, or the light itself. */
static Vec3 look(const Frame *frame, Vec3 direction) {
    const Mesh *mesh = frame->mesh;
    float c = cosf(frame->light_angle), s = sinf(frame->light_angle);
    Vec3 sum = {0.0f, 0.0f, 0.0f}, place = {0.0f, 0.0f, 0.0f};
    Hit hit;
    if (!tracer_hit(frame->tracer, frame->eye, direction, &hit)) {
        return light_radiance(frame->light, vec3_make(c * direction.x + s * direction.z, direction.y,
                                                      c * direction.z - s * direction.x));
    }
    for (int k = 0; k < 3; k++) {
        uint32_t corner = mesh->triangles[hit.triangle][k];
        float weight = k == 0 ? 1.0f - hit.u - hit.v : k == 1 ? hit.u : hit.v;
        sum = vec3_axpy(sum, weight, frame->field->radiance[corner]);
        place = vec3_axpy(place, weight, mesh->positions[corner]);
    }
    if (mesh->triangles[hit.triangle][0] >= mesh->object_vertices) {
        int dark = ((int)floorf(CHECKS * place.x) + (int)floorf(CHECKS * place.z)) & 1;
        sum = vec3_scale(sum, dark ? 0.6f : 1.0f);
    }
    return sum;
}

static wis_status draw_row(void *shared, unsigned worker, size_t y) {
    Frame *frame = shared;
    float pixel = 2.0f * HALF_WIDTH / (float)WIDTH;
    (void)worker;
    for (uint32_t x = 0; x < WIDTH; x++) {
        Vec3 sum = {0.0f, 0.0f, 0.0f};
        for (uint32_t k = 0; k < FINE * FINE; k++) {
            float sx = (float)x + ((float)(k % FINE) + 0.5f) / FINE - 0.5f * WIDTH;
            float sy = 0.5f * HEIGHT - (float)y - ((float)(k / FINE) + 0.5f) / FINE;
            Vec3 direction = vec3_axpy(vec3_axpy(frame->forward, sx * pixel, frame->right), sy * pixel, frame->up);
            Vec3 seen = vec3_scale(look(frame, vec3_normalise(direction)), frame->exposure);
            /* Clipped before they are added, so that the edges of lamps are smooth. */
            sum = vec3_add(sum, vec3_make(fminf(seen.x, 1.0f), fminf(seen.y, 1.0f), fminf(seen.z, 1.0f)));
        }
        image_set(&frame->image, x, (uint32_t)y, vec3_scale(sum, 1.0f / (FINE * FINE)), 1.0f);
    }
    return WIS_OK;
}

static wis_status write_frames(Frame *frame, Field *field, const char *folder, unsigned frames) {
    double lighting = 0.0;
    wis_status status = WIS_OK;
    for (unsigned i = 0; status == WIS_OK && i < frames; i++) {
        unsigned half = (frames + 1) / 2;
        char path[512];
        double start;
        frame->light_angle = i < half ? 2.0f * PI * (float)i / (float)half : 0.0f;
        walk(frame, i < half ? 0.5f : 0.5f + 2.0f * PI * (float)(i - half) / (float)(frames - half));
        start = wall_seconds();
        field_turn_light(field, frame->light, frame->light_angle);
        status = field_look_from(field, frame->eye);
        if (status == WIS_OK) {
            status = field_shade(field, THREADS);
        }
        lighting += wall_seconds() - start;
        if (status == WIS_OK) {
            status = parallel_for(THREADS, HEIGHT, draw_row, frame, NULL);
        }
        snprintf(path, sizeof path, "%s/relight-%02u.png", folder, i);
        if (status == WIS_OK && !image_write_png(&frame->image, path)) {
            fprintf(stderr, "relight: cannot write %s\n", path);
            status = WIS_INVALID_ARGUMENT;
        }
    }
    if (status == WIS_OK && frames > 0) {
        printf("%u frames, %.0f ms of lighting each: %s/relight-00.png and on\n", frames, 1e3 * lighting / frames, folder);
    }
    return status;
}

/* Needs a mesh and a light that were read. */
static wis_status run(const Mesh *mesh, const Light *light, const char *folder, unsigned frames) {
    Tracer tracer;
    Field field;
    Frame frame;
    double start = wall_seconds();
    wis_status status = WIS_OK;
    memset(&field, 0, sizeof field);
    memset(&frame, 0, sizeof frame);
    if (!tracer_init(&tracer, mesh)) {
        fprintf(stderr, "relight: Embree cannot trace the mesh\n");
        status = WIS_INVALID_ARGUMENT;
    }
    if (status == WIS_OK) {
        status = field_init(&field, mesh, &tracer, THREADS);
    }
    if (status == WIS_OK) {
        printf("%u vertices, %.0f MB of visibility in %.1f s\n", mesh->vertex_count, field_megabytes(&field),
               wall_seconds() - start);
        frame.mesh = mesh;
        frame.tracer = &tracer;
        frame.field = &field;
        frame.light = light;
        frame.exposure = find_exposure(light);
        status = image_init(&frame.image, WIDTH, HEIGHT) ? WIS_OK : WIS_MEMORY_TOO_SMALL;
    }
    if (status == WIS_OK) {
        status = write_frames(&frame, &field, folder, frames);
    }
    image_free(&frame.image);
    if (field.mesh != NULL) {
        field_free(&field);
    }
    tracer_free(&tracer);
    return status;
}

static bool is_given(int count, char **arguments, int index) {
    return count > index && strcmp(arguments[index], "-") != 0;
}

int main(int count, char **arguments) {
    Light light;
    Mesh mesh;
    const char *why;
    wis_status status = WIS_INVALID_ARGUMENT;
    memset(&light, 0, sizeof light);
    memset(&mesh, 0, sizeof mesh);
    if (count < 2) {
        fprintf(stderr, "usage: relight <folder for frames> [frames] [map.hdr | -] [mesh | -]\n");
        return 2;
    }
    why = is_given(count, arguments, 3) ? light_read(&light, arguments[3]) : light_make_sky(&light);
    if (why == NULL) {
        why = is_given(count, arguments, 4) ? mesh_read(&mesh, arguments[4]) : mesh_make(&mesh);
    }
    if (why != NULL) {
        fprintf(stderr, "relight: %s\n", why);
    } else {
        status = run(&mesh, &light, arguments[1], count > 2 ? (unsigned)strtoul(arguments[2], NULL, 10) : 8);
        if (status != WIS_OK) {
            fprintf(stderr, "relight: %s\n", wis_status_string(status));
        }
    }
    mesh_free(&mesh);
    light_free(&light);
    return status == WIS_OK ? 0 : 1;
}
