/* A first picture of one's own: a ball on a floor under a sky with a sun, by the loop of README.md. Writes first.pgm.
 * scripts/first-picture.sh counts the time from a clone to this picture. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "wis.h"

#define PI 3.14159265f
enum { COLUMNS = 256, ROWS = 128, WIDTH = 480, HEIGHT = 270, SAMPLES = 4 };

typedef struct { float x, y, z; } vec;

static float map[ROWS][COLUMNS];

static void check(wis_status status) {
    if (status != WIS_OK) {
        fprintf(stderr, "%s\n", wis_status_string(status));
        exit(EXIT_FAILURE);
    }
}

static vec along(vec a, float s, vec b) {
    vec sum = {a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
    return sum;
}

static float dot(vec a, vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

static vec unit(vec a) {
    vec zero = {0, 0, 0};
    return along(zero, 1 / sqrtf(dot(a, a)), a);
}

static vec of(const float d[3]) {
    vec a = {d[0], d[1], d[2]};
    return a;
}

/* The nearest texel; +z is up. */
static float radiance(vec d) {
    float azimuth = atan2f(d.y, d.x) / (2 * PI);
    int x = (int)((azimuth < 0 ? azimuth + 1 : azimuth) * COLUMNS), y = (int)(acosf(fmaxf(-1, fminf(1, d.z))) / PI * ROWS);
    return map[y < ROWS ? y : ROWS - 1][x < COLUMNS ? x : COLUMNS - 1];
}

/* A ball of radius 1 on the floor z = 0: the distance and the normal, or 0. */
static float trace(vec o, vec d, vec *normal) {
    vec centre = {0, 0, 1}, up = {0, 0, 1}, to = along(centre, -1, o);
    float middle = dot(to, d), square = middle * middle - dot(to, to) + 1, floor = d.z < 0 ? -o.z / d.z : 0;
    if (square > 0 && middle - sqrtf(square) > 1e-3f) {
        *normal = along(along(o, middle - sqrtf(square), d), -1, centre);
        return middle - sqrtf(square);
    }
    *normal = up;
    return floor > 1e-3f && floor < 30 ? floor : 0;
}

static void *allocate(size_t bytes) {
    void *memory = malloc(bytes);
    if (memory == NULL) exit(EXIT_FAILURE);
    return memory;
}

int main(void) {
    static unsigned char picture[HEIGHT][WIDTH];
    for (int y = 0; y < ROWS; y++)
        for (int x = 0; x < COLUMNS; x++)
            map[y][x] = (y < ROWS / 2 ? 0.6f : 0.15f) + (y / 2 == 20 && x / 2 == 60 ? 4000.0f : 0.0f);

    wis_environment_config light = {0};
    light.size = sizeof light;
    light.layout = WIS_LAYOUT_LATLONG;
    light.width = COLUMNS;
    light.height = ROWS;
    light.channels = 1;
    light.format = WIS_FORMAT_F32;
    light.filter = WIS_FILTER_NEAREST;
    light.pixels = map;
    wis_memory_size size;
    const wis_environment *environment;
    check(wis_environment_size(&light, &size, NULL));
    void *memory = allocate(size.bytes), *scratch = allocate(size.scratch_bytes);
    check(wis_environment_init(&light, memory, size.bytes, scratch, size.scratch_bytes, &environment, NULL));

    wis_sampler_config config = {0};
    wis_sampler *sampler;
    config.size = sizeof config;
    check(wis_sampler_size(&config, &size, NULL));
    void *working = allocate(size.bytes);
    check(wis_sampler_init(&config, working, size.bytes, &sampler, NULL));

    wis_material material = {0};
    material.size = sizeof material;
    material.lobe_count = 1;
    material.lobe[0].kind = WIS_LOBE_LAMBERT;
    check(wis_material_init(&material, NULL));

    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            float sum = 0;
            for (uint32_t sample = 0; sample < SAMPLES; sample++) {
                float u[2];
                check(wis_points_sobol((uint32_t)(y * WIDTH + x), sample, 1, u, 0));
                vec eye = {0, -6, 2.2f}, n, down = {(x + u[0] - WIDTH / 2) / WIDTH, 1, (HEIGHT / 2 - y - u[1]) / WIDTH - 0.2f};
                vec d = unit(down);
                float distance = trace(eye, d, &n);
                if (distance == 0) {
                    sum += radiance(d);
                    continue;
                }
                vec p = along(eye, distance, d);
                wis_point point = {0};
                wis_ray ray[4];
                uint32_t count;
                point.size = sizeof point;
                point.material = &material;
                point.normal[0] = n.x, point.normal[1] = n.y, point.normal[2] = n.z;
                point.wo[0] = -d.x, point.wo[1] = -d.y, point.wo[2] = -d.z;
                point.weight[0][0] = point.weight[0][1] = point.weight[0][2] = 0.7f;
                point.seed = (uint32_t)(y * WIDTH + x);
                point.sample = sample;
                check(wis_direct(sampler, environment, &point, 4, ray, &count));
                for (uint32_t i = 0; i < count; i++) {
                    vec wi = of(ray[i].wi), unused;
                    float f = 0.7f / PI * fmaxf(0, dot(n, wi));
                    if (f > 0 && trace(p, wi, &unused) == 0) sum += f * radiance(wi) * ray[i].weight;
                }
            }
            picture[y][x] = (unsigned char)(255 * powf(fminf(1, 0.5f * sum / SAMPLES), 1 / 2.2f) + 0.5f);
        }

    FILE *file = fopen("first.pgm", "wb");
    if (file == NULL) return EXIT_FAILURE;
    fprintf(file, "P5\n%d %d\n255\n", WIDTH, HEIGHT);
    fwrite(picture, 1, sizeof picture, file);
    fclose(file);
    free(working);
    free(scratch);
    free(memory);
    return EXIT_SUCCESS;
}
