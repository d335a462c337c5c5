//! The arguments of a call, by the names and types of its parameters and by what a row of curves.txt sets.

use crate::world::{Values, World, directions, numbers};
use std::ffi::{c_int, c_void};
use wis_fuzz::header::{Function, Parameter};

const UP: [f32; 3] = [0.0, 0.0, 1.0];
const SLANTED: [f32; 3] = [0.6, 0.0, 0.8];

/// A position and a level of a square.
type Place = (u64, u32);

impl World {
    /// The value of a parameter that no other call gave; none if the header tells it.
    pub fn argument(&mut self, function: &Function, parameter: &Parameter, given: &Values) -> Option<f64> {
        let (name, call) = (parameter.name.as_str(), function.name.as_str());
        let count = self.whole("count");
        if !parameter.is_pointer() {
            return match (call, name) {
                ("wis_triple_blend", "room") => Some((count * self.whole("elements")) as f64),
                ("wis_sparse_pack", "room") | (_, "packed_bytes") => Some((16 + 18 * count) as f64),
                (_, "brdf_count" | "light_count") => Some(count as f64),
                (_, "bytes") => Some(self.sizes[0] as f64),
                _ => self.setting(name),
            };
        }
        // Objects of a kind are told apart by how many stand before.
        let is_function = |p: &&Parameter| matches!(p.pointee.as_str(), "wis_tree" | "wis_visibility");
        let number = 1 + function.parameters.iter().take_while(|p| p.name != name).filter(is_function).count() as u64;
        let pixels = self.whole("pixels");
        Some(match (parameter.pointee.as_str(), name) {
            ("wis_environment_config", _) => self.map(),
            ("wis_sampler_config", _) => {
                let [rays, candidates] = ["rays", "candidates"].map(|name| self.number(name));
                self.of("wis_sampler_config", &vec![("rays", rays), ("candidates_per_ray", candidates)])
            }
            ("wis_check_config", _) => {
                self.of("wis_check_config", &vec![("radiance", white as *const () as usize as f64)])
            }
            ("wis_strata_config", _) => {
                let lights = self.number("lights");
                self.of("wis_strata_config", &vec![("count", lights)])
            }
            ("wis_jitter_config", _) => self.strata(),
            ("wis_tree_config", _) => self.tree(),
            ("wis_product_config", _) => self.of("wis_product_config", &vec![]),
            ("wis_material", _) => self.shapes(),
            ("wis_point", _) => {
                let count = if call.ends_with("_prepare") { self.given(given, "count") } else { 1.0 };
                self.points(call, count as usize)
            }
            ("wis_wave", _) => self.wave(),
            ("wis_environment", _) => self.light(),
            ("wis_product", _) if self.number("lobes") == 0.0 => 0.0,
            ("wis_product", _) => self.product(),
            ("wis_sampler" | "wis_visibility_cache" | "wis_jitter", _) => {
                self.call(&format!("{}_init", parameter.pointee), &vec![])
            }
            ("wis_tree", _) => self.planar(pixels, number),
            ("wis_visibility", _) => self.visible(pixels, number),
            ("void", "memory") => match call {
                "wis_environment_open" => self.light(),
                "wis_environment_turn" => self.call("wis_environment_init", &vec![]),
                "wis_product_open" => self.product(),
                "wis_tree_open" => self.planar(pixels, 1),
                "wis_visibility_open" => self.visible(pixels, 1),
                _ => self.call(&call.replace("_open", "_init"), &vec![]),
            },
            ("wis_wavelets", _) if parameter.is_input() => {
                self.elements(count, if name == "kept_light" { 0.3 } else { 0.2 })
            }
            (_, "packed") if parameter.is_input() => {
                let packed = self.room(16 + 18 * count);
                self.call("wis_sparse_pack", &vec![("packed", packed)]);
                packed
            }
            (_, "list") => {
                let list = self.elements(self.whole("elements"), 0.2);
                self.addresses(&vec![list; count])
            }
            (_, "list_count") => self.array(&vec![self.number("elements") as u32; count]),
            (_, "weight") if parameter.is_input() => self.array(&vec![0.25; count]),
            (_, "reached") => self.array(&vec![0x0101_0101; count]),
            (_, "contribution") => self.array(&self.ordered(count)),
            (_, "points") => {
                let alike = self.word("order") == Some("equal");
                self.array(&if alike { vec![0.3; 2 * count] } else { numbers(2, 2 * count) })
            }
            (_, "index") if call == "wis_warp_in_place" => self.array(&(0..count as u32).collect::<Vec<_>>()),
            (_, "position" | "radiance") => self.array(&[self.number(name) as f32; 3]),
            (_, "normal") => self.array(&UP),
            (_, "u") if call == "wis_sample" => self.array(&numbers(2, 2 * count)),
            (_, "wi") if function.has("count") => self.array(&directions(3, count)),
            (_, "wi" | "wo") if parameter.is_input() => self.array(&SLANTED),
            (_, "u" | "point") if parameter.is_input() => {
                self.array(&self.setting(name).map_or([0.3, 0.7], |n| [1.0 / n as f32; 2]))
            }
            _ => return None,
        })
    }

