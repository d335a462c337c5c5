/* SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * wis: direct light from an environment map. Generated from the Rust sources: edit those, then run `make header`.
 *
 * wis chooses the directions in which a renderer traces shadow rays towards an environment map, and their weights. At a shading point
 *
 *     reflected light = sum over rays of weight x f(wo, wi) x |cos| x L(wi) x V(wi)
 *
 * in expectation, for your own BRDF f, radiance L and visibility V. You evaluate those for the rays that you trace, and no others.
 *
 * Order of use. Most renderers need the 15 functions before wis_environment_begin. Once for a map: wis_environment_size, wis_environment_init.
 * For each thread: wis_sampler_size, wis_sampler_init. For each material: wis_material_init. At a hit: wis_direct. While you integrate:
 * wis_check compares your radiance with the light that was built, wis_check_point your BSDF with the lobes. Further on: visibility of earlier
 * passes; waves of hits; wis_product_prepare, wis_sample and wis_pdf for renderers that combine samples with their own (MIS). Structured
 * importance sampling is in wis_lights.h, wavelet trees in wis_wavelets.h. What calls cost: docs/performance.md. A library built without
 * products (make lib PRODUCTS=) lacks wis_product_*, wis_sample, wis_pdf and wis_invert; one without checks (make lib CHECKS=) wis_check and
 * wis_check_point.
 *
 * Memory. Everything is built in memory that you give and that a _size call measures before: bytes and alignment. Objects hold no pointers
 * and have no free function: copy, save and map them as bytes. Nothing allocates, prints or aborts. There is no global state.
 *
 * Threads. An environment is constant once built, and any number of threads may read it. A sampler belongs to one thread at a time. Memory in
 * which a call builds belongs to that call alone, except where its comment says so.
 *
 * Work. A comment ends with what the work of a call is at most proportional to, besides a constant: `Work: count`. Client's functions are not
 * counted. Squares are inner nodes of trees, cells the pixels of the octahedral square.
 *
 * Failure. If a status is not WIS_OK, the call wrote no handle and no result, and the memory of an object that it was to build is undefined. A
 * wis_diagnostic, which may be null, receives argument, field and element at fault; calls on a sampler keep it there (wis_sampler_fault).
 * Pointers must not be null unless their comment allows it. Any call may answer WIS_NULL_POINTER, WIS_MISALIGNED, WIS_INVALID_STRUCT_SIZE,
 * WIS_MISMATCH and WIS_MEMORY_TOO_SMALL as wis_status describes them; comments name only other statuses.
 *
 * Structs and arguments. If the first field is `size`, set it to sizeof the struct; set fields that you do not use to 0. Arguments stand in the
 * order objects, config, count, inputs, outputs. A stride is the distance in bytes from one element to the next; 0: close together. A stride
 * shorter than an element is WIS_INVALID_ARGUMENT, one that is no multiple of 4 WIS_MISALIGNED.
 *
 * Spaces and units. Directions are three floats x, y, z of unit length (within 1e-3) in world space. They point away from the surface: wo to
 * the viewer, wi to the light. A pdf is per solid angle, in 1/sr. Radiance is in the unit of the map. The polar axis of a lat-long map is +z in
 * map space; world_from_map is a row-major 3x3 rotation or reflection (within 1e-4). Random numbers u lie in [0, 1); others are moved to the
 * nearest inside, NaN counts as 1/2. The same inputs give the same bits on every processor that the library supports.
 */

#ifndef WIS_H
#define WIS_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** @defgroup answers Answers, memory, version
 *  What calls answer, where a fault lies, and which library is linked. */ /** @{ */

/// The answer of every call that can fail.
typedef enum wis_status {
  WIS_OK = 0, /**< The call did what was asked. */
  WIS_NULL_POINTER = 1, /**< A pointer that must not be null is null. */
  WIS_INVALID_ARGUMENT = 2, /**< A value is outside the range that its comment states, or a stride is shorter than an element. */
  WIS_INVALID_STRUCT_SIZE = 3, /**< The `size` of a struct is not set, or the header is of another version. */
  WIS_MEMORY_TOO_SMALL = 4, /**< The memory is shorter than the size query said. */
  WIS_MISALIGNED = 5, /**< A pointer or stride is not aligned to what it points to: 16 for blocks, 4 for floats, 2 for 16-bit floats. */
  WIS_OVERFLOW = 6, /**< Sizes overflow or exceed what the format can address, or a result exceeds its type. */
  WIS_INVALID_TEXEL = 7, /**< A texel is NaN or infinite (see WIS_ENVIRONMENT_SANITISE); a pixel of a tree also if it is negative. */
  /// A matrix is not a rotation or reflection within 1e-4, a direction is not of unit length within 1e-3, or the tangent that an
  /// anisotropic lobe needs is 0 or parallel to the normal.
  WIS_INVALID_TRANSFORM = 8,
  /// The memory holds no such object, or one that is not finished; or the product was prepared with another environment.
  WIS_MISMATCH = 9,
  WIS_CORRUPT = 10, /**< Not an object that this version wrote: `field` of the diagnostic is `magic`; null if bytes were changed. */
  WIS_ZERO_DENSITY = 11, /**< The density of that direction is 0: no u leads there. */
  WIS_CALLBACK_FAILED = 12, /**< A callback failed or returned a value that is NaN, infinite or negative. */
  WIS_NOT_BUILT = 13, /**< The object was not built, or built without what the call needs (RGB, the compensated distribution). */
  WIS_UNREACHABLE = 14, /**< The density there is above 0, but numbers u of 24 bits do not reach it. */
} wis_status;

#define WIS_VERSION 768 /**< The version of the library and of every stored object: major * 65536 + minor * 256 + patch. */
#define WIS_ALIGNMENT 16 /**< The alignment of every block of memory, in bytes: that of malloc on 64-bit platforms. */

/// How much memory an object needs. Both blocks are yours: allocate them as you like.
typedef struct wis_memory_size {
  size_t bytes; /**< Bytes of the object. */
  size_t align; /**< Alignment of both blocks, in bytes. */
  size_t scratch_bytes; /**< Bytes that only the build needs; may be freed afterwards. 0: none. */
} wis_memory_size;

/// Where the fault is. Written only if a call fails, and only if you give one.
typedef struct wis_diagnostic {
  uint32_t argument; /**< The position of the argument at fault, 1 = first; 0: none in particular. */
  uint32_t x; /**< WIS_INVALID_TEXEL: the column of the texel, 0 = first. Array of arrays: the number of the element in the inner one. */
  uint32_t y; /**< The row of the texel, or the number of the element at fault in an array, 0 = first. 0 where the argument is neither. */
  uint32_t reserved; /**< Always 0. */
  uint64_t bytes_needed; /**< WIS_MEMORY_TOO_SMALL: the bytes that are needed. */
  const char *field; /**< The field at fault, as `normal`: a static string, or null. `magic`: stored bytes are of another version. */
} wis_diagnostic;

