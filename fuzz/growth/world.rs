//! Calls by the names of their parameters. What is not given follows from the header: strides, diagnostics and inputs are 0, outputs and
//! handles have room of their own, and blocks are as long as the size query says.

use crate::count;
use anyhow::Result;
use std::collections::BTreeMap;
use std::ffi::c_void;
use wis_fuzz::header::{Field, Function, Headers, Parameter, Scalar};
use wis_fuzz::world::addresses;

/// Values of parameters or fields by their names; addresses are below 2^47 and exact.
pub type Values<'a> = Vec<(&'a str, f64)>;

/// Room of an output: pages that are not written cost nothing.
const OUTPUT: usize = 4 << 20;

/// Any function: integers go to registers in their order and then to the stack, floats to registers of their own.
type Any = unsafe extern "C" fn(u64, u64, u64, u64, u64, u64, f64, f64, u64, u64, u64, u64, u64) -> u64;

pub struct World {
    pub headers: Headers,
    addresses: BTreeMap<String, usize>,
    only: String,
    counted: usize,
    /// What rows do not set.
    defaults: Vec<(String, String)>,
    /// What the row sets, then the defaults; and n.
    settings: Vec<(String, String)>,
    size: f64,
    blocks: Vec<Vec<u128>>,
    /// What several curves read, by a name: built once, with the sizes that were asked for last.
    kept: BTreeMap<String, (f64, [usize; 2])>,
    /// The memory of it.
    kept_blocks: Vec<Vec<u128>>,
    /// What the last size query answered: bytes, and bytes of scratch memory.
    pub sizes: [usize; 2],
}

impl World {
    pub fn new(library: &str, only: &str) -> Result<World> {
        let headers = Headers::read();
        let addresses = addresses(library, &headers)?;
        let (kept, kept_blocks, blocks) = (BTreeMap::new(), Vec::new(), Vec::new());
        let (only, counted, size, sizes, defaults) = (only.into(), 0, 0.0, [0; 2], Vec::new());
        let settings = Vec::new();
        Ok(World { headers, addresses, only, counted, defaults, settings, size, blocks, kept, kept_blocks, sizes })
    }

    /// What `make` answers, made at the first call with that name: what no later call writes.
    pub fn once(&mut self, name: String, make: impl FnOnce(&mut World) -> f64) -> f64 {
        if !self.kept.contains_key(&name) {
            let before = std::mem::take(&mut self.blocks);
            let made = make(self);
            self.kept_blocks.extend(std::mem::replace(&mut self.blocks, before));
            self.kept.insert(name.clone(), (made, self.sizes));
        }
        let (made, sizes) = self.kept[&name];
        self.sizes = sizes;
        made
    }

    /// Measures a function at each size of an input, as a row of curves.txt has it.
    pub fn curve(&mut self, row: &str) {
        let setting = |word: &str| word.split_once('=').map(|(name, value)| (name.to_string(), value.to_string()));
        let all = |words: &str| words.split_whitespace().map(|word| setting(word).expect(row)).collect::<Vec<_>>();
        if let Some(words) = row.strip_prefix("defaults;") {
            self.defaults = all(words);
            return;
        }
        let columns: Vec<&str> = row.split(';').map(str::trim).collect();
        let [function, input, grows, sizes, settings] = columns[..] else { panic!("{row}") };
        if !function.contains(&self.only) {
            return;
        }
        let declared = self.headers.functions.iter().find(|declared| declared.name == function).expect(row);
        let is_known = |name: &str| declared.has(name) || name.contains('.') || matches!(name, "order" | "source");
        self.settings = all(settings);
        let is_default = |name: &String| self.defaults.iter().any(|of| of.0 == *name);
        assert!(self.settings.iter().all(|(name, _)| is_known(name) || is_default(name)), "{row}");
        self.settings.extend(self.defaults.iter().cloned());
        for size in sizes.split_whitespace().map(|size| size.parse::<f64>().expect(row)) {
            self.blocks.clear();
            self.size = size;
            let stated = match grows.trim_start_matches("<= ") {
                "1" => 1.0,
                "n" => size,
                "sqrt n" => size.sqrt(),
                "log n" => size.log2(),
                "n log n" => size * size.log2(),
                _ => panic!("{row}"),
            };
            let is_later = matches!(function, "wis_environment_run" | "wis_environment_finish");
            let values = if is_later { self.begun() } else { Values::new() };
            let asked = ["bytes by", "scratch by"].iter().position(|answer| input.contains(answer));
            let measured = if let Some(asked) = asked {
                self.call(function, &values);
                self.sizes[asked].to_string()
            } else {
                self.counted += 1;
                let label = self.counted.to_string();
                self.run(function, &values, Some(&label));
                format!("count {label}")
            };
            let relation = if grows.starts_with("<= ") { "at most" } else { "as" };
            println!("{function}\t{input}\t{relation}\t{size}\t{stated}\t{measured}");
        }
    }

