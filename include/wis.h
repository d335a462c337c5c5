/* SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * wis: product importance sampling of environment light x BRDF x cosine.
 * Generated from the Rust sources: edit those, then run `make header`.
 *
 * At a shading point the library draws directions wi distributed like L(wi) f(wo, wi) max(0, n.wi) and answers
 * their exact pdf. Radiance L, BRDF f and visibility of a sample are evaluated by the caller, who also owns the
 * memory, the threads and the random numbers.
 *
 * Order of work: wis_wavelet_light_size and _init once for a light; wis_wavelet_product_size once for a thread;
 * wis_wavelet_product_prepare at a shading point; then sample, pdf and invert as often as needed. Besides: picks from a pool
 * of candidates (wis_pool_*), a map as directional lights (wis_strata_*), low-discrepancy points (wis_points_*), and
 * wavelet trees of any function to sample from (wis_haar_*, wis_tree_*, wis_warp_*).
 *
 * Which sampler. For a lobe whose half-angle is at least 0.02 radians, with 16 samples or more at a point or where the
 * hits of a pixel share a product (reuse_cone): prepare a product. Else a pool; and where a single texel gives more than a
 * tenth of the light (a sun), a pool unless a product is shared. A half-angle is sqrt(alpha_x alpha_y) for GGX,
 * acos(2^(-1/(s+1))) for Phong of exponent s, pi/2 for Lambert; of several lobes that of the widest with at least a tenth
 * of the weight; a measured BRDF counts as wide. wis_pool_pick says how many candidates a pool needs. Where rays are dear,
 * draw the candidates from a product from 16 samples on: of equal numbers of samples that has the least error.
 *
 * Memory. Everything is built in memory that the caller gives and that a _size call measures beforehand, bytes and
 * alignment. What was built holds no pointer and has no free function: it may be copied, saved and mapped again.
 * Nothing allocates, prints or aborts, and there is no global state.
 *
 * Threads. An object is const once built, and any number of threads may share it. While it is being built, its
 * memory and scratch belong to that call alone.
 *
 * Failure. A call that can fail answers a wis_status. Unless that is WIS_OK, no handle and no result is written and
 * the memory of the object is undefined; the diagnostic, which may be null, says where the fault is: the argument, the
 * field of a struct, the element of an array. Other pointers must not be null unless their comment says so. Every call
 * answers WIS_NULL_POINTER, WIS_MISALIGNED, WIS_INVALID_STRUCT_SIZE, WIS_MISMATCH (a handle of something else) and
 * WIS_MEMORY_TOO_SMALL as wis_status describes them; comments of calls tell the other statuses.
 *
 * Structs. Where the first field is `size`, set it to sizeof the struct and every field that is not used to 0.
 *
 * Arguments stand in the order objects, config, count, inputs, outputs. A stride is the distance in bytes between
 * the first floats of neighbouring elements; 0: they stand close together. A stride shorter than an element is
 * WIS_INVALID_ARGUMENT, one that is no multiple of 4 WIS_MISALIGNED; the diagnostic then names the stride.
 *
 * Spaces and units. A direction is three floats x, y, z of unit length in world space and points away from the
 * surface: wo to the eye, wi to the light. A pdf is per solid angle, in 1/sr. Radiance is in the unit of the map.
 * A map's own axis is z; world_from_map is a row-major 3x3 rotation or reflection, null for the identity.
 *
 * Random numbers. A sample takes u in [0, 1)^2 and keeps its stratification. A u outside is clamped, NaN is 0.5.
 */

#ifndef WIS_H
#define WIS_H

#include <stddef.h>
#include <stdint.h>

/// The version of the library and of every stored object: major * 65536 + minor * 256 + patch.
#define WIS_VERSION 512

/// The alignment of every block of memory, in bytes: that of malloc on 64-bit platforms.
#define WIS_ALIGNMENT 16

/// Every cell is stored: 16 bytes for four cells, and a third more for the coarser levels. If the resolution is left
/// to the library and WIS_WAVELET_LIGHT_NEAREST is set, cells in which light varies much (a sun, the edge of a lamp) are
/// divided further, down to 16384 along each side: 24 bytes a square, in as much room as cells / 8 or 4096 squares take.
#define WIS_STORAGE_PYRAMID 1

/// A wavelet tree pruned to `error_budget`: 24 bytes for each square that is kept.
#define WIS_STORAGE_SPARSE 2

/// The client looks texels up without filtering: importance is not spread to neighbouring texels.
#define WIS_WAVELET_LIGHT_NEAREST 1

/// Black stays black, with density 0. Otherwise no cell is darker than 2^-16 of the mean.
#define WIS_WAVELET_LIGHT_EXACT_ZERO 2

/// The compensated distribution is stored too (Karlik et al. 2019): max(L - mean, L / 64). It takes as much room as the
/// luminance; in a pyramid whose resolution is left to the library it keeps, for clients without filter
/// (WIS_WAVELET_LIGHT_NEAREST), the texels instead, 6 to 8 bytes each, and is sampled and asked twice as fast.
#define WIS_WAVELET_LIGHT_COMPENSATED 4

/// RGB averages are stored too, for wis_wavelet_product_estimate_rgb: 48 bytes for four cells, and a third more.
#define WIS_WAVELET_LIGHT_RGB 8

/// Bad texels are replaced and counted instead of rejected: NaN, -Inf and negative channels by 0, a texel with
/// +Inf by the largest finite luminance of the map.
#define WIS_WAVELET_LIGHT_SANITISE 16

/// Proportional to luminance.
#define WIS_DISTRIBUTION_PLAIN 0

/// Proportional to the luminance above the mean: for multiple importance sampling with the BRDF.
#define WIS_DISTRIBUTION_COMPENSATED 1

/// Directions uniform over the solid angle of a stratum: the paper's jitter, biased in shadow where the light varies
/// inside the stratum.
#define WIS_JITTER_UNIFORM 0

/// Directions in proportion to the radiance of the texels: the light's `rgb` luminance x visibility is unbiased.
#define WIS_JITTER_ENERGY 1

/// Columns are the azimuth phi = 2 pi (x + 1/2) / width, rows the polar angle theta = pi (y + 1/2) / height from +z;
/// the direction is (sin theta cos phi, sin theta sin phi, cos theta).
#define WIS_LAYOUT_LATLONG 1

/// Six square faces below one another, +x -x +y -y +z -z, each as OpenGL orients it; height = 6 width.
#define WIS_LAYOUT_CUBE 2

/// The equal-area octahedral square (Clarberg 2008): +z in the centre, -z in the corners, columns along x, rows
/// along y; height = width.
#define WIS_LAYOUT_OCTAHEDRAL 3

/// 32-bit floats.
#define WIS_FORMAT_F32 1

/// 16-bit floats.
#define WIS_FORMAT_F16 2

/// You interpolate between texel centres along both axes. Lat-long maps wrap in azimuth and mirror over the poles, faces of a
/// cube and edges of an octahedral map join.
#define WIS_FILTER_BILINEAR 0

/// You take the texel that holds the direction.
#define WIS_FILTER_NEAREST 1

/// Lat-long only: the first and the last row of texels lie at the poles, so theta = pi y / (height - 1).
#define WIS_ENVIRONMENT_ROWS_AT_POLES 1

/// Black texels get pdf 0. Otherwise no texel counts as darker than 2^-16 of the mean, and every direction has a pdf above 0.
#define WIS_ENVIRONMENT_EXACT_ZERO 2

/// The distribution is compensated (Karlik et al. 2019): proportional to max(L - mean, L / 64) instead of L. For multiple
/// importance sampling with BRDF samples.
#define WIS_ENVIRONMENT_COMPENSATED 4

/// Bad texels are replaced and counted instead of rejected: NaN, -Inf and negative channels by 0, a texel with
/// +Inf by the largest finite luminance of the map.
#define WIS_ENVIRONMENT_SANITISE 8

/// Lobes of a material.
#define WIS_MAX_LOBES 4

/// Diffuse reflection: `weight / pi` on the side of wo.
#define WIS_LOBE_LAMBERT 1

/// Trowbridge-Reitz (GGX) microfacets: `weight F D G / (4 cos cos)`, height-correlated Smith shadowing, Schlick's Fresnel term.
#define WIS_LOBE_GGX 2

/// `weight (a + 2) / (2 pi) max(0, r.wi)^a` with r the mirror direction of wo.
#define WIS_LOBE_PHONG 3

/// Transmission through GGX microfacets (Walter et al. 2007, Eq. 21): `weight (1 - F)` times D, G and the Jacobian for `eta`.
#define WIS_LOBE_GGX_TRANSMISSION 5

/// Diffuse transmission: `weight / pi` on the side opposite to wo.
#define WIS_LOBE_LAMBERT_TRANSMISSION 6

/// Directions on both sides of the surface count, with |n.wi| for the cosine. Implied by a lobe that transmits.
#define WIS_POINT_WHOLE_SPHERE 1

/// The client's BRDF already contains the cosine, and so do the lobes: it is not multiplied again.
#define WIS_POINT_COSINE_INCLUDED 2

/// The most candidates of one pool.
#define WIS_MAX_CANDIDATES (1 << 24)

/// The most squares that a configuration may ask for.
#define WIS_MAX_SQUARES 4096

/// Detect the instructions of this processor.
#define WIS_CPU_DETECT 0

/// Instructions that every processor of the platform has.
#define WIS_CPU_BASELINE 1

/// x86-64 with AVX2.
#define WIS_CPU_AVX2 2

/// Rays of one point at the most, in a wave.
#define WIS_WAVE_RAYS 64

/// A lobe `weight / pi`.
#define WIS_WAVELET_LOBE_LAMBERT 1

/// A lobe of Trowbridge-Reitz (GGX) microfacets: `weight F D G / (4 cos cos)` with height-correlated Smith shadowing
/// and Schlick's Fresnel term.
#define WIS_WAVELET_LOBE_GGX 2

/// A lobe `weight (a + 2) / (2 pi) max(0, r.wi)^a` with r the mirror direction of wo.
#define WIS_WAVELET_LOBE_PHONG 3

/// A lobe `weight` times the table that is given with the query (wis_wavelet_product_prepare_table, wis_wavelet_table_eval).
#define WIS_WAVELET_LOBE_TABLE 4

/// Query flag: wi may lie on either side of the surface; the cosine is |n.wi|.
#define WIS_WAVELET_QUERY_WHOLE_SPHERE 1

/// Query flag: the values already contain the cosine: it is not multiplied again.
#define WIS_WAVELET_QUERY_COSINE_INCLUDED 2

/// Lobes in a query.
#define WIS_WAVELET_MAX_LOBES 4

/// The most slices of a table.
#define WIS_MAX_SLICES 256

/// Cells of a prior.
#define WIS_PRIOR_CELLS 64

/// The most cells along an axis.
#define WIS_MAX_GRID 4096

/// The most trees or approximations that are blended at once: quadrilinear interpolation has 16.
#define WIS_MAX_BLEND 16

/// The most places along an axis of a pixel.
#define WIS_MAX_PLACES 16

