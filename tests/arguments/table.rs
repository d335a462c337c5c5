//! Every function of the library, callable with one machine word for each argument.

use wis::ffi::check::*;
use wis::ffi::direct::*;
use wis::ffi::light::*;
use wis::ffi::lights::*;
use wis::ffi::material::*;
use wis::ffi::points::*;
use wis::ffi::product::*;
use wis::ffi::sampler::*;
use wis::ffi::sampling::*;
use wis::ffi::visibility::*;
use wis::ffi::wave::*;
use wis::ffi::wavelets::table::*;
use wis::ffi::wavelets::tree::*;
use wis::ffi::wavelets::triple::*;
use wis::ffi::wavelets::visibility::*;
use wis::ffi::{wis_status_string, wis_version};

/// A function, its parameters in order, and how it is called.
pub struct Entry {
    pub name: &'static str,
    pub parameters: &'static [&'static str],
    pub call: fn(&[usize]) -> usize,
}

macro_rules! table {
    ($($name:ident($($parameter:ident),*);)*) => {
        &[$(Entry {
            name: stringify!($name),
            parameters: &[$(stringify!($parameter)),*],
            call: |arguments| {
                let mut arguments = arguments.iter().copied();
                $(let $parameter = arguments.next().expect(stringify!($parameter));)*
                assert_eq!(arguments.next(), None);
                // SAFETY: the tests hand over null, misaligned or valid pointers to blocks as long as they say.
                #[allow(unused_unsafe)]
                unsafe { $name($($parameter as _),*) as usize }
            },
        }),*]
    };
}

pub const TABLE: &[Entry] = table! {
    wis_status_string(status);
    wis_version();
    wis_environment_size(config, size, diagnostic);
    wis_environment_init(config, memory, bytes, scratch, scratch_bytes, environment, diagnostic);
    wis_environment_begin(config, scratch, scratch_bytes, items, diagnostic);
    wis_environment_run(config, memory, bytes, scratch, scratch_bytes, pass, first, count, diagnostic);
    wis_environment_finish(config, memory, bytes, scratch, scratch_bytes, environment, diagnostic);
    wis_environment_open(memory, bytes, environment, diagnostic);
    wis_environment_describe(environment, info);
    wis_environment_turn(memory, bytes, world_from_map, environment, diagnostic);
    wis_sampler_size(config, size, diagnostic);
    wis_sampler_init(config, memory, bytes, sampler, diagnostic);
    wis_sampler_begin_pixel(sampler);
    wis_sampler_fault(sampler, fault);
    wis_visibility_cache_size(places, size, diagnostic);
    wis_visibility_cache_init(places, memory, bytes, cache, diagnostic);
    wis_visibility_cache_record(point, count, wi, wi_stride, reached);
    wis_visibility_cache_end_pass(cache);
    wis_visibility_key(position, normal, cell, visibility_key);
    wis_material_init(material, diagnostic);
    wis_base(environment, radiance, base);
    wis_direct(sampler, environment, point, rays, ray, ray_count);
    wis_direct_wave(sampler, environment, count, wave);
    wis_product_size(config, size, diagnostic);
    wis_product_prepare(sampler, environment, config, count, point, memory, bytes, offset, bytes_used);
    wis_product_open(environment, memory, bytes, product, diagnostic);
    wis_product_describe(environment, product, info);
    wis_product_covers(product, point, covers);
    wis_sample(sampler, environment, product, count, u, u_stride, drawn, drawn_stride);
    wis_pdf(sampler, environment, product, count, wi, wi_stride, pdf, pdf_stride);
    wis_invert(sampler, environment, product, count, wi, wi_stride, u, u_stride, status);
    wis_check(sampler, environment, config, info);
    wis_check_point(sampler, environment, point, verdict);
    wis_points_sobol(seed, first, count, out, stride);
    wis_table_view(slice_count, normal, wo, slice, weight, world_from_tree);
    wis_strata_size(map, config, size, diagnostic);
    wis_strata_lights(map, config, scratch, scratch_bytes, lights, light_count, label, diagnostic);
    wis_jitter_size(map, config, size, diagnostic);
    wis_jitter_init(map, config, memory, bytes, scratch, scratch_bytes, jitter, diagnostic);
    wis_jitter_open(memory, bytes, jitter, diagnostic);
    wis_jitter_sample(jitter, light, u, sample);
    wis_jitter_pdf(jitter, light, wi, pdf);
    wis_strata_order(count, contribution, threshold, index, traced, diagnostic);
    wis_tree_size(config, size, diagnostic);
    wis_tree_init(config, memory, bytes, scratch, scratch_bytes, tree, info, diagnostic);
    wis_tree_open(memory, bytes, tree, info, diagnostic);
    wis_tree_product_integral(e, f, integral);
    wis_tree_sample(tree, u, point, pdf);
    wis_tree_pdf(tree, point, pdf);
    wis_tree_invert(tree, point, u);
    wis_triple_integral(brdf, light, visibility, integral);
    wis_triple_select(tree, rule, keep, wavelets, wavelet_count, diagnostic);
    wis_triple_sublinear(
        brdf_average, brdf_count, brdf, light_count, kept_light, light, visibility, integral, diagnostic
    );
    wis_triple_blend(count, list, list_count, weight, room, wavelets, wavelet_count, diagnostic);
    wis_triple_terms(tree, rule, bound, terms);
    wis_sparse_pack(average, count, wavelets, room, packed, packed_bytes, diagnostic);
    wis_sparse_unpack(packed, packed_bytes, room, wavelets, wavelet_count, average, diagnostic);
    wis_visibility_size(tree, size, diagnostic);
    wis_visibility_init(tree, memory, bytes, visibility, diagnostic);
    wis_visibility_open(memory, bytes, visibility, diagnostic);
    wis_visibility_integral(
        brdf_average, brdf_count, brdf, light_count, kept_light, light, visibility, integral, diagnostic
    );
    wis_visibility_product_integral(tree, visibility, integral);
    wis_grid_cells(side, wi, cell, weights);
    wis_square_direction(point, world_from_tree, direction);
    wis_square_point(wi, world_from_tree, point);
    wis_warp_in_place(tree, points, index, count, diagnostic);
};