    /// A word of the row.
    pub fn word(&self, name: &str) -> Option<&str> {
        self.settings.iter().find(|setting| setting.0 == name).map(|setting| setting.1.as_str())
    }

    /// What the row, or else the defaults, set: a number, n or a part of it, or a constant.
    pub fn setting(&self, name: &str) -> Option<f64> {
        self.word(name).map(|text| self.value(text))
    }

    fn value(&self, text: &str) -> f64 {
        let part = |rest: &str| self.size / rest.strip_prefix('/').map_or(1.0, |by| by.parse().expect(by));
        let other = || if text.starts_with("WIS_") { self.constant(text) } else { text.parse().expect(text) };
        text.strip_prefix('n').map_or_else(other, part)
    }

    pub fn number(&self, name: &str) -> f64 {
        self.setting(name).unwrap_or_else(|| panic!("{name} is not set"))
    }

    pub fn whole(&self, name: &str) -> usize {
        self.number(name) as usize
    }

    /// The value that a call was given, or that the row sets.
    pub fn given(&self, values: &Values, name: &str) -> f64 {
        values.iter().find(|value| value.0 == name).map_or_else(|| self.number(name), |value| value.1)
    }

    /// Calls a function that must succeed. Answers the memory that it wrote its object to, if it is a builder.
    pub fn call(&mut self, name: &str, values: &Values) -> f64 {
        self.run(name, values, None)
    }

    fn run(&mut self, name: &str, values: &Values, label: Option<&str>) -> f64 {
        let function = self.headers.functions.iter().find(|function| function.name == name).expect(name).clone();
        let mut values = values.clone();
        let lacks = |values: &Values, name: &str| function.has(name) && values.iter().all(|value| value.0 != name);
        let is_built = !name.ends_with("_open") && !name.ends_with("_turn");
        if is_built && (lacks(&values, "memory") || lacks(&values, "scratch")) {
            self.call(&function.size_query(), &values);
            let count = if name.ends_with("_prepare") { self.given(&values, "count") as usize } else { 1 };
            // What needs scratch memory alone says so in either place.
            let [bytes, scratch_bytes] = self.sizes;
            let scratch_bytes = if scratch_bytes == 0 { bytes } else { scratch_bytes };
            for (block, of, size) in [("memory", "bytes", count * bytes), ("scratch", "scratch_bytes", scratch_bytes)] {
                if lacks(&values, block) {
                    values.push((block, self.room(size)));
                    values.push((of, size as f64));
                }
            }
        }
        let (mut integers, mut floats, mut size) = (Vec::new(), Vec::new(), None);
        for parameter in &function.parameters {
            let given = values.iter().find(|value| value.0 == parameter.name).map(|value| value.1);
            let given = given.or_else(|| self.argument(&function, parameter, &values));
            let value = given.unwrap_or_else(|| self.absent(&function, parameter));
            if parameter.name == "size" {
                size = Some(value as usize);
            }
            let bits = bits(parameter.scalar, value);
            if parameter.scalar.is_float() { floats.push(f64::from_bits(bits)) } else { integers.push(bits) }
        }
        integers.resize(11, 0);
        floats.resize(2, 0.0);
        let [a, b, c, d, e, f, g, h, i, j, k] = integers[..] else { panic!("{name} has more parameters") };
        // SAFETY: what is passed in the registers and on the stack is what the header declares; more does no harm.
        let call = unsafe { std::mem::transmute::<*const c_void, Any>(self.addresses[name] as *const c_void) };
        // SAFETY: pointers are to what the header says.
        let run = || unsafe { call(a, b, c, d, e, f, floats[0], floats[1], g, h, i, j, k) };
        let answer = match label {
            Some(label) => count::count(label, run),
            None => run(),
        };
        assert!(!function.answers_status || answer as u32 == 0, "{name} answers {}: {values:?}", answer as u32);
        if let Some(size) = size {
            // SAFETY: a wis_memory_size, whose first and third fields are sizes.
            self.sizes = unsafe { [*(size as *const usize), *(size as *const usize).add(2)] };
        }
        values.iter().find(|value| value.0 == "memory").map_or(0.0, |value| value.1)
    }

