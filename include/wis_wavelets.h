/* SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * wis_wavelets: wavelet trees of light and BRDF, their products, and sampling from them.
 * Generated from the Rust sources: edit those, then run `make header`.
 *
 * Wavelet importance sampling (Clarberg et al. 2005). wis_wavelet_light_* stores an environment map as a Haar wavelet tree over
 * the octahedral square, complete or pruned by an error budget; a sky with its sun takes 27 kB. wis_wavelet_product_*
 * multiplies it by BRDF x cosine at a shading point and samples the product with an exact pdf. Use it if memory for the light is
 * what counts; else wis_direct in wis.h is faster.
 *
 * Trees of any function of 1 to 4 variables: wis_haar, wis_tree_*, wis_warp_*. wis_tree_init also makes trees of products and
 * sums of trees, of lists of wavelets and of rotated maps. Products of such lists: wis_sparse_*. Triple product integrals of BRDF, light and visibility (Ng et al. 2004): wis_triple_*,
 * wis_visibility_*.
 *
 * Order of use. Once for a map: wis_wavelet_light_size, wis_wavelet_light_init. Once for a thread: wis_wavelet_product_size. At a
 * hit: wis_wavelet_product_prepare, then sample, pdf and invert as often as needed.
 *
 * The rules of wis.h for memory, threads, failure, structs, arguments, spaces and random numbers hold here.
 */

#ifndef WIS_WAVELETS_H
#define WIS_WAVELETS_H

#include "wis.h"

