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

inline wis_wavelet_light_config map_config(const std::vector<float> &pixels) {
    auto config = wis::sized<wis_wavelet_light_config>();
    config.layout = WIS_LAYOUT_LATLONG;
    config.width = width;
    config.height = height;
    config.channels = 3;
    config.format = WIS_FORMAT_F32;
    config.storage = WIS_STORAGE_PYRAMID;
    config.flags = WIS_WAVELET_LIGHT_NEAREST;
    config.pixels = pixels.data();
    return config;
}

inline wis_wavelet_query lambert() {
    auto query = wis::sized<wis_wavelet_query>();
    query.lobe_count = 1;
    query.normal[2] = 1.0f;
    query.tangent[0] = 1.0f;
    query.wo[0] = 0.6f;
    query.wo[2] = 0.8f;
    query.lobe[0].kind = WIS_WAVELET_LOBE_LAMBERT;
    for (float &weight : query.lobe[0].weight) weight = 0.8f;
    return query;
}

#endif