/// A sentence for a log; a static string, also for a value that is not a status. Work: constant.
const char *wis_status_string(uint32_t status);

/// WIS_VERSION of the library that is linked. Work: constant.
uint32_t wis_version(void);
/** @} */

/** @defgroup light The light
 *  An environment, built once for a map and read by any number of threads. */ /** @{ */

#define WIS_LAYOUT_LATLONG 1 /**< Columns: azimuth 2 pi (x + 1/2) / width from +x to +y. Rows: angle pi (y + 1/2) / height from +z. */
#define WIS_LAYOUT_CUBE 2 /**< Six square faces below one another, +x -x +y -y +z -z, each as OpenGL orients it; height = 6 width. */
#define WIS_LAYOUT_OCTAHEDRAL 3 /**< Equal-area octahedral square (Clarberg 2008): +z in the centre, columns along x; height = width. */
#define WIS_ENVIRONMENT_PASSES 6 /**< The passes of a build that threads share. */
#define WIS_FORMAT_F32 1 /**< 32-bit floats. */
#define WIS_FORMAT_F16 2 /**< 16-bit floats. */

/// You interpolate between texel centres. Azimuth wraps; beyond a pole rows go on half a turn further; faces join.
#define WIS_FILTER_BILINEAR 0

#define WIS_FILTER_NEAREST 1 /**< You take the texel that holds the direction. */
#define WIS_ENVIRONMENT_ROWS_AT_POLES 1 /**< Lat-long: the first and the last row lie at the poles: theta = pi y / (height - 1). */
#define WIS_ENVIRONMENT_EXACT_ZERO 2 /**< Black texels get pdf 0. Otherwise none counts as darker than 2^-16 of the mean. */
#define WIS_ENVIRONMENT_COMPENSATED 4 /**< Densities and products are those of max(L - mean, L / 64) (Karlik et al. 2019), for MIS. */
#define WIS_ENVIRONMENT_SANITISE 8 /**< NaN and -Inf count as 0, +Inf as 65504, instead of being rejected. Clamp your look-up alike. */

/// No products will be prepared with it, nor shared by hits: 21 kB less. wis_product_prepare answers WIS_NOT_BUILT.
#define WIS_ENVIRONMENT_LIGHT_ONLY 16

/// Only rays will be drawn with it: no exact tables. 1.1 to 2.1 MB for a map of 1024 x 512, in half the time; wis_sample, wis_pdf,
/// wis_invert, wis_product_prepare and wis_check answer WIS_NOT_BUILT, with the field `flags`. A library without products and checks sets
/// it.
#define WIS_ENVIRONMENT_RAYS_ONLY 64

#define WIS_ENVIRONMENT_ABSOLUTE 32 /**< Negative channels count by their size instead of as 0: pdf > 0 wherever |L| > 0. */

/// An environment map as a distribution of directions: bytes in your memory without pointers, so it may be copied (to any block aligned to
/// WIS_ALIGNMENT), saved and mapped. Constant once built, but for wis_environment_turn; any number of threads may use it at once.
typedef struct wis_environment wis_environment;

/// Gives row `y` in the format of the configuration. The bytes must stay until the next call on the same thread. Null: WIS_CALLBACK_FAILED.
typedef const void *(*wis_row_fn)(void *user, uint32_t y);

/// The map, and what to build from it.
typedef struct wis_environment_config {
  uint32_t size; /**< sizeof(wis_environment_config). */
  uint32_t layout; /**< WIS_LAYOUT_*. */
  uint32_t width; /**< Texels in a row, 1 to 32768, also odd; more is WIS_OVERFLOW. */
  uint32_t height; /**< Rows, 1 to 32768; of a cube map all six faces. More is WIS_OVERFLOW. */
  uint32_t channels; /**< 1 (luminance), 3 (RGB) or 4 (alpha is ignored), linear Rec. 709. Negative ones count as 0: clamp alike. */
  uint32_t format; /**< WIS_FORMAT_*. */
  uint32_t filter; /**< WIS_FILTER_*: how you look the map up. */
  uint32_t flags; /**< WIS_ENVIRONMENT_*, or 0. */
  float error_budget; /**< The relative standard deviation of radiance / pdf that coarser tables may add, 0 to 1; 0: every texel. */
  const void *pixels; /**< Texel 0 of row 0, aligned to its format; or null, and `row` gives the rows, which need no alignment. */
  ptrdiff_t row_stride; /**< Bytes from a row to the next, a multiple of a channel's, may be negative; 0: rows stand close together. */
  wis_row_fn row; /**< Used if `pixels` is null; called from each thread that runs the first pass. */
  void *row_user; /**< Handed to `row`. */
  const float *world_from_map; /**< A row-major 3x3 rotation or reflection, world = M map, within 1e-4; null is the identity. Copied. */
} wis_environment_config;

/// What was built.
typedef struct wis_environment_info {
  uint32_t size; /**< sizeof(wis_environment_info), set by the caller. */
  uint32_t layout; /**< WIS_LAYOUT_*. */
  uint32_t width; /**< Texels in a row. */
  uint32_t height; /**< Rows. */
  uint32_t filter; /**< WIS_FILTER_*. */
  uint32_t flags; /**< WIS_ENVIRONMENT_*, but for WIS_ENVIRONMENT_SANITISE and WIS_ENVIRONMENT_ABSOLUTE. */
  uint64_t bytes; /**< Bytes of the environment: that much of the block is in use and needs to be saved. */
  uint64_t sanitised; /**< Texels that had a negative channel, or one that WIS_ENVIRONMENT_SANITISE replaced. */
  uint64_t content_id; /**< Tells environments apart: a hash of the bytes, also of world_from_map. */
  /// The integral of luminance, or of what compensation leaves of it, over the sphere: unit of the map x steradian.
  /// WIS_ENVIRONMENT_RAYS_ONLY: of luminance.
  double power;
  double mean; /**< The mean luminance over the sphere, in the unit of the map. */
  double largest_share; /**< The share of the light that the brightest texel gives, 0 to 1. */
  double error; /**< The relative standard deviation of radiance / pdf that the error budget added. */
} wis_environment_info;