#ifdef __cplusplus
extern "C" {
#endif

/** @defgroup wavelets Wavelets */ /** @{ */

/// Every cell is stored: 16 bytes for four cells, and a third more for the coarser levels. If the resolution is left to the library and
/// WIS_WAVELET_LIGHT_NEAREST is set, cells in which light varies much (a sun, the edge of a lamp) are divided further, down to 16384 along
/// each side: 24 bytes a square, in as much room as cells / 8 or 4096 squares take.
#define WIS_STORAGE_PYRAMID 1

#define WIS_STORAGE_SPARSE 2 /**< A wavelet tree pruned to `error_budget`: 24 bytes for each square that is kept. */
#define WIS_WAVELET_LIGHT_NEAREST 1 /**< The client looks texels up without filtering: importance is not spread to neighbouring texels. */
#define WIS_WAVELET_LIGHT_EXACT_ZERO 2 /**< Black stays black, with density 0. Otherwise no cell is darker than 2^-16 of the mean. */

/// RGB averages are stored too, for wis_wavelet_product_estimate_rgb: 48 bytes for four cells, and a third more.
#define WIS_WAVELET_LIGHT_RGB 4

/// Channels that are not finite are replaced instead of rejected: NaN and -Inf by 0, +Inf by 65504, the largest half float. Negative
/// channels always count as 0: clamp your look-up at 0.
#define WIS_WAVELET_LIGHT_SANITISE 8

/// An environment: bytes in your memory without pointers, so it may be copied (to any block aligned to WIS_ALIGNMENT), saved and mapped.
/// Constant once built; any number of threads may use it at once. Nothing to free.
typedef struct wis_wavelet_light wis_wavelet_light;

/// What to build.
typedef struct wis_wavelet_light_config {
  uint32_t size; /**< sizeof(wis_wavelet_light_config). */
  uint32_t layout; /**< WIS_LAYOUT_*. */
  uint32_t width; /**< Texels in a row, at least 1; any number, also odd. */
  uint32_t height; /**< Rows, at least 1; of a cube map all six faces. */
  uint32_t channels; /**< 1 (luminance), 3 (RGB) or 4 (RGB and an alpha that is ignored); linear Rec. 709 radiance. */
  uint32_t format; /**< WIS_FORMAT_*. */
  uint32_t flags; /**< WIS_WAVELET_LIGHT_*, or 0. */
  uint32_t storage; /**< WIS_STORAGE_*. */
  /// Cells along each side of the octahedral square, a power of two from 1 to 4096; 0: at least as many cells as texels, and of a pyramid
  /// for clients without filter finer ones where light varies within them.
  uint32_t resolution;
  /// Sparse storage: the variance that pruning may add to an estimate of the map's power, relative to its square, 0 or more (0.01 = 1 %); 0
  /// drops nothing but constant squares.
  float error_budget;
  const void *pixels; /**< Texel 0 of row 0, aligned to its format; or null, and `row` gives the rows, which need no alignment. */
  ptrdiff_t row_stride; /**< Bytes from a row to the next, a multiple of a channel's, may be negative; 0: rows stand close together. */
  wis_row_fn row; /**< Used if `pixels` is null. */
  void *row_user; /**< Handed to `row`. */
} wis_wavelet_light_config;

/// What was built.
typedef struct wis_wavelet_light_info {
  uint32_t size; /**< sizeof(wis_wavelet_light_info), set by the caller. */
  uint32_t resolution; /**< Cells along each side of the square. */
  uint32_t storage; /**< WIS_STORAGE_*. */
  uint32_t flags; /**< WIS_WAVELET_LIGHT_*. */
  uint64_t bytes; /**< Bytes of the environment: that much of the block is in use and needs to be saved. */
  uint64_t squares; /**< Squares stored, each the averages of four children. */
  uint64_t sanitised; /**< Texels that were replaced. */
  uint64_t content_id; /**< Tells environments apart: a hash of the bytes. */
  double power; /**< The integral of luminance over the sphere, in the units of the map times steradian. */
  double error; /**< Sparse storage: the variance that pruning added, relative. */
} wis_wavelet_light_info;

/// Measures the memory of a build: exactly for a pyramid of a stated resolution, at most for sparse storage and for a pyramid whose cells
/// may be divided further. Work: constant.
enum wis_status wis_wavelet_light_size(const struct wis_wavelet_light_config *config, struct wis_memory_size *size,
    struct wis_diagnostic *diagnostic);

/// Builds an environment. `info`, which may be null, tells the bytes in use. WIS_INVALID_TEXEL: the diagnostic names column and row.
/// WIS_MEMORY_TOO_SMALL: the diagnostic tells the bytes that are needed. A map of 1024 x 512 costs about 0.3 s. Work: texels + cells.
enum wis_status wis_wavelet_light_init(const struct wis_wavelet_light_config *config, void *memory, size_t bytes, void *scratch,
    size_t scratch_bytes, const struct wis_wavelet_light **environment, struct wis_wavelet_light_info *info,
    struct wis_diagnostic *diagnostic);

/// Opens bytes that an earlier build wrote: copied, or mapped from a file. WIS_CORRUPT if a byte was changed; with the field `magic` in the
/// diagnostic if another version of wis wrote them. `info` may be null. Reads all bytes once. Work: bytes.
enum wis_status wis_wavelet_light_open(const void *memory, size_t bytes, const struct wis_wavelet_light **environment,
    struct wis_wavelet_light_info *info, struct wis_diagnostic *diagnostic);

#define WIS_WAVELET_LOBE_LAMBERT 1 /**< A lobe `weight / pi`. */

/// A lobe of Trowbridge-Reitz (GGX) microfacets: `weight F D G / (4 cos cos)` with height-correlated Smith shadowing and Schlick's Fresnel
/// term.
#define WIS_WAVELET_LOBE_GGX 2

#define WIS_WAVELET_LOBE_PHONG 3 /**< A lobe `weight (a + 2) / (2 pi) max(0, r.wi)^a` with r the mirror direction of wo. */
#define WIS_WAVELET_LOBE_TABLE 4 /**< A lobe `weight` times the table that is given with the query. */
#define WIS_WAVELET_QUERY_WHOLE_SPHERE 1 /**< Query flag: wi may lie on either side of the surface; the cosine is |n.wi|. */
#define WIS_WAVELET_QUERY_COSINE_INCLUDED 2 /**< Query flag: the values already contain the cosine: it is not multiplied again. */
#define WIS_WAVELET_MAX_LOBES 4 /**< Lobes in a query. */

/// One lobe of a BRDF.
typedef struct wis_wavelet_lobe {
  uint32_t kind; /**< WIS_WAVELET_LOBE_LAMBERT, WIS_WAVELET_LOBE_GGX, WIS_WAVELET_LOBE_PHONG or WIS_WAVELET_LOBE_TABLE. */
  float weight[3]; /**< Linear RGB factor, finite and not negative. */
  float f0[3]; /**< GGX: reflectance at normal incidence, RGB in [0, 1]. Others: not read. */
  float a; /**< GGX: alpha along the tangent, 1e-5 to 16. Phong: the exponent, 0 to 1e7. Others: not read. */
  float b; /**< GGX: alpha along the bitangent, 1e-5 to 16; equal to `a` for an isotropic lobe, never 0. Others: not read. */
} wis_wavelet_lobe;

/// A shading point: everything that the product needs to know of it. World space; plain and copyable.
typedef struct wis_wavelet_query {
  uint32_t size; /**< sizeof(wis_wavelet_query). */
  uint32_t flags; /**< WIS_WAVELET_QUERY_* flags, or 0: the upper hemisphere of the normal, the cosine not contained. */
  uint32_t lobe_count; /**< Lobes used, 0 to 4; with 0 there is nothing to sample. */
  float normal[3]; /**< The shading normal, unit length. */
  /// The direction of alpha `a`; need not be exactly normal to the normal. All 0, or along the normal: any, if no lobe is anisotropic; else
  /// WIS_INVALID_TRANSFORM.
  float tangent[3];
  float wo[3]; /**< The direction to the viewer, unit length. */
  struct wis_wavelet_lobe lobe[WIS_WAVELET_MAX_LOBES]; /**< The lobes, of which the first lobe_count are read. */
} wis_wavelet_query;

#define WIS_MAX_SQUARES 4096 /**< The most squares that a configuration may ask for. */

/// A prepared shading point: bytes in your memory without pointers, so it may be copied (to any block aligned to WIS_ALIGNMENT) and kept.
/// Every call on it also takes the light that it was prepared with. The same light, query and configuration give the same bytes.
typedef struct wis_wavelet_product wis_wavelet_product;

/// Evaluates the luminance of BRDF x cosine (at least 0, finite) for `count` world directions, at most 40, three floats each. Where the
/// BRDF is 0 outside a hemisphere, and not narrow, directions outside are asked for as their mirror images inside. Returns 0; anything else
/// stops the preparation with WIS_CALLBACK_FAILED.
typedef int (*wis_brdf_batch_fn)(void *user, size_t count, const float *wi, float *f_cos);

/// A BRDF that the client evaluates. It is called only while products are prepared.
typedef struct wis_wavelet_callback {
  uint32_t size; /**< sizeof(wis_wavelet_callback). */
  float half_angle; /**< The half-angle of the narrow lobe in radians, 0 to pi/2; 0: no narrow lobe. */
  float peak[3]; /**< The direction about which a narrow lobe is concentrated, unit length. Read if half_angle is above 0. */
  uint32_t reserved; /**< Always 0. */
  wis_brdf_batch_fn eval; /**< The BRDF. */
  void *user; /**< Handed to `eval`. */
} wis_wavelet_callback;

/// What a preparation may spend, how the map is turned, and what lobes alone do not say. Everything is read during the call.
typedef struct wis_wavelet_product_config {
  uint32_t size; /**< sizeof(wis_wavelet_product_config). */
  uint32_t max_squares; /**< Inner nodes of the product's tree, 1 to WIS_MAX_SQUARES; 0: 128. Bounds memory and time. */
  /// BRDF evaluations besides those of the 64 squares at most that narrow lobes ask for; 0: 66 for Lambert's lobes alone, 146 with a table
  /// or for a callback with a peak, else 106. At least 66 are spent.
  uint32_t max_evaluations;
  uint32_t reserved; /**< Always 0. */
  const float *world_from_map; /**< A row-major 3x3 rotation or reflection, world = M map, within 1e-4; null is the identity. */
  /// What lobes of the kind WIS_WAVELET_LOBE_TABLE mean; null: there are none. Densities are above 0 wherever the true BRDF may be, however
  /// coarse the table is.
  const struct wis_wavelet_table *table;
  /// The BRDF in place of the queries' lobes; of a query, `normal` and WIS_WAVELET_QUERY_WHOLE_SPHERE are then read. Null: lobes.
  const struct wis_wavelet_callback *callback;
} wis_wavelet_product_config;

/// What a prepared product is made of.
typedef struct wis_wavelet_product_info {
  uint32_t size; /**< sizeof(wis_wavelet_product_info), set by the caller. */
  uint32_t squares; /**< Inner nodes. */
  uint32_t leaves; /**< Leaves. */
  uint32_t evaluations; /**< BRDF evaluations that the preparation spent. */
  uint64_t bytes; /**< Bytes in use: that much of the block is the product. */
  uint64_t environment; /**< The content id of the light. */
  /// An approximation of the integral over directions of luminance x luminance of BRDF x cosine, without visibility, in the units of the
  /// map. A ratio or control variate that uses it inherits its error.
  double estimate;
} wis_wavelet_product_info;

/// Evaluates RGB of BRDF x cosine of a query for `count` directions of unit length (0 for others): what its lobes and the table, which may
/// be null, mean. Strides in bytes, 0: packed. Work: count x lobes x depth of the slices.
enum wis_status wis_wavelet_query_eval(const struct wis_wavelet_query *query, const struct wis_wavelet_table *table, size_t count,
    const float *wi, size_t wi_stride, float *f_cos, size_t f_cos_stride);

/// Measures the memory of a product; there is no scratch memory. Work: constant.
enum wis_status wis_wavelet_product_size(const struct wis_wavelet_product_config *config, struct wis_memory_size *size,
    struct wis_diagnostic *diagnostic);

/// Prepares the products of a light and `count` shading points. `memory`: `count` times the bytes of wis_wavelet_product_size. `product`
/// receives `count` handles. A query without lobes, or light and lobes that do not meet, give a product whose samples have pdf 0. On
/// failure, products before the query at fault, whose number is the diagnostic's `y`, are whole. Costs 1 us for Lambert's lobes to 6 us for
/// narrow ones each. Work: count x (squares + evaluations) x lobes.
enum wis_status wis_wavelet_product_prepare(const struct wis_wavelet_light *environment, const struct wis_wavelet_product_config *config,
    size_t count, const struct wis_wavelet_query *query, void *memory, size_t bytes, const struct wis_wavelet_product **product,
    struct wis_diagnostic *diagnostic);

/// Tells what a product is made of, and the approximation of its integral. Work: constant.
enum wis_status wis_wavelet_product_describe(const struct wis_wavelet_light *environment, const struct wis_wavelet_product *product,
    struct wis_wavelet_product_info *info);

/// Approximates the integral of radiance x BRDF x cosine in RGB. `table`: the one that the product was prepared with, whose colours count,
/// or null. WIS_NOT_BUILT without WIS_WAVELET_LIGHT_RGB, and for the product of a callback. Costs a BRDF evaluation for each leaf. Work:
/// squares x lobes.
enum wis_status wis_wavelet_product_estimate_rgb(const struct wis_wavelet_light *environment, const struct wis_wavelet_product *product,
    const struct wis_wavelet_table *table, double rgb[3]);

/// Draws `count` directions in proportion to a product, or, if `product` is null, to the light.
///
/// `world_from_map`: of the light alone; null is the identity. A product has its own, and this one then does not count. `u`: two numbers
/// each. `drawn`: directions and their pdfs, which are above 0 and the very bits that wis_wavelet_pdf answers for that direction; pdf 0 if
/// there is nothing to sample. Strides in bytes, 0: packed. Costs 40 to 80 ns each in batches of 16, 100 to 200 ns alone. Work: count x
/// (log squares + log cells).
enum wis_status wis_wavelet_sample(const struct wis_wavelet_light *environment, const struct wis_wavelet_product *product,
    const float world_from_map[9], size_t count, const float *u, size_t u_stride, struct wis_drawn *drawn, size_t drawn_stride);

/// The pdf of `count` directions in a product, or, if `product` is null, in the light, per steradian: above 0 wherever radiance x BRDF x
/// cosine is, and 0 for directions that are not of unit length. `world_from_map` and strides as in wis_wavelet_sample. Costs 20 to 50 ns
/// each in batches of 16. Work: count x (log squares + log cells).
enum wis_status wis_wavelet_pdf(const struct wis_wavelet_light *environment, const struct wis_wavelet_product *product,
    const float world_from_map[9], size_t count, const float *wi, size_t wi_stride, float *pdf, size_t pdf_stride);

/// The `u` that leads to each of `count` directions. `status`: WIS_OK, WIS_ZERO_DENSITY where no u leads there, or WIS_INVALID_TRANSFORM
/// for a direction that is not of unit length, each as a byte; where it is not WIS_OK, u is not written. `world_from_map` and strides as in
/// wis_wavelet_sample; statuses stand close together. Work: count x (log squares + log cells).
enum wis_status wis_wavelet_invert(const struct wis_wavelet_light *environment, const struct wis_wavelet_product *product,
    const float world_from_map[9], size_t count, const float *wi, size_t wi_stride, float *u, size_t u_stride, uint8_t *status);

/// The wavelets of a square that an approximation keeps. Approximations are lists of these, depth first: by position, and squares before
/// those inside them.
typedef struct wis_wavelets {
  uint32_t position; /**< The Morton code of the square's first pixel among 4096 x 4096 (axis 1 in the higher bit of each pair). */
  uint32_t level; /**< The square has the width 2^-level. */
  /// The details 1 (axis 2), 2 (axis 1) and 3 (both) in value space, 2^level times the orthonormal coefficients; 0 for those that were
  /// dropped.
  float detail[3];
} wis_wavelets;

/// The wavelets of a square of n axes that a set keeps.
typedef struct wis_details {
  /// The Morton code of the square's first pixel among 4096 along each axis: n bits a level, axis 1 the highest of each n.
  uint64_t position;
  uint32_t level; /**< The square has the width 2^-level. */
  uint32_t reserved; /**< Not read; 0 where the library writes. */
  /// Detail f, 1 to 2^n - 1, in value space: 2^(n level / 2) times the orthonormal coefficient of the wavelet that varies along the axes
  /// whose bits are set in f, axis 1 the highest of n. Others are not read; 0 where the library writes.
  float detail[16];
} wis_details;

#define WIS_MAX_BLEND 16 /**< The most trees or approximations that are blended at once: quadrilinear interpolation has 16. */
#define WIS_MAX_PLACES 16 /**< The most places along an axis of a pixel. */

/// Source of a tree: values on a grid. It reads `dimensions`, `depth`, `error_budget` and `pixels`.
///
/// wis_tree_size tells the bytes that the tree needs at most (the bytes that are in use stand in wis_tree_info; a block that is too short
/// fails with WIS_MEMORY_TOO_SMALL and tells them). It does not read the pixels. WIS_INVALID_TEXEL: `x` is the position along the last
/// axis, `y` the number of the row. Work: pixels.
#define WIS_TREE_PIXELS 0

/// Source of a tree: the product of two or three trees, sampled, saved and multiplied like any other. It reads `tree_count` and `trees`.
/// Trees behind the first have its first axes, at most as many, and are constant along the rest. The averages are exact but for rounding
/// (Clarberg et al. 2005, Section 4.3; with light, BRDF x cosine and visibility as factors the triple product of Ng et al. 2004). `error`
/// in wis_tree_info is 0: what was dropped from the factors is not counted. WIS_INVALID_ARGUMENT for another number of trees, or if a tree
/// has more axes than the first: `y` in the diagnostic is its number. WIS_OVERFLOW if the average is above 0 and below 2^-1022, or beyond a
/// double.
///
/// If all trees have the same axes the size is exact, and costs one visit of each square of the product. Otherwise it is an upper bound,
/// and costs one visit of each square of the trees. WIS_OVERFLOW if there may be more than 2^32 - 2 squares.
///
/// Blocks may be longer than wis_tree_size says, and serve for many products. They may be shorter, too: the call answers
/// WIS_MEMORY_TOO_SMALL as soon as the product exceeds the scratch block, or at the end if it exceeds the other one. The diagnostic then
/// tells enough bytes, of the scratch block as wis_tree_size does. Work: squares of the trees and of the product.
#define WIS_TREE_PRODUCT 1

/// Source of a tree: a blend, the weighted sum of 1 to WIS_MAX_BLEND trees of the same axes. It reads `tree_count`, `trees` and `weight`.
/// The sum is what stands between tabulated functions, exactly (Clarberg et al. 2005, Section 5.2: coefficients interpolate one by one).
/// The product of two such sums is the bilinear blend of the products of all pairs. WIS_INVALID_ARGUMENT for another number of trees, trees
/// of different axes, or a weight out of range: `y` in the diagnostic is the number of the tree or the weight. WIS_OVERFLOW as for
/// WIS_TREE_PRODUCT. `error` in wis_tree_info is 0.
///
/// wis_tree_size does not read the weights, and costs one visit of each square of the sum. Blocks may be longer than it says; one that is
/// too short fails with WIS_MEMORY_TOO_SMALL. Work: squares of all trees.
#define WIS_TREE_BLEND 2

/// Source of a tree: the average of a function of two axes and any set of its wavelets in order, free thresholding as the papers print it.
/// It reads `average`, `count`, `wavelets` and `least`. Such a function may be negative or 0 where what it approximates is not. Values
/// below `least` are raised to it, and the tree is that of the raised function, in average, sample and pdf alike. A `least` above 0 keeps
/// the pdf above 0 everywhere. WIS_INVALID_ARGUMENT if the list is out of order (`y` in the diagnostic is the first element that is), or if
/// values are too large for a tree: above 2^120 times the average. WIS_OVERFLOW if the tree's average is beyond a double.
///
/// The size is exactly the bytes in use, without scratch memory. wis_tree_size does not read `average` and `least`. Work: count.
#define WIS_TREE_WAVELETS 3

/// Source of a tree: as WIS_TREE_WAVELETS, for a function of 1 to 4 axes: what wis_sparse_multiply gives, as something to sample. It reads
/// `dimensions`, `average`, `count`, `details` and `least`. Work: count.
#define WIS_TREE_DETAILS 4

/// Source of a tree: the luminance of an environment over the octahedral square of another frame, a map that is rotated about a direction.
/// It is made when a scene asks for it (Clarberg et al. 2005, Section 6.1, make all of them beforehand). It reads `depth`, `error_budget`,
/// `least`, `environment`, `places`, `world_from_map` and `world_from_tree`. With a BRDF that is tabulated about the same direction
/// WIS_TREE_PRODUCT gives their product; WIS_TREE_BLEND interpolates between directions, wis_grid_cells says which.
///
/// wis_tree_size tells the bytes that the tree needs at most, and reads neither the environment nor the matrices. Costs (places 2^depth)^2
/// look-ups in the map. Work: places^2 x 4^depth.
#define WIS_TREE_ENVIRONMENT 5

/// The tree of a function: bytes in your memory without pointers, so it may be copied (to any block aligned to WIS_ALIGNMENT), saved and
/// mapped. Constant once built; any number of threads may use it at once. Nothing to free.
typedef struct wis_tree wis_tree;

/// What was built.
typedef struct wis_tree_info {
  uint32_t size; /**< sizeof(wis_tree_info), set by the caller. */
  uint32_t dimensions; /**< Axes. */
  uint32_t depth; /**< The grid has 2^depth pixels along each axis. */
  uint32_t squares; /**< Squares stored, each the averages of 2^n children. */
  uint64_t bytes; /**< Bytes of the tree: that much of the block is in use and needs to be saved. */
  uint64_t content_id; /**< Tells trees apart: a hash of the bytes. */
  double average; /**< The average of the function. */
  double error; /**< The variance that pruning added, relative. */
} wis_tree_info;

/// What to build. Fields that the source does not read need not be set.
typedef struct wis_tree_config {
  uint32_t size; /**< sizeof(wis_tree_config). */
  uint32_t source; /**< What the tree is made of: a WIS_TREE_ constant, which tells the fields that are read. 0 is WIS_TREE_PIXELS. */
  uint32_t dimensions; /**< Of pixels and details: axes n, 1 to 4. */
  /// Of pixels and environments: the grid has 2^depth pixels along each axis; 0 to 12. For environments the paper has 6 and 7.
  uint32_t depth;
  /// Of pixels and environments: the variance that pruning may add to an estimate of the integral, relative to its square, 0 or more (0.01
  /// = 1 %); 0 drops nothing but constant squares.
  float error_budget;
  const float *pixels; /**< Of pixels: 2^(n depth) values, C order: axis 1 slowest, the last axis fastest. Finite, 0 or more. */
  uint32_t tree_count; /**< Of products, 2 or 3, and of blends, 1 to WIS_MAX_BLEND: how many trees. */
  const struct wis_tree *const *trees; /**< Of products and blends: the trees. */
  const double *weight; /**< Of blends: a weight for each tree, finite, 0 or more. */
  double average; /**< Of wavelets and details: the average of the function, finite. */
  uint32_t count; /**< Of wavelets and details: elements of the list. */
  const struct wis_wavelets *wavelets; /**< Of wavelets: the list, in order. */
  const struct wis_details *details; /**< Of details: the list, in order. */
  /// Of wavelets and details: the value that smaller ones are raised to, finite, 0 or more. Of environments: the share of the map's mean
  /// that is added to each pixel, 0 to 1e6: what keeps the pdf above 0 wherever there is light.
  double least;
  const struct wis_wavelet_light *environment; /**< Of environments: the map. */
  /// Of environments: each pixel is the mean of places x places, 1 to WIS_MAX_PLACES, each of a cell of the map about as large as what it
  /// stands for; 2 is a good start.
  uint32_t places;
  /// Of environments: nine numbers, row by row: world = M map, within 1e-4 of a rotation or reflection; null is the identity.
  const float *world_from_map;
  /// Of environments: the same from the frame of the tree: the direction about which the map is rotated is its third column. Null is the
  /// identity.
  const float *world_from_tree;
} wis_tree_config;

/// The memory of a tree, as its source tells. WIS_INVALID_ARGUMENT with the field `source` for a number that is none. Work: constant for
/// pixels and environments; count for lists; else squares of the trees and of the result.
enum wis_status wis_tree_size(const struct wis_tree_config *config, struct wis_memory_size *size, struct wis_diagnostic *diagnostic);

/// Builds a tree of what its configuration says. Each source tells its statuses, the bounds of its blocks and its work. `scratch` may be
/// null where wis_tree_size asks for none. `info` may be null. The bytes in use stand in `info`. Work: pixels; places^2 x 4^depth for
/// environments; count for lists; else squares of the trees and of the result.
enum wis_status wis_tree_init(const struct wis_tree_config *config, void *memory, size_t bytes, void *scratch, size_t scratch_bytes,
    const struct wis_tree **tree, struct wis_tree_info *info, struct wis_diagnostic *diagnostic);

/// Checks bytes that an earlier build wrote (copied, or mapped from a file) and gives them as a tree. WIS_CORRUPT if a byte was changed;
/// with the field `magic` in the diagnostic if another version of wis wrote them. Reads all of them once. `info` may be null. Work: bytes.
enum wis_status wis_tree_open(const void *memory, size_t bytes, const struct wis_tree **tree, struct wis_tree_info *info,
    struct wis_diagnostic *diagnostic);

/// The average of the function. Work: constant.
enum wis_status wis_tree_average(const struct wis_tree *tree, double *average);

/// The integral over the unit cube of the product of the stored functions. `f` has the first axes of `e`, at most as many (else
/// WIS_INVALID_ARGUMENT), and is constant along the rest. At least 0; WIS_OVERFLOW if it is beyond a double. Costs one visit of each square
/// that both trees keep. Work: squares.
enum wis_status wis_tree_product_integral(const struct wis_tree *e, const struct wis_tree *f, double *integral);

/// Samples a point of the unit cube in proportion to the function. `u`: n numbers in [0, 1) (others are moved there, NaN counts as 1/2);
/// `point`: n numbers; `pdf`: the density there with respect to the cube. A tree that is 0 everywhere gives pdf 0. Work: depth.
enum wis_status wis_tree_sample(const struct wis_tree *tree, const float *u, float *point, float *pdf);

/// The density at any point (coordinates are moved into [0, 1)): the very bits that a sample came with. Work: depth.
enum wis_status wis_tree_pdf(const struct wis_tree *tree, const float *point, float *pdf);

/// The `u` that leads to a point. WIS_ZERO_DENSITY if none does. Work: depth.
enum wis_status wis_tree_invert(const struct wis_tree *tree, const float *point, float *u);

/// Warps `count` points (n packed numbers each) in place; afterwards points of one cell stand together. The points and `index` (your
/// numbers of the points) are permuted alike; as a set, the points are those of wis_tree_sample to the bit. WIS_ZERO_DENSITY if the tree is
/// 0 everywhere. Work: count x depth.
enum wis_status wis_warp_in_place(const struct wis_tree *tree, float *points, uint32_t *index, size_t count,
    struct wis_diagnostic *diagnostic);

#define WIS_MAX_SLICES 256 /**< The most slices of a table. */

/// An isotropic BRDF x cosine as trees that you built and that stay yours: slice k is its luminance for the view whose angle to the normal
/// is `(k + 1/2) / slice_count` of a right angle, over the octahedral square about the mirror direction (wis_wavelet_table_directions).
/// Other views blend the two slices beside them (Clarberg et al. 2005, Section 5). Directions are sampled by luminance; colours, if there
/// are any, are what wis_wavelet_query_eval tells.
typedef struct wis_wavelet_table {
  uint32_t size; /**< sizeof(wis_wavelet_table). */
  uint32_t slice_count; /**< Slices, 1 to WIS_MAX_SLICES; the paper has 16 and 32. */
  /// The slices, trees of two axes (else WIS_INVALID_ARGUMENT) whose averages are floats (else WIS_OVERFLOW). Null for a slice that was not
  /// built: the other one beside the view then stands in, and without both the answer is WIS_NOT_BUILT.
  const struct wis_tree *const *slice;
  const struct wis_tree *const *colour[3]; /**< As `slice`, red, green and blue; three nulls: the table is grey, as its luminance says. */
} wis_wavelet_table;

/// The directions at which a slice is to be evaluated: `wo`, three numbers, and 4^depth `wi`, in the order of the pixels of
/// wis_tree_config, in a frame whose normal is +z and in which wo has y = 0. `offset`: two numbers, where in each pixel, 1/2 for its
/// centre. Average several places, and choose pixels (2 / 2^depth radians wide at the mirror direction) that are finer than the lobe:
/// samples are as uneven as the lobe is inside a pixel. wi below the surface are given too. The stride is in bytes; 0: packed. Work:
/// 4^depth.
enum wis_status wis_wavelet_table_directions(uint32_t slice, uint32_t slice_count, uint32_t depth, const float offset[2], float wo[3],
    float *wi, size_t wi_stride);

#define WIS_HAAR_FORWARD 0 /**< Direction of wis_haar: from an image to its coefficients. */
#define WIS_HAAR_INVERSE 1 /**< Direction of wis_haar: from the coefficients to the image. */

/// Replaces an image by its orthonormal non-standard Haar coefficients, in place, or these by the image. `values`: `count` = 2^(n depth)
/// numbers, C order (axis 1 slowest), at most 1e290 in size; `dimensions` n = 1 to 4, `depth` at most 12. The coefficient of level l,
/// translation t and wavelet f = (f1 .. fn) replaces the pixel at coordinates (2 t_q + f_q) 2^(depth - 1 - l), the scaling coefficient the
/// pixel at the origin. WIS_INVALID_ARGUMENT for anything out of these ranges, or another `direction` than WIS_HAAR_FORWARD and
/// WIS_HAAR_INVERSE. Work: count.
enum wis_status wis_haar(uint32_t direction, uint32_t dimensions, uint32_t depth, size_t count, double *values,
    struct wis_diagnostic *diagnostic);

/// Rule of wis_triple_terms: the fewest that leave a relative L2 error of at most `bound`. Costs 33 visits of each square.
#define WIS_TERMS_ERROR 0

/// Rule of wis_triple_terms: those with an orthonormal coefficient of at least `bound`, as those keep who threshold. One visit of each
/// square.
#define WIS_TERMS_THRESHOLD 1

/// A function of two axes: its average, and some of its wavelets, depth first.
typedef struct wis_wavelet_set {
  uint32_t size; /**< sizeof(wis_wavelet_set). */
  uint32_t count; /**< Elements of `wavelets`. */
  double average; /**< Over the whole square; finite, may be negative. */
  const struct wis_wavelets *wavelets; /**< By position, and squares before those inside them. Null if there are none. */
} wis_wavelet_set;

/// As wis_wavelet_set, of 1 to 4 axes.
typedef struct wis_detail_set {
  uint32_t size; /**< sizeof(wis_detail_set). */
  uint32_t axes; /**< How many axes, 1 to 4. */
  uint32_t count; /**< Elements of `details`. */
  uint32_t reserved; /**< Always 0. */
  double average; /**< Over the whole cube; finite, may be negative. */
  const struct wis_details *details; /**< By position, and squares before those inside them. Null if there are none. */
} wis_detail_set;

/// How many of a tree's largest wavelets wis_triple_select and wis_sparse_select are asked to keep, by a `rule`: WIS_TERMS_ERROR or
/// WIS_TERMS_THRESHOLD, else WIS_INVALID_ARGUMENT. `bound` is 0 or more. Work: squares.
enum wis_status wis_triple_terms(const struct wis_tree *tree, uint32_t rule, double bound, uint32_t *terms);

/// As wis_triple_select, for a tree of 1 to 4 axes: its `keep` wavelets with the largest orthonormal coefficients, into `kept`. Work:
/// squares.
enum wis_status wis_sparse_select(const struct wis_tree *tree, uint32_t keep, struct wis_details *kept, uint32_t *kept_count,
    struct wis_diagnostic *diagnostic);

/// The product of two functions (Clarberg et al. 2005, Section 4.3; values may be negative): its average and its wavelets, without
/// decompression: each square that either has a wavelet in is visited once. `wavelets` has room for `room` elements. WIS_MEMORY_TOO_SMALL
/// if the product has more squares: then nothing is multiplied, and `wavelet_count` alone is written. It tells how many squares the product
/// has, at most 12 times the sum of both counts. WIS_INVALID_ARGUMENT for an average that is not finite, or a list that is out of order:
/// `y` in the diagnostic is the first element that is. WIS_OVERFLOW if the average is beyond a double or a detail beyond a float;
/// `wavelets` is then undefined. Work: wavelets of e and f.
enum wis_status wis_triple_multiply(const struct wis_wavelet_set *e, const struct wis_wavelet_set *f, uint32_t room,
    struct wis_wavelets *wavelets, uint32_t *wavelet_count, double *average, struct wis_diagnostic *diagnostic);

/// As wis_triple_multiply, for a function `e` of 1 to 4 axes, and one, `f`, of the first of them, constant along the rest (Clarberg et al.
/// 2005, Section 4.3). Where `e` is constant and `f` is not, the product has as many squares as n axes ask for: 2^((n - m) level) for each
/// of the m axes of `f`. A `product_count` of 2^32 - 1 stands for that many or more. Work: details of e and f + squares of the product.
enum wis_status wis_sparse_multiply(const struct wis_detail_set *e, const struct wis_detail_set *f, uint32_t room,
    struct wis_details *product, uint32_t *product_count, double *average, struct wis_diagnostic *diagnostic);

/// A non-standard Haar function of n variables: the product of functions of one level.
typedef struct wis_basis_function {
  uint32_t level; /**< The support is a cube of the width 2^-level, at most 31. */
  uint32_t translation[4]; /**< Where it stands among 2^level along each axis; axes beyond the dimensions are not read. */
  uint32_t wavelet; /**< psi instead of phi: bit n - 1 along axis 1, and so on to bit 0 along axis n. */
} wis_basis_function;

/// Rule of wis_triple_select: the wavelets with the largest orthonormal coefficients (non-linear approximation).
#define WIS_SELECT_WAVELETS 0

/// Rule of wis_triple_select: whole squares, those whose three coefficients have the largest sum of squares (Ng et al. 2004, Section 7.2,
/// keeps the light's squares so).
#define WIS_SELECT_SQUARES 1

/// The integral of the product of two Haar functions `i` and `j` of n variables and one, `k`, of the first m of them (Clarberg et al. 2005,
/// Eq. 5): the generalised tripling coefficient. n is 1 to 4 and m 1 to n. With the constant (level 0, no wavelet) as `k` it is the
/// non-standard coupling coefficient of `i` and `j`. WIS_INVALID_ARGUMENT for anything out of range. Work: constant.
enum wis_status wis_tripling_coefficient(uint32_t n, uint32_t m, const struct wis_basis_function *i, const struct wis_basis_function *j,
    const struct wis_basis_function *k, double *coefficient);

/// The integral over the unit square of BRDF x light x visibility (Ng et al. 2004, Section 5), three trees of two axes
/// (WIS_INVALID_ARGUMENT for others), in any order. At least 0, and exact but for the rounding of stored averages: the relative error is at
/// most 2e-7. WIS_OVERFLOW if it is beyond a double. Costs one visit of each square that two of the trees keep. For the six faces of a cube
/// map, or three channels, add up as many calls. Work: squares.
enum wis_status wis_triple_integral(const struct wis_tree *brdf, const struct wis_tree *light, const struct wis_tree *visibility,
    double *integral);

/// Keeps `keep` wavelets, or whole squares, of a tree of two axes, as `rule` says: WIS_SELECT_WAVELETS or WIS_SELECT_SQUARES (else
/// WIS_INVALID_ARGUMENT); of equal ones the first in depth-first order. `wavelets` has room for `keep` elements; `wavelet_count` tells how
/// many squares were written, at most that many. WIS_OVERFLOW if a detail that is kept is beyond a float; `wavelets` is then undefined.
/// Costs 33 visits of each square: do it when the function is built. Work: squares.
enum wis_status wis_triple_select(const struct wis_tree *tree, uint32_t rule, uint32_t keep, struct wis_wavelets *wavelets,
    uint32_t *wavelet_count, struct wis_diagnostic *diagnostic);

/// The triple product integral with approximations of BRDF and light (Ng et al. 2004, Section 5.3): wavelets of the BRDF meet the exact
/// light and visibility, and light and visibility meet the approximate BRDF where the light's wavelet is kept. `brdf_average`: the BRDF's
/// mean over the square, finite; both lists as wis_triple_select writes them (WIS_INVALID_ARGUMENT if they are out of order; `y` in the
/// diagnostic is the first element that is). The exact integral, but for rounding, if nothing was dropped. An integral that is 0 or small
/// may come out below 0, by what was dropped or by rounding. WIS_OVERFLOW if it is beyond a double. Costs a few steps down the trees for
/// each element, whatever the resolution. Work: brdf_count + light_count.
enum wis_status wis_triple_sublinear(double brdf_average, uint32_t brdf_count, const struct wis_wavelets *brdf, uint32_t light_count,
    const struct wis_wavelets *kept_light, const struct wis_tree *light, const struct wis_tree *visibility, double *integral,
    struct wis_diagnostic *diagnostic);

/// The weighted sum of up to WIS_MAX_BLEND approximations: a BRDF between tabulated ones, as the 16 nearest pairs of normal and reflected
/// direction give it (Ng et al. 2004, Section 7.1.2; wis_grid_cells). `list`: as wis_triple_select writes them, `list_count` elements each;
/// `weight`: finite. `wavelets` has room for `room` elements; `wavelet_count` tells how many squares the sum has. WIS_MEMORY_TOO_SMALL if
/// there is no room for them; the sum of all counts is always enough. WIS_OVERFLOW if a detail is beyond a float. `wavelets` is undefined
/// after both. Averages are blended with the same weights. Work: elements of all lists.
enum wis_status wis_triple_blend(uint32_t count, const struct wis_wavelets *const *list, const uint32_t *list_count, const double *weight,
    uint32_t room, struct wis_wavelets *wavelets, uint32_t *wavelet_count, struct wis_diagnostic *diagnostic);

/// A map of visibility in 8 bits: bytes in your memory without pointers, so it may be copied (to any block aligned to WIS_ALIGNMENT), saved
/// and mapped. A third of the tree that it was made of. Constant; any number of threads may use it at once. Nothing to free.
typedef struct wis_visibility wis_visibility;

/// The memory that wis_visibility_init needs: exactly the bytes that are to be saved. WIS_INVALID_ARGUMENT for a tree of other than two
/// axes. Work: constant.
enum wis_status wis_visibility_size(const struct wis_tree *tree, struct wis_memory_size *size, struct wis_diagnostic *diagnostic);

/// Stores a tree of two dimensions whose values are 0 (occluded) to 1 (visible) in 8 bits: exactly if they are 0 or 1, up to 1/510 in the
/// averages of larger squares (Ng et al. 2004, Section 7.1.1). WIS_INVALID_ARGUMENT for values above 1. Work: squares.
enum wis_status wis_visibility_init(const struct wis_tree *tree, void *memory, size_t bytes, const struct wis_visibility **visibility,
    struct wis_diagnostic *diagnostic);

/// Checks bytes that wis_visibility_init wrote (copied, or mapped from a file) and gives them as a map of visibility. WIS_CORRUPT if a byte
/// was changed; with the field `magic` in the diagnostic if another version of wis wrote them. Reads all of them once. Work: bytes.
enum wis_status wis_visibility_open(const void *memory, size_t bytes, const struct wis_visibility **visibility,
    struct wis_diagnostic *diagnostic);

/// As wis_triple_sublinear, for visibility in 8 bits. Work: brdf_count + light_count.
enum wis_status wis_visibility_integral(double brdf_average, uint32_t brdf_count, const struct wis_wavelets *brdf, uint32_t light_count,
    const struct wis_wavelets *kept_light, const struct wis_tree *light, const struct wis_visibility *visibility, double *integral,
    struct wis_diagnostic *diagnostic);

/// The integral over the unit square of a tree of two dimensions as it is seen through a map of visibility (a double product). Nothing is
/// dropped: exact but for rounding where visibility is 0 or 1. At least 0; WIS_OVERFLOW if it is beyond a double. If many vertices share a
/// BRDF, as all that have one normal or one reflected direction, multiply it by the light once for a frame: this is then faster for each
/// vertex than wis_visibility_integral, and no approximation. Work: squares.
enum wis_status wis_visibility_product_integral(const struct wis_tree *tree, const struct wis_visibility *visibility, double *integral);

#define WIS_MAX_GRID 4096 /**< The most cells along an axis. */

/// The centre of a cell of a grid of `side` x `side` directions (1 to WIS_MAX_GRID): the direction at which to tabulate what wis_grid_cells
/// then finds. Cells are pixels of the octahedral square, axis 1 slowest. WIS_INVALID_ARGUMENT for a side or a cell out of range. Work:
/// constant.
enum wis_status wis_grid_direction(uint32_t side, uint32_t cell, float direction[3]);

/// The four cells about a direction of unit length (else WIS_INVALID_TRANSFORM) and their bilinear weights, which add up to 1. For pairs of
/// directions, as a normal and the reflected direction, the 16 products of two weights interpolate quadrilinearly. Cells may repeat where
/// the sheets of the square meet. Work: constant.
enum wis_status wis_grid_cells(uint32_t side, const float wi[3], uint32_t cell[4], float weights[4]);
/** @} */

#ifdef __cplusplus
}
#endif

#endif /* WIS_WAVELETS_H */
