//! Samples of a pixel side by side: points, directions, and what the renderer evaluates for them.

use crate::client::{self, Density, raw};
use crate::cost::Cost;
use crate::dense::{Dense, Grid};
use crate::lanes::{Directions, F8, LANES, V8, load, padded, store};
use crate::light::Light;
use crate::material::Bsdf;
use crate::points;
use crate::texels::Texels;
use wide::CmpGt;

/// Independent sequences of points within a pixel and pass.
#[derive(Clone, Copy)]
pub enum Stream {
    Light,
    Bsdf,
    Choice,
    Uniform,
}

/// Directions of one or more techniques with BRDF, radiance and densities.
#[derive(Default)]
pub struct Batch {
    pixel: [u32; 2],
    pass: u32,
    turn: u32,
    u: Vec<[f32; 2]>,
    count: usize,
    wi: Directions,
    /// BRDF x cosine x radiance.
    reflected: Vec<f32>,
    /// Without the BRDF, after [`Batch::reflect`].
    radiance: Vec<f32>,
    pdf_bsdf: Vec<f32>,
    pdf_light: Vec<f32>,
    /// Written by the library.
    drawn: Vec<raw::wis_drawn>,
    asked: Vec<[f32; 3]>,
    pdf_drawn: Vec<f32>,
}

impl Batch {
    /// Starts anew with the sequences of a pixel in a pass; it is the pixel's `turn`-th time.
    pub fn begin(&mut self, pixel: [u32; 2], pass: u32, turn: u32) {
        (self.pixel, self.pass, self.turn, self.count) = (pixel, pass, turn, 0);
        self.pdf_drawn.clear();
    }

    /// Samples that are there.
    pub fn len(&self) -> usize {
        self.count
    }

    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    pub fn wi(&self) -> &Directions {
        &self.wi
    }

    /// BRDF x cosine x radiance of a sample.
    #[inline]
    pub fn reflected(&self, i: usize) -> f32 {
        self.reflected[i]
    }

    /// The points of a stream after those of earlier turns.
    pub fn points(&mut self, stream: Stream, count: usize) -> &[[f32; 2]] {
        self.u.resize(count, [0.0; 2]);
        let seed = client::pixel_seed(self.pixel, self.pass.wrapping_mul(4).wrapping_add(stream as u32));
        points::sobol(seed, self.turn * count as u32, &mut self.u);
        &self.u
    }

    /// Adds samples of the texels of a light.
    pub fn from_texels(&mut self, texels: &Texels, light: &Light, count: usize) {
        self.points(Stream::Light, count);
        let first = self.grow(count);
        texels.sample(light, &self.u, &mut self.wi, first);
    }

    /// Adds samples of the BRDF.
    pub fn from_bsdf(&mut self, bsdf: &Bsdf, count: usize) {
        self.from_map(Stream::Bsdf, count, |u, used| bsdf.sample(u, used));
    }

    /// Adds directions by a function of eight points, of which so many are in use.
    pub fn from_map(&mut self, stream: Stream, count: usize, map: impl Fn([F8; 2], usize) -> V8) {
        self.points(stream, count);
        let first = self.grow(count);
        for (block, u) in self.u.chunks(LANES).enumerate() {
            let axis = |k: usize| F8::new(std::array::from_fn(|i| u.get(i).map_or(0.5, |u| u[k])));
            self.wi.store(first + block * LANES, map([axis(0), axis(1)], u.len()));
        }
    }

    /// Adds samples of the limit.
    pub fn from_dense(&mut self, (dense, grid): (&Dense, &Grid), count: usize) {
        self.points(Stream::Light, count);
        let first = self.grow(count);
        for (i, u) in self.u.iter().enumerate() {
            let (wi, pdf) = dense.sample(grid, *u);
            self.wi.set(first + i, wi.to_array());
            self.pdf_drawn.push(pdf);
        }
    }

    /// Adds samples of a density of the library, with its pdfs.
    pub fn from_density(&mut self, density: &dyn Density, count: usize) -> client::Result<()> {
        self.points(Stream::Light, count);
        let first = self.grow(count);
        self.drawn.resize(count, Default::default());
        density.sample_n(&self.u, &mut self.drawn)?;
        for (i, drawn) in self.drawn.iter().enumerate() {
            self.wi.set(first + i, drawn.wi);
            self.pdf_drawn.push(drawn.pdf);
        }
        Ok(())
    }

    /// Adds a sample of each of `count` densities, which answer a direction with its pdf.
    pub fn from_each(
        &mut self,
        count: usize,
        sample: impl Fn(usize, [f32; 2]) -> client::Result<([f32; 3], f32)>,
    ) -> client::Result<()> {
        self.points(Stream::Light, count);
        for i in 0..count {
            let (wi, pdf) = sample(i, self.u[i])?;
            self.push_drawn(wi, pdf);
        }
        Ok(())
    }