/// Measures the memory of a build: bytes of the environment, at most, and bytes of scratch memory. What was built says how many of them it
/// uses. A map of 1024 x 512 needs 4.5 MB (WIS_FILTER_NEAREST: 3.3 MB), of which 3.5 to 4.5 are used, and 2.4 MB of scratch. Reads no
/// pixels. Costs 15 us. Work: constant.
enum wis_status wis_environment_size(const struct wis_environment_config *config, struct wis_memory_size *size,
    struct wis_diagnostic *diagnostic);

/// Builds an environment on one thread. `memory`: where the environment goes; a multiple of 64 as its address makes look-ups from cold
/// caches cheaper. `scratch`: may be freed afterwards. `environment` receives the handle, which is the address of `memory`.
/// WIS_INVALID_TEXEL: the diagnostic names column and row. WIS_MEMORY_TOO_SMALL: the diagnostic tells the bytes that are needed; an error
/// budget needs fewer than wis_environment_size says. A map of 1024 x 512 RGB floats costs 15 to 90 ms, a budget 0.2 to 0.4 s more. Work:
/// texels.
enum wis_status wis_environment_init(const struct wis_environment_config *config, void *memory, size_t bytes, void *scratch,
    size_t scratch_bytes, const struct wis_environment **environment, struct wis_diagnostic *diagnostic);

/// Opens bytes that an earlier build wrote: copied, or mapped from a file. `bytes`: as many as wis_environment_info says, or more.
/// `environment` receives the handle, which is the address of `memory`. WIS_CORRUPT if a byte was changed; with the field `magic` in the
/// diagnostic if another version of wis wrote them. Reads all bytes once: 1 ms for a map of 1024 x 512. Work: bytes.
enum wis_status wis_environment_open(const void *memory, size_t bytes, const struct wis_environment **environment,
    struct wis_diagnostic *diagnostic);

/// Describes an environment. Work: constant.
enum wis_status wis_environment_describe(const struct wis_environment *environment, struct wis_environment_info *info);
/** @} */

/** @defgroup sampler A sampler for each thread
 *  What a thread keeps from hit to hit. */ /** @{ */

#define WIS_CPU_DETECT 0 /**< Detect the instructions of this processor. */
#define WIS_CPU_BASELINE 1 /**< Instructions that every processor of the platform has. */
#define WIS_CPU_AVX2 2 /**< x86-64 with AVX2. */

/// One thread's working memory: bytes in your memory without pointers to it. One thread at a time may use it.
typedef struct wis_sampler wis_sampler;

/// What a sampler is made for. Zeros are good choices.
typedef struct wis_sampler_config {
  uint32_t size; /**< sizeof(wis_sampler_config). */
  uint32_t cpu_level; /**< WIS_CPU_*. Never changes a bit of the results. WIS_INVALID_ARGUMENT for a level that this processor lacks. */
  uint32_t rays; /**< The most rays of one call, 1 to 4096; 0: 16. */
  /// Candidates for each ray, 1 to 256, rounded up to powers of two, at least 16 a call: 1 to 16 are the same for one ray. 0: chosen by
  /// rays, point and lobes, for cheap and expensive rays alike.
  uint32_t candidates_per_ray;
  /// First hits of a pixel, between calls of wis_sampler_begin_pixel; 0: unknown. From 16 on they share products: 16 kB more.
  uint32_t hits_per_pixel;
  uint32_t reserved; /**< Always 0. */
} wis_sampler_config;

/// The bytes that a sampler needs: 6 kB for 16 rays, 2 kB for one to four. Work: constant.
enum wis_status wis_sampler_size(const struct wis_sampler_config *config, struct wis_memory_size *size, struct wis_diagnostic *diagnostic);

/// Makes a sampler in `memory`. Detects the processor's instructions, which takes microseconds: once for a thread. Work: bytes.
enum wis_status wis_sampler_init(const struct wis_sampler_config *config, void *memory, size_t bytes, struct wis_sampler **sampler,
    struct wis_diagnostic *diagnostic);

/// Forgets products that hits of the last pixel shared, so that images depend on the order of pixels and on threads in nothing. Call it
/// when the seed of points changes. WIS_NULL_POINTER, WIS_MISMATCH for memory that holds no sampler. Work: constant.
enum wis_status wis_sampler_begin_pixel(struct wis_sampler *sampler);

/// Where the last call on this sampler that failed was at fault: argument, field and element. Work: constant.
enum wis_status wis_sampler_fault(const struct wis_sampler *sampler, struct wis_diagnostic *fault);
/** @} */

/** @defgroup material Materials, portals, points
 *  What a hit tells: lobes near your BSDF, normal, wo, and windows that light comes through. */ /** @{ */

#define WIS_MAX_LOBES 4 /**< Lobes of a material. */
#define WIS_LOBE_LAMBERT 1 /**< Diffuse reflection: `weight / pi` above the surface; with both sides, on the side of wo. */
#define WIS_LOBE_GGX 2 /**< Microfacets: `weight F D G / (4 cos cos)`, GGX, height-correlated Smith shadowing, Schlick's Fresnel term. */
#define WIS_LOBE_PHONG 3 /**< `weight (a + 2) / (2 pi) max(0, r.wi)^a` on the side of wo; r, the mirror direction of wo, may lie below. */

/// Transmission through GGX microfacets (Walter et al. 2007, Eq. 21): `weight (1 - F)` times D, G and the Jacobian for `eta`; 0 beyond the
/// critical angle. F: Schlick's term by the cosine of wo and the half vector, from either side with `f0` of this lobe: ((eta - 1) / (eta +
/// 1))^2 for clear glass. Seen from inside glass `eta` is 1 / 1.5, and the GGX lobe has an `f0` of 1 where wo is beyond the critical angle.
/// Wherever a width counts, the lobe is as narrow as a mirror of alpha |1 - 1 / eta| / 2.
#define WIS_LOBE_GGX_TRANSMISSION 5

#define WIS_LOBE_LAMBERT_TRANSMISSION 6 /**< Diffuse transmission: `weight / pi` on the side opposite to wo. */
#define WIS_POINT_WHOLE_SPHERE 1 /**< Directions on both sides count, with |n.wi| for the cosine. Implied by a lobe that transmits. */
#define WIS_POINT_COSINE_INCLUDED 2 /**< The client's BRDF already contains the cosine, and so do the lobes: it is not multiplied again. */
#define WIS_POINT_COMPENSATED 4 /**< Rays bring what exceeds the light's mean, escaping BSDF rays the rest: wis_base. Products ignore it. */

/// Directions outside all portals do not count. Without it an eighth of the rays looks elsewhere, and means are right in any case.
#define WIS_POINT_PORTALS_COMPLETE 8

