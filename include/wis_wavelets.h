/* SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * wis_wavelets: wavelet trees of light and BRDF, their products, and sampling from them.
 * Generated from the Rust sources: edit those, then run `make header`.
 *
 * Wavelet importance sampling (Clarberg et al. 2005) at a shading point. Once for a material: a table of BRDF x cosine, each slice a
 * tree of WIS_TREE_PIXELS (wis_table_view, wis_square_direction). Once for a mirror direction: the light about it, a tree of
 * WIS_TREE_ENVIRONMENT, made of the renderer's wis_environment. At a hit: WIS_TREE_BLEND of two slices, WIS_TREE_PRODUCT of both
 * trees, and wis_warp_in_place or wis_tree_sample, wis_tree_pdf and wis_tree_invert. c-examples/wavelets.c is the whole way. For
 * rendering, wis_direct and wis_product in wis.h are faster: they build no trees at a hit.
 *
 * Trees of any function of two or four variables: wis_tree_*, wis_warp_*. wis_tree_init also makes trees of products and
 * sums of trees, of lists of wavelets and of rotated maps. Such lists in 3 to 4 bytes a wavelet: wis_sparse_*. Triple product integrals
 * of BRDF, light and visibility (Ng et al. 2004): wis_triple_*, wis_visibility_*.
 *
 * The rules of wis.h for memory, threads, failure, structs, arguments, spaces and random numbers hold here.
 */

#ifndef WIS_WAVELETS_H
#define WIS_WAVELETS_H

#include "wis.h"

