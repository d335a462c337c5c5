//! Directions <-> positions on the faces of a map, for every layout, with the solid angle of a position.
//!
//! A face is a grid of patches. Along each axis the edge between patches k - 1 and k lies at `edge(k)`, in units of texels:
//! for a bilinear client an edge runs through texel centres, so the first and the last patch are half as wide. Lat-long maps
//! begin their columns at the first texel centre and wrap. The same functions serve one direction and eight.

use super::warp::{Profile, Profiles};
use crate::simd::{Apart, Num};
use crate::sphere::{
    SPHERE, atan_turns, azimuth, octahedral_direction, octahedral_square, sin_cos_half, sin_cos_quarters,
};
use core::f32::consts::PI;

/// How directions are laid out over a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// Columns are the azimuth, rows the polar angle from +z.
    LatLong,
    /// Six square faces below one another: +x, -x, +y, -y, +z, -z, each as OpenGL orients it.
    Cube,
    /// The equal-area octahedral square (Clarberg 2008): columns along axis 1, rows along axis 2.
    Octahedral,
}

/// All of them, by their numbers.
pub const LAYOUTS: [Layout; 3] = [Layout::LatLong, Layout::Cube, Layout::Octahedral];

impl Layout {
    /// Whether a map may have these sides.
    pub fn fits(self, width: u32, height: u32) -> bool {
        match self {
            Layout::LatLong => true,
            Layout::Cube => width.checked_mul(6) == Some(height),
            Layout::Octahedral => width == height,
        }
    }
}

/// One axis of a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// Patches along the axis.
    pub patches: u32,
    /// The length of the axis, in texels.
    pub length: f32,
    /// How far the edges lie before whole numbers: 1/2 where patches lie between texel centres.
    pub shift: f32,
}

impl Axis {
    /// Where patch `k` begins.
    #[inline(always)]
    pub fn edge<F: Num>(&self, k: F) -> F {
        (k - F::splat(self.shift)).max(F::splat(0.0)).min(F::splat(self.length))
    }

    /// The same in f64.
    pub fn edge_f64(&self, k: u32) -> f64 {
        (f64::from(k) - f64::from(self.shift)).max(0.0).min(f64::from(self.length))
    }

    /// The patch that holds a position in [0, length].
    #[inline(always)]
    pub fn patch<F: Num>(&self, position: F) -> F::Ints {
        let last = (self.patches - 1) as f32;
        (position + F::splat(self.shift)).max(F::splat(0.0)).min(F::splat(last)).truncate()
    }
}

/// What is added to the sine of the polar angle, so that the density at a pole is a number; far below any texel.
pub const POLE: f32 = 1.0 / (1u64 << 40) as f32;

/// The layout of a light: which direction a position on a face stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chart {
    /// How directions are laid out.
    pub layout: Layout,
    /// Columns and rows of a face.
    pub axes: [Axis; 2],
    /// Lat-long: where column 0 begins, in texels from azimuth 0.
    pub offset: f32,
}

/// Where a direction is: the number of its face, the position (column, row), and the solid angle of a texel there.
#[derive(Clone, Copy)]
pub struct Place<F: Num> {
    /// The face, as a number.
    pub face: F,
    /// The position along columns and rows.
    pub position: [F; 2],
    /// Steradians for each unit of position in both axes.
    pub solid_angle: F,
}

// Most maps are lat-long: the other layouts stand apart, so that they are no cold code between.
/// [`Chart::place`] on them.
struct OtherPlace<'a, F>(&'a Chart, [F; 3]);
/// [`Chart::direction_and_angle`] on them.
struct OtherDirection<'a, F>(&'a Chart, F, [F; 2]);
/// [`Chart::profiles`] on a cube.
struct ProfilesCube<'a, F>(&'a Chart, [F; 2], [F; 2]);

macro_rules! apart {
    ($computation:ident, $output:ty, |$of:ident| $run:expr) => {
        impl<F: Num> Apart<F> for $computation<'_, F> {
            type Output = $output;

            #[inline(always)]
            fn run(self) -> $output {
                let $of = self;
                $run
            }
        }
    };
}

apart!(OtherPlace, Place<F>, |of| match of.0.layout {
    Layout::Cube => of.0.place_cube(of.1),
    _ => of.0.place_octahedral(of.1),
});
apart!(OtherDirection, ([F; 3], F), |of| match of.0.layout {
    Layout::Cube => of.0.direction_cube(of.1, of.2),
    _ => of.0.direction_octahedral(of.2),
});
apart!(ProfilesCube, Profiles<F>, |of| of.0.profiles_cube(of.1, of.2));

impl Chart {
    /// Faces of the layout.
    pub fn faces(&self) -> u32 {
        if self.layout == Layout::Cube { 6 } else { 1 }
    }