#define WIS_MAX_PORTALS 8 /**< Portals of a point. */

/// The shape of a lobe.
typedef struct wis_lobe {
  uint32_t kind; /**< WIS_LOBE_*. */
  float a; /**< GGX: alpha along the tangent, 1e-5 to 16. Phong: the exponent, 0 to 1e7. Others: not read. */
  float b; /**< GGX: alpha along the bitangent, 1e-5 to 16. Others: not read. */
  float eta; /**< GGX transmission: refractive index beyond over that on the side of wo, 0.1 to 10, not within 1e-3 of 1. */
} wis_lobe;

/// The shapes of a material's lobes. Plain and copyable: fill `size`, `lobe_count` and `lobe`, then call wis_material_init once.
typedef struct wis_material {
  uint32_t size; /**< sizeof(wis_material). */
  uint32_t lobe_count; /**< Lobes used, 0 to 4. Without lobes a point reflects alike in all directions. */
  struct wis_lobe lobe[WIS_MAX_LOBES]; /**< The lobes, of which the first lobe_count are read. */
  uint64_t hash; /**< Written by wis_material_init: tells materials apart by their content. */
} wis_material;

/// Writes the luminance of your BRDF x |cosine| (finite, at least 0) for `count` world directions, three floats each. Returns 0; anything
/// else stops the call with WIS_CALLBACK_FAILED. Floating-point control is the default meanwhile.
typedef int (*wis_target_fn)(void *user, size_t count, const float *wi, float *f_cos);

/// A rectangle that light comes through, such as a window, in world space. `edges[0]` x `edges[1]` points into the room. A portal that is
/// seen from behind or from its plane, or has no area, is left out: zeros are no portal.
typedef struct wis_portal {
  float corner[3]; /**< A corner less the position of the shading point. */
  float edges[2][3]; /**< The two edges that begin there, at right angles within 1e-3. */
} wis_portal;

/// A shading point in world space. Plain and copyable.
typedef struct wis_point {
  uint32_t size; /**< sizeof(wis_point). */
  uint32_t flags; /**< WIS_POINT_*, or 0: the upper hemisphere of the normal. */
  const struct wis_material *material; /**< The material, after wis_material_init. Null: no lobes. Read during calls only. */
  float normal[3]; /**< The shading normal, unit length. */
  float tangent[3]; /**< Direction of alpha `a`, length 0.01 to 1e18, not along the normal. All 0: any, if no lobe is anisotropic. */
  /// The direction to the viewer, unit length. Below the shading horizon, of a point without WIS_POINT_WHOLE_SPHERE, GGX is 0 and other
  /// lobes keep their formulas. If all lobes are 0 by that, the point counts as one without lobes.
  float wo[3];
  float weight[WIS_MAX_LOBES][3]; /**< Linear RGB factor of each lobe at this hit, at least 0: textures. All 0: rays ignore the lobes. */
  float f0[WIS_MAX_LOBES][3]; /**< GGX: reflectance at normal incidence of each lobe, RGB in [0, 1]. Others: not read. */
  uint32_t seed; /**< The pixel: any number, another one for each pixel. */
  uint32_t sample; /**< The number of this hit among all of its pixel and bounce, over all passes. Gaps only slow convergence. */
  uint32_t bounce; /**< The bounce: 0 for camera hits, 1 for the next ... */
  uint32_t visibility_key; /**< The place in `visibility`, such as wis_visibility_key or the number of a tile of pixels + 1. 0: none. */
  uint32_t portal_count; /**< How many portals there are, at most WIS_MAX_PORTALS; 0: light may come from everywhere. */
  struct wis_visibility_cache *visibility; /**< What rays of earlier passes saw, which wis_direct then prefers. Null: not known. */
  /// Your own BRDF in place of the values of the lobes, which then only propose directions: called for 16 candidates at a time. Null: none.
  wis_target_fn target;
  void *target_user; /**< Handed to `target`. */
  const struct wis_portal *portals; /**< Windows that light comes through; may overlap. Not read by products. */
} wis_point;

/// Checks the shapes of a material and writes its hash. Costs 20 ns: also good for one hit, where a texture gives the roughness.
/// WIS_INVALID_ARGUMENT names the field; `y` of the diagnostic is the number of the lobe. Work: lobes.
enum wis_status wis_material_init(struct wis_material *material, struct wis_diagnostic *diagnostic);
/** @} */

/** @defgroup direct Direct light
 *  The rays to trace at a hit, and their weights. */ /** @{ */

/// A direction to trace, and what the light that comes from it counts.
typedef struct wis_ray {
  float wi[3]; /**< The direction towards the light, unit length, world space. */
  float weight; /**< What f x cosine x L x V is multiplied by. */
} wis_ray;

/// The part of a radiance that BSDF rays bring where points have WIS_POINT_COMPENSATED, 0 to 1: the light's mean radiance over the
/// luminance of `radiance`, at most 1; 1 for black. WIS_NULL_POINTER. Costs 3 ns. Work: constant.
enum wis_status wis_base(const struct wis_environment *environment, const float radiance[3], float *base);

/// The rays to trace at a hit, each with a weight. For each, evaluate your BRDF, radiance and visibility, and add `weight f(wo, wi) |cos|
/// L(wi) V(wi)`. The sum is unbiased for any BRDF and radiance that vanish outside the point's hemisphere and where the built light is 0.
///
/// `rays`: at most as many as the sampler was made for (WIS_INVALID_ARGUMENT). `ray_count`: how many there are, 0 (no light) to `rays`.
/// Rays are picked among candidates, half from the light and half from the lobes. One ray has 16, or 64 for a lobe below 0.15. Of up to 8
/// rays each has 16 (8 if all lobes are diffuse), beyond 8; 2048 in all at the most. Where the visibility cache of the point knows that
/// little of the light was seen, each has 8.
///
/// Portals of the point add 8 candidates for each ray, at least 16. WIS_INVALID_ARGUMENT for one that is not finite or has no right angle:
/// `y` of the fault is its number. If all are left out, rays are those without portals; none with WIS_POINT_PORTALS_COMPLETE.
///
/// With `hits_per_pixel` of 16 and more, first hits (`bounce` 0) whose lobes are all of 0.2 or wider draw from at most four products that
/// hits of the pixel share. Others, hits with portals, and hits of which light or point alone is COMPENSATED have candidates.
///
/// Path tracers, whose BSDF rays go on from the hit, may split any light: with WIS_POINT_COMPENSATED rays count (1 - base) L(wi), where
/// `base` is wis_base of L(wi), and BSDF rays that leave the scene, also after the last hit, count base L(wi). Candidates are then 4 for
/// each ray, at least 8 of each source. WIS_NOT_BUILT: the material was not initialised. WIS_INVALID_TRANSFORM: normal, wo or tangent.
/// Work: rays x candidates x lobes.
enum wis_status wis_direct(struct wis_sampler *sampler, const struct wis_environment *environment, const struct wis_point *point,
    uint32_t rays, struct wis_ray *ray, uint32_t *ray_count);
