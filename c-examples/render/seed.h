/* Seeds of pixels, passes and dimensions: nested hashes (Wellons 2018, "lowbias32"). Any number that tells pixels apart is one, too. */
#ifndef RENDER_SEED_H
#define RENDER_SEED_H

#include <stdint.h>

static inline uint32_t seed_mix(uint32_t x) {
    x = (x ^ (x >> 16)) * 0x7feb352du;
    x = (x ^ (x >> 15)) * 0x846ca68bu;
    return x ^ (x >> 16);
}

static inline uint32_t pixel_seed(uint32_t x, uint32_t y, uint32_t pass) {
    return seed_mix(x ^ seed_mix(y ^ seed_mix(pass)));
}

#endif