/// The answer of every call that can fail.
typedef enum wis_status {
  /// The call did what was asked.
  WIS_OK = 0,
  /// A pointer that must not be null is null.
  WIS_NULL_POINTER = 1,
  /// A value is outside the range that its comment states, or a stride is shorter than an element.
  WIS_INVALID_ARGUMENT = 2,
  /// The first field of a struct is not the size of that struct: it was not set, or the header is of another version.
  WIS_INVALID_STRUCT_SIZE = 3,
  /// The memory is shorter than the size query said.
  WIS_MEMORY_TOO_SMALL = 4,
  /// A pointer or a stride is not a multiple of the alignment of what it points to: 16 for blocks, 4 for floats, 2 for
  /// 16-bit floats.
  WIS_MISALIGNED = 5,
  /// Sizes that were asked for overflow, or exceed what the format can address; or a result is beyond a double, or beyond a
  /// float where it is stored as one.
  WIS_OVERFLOW = 6,
  /// A texel is NaN, infinite or negative, and the policy is to reject it.
  WIS_INVALID_TEXEL = 7,
  /// A matrix is not a rotation or reflection within 1e-4, a direction is not of unit length within 1e-3, or the tangent
  /// that an anisotropic lobe needs is 0 or parallel to the normal.
  WIS_INVALID_TRANSFORM = 8,
  /// The product was prepared with another environment, or the memory does not hold such an object.
  WIS_MISMATCH = 9,
  /// The bytes are not an object that this version wrote, or they were changed.
  WIS_CORRUPT = 10,
  /// The density of that direction is 0: no u leads there.
  WIS_ZERO_DENSITY = 11,
  /// A callback failed or returned a value that is NaN, infinite or negative.
  WIS_CALLBACK_FAILED = 12,
  /// The object was not built, or built without what the call needs (RGB, the compensated distribution).
  WIS_NOT_BUILT = 13,
} wis_status;

/// An environment: bytes in your memory without pointers, so it may be copied (to any block aligned to
/// WIS_ALIGNMENT), saved and mapped. Constant once built; any number of threads may use it at once. Nothing to free.
typedef struct wis_wavelet_light wis_wavelet_light;

/// An environment map as a distribution of directions: bytes in your memory without pointers, so it may be copied (to any block
/// aligned to WIS_ALIGNMENT), saved and mapped. Constant once built, but for wis_environment_turn; any number of threads may
/// use it at once. Nothing to free.
typedef struct wis_environment wis_environment;

/// A Haar function of one variable: `2^(level/2) phi(2^level x - translation)`, or the wavelet psi in place of phi.
/// psi is 1 on the lower and -1 on the upper half.
typedef struct wis_function wis_function;

/// The texels of every stratum, to place samples inside: bytes in your memory without pointers. Constant once built; any
/// number of threads may use it at once. Nothing to free.
typedef struct wis_jitter wis_jitter;

/// A prepared shading point: bytes in your memory without pointers, so it may be copied (to any block aligned to
/// WIS_ALIGNMENT) and kept. Constant once prepared; any number of threads may use it at once. Every call on it also
/// takes the environment that it was prepared with. The same environment, query and configuration give the same
/// bytes. Nothing to free.
typedef struct wis_wavelet_product wis_wavelet_product;

/// One thread's working memory: bytes in your memory without pointers to it. Nothing to free. One thread at a time may use it.
typedef struct wis_sampler wis_sampler;

/// The tree of a function: bytes in your memory without pointers, so it may be copied (to any block aligned to
/// WIS_ALIGNMENT), saved and mapped. Constant once built; any number of threads may use it at once. Nothing to free.
typedef struct wis_tree wis_tree;

/// A map of visibility in 8 bits: bytes in your memory without pointers, so it may be copied (to any block aligned to
/// WIS_ALIGNMENT), saved and mapped. A third of the tree that it was made of. Constant; any number of threads may use it at
/// once. Nothing to free.
typedef struct wis_visibility wis_visibility;

/// The shape of a lobe.
typedef struct wis_lobe {
  /// WIS_LOBE_*.
  uint32_t kind;
  /// GGX: alpha along the tangent, 1e-5 to 16. Phong: the exponent, 0 to 1e7. Others: not read.
  float a;
  /// GGX: alpha along the bitangent, 1e-5 to 16. Others: not read.
  float b;
  /// GGX transmission: refractive index beyond the surface over that on the side of wo, 0.1 to 10, not within 1e-3 of 1.
  /// Others: not read.
  float eta;
} wis_lobe;

/// The shapes of a material's lobes. Plain and copyable: fill `size`, `lobe_count` and `lobe`, then call wis_material_init once.
typedef struct wis_material {
  /// sizeof(wis_material).
  uint32_t size;
  /// Lobes used, 0 to 4. Without lobes a point reflects alike in all directions.
  uint32_t lobe_count;
  /// The lobes, of which the first lobe_count are read.
  struct wis_lobe lobe[WIS_MAX_LOBES];
  /// Written by wis_material_init: tells materials apart by their content.
  uint64_t hash;
} wis_material;

/// A shading point in world space. Plain and copyable.
typedef struct wis_point {
  /// sizeof(wis_point).
  uint32_t size;
  /// WIS_POINT_*, or 0: the upper hemisphere of the normal.
  uint32_t flags;
  /// The material, after wis_material_init. Null: no lobes. Read during calls only.
  const struct wis_material *material;
  /// The shading normal, unit length.
  float normal[3];
  /// The direction of alpha `a`; need not be exactly normal to the normal. All 0: any, if no lobe is anisotropic.
  float tangent[3];
  /// The direction to the viewer, unit length.
  float wo[3];
  /// Linear RGB factor of each lobe at this hit, finite and not negative. Textures go here.
  float weight[WIS_MAX_LOBES][3];
  /// GGX: reflectance at normal incidence of each lobe, RGB in [0, 1]. Others: not read.
  float f0[WIS_MAX_LOBES][3];
  /// The pixel: any number, another one for each pixel.
  uint32_t seed;
  /// The number of this hit among all hits of the pixel and the stream, over all passes: 0, 1, 2 ...
  uint32_t turn;
  /// The bounce: 0 for camera hits, 1 for the next ...
  uint32_t stream;
  /// Always 0.
  uint32_t reserved;
} wis_point;

/// A direction to trace, and what the light that comes from it counts.
typedef struct wis_ray {
  /// The direction towards the light, unit length, world space.
  float wi[3];
  /// What f x cosine x L x V is multiplied by.
  float weight;
} wis_ray;

/// Gives row `y` in the format of the configuration. The bytes must stay as they are until the next call on the same
/// thread. Null stops the build with WIS_CALLBACK_FAILED.
typedef const void *(*wis_row_fn)(void *user, uint32_t y);

/// What to build.
typedef struct wis_wavelet_light_config {
  /// sizeof(wis_wavelet_light_config).
  uint32_t size;
  /// WIS_LAYOUT_*.
  uint32_t layout;
  /// Texels in a row, at least 1; any number, also odd.
  uint32_t width;
  /// Rows, at least 1; of a cube map all six faces.
  uint32_t height;
  /// 1 (luminance), 3 (RGB) or 4 (RGB and an alpha that is ignored); linear Rec. 709 radiance.
  uint32_t channels;
  /// WIS_FORMAT_*.
  uint32_t format;
  /// WIS_WAVELET_LIGHT_*, or 0.
  uint32_t flags;
  /// WIS_STORAGE_*.
  uint32_t storage;
  /// Cells along each side of the octahedral square, a power of two from 1 to 4096; 0: at least as many cells
  /// as texels, and of a pyramid for clients without filter finer ones where light varies within them.
  uint32_t resolution;
  /// Sparse storage: the variance that pruning may add to an estimate of the map's power, relative to its square,
  /// 0 or more (0.01 = 1 %); 0 drops nothing but constant squares.
  float error_budget;
  /// The first texel of row 0, or null if `row` gives the rows. Aligned to its format, 4 or 2 bytes; the rows of `row` need
  /// no alignment.
  const void *pixels;
  /// Bytes from a row to the next, may be negative: a multiple of the bytes of a channel, at least a row. 0: rows stand
  /// close together.
  ptrdiff_t row_stride;
  /// Used if `pixels` is null; called from each thread that runs the first pass.
  wis_row_fn row;
  /// Handed to `row`.
  void *row_user;
} wis_wavelet_light_config;

/// How much memory an object needs. Both blocks are the caller's.
typedef struct wis_memory_size {
  /// Bytes of the object.
  size_t bytes;
  /// Alignment of both blocks, in bytes.
  size_t align;
  /// Bytes that only the build needs; may be freed afterwards.
  size_t scratch_bytes;
} wis_memory_size;

/// Where the fault is. Written only on failure, and only if the caller gives one.
typedef struct wis_diagnostic {
  /// The position of the argument at fault, 1 = first; 0: none in particular.
  uint32_t argument;
  /// WIS_INVALID_TEXEL: the column of the texel. wis_triple_blend: the number of the wavelet in its list, 0 = first.
  uint32_t x;
  /// The number of the element at fault in an array, 0 = first: the row of a texel, the query of wis_wavelet_products_prepare, a
  /// tree, a list, a wavelet, a weight, a label. 0 where the argument is no array.
  uint32_t y;
  /// Always 0.
  uint32_t reserved;
  /// WIS_MEMORY_TOO_SMALL: the bytes that are needed.
  uint64_t bytes_needed;
  /// The field at fault of the struct that the argument points to, as "normal" or "lobe[1].b": a static string. Null if
  /// the argument is no struct, or no field in particular is at fault.
  const char *field;
} wis_diagnostic;

/// What was built.
typedef struct wis_wavelet_light_info {
  /// sizeof(wis_wavelet_light_info), set by the caller.
  uint32_t size;
  /// Cells along each side of the square.
  uint32_t resolution;
  /// WIS_STORAGE_*.
  uint32_t storage;
  /// WIS_WAVELET_LIGHT_*.
  uint32_t flags;
  /// Bytes of the environment: that much of the block is in use and needs to be saved.
  uint64_t bytes;
  /// Squares stored, each the averages of four children.
  uint64_t squares;
  /// Texels that were replaced.
  uint64_t sanitised;
  /// Tells environments apart: a hash of the bytes.
  uint64_t content_id;
  /// The integral of luminance over the sphere, in the units of the map times steradian.
  double power;
  /// Sparse storage: the variance that pruning added, relative.
  double error;
} wis_wavelet_light_info;

/// A direction in world space and its pdf per solid angle; a pdf of 0 means that there is no sample.
typedef struct wis_drawn {
  /// The direction towards the light, unit length, world space.
  float wi[3];
  /// The probability density per solid angle; 0: no sample.
  float pdf;
} wis_drawn;

/// The map, and what to build from it.
typedef struct wis_environment_config {
  /// sizeof(wis_environment_config).
  uint32_t size;
  /// WIS_LAYOUT_*.
  uint32_t layout;
  /// Texels in a row, 1 to 32768; any number, also odd.
  uint32_t width;
  /// Rows, 1 to 32768; of a cube map all six faces.
  uint32_t height;
  /// 1 (luminance), 3 (RGB) or 4 (RGB and an alpha that is ignored); linear Rec. 709 radiance.
  uint32_t channels;
  /// WIS_FORMAT_*.
  uint32_t format;
  /// WIS_FILTER_*: how you look the map up.
  uint32_t filter;
  /// WIS_ENVIRONMENT_*, or 0.
  uint32_t flags;
  /// The relative standard deviation of radiance / pdf that coarser tables may add, 0 to 1. 0 keeps every texel. 0.01 makes a
  /// smooth sky take kilobytes.
  float error_budget;
  /// The first texel of row 0, or null if `row` gives the rows. Aligned to its format, 4 or 2 bytes; the rows of `row` need
  /// no alignment.
  const void *pixels;
  /// Bytes from a row to the next, may be negative: a multiple of the bytes of a channel, at least a row. 0: rows stand
  /// close together.
  ptrdiff_t row_stride;
  /// Used if `pixels` is null; called from each thread that runs the first pass.
  wis_row_fn row;
  /// Handed to `row`.
  void *row_user;
  /// A row-major 3x3 rotation or reflection, world = M map, within 1e-4; null is the identity. Copied.
  const float *world_from_map;
} wis_environment_config;

