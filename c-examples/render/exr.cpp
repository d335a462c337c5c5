/* OpenEXR files by the library of that name: its C++ interface alone knows all compressions and gives 32-bit floats. */
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>

#include <algorithm>
#include <exception>
#include <vector>

#include "read.h"

/* A window of data may be larger than what it shows; beyond this, a file is hostile. */
static const int MAX_WINDOW = 65536;

/* What lies outside the window of data is black. */
static void copy_row(Light *light, const Imath::Box2i &shown, const Imath::Box2i &data, int y, const float *row, bool grey) {
    float *out = light->texels + 3 * (std::size_t)light->width * (std::size_t)(y - shown.min.y);
    for (int x = std::max(data.min.x, shown.min.x); x <= std::min(data.max.x, shown.max.x); x++) {
        for (int k = 0; k < 3; k++) {
            out[3 * (x - shown.min.x) + k] = row[3 * (x - data.min.x) + (grey ? 0 : k)];
        }
    }
}

static const char *read_file(Light *light, const char *path) {
    static const char *const names[3] = {"R", "G", "B"};
    Imf::Header::setMaxImageSize(MAX_WINDOW, MAX_WINDOW);
    Imf::InputFile file(path, 0);
    const Imath::Box2i shown = file.header().displayWindow(), data = file.header().dataWindow();
    const Imf::ChannelList &channels = file.header().channels();
    bool grey = channels.findChannel("R") == nullptr && channels.findChannel("Y") != nullptr;
    for (int k = 0; k < 3 && !grey; k++) {
        if (channels.findChannel(names[k]) == nullptr) {
            return "an OpenEXR file without the channels R, G and B, or Y";
        }
    }
    const char *fault = read_begin(light, (long)shown.max.x - shown.min.x + 1, (long)shown.max.y - shown.min.y + 1);
    if (fault != nullptr) {
        return fault;
    }
    std::vector<float> row(3 * ((std::size_t)(data.max.x - data.min.x) + 1));
    const std::size_t step = 3 * sizeof(float);
    Imf::FrameBuffer pixels;
    for (int k = 0; k < (grey ? 1 : 3); k++) {
        char *base = (char *)(row.data() + k) - (std::ptrdiff_t)step * data.min.x;
        pixels.insert(grey ? "Y" : names[k], Imf::Slice(Imf::FLOAT, base, step, 0));
    }
    file.setFrameBuffer(pixels);
    for (int y = std::max(data.min.y, shown.min.y); y <= std::min(data.max.y, shown.max.y); y++) {
        file.readPixels(y);
        copy_row(light, shown, data, y, row.data(), grey);
    }
    return nullptr;
}

extern "C" const char *exr_read(Light *light, const char *path) {
    try {
        return read_file(light, path);
    } catch (const std::exception &error) {
        return read_fault("an OpenEXR file that its library refuses: %s", error.what());
    }
}
