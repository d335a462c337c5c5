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