/// What was built.
typedef struct wis_environment_info {
  /// sizeof(wis_environment_info), set by the caller.
  uint32_t size;
  /// WIS_LAYOUT_*.
  uint32_t layout;
  /// Texels in a row.
  uint32_t width;
  /// Rows.
  uint32_t height;
  /// WIS_FILTER_*.
  uint32_t filter;
  /// WIS_ENVIRONMENT_*, but for WIS_ENVIRONMENT_SANITISE.
  uint32_t flags;
  /// Bytes of the environment: that much of the block is in use and needs to be saved.
  uint64_t bytes;
  /// Texels that were replaced.
  uint64_t sanitised;
  /// Tells environments apart: a hash of the bytes, also of world_from_map.
  uint64_t content_id;
  /// The integral of what the pdf is proportional to over the sphere: of luminance (of what compensation leaves of it), in the
  /// unit of the map times steradian.
  double power;
  /// The mean luminance over the sphere, in the unit of the map.
  double mean;
  /// The share of the light that the brightest texel gives, 0 to 1.
  double largest_share;
  /// The relative standard deviation of radiance / pdf that the error budget added.
  double error;
} wis_environment_info;

/// A candidate and how often it was picked.
typedef struct wis_pick {
  /// The number of the candidate, from 0.
  uint32_t candidate;
  /// How many of the picks it stands for, at least 1.
  uint32_t multiplicity;
} wis_pick;

/// Rays that were traced from some place, cell by cell; all 0 before the first. Plain and copyable.
typedef struct wis_prior {
  /// sizeof(wis_prior).
  uint32_t size;
  /// Always 0.
  uint32_t reserved;
  /// Rays that reached the light, at most as many as were traced.
  uint32_t visible[WIS_PRIOR_CELLS];
  /// Rays that were traced.
  uint32_t traced[WIS_PRIOR_CELLS];
} wis_prior;

/// One lobe of a BRDF.
typedef struct wis_wavelet_lobe {
  /// WIS_WAVELET_LOBE_LAMBERT, WIS_WAVELET_LOBE_GGX, WIS_WAVELET_LOBE_PHONG or WIS_WAVELET_LOBE_TABLE.
  uint32_t kind;
  /// Linear RGB factor, finite and not negative.
  float weight[3];
  /// GGX: reflectance at normal incidence, RGB in [0, 1]. Others: not read.
  float f0[3];
  /// GGX: alpha along the tangent, 1e-5 to 16. Phong: the exponent, 0 to 1e7. Others: not read.
  float a;
  /// GGX: alpha along the bitangent, 1e-5 to 16; equal to `a` for an isotropic lobe, never 0. Others: not read.
  float b;
} wis_wavelet_lobe;

/// A shading point: everything that the product needs to know of it. World space; plain and copyable.
typedef struct wis_wavelet_query {
  /// sizeof(wis_wavelet_query).
  uint32_t size;
  /// WIS_WAVELET_QUERY_* flags, or 0: the upper hemisphere of the normal, the cosine not contained.
  uint32_t flags;
  /// Lobes used, 0 to 4; with 0 there is nothing to sample.
  uint32_t lobe_count;
  /// The shading normal, unit length.
  float normal[3];
  /// The direction of alpha `a`; need not be exactly normal to the normal. All 0, or along the normal: any, if no lobe is
  /// anisotropic; else WIS_INVALID_TRANSFORM.
  float tangent[3];
  /// The direction to the viewer, unit length.
  float wo[3];
  /// The lobes, of which the first lobe_count are read.
  struct wis_wavelet_lobe lobe[WIS_WAVELET_MAX_LOBES];
} wis_wavelet_query;

/// What a preparation may spend, and how the map is turned.
typedef struct wis_wavelet_product_config {
  /// sizeof(wis_wavelet_product_config).
  uint32_t size;
  /// What wis_cpu_detect answered, or 0 for the baseline of the platform; anything else is WIS_INVALID_ARGUMENT. Never
  /// changes a bit of the results.
  uint32_t cpu_level;
  /// Inner nodes of the product's tree, 1 to WIS_MAX_SQUARES; 0: 128. Bounds memory and time.
  uint32_t max_squares;
  /// BRDF evaluations besides those of the 64 squares at most that narrow lobes ask for; 0: 66 for Lambert's lobes alone,
  /// 146 with a table or for a callback with a peak, else 106. At least 66 are spent.
  uint32_t max_evaluations;
  /// A row-major 3x3 rotation or reflection, world = M map, within 1e-4; null is the identity. Read during the call.
  const float *world_from_map;
  /// Radians, 0 to pi/2: the product may also serve hits of the same lobes whose normals lie within this angle of the
  /// query's (wis_wavelet_product_covers). Cosines and horizon are widened by it, so the pdf stays above 0 for all of them;
  /// what the product estimates is then widened too. Hits outside are best given another product; narrow lobes sample
  /// better with a small cone (.05). 0: this normal only.
  float reuse_cone;
  /// What other pixels saw about here, as a factor of the density (wis_prior_count says when that is unbiased); null:
  /// none. The estimates stay those without visibility. Read during the call.
  const struct wis_prior *prior;
} wis_wavelet_product_config;

/// Evaluates the luminance of BRDF x cosine (at least 0, finite) for `count` world directions, three floats each. Where the
/// BRDF is 0 outside a hemisphere, and not narrow, directions outside are asked for as their mirror images inside.
/// Returns 0; anything else stops the preparation with WIS_CALLBACK_FAILED.
typedef int (*wis_brdf_batch_fn)(void *user, size_t count, const float *wi, float *f_cos);

/// A BRDF that the client evaluates. It is called only while the product is prepared.
typedef struct wis_wavelet_callback {
  /// sizeof(wis_wavelet_callback).
  uint32_t size;
  /// WIS_WAVELET_QUERY_WHOLE_SPHERE, or 0: the BRDF is 0 outside the upper hemisphere of the normal.
  uint32_t flags;
  /// The shading normal, unit length.
  float normal[3];
  /// The direction about which a narrow lobe is concentrated, unit length. Read if half_angle is above 0.
  float peak[3];
  /// The half-angle of that lobe in radians, 0 to pi/2; 0: no narrow lobe.
  float half_angle;
  /// The BRDF.
  wis_brdf_batch_fn eval;
  /// Handed to `eval`.
  void *user;
} wis_wavelet_callback;

/// What a prepared product is made of.
typedef struct wis_wavelet_product_info {
  /// sizeof(wis_wavelet_product_info), set by the caller.
  uint32_t size;
  /// Inner nodes.
  uint32_t squares;
  /// Leaves.
  uint32_t leaves;
  /// BRDF evaluations that the preparation spent.
  uint32_t evaluations;
  /// Bytes in use: that much of the block is the product.
  uint64_t bytes;
  /// The content id of the environment.
  uint64_t environment;
} wis_wavelet_product_info;

/// What a sampler is made for. Zeros are good choices.
typedef struct wis_sampler_config {
  /// sizeof(wis_sampler_config).
  uint32_t size;
  /// WIS_CPU_*. Never changes a bit of the results. WIS_INVALID_ARGUMENT for a level that this processor lacks.
  uint32_t cpu_level;
  /// The most rays of one call, 1 to 4096; 0: 16.
  uint32_t rays;
  /// Candidates for each ray, 1 to 256; 0: the library's choice.
  uint32_t candidates_per_ray;
  /// Hits of one pixel between two calls of wis_sampler_begin_pixel; 0: not known.
  uint32_t hits_per_pixel;
  /// Always 0.
  uint32_t reserved;
} wis_sampler_config;

/// How to cut a map into strata. Zeros stand for the paper's choices.
typedef struct wis_strata_config {
  /// sizeof(wis_strata_config).
  uint32_t size;
  /// Lights to place; there may be more where many small bright regions are each worth a light.
  uint32_t count;
  /// Layers of brightness, cut at multiples of the map's standard deviation, at most 64; 0: 6.
  uint32_t levels;
  /// The solid angle in sr from which on the size of a region does not count; 0: 0.01.
  float angle_limit;
  /// A row-major 3x3 rotation or reflection, world = M map, within 1e-4; null is the identity.
  const float *world_from_map;
  /// Two exponents, at least 0 and at most 8, of radiance and of solid angle: how much a region counts. (1, 0) is
  /// importance sampling of the light, (0, 1) with an `angle_limit` of 4 pi stratifies the sphere; null: 1 and 1/4.
  const float *exponents;
} wis_strata_config;

/// A stratum as a directional light.
typedef struct wis_light {
  /// The direction towards the light: the centre of the stratum, unit length, world space.
  float direction[3];
  /// Radiance x solid angle, summed over the stratum: the irradiance on a surface that faces the light.
  float rgb[3];
  /// The luminance of `rgb`.
  float luminance;
  /// The solid angle of the stratum.
  float solid_angle;
  /// The largest angle from the centre to a texel's centre in the stratum, in radians.
  float extent;
} wis_light;

/// An isotropic BRDF x cosine as trees that you built and that stay yours: slice k is its luminance for the view whose
/// angle to the normal is `(k + 1/2) / slice_count` of a right angle, over the octahedral square about the mirror
/// direction (wis_wavelet_table_directions). Other views blend the two slices beside them (Clarberg et al. 2005, Section 5).
/// Directions are sampled by luminance; colours, if there are any, are what wis_wavelet_table_eval tells.
typedef struct wis_wavelet_table {
  /// sizeof(wis_wavelet_table).
  uint32_t size;
  /// Slices, 1 to WIS_MAX_SLICES; the paper has 16 and 32.
  uint32_t slice_count;
  /// The slices, trees of two axes (else WIS_INVALID_ARGUMENT) whose averages are floats (else WIS_OVERFLOW). Null for a
  /// slice that was not built: the other one beside the view then stands in, and without both the answer is WIS_NOT_BUILT.
  const struct wis_tree *const *slice;
  /// As `slice`, red, green and blue; three nulls: the table is grey, as its luminance says.
  const struct wis_tree *const *colour[3];
} wis_wavelet_table;

/// What to build.
typedef struct wis_tree_config {
  /// sizeof(wis_tree_config).
  uint32_t size;
  /// Axes n, 1 to 4.
  uint32_t dimensions;
  /// The grid has 2^depth pixels along each axis; 0 to 12.
  uint32_t depth;
  /// The variance that pruning may add to an estimate of the integral, relative to its square, 0 or more (0.01 =
  /// 1 %); 0 drops nothing but constant squares.
  float error_budget;
  /// 2^(n depth) values, C order: axis 1 slowest, the last axis fastest. Finite, 0 or more.
  const float *pixels;
} wis_tree_config;

/// What was built.
typedef struct wis_tree_info {
  /// sizeof(wis_tree_info), set by the caller.
  uint32_t size;
  /// Axes.
  uint32_t dimensions;
  /// The grid has 2^depth pixels along each axis.
  uint32_t depth;
  /// Squares stored, each the averages of 2^n children.
  uint32_t squares;
  /// Bytes of the tree: that much of the block is in use and needs to be saved.
  uint64_t bytes;
  /// Tells trees apart: a hash of the bytes.
  uint64_t content_id;
  /// The average of the function.
  double average;
  /// The variance that pruning added, relative.
  double error;
} wis_tree_info;

/// How to rotate a map.
typedef struct wis_rotated_config {
  /// sizeof(wis_rotated_config).
  uint32_t size;
  /// The tree has 2^depth pixels along each axis; 0 to 12. The paper has 6 and 7.
  uint32_t depth;
  /// Each pixel is the mean of places x places, 1 to WIS_MAX_PLACES, each of a cell of the map about as large as what it
  /// stands for; 2 is a good start.
  uint32_t places;
  /// As wis_tree_config.
  float error_budget;
  /// The share of the map's mean that is added to each pixel, 0 to 1e6: what keeps the pdf above 0 wherever there is light.
  float least;
  /// Nine numbers, row by row: world = M map, within 1e-4 of a rotation or reflection; null is the identity.
  const float *world_from_map;
  /// The same from the frame of the tree: the direction about which the map is rotated is its third column. Null is the
  /// identity.
  const float *world_from_tree;
} wis_rotated_config;

/// The wavelets of a square of n axes that a set keeps.
typedef struct wis_details {
  /// The Morton code of the square's first pixel among 4096 along each axis: n bits a level, axis 1 the highest of each n.
  uint64_t position;
  /// The square has the width 2^-level.
  uint32_t level;
  /// Not read; 0 where the library writes.
  uint32_t reserved;
  /// Detail f, 1 to 2^n - 1, in value space: 2^(n level / 2) times the orthonormal coefficient of the wavelet that varies
  /// along the axes whose bits are set in f, axis 1 the highest of n. Others are not read; 0 where the library writes.
  float detail[16];
} wis_details;

