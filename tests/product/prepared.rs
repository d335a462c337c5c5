//! Products in memory of their own.

use super::built::Built;
use wis::brdf::point::Point;
use wis::light::batch::Density;
use wis::light::tables::Light;
use wis::product::density::Shaded;
use wis::product::prepare::{Config, Task};
use wis::product::stored::{MAX_DIVIDED, Product, most_bytes};
use wis::simd::Level;
use wis::sphere::Frame;
use wis::status::Error;

pub struct Prepared<'a> {
    pub built: &'a Built,
    light: Light<'a>,
    words: Vec<u128>,
    bytes: usize,
}

impl<'a> Prepared<'a> {
    pub fn new(built: &'a Built, point: &Point<'_>) -> Prepared<'a> {
        Prepared::with(built, point, &Config::default())
    }

    pub fn with(built: &'a Built, point: &Point<'_>, config: &Config) -> Prepared<'a> {
        Prepared::over(Level::detect(), built, point, config, 0xa5).expect("the point is valid")
    }

    /// At a level, in memory that held other bytes.
    pub fn over(
        level: Level,
        built: &'a Built,
        point: &Point<'_>,
        config: &Config,
        filling: u8,
    ) -> Result<Prepared<'a>, Error> {
        let mut words = vec![u128::from_ne_bytes([filling; 16]); most_bytes(MAX_DIVIDED) / 16];
        let memory = bytemuck::cast_slice_mut(&mut words);
        let bytes = Task { level, environment: &built.environment(), point, config }.prepare(None, memory)?;
        Ok(Prepared { built, light: built.environment().light(), words, bytes })
    }

    pub fn bytes(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.words)[..self.bytes]
    }

    pub fn product(&self) -> Product<'_> {
        Product::view(self.bytes()).expect("it was prepared")
    }

    pub fn shaded(&self) -> Shaded<'_> {
        Shaded::new(&self.light, self.product())
    }

    pub fn frame(&self) -> Frame {
        self.built.environment().frame()
    }

    pub fn sample(&self, u: [f32; 2]) -> ([f32; 3], f32) {
        self.shaded().sample::<f32>(&self.frame(), u)
    }

    pub fn pdf(&self, wi: [f32; 3]) -> f32 {
        self.shaded().pdf::<f32>(&self.frame(), wi)
    }
}