/** @} */

/** @defgroup check Checks while you integrate
 *  Your radiance beside the built light, your BSDF beside the lobes. */ /** @{ */

/// What explains the difference between a renderer's radiance and the built light.
typedef enum wis_cause {
  WIS_CAUSE_NONE = 0, /**< The environment is the light that you see. */
  WIS_CAUSE_SCALED = 1, /**< Your radiance is `scale` times the light: harmless if you meant it, since rays are chosen alike. */
  WIS_CAUSE_FRAME = 2, /**< You do not apply world_from_map, or you apply its inverse. */
  WIS_CAUSE_TURNED = 3, /**< Your map is rotated by 90, 180 or 270 degrees about the polar axis. */
  WIS_CAUSE_MIRRORED = 4, /**< Your map is mirrored: azimuth runs the other way. */
  WIS_CAUSE_UPSIDE_DOWN = 5, /**< Your polar axis points the other way: rows from bottom to top. */
  WIS_CAUSE_AXES = 6, /**< Another axis is your polar axis: y up, for instance, in place of z. */
  WIS_CAUSE_SHIFTED = 7, /**< You look texels up half a texel beside. */
  WIS_CAUSE_ROWS = 8, /**< Your first and last rows lie at the poles and those of the environment do not, or the other way round. */
  WIS_CAUSE_FILTER = 9, /**< You interpolate and the environment takes the nearest texel, or the other way round. */
  WIS_CAUSE_OTHER = 10, /**< Another map, rotation, blur or curve of colours: no other cause leaves almost no difference. */
  WIS_CAUSE_CLAMPED = 11, /**< You clamp what you look up at `limit`: clamp the map before you build the light. */
} wis_cause;

/// What explains the difference between a client's BRDF x cosine and the lobes of a point.
typedef enum wis_mistake {
  WIS_MISTAKE_NONE = 0, /**< The lobes are your BSDF. */
  WIS_MISTAKE_SCALED = 1, /**< Your BSDF is `scale` times the lobes: harmless, since rays are chosen alike. */
  WIS_MISTAKE_WO = 2, /**< wo points into the surface. Also where your BSDF ignores the side of wo and wo lies below. */
  WIS_MISTAKE_NORMAL = 3, /**< The normal points to the other side: flip it to the side of wo, or set WIS_POINT_WHOLE_SPHERE. */
  WIS_MISTAKE_WI = 4, /**< Your BSDF takes wi towards the surface: wi points to the light. */
  WIS_MISTAKE_NO_WEIGHT = 5, /**< The weights of all lobes are 0. */
  WIS_MISTAKE_WEIGHT = 6, /**< The weight of `lobe` should be `value` times as large, or `value` if it is 0. */
  WIS_MISTAKE_COSINE_MISSING = 7, /**< Your values lack a cosine: multiply by it, or set WIS_POINT_COSINE_INCLUDED. */
  WIS_MISTAKE_COSINE_TWICE = 8, /**< Your values have a cosine too many: WIS_POINT_COSINE_INCLUDED is set, or you multiply twice. */
  WIS_MISTAKE_ALPHA_SQUARE = 9, /**< Your alpha is the square of `a` and `b` of GGX lobes: you pass roughness in place of its square. */
  WIS_MISTAKE_ALPHA_ROOT = 10, /**< Your alpha is the square root of `a` and `b` of GGX lobes. */
  WIS_MISTAKE_TANGENT = 11, /**< The tangent should be rotated about the normal by `angle`; by 90 degrees: or swap `a` and `b`. */
  WIS_MISTAKE_ETA = 12, /**< `eta` is inverted. */
  WIS_MISTAKE_SIDES = 13, /**< Your sides and the lobes' differ: set WIS_POINT_WHOLE_SPHERE, or add a lobe that transmits. */
  WIS_MISTAKE_F0 = 14, /**< f0 of `lobe`, and of lobes with the same f0, should be `value`. */
  WIS_MISTAKE_RESEMBLES = 15, /**< No mistake: the lobes resemble your BSDF, of which they are 1 - `error` (docs/integrating.md). */
  WIS_MISTAKE_OTHER = 16, /**< Less than half of your BSDF is in the lobes: two mistakes, or lobes of another kind. */
  WIS_MISTAKE_PORTALS = 17, /**< Your BSDF is in the lobes, but no portal faces the point: `edges[0]` x `edges[1]` points into the room. */
} wis_mistake;

/// Writes the radiance that you see from `count` world directions, three floats each: linear RGB, three floats each, finite and at least 0.
/// Returns 0; anything else stops the call with WIS_CALLBACK_FAILED. Floating-point control is the default meanwhile.
typedef int (*wis_radiance_fn)(void *user, size_t count, const float *wi, float *rgb);

/// What the environment is compared with.
typedef struct wis_check_config {
  uint32_t size; /**< sizeof(wis_check_config). */
  uint32_t reserved; /**< Always 0. */
  wis_radiance_fn radiance; /**< Your radiance of the environment, as your integrator evaluates it. */
  void *radiance_user; /**< Handed to `radiance`. */
} wis_check_config;

/// What was found. From `filter` on: what to build the environment with so that it is the light that you see.
typedef struct wis_check_info {
  uint32_t size; /**< sizeof(wis_check_info), set by the caller. */
  uint32_t cause; /**< A wis_cause: the likely cause of the difference. */
  float error; /**< The mean difference of both, each as a share of the larger, 0 to 1. A factor does not count. */
  float explained; /**< The difference that is left with the fields below: `error` if nothing explains it. */
  float scale; /**< Your radiance over that of the light. */
  uint32_t filter; /**< WIS_FILTER_*. */
  uint32_t flags; /**< WIS_ENVIRONMENT_ROWS_AT_POLES or 0. */
  float shift[2]; /**< How far beside you look texels up along columns and rows, in texels: 0, 0.5 or -0.5. To be mended in your look-up. */
  float world_from_map[9]; /**< The row-major matrix. */
  float limit; /**< The luminance at which you clamp what you look up; 0 if you do not. */
} wis_check_info;