/// The wavelets of a square that an approximation keeps. Approximations are lists of these, depth first: by position,
/// and squares before those inside them.
typedef struct wis_wavelets {
  /// The Morton code of the square's first pixel among 4096 x 4096 (axis 1 in the higher bit of each pair).
  uint32_t position;
  /// The square has the width 2^-level.
  uint32_t level;
  /// The details 1 (axis 2), 2 (axis 1) and 3 (both) in value space, 2^level times the orthonormal coefficients; 0 for
  /// those that were dropped.
  float detail[3];
} wis_wavelets;

/// A non-standard Haar function of n variables: the product of functions of one level.
typedef struct wis_basis_function {
  /// The support is a cube of the width 2^-level, at most 31.
  uint32_t level;
  /// Where it stands among 2^level along each axis; axes beyond the dimensions are not read.
  uint32_t translation[4];
  /// psi instead of phi: bit n - 1 along axis 1, and so on to bit 0 along axis n.
  uint32_t wavelet;
} wis_basis_function;

/// A whole number of each point.
typedef struct wis_ints_in {
  /// The number of point 0; null where that is allowed.
  const uint32_t *first;
  /// Bytes from a point to the next; 0: all points share it.
  ptrdiff_t point;
} wis_ints_in;

/// Numbers of all points: number `k` of point `i` stands `i * point + k * number` bytes behind `first`.
/// Array of structures: point = sizeof the structure, number = 4. Structure of arrays: point = 4, number = bytes of a column.
typedef struct wis_floats_in {
  /// The first number of point 0; null where that is allowed.
  const float *first;
  /// Bytes from a point to the next; 0: all points share these numbers.
  ptrdiff_t point;
  /// Bytes from a number to the next; 0: they stand close together.
  ptrdiff_t number;
} wis_floats_in;

/// As wis_floats_in, for numbers that are written. `point` must not be 0.
typedef struct wis_floats_out {
  /// The first number of point 0.
  float *first;
  /// Bytes from a point to the next.
  ptrdiff_t point;
  /// Bytes from a number to the next; 0: they stand close together.
  ptrdiff_t number;
} wis_floats_out;

/// The points of a wave, and where their rays go.
typedef struct wis_wave {
  /// sizeof(wis_wave).
  uint32_t size;
  /// WIS_POINT_* of all points.
  uint32_t flags;
  /// How many materials there are.
  uint32_t material_count;
  /// The most rays for each point, at most as many as the sampler was made for.
  uint32_t rays;
  /// The materials, each after wis_material_init.
  const struct wis_material *materials;
  /// The material of each point, below material_count. Null: material 0.
  struct wis_ints_in material;
  /// Points whose byte is 0 are left out: their count is 0 and nothing else of them is read. Null: none.
  const uint8_t *mask;
  /// Three numbers each: the shading normal.
  struct wis_floats_in normal;
  /// Three numbers each; null: any, if no lobe is anisotropic.
  struct wis_floats_in tangent;
  /// Three numbers each: the direction to the viewer.
  struct wis_floats_in wo;
  /// Three numbers for each lobe, lobe after lobe: RGB factors. Null: 1.
  struct wis_floats_in weight;
  /// Three numbers for each lobe, lobe after lobe: reflectance at normal incidence. Null: 0.
  struct wis_floats_in f0;
  /// The pixel of each point; wis_sampler_begin_pixel is called where it changes.
  struct wis_ints_in seed;
  /// The number of the hit of each point among all hits of its pixel and stream; null: 0.
  struct wis_ints_in turn;
  /// The bounce of each point; null: 0.
  struct wis_ints_in stream;
  /// Four numbers for each ray, ray after ray: direction and weight.
  struct wis_floats_out ray;
  /// How many rays each point has.
  uint32_t *count;
  /// A wis_status for each point, as a byte: a bad point never fails the others. May be null.
  uint8_t *status;
} wis_wave;



#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/// A sentence for a log; a static string, also for a value that is not a status.
const char *wis_status_string(uint32_t status);

/// The best instructions that this processor and the library have: a number to hand to preparations (wis_wavelet_product_config)
/// and to the calls that end in _lanes. 0 is the baseline of the platform; other numbers mean nothing to count with. The
/// calls answer WIS_INVALID_ARGUMENT to a number that this function answers on no processor. Keep the number as long as the
/// process, not in a file: another machine may lack the instructions, which wis_wavelet_product_size finds and later calls do not.
/// Takes about 20 us in a virtual machine: call it once.
uint32_t wis_cpu_detect(void);

/// WIS_VERSION of the library that is linked.
uint32_t wis_version(void);

/// The rays to trace at a hit, each with a weight. For each, evaluate your BRDF, the radiance and the visibility, and add
/// `weight f(wo, wi) |cos| L(wi) V(wi)`: the sum is an unbiased estimate of the reflected light of the environment, for any BRDF
/// and radiance that vanish outside the point's hemisphere and where the built light is 0.
///
/// `rays`: at most as many as the sampler was made for (WIS_INVALID_ARGUMENT); `count` tells how many there are, between 0 (no
/// light) and `rays`. `u`: null. It takes about 30 ns for each candidate, of which a single ray has 16.
enum wis_status wis_direct(struct wis_sampler *sampler,
                           const struct wis_environment *environment_object,
                           const struct wis_point *shading_point,
                           uint32_t rays,
                           const float *u,
                           struct wis_ray *ray,
                           uint32_t *count);

/// The bytes that an environment needs: exactly for a pyramid of a stated resolution, at most for sparse storage and
/// for a pyramid whose cells may be divided further (the bytes that are in use stand in wis_wavelet_light_info; a block that is too short fails with WIS_MEMORY_TOO_SMALL and tells them, and
/// wis_wavelet_light_finish may then be called again).
enum wis_status wis_wavelet_light_size(const struct wis_wavelet_light_config *config,
                                       struct wis_memory_size *size,
                                       struct wis_diagnostic *diagnostic);

/// Builds an environment in one call. `info` may be null.
enum wis_status wis_wavelet_light_init(const struct wis_wavelet_light_config *config,
                                       void *memory,
                                       size_t bytes,
                                       void *scratch,
                                       size_t scratch_bytes,
                                       const struct wis_wavelet_light **environment,
                                       struct wis_wavelet_light_info *info,
                                       struct wis_diagnostic *diagnostic);

/// Begins a build that threads share: for each of the two passes `p`, the rows `0..rows[p]` go to
/// wis_wavelet_light_run in any portions, on any threads; all of pass 0 before any of pass 1. The bits do not depend on
/// how the rows were shared.
enum wis_status wis_wavelet_light_begin(const struct wis_wavelet_light_config *config,
                                        void *scratch,
                                        size_t scratch_bytes,
                                        uint32_t rows[2],
                                        struct wis_diagnostic *diagnostic);

/// Works on `count` rows of a pass (0 or 1) from row `first` on. The configuration must be that of
/// wis_wavelet_light_begin. Threads may call this at once for different rows. WIS_MISMATCH if the second pass comes
/// before the first is done.
enum wis_status wis_wavelet_light_run(const struct wis_wavelet_light_config *config,
                                      void *scratch,
                                      size_t scratch_bytes,
                                      uint32_t pass,
                                      uint32_t first,
                                      uint32_t count,
                                      struct wis_diagnostic *diagnostic);

/// Ends a build when both passes are done (WIS_MISMATCH before). `info` may be null.
enum wis_status wis_wavelet_light_finish(const struct wis_wavelet_light_config *config,
                                         void *memory,
                                         size_t bytes,
                                         void *scratch,
                                         size_t scratch_bytes,
                                         const struct wis_wavelet_light **environment,
                                         struct wis_wavelet_light_info *info,
                                         struct wis_diagnostic *diagnostic);

/// Checks bytes that an earlier build wrote (copied, or mapped from a file) and gives them as an environment. Reads
/// all of them once. `info` may be null.
enum wis_status wis_wavelet_light_open(const void *memory,
                                       size_t bytes,
                                       const struct wis_wavelet_light **environment,
                                       struct wis_wavelet_light_info *info,
                                       struct wis_diagnostic *diagnostic);

/// The integral of a distribution over the sphere, in the units of the map times steradian: of luminance, or of what
/// compensation leaves of it. Its radiance over this power is the pdf of a direction, up to the size of a cell.
enum wis_status wis_wavelet_light_power(const struct wis_wavelet_light *environment,
                                        uint32_t distribution,
                                        double *power);

/// Samples a direction in proportion to the light alone. `u`: two numbers in [0, 1) (others are moved there, NaN
/// counts as 1/2). `world_from_map`: a row-major 3x3 rotation or reflection, within 1e-4; null is the identity. A
/// black environment gives pdf 0.
enum wis_status wis_wavelet_light_sample(const struct wis_wavelet_light *environment,
                                         uint32_t distribution,
                                         const float world_from_map[9],
                                         const float u[2],
                                         struct wis_drawn *sample);

/// As `count` calls of wis_wavelet_light_sample. Strides are in bytes from one element to the next; 0: packed.
enum wis_status wis_wavelet_light_sample_n(const struct wis_wavelet_light *environment,
                                           uint32_t distribution,
                                           const float world_from_map[9],
                                           size_t count,
                                           const float *u,
                                           size_t u_stride,
                                           float *wi,
                                           size_t wi_stride,
                                           float *pdf,
                                           size_t pdf_stride);

/// As wis_wavelet_light_sample_n, with the instructions of a `cpu_level` (wis_cpu_detect): the same bits, with AVX2 in three
/// quarters of the time.
enum wis_status wis_wavelet_light_sample_lanes(const struct wis_wavelet_light *environment,
                                               uint32_t distribution,
                                               const float world_from_map[9],
                                               uint32_t cpu_level,
                                               size_t count,
                                               const float *u,
                                               size_t u_stride,
                                               float *wi,
                                               size_t wi_stride,
                                               float *pdf,
                                               size_t pdf_stride);

/// The pdf per solid angle of any direction of unit length (within 1e-3): the very bits that a sample came with.
enum wis_status wis_wavelet_light_pdf(const struct wis_wavelet_light *environment,
                                      uint32_t distribution,
                                      const float world_from_map[9],
                                      const float wi[3],
                                      float *pdf);

/// As `count` calls of wis_wavelet_light_pdf; a direction that is not of unit length gets pdf 0.
enum wis_status wis_wavelet_light_pdf_n(const struct wis_wavelet_light *environment,
                                        uint32_t distribution,
                                        const float world_from_map[9],
                                        size_t count,
                                        const float *wi,
                                        size_t wi_stride,
                                        float *pdf,
                                        size_t pdf_stride);

/// As wis_wavelet_light_pdf_n, with the instructions of a `cpu_level` (wis_cpu_detect): the same bits, with AVX2 in three
/// quarters of the time.
enum wis_status wis_wavelet_light_pdf_lanes(const struct wis_wavelet_light *environment,
                                            uint32_t distribution,
                                            const float world_from_map[9],
                                            uint32_t cpu_level,
                                            size_t count,
                                            const float *wi,
                                            size_t wi_stride,
                                            float *pdf,
                                            size_t pdf_stride);

/// The `u` that leads to a direction. WIS_ZERO_DENSITY if none does.
enum wis_status wis_wavelet_light_invert(const struct wis_wavelet_light *environment,
                                         uint32_t distribution,
                                         const float world_from_map[9],
                                         const float wi[3],
                                         float u[2]);

/// The centre of a cell of a grid of `side` x `side` directions (1 to WIS_MAX_GRID): the direction at which to tabulate what
/// wis_grid_cells then finds. Cells are pixels of the octahedral square, axis 1 slowest. WIS_INVALID_ARGUMENT for a side or
/// a cell out of range.
enum wis_status wis_grid_direction(uint32_t side,
                                   uint32_t cell,
                                   float direction[3]);

