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