/// What was found.
typedef struct wis_point_verdict {
  uint32_t size; /**< sizeof(wis_point_verdict), set by the caller. */
  uint32_t mistake; /**< A wis_mistake: the likely cause of the difference. Of causes that explain it alike, the first. */
  const char *message; /**< The same as a sentence for a log; a static string. */
  float error; /**< The integral of |your BSDF - lobes| over the integral of the larger of both, 0 to 1. A common factor does not count. */
  float explained; /**< The difference that is left without the mistake; `error` where no mistake is named. */
  float scale; /**< Your BSDF over the lobes without the mistake. */
  uint32_t lobe; /**< WIS_MISTAKE_WEIGHT, WIS_MISTAKE_F0: the number of the lobe, 0 = first. Else 0. */
  float value; /**< WIS_MISTAKE_WEIGHT, WIS_MISTAKE_F0: see there; the luminance of a weight, grey f0. Else 0. */
  float angle; /**< WIS_MISTAKE_TANGENT: in degrees, 0 to 180, counter-clockwise seen from the tip of the normal. Else 0. */
} wis_point_verdict;

/// Compares your radiance with an environment and names the likely mistake: wrong axes, a wrong filter and the like cost no bias but many
/// times the error, in silence. Call it once while you integrate the library, or in a test.
///
/// `radiance` of `config` is called for at most 64 world directions at a time: 256, half of them drawn from the light, and up to 25,000
/// more that confirm an explanation. It answers the same for the same direction. What your map does not show is no mistake: a constant sky
/// fits every frame. WIS_CALLBACK_FAILED for a radiance that is NaN, infinite or negative: `y` of the fault (wis_sampler_fault) is the
/// number of the direction. WIS_NOT_BUILT for an environment with WIS_ENVIRONMENT_RAYS_ONLY. 1 to 20 ms besides `radiance`. Work: constant.
enum wis_status wis_check(struct wis_sampler *sampler, const struct wis_environment *environment, const struct wis_check_config *config,
    struct wis_check_info *info);

/// Compares your BSDF, the `target` of a point, with its lobes and names the likely mistake: a wo that is flipped, roughness for alpha, a
/// cosine too many and the like cost no bias but many times the error, in silence. Call it once for a kind of material, or in a test.
///
/// `target` is called five times, for 40 world directions on both sides of the surface. A mistake is named if it explains almost all of the
/// difference. What a point does not show is no mistake: see it from above, 20 to 70 degrees off the normal, and give each lobe a weight. A
/// `sample` that is always 0 stays unseen. WIS_NULL_POINTER for a target that is null, WIS_CALLBACK_FAILED for a value that is NaN,
/// infinite or negative: `y` of the fault (wis_sampler_fault) is the number of the direction. WIS_NOT_BUILT: the material was not
/// initialised. WIS_INVALID_TRANSFORM: normal, wo or tangent. Costs 0.1 to 2 ms besides `target`. Work: constant.
enum wis_status wis_check_point(struct wis_sampler *sampler, const struct wis_environment *environment, const struct wis_point *point,
    struct wis_point_verdict *verdict);
/** @} */

/** @defgroup shared Builds that threads share, lights that turn
 *  One build by several threads, and an environment that turns without being built again. */ /** @{ */

/// Begins a build that threads share. `items` receives the number of items of each of WIS_ENVIRONMENT_PASSES passes. Hand all items of a
/// pass to wis_environment_run, in any portions, on any threads, before those of the next pass; then call wis_environment_finish. The bytes
/// are those of wis_environment_init. Work: rows.
enum wis_status wis_environment_begin(const struct wis_environment_config *config, void *scratch, size_t scratch_bytes, uint32_t items[6],
    struct wis_diagnostic *diagnostic);

/// Works on `count` items of a pass, from item `first` on. Threads may call this at once for different items. `config`: that of
/// wis_environment_begin. `memory`: used from pass 2 on, null before; the same block in all calls from then on and in
/// wis_environment_finish. If it is too short, the diagnostic tells the bytes that are needed, and pass 2 may be run again. `pass`: 0 to
/// WIS_ENVIRONMENT_PASSES - 1. WIS_MISMATCH if an earlier pass is not done. Work: texels of the items.
enum wis_status wis_environment_run(const struct wis_environment_config *config, void *memory, size_t bytes, void *scratch,
    size_t scratch_bytes, uint32_t pass, uint32_t first, uint32_t count, struct wis_diagnostic *diagnostic);

/// Ends a build whose passes are done (WIS_MISMATCH before). `memory`: that of pass 2. `environment` receives the handle. Work: texels.
enum wis_status wis_environment_finish(const struct wis_environment_config *config, void *memory, size_t bytes, void *scratch,
    size_t scratch_bytes, const struct wis_environment **environment, struct wis_diagnostic *diagnostic);

/// Turns an environment in place; nothing is rebuilt. `memory`: the environment, which no other thread may use meanwhile. `world_from_map`:
/// replaces the former one; a row-major 3x3 rotation or reflection, world = M map, within 1e-4; null is the identity. `environment`
/// receives the handle. The content id changes: earlier products answer WIS_MISMATCH. A call that fails changes nothing. Costs less than
/// 0.1 us. Work: constant.
enum wis_status wis_environment_turn(void *memory, size_t bytes, const float world_from_map[9], const struct wis_environment **environment,
    struct wis_diagnostic *diagnostic);
/** @} */

/** @defgroup visibility Visibility of earlier passes
 *  What rays of earlier passes met, for cells of the scene that you choose. */ /** @{ */

/// What rays saw from places of the scene, in your memory. Any number of threads may record and read at once; between passes one of them
/// calls wis_visibility_cache_end_pass alone.
typedef struct wis_visibility_cache wis_visibility_cache;

/// The bytes that a cache of so many places needs: 1152 each. `places`: 1 to 2^20; more keys than places share them, which costs quality
/// only. As many as tiles of 8 x 8 pixels, or pieces of surface, are a good number. Work: constant.
enum wis_status wis_visibility_cache_size(uint32_t places, struct wis_memory_size *size, struct wis_diagnostic *diagnostic);

/// Makes a cache in which nothing was seen yet. `cache` receives the handle, which is the address of `memory`. Work: places.
enum wis_status wis_visibility_cache_init(uint32_t places, void *memory, size_t bytes, struct wis_visibility_cache **cache,
    struct wis_diagnostic *diagnostic);