/// The four cells about a direction of unit length (else WIS_INVALID_TRANSFORM) and their bilinear weights, which add
/// up to 1. For pairs of directions, as a normal and the reflected direction, the 16 products of two weights
/// interpolate quadrilinearly. Cells may repeat where the sheets of the square meet.
enum wis_status wis_grid_cells(uint32_t side, const float wi[3], uint32_t cell[4], float weights[4]);

/// Replaces an image by its orthonormal non-standard Haar coefficients, in place. `values`: `count` = 2^(n depth)
/// numbers, C order (axis 1 slowest), at most 1e290 in size; `dimensions` n = 1 to 4, `depth` at most 12. The
/// coefficient of level l, translation t and wavelet f = (f1 .. fn) replaces the pixel at coordinates (2 t_q + f_q)
/// 2^(depth - 1 - l), the scaling coefficient the pixel at the origin. WIS_INVALID_ARGUMENT for anything out of these
/// ranges.
enum wis_status wis_haar_forward(uint32_t dimensions,
                                 uint32_t depth,
                                 size_t count,
                                 double *values,
                                 struct wis_diagnostic *diagnostic);

/// Replaces the coefficients of wis_haar_forward by the image, in place, with the same arguments and statuses.
enum wis_status wis_haar_inverse(uint32_t dimensions,
                                 uint32_t depth,
                                 size_t count,
                                 double *values,
                                 struct wis_diagnostic *diagnostic);

/// The memory that wis_jitter_init needs for the strata of a lat-long map.
enum wis_status wis_jitter_size(const struct wis_wavelet_light_config *map,
                                uint32_t light_count,
                                struct wis_memory_size *size,
                                struct wis_diagnostic *diagnostic);

/// Sorts the texels of a map by the strata that wis_strata_lights found (`label`, width x height numbers below
/// `light_count`, else WIS_INVALID_ARGUMENT), so that directions can be drawn inside each. `distribution`:
/// WIS_JITTER_*. `world_from_map` as in wis_strata_config; null is the identity.
enum wis_status wis_jitter_init(const struct wis_wavelet_light_config *map,
                                const float world_from_map[9],
                                uint32_t light_count,
                                const uint32_t *label,
                                uint32_t distribution,
                                void *memory,
                                size_t bytes,
                                void *scratch,
                                size_t scratch_bytes,
                                const struct wis_jitter **jitter,
                                struct wis_diagnostic *diagnostic);

/// Draws a direction inside stratum `light` (WIS_INVALID_ARGUMENT if there is none). The pdf is per solid angle within the
/// stratum. With WIS_JITTER_ENERGY add the light's whole energy x BRDF x cosine x visibility, without dividing by the
/// pdf; for radiance looked up at the sample divide by it.
enum wis_status wis_jitter_sample(const struct wis_jitter *jitter,
                                  uint32_t light,
                                  const float u[2],
                                  struct wis_drawn *sample);

/// The pdf of wis_jitter_sample for any direction of unit length: the very bits that a sample came with, and 0 outside
/// the stratum.
enum wis_status wis_jitter_pdf(const struct wis_jitter *jitter, uint32_t light, const float wi[3], float *pdf);

/// Which lights are worth a shadow ray at a point (Agarwal et al. 2003, Section 4): writes the numbers of `count`
/// lights into `index`, the first `traced` of them in the order of `contribution` (radiance x BRDF x cosine, at least 0
/// and finite, else WIS_INVALID_ARGUMENT), the largest first, equal ones by number. What the others could add is at
/// most `threshold` (0 to 1, however small) of the whole; they follow in an order of no meaning. Estimate those by
/// their sum x the share that is visible of a few of them drawn in proportion to `contribution`: without bias. The time
/// is that of a pass over all lights and of sorting those that are traced.
enum wis_status wis_strata_order(size_t count,
                                 const float *contribution,
                                 float threshold,
                                 uint32_t *index,
                                 uint32_t *traced,
                                 struct wis_diagnostic *diagnostic);

/// The memory that a build needs. `size`: bytes of the environment, exactly without an error budget and at most with one; and
/// bytes of scratch memory. A map of 1024 x 512 takes 2.4 MB and 2.5 MB of scratch. Takes microseconds; reads no pixels.
enum wis_status wis_environment_size(const struct wis_environment_config *config,
                                     struct wis_memory_size *size,
                                     struct wis_diagnostic *diagnostic);

/// Builds an environment in `memory`, on one thread. `scratch` may be freed afterwards. `environment` receives the handle, which
/// is the address of `memory`. WIS_INVALID_TEXEL names the texel at fault by column and row. WIS_MEMORY_TOO_SMALL tells the
/// bytes that are needed, which an error budget makes fewer than wis_environment_size says. A map of 1024 x 512 floats takes
/// about 10 ms.
enum wis_status wis_environment_init(const struct wis_environment_config *config,
                                     void *memory,
                                     size_t bytes,
                                     void *scratch,
                                     size_t scratch_bytes,
                                     const struct wis_environment **environment,
                                     struct wis_diagnostic *diagnostic);

/// Begins a build that threads share. `items` receives how many items each of three passes has: rows of texels; cells, whose
/// tables are chosen; cells, whose tables are written. Hand items 0 to items[p] - 1 of pass p to wis_environment_run in any
/// portions, on any threads; all of a pass before any of the next. Then call wis_environment_finish. The bytes are those of
/// wis_environment_init, however the items were shared.
enum wis_status wis_environment_begin(const struct wis_environment_config *config,
                                      void *scratch,
                                      size_t scratch_bytes,
                                      uint32_t items[3],
                                      struct wis_diagnostic *diagnostic);

/// Works on `count` items of `pass` (0, 1 or 2) from item `first` on. `config` is that of wis_environment_begin. Threads may call
/// this at once for different items. `memory` is used by pass 2 only, may be null before, and must be the same block in all calls
/// of pass 2 and in wis_environment_finish; if it is too short, WIS_MEMORY_TOO_SMALL tells the bytes that are needed, and pass 2
/// may be run again. WIS_MISMATCH if the passes before are not done.
enum wis_status wis_environment_run(const struct wis_environment_config *config,
                                    void *memory,
                                    size_t bytes,
                                    void *scratch,
                                    size_t scratch_bytes,
                                    uint32_t pass,
                                    uint32_t first,
                                    uint32_t count,
                                    struct wis_diagnostic *diagnostic);

/// Ends a build whose three passes are done (WIS_MISMATCH before). `memory` is the block of pass 2; `environment` receives the
/// handle.
enum wis_status wis_environment_finish(const struct wis_environment_config *config,
                                       void *memory,
                                       size_t bytes,
                                       void *scratch,
                                       size_t scratch_bytes,
                                       const struct wis_environment **environment,
                                       struct wis_diagnostic *diagnostic);

/// Checks bytes that an earlier build wrote (copied, or mapped from a file) and gives them as an environment: `environment`
/// receives the handle, which is the address of `memory`. `bytes`: as many as the info says, or more. WIS_CORRUPT if a byte was
/// changed. Reads all bytes once.
enum wis_status wis_environment_open(const void *memory,
                                     size_t bytes,
                                     const struct wis_environment **environment,
                                     struct wis_diagnostic *diagnostic);

/// Describes an environment. Set `info->size` before.
enum wis_status wis_environment_describe(const struct wis_environment *environment, struct wis_environment_info *info);

/// Turns an environment in place: `world_from_map` is a row-major 3x3 rotation or reflection, world = M map, within 1e-4, that
/// replaces the former one; null is the identity. Nothing is rebuilt: takes less than a microsecond. The content id changes, so
/// products that were prepared before answer WIS_MISMATCH. No other thread may use the environment meanwhile. A call that
/// fails changes nothing.
enum wis_status wis_environment_turn(void *memory,
                                     size_t bytes,
                                     const float world_from_map[9],
                                     const struct wis_environment **environment,
                                     struct wis_diagnostic *diagnostic);

/// Checks the shapes of a material and writes its hash. Costs 20 ns: also good for one hit, where a texture gives the roughness.
/// WIS_INVALID_ARGUMENT names the field; `y` of the diagnostic is the number of the lobe.
enum wis_status wis_material_init(struct wis_material *material,
                                  struct wis_diagnostic *diagnostic);

/// A seed for a pixel in a pass; seeds of neighbours and of passes are decorrelated.
uint32_t wis_pixel_seed(uint32_t x, uint32_t y, uint32_t pass);

/// Points `first` to `first + count - 1` of the Hammersley set of `total` points in the unit square; WIS_INVALID_ARGUMENT if
/// those are more than `total`. No coordinate is exactly 0 or 1. `stride` in bytes from one point to the next; 0: packed.
enum wis_status wis_points_hammersley(uint32_t first,
                                      uint32_t count,
                                      uint32_t total,
                                      float *out,
                                      size_t stride);

/// Points `first` to `first + count - 1` (at most 2^32 - 1, else WIS_OVERFLOW) of an Owen-scrambled Sobol
/// (0,2)-sequence: each aligned block of 2^k points has one in every elementary interval of area 2^-k. Sequences of
/// different seeds are independent. No coordinate is exactly 0 or 1. `stride` in bytes from one point to the next; 0:
/// packed.
enum wis_status wis_points_sobol(uint32_t seed, uint32_t first, size_t count, float *out, size_t stride);

/// The scratch memory that wis_pool_pick needs for `count` candidates, in `bytes`. WIS_OVERFLOW for more than
/// WIS_MAX_CANDIDATES.
enum wis_status wis_pool_size(size_t count, struct wis_memory_size *size);

/// Picks directions to trace from `count` candidates, in proportion to the client's weights: the sampler to use where
/// nothing is prepared, or where lobes are too narrow for a product.
///
/// Draw k N candidates, half of them (a quarter for lobes below 0.02) from wis_wavelet_light_sample_lanes with
/// WIS_DISTRIBUTION_COMPENSATED, or from wis_wavelet_product_sample_lanes where a product is prepared, and the others from the
/// BRDF. Good choices are k = 16 for a single pick (up to eight samples in a call cost little more than two), 8 for up to
/// four picks and 4 for more. Where the BRDF is dear, 8 and 4, and 4 for Lambert's lobes alone from two picks on; of both,
/// more than four picks under a sun need no pool: trace all N candidates (k = 1) and add up what they are weighed with
/// below, times visibility (MIS, balance heuristic).
/// With g = luminance of radiance x BRDF x cosine, by the client's own evaluation, the weight of candidate x is
/// g(x) / (n_e p_e(x) + n_b p_b(x)), for n_e and n_b candidates from densities p_e and p_b. Then `picks` = N rays,
/// fewer where a candidate is picked more than once, give the estimate
/// sum of radiance x BRDF x cosine x visibility x multiplicity x weight_sum / (N g), without bias.
///
/// Picks are systematic along a curve over the sphere, so that well-spread candidates give well-spread picks; a single
/// pick goes through the candidates in their own order. A candidate is picked N weight / weight_sum times in
/// expectation. Weights that are 0 are never picked; if all are 0, there are no picks and the estimate is 0.
/// WIS_INVALID_ARGUMENT for a weight that is negative, NaN or infinite.
///
/// `u` in [0, 1) (clamped, NaN counts as 1/2) is one more random number for the whole pool. `scratch` is aligned to
/// WIS_ALIGNMENT, of wis_pool_size. `pick` holds up to `picks` elements, of which `pick_count` are written. Strides are
/// in bytes; 0: packed.
enum wis_status wis_pool_pick(size_t count,
                              const float *wi,
                              size_t wi_stride,
                              const float *weight,
                              size_t weight_stride,
                              uint32_t picks,
                              float u,
                              void *scratch,
                              size_t scratch_bytes,
                              struct wis_pick *pick,
                              uint32_t *pick_count,
                              double *weight_sum,
                              struct wis_diagnostic *diagnostic);

