//! Pictures of a scene by several estimators side by side: the image above, its error below.

use crate::scene::{HEIGHT, Scene, WIDTH};
use font8x8::{BASIC_FONTS, UnicodeFonts};
use image::{Rgb, RgbImage};

/// Pixels between neighbouring shading points: see `View::Image`.
pub const STEP: u32 = 2;
/// White between panels.
const GAP: u32 = 4;

/// A picture of all pixels in colour: linear RGB of each point of a scene.
pub type Picture = Vec<[f32; 3]>;

/// Panels of one size side by side, with names above them: pictures of all pixels of a scene, or maps.
pub struct Sheet {
    image: RgbImage,
    /// Pixels of a panel.
    panel: [u32; 2],
    /// Pixels above a panel that its name takes.
    strip: u32,
    mean: f64,
}

/// Letters are twice as large as those of the font.
const LETTER: u32 = 16;
/// From a line of letters to the next: names stand above panels, since they would hide what is drawn inside.
const LINE: u32 = LETTER + 4;

impl Sheet {
    /// A sheet of so many columns and rows of pictures of scenes, for a mean luminance.
    pub fn new(columns: u32, rows: u32, mean: f64) -> Sheet {
        Sheet::of_panels([columns, rows], [WIDTH, HEIGHT], mean)
    }

    /// A sheet of so many columns and rows of panels of a size.
    pub fn of_panels([columns, rows]: [u32; 2], panel: [u32; 2], mean: f64) -> Sheet {
        let strip = LINE + 4;
        let size = [columns * (panel[0] + GAP) - GAP, rows * (panel[1] + strip + GAP) - GAP];
        Sheet { image: RgbImage::from_pixel(size[0], size[1], Rgb([255; 3])), panel, strip, mean }
    }

    /// Where the picture of a panel begins, below its name.
    fn corner(&self, at: [u32; 2]) -> [u32; 2] {
        [at[0] * (self.panel[0] + GAP), at[1] * (self.panel[1] + self.strip + GAP) + self.strip]
    }

    /// Writes the name of a panel, which may have two lines.
    fn label(&mut self, at: [u32; 2], name: &str) {
        let [x, y] = self.corner(at);
        let top = y - self.strip + 2;
        for (line, text) in (0..).zip(name.lines()) {
            self.text([x + 4, top + line * LINE], text);
        }
    }

    /// Fills a panel by the place of its pixels in [0, 1), with colours from 0 to 1.
    pub fn map(&mut self, at: [u32; 2], colour: impl Fn([f32; 2]) -> [f64; 3], name: &str) {
        let (corner, [width, height]) = (self.corner(at), self.panel);
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let place = [(x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32];
            let byte = |c: f64| (c.clamp(0.0, 1.0) * 255.0).round() as u8;
            self.image.put_pixel(corner[0] + x, corner[1] + y, Rgb(colour(place).map(byte)));
        }
        self.label(at, name);
    }

    /// Draws a dot of a colour at a place in [0, 1) of a panel.
    pub fn dot(&mut self, at: [u32; 2], place: [f32; 2], colour: [u8; 3]) {
        let corner = self.corner(at);
        let [x, y] = [0, 1].map(|k| ((place[k] * self.panel[k] as f32) as u32).clamp(2, self.panel[k] - 3));
        let around = (0..25).map(|i| [i % 5, i / 5]).filter(|d| d.iter().all(|c| *c != 0 && *c != 4) || d.contains(&2));
        for [dx, dy] in around {
            let inside = [dx, dy].iter().all(|c| *c != 0 && *c != 4);
            let colour = if inside { colour } else { [0; 3] };
            self.image.put_pixel(corner[0] + x + dx - 2, corner[1] + y + dy - 2, Rgb(colour));
        }
    }

    /// Draws a picture, scaled to a mean of .4 and gamma-corrected.
    pub fn picture(&mut self, at: [u32; 2], scene: &Scene, picture: &[[f32; 3]], name: &str) {
        let tone = |value: f32| displayed(f64::from(value) / self.mean);
        let colours: Vec<[f64; 3]> = picture.iter().map(|rgb| rgb.map(tone)).collect();
        self.panel(at, scene, &colours, name);
    }

    /// Draws numbers between 0 and 1 in the colours of the scale.
    pub fn errors(&mut self, at: [u32; 2], scene: &Scene, errors: &[f64], name: &str) {
        let colours: Vec<[f64; 3]> = errors.iter().map(|&error| scale(error)).collect();
        self.panel(at, scene, &colours, name);
    }

    fn panel(&mut self, at: [u32; 2], scene: &Scene, colours: &[[f64; 3]], name: &str) {
        let origin = self.corner(at);
        let pixels = (0..self.panel[1]).flat_map(|y| (0..self.panel[0]).map(move |x| [x, y]));
        pixels.for_each(|[x, y]| self.image.put_pixel(origin[0] + x, origin[1] + y, Rgb([24; 3])));
        // Points of every other column and row fill the pixels beside them.
        let is_sparse = scene.points.iter().all(|point| point.pixel.iter().all(|c| c % 2 == 0));
        let block = if is_sparse { 2 } else { 1 };
        for (point, colour) in scene.points.iter().zip(colours) {
            // Five bits: noise below is not seen and would double the file.
            let byte = |c: f64| ((c * 31.0).round() * 255.0 / 31.0) as u8;
            for (dx, dy) in (0..block).flat_map(|dy| (0..block).map(move |dx| (dx, dy))) {
                let [x, y] = [point.pixel[0] + dx, point.pixel[1] + dy];
                if x < self.panel[0] && y < self.panel[1] {
                    self.image.put_pixel(origin[0] + x, origin[1] + y, Rgb(colour.map(byte)));
                }
            }
        }
        self.label(at, name);
    }