/// Records what rays from a point saw: `reached[k]` is not 0 where the ray along `wi[k]` reached the light. Of the point only `visibility`,
/// `visibility_key` and `seed` are read; with a null `visibility` or the key 0 nothing is recorded. Directions that are not of unit length
/// are left out. Rays of wis_direct and others are welcome alike. Threads may record at once.
///
/// Estimates stay unbiased: a pixel never reads its own rays, and what is read does not change before wis_visibility_cache_end_pass. That
/// holds to the last digit if each pass has seeds of its own. With one seed over all passes a pixel's rays reach it again through those of
/// others; no bias was found by tests that find one of 1 %. Work: count.
enum wis_status wis_visibility_cache_record(const struct wis_point *point, size_t count, const float *wi, size_t wi_stride,
    const uint8_t *reached);

/// Ends a pass: points then read what was recorded so far. No other call may use the cache meanwhile. 0.5 us for each place. Work: places.
enum wis_status wis_visibility_cache_end_pass(struct wis_visibility_cache *cache);

/// A key for the piece of surface about a position: the cell of a grid of width `cell` (0 or less: 1), apart for six directions of the
/// normal. Never 0. A twentieth of the scene is a good width. Renderers that know the pixel may use its tile's number + 1. Work: constant.
enum wis_status wis_visibility_key(const float position[3], const float normal[3], float cell, uint32_t *visibility_key);
/** @} */

/** @defgroup wave Waves
 *  Many hits in one call. */ /** @{ */

#define WIS_WAVE_RAYS 64 /**< Rays of one point at the most, in a wave. */

/// A whole number of each point.
typedef struct wis_ints_in {
  const uint32_t *first; /**< The number of point 0; null where that is allowed. */
  ptrdiff_t point; /**< Bytes from a point to the next; 0: all points share it. */
} wis_ints_in;

/// Numbers of all points: number `k` of point `i` stands `i * point + k * number` bytes behind `first`. Array of structures: point = sizeof
/// the structure, number = 4. Structure of arrays: point = 4, number = bytes of a column. Points that have a number in common are
/// WIS_INVALID_ARGUMENT, unless all share all of them.
typedef struct wis_floats_in {
  const float *first; /**< The first number of point 0; null where that is allowed. */
  ptrdiff_t point; /**< Bytes from a point to the next; 0: all points share these numbers. */
  ptrdiff_t number; /**< Bytes from a number to the next; 0: they stand close together. */
} wis_floats_in;

/// As wis_floats_in, for numbers that are written. `point` must not be 0.
typedef struct wis_floats_out {
  float *first; /**< The first number of point 0. */
  ptrdiff_t point; /**< Bytes from a point to the next. */
  ptrdiff_t number; /**< Bytes from a number to the next; 0: they stand close together. */
} wis_floats_out;

/// The points of a wave, and where their rays go.
typedef struct wis_wave {
  uint32_t size; /**< sizeof(wis_wave). */
  uint32_t flags; /**< WIS_POINT_* of all points. */
  uint32_t material_count; /**< How many materials there are. */
  uint32_t rays; /**< The most rays for each point, at most as many as the sampler was made for. */
  const struct wis_material *materials; /**< The materials, each after wis_material_init. */
  struct wis_ints_in material; /**< The material of each point, below material_count. Null: material 0. */
  const uint8_t *mask; /**< Points whose byte is 0 are left out: their count is 0 and nothing else of them is read. Null: none. */
  struct wis_floats_in normal; /**< Three numbers each: the shading normal. */
  struct wis_floats_in tangent; /**< Three numbers each; null: any, if no lobe is anisotropic. */
  struct wis_floats_in wo; /**< Three numbers each: the direction to the viewer. */
  struct wis_floats_in weight; /**< Three numbers for each lobe, lobe after lobe: RGB factors. Null: 1. */
  struct wis_floats_in f0; /**< Three numbers for each lobe, lobe after lobe: reflectance at normal incidence. Null: 0. */
  struct wis_ints_in seed; /**< The pixel of each point; wis_sampler_begin_pixel is called where it changes. */
  struct wis_ints_in sample; /**< The number of the hit of each point among all hits of its pixel and bounce; null: 0. */
  struct wis_ints_in bounce; /**< The bounce of each point; null: 0. */
  struct wis_ints_in visibility_key; /**< The place of each point in `visibility`; null: 0, which is none. */
  struct wis_ints_in portal_count; /**< How many portals each point has, at most WIS_MAX_PORTALS; null: 0. */
  struct wis_floats_in portal; /**< Nine numbers each, portal after portal, as in wis_portal. Null only without `portal_count`. */
  struct wis_floats_in position; /**< Positions, taken from the corners of portals, so that points share portals of the world. Null: 0. */
  struct wis_visibility_cache *visibility; /**< What rays of earlier passes saw. Null: not known. */
  struct wis_floats_out ray; /**< Four numbers for each ray, ray after ray: direction and weight. */
  uint32_t *count; /**< How many rays each point has. */
  uint8_t *status; /**< A wis_status for each point, as a byte: a bad point never fails the others. May be null. */
} wis_wave;

/// As `count` calls of wis_direct, in order, with wis_sampler_begin_pixel where the seed changes: the same bits. A point that is wrong gets
/// a status of its own and no rays. `wave` and its arrays are read during the call only. Work: count x rays x candidates x lobes.
enum wis_status wis_direct_wave(struct wis_sampler *sampler, const struct wis_environment *environment, size_t count,
    const struct wis_wave *wave);
/** @} */

/** @defgroup product Products and densities
 *  Samples and densities, for renderers that combine them with their own (MIS). */ /** @{ */

#define WIS_PRODUCT_UNDIVIDED 1 /**< No cell is divided: cheaper to prepare, and worse. */
#define WIS_PRODUCT_CHECKSUM 2 /**< Products get the checksum that wis_product_open asks for: about 0.6 us each. */

/// The product of an environment and the BRDF x cosine at a shading point, as a distribution of directions: bytes in your memory without
/// pointers, to be copied (to any block aligned to WIS_ALIGNMENT) and read by any number of threads.
typedef struct wis_product wis_product;

/// How products are prepared. Zeros are good choices.
typedef struct wis_product_config {
  uint32_t size; /**< sizeof(wis_product_config). */
  uint32_t flags; /**< WIS_PRODUCT_*, or 0. */
  uint32_t divided_cells; /**< The most cells of the environment that are divided, 1 to 24; 0: 8. */
  /// How far normals of hits that it serves may turn, in radians, 0 to pi/2. The pdf stays above 0 for them; the integral grows.
  float cone;
} wis_product_config;