/// Counts rays: `visible[k]` is not 0 where the ray along `wi[k]` reached the light. Directions that are not of unit
/// length are left out. The cells divide map space: give the `world_from_map` (null: the identity) of the environment
/// that the prior will serve. Stride in bytes, 0: packed.
///
/// A prior is worth having for a tile of about 8 x 8 pixels. So that estimates stay unbiased, what a product or pool
/// reads must be made of samples whose random numbers are independent of that pixel's: count into a second prior while
/// the first is read and swap them between passes, with a seed of its own for each pixel and pass. With samples that
/// neighbouring pixels share (a screen-space mask) it is slightly biased. Counts are integers: with wis_prior_add the
/// result does not depend on how many threads counted.
enum wis_status wis_prior_count(struct wis_prior *prior,
                                const float world_from_map[9],
                                size_t count,
                                const float *wi,
                                size_t wi_stride,
                                const uint8_t *visible);

/// Adds the counts of another prior: what threads or tiles have counted apart.
enum wis_status wis_prior_add(struct wis_prior *prior, const struct wis_prior *other);

/// Halves all counts: what was seen long ago, or by a camera that has moved, counts less.
enum wis_status wis_prior_halve(struct wis_prior *prior);

/// The factor g of the prior for `count` directions, 0.1 to about 0.6: for the pool. Multiply a candidate's weight by its
/// g before wis_pool_pick, and divide what its pick contributes by it. 0 for directions that are not of unit length.
/// Strides in bytes, 0: packed.
enum wis_status wis_prior_weights(const struct wis_prior *prior,
                                  const float world_from_map[9],
                                  size_t count,
                                  const float *wi,
                                  size_t wi_stride,
                                  float *weight,
                                  size_t weight_stride);

/// Evaluates RGB of BRDF x cosine of a query for `count` directions of unit length (0 for others): what the lobes mean.
/// Strides are in bytes; 0: packed.
enum wis_status wis_query_eval(const struct wis_wavelet_query *query,
                               size_t count,
                               const float *wi,
                               size_t wi_stride,
                               float *f_cos,
                               size_t f_cos_stride);

/// The bytes that a product needs; no scratch memory besides. Allocate one block per thread and use it over and over.
enum wis_status wis_wavelet_product_size(const struct wis_wavelet_product_config *config,
                                         struct wis_memory_size *size,
                                         struct wis_diagnostic *diagnostic);

/// Prepares the product of an environment and a shading point. A query without lobes, or light and lobes that do not
/// meet, give a product whose samples have pdf 0.
enum wis_status wis_wavelet_product_prepare(const struct wis_wavelet_light *environment,
                                            const struct wis_wavelet_query *query,
                                            const struct wis_wavelet_product_config *config,
                                            void *memory,
                                            size_t bytes,
                                            const struct wis_wavelet_product **product,
                                            struct wis_diagnostic *diagnostic);

/// As wis_wavelet_product_prepare, for a BRDF that the client evaluates in batches of at most 40 directions. There is no RGB
/// estimate of such a product.
enum wis_status wis_wavelet_product_prepare_callback(const struct wis_wavelet_light *environment,
                                                     const struct wis_wavelet_callback *brdf,
                                                     const struct wis_wavelet_product_config *config,
                                                     void *memory,
                                                     size_t bytes,
                                                     const struct wis_wavelet_product **product,
                                                     struct wis_diagnostic *diagnostic);

/// Whether a product may serve a hit: 1 if the hit has the lobes and flags of the query that was prepared, bit for bit,
/// and its normal lies within `reuse_cone` of that query's; else 0, also for a product of a callback. That a tabulated
/// lobe means the same table is yours to know. The view (wo) may
/// differ: it changes the quality of the samples, not that the pdf is above 0 wherever the hit reflects light.
enum wis_status wis_wavelet_product_covers(const struct wis_wavelet_light *environment,
                                           const struct wis_wavelet_product *product,
                                           const struct wis_wavelet_query *query,
                                           uint32_t *covers);

/// What a product is made of.
enum wis_status wis_wavelet_product_describe(const struct wis_wavelet_light *environment,
                                             const struct wis_wavelet_product *product,
                                             struct wis_wavelet_product_info *info);

/// An approximation of the integral over directions of luminance x luminance of BRDF x cosine, without visibility, in
/// the units of the map. An approximation: a ratio or control variate that uses it inherits its error.
///
/// Estimates from N samples, f L the luminance or colour of radiance x BRDF x cosine and V the visibility of each: the mean of
/// f L V / pdf is unbiased (Clarberg et al. 2005, Eq. 8). This integral times the share of samples with V = 1 (Eq. 11), or
/// times sum(f L V / pdf) / sum(f L / pdf), is free of noise where nothing is blocked, and biased by the integral's error:
/// better for a few samples, worse from 64 on.
enum wis_status wis_wavelet_product_estimate(const struct wis_wavelet_light *environment,
                                             const struct wis_wavelet_product *product,
                                             double *luminance);

/// The approximation of the integral of radiance x BRDF x cosine in RGB. WIS_NOT_BUILT unless the environment was built
/// with WIS_WAVELET_LIGHT_RGB and the product from a query without a table (for those with: wis_wavelet_table_estimate_rgb). Costs a
/// BRDF evaluation for each leaf.
enum wis_status wis_wavelet_product_estimate_rgb(const struct wis_wavelet_light *environment,
                                                 const struct wis_wavelet_product *product,
                                                 double rgb[3]);

/// Samples a direction in proportion to the product. `u`: two numbers in [0, 1) (others are moved there, NaN counts as
/// 1/2). pdf 0: there is nothing to sample.
enum wis_status wis_wavelet_product_sample(const struct wis_wavelet_light *environment,
                                           const struct wis_wavelet_product *product,
                                           const float u[2],
                                           struct wis_drawn *sample);

/// As `count` calls of wis_wavelet_product_sample, in the order of `u`. Strides are in bytes from one element to the next; 0:
/// packed.
enum wis_status wis_wavelet_product_sample_n(const struct wis_wavelet_light *environment,
                                             const struct wis_wavelet_product *product,
                                             size_t count,
                                             const float *u,
                                             size_t u_stride,
                                             float *wi,
                                             size_t wi_stride,
                                             float *pdf,
                                             size_t pdf_stride);

/// As wis_wavelet_product_sample_n, with the instructions of a `cpu_level` (wis_cpu_detect): the same bits, with AVX2 in three quarters
/// of the time.
enum wis_status wis_wavelet_product_sample_lanes(const struct wis_wavelet_light *environment,
                                                 const struct wis_wavelet_product *product,
                                                 uint32_t cpu_level,
                                                 size_t count,
                                                 const float *u,
                                                 size_t u_stride,
                                                 float *wi,
                                                 size_t wi_stride,
                                                 float *pdf,
                                                 size_t pdf_stride);

/// The pdf per solid angle of any direction of unit length (within 1e-3): the very bits that a sample came with, and
/// above 0 wherever radiance x BRDF x cosine is.
enum wis_status wis_wavelet_product_pdf(const struct wis_wavelet_light *environment,
                                        const struct wis_wavelet_product *product,
                                        const float wi[3],
                                        float *pdf);

/// As `count` calls of wis_wavelet_product_pdf; a direction that is not of unit length gets pdf 0.
enum wis_status wis_wavelet_product_pdf_n(const struct wis_wavelet_light *environment,
                                          const struct wis_wavelet_product *product,
                                          size_t count,
                                          const float *wi,
                                          size_t wi_stride,
                                          float *pdf,
                                          size_t pdf_stride);

/// As wis_wavelet_product_pdf_n, with the instructions of a `cpu_level` (wis_cpu_detect): the same bits, with AVX2 in three quarters
/// of the time.
enum wis_status wis_wavelet_product_pdf_lanes(const struct wis_wavelet_light *environment,
                                              const struct wis_wavelet_product *product,
                                              uint32_t cpu_level,
                                              size_t count,
                                              const float *wi,
                                              size_t wi_stride,
                                              float *pdf,
                                              size_t pdf_stride);

/// The `u` that leads to a direction. WIS_ZERO_DENSITY if none does.
enum wis_status wis_wavelet_product_invert(const struct wis_wavelet_light *environment,
                                           const struct wis_wavelet_product *product,
                                           const float wi[3],
                                           float u[2]);

/// Prepares `count` products in one block of `count` times the bytes that wis_wavelet_product_size gives; `product` receives
/// their handles. Each has the bytes of wis_wavelet_product_prepare. On failure, products before the query at fault, whose number
/// stands in the diagnostic's `y`, are whole.
enum wis_status wis_wavelet_products_prepare(const struct wis_wavelet_light *environment,
                                             size_t count,
                                             const struct wis_wavelet_query *query,
                                             const struct wis_wavelet_product_config *config,
                                             void *memory,
                                             size_t bytes,
                                             const struct wis_wavelet_product **product,
                                             struct wis_diagnostic *diagnostic);

/// One sample of each of `count` products: the bits of as many calls of wis_wavelet_product_sample, in a quarter of the time.
/// Strides are in bytes from one element to the next; 0: packed.
enum wis_status wis_wavelet_products_sample(const struct wis_wavelet_light *environment,
                                            size_t count,
                                            const struct wis_wavelet_product *const *product,
                                            const float *u,
                                            size_t u_stride,
                                            float *wi,
                                            size_t wi_stride,
                                            float *pdf,
                                            size_t pdf_stride);

/// As wis_wavelet_products_sample, with the instructions of a `cpu_level` (wis_cpu_detect): the same bits.
enum wis_status wis_wavelet_products_sample_lanes(const struct wis_wavelet_light *environment,
                                                  uint32_t cpu_level,
                                                  size_t count,
                                                  const struct wis_wavelet_product *const *product,
                                                  const float *u,
                                                  size_t u_stride,
                                                  float *wi,
                                                  size_t wi_stride,
                                                  float *pdf,
                                                  size_t pdf_stride);

/// The pdf of one direction for each of `count` products: the bits of as many calls of wis_wavelet_product_pdf; 0 for a direction
/// that is not of unit length. Strides as above.
enum wis_status wis_wavelet_products_pdf(const struct wis_wavelet_light *environment,
                                         size_t count,
                                         const struct wis_wavelet_product *const *product,
                                         const float *wi,
                                         size_t wi_stride,
                                         float *pdf,
                                         size_t pdf_stride);

/// As wis_wavelet_products_pdf, with the instructions of a `cpu_level` (wis_cpu_detect): the same bits.
enum wis_status wis_wavelet_products_pdf_lanes(const struct wis_wavelet_light *environment,
                                               uint32_t cpu_level,
                                               size_t count,
                                               const struct wis_wavelet_product *const *product,
                                               const float *wi,
                                               size_t wi_stride,
                                               float *pdf,
                                               size_t pdf_stride);

/// The bytes that a sampler needs: 1.4 kB for 16 rays.
enum wis_status wis_sampler_size(const struct wis_sampler_config *config,
                                 struct wis_memory_size *size,
                                 struct wis_diagnostic *diagnostic);

/// Makes a sampler in `memory`. Detects the processor's instructions, which takes microseconds: once for a thread.
enum wis_status wis_sampler_init(const struct wis_sampler_config *config,
                                 void *memory,
                                 size_t memory_bytes,
                                 struct wis_sampler **sampler,
                                 struct wis_diagnostic *diagnostic);

/// Forgets products that hits of the last pixel shared, so that images depend on the order of pixels and on threads in nothing.
/// Call it when the seed of points changes. WIS_NULL_POINTER, WIS_MISMATCH for memory that holds no sampler.
enum wis_status wis_sampler_begin_pixel(struct wis_sampler *sampler);

/// Where the last call on this sampler that failed was at fault: argument, field and element. A pointer into the sampler, which
/// stays valid as long as that does; null for a null sampler.
const struct wis_diagnostic *wis_sampler_fault(const struct wis_sampler *sampler);

