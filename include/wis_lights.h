/* SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * wis_lights: an environment map as directional lights.
 * Generated from the Rust sources: edit those, then run `make header`.
 *
 * Structured importance sampling (Agarwal et al. 2003) cuts a lat-long map into strata and places a directional light in each.
 * Bright, wide regions get more lights than small ones of the same energy. Use it if a frame shares one set of lights.
 *
 * Order of use. Once for a map: wis_strata_size, wis_strata_lights. At a hit: add up the lights with their shadows;
 * wis_strata_order says which of them are worth a ray. Soft shadows: wis_jitter_init once, then wis_jitter_sample draws a
 * direction inside the stratum of a light.
 *
 * The rules of wis.h for memory, threads, failure, structs and arguments hold here.
 */

#ifndef WIS_LIGHTS_H
#define WIS_LIGHTS_H

#include "wis.h"

#ifdef __cplusplus
extern "C" {
#endif

/** @defgroup lights Directional lights
 *  Structured importance sampling (Agarwal and others, 2003): a map as directional lights. */ /** @{ */

/// A stratum as a directional light.
typedef struct wis_light {
  float direction[3]; /**< The direction towards the light: the centre of the stratum, unit length, world space. */
  float rgb[3]; /**< Radiance x solid angle, summed over the stratum: the irradiance on a surface that faces the light. */
  float luminance; /**< The luminance of `rgb`. */
  float solid_angle; /**< The solid angle of the stratum. */
  float extent; /**< The largest angle from the centre to a texel's centre in the stratum, in radians. */
} wis_light;

/// Directions uniform over the solid angle of a stratum: the paper's jitter, biased in shadow where the light varies inside the stratum.
#define WIS_JITTER_UNIFORM 0

/// Directions in proportion to the radiance of the texels: the light's `rgb` luminance x visibility is unbiased.
#define WIS_JITTER_ENERGY 1

/// The texels of every stratum, to place samples inside: bytes in your memory without pointers. Constant once built; any number of threads
/// may use it at once. Nothing to free.
typedef struct wis_jitter wis_jitter;

/// How to cut a map into strata. Zeros stand for the paper's choices.
typedef struct wis_strata_config {
  uint32_t size; /**< sizeof(wis_strata_config). */
  uint32_t count; /**< Lights to place; there may be more where many small bright regions are each worth a light. */
  uint32_t levels; /**< Layers of brightness, cut at multiples of the map's standard deviation, at most 64; 0: 6. */
  float angle_limit; /**< The solid angle in sr from which on the size of a region does not count; 0: 0.01. */
  /// Two exponents, at least 0 and at most 8, of radiance and of solid angle: how much a region counts. (1, 0) is importance sampling of
  /// the light, (0, 1) with an `angle_limit` of 4 pi stratifies the sphere; null: 1 and 1/4.
  const float *exponents;
} wis_strata_config;

/// Which texel lies in which stratum, and how places are drawn.
typedef struct wis_jitter_config {
  uint32_t size; /**< sizeof(wis_jitter_config). */
  uint32_t light_count; /**< Strata: the lights that wis_strata_lights placed. */
  uint32_t distribution; /**< WIS_JITTER_*. */
  uint32_t reserved; /**< Always 0. */
  /// The light of each texel, width x height numbers below `light_count`: as wis_strata_lights found them. wis_jitter_size does not read
  /// it.
  const uint32_t *label;
} wis_jitter_config;

/// The memory that wis_strata_lights needs: `bytes` of lights and `scratch_bytes` of scratch. `map`: lat-long, without
/// WIS_ENVIRONMENT_ROWS_AT_POLES; of its flags only WIS_ENVIRONMENT_SANITISE counts; filter and error budget do not matter. Work: constant.
enum wis_status wis_strata_size(const struct wis_environment_config *map, const struct wis_strata_config *config,
    struct wis_memory_size *size, struct wis_diagnostic *diagnostic);

/// Cuts a map into strata and gives each as a directional light (Agarwal et al. 2003): bright regions get more lights than dark ones of the
/// same energy, and lights of a region stand apart. The lights' `rgb` add up to the integral of radiance over the sphere. Written are
/// `light_count` lights, in the order of importance in which they were placed; 0 for a black map. The result depends on nothing but the map
/// and the config. WIS_OVERFLOW if the light of a stratum is no float.
///
/// `lights` holds `bytes` of wis_strata_size. `label` may be null; else it holds width x height numbers, and gets the number of the light
/// of each texel. Work: (lights + levels) x texels.
enum wis_status wis_strata_lights(const struct wis_environment_config *map, const struct wis_strata_config *config, void *scratch,
    size_t scratch_bytes, struct wis_light *lights, uint32_t *light_count, uint32_t *label, struct wis_diagnostic *diagnostic);

/// The memory that wis_jitter_init needs for the strata of a lat-long map. Work: constant.
enum wis_status wis_jitter_size(const struct wis_environment_config *map, const struct wis_jitter_config *config,
    struct wis_memory_size *size, struct wis_diagnostic *diagnostic);

/// Sorts the texels of a map by their strata, so that directions can be drawn inside each. `map` as in wis_strata_size.
/// WIS_INVALID_ARGUMENT for a label that is no stratum: `y` in the diagnostic is the number of the texel. Work: texels + lights.
enum wis_status wis_jitter_init(const struct wis_environment_config *map, const struct wis_jitter_config *config, void *memory,
    size_t bytes, void *scratch, size_t scratch_bytes, const struct wis_jitter **jitter, struct wis_diagnostic *diagnostic);

/// Opens bytes that wis_jitter_init wrote: copied, or mapped from a file. `jitter` receives the handle, which is the address of `memory`.
/// WIS_CORRUPT if a byte was changed; with the field `magic` in the diagnostic if another version of wis wrote them. Reads all bytes once.
/// Work: bytes.
enum wis_status wis_jitter_open(const void *memory, size_t bytes, const struct wis_jitter **jitter, struct wis_diagnostic *diagnostic);

/// Draws a direction inside stratum `light` (WIS_INVALID_ARGUMENT if there is none). The pdf is per solid angle within the stratum. With
/// WIS_JITTER_ENERGY add the light's whole energy x BRDF x cosine x visibility, without dividing by the pdf; for radiance looked up at the
/// sample divide by it. Work: log texels.
enum wis_status wis_jitter_sample(const struct wis_jitter *jitter, uint32_t light, const float u[2], struct wis_drawn *sample);

/// The pdf of wis_jitter_sample for any direction of unit length: the very bits that a sample came with, and 0 outside the stratum. Work:
/// log texels.
enum wis_status wis_jitter_pdf(const struct wis_jitter *jitter, uint32_t light, const float wi[3], float *pdf);

/// Which lights are worth a shadow ray at a point (Agarwal et al. 2003, Section 4): writes the numbers of `count` lights into `index`, the
/// first `traced` of them in the order of `contribution` (radiance x BRDF x cosine, at least 0 and finite, else WIS_INVALID_ARGUMENT), the
/// largest first, equal ones by number. What the others could add is at most `threshold` (0 to 1, however small) of the whole; they follow
/// in an order of no meaning. Estimate those by their sum x the share that is visible of a few of them drawn in proportion to
/// `contribution`: without bias. The time is that of a pass over all lights and of sorting those that are traced. Work: count x log count.
enum wis_status wis_strata_order(size_t count, const float *contribution, float threshold, uint32_t *index, uint32_t *traced,
    struct wis_diagnostic *diagnostic);
/** @} */

#ifdef __cplusplus
}
#endif

#endif /* WIS_LIGHTS_H */
