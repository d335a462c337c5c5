//! A map of 16384 x 8192 that is never stored: rows from a callback, and a sun of four texels.

use super::brdf::V3;
use super::maps::{available_memory, look_up};
use super::quadrature::Peak;
use crate::client::{Texels, raw};
use crate::environment::{Environment, Map};
use std::f64::consts::{PI, TAU};
use std::sync::OnceLock;

const WIDTH: u32 = 16384;
const HEIGHT: u32 = 8192;
/// The first column and row of the sun, which has two of each.
const SUN: [u32; 2] = [2500, 1700];
const BRIGHT: f32 = 1e8;
/// Rows of one kind; kinds of rows.
const KIND: u32 = 256;

/// The rows that there are, and the environment that was built of them.
pub struct Huge {
    rows: Vec<Vec<f32>>,
    environment: Environment,
}

/// Radiance without the sun: brighter above, uneven from column to column.
fn sky(x: u32, kind: u32) -> f32 {
    0.2 + (HEIGHT / KIND - kind) as f32 / 32.0 + 0.1 * ((x / 64 + kind) % 7) as f32
}

impl Huge {
    /// The one map; none if the machine has too little memory for it.
    pub fn get() -> Result<Option<&'static Huge>, String> {
        static HUGE: OnceLock<Result<Option<Huge>, String>> = OnceLock::new();
        HUGE.get_or_init(Huge::new).as_ref().map(Option::as_ref).map_err(String::clone)
    }

    fn new() -> Result<Option<Huge>, String> {
        let row = |kind: u32| (0..WIDTH).map(|x| sky(x, kind)).collect::<Vec<f32>>();
        let mut rows: Vec<Vec<f32>> = (0..HEIGHT / KIND).map(row).collect();
        let mut lit = rows[(SUN[1] / KIND) as usize].clone();
        lit[SUN[0] as usize..][..2].fill(BRIGHT);
        rows.push(lit);
        let of = |y: u32| rows[Huge::kind(y)].as_ptr().cast();
        let map = Map::latlong(WIDTH, HEIGHT, 1, Texels::Rows(raw::WIS_FORMAT_F32, &of));
        let size = Environment::size(&map)?;
        if available_memory().is_some_and(|free| free < 2 * (size.bytes + size.scratch_bytes) as u64) {
            return Ok(None);
        }
        let environment = Environment::new(&map)?;
        Ok(Some(Huge { rows, environment }))
    }

    fn kind(y: u32) -> usize {
        if (SUN[1]..SUN[1] + 2).contains(&y) { (HEIGHT / KIND) as usize } else { (y / KIND) as usize }
    }

    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    /// What a client finds between texel centres.
    pub fn radiance(&self, least: f64, wi: V3) -> f64 {
        let texel = |x: i64, y: i64| f64::from(self.rows[Huge::kind(y as u32)][x as usize]);
        look_up([WIDTH, HEIGHT], texel, (true, false), least, wi)
    }

    /// The integral of radiance: each texel counts what the areas about it look up.
    pub fn power(&self) -> f64 {
        self.power_by(Huge::kind)
    }

    /// The same without the sun.
    pub fn dim_power(&self) -> f64 {
        self.power_by(|y| (y / KIND) as usize)
    }

    fn power_by(&self, kind: impl Fn(u32) -> usize) -> f64 {
        let sum = |y: i64| {
            let y = y.clamp(0, i64::from(HEIGHT) - 1) as u32;
            self.rows[kind(y)].iter().map(|texel| f64::from(*texel)).sum::<f64>()
        };
        let polar = |y: u32| (PI * f64::from(y) / f64::from(HEIGHT)).cos();
        let row = |y: u32| {
            let y = i64::from(y);
            (sum(y - 1) + 6.0 * sum(y) + sum(y + 1)) / 8.0
        };
        (0..HEIGHT).map(|y| row(y) * TAU / f64::from(WIDTH) * (polar(y) - polar(y + 1))).sum()
    }

    /// The middle of the sun, and the size of a texel.
    pub fn sun(&self) -> Peak {
        let [u, v] = [f64::from(SUN[0] + 1) / f64::from(WIDTH), f64::from(SUN[1] + 1) / f64::from(HEIGHT)];
        let ((sine, z), (y, x)) = ((PI * v).sin_cos(), (TAU * u).sin_cos());
        Peak { at: [sine * x, sine * y, z], detail: PI / f64::from(HEIGHT) }
    }
}
