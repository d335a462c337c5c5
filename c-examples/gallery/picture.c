/* Materials are sums of at most two lobes. Views were chosen for the eye. */
#include "picture.h"

#define LAMBERT(r, g, b) {WIS_LOBE_LAMBERT, {r, g, b}, {0}, 0}
#define GGX(r, g, b, alpha) {WIS_LOBE_GGX, {1, 1, 1}, {r, g, b}, alpha}
#define DIFFUSE(r, g, b) {"diffuse", 1, {LAMBERT(r, g, b)}}
#define METAL(r, g, b, alpha) {"metal", 1, {GGX(r, g, b, alpha)}}
#define PLASTIC(r, g, b, alpha) {"plastic", 2, {LAMBERT(r, g, b), GGX(0.05f, 0.05f, 0.05f, alpha)}}

const Picture pictures[PICTURES] = {
    {.name = "spot", .mesh = "spot.obj", .map = "rooitou_park_1k.hdr",
     .surface = "matt, Lambert", .light = "field under a small sun",
     .thing = DIFFUSE(0.62f, 0.36f, 0.20f), .light_square = DIFFUSE(0.42f, 0.42f, 0.40f), .dark_square = DIFFUSE(0.25f, 0.27f, 0.25f),
     .set_angle = 0, .thing_angle = 180, .eye_angle = 35, .eye_height = 1.0f, .eye_distance = 2.3f,
     .target_height = 0.45f, .half_width = 0.34f, .exposure = 1, .crop_x = 0.36f, .crop_y = 0.28f, .in_page = true},
    {.name = "teapot", .mesh = "teapot.obj", .map = "empty_warehouse_01_1k.hdr",
     .surface = "glossy metal, GGX 0.1", .light = "warehouse with lamps and windows",
     .thing = METAL(0.95f, 0.64f, 0.54f, 0.1f), .light_square = DIFFUSE(0.50f, 0.48f, 0.45f), .dark_square = DIFFUSE(0.20f, 0.20f, 0.22f),
     .set_angle = 0, .thing_angle = 0, .eye_angle = 25, .eye_height = 1.4f, .eye_distance = 3.0f,
     .target_height = 0.42f, .half_width = 0.40f, .exposure = 1, .crop_x = 0.36f, .crop_y = 0.40f, .in_page = true},
    {.name = "bunny", .mesh = "stanford-bunny.obj", .map = "venice_sunset_1k.hdr",
     .surface = "plastic, Lambert and GGX 0.15", .light = "waterfront at sunset",
     .thing = PLASTIC(0.05f, 0.20f, 0.36f, 0.15f), .light_square = PLASTIC(0.50f, 0.47f, 0.42f, 0.3f), .dark_square = PLASTIC(0.16f, 0.15f, 0.14f, 0.3f),
     .set_angle = 0, .thing_angle = 20, .eye_angle = 20, .eye_height = 1.0f, .eye_distance = 2.5f,
     .target_height = 0.45f, .half_width = 0.33f, .exposure = 1, .crop_x = 0.5f, .crop_y = 0.5f},
    {.name = "dragon", .mesh = "dragon_vrip_res3.ply", .map = "studio_small_03_1k.hdr",
     .surface = "metal, GGX 0.2", .light = "dark studio with two lamps",
     .thing = METAL(1.00f, 0.78f, 0.34f, 0.2f), .light_square = DIFFUSE(0.40f, 0.40f, 0.42f), .dark_square = DIFFUSE(0.18f, 0.18f, 0.20f),
     .set_angle = 0, .thing_angle = 0, .eye_angle = 20, .eye_height = 1.2f, .eye_distance = 3.0f,
     .target_height = 0.42f, .half_width = 0.33f, .exposure = 1, .crop_x = 0.5f, .crop_y = 0.5f},
    {.name = "buddha", .mesh = "buddha.obj", .map = "st_fagans_interior_1k.hdr",
     .surface = "rough metal, GGX 0.4", .light = "lobby with many small lamps",
     .thing = METAL(0.80f, 0.62f, 0.42f, 0.4f), .light_square = PLASTIC(0.36f, 0.28f, 0.20f, 0.2f), .dark_square = PLASTIC(0.14f, 0.10f, 0.07f, 0.2f),
     .set_angle = 0, .thing_angle = 0, .eye_angle = 15, .eye_height = 1.0f, .eye_distance = 2.6f,
     .target_height = 0.5f, .half_width = 0.25f, .exposure = 1, .crop_x = 0.5f, .crop_y = 0.5f},
    {.name = "room", .mesh = "stanford-bunny.obj", .map = "potsdamer_platz_1k.hdr",
     .surface = "plastic in a room with two openings", .light = "city, most of it blocked",
     .thing = PLASTIC(0.60f, 0.14f, 0.08f, 0.1f), .light_square = PLASTIC(0.55f, 0.50f, 0.42f, 0.15f), .dark_square = PLASTIC(0.25f, 0.20f, 0.15f, 0.15f),
     .set_angle = 180, .thing_angle = 20, .eye_angle = -30, .eye_height = 0.9f, .eye_distance = 1.75f,
     .target_height = 0.5f, .half_width = 0.58f, .exposure = 0.6f, .room = true, .crop_x = 0.5f, .crop_y = 0.5f, .in_page = true},
};
