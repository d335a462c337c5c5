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