    /// A lat-long map of noise with a sun, RGB, twice as wide as high; texels: a square times two.
    fn map(&mut self) -> f64 {
        let (texels, sizes) = (self.whole("texels"), self.sizes);
        let height = ((texels / 2) as f64).sqrt();
        let pixels = self.once(format!("pixels {texels}"), |w| {
            let mut pixels = numbers(1, 3 * texels);
            pixels[0] = 1e4;
            w.array(&pixels)
        });
        // Pixels have no sizes: those that were asked for last stay.
        self.sizes = sizes;
        let (layout, format) = (self.constant("WIS_LAYOUT_LATLONG"), self.constant("WIS_FORMAT_F32"));
        let size = [("layout", layout), ("width", 2.0 * height), ("height", height)];
        let rest = [("channels", 3.0), ("format", format), ("pixels", pixels)];
        self.of("wis_environment_config", &[size, rest].concat())
    }

    fn light(&mut self) -> f64 {
        self.once(format!("light {}", self.number("texels")), |w| w.call("wis_environment_init", &vec![]))
    }

    /// What a build goes on with whose first passes are done, up to that of the row: the next one, or the end.
    pub fn begun<'a>(&mut self) -> Values<'a> {
        let (config, passes) = (self.map(), self.whole("pass"));
        self.call("wis_environment_size", &vec![("config", config)]);
        let [bytes, scratch_bytes] = self.sizes;
        let (memory, scratch, items) = (self.room(bytes), self.room(scratch_bytes), self.array(&[0; 6]));
        let work = vec![("config", config), ("scratch", scratch), ("scratch_bytes", scratch_bytes as f64)];
        self.call("wis_environment_begin", &[work.clone(), vec![("items", items)]].concat());
        // SAFETY: six integers.
        let items = unsafe { *(items as usize as *const [u32; 6]) };
        let build = [work, vec![("memory", memory), ("bytes", bytes as f64)]].concat();
        let of = |pass: usize| {
            let count = items.get(pass).map_or(0.0, |items| f64::from(*items));
            [build.clone(), vec![("pass", pass as f64), ("first", 0.0), ("count", count)]].concat()
        };
        for pass in 0..passes {
            self.call("wis_environment_run", &of(pass));
        }
        of(passes)
    }

    /// GGX lobes of different widths, and Lambert's, which costs least, as the last.
    fn shapes(&mut self) -> f64 {
        let (lobes, lambert, ggx) = (self.whole("lobes").max(1), "WIS_LOBE_LAMBERT", "WIS_LOBE_GGX");
        let names: Vec<String> =
            (0..3).flat_map(|k| ["kind", "a", "b"].map(|field| format!("lobe[{k}].{field}"))).collect();
        let mut fields = vec![("lobe_count", lobes as f64), ("lobe[3].kind", self.constant(lambert))];
        for (names, alpha) in names.chunks(3).zip([0.1, 0.4, 0.02]).take(lobes) {
            fields.extend(names.iter().map(String::as_str).zip([self.constant(ggx), alpha, alpha]));
        }
        self.of("wis_material", &fields)
    }

    fn material(&mut self) -> f64 {
        let material = self.shapes();
        self.call("wis_material_init", &vec![("material", material)]);
        material
    }

    /// Points that are alike, whose lobes weigh the same.
    fn points(&mut self, call: &str, count: usize) -> f64 {
        let mut fields = vec![("material", self.material()), ("normal[2]", 1.0), ("tangent[0]", 1.0)];
        fields.extend([("wo[0]", 0.6), ("wo[2]", 0.8), ("weight*", 0.25), ("f0*", 0.5)]);
        match call {
            "wis_check_point" => fields.push(("target", even as *const () as usize as f64)),
            "wis_visibility_cache_record" => {
                let cache = self.call("wis_visibility_cache_init", &vec![]);
                fields.extend([("visibility", cache), ("visibility_key", 1.0)]);
            }
            _ => {}
        }
        self.list("wis_point", &vec![fields; count])
    }

    fn wave(&mut self) -> f64 {
        let (count, rays, materials) = (self.whole("count"), self.whole("rays"), self.material());
        let (normal, wo, seeds) = (self.array(&UP), self.array(&SLANTED), self.array(&vec![1; count]));
        let (ray, counts) = (self.room(16 * rays * count), self.room(4 * count));
        let arrays = [("materials", materials), ("normal.first", normal), ("wo.first", wo), ("seed.first", seeds)];
        let rest = [("seed.point", 4.0), ("material_count", 1.0), ("rays", rays as f64), ("ray.first", ray)];
        let last = vec![("ray.point", 16.0 * rays as f64), ("count", counts)];
        self.of("wis_wave", &[arrays.to_vec(), rest.to_vec(), last].concat())
    }

