// The scene of scene.h for the consumers in C++11.
#ifndef SCENE_HPP
#define SCENE_HPP
#include <wis_wavelets.hpp>

#include <vector>

const unsigned width = 16, height = 8;

inline std::vector<float> paint() {
    std::vector<float> pixels(3 * width * height, 0.5f);
    for (unsigned c = 0; c < 3; c++) pixels[3 * (2 * width + 5) + c] = 100.0f;
    return pixels;
}

inline wis_environment_config map_config(const std::vector<float> &pixels) {
    auto config = wis::sized<wis_environment_config>();
    config.layout = WIS_LAYOUT_LATLONG;
    config.filter = WIS_FILTER_NEAREST;
    config.width = width;
    config.height = height;
    config.channels = 3;
    config.format = WIS_FORMAT_F32;
    config.pixels = pixels.data();
    return config;
}

// A tree of the light over the octahedral square of the world.
inline wis_tree_config tree_config(const wis_environment *environment) {
    auto config = wis::sized<wis_tree_config>();
    config.source = WIS_TREE_ENVIRONMENT;
    config.depth = 4;
    config.environment = environment;
    return config;
}

#endif