    /// Adds one of many samples that a density gave for points of `points`.
    pub fn push_drawn(&mut self, wi: [f32; 3], pdf: f32) {
        let first = self.grow(1);
        self.wi.set(first, wi);
        self.pdf_drawn.push(pdf);
    }

    /// Asks for the pdfs of those samples that have none of the density, and answers those of all.
    pub fn ask(&mut self, density: &dyn Density) -> client::Result<&[f32]> {
        let first = self.pdf_drawn.len();
        self.asked.clear();
        self.asked.extend((first..self.count).map(|i| self.wi.get(i).to_array()));
        self.pdf_drawn.resize(self.count, 0.0);
        density.pdf_n(&self.asked, &mut self.pdf_drawn[first..])?;
        Ok(&self.pdf_drawn)
    }

    /// Evaluates BRDF, its pdf and radiance for all samples, and spends what that costs.
    pub fn reflect(&mut self, bsdf: &Bsdf, light: &Light, texels: &Texels, cost: Cost) {
        for i in (0..self.count).step_by(LANES) {
            let (f_cos, wi, used) = self.scatter(i, bsdf, cost);
            let radiance = texels.radiance(light, wi, used);
            store(&mut self.reflected, i, f_cos * radiance);
            store(&mut self.radiance, i, radiance);
        }
    }

    /// The same and the pdf of the light, which costs a look-up of its own.
    pub fn evaluate(&mut self, bsdf: &Bsdf, light: &Light, texels: &Texels, cost: Cost) {
        for i in (0..self.count).step_by(LANES) {
            let (f_cos, wi, used) = self.scatter(i, bsdf, cost);
            let (radiance, pdf_light) = texels.eval(light, wi, used);
            store(&mut self.reflected, i, f_cos * radiance);
            store(&mut self.pdf_light, i, pdf_light);
        }
    }

    /// BRDF x cosine of the samples from number `i` on, their directions, and how many of them are in use; keeps the pdf.
    fn scatter(&mut self, i: usize, bsdf: &Bsdf, cost: Cost) -> (F8, V8, usize) {
        let (wi, used) = (self.wi.load(i), (self.count - i).min(LANES));
        cost.evaluate(used);
        let (f_cos, pdf) = bsdf.eval(wi, used);
        store(&mut self.pdf_bsdf, i, pdf);
        (f_cos, wi, used)
    }

    /// Divides each sample by a density of both pdfs; those whose density is 0 add nothing.
    pub fn weigh(&mut self, density: impl Fn(usize, F8, F8) -> F8) {
        for i in (0..self.count).step_by(LANES) {
            let reflected = load(&self.reflected, i);
            let density = density(i, load(&self.pdf_light, i), load(&self.pdf_bsdf, i));
            let weight = reflected / density;
            let sound = reflected.cmp_gt(F8::ZERO) & density.cmp_gt(F8::ZERO);
            store(&mut self.reflected, i, sound & weight);
        }
    }

    /// Divides each sample by a density of the library's pdf and that of the BRDF, as [`Batch::weigh`].
    pub fn weigh_by_drawn(&mut self, density: impl Fn(usize, F8, F8) -> F8) {
        let drawn = self.pdf_drawn.len();
        self.pdf_drawn.resize(padded(self.count), 0.0);
        std::mem::swap(&mut self.pdf_drawn, &mut self.pdf_light);
        self.weigh(density);
        std::mem::swap(&mut self.pdf_drawn, &mut self.pdf_light);
        self.pdf_drawn.truncate(drawn);
    }

    /// Samples of a density bring the radiance above the mean, those of the BRDF behind them, so many, what is left.
    pub fn weigh_parts(&mut self, mean: f32, scattered: usize) {
        let drawn = self.count - scattered;
        for i in 0..self.count {
            let base = (mean / self.radiance[i]).min(1.0);
            let density = if i < drawn { self.pdf_drawn[i] } else { self.pdf_bsdf[i] * scattered as f32 };
            let part = if i < drawn { 1.0 - base } else { base };
            let sound = self.reflected[i] > 0.0 && density > 0.0;
            self.reflected[i] = if sound { self.reflected[i] * part / density } else { 0.0 };
        }
    }

    /// Multiplies each weighed sample by a factor.
    pub fn scale(&mut self, factors: &[f32]) {
        self.reflected.iter_mut().zip(factors).for_each(|(reflected, factor)| *reflected *= factor);
    }

    /// Makes room for more samples and answers the number of the first.
    fn grow(&mut self, count: usize) -> usize {
        let first = self.count;
        self.count += count;
        if self.reflected.len() < padded(self.count) {
            self.wi.resize(self.count + LANES);
            for column in [&mut self.reflected, &mut self.radiance, &mut self.pdf_bsdf, &mut self.pdf_light] {
                column.resize(padded(self.count), 0.0);
            }
        }
        first
    }
}