/// Draws `count` directions in proportion to the light.
///
/// `u`: two numbers in [0, 1) each; others are moved there, NaN counts as 1/2. `wi`: unit length, world space. `pdf`: per
/// steradian, above 0, and the very bits that wis_pdf answers for that direction; 0 if the light is black. Strides are the bytes
/// from one element to the next; 0: packed. About 40 ns each in batches of 8 and more.
enum wis_status wis_sample(struct wis_sampler *sampler,
                           const struct wis_environment *environment_object,
                           size_t count,
                           const float *u,
                           size_t u_stride,
                           float *wi,
                           size_t wi_stride,
                           float *pdf,
                           size_t pdf_stride);

/// The pdf of `count` directions in the light, per steradian; 0 for those that are not of unit length within 1e-3. Strides as in
/// wis_sample. About 15 ns each in batches of 8 and more.
enum wis_status wis_pdf(struct wis_sampler *sampler,
                        const struct wis_environment *environment_object,
                        size_t count,
                        const float *wi,
                        size_t wi_stride,
                        float *pdf,
                        size_t pdf_stride);

/// The `u` that leads to each of `count` directions. `status`: WIS_OK, WIS_ZERO_DENSITY where no u leads there, or
/// WIS_INVALID_TRANSFORM for a direction that is not of unit length within 1e-3, each as a byte; where it is not WIS_OK, u is not
/// written. Strides as in wis_sample; statuses stand close together.
enum wis_status wis_invert(struct wis_sampler *sampler,
                           const struct wis_environment *environment_object,
                           size_t count,
                           const float *wi,
                           size_t wi_stride,
                           float *u,
                           size_t u_stride,
                           uint8_t *status);

/// The memory that wis_strata_lights needs: `bytes` of lights and `scratch_bytes` of scratch. The map is lat-long; its
/// storage, resolution and error budget do not matter.
enum wis_status wis_strata_size(const struct wis_wavelet_light_config *map,
                                const struct wis_strata_config *config,
                                struct wis_memory_size *size,
                                struct wis_diagnostic *diagnostic);

/// Cuts a map into strata and gives each as a directional light (Agarwal et al. 2003): bright regions get more lights
/// than dark ones of the same energy, and lights of a region stand apart. The lights' `rgb` add up to the integral of
/// radiance over the sphere. Written are `light_count` lights, in the order of importance in which they were placed; 0
/// for a black map. The result depends on nothing but the map and the config. WIS_OVERFLOW if the light of a stratum is no
/// float.
///
/// `lights` holds `bytes` of wis_strata_size. `label` may be null; else it holds width x height numbers, and gets the
/// number of the light of each texel.
enum wis_status wis_strata_lights(const struct wis_wavelet_light_config *map,
                                  const struct wis_strata_config *config,
                                  void *scratch,
                                  size_t scratch_bytes,
                                  struct wis_light *lights,
                                  uint32_t *light_count,
                                  uint32_t *label,
                                  struct wis_diagnostic *diagnostic);

/// The directions at which a slice is to be evaluated: `wo`, three numbers, and 4^depth `wi`, in the order of the pixels
/// of wis_tree_config, in a frame whose normal is +z and in which wo has y = 0. `offset`: two numbers, where in each
/// pixel, 1/2 for its centre. Average several places, and choose pixels (2 / 2^depth radians wide at the mirror direction) that
/// are finer than the lobe: samples are as uneven as the lobe is inside a pixel. wi below the surface are given too. The stride is in bytes; 0: packed.
enum wis_status wis_wavelet_table_directions(uint32_t slice,
                                             uint32_t slice_count,
                                             uint32_t depth,
                                             const float offset[2],
                                             float wo[3],
                                             float *wi,
                                             size_t wi_stride);

/// As wis_query_eval, for a query with tabulated lobes: what the table means, in its colours.
enum wis_status wis_wavelet_table_eval(const struct wis_wavelet_table *table,
                                       const struct wis_wavelet_query *query,
                                       size_t count,
                                       const float *wi,
                                       size_t wi_stride,
                                       float *f_cos,
                                       size_t f_cos_stride);

/// As wis_wavelet_product_prepare, for a query with tabulated lobes (WIS_WAVELET_LOBE_TABLE, weighted, beside others if there are). The
/// narrow lobe of the table, if it has one, is found in its slices. The table is read during the call only: densities are
/// above 0 wherever the true BRDF may be, however coarse the table is.
enum wis_status wis_wavelet_product_prepare_table(const struct wis_wavelet_light *environment,
                                                  const struct wis_wavelet_table *table,
                                                  const struct wis_wavelet_query *query,
                                                  const struct wis_wavelet_product_config *config,
                                                  void *memory,
                                                  size_t bytes,
                                                  const struct wis_wavelet_product **product,
                                                  struct wis_diagnostic *diagnostic);

/// As wis_wavelet_product_estimate_rgb, for a product that was prepared with this table, in the table's colours.
enum wis_status wis_wavelet_table_estimate_rgb(const struct wis_wavelet_light *environment,
                                               const struct wis_wavelet_product *product,
                                               const struct wis_wavelet_table *table,
                                               double rgb[3]);

/// The bytes that a tree needs at most (the bytes that are in use stand in wis_tree_info; a block that is too short
/// fails with WIS_MEMORY_TOO_SMALL and tells them). Does not read the pixels.
enum wis_status wis_tree_size(const struct wis_tree_config *config,
                              struct wis_memory_size *size,
                              struct wis_diagnostic *diagnostic);

/// Builds a tree. `info` may be null. WIS_INVALID_TEXEL: `x` is the position along the last axis, `y` the number of
/// the row.
enum wis_status wis_tree_init(const struct wis_tree_config *config,
                              void *memory,
                              size_t bytes,
                              void *scratch,
                              size_t scratch_bytes,
                              const struct wis_tree **tree,
                              struct wis_tree_info *info,
                              struct wis_diagnostic *diagnostic);

/// Checks bytes that an earlier build wrote (copied, or mapped from a file) and gives them as a tree. Reads all of
/// them once. `info` may be null.
enum wis_status wis_tree_open(const void *memory,
                              size_t bytes,
                              const struct wis_tree **tree,
                              struct wis_tree_info *info,
                              struct wis_diagnostic *diagnostic);

/// The average of the function.
enum wis_status wis_tree_average(const struct wis_tree *tree, double *average);

/// The integral over the unit cube of the product of the stored functions. `f` has the first axes of `e`, at most as
/// many (else WIS_INVALID_ARGUMENT), and is constant along the rest. At least 0; WIS_OVERFLOW if it is beyond a double.
/// Costs one visit of each square that both trees keep.
enum wis_status wis_tree_product_integral(const struct wis_tree *e, const struct wis_tree *f, double *integral);

/// Samples a point of the unit cube in proportion to the function. `u`: n numbers in [0, 1) (others are moved there,
/// NaN counts as 1/2); `point`: n numbers; `pdf`: the density there with respect to the cube. A tree that is 0
/// everywhere gives pdf 0.
enum wis_status wis_tree_sample(const struct wis_tree *tree, const float *u, float *point, float *pdf);

/// The density at any point (coordinates are moved into [0, 1)): the very bits that a sample came with.
enum wis_status wis_tree_pdf(const struct wis_tree *tree, const float *point, float *pdf);

/// The `u` that leads to a point. WIS_ZERO_DENSITY if none does.
enum wis_status wis_tree_invert(const struct wis_tree *tree, const float *point, float *u);

/// Warps `count` points (n packed numbers each) in place; afterwards points of one cell stand together. The points
/// and `index` (your numbers of the points) are permuted alike; as a set, the points are those of wis_tree_sample to
/// the bit.
/// WIS_ZERO_DENSITY if the tree is 0 everywhere.
enum wis_status wis_warp_in_place(const struct wis_tree *tree,
                                  float *points,
                                  uint32_t *index,
                                  size_t count,
                                  struct wis_diagnostic *diagnostic);

/// The memory that wis_tree_multiply needs for these trees at most; `g` may be null. If all trees have the same axes the
/// size is exact, and costs one visit of each square of the product. Otherwise it is an upper bound, and costs one visit of
/// each square of the trees. WIS_OVERFLOW if there may be more than 2^32 - 2 squares.
enum wis_status wis_tree_multiply_size(const struct wis_tree *e,
                                       const struct wis_tree *f,
                                       const struct wis_tree *g,
                                       struct wis_memory_size *size,
                                       struct wis_diagnostic *diagnostic);

/// Multiplies two or three trees into a tree: sampled, saved and multiplied like any other. `f` and `g` (null: 1) have the
/// first axes of `e`, at most as many, and are constant along the rest. The averages are exact but for rounding (Clarberg
/// et al. 2005, Section 4.3; with light, BRDF x cosine and visibility as factors the triple product of Ng et al. 2004).
/// `error` in `info`, which may be null, is 0: what was dropped from the factors is not counted. WIS_INVALID_ARGUMENT if `f` or
/// `g` has more axes than `e`; WIS_OVERFLOW if the average is above 0 and below 2^-1022, or beyond a double.
///
/// Blocks may be longer than wis_tree_multiply_size says, and serve for many products. They may be shorter, too: the call
/// answers WIS_MEMORY_TOO_SMALL as soon as the product exceeds the scratch block, or at the end if it exceeds the other one.
/// The diagnostic then tells enough bytes, of the scratch block as wis_tree_multiply_size does. The bytes in use stand in
/// `info`.
enum wis_status wis_tree_multiply(const struct wis_tree *e,
                                  const struct wis_tree *f,
                                  const struct wis_tree *g,
                                  void *memory,
                                  size_t bytes,
                                  void *scratch,
                                  size_t scratch_bytes,
                                  const struct wis_tree **tree,
                                  struct wis_tree_info *info,
                                  struct wis_diagnostic *diagnostic);

/// The memory that wis_tree_blend needs for these trees, at most. Costs one visit of each square of the sum.
enum wis_status wis_tree_blend_size(uint32_t tree_count,
                                    const struct wis_tree *const *trees,
                                    struct wis_memory_size *size,
                                    struct wis_diagnostic *diagnostic);

/// The weighted sum of 1 to WIS_MAX_BLEND trees of the same axes as a tree: what stands between tabulated functions, exactly
/// (Clarberg et al. 2005, Section 5.2: coefficients interpolate one by one). `weight`: finite, 0 or more. The product
/// (wis_tree_multiply) of two such sums is the bilinear blend of the products of all pairs. WIS_INVALID_ARGUMENT for another
/// number of trees, trees of different axes, or a weight out of range: `y` in the diagnostic is the number of the tree or the
/// weight. WIS_OVERFLOW as wis_tree_multiply.
///
/// Blocks may be longer than wis_tree_blend_size says; one that is too short fails with WIS_MEMORY_TOO_SMALL. The bytes in use
/// stand in `info`, which may be null; its `error` is 0.
enum wis_status wis_tree_blend(uint32_t tree_count,
                               const struct wis_tree *const *trees,
                               const double *weight,
                               void *memory,
                               size_t bytes,
                               void *scratch,
                               size_t scratch_bytes,
                               const struct wis_tree **tree,
                               struct wis_tree_info *info,
                               struct wis_diagnostic *diagnostic);

/// The memory that wis_tree_of_environment needs at most. Does not read the transforms.
enum wis_status wis_tree_of_environment_size(const struct wis_rotated_config *config,
                                             struct wis_memory_size *size,
                                             struct wis_diagnostic *diagnostic);

/// The luminance of an environment over the octahedral square of another frame as a tree: a map that is rotated about a
/// direction, made when a scene asks for it (Clarberg et al. 2005, Section 5.1, make all of them beforehand). With a BRDF that
/// is tabulated about the same direction wis_tree_multiply gives their product; wis_tree_blend interpolates between
/// directions, wis_grid_cells says which. `info` may be null. The bytes in use stand in `info`. Costs (places 2^depth)^2
/// look-ups in the map.
enum wis_status wis_tree_of_environment(const struct wis_wavelet_light *environment,
                                        const struct wis_rotated_config *config,
                                        void *memory,
                                        size_t bytes,
                                        void *scratch,
                                        size_t scratch_bytes,
                                        const struct wis_tree **tree,
                                        struct wis_tree_info *info,
                                        struct wis_diagnostic *diagnostic);