/// What was prepared.
typedef struct wis_product_info {
  uint32_t size; /**< sizeof(wis_product_info), set by the caller. */
  uint32_t bytes; /**< Bytes of the product: that much of the block is in use. */
  uint32_t divided_cells; /**< Cells that are divided. */
  float lobe_share; /**< The share of `u[0]` that draws from lobes: narrow ones, or all where a lamp below the horizon would win. */
  /// About the integral of luminance x BRDF x cosine, no estimate. Off by 2 % (root mean square over points, median of eight maps) for
  /// Lambert's lobe and GGX 0.5, 6 % for 0.2, 9 % for 0.1, 21 % for 0.05, and by a factor of 1.5 for 0.02. Where a map is black but for
  /// lamps more: a factor of 1.2 for GGX 0.2, of 5 for 0.02.
  double integral;
  float rgb[3]; /**< The same for the colour of the light; the BRDF counts by its luminance. */
  float cone_cosine; /**< The cosine of the cone of normals that it serves. */
  uint64_t environment; /**< The content id of its environment. */
} wis_product_info;

/// Measures the memory of one product at most: 4.0 kB, without division 2.0 kB, with 24 divided cells 8.0 kB. Work: constant.
enum wis_status wis_product_size(const struct wis_product_config *config, struct wis_memory_size *size, struct wis_diagnostic *diagnostic);

/// Prepares products at `count` points, one behind the other in `memory`: product i begins `offset[i]` bytes behind it, at a multiple of
/// 16. `bytes_used` receives the bytes of all, which is what needs to be copied. `memory`: `count` times the bytes of wis_product_size.
/// `seed`, `sample` and `bounce` of the points are not read. The number of a bad point stands in `y` of the fault (wis_sampler_fault).
/// WIS_NOT_BUILT for an environment with WIS_ENVIRONMENT_LIGHT_ONLY. About 1 us for Lambert's lobe, 2 us for another wide one, and 4 us
/// where lobes below about 0.12 are tried. Work: count x (lobes + divided cells).
enum wis_status wis_product_prepare(struct wis_sampler *sampler, const struct wis_environment *environment,
    const struct wis_product_config *config, size_t count, const struct wis_point *point, void *memory, size_t bytes, size_t *offset,
    size_t *bytes_used);

/// Opens bytes of one product that wis_product_prepare wrote with WIS_PRODUCT_CHECKSUM: copied, or read from a file. `bytes`: as many as
/// wis_product_info says, or more. `environment`: the one that it was prepared with, or that one's bytes opened again; WIS_MISMATCH for
/// another. `product` receives the handle, which is the address of `memory`. WIS_CORRUPT if a byte was changed or there is no checksum;
/// with the field `magic` in the diagnostic if another version of wis wrote them. Reads all bytes: about 1.3 us. Work: bytes.
enum wis_status wis_product_open(const struct wis_environment *environment, const void *memory, size_t bytes,
    const struct wis_product **product, struct wis_diagnostic *diagnostic);

/// Describes a product. WIS_MISMATCH for a product of another environment. Costs about 1 us. Work: divided cells.
enum wis_status wis_product_describe(const struct wis_environment *environment, const struct wis_product *product,
    struct wis_product_info *info);

/// Whether a product serves another hit well: 1 in `covers`, else 0. The normal must lie within the cone. Normal and view must also lie
/// within half of the narrowest alpha of the product's, at most 0.1 radians. Lobes must be of the same kinds and about as wide. Weights and
/// f0 may differ as long as no lobe's share of what the hit scatters is more than 1.25 times that at the product. Where `covers` is 1, the
/// pdf is above 0 wherever that hit reflects light. Costs about 100 ns. Work: lobes.
enum wis_status wis_product_covers(const struct wis_product *product, const struct wis_point *point, uint32_t *covers);

/// A direction in world space and its pdf per solid angle; a pdf of 0 means that there is no sample.
typedef struct wis_drawn {
  float wi[3]; /**< The direction towards the light, unit length, world space. */
  float pdf; /**< The probability density per solid angle; 0: no sample. */
} wis_drawn;

/// Draws `count` directions in proportion to a product, or, if `product` is null, to the light. `u`: two numbers in [0, 1) each. `drawn`:
/// unit directions in world space, and their pdfs per steradian: above 0, and the very bits that wis_pdf answers for that direction; 0 if
/// the light is black. In batches of 8 and more a third of the cost alone, or less. WIS_MISMATCH for a product of another environment,
/// WIS_NOT_BUILT for one with WIS_ENVIRONMENT_RAYS_ONLY. Work: count x (lobes + log texels).
enum wis_status wis_sample(struct wis_sampler *sampler, const struct wis_environment *environment, const struct wis_product *product,
    size_t count, const float *u, size_t u_stride, struct wis_drawn *drawn, size_t drawn_stride);

/// The pdf of `count` directions in a product, or, if `product` is null, in the light, per steradian; 0 for those that are not of unit
/// length within 1e-3. Batches and WIS_NOT_BUILT as in wis_sample. Work: count x (lobes + log texels).
enum wis_status wis_pdf(struct wis_sampler *sampler, const struct wis_environment *environment, const struct wis_product *product,
    size_t count, const float *wi, size_t wi_stride, float *pdf, size_t pdf_stride);

/// The `u` that leads to each of `count` directions: into its part of the tables, and there as near as 24 bits of u come. `status`: WIS_OK;
/// WIS_ZERO_DENSITY where no u leads there; WIS_UNREACHABLE where the density is above 0 but no u of 24 bits leads there (with a product:
/// or narrow lobes alone do); WIS_INVALID_TRANSFORM for a direction that is not of unit length within 1e-3. A byte each; u is written where
/// it is WIS_OK. WIS_NOT_BUILT as in wis_sample. Strides as in wis_sample; statuses are packed. Work: count x (lobes + log texels).
enum wis_status wis_invert(struct wis_sampler *sampler, const struct wis_environment *environment, const struct wis_product *product,
    size_t count, const float *wi, size_t wi_stride, float *u, size_t u_stride, uint8_t *status);
/** @} */

/** @defgroup points Random numbers
 *  Low-discrepancy points in the square. */ /** @{ */

/// Points `first` to `first + count - 1` (at most 2^32 - 1, else WIS_OVERFLOW) of an Owen-scrambled Sobol (0,2)-sequence: each aligned
/// block of 2^k points has one in every elementary interval of area 2^-k. Sequences of different seeds are independent, also of numbers in
/// a row: any that tells pixels and passes apart. No coordinate is exactly 0 or 1. `stride` in bytes from one point to the next; 0: packed.
/// Work: count.
enum wis_status wis_points_sobol(uint32_t seed, uint32_t first, size_t count, float *out, size_t stride);
/** @} */

#ifdef __cplusplus
}
#endif

#endif /* WIS_H */