    /// How close to a border along an axis, in units of position, a direction's rounding may be felt.
    #[inline(always)]
    pub fn margin(&self, axis: usize) -> f32 {
        const SHARE: f32 = 1.0 / (1 << 22) as f32;
        self.axes[axis].length * SHARE
    }

    /// Where a direction of unit length is.
    #[inline(always)]
    pub fn place<F: Num>(&self, d: [F; 3]) -> Place<F> {
        if self.layout == Layout::LatLong {
            return self.place_latlong(d);
        }
        // Taken apart: else lat-long maps would answer through the memory that the function does.
        let Place { face, position: [x, y], solid_angle } = F::apart(OtherPlace(self, d));
        Place { face, position: [x, y], solid_angle }
    }

    /// The direction of a position on a face.
    #[inline(always)]
    pub fn direction<F: Num>(&self, face: F, position: [F; 2]) -> [F; 3] {
        self.direction_and_angle(face, position).0
    }

    /// The direction of a position on a face, and the steradians for each unit of position in both axes.
    #[inline(always)]
    pub fn direction_and_angle<F: Num>(&self, face: F, position: [F; 2]) -> ([F; 3], F) {
        if self.layout == Layout::LatLong {
            return self.direction_latlong(position);
        }
        let ([x, y, z], angle) = F::apart(OtherDirection(self, face, position));
        ([x, y, z], angle)
    }

    /// Steradians for each unit of position in a lat-long map, but for the sine.
    fn latlong_unit(&self) -> f32 {
        2.0 * PI / self.axes[0].length * (PI / self.axes[1].length)
    }

    #[inline(always)]
    fn place_latlong<F: Num>(&self, [x, y, z]: [F; 3]) -> Place<F> {
        let (zero, one) = (F::splat(0.0), F::splat(1.0));
        let [columns, rows] = [self.axes[0].length, self.axes[1].length];
        let sine = (x * x + y * y).sqrt();
        let polar = atan_turns(sine / (one + z.abs()));
        let row = F::select(z.lt(zero), one - polar, polar) * F::splat(rows);
        let around = azimuth(x, y) * F::splat(columns * 0.25) - F::splat(self.offset);
        let column = F::select(around.lt(zero), around + F::splat(columns), around);
        let solid_angle = (sine + F::splat(POLE)) * F::splat(self.latlong_unit());
        Place { face: zero, position: [column, row], solid_angle }
    }

    #[inline(always)]
    fn direction_latlong<F: Num>(&self, [column, row]: [F; 2]) -> ([F; 3], F) {
        let [columns, rows] = [self.axes[0].length, self.axes[1].length];
        let (sine, cosine) = sin_cos_half(row * F::splat(2.0 / rows));
        let z = cosine.copysign(F::splat(0.5 * rows) - row);
        let four = F::splat(4.0);
        let turned = (column + F::splat(self.offset)) * F::splat(4.0 / columns);
        let (sin, cos) = sin_cos_quarters(F::select(four.le(turned), turned - four, turned));
        let solid_angle = (sine + F::splat(POLE)) * F::splat(self.latlong_unit());
        ([sine * cos, sine * sin, z], solid_angle)
    }

    #[inline(always)]
    fn place_cube<F: Num>(&self, [x, y, z]: [F; 3]) -> Place<F> {
        let (zero, one) = (F::splat(0.0), F::splat(1.0));
        let (ax, ay, az) = (x.abs(), y.abs(), z.abs());
        let along_x = F::and(ay.le(ax), az.le(ax));
        let along_y = az.le(ay);
        let axis = (along_x, along_y);
        let major = pick::<F>(axis, [x, y, z]);
        let sign = one.copysign(major);
        // Seen from inside, s runs along -z, x, x and t along -y, z, -y on the positive faces.
        let s = pick::<F>(axis, [zero - z * sign, x, x * sign]);
        let t = pick::<F>(axis, [zero - y, z * sign, zero - y]);
        let scale = one / major.abs().max(F::splat(f32::MIN_POSITIVE));
        let face = pick::<F>(axis, [zero, F::splat(2.0), F::splat(4.0)]) + F::only(major.le(zero), one);
        let (s, t) = (s * scale, t * scale);
        let half = F::splat(0.5 * self.axes[0].length);
        let inverse = scale_of_plane(s, t);
        let unit = 2.0 / self.axes[0].length;
        Place { face, position: [half + half * s, half + half * t], solid_angle: inverse * F::splat(unit * unit) }
    }