    /// The value of a parameter that nobody gave.
    fn absent(&mut self, function: &Function, parameter: &Parameter) -> f64 {
        let is_output = parameter.scalar == Scalar::Pointer && !parameter.is_input() && parameter.name != "diagnostic";
        assert!(
            is_output
                || parameter.scalar == Scalar::Pointer
                || parameter.name.ends_with("_stride")
                || parameter.name == "stride",
            "{} of {} is not given",
            parameter.name,
            function.name
        );
        if !is_output {
            return 0.0;
        }
        let layout = self.headers.pointed(parameter);
        match layout.fields.first() {
            Some(field) if field.path == "size" => self.of(&parameter.pointee.clone(), &vec![]),
            _ => self.room(OUTPUT),
        }
    }

    /// Zeros that begin at a multiple of 64.
    pub fn room(&mut self, bytes: usize) -> f64 {
        let mut block = vec![0; bytes.div_ceil(16) + 4];
        let start = block.as_mut_ptr() as usize;
        self.blocks.push(block);
        start.next_multiple_of(64) as f64
    }

    pub fn array<T: Copy>(&mut self, values: &[T]) -> f64 {
        let at = self.room(size_of_val(values));
        // SAFETY: the room is as long, and rooms begin at multiples of 64.
        unsafe { std::slice::from_raw_parts_mut(at as usize as *mut T, values.len()) }.copy_from_slice(values);
        at
    }

    pub fn addresses(&mut self, values: &[f64]) -> f64 {
        self.array(&values.iter().map(|value| *value as u64).collect::<Vec<_>>())
    }

    /// A struct with its size, some fields, and those that the row sets.
    pub fn of(&mut self, name: &str, fields: &Values) -> f64 {
        let (settings, kind) = (self.settings.clone(), name.trim_start_matches("wis_").trim_end_matches("_config"));
        let own = settings
            .iter()
            .filter_map(|(path, value)| Some((path.strip_prefix(kind)?.strip_prefix('.')?, self.value(value))));
        let own: Values = own.collect();
        self.list(name, &[[&fields[..], &own].concat()])
    }

    /// Structs one after the other.
    pub fn list(&mut self, name: &str, elements: &[Values]) -> f64 {
        let layout = self.headers.layouts[name].clone();
        let size = layout.fields.first().filter(|first| first.path == "size").map(|_| ("size", layout.size as f64));
        // The fields of each path: most elements have the same paths.
        let mut meant: BTreeMap<String, Vec<Field>> = BTreeMap::new();
        let mut bytes = vec![0; layout.size * elements.len()];
        for (element, fields) in bytes.chunks_mut(layout.size).zip(elements) {
            for (path, value) in size.iter().chain(fields) {
                if !meant.contains_key(*path) {
                    // "weight*" is all numbers whose paths begin so.
                    let is_meant = |field: &&Field| match path.strip_suffix('*') {
                        Some(begin) => field.path.starts_with(begin),
                        None => field.path == *path,
                    };
                    let found: Vec<Field> = layout.fields.iter().filter(is_meant).cloned().collect();
                    assert!(!found.is_empty(), "no field {path} of {name}");
                    meant.insert(path.to_string(), found);
                }
                for field in &meant[*path] {
                    let bits = bits(field.scalar, *value).to_le_bytes();
                    element[field.offset..][..field.scalar.size()].copy_from_slice(&bits[..field.scalar.size()]);
                }
            }
        }
        self.array(&bytes)
    }

    /// A constant of the headers.
    pub fn constant(&self, name: &str) -> f64 {
        self.headers.constant_of(name) as f64
    }
}

fn bits(scalar: Scalar, value: f64) -> u64 {
    match scalar {
        Scalar::F32 => u64::from((value as f32).to_bits()),
        Scalar::F64 => value.to_bits(),
        _ => value as u64,
    }
}

/// Numbers in [0, 1) that follow from a seed.
pub fn numbers(seed: u64, count: usize) -> Vec<f32> {
    let mut state = seed;
    let next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1 << 24) as f32
    };
    std::iter::repeat_with(next).take(count).collect()
}

/// Unit directions, one after the other.
pub fn directions(seed: u64, count: usize) -> Vec<f32> {
    let direction = |pair: &[f32]| {
        let (z, phi) = (2.0 * pair[0] - 1.0, std::f32::consts::TAU * pair[1]);
        let r = (1.0 - z * z).max(0.0).sqrt();
        [r * phi.cos(), r * phi.sin(), z]
    };
    numbers(seed, 2 * count).chunks(2).flat_map(direction).collect()
}