#ifdef __cplusplus
extern "C" {
#endif

/** @defgroup wavelets Wavelets
 *  Wavelet importance sampling (Clarberg and others, 2005) and triple products (Ng and others, 2004). */ /** @{ */

/// The wavelets of a square that an approximation keeps. Approximations are lists of these, depth first: by position, and squares before
/// those inside them.
typedef struct wis_wavelets {
  uint32_t position; /**< The Morton code of the square's first pixel among 4096 x 4096 (axis 1 in the higher bit of each pair). */
  uint32_t level; /**< The square has the width 2^-level. */
  /// The details 1 (axis 2), 2 (axis 1) and 3 (both) in value space, 2^level times the orthonormal coefficients; 0 for those that were
  /// dropped.
  float detail[3];
} wis_wavelets;

#define WIS_MAX_BLEND 16 /**< The most trees or approximations that are blended at once: quadrilinear interpolation has 16. */

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

/// Source of a tree: the luminance of an environment over the octahedral square of another frame, a map that is rotated about a direction
/// (Clarberg et al. 2005, Section 6.1). It reads `depth`, `error_budget`, `least`, `environment` and `world_from_tree`. With a BRDF that is
/// tabulated about the same direction WIS_TREE_PRODUCT gives their product; WIS_TREE_BLEND interpolates between directions, wis_grid_cells
/// says which.
///
/// Each patch of the light hands its share out to the pixels that it covers, so that `average` in wis_tree_info is the power in
/// wis_environment_info over 4 pi: no lamp is lost, however small. Pixels of an even sky differ by 0.6 % (root mean square). Of a
/// compensated environment it is the tree of what compensation leaves. wis_tree_size tells the bytes that the tree needs at most, and reads
/// neither the environment nor the matrix. Work: (columns + 2^depth) x (rows + 2^depth), of the map with all its faces.
#define WIS_TREE_ENVIRONMENT 4

/// The tree of a function: bytes in your memory without pointers, so it may be copied (to any block aligned to WIS_ALIGNMENT), saved and
/// mapped. Constant once built; any number of threads may use it at once. Nothing to free.
typedef struct wis_tree wis_tree;

/// What to build. Fields that the source does not read need not be set.
typedef struct wis_tree_config {
  uint32_t size; /**< sizeof(wis_tree_config). */
  uint32_t source; /**< What the tree is made of: a WIS_TREE_ constant, which tells the fields that are read. 0 is WIS_TREE_PIXELS. */
  uint32_t dimensions; /**< Of pixels: axes n, 2 (a direction) or 4 (two directions). */
  /// Of pixels and environments: the grid has 2^depth pixels along each axis; 0 to 12. For environments the paper has 6 and 7.
  uint32_t depth;
  /// Of pixels and environments: the variance that pruning may add to an estimate of the integral, relative to its square, 0 or more (0.01
  /// = 1 %); 0 drops nothing but constant squares.
  float error_budget;
  const float *pixels; /**< Of pixels: 2^(n depth) values, C order: axis 1 slowest, the last axis fastest. Finite, 0 or more. */
  uint32_t tree_count; /**< Of products, 2 or 3, and of blends, 1 to WIS_MAX_BLEND: how many trees. */
  const struct wis_tree *const *trees; /**< Of products and blends: the trees. */
  const double *weight; /**< Of blends: a weight for each tree, finite, 0 or more. */
  double average; /**< Of wavelets: the average of the function, finite. */
  uint32_t count; /**< Of wavelets: elements of the list. */
  const struct wis_wavelets *wavelets; /**< Of wavelets: the list, in order. */
  /// Of wavelets: the value that smaller ones are raised to, finite, 0 or more. Of environments: the share of the map's mean that is added
  /// to each pixel, 0 to 1e6: what keeps the pdf above 0 wherever there is light.
  double least;
  const struct wis_environment *environment; /**< Of environments: the map. */
  /// Of environments: nine numbers, row by row: world = M tree, within 1e-4 of a rotation or reflection. The direction about which the map
  /// is rotated is the third column. Null is the identity.
  const float *world_from_tree;
} wis_tree_config;

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

/// The memory of a tree, as its source tells. WIS_INVALID_ARGUMENT with the field `source` for a number that is none. Work: constant for
/// pixels and environments; count for lists; else squares of the trees and of the result.
enum wis_status wis_tree_size(const struct wis_tree_config *config, struct wis_memory_size *size, struct wis_diagnostic *diagnostic);

/// Builds a tree of what its configuration says. Each source tells its statuses, the bounds of its blocks and its work. `scratch` may be
/// null where wis_tree_size asks for none. `info` may be null. The bytes in use stand in `info`. Work: pixels; (columns + 2^depth) x (rows
/// + 2^depth) for environments; count for lists; else squares of the trees and of the result.
enum wis_status wis_tree_init(const struct wis_tree_config *config, void *memory, size_t bytes, void *scratch, size_t scratch_bytes,
    const struct wis_tree **tree, struct wis_tree_info *info, struct wis_diagnostic *diagnostic);

/// Checks bytes that an earlier build wrote (copied, or mapped from a file) and gives them as a tree. WIS_CORRUPT if a byte was changed;
/// with the field `magic` in the diagnostic if another version of wis wrote them. Reads all of them once. `info` may be null. Work: bytes.
enum wis_status wis_tree_open(const void *memory, size_t bytes, const struct wis_tree **tree, struct wis_tree_info *info,
    struct wis_diagnostic *diagnostic);

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
#define WIS_MAX_GRID 4096 /**< The most cells of a grid along an axis. */

/// How a table of an isotropic BRDF x cosine is read at a shading point (Clarberg et al. 2005, Section 5). Slice k is a tree of two axes
/// for the view whose angle to the normal is `(k + 1/2) / slice_count` of a right angle, over the octahedral square about the mirror
/// direction. Other views blend the two slices beside them: WIS_TREE_BLEND with these weights.
///
/// To build slice k, call this with its own view, and evaluate BRDF x cosine where wis_square_direction leads with `world_from_tree`.
/// Choose pixels (2 / 2^depth radians wide at the mirror direction) that are finer than the lobe: samples are as uneven as the lobe is
/// inside a pixel.
///
/// `slice_count`: 1 to WIS_MAX_SLICES; the paper has 16 and 32. `normal` and `wo`, the direction to the viewer, have unit length, else
/// WIS_INVALID_TRANSFORM; a `wo` below the surface counts as one along it. `slice`: the two slices, which may be the same; `weight`: two
/// numbers that add up to 1. `world_from_tree`: nine numbers as wis_tree_config has them, for WIS_TREE_ENVIRONMENT. Work: constant.
enum wis_status wis_table_view(uint32_t slice_count, const float normal[3], const float wo[3], uint32_t slice[2], double weight[2],
    float world_from_tree[9]);

/// The four cells about a direction of unit length (else WIS_INVALID_TRANSFORM) in a grid of `side` x `side` (1 to WIS_MAX_GRID), and their
/// bilinear weights, which add up to 1. Cells are pixels of the octahedral square, axis 1 slowest; tabulate at their centres
/// (wis_square_direction). For pairs of directions, as a normal and the reflected direction, the 16 products of two weights interpolate
/// quadrilinearly. Cells may repeat where the sheets of the square meet. Work: constant.
enum wis_status wis_grid_cells(uint32_t side, const float wi[3], uint32_t cell[4], float weights[4]);

/// The world direction of a point of the octahedral square of a frame: of a sample of a tree of light or BRDF. The pdf per steradian is
/// that of the tree over 4 pi. Coordinates in [0, 1], else WIS_INVALID_ARGUMENT. `world_from_tree` as in wis_tree_config; null is the
/// identity. Work: constant.
enum wis_status wis_square_direction(const float point[2], const float world_from_tree[9], float direction[3]);

/// The point of the octahedral square of a frame for a world direction of unit length (else WIS_INVALID_TRANSFORM): where wis_tree_pdf and
/// wis_tree_invert take it. `world_from_tree` as in wis_square_direction. Work: constant.
enum wis_status wis_square_point(const float wi[3], const float world_from_tree[9], float point[2]);

/// Rule of wis_triple_terms: the fewest that leave a relative L2 error of at most `bound`. Costs 33 visits of each square.
#define WIS_TERMS_ERROR 0

/// Rule of wis_triple_terms: those with an orthonormal coefficient of at least `bound`, as those keep who threshold. One visit of each
/// square.
#define WIS_TERMS_THRESHOLD 1

/// Rule of wis_triple_select: the wavelets with the largest orthonormal coefficients (non-linear approximation).
#define WIS_SELECT_WAVELETS 0

/// Rule of wis_triple_select: whole squares, those whose three coefficients have the largest sum of squares (Ng et al. 2004, Section 7.2,
/// keeps the light's squares so).
#define WIS_SELECT_SQUARES 1

/// How many of the largest wavelets of a tree of two axes wis_triple_select is asked to keep, by a `rule`: WIS_TERMS_ERROR or
/// WIS_TERMS_THRESHOLD, else WIS_INVALID_ARGUMENT. `bound` is 0 or more. Work: squares.
enum wis_status wis_triple_terms(const struct wis_tree *tree, uint32_t rule, double bound, uint32_t *terms);

/// Stores a function of two axes as the papers do: its average, and any of its wavelets as an index by difference and 16 bits of one scale,
/// 3 to 4 bytes for each where they are dense (Clarberg et al. 2005, Section 7, has 300 kB for 2 % of 16 x 16 slices of 64 x 64 in three
/// colours, and 5 MB for 32 x 32 of 128 x 128). A slice of a table takes a call; slices may stand one behind another, without alignment.
///
/// `average`: finite, kept as a float. `wavelets`: as wis_triple_select writes them (WIS_INVALID_ARGUMENT if they are out of order; `y` in
/// the diagnostic is the first element that is). Coefficients are rounded to 1/32767 of the largest orthonormal one, and dropped where that
/// is 0. `packed` has room for `room` bytes; `packed_bytes` tells how many the function takes: at most 16, and 18 for each element.
/// WIS_MEMORY_TOO_SMALL if there is no room for them; `packed` is then undefined. WIS_OVERFLOW if the average is beyond a float. Work:
/// count.
enum wis_status wis_sparse_pack(double average, uint32_t count, const struct wis_wavelets *wavelets, size_t room, uint8_t *packed,
    size_t *packed_bytes, struct wis_diagnostic *diagnostic);

/// Reads what wis_sparse_pack wrote, one function at a time, as a list for WIS_TREE_WAVELETS, from which trees are sampled, queried and
/// multiplied, and for wis_triple_sublinear, wis_triple_blend and wis_visibility_integral. `packed`: `packed_bytes` bytes, of which as many
/// are read as the function has. WIS_CORRUPT if they are no such function. A change that leaves one is not noticed: there is no checksum.
/// `wavelets` has room for `room` elements; `wavelet_count` tells how many squares there are, at most a third of the bytes.
/// WIS_MEMORY_TOO_SMALL if there is no room for them. `wavelets` is undefined after both. Work: packed_bytes.
enum wis_status wis_sparse_unpack(const uint8_t *packed, size_t packed_bytes, uint32_t room, struct wis_wavelets *wavelets,
    uint32_t *wavelet_count, double *average, struct wis_diagnostic *diagnostic);

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
/** @} */

#ifdef __cplusplus
}
#endif

#endif /* WIS_WAVELETS_H */