    #[inline(always)]
    fn direction_cube<F: Num>(&self, face: F, [column, row]: [F; 2]) -> ([F; 3], F) {
        let (zero, one) = (F::splat(0.0), F::splat(1.0));
        let unit = F::splat(2.0 / self.axes[0].length);
        let (s, t) = (column * unit - one, row * unit - one);
        let length = (s * s + t * t + one).sqrt();
        let (s, t, m) = (s / length, t / length, one / length);
        let along_x = face.lt(F::splat(2.0));
        let along_y = face.lt(F::splat(4.0));
        let pair = F::select(along_x, zero, F::select(along_y, F::splat(2.0), F::splat(4.0)));
        let sign = F::select(pair.lt(face), zero - one, one);
        let axis = (along_x, along_y);
        let direction = [
            pick::<F>(axis, [m * sign, s, s * sign]),
            pick::<F>(axis, [zero - t, m * sign, zero - t]),
            pick::<F>(axis, [zero - s * sign, t * sign, m * sign]),
        ];
        (direction, m * m * m * unit * unit)
    }

    /// As [`octahedral_square`], in texels.
    #[inline(always)]
    fn place_octahedral<F: Num>(&self, d: [F; 3]) -> Place<F> {
        let side = self.axes[0].length;
        let [s, t] = octahedral_square(d);
        Place { face: F::splat(0.0), position: [s * side, t * side], solid_angle: F::splat(SPHERE / (side * side)) }
    }

    /// As [`octahedral_direction`], from texels.
    #[inline(always)]
    fn direction_octahedral<F: Num>(&self, [column, row]: [F; 2]) -> ([F; 3], F) {
        let side = self.axes[0].length;
        let unit = 1.0 / side;
        (octahedral_direction([column * unit, row * unit]), F::splat(SPHERE / (side * side)))
    }

    /// How the solid angle varies down and across a patch, each as a parabola in its own coordinate; but for a constant factor
    /// the solid angle of a position is their product.
    #[inline(always)]
    pub fn profiles<F: Num>(&self, low: [F; 2], size: [F; 2]) -> Profiles<F> {
        match self.layout {
            Layout::LatLong => Profiles { down: Some(self.profile_of_sines(low[1], size[1])), across: None },
            Layout::Cube => F::apart(ProfilesCube(self, low, size)),
            Layout::Octahedral => Profiles { down: None, across: None },
        }
    }

    #[inline(always)]
    fn profiles_cube<F: Num>(&self, low: [F; 2], size: [F; 2]) -> Profiles<F> {
        let (half, one) = (F::splat(0.5), F::splat(1.0));
        let unit = F::splat(2.0 / self.axes[0].length);
        let (s, t) = (low[0] * unit - one, low[1] * unit - one);
        let (width, height) = (size[0] * unit, size[1] * unit);
        let (middle_s, middle_t) = (s + half * width, t + half * height);
        let centre = scale_of_plane(middle_s, middle_t);
        let (left, right) = (scale_of_plane(s, middle_t), scale_of_plane(s + width, middle_t));
        let (top, bottom) = (scale_of_plane(middle_s, t), scale_of_plane(middle_s, t + height));
        Profiles {
            down: Some(Profile::through(top, centre, bottom)),
            across: Some(Profile::through(left, centre, right)),
        }
    }

    /// The sine of the polar angle down a patch: sin(m +- h) = sin m cos h +- cos m sin h about its middle m.
    #[inline(always)]
    fn profile_of_sines<F: Num>(&self, low: F, size: F) -> Profile<F> {
        let (zero, one) = (F::splat(0.0), F::splat(1.0));
        let rows = self.axes[1].length;
        let middle = low + F::splat(0.5) * size;
        let (sine, magnitude) = sin_cos_half(middle * F::splat(2.0 / rows));
        let cosine = magnitude.copysign(F::splat(0.5 * rows) - middle);
        let h = size * F::splat(0.5 * PI / rows);
        let squared = h * h;
        let third = F::splat(1.0 / 6.0) - squared * (F::splat(1.0 / 120.0) - squared * F::splat(1.0 / 5040.0));
        let fourth = F::splat(1.0 / 24.0) - squared * F::splat(1.0 / 720.0);
        let sine_h = h * (one - squared * third);
        // 1 - cos h
        let versed_h = squared * (F::splat(0.5) - squared * fourth);
        let (mean, tilt, drop) = (sine, cosine * sine_h, sine * versed_h);
        let pole = F::splat(POLE);
        let first = F::select(low.le(zero), zero, (mean - drop - tilt).max(zero)) + pole;
        let last = F::select(F::splat(rows).le(low + size), zero, (mean - drop + tilt).max(zero)) + pole;
        Profile { first, last, bulge: F::splat(4.0) * drop }
    }
}

/// The first where the major axis is x, the second where it is y, the third elsewhere.
#[inline(always)]
fn pick<F: Num>((along_x, along_y): (F::Mask, F::Mask), [a, b, c]: [F; 3]) -> F {
    F::select(along_x, a, F::select(along_y, b, c))
}

/// (1 + s^2 + t^2)^(-3/2): the solid angle of a unit of area on a cube face.
#[inline(always)]
fn scale_of_plane<F: Num>(s: F, t: F) -> F {
    let squared = F::splat(1.0) + s * s + t * t;
    F::splat(1.0) / (squared * squared.sqrt())
}
