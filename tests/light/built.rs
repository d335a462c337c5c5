//! Lights in memory of their own.

use super::lookup::Map;
pub use crate::support::Random;
use crate::support::scenes;
use wis::light::batch::Density;
use wis::light::environment::{Environment, turn};
use wis::light::pixels::{Format, Pixels};
use wis::light::plan::{Description, Plan};
use wis::simd::{Compute, GROUP, Level, Num, compute, places};
use wis::sphere::Frame;
use wis::status::Error;

pub struct Built {
    words: Vec<u128>,
    bytes: usize,
}

impl Built {
    pub fn new(map: &Map, of: &Description) -> Built {
        Built::over(map, of, false, 0xa5).expect("the map is valid")
    }

    /// In memory that held other bytes.
    pub fn over(map: &Map, of: &Description, sanitise: bool, filling: u8) -> Result<Built, Error> {
        let row = |y: u32| {
            let start = (y * map.width) as usize;
            Some(bytemuck::cast_slice(&map.texels[start..start + map.width as usize]))
        };
        Built::of_rows(of, sanitise, filling, row)
    }

    pub fn of_rows<'a>(
        of: &Description,
        sanitise: bool,
        filling: u8,
        row: impl Fn(u32) -> Option<&'a [u8]> + 'a,
    ) -> Result<Built, Error> {
        let plan = Plan::new(of)?;
        let size = plan.size()?;
        let filled = |bytes: usize| vec![u128::from_ne_bytes([filling; 16]); bytes.div_ceil(16)];
        let (mut words, mut scratch) = (filled(size.bytes), filled(size.scratch));
        let pixels = Pixels { channels: 1, format: Format::F32, sanitise, absolute: false };
        let (memory, scratch) = (bytemuck::cast_slice_mut(&mut words), bytemuck::cast_slice_mut(&mut scratch));
        let bytes = Environment::build_in(&plan, &pixels, &Frame::IDENTITY, &row, memory, scratch)?.as_bytes().len();
        Ok(Built { words, bytes })
    }

    pub fn bytes(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.words)[..self.bytes]
    }

    pub fn environment(&self) -> Environment<'_> {
        Environment::view(self.bytes()).expect("it was built")
    }

    /// A copy in another frame.
    pub fn turned(&self, frame: &Frame) -> Built {
        let mut words = self.words.clone();
        turn(&mut bytemuck::cast_slice_mut(&mut words)[..self.bytes], frame);
        Built { words, bytes: self.bytes }
    }

    /// No texel is darker for the light.
    pub fn least(&self) -> f64 {
        let of = self.environment().description();
        if of.exact_zero { 0.0 } else { self.environment().header().mean / 65536.0 }
    }

    /// Samples one by one.
    pub fn sample(&self, frame: &Frame, u: [f32; 2]) -> ([f32; 3], f32) {
        self.environment().light().sample::<f32>(frame, u)
    }

    /// The pdf of one direction.
    pub fn pdf(&self, wi: [f32; 3]) -> f32 {
        self.environment().light().pdf::<f32>(&Frame::IDENTITY, wi)
    }
}

/// Samples and their pdfs in lanes, and what pdf answers for the directions.
pub fn in_lanes(level: Level, built: &Built, frame: &Frame, u: &[[f32; 2]; GROUP]) -> [([f32; 3], f32, f32); GROUP] {
    struct Both<'a>(&'a Built, &'a Frame, &'a [[f32; 2]; GROUP]);
    impl Compute for Both<'_> {
        type Output = [([f32; 3], f32, f32); GROUP];

        fn run<F: Num>(self) -> Self::Output {
            let Both(built, frame, u) = self;
            let environment = built.environment();
            let light = environment.light();
            let mut all = [([0.0; 3], 0.0, 0.0); GROUP];
            for first in places::<F>() {
                let (wi, pdf) = light.sample::<F>(frame, [0, 1].map(|k: usize| F::each(|lane| u[first + lane][k])));
                let (again, pdf, wi) = (light.pdf::<F>(frame, wi).store(), pdf.store(), wi.map(F::store));
                for lane in 0..F::WIDTH {
                    let of = |lanes: &F::Floats| lanes.as_ref()[lane];
                    all[first + lane] = (wi.each_ref().map(of), of(&pdf), of(&again));
                }
            }
            all
        }
    }
    compute(level, Both(built, frame, u))
}

impl Random {
    /// A rotation, or one with a reflection.
    pub fn frame(&mut self) -> Frame {
        let [a, b] = [self.direction(), self.direction()];
        let determinant = if self.bits() & 1 == 0 { 1.0 } else { -1.0 };
        Frame::new(&scenes::rows(a, b, determinant)).expect("a rotation or a reflection")
    }
}