    /// The product of one point.
    fn product(&mut self) -> f64 {
        self.call("wis_product_prepare", &vec![("count", 1.0)])
    }

    /// Strata of a map, each of every so many texels.
    fn strata(&mut self) -> f64 {
        let [texels, lights] = ["texels", "lights"].map(|name| self.number(name) as u32);
        let label = self.array(&(0..texels).map(|i| i % lights).collect::<Vec<_>>());
        let distribution = self.constant("WIS_JITTER_ENERGY");
        let fields = [("light_count", f64::from(lights)), ("distribution", distribution), ("label", label)];
        self.of("wis_jitter_config", &fields.to_vec())
    }

    /// Numbers in the order of the row.
    fn ordered(&self, count: usize) -> Vec<f32> {
        let rising = |count: usize| (0..count).map(|i| i as f32);
        match self.word("order") {
            Some("rising") => rising(count).collect(),
            Some("falling") => rising(count).rev().collect(),
            Some("equal") => vec![1.0; count],
            Some("pipe") => rising(count / 2).chain(rising(count / 2).rev()).collect(),
            _ => numbers(5, count),
        }
    }

    /// A tree from the source of the row.
    fn tree(&mut self) -> f64 {
        let [pixels, axes, count, trees] = ["pixels", "axes", "count", "trees"].map(|name| self.whole(name));
        let depth = pixels.ilog2() / axes as u32;
        let more = match self.word("source") {
            None => return self.noise(axes as u32, depth, 1),
            Some("WIS_TREE_PRODUCT") => {
                let pair = [self.stored(axes as u32, depth, 1), self.stored(2, depth, 2)];
                vec![("tree_count", 2.0), ("trees", self.addresses(&pair))]
            }
            Some("WIS_TREE_BLEND") => {
                let all: Vec<f64> = (0..trees as u64).map(|seed| self.planar(pixels, seed)).collect();
                let (all, weight) = (self.addresses(&all), self.array(&vec![0.25; trees]));
                vec![("tree_count", trees as f64), ("trees", all), ("weight", weight)]
            }
            Some("WIS_TREE_WAVELETS") => {
                let list = self.elements(count, 0.2);
                vec![("count", count as f64), ("wavelets", list), ("average", 1.0), ("least", 0.1)]
            }
            _ => vec![("depth", f64::from(depth)), ("least", 0.25), ("environment", self.light())],
        };
        let source = vec![("source", self.number("source"))];
        self.of("wis_tree_config", &[source, more].concat())
    }

    /// A tree of noise in which every square is kept.
    fn noise(&mut self, axes: u32, depth: u32, seed: u64) -> f64 {
        let pixels = self.array(&numbers(seed, 1 << (axes * depth)));
        let size = [("dimensions", f64::from(axes)), ("depth", f64::from(depth)), ("pixels", pixels)];
        self.of("wis_tree_config", &size.to_vec())
    }

    fn stored(&mut self, axes: u32, depth: u32, seed: u64) -> f64 {
        self.once(format!("tree {axes} {depth} {seed}"), |w| {
            let config = w.noise(axes, depth, seed);
            w.call("wis_tree_init", &vec![("config", config)])
        })
    }

    /// A planar tree of so many pixels.
    fn planar(&mut self, pixels: usize, seed: u64) -> f64 {
        self.stored(2, pixels.ilog2() / 2, seed)
    }

    fn visible(&mut self, pixels: usize, seed: u64) -> f64 {
        let tree = self.planar(pixels, seed);
        self.call("wis_visibility_init", &vec![("tree", tree)])
    }

    /// Wavelets whose details are a seed, 0.1 and the negative seed. Next to each other on the level that is just fine enough: their
    /// ancestors are few; or scattered over the finest, each with ancestors of its own.
    fn elements(&mut self, count: usize, seed: f64) -> f64 {
        let level = count.ilog2() / 2;
        let place = |k: u64| -> Place {
            match self.word("order") {
                Some("scattered") => ((k * ((1 << 24) / count as u64)) & !3, 11),
                _ => (k << (2 * (12 - level)), level),
            }
        };
        let element = |(position, level): Place| {
            let details = [("detail[0]", seed), ("detail[1]", 0.1), ("detail[2]", -seed)];
            [&[("position", position as f64), ("level", f64::from(level))][..], &details].concat()
        };
        let all: Vec<Values> = (0..count as u64).map(place).map(element).collect();
        self.list("wis_wavelets", &all)
    }
}

extern "C" fn even(_: *mut c_void, count: usize, _: *const f32, f_cos: *mut f32) -> c_int {
    // SAFETY: the library gives room for `count` values.
    unsafe { std::slice::from_raw_parts_mut(f_cos, count) }.fill(1.0);
    0
}

extern "C" fn white(user: *mut c_void, count: usize, wi: *const f32, rgb: *mut f32) -> c_int {
    even(user, 3 * count, wi, rgb)
}
