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