/// The fewest of a tree's largest wavelets (wis_triple_select, wis_sparse_select) that leave a relative L2 error of at most
/// `error`, 0 or more.
/// Costs 33 visits of each square.
enum wis_status wis_triple_terms(const struct wis_tree *tree,
                                 double error,
                                 uint32_t *terms);

/// How many of a tree's wavelets have an orthonormal coefficient of at least `threshold`, 0 or more: what wis_triple_select
/// and wis_sparse_select are asked to keep by those who threshold. One visit of each square.
enum wis_status wis_triple_at_least(const struct wis_tree *tree,
                                    double threshold,
                                    uint32_t *terms);

/// As wis_triple_select, for a tree of 1 to 4 axes: its `keep` wavelets with the largest orthonormal coefficients, into `kept`.
enum wis_status wis_sparse_select(const struct wis_tree *tree,
                                  uint32_t keep,
                                  struct wis_details *kept,
                                  uint32_t *kept_count,
                                  struct wis_diagnostic *diagnostic);

/// The product of two functions given by averages and wavelets, any sets in order (Clarberg et al. 2005, Section 4.3; values
/// may be negative): its average and its wavelets, without decompression: each square that either has a wavelet in is
/// visited once. `wavelets` has room for `room` elements. WIS_MEMORY_TOO_SMALL if the product has more squares: then nothing is
/// multiplied, and `wavelet_count` alone is written. It tells how many squares the product has, at most 12 times the sum of
/// both counts. WIS_INVALID_ARGUMENT for an average that is not finite, or a list that is out of order: `y` in the diagnostic
/// is the first element that is. WIS_OVERFLOW if the average is beyond a double or a detail beyond a float; `wavelets` is then
/// undefined.
enum wis_status wis_triple_multiply(double e_average,
                                    uint32_t e_count,
                                    const struct wis_wavelets *e,
                                    double f_average,
                                    uint32_t f_count,
                                    const struct wis_wavelets *f,
                                    uint32_t room,
                                    struct wis_wavelets *wavelets,
                                    uint32_t *wavelet_count,
                                    double *average,
                                    struct wis_diagnostic *diagnostic);

/// As wis_triple_multiply, for a function `e` of n axes, 1 to 4, and one, `f`, of the first m of them, 1 to n, constant along
/// the rest (Clarberg et al. 2005, Section 4.3). Where `e` is constant and `f` is not, the product has as many squares as
/// n axes ask for: 2^((n - m) level) for each of `f`. A `product_count` of 2^32 - 1 stands for that many or more.
enum wis_status wis_sparse_multiply(uint32_t n,
                                    uint32_t m,
                                    double e_average,
                                    uint32_t e_count,
                                    const struct wis_details *e,
                                    double f_average,
                                    uint32_t f_count,
                                    const struct wis_details *f,
                                    uint32_t room,
                                    struct wis_details *product,
                                    uint32_t *product_count,
                                    double *average,
                                    struct wis_diagnostic *diagnostic);

/// The memory that wis_tree_of_wavelets needs: exactly the bytes in use.
enum wis_status wis_tree_of_wavelets_size(uint32_t count,
                                          const struct wis_wavelets *wavelets,
                                          struct wis_memory_size *size,
                                          struct wis_diagnostic *diagnostic);

/// The tree of a function that is given by its average and any set of wavelets in order: free thresholding as the papers
/// print it. Such a function may be negative or 0 where what it approximates is not: values below `least` (0 or more,
/// finite) are raised to it, and the tree is that of the raised function, in average, sample and pdf alike. A `least`
/// above 0 keeps the pdf above 0 everywhere. WIS_INVALID_ARGUMENT if the list is out of order (`y` in the diagnostic is the
/// first element that is), or if values are too large for a tree: above 2^120 times the average. WIS_OVERFLOW if the tree's
/// average is beyond a double. `info` may be null.
enum wis_status wis_tree_of_wavelets(double average,
                                     uint32_t count,
                                     const struct wis_wavelets *wavelets,
                                     double least,
                                     void *memory,
                                     size_t bytes,
                                     const struct wis_tree **tree,
                                     struct wis_tree_info *info,
                                     struct wis_diagnostic *diagnostic);

/// The memory that wis_tree_of_details needs: exactly the bytes in use.
enum wis_status wis_tree_of_details_size(uint32_t dimensions,
                                         uint32_t count,
                                         const struct wis_details *details,
                                         struct wis_memory_size *size,
                                         struct wis_diagnostic *diagnostic);

/// As wis_tree_of_wavelets, for a function of 1 to 4 axes: what wis_sparse_multiply gives, as something to sample.
enum wis_status wis_tree_of_details(uint32_t dimensions,
                                    double average,
                                    uint32_t count,
                                    const struct wis_details *details,
                                    double least,
                                    void *memory,
                                    size_t bytes,
                                    const struct wis_tree **tree,
                                    struct wis_tree_info *info,
                                    struct wis_diagnostic *diagnostic);

/// The integral of the product of two Haar functions `i` and `j` of n variables and one, `k`, of the first m of them
/// (Clarberg et al. 2005, Eq. 5): the generalised tripling coefficient. n is 1 to 4 and m 1 to n. With the constant
/// (level 0, no wavelet) as `k` it is the non-standard coupling coefficient of `i` and `j`. WIS_INVALID_ARGUMENT for anything
/// out of range.
enum wis_status wis_tripling_coefficient(uint32_t n,
                                         uint32_t m,
                                         const struct wis_basis_function *i,
                                         const struct wis_basis_function *j,
                                         const struct wis_basis_function *k,
                                         double *coefficient);

/// The integral over the unit square of BRDF x light x visibility (Ng et al. 2004, Section 5), three trees of two axes
/// (WIS_INVALID_ARGUMENT for others), in any order. At least 0, and exact but for the rounding of stored averages: the
/// relative error is at most 2e-7. WIS_OVERFLOW if it is beyond a double. Costs one visit of each square that two of the trees
/// keep. For the six faces of a cube map, or three channels, add up as many calls.
enum wis_status wis_triple_integral(const struct wis_tree *brdf,
                                    const struct wis_tree *light,
                                    const struct wis_tree *visibility,
                                    double *integral);

/// Keeps the `keep` wavelets of a tree of two axes with the largest orthonormal coefficients (non-linear approximation);
/// of equal ones the first in depth-first order. `wavelets` has room for `keep` elements; `wavelet_count` tells how many
/// squares were written, at most that many. WIS_OVERFLOW if a detail that is kept is beyond a float; `wavelets` is then
/// undefined. Costs 33 visits of each square: do it when the function is built.
enum wis_status wis_triple_select(const struct wis_tree *tree,
                                  uint32_t keep,
                                  struct wis_wavelets *wavelets,
                                  uint32_t *wavelet_count,
                                  struct wis_diagnostic *diagnostic);

/// As wis_triple_select, for whole squares: those whose three coefficients have the largest sum of squares (Ng et al. 2004,
/// Section 7.2, keeps the light's squares so).
enum wis_status wis_triple_select_squares(const struct wis_tree *tree,
                                          uint32_t keep,
                                          struct wis_wavelets *wavelets,
                                          uint32_t *wavelet_count,
                                          struct wis_diagnostic *diagnostic);

/// The triple product integral with approximations of BRDF and light (Ng et al. 2004, Section 5.3): wavelets of the
/// BRDF meet the exact light and visibility, and light and visibility meet the approximate BRDF where the light's
/// wavelet is kept. `brdf_average`: the BRDF's mean over the square, finite; both lists as wis_triple_select writes
/// them (WIS_INVALID_ARGUMENT if they are out of order; `y` in the diagnostic is the first element that is). The exact
/// integral, but for rounding, if nothing was dropped. An integral that is 0 or small may come out below 0, by what was
/// dropped or by rounding. WIS_OVERFLOW if it is beyond a double. Costs a few steps down the trees for each element,
/// whatever the resolution.
enum wis_status wis_triple_sublinear(double brdf_average,
                                     uint32_t brdf_count,
                                     const struct wis_wavelets *brdf,
                                     uint32_t light_count,
                                     const struct wis_wavelets *kept_light,
                                     const struct wis_tree *light,
                                     const struct wis_tree *visibility,
                                     double *integral,
                                     struct wis_diagnostic *diagnostic);

/// The weighted sum of up to WIS_MAX_BLEND approximations: a BRDF between tabulated ones, as the 16 nearest pairs of normal
/// and reflected direction give it (Ng et al. 2004, Section 7.1.2; wis_grid_cells). `list`: as wis_triple_select writes them,
/// `list_count` elements each; `weight`: finite. `wavelets` has room for `room` elements; `wavelet_count` tells how many
/// squares the sum has. WIS_MEMORY_TOO_SMALL if there is no room for them; the sum of all counts is always enough.
/// WIS_OVERFLOW if a detail is beyond a float. `wavelets` is undefined after both. Averages are blended with the same weights.
enum wis_status wis_triple_blend(uint32_t count,
                                 const struct wis_wavelets *const *list,
                                 const uint32_t *list_count,
                                 const double *weight,
                                 uint32_t room,
                                 struct wis_wavelets *wavelets,
                                 uint32_t *wavelet_count,
                                 struct wis_diagnostic *diagnostic);

/// The memory that wis_visibility_init needs: exactly the bytes that are to be saved. WIS_INVALID_ARGUMENT for a tree of
/// other than two axes.
enum wis_status wis_visibility_size(const struct wis_tree *tree,
                                    struct wis_memory_size *size,
                                    struct wis_diagnostic *diagnostic);

/// Stores a tree of two dimensions whose values are 0 (occluded) to 1 (visible) in 8 bits: exactly if they are 0 or 1, up
/// to 1/510 in the averages of larger squares (Ng et al. 2004, Section 7.1.1). WIS_INVALID_ARGUMENT for values above 1.
enum wis_status wis_visibility_init(const struct wis_tree *tree,
                                    void *memory,
                                    size_t bytes,
                                    const struct wis_visibility **visibility,
                                    struct wis_diagnostic *diagnostic);

/// Checks bytes that wis_visibility_init wrote (copied, or mapped from a file) and gives them as a map of visibility. Reads
/// all of them once.
enum wis_status wis_visibility_open(const void *memory,
                                    size_t bytes,
                                    const struct wis_visibility **visibility,
                                    struct wis_diagnostic *diagnostic);

/// As wis_triple_sublinear, for visibility in 8 bits.
enum wis_status wis_visibility_integral(double brdf_average,
                                        uint32_t brdf_count,
                                        const struct wis_wavelets *brdf,
                                        uint32_t light_count,
                                        const struct wis_wavelets *kept_light,
                                        const struct wis_tree *light,
                                        const struct wis_visibility *visibility,
                                        double *integral,
                                        struct wis_diagnostic *diagnostic);

/// The integral over the unit square of a tree of two dimensions as it is seen through a map of visibility (a double
/// product). Nothing is dropped: exact but for rounding where visibility is 0 or 1. At least 0; WIS_OVERFLOW if it is
/// beyond a double. If many vertices share a BRDF, as all that have one normal or one reflected direction, multiply it
/// by the light once for a frame: this is then faster for each vertex than wis_visibility_integral, and no
/// approximation.
enum wis_status wis_visibility_product_integral(const struct wis_tree *tree,
                                                const struct wis_visibility *visibility,
                                                double *integral);

/// As `count` calls of wis_direct, in order, with wis_sampler_begin_pixel where the seed changes: the same bits. A point that is
/// wrong gets a status of its own and no rays. `wave` and its arrays are read during the call only.
enum wis_status wis_direct_wave(struct wis_sampler *sampler,
                                const struct wis_environment *environment_object,
                                size_t count,
                                const struct wis_wave *wave);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* WIS_H */
