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
 * the memory of the object is undefined; the diagnostic, which may be null, says where the fault is. Other pointers
 * must not be null unless their comment says so.
 *
 * Structs. Where the first field is `size`, set it to sizeof the struct and every field that is not used to 0.
 *
 * Arguments stand in the order objects, config, count, inputs, outputs. A stride is the distance in bytes between
 * the first floats of neighbouring elements; 0: they stand close together.
 *
 * Spaces and units. A direction is three floats x, y, z of unit length in world space and points away from the
 * surface: wo to the eye, wi to the light. A pdf is per solid angle, in 1/sr. Radiance is in the unit of the map.
 * A map's own axis is z; world_from_map is a row-major 3x3 rotation or reflection, null for the identity.
 *
 * Random numbers. A sample takes u in [0, 1)^2 and keeps its stratification. A u outside is clamped, NaN is 0.5.
 */