    /// Draws the colours of errors from 0 to 1, with the names of both ends and a line of text above.
    pub fn legend(&mut self, at: [u32; 2], title: &str, [low, high]: [&str; 2]) {
        let corner = self.corner(at);
        let origin = [corner[0] + 40, corner[1] + self.panel[1] / 2 - 24];
        let width = self.panel[0] - 80;
        for (x, y) in (0..width).flat_map(|x| (0..48).map(move |y| (x, y))) {
            let colour = scale(f64::from(x) / f64::from(width - 1)).map(|c| (255.0 * c) as u8);
            self.image.put_pixel(origin[0] + x, origin[1] + y, Rgb(colour));
        }
        self.text([origin[0], origin[1] - 30], title);
        self.text([origin[0], origin[1] + 56], low);
        self.text([origin[0] + width - LETTER * high.len() as u32, origin[1] + 56], high);
    }

    /// Black letters on white.
    fn text(&mut self, at: [u32; 2], text: &str) {
        for (i, letter) in (0..).zip(text.chars()) {
            let rows = BASIC_FONTS.get(letter).unwrap_or_default();
            let places = (0..LINE).flat_map(|y| (0..LETTER).map(move |x| [x, y]));
            for [x, y] in places {
                let row = (y.wrapping_sub(2) / 2) as usize;
                let is_set = rows.get(row).is_some_and(|row| row >> (x / 2) & 1 == 1);
                let place = [at[0] + i * LETTER + x, at[1] + y];
                if place[0] < self.image.width() && place[1] < self.image.height() {
                    self.image.put_pixel(place[0], place[1], Rgb([if is_set { 0 } else { 255 }; 3]));
                }
            }
        }
    }

    /// The sheet as PNG, at the best compression.
    ///
    /// # Errors
    /// The encoder fails.
    pub fn png(&self) -> image::ImageResult<Vec<u8>> {
        use image::codecs::png::{CompressionType, FilterType, PngEncoder};
        let mut out = Vec::new();
        let encoder = PngEncoder::new_with_quality(&mut out, CompressionType::Best, FilterType::Adaptive);
        self.image.write_with_encoder(encoder)?;
        Ok(out)
    }
}

/// What is displayed of a value over the mean of its picture, 0 to 1.
fn displayed(value: f64) -> f64 {
    (0.4 * value.max(0.0)).min(1.0).powf(1.0 / 2.2)
}

/// The root mean squared difference of two pictures as they are displayed, of white.
pub fn displayed_difference(exact: &[f64], picture: &[f64]) -> f64 {
    let mean = exact.iter().sum::<f64>() / exact.len() as f64;
    let squares = exact.iter().zip(picture).map(|(a, b)| (displayed(a / mean) - displayed(b / mean)).powi(2));
    (squares.sum::<f64>() / exact.len() as f64).sqrt()
}

/// The colour of a number from 0 to 1: from black over violet and orange to light yellow.
pub fn scale(value: f64) -> [f64; 3] {
    const STOPS: [[f64; 3]; 5] =
        [[0.0, 0.0, 0.02], [0.32, 0.07, 0.48], [0.72, 0.22, 0.47], [0.99, 0.53, 0.38], [0.99, 0.99, 0.75]];
    let at = value.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let first = (at as usize).min(STOPS.len() - 2);
    std::array::from_fn(|k| STOPS[first][k] + (STOPS[first + 1][k] - STOPS[first][k]) * (at - first as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A name changes no pixel of a panel, and is written in the strip above it.
    #[test]
    fn names_hide_nothing() {
        let drawn = |name: &str| {
            let mut sheet = Sheet::of_panels([1, 2], [64, 48], 1.0);
            sheet.map([0, 1], |_| [0.5; 3], name);
            sheet
        };
        let (named, bare) = (drawn("abc"), drawn(""));
        let [x, y] = named.corner([0, 1]);
        let inside = |(at, _): &((u32, u32), _)| at.0 >= x && at.1 >= y;
        let of = |sheet: &Sheet| {
            let pixels = sheet.image.enumerate_pixels().map(|(x, y, colour)| ((x, y), *colour));
            pixels.partition::<Vec<_>, _>(inside)
        };
        let ((panel, strip), (same, white)) = (of(&named), of(&bare));
        assert!(panel.len() == 64 * 48 && panel == same && strip != white);
    }

    #[test]
    fn the_scale_of_errors_becomes_lighter() {
        let luminance = |value: f64| scale(value).iter().sum::<f64>();
        assert!((1..=32).all(|i| luminance(f64::from(i) / 32.0) > luminance(f64::from(i - 1) / 32.0)));
    }
}
