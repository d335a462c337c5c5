//! Sampling inside a patch: density proportional to a bilinear function times a profile along each axis.
//!
//! The corners give the bilinear radiance, the profiles the solid angle (the sine of the polar angle, the tilt of a cube
//! face), as parabolas. Row first, from the density integrated over columns; then the column. Each is a quartic whose root
//! Newton's method finds from a start that is exact when one of the two factors is constant.

use crate::simd::Num;

/// Newton steps at most. Away from the poles two are enough; beside a dark pole the density is a cube.
const STEPS: usize = 8;

/// The last Newton step begins with at most this share of the integral missing; it leaves the square of it.
const CLOSE: f32 = 1.0 / (1 << 10) as f32;

/// A parabola over [0, 1], written so that its values beside an end where it is 0 keep their relative precision.
#[derive(Clone, Copy)]
pub struct Profile<F: Num> {
    /// The value at 0.
    pub first: F,
    /// The value at 1.
    pub last: F,
    /// Four times what the value at 1/2 exceeds the mean of both ends by.
    pub bulge: F,
}

impl<F: Num> Profile<F> {
    /// The parabola through the values at 0, 1/2 and 1.
    #[inline(always)]
    pub fn through(first: F, middle: F, last: F) -> Profile<F> {
        let two = F::splat(2.0);
        Profile { first, last, bulge: two * (two * middle - (first + last)) }
    }

    /// The value at `x`.
    #[inline(always)]
    pub fn at(&self, x: F) -> F {
        let rest = F::splat(1.0) - x;
        self.first * rest + self.last * x + self.bulge * (x * rest)
    }
}

/// A density along one axis of a patch: linear from `from` to `to`, times a profile.
#[derive(Clone, Copy)]
pub struct Edge<F: Num> {
    /// Coefficients of x, x^2, x^3 and x^4 of the integral.
    integral: [F; 4],
    from: F,
    to: F,
    profile: Profile<F>,
}

impl<F: Num> Edge<F> {
    /// The density with these values at both ends and this profile.
    #[inline(always)]
    pub fn new(from: F, to: F, profile: Profile<F>) -> Edge<F> {
        let Profile { first, last, bulge } = profile;
        let tilt = last - first + bulge;
        let rise = to - from;
        let integral = [
            from * first,
            F::splat(0.5) * (from * tilt + rise * first),
            F::splat(1.0 / 3.0) * (rise * tilt - from * bulge),
            F::splat(-0.25) * (rise * bulge),
        ];
        Edge { integral, from, to, profile }
    }

    /// The integral over [0, 1].
    #[inline(always)]
    pub fn total(&self) -> F {
        let [a, b, c, d] = self.integral;
        (a + b) + (c + d)
    }

    /// The integral over [0, x].
    #[inline(always)]
    pub fn up_to(&self, x: F) -> F {
        let [a, b, c, d] = self.integral;
        (((d * x + c) * x + b) * x + a) * x
    }

    /// The x below which the share `u` of the integral lies.
    #[inline(always)]
    pub fn sample(&self, u: F) -> F {
        let (zero, one) = (F::splat(0.0), F::splat(1.0));
        let Profile { first, last, .. } = self.profile;
        // Exact if the linear factor or the profile is constant.
        let mut x = linear(self.from * first, self.to * last, u);
        let total = self.total();
        let (target, close) = (u * total, F::splat(CLOSE) * total);
        let [a, b, c, d] = self.integral;
        let (b2, c3, d4) = (b + b, F::splat(3.0) * c, F::splat(4.0) * d);
        let mut active = zero.le(zero);
        for _ in 0..STEPS {
            let excess = self.up_to(x) - target;
            let slope = ((d4 * x + c3) * x + b2) * x + a;
            let next = (x - excess / slope.max(F::splat(f32::MIN_POSITIVE))).max(zero).min(one);
            x = F::select(active, next, x);
            active = F::and(active, close.lt(excess.abs()));
            if F::bits(active) == 0 {
                break;
            }
        }
        x
    }
}

/// The value at `x` between two values; above 0 where one of them has a part in it, however small beside the other.
#[inline(always)]
fn between<F: Num>(from: F, to: F, x: F) -> F {
    from * (F::splat(1.0) - x) + to * x
}

/// The x below which the share `u` of a linear density lies.
#[inline(always)]
pub fn linear<F: Num>(from: F, to: F, u: F) -> F {
    let root = (from * from + u * (to * to - from * from)).max(F::splat(0.0)).sqrt();
    (u * (from + to) / (from + root).max(F::splat(f32::MIN_POSITIVE))).min(F::splat(1.0))
}

/// The share of a linear density below x.
#[inline(always)]
pub fn linear_up_to<F: Num>(from: F, to: F, x: F) -> F {
    let two = F::splat(2.0);
    x * (two * from + (to - from) * x) / (from + to).max(F::splat(f32::MIN_POSITIVE))
}

/// The profiles down and across a patch; one that is constant is left out.
#[derive(Clone, Copy)]
pub struct Profiles<F: Num> {
    /// Down the rows.
    pub down: Option<Profile<F>>,
    /// Across the columns.
    pub across: Option<Profile<F>>,
}

/// The density of a patch: corners (low row low column, low row high column, high row low column, high row high column) and
/// the profiles down and across.
#[derive(Clone, Copy)]
pub struct PatchDensity<F: Num> {
    corner: [F; 4],
    profiles: Profiles<F>,
    /// The densities of rows at both ends, integrated over columns.
    rows: [F; 2],
    /// The integral over the patch.
    total: F,
}

impl<F: Num> PatchDensity<F> {
    /// The density with these corners and profiles.
    #[inline(always)]
    pub fn new(corner: [F; 4], profiles: Profiles<F>) -> PatchDensity<F> {
        let half = F::splat(0.5);
        let [c00, c01, c10, c11] = corner;
        let rows = match profiles.across {
            None => [half * (c00 + c01), half * (c10 + c11)],
            Some(across) => {
                // The integrals of the profile, times 1 - x and times x.
                let Profile { first, last, bulge } = across;
                let twelfth = F::splat(1.0 / 12.0) * bulge;
                let sixth = F::splat(1.0 / 6.0);
                let low = F::splat(1.0 / 3.0) * first + sixth * last + twelfth;
                let high = F::splat(1.0 / 3.0) * last + sixth * first + twelfth;
                [low * c00 + high * c01, low * c10 + high * c11]
            }
        };
        let total = match profiles.down {
            None => half * (rows[0] + rows[1]),
            Some(down) => Edge::new(rows[0], rows[1], down).total(),
        };
        PatchDensity { corner, profiles, rows, total }
    }

    /// The values at both ends of the columns of a row position.
    #[inline(always)]
    fn columns(&self, t: F) -> [F; 2] {
        let [c00, c01, c10, c11] = self.corner;
        [between(c00, c10, t), between(c01, c11, t)]
    }

    /// The position (column, row) in [0, 1]^2 for `u` (column, row).
    #[inline(always)]
    pub fn sample(&self, u: [F; 2]) -> [F; 2] {
        let t = sample_axis(self.rows, self.profiles.down, u[1]);
        [sample_axis(self.columns(t), self.profiles.across, u[0]), t]
    }

    /// The `u` (column, row) that leads to a position.
    #[inline(always)]
    pub fn invert(&self, [s, t]: [F; 2]) -> [F; 2] {
        [share(self.columns(t), self.profiles.across, s), share(self.rows, self.profiles.down, t)]
    }

    /// The bilinear function at a position.
    #[inline(always)]
    pub fn bilinear(&self, [s, t]: [F; 2]) -> F {
        let [low, high] = self.columns(t);
        between(low, high, s)
    }

    /// The density at a position for each unit of the patch's area, but for the factor [`PatchDensity::total`].
    #[inline(always)]
    pub fn unscaled(&self, [s, t]: [F; 2]) -> F {
        let mut density = self.bilinear([s, t]);
        if let Some(down) = self.profiles.down {
            density = density * down.at(t);
        }
        if let Some(across) = self.profiles.across {
            density = density * across.at(s);
        }
        density
    }

    /// The integral of the unscaled density.
    #[inline(always)]
    pub fn total(&self) -> F {
        self.total
    }
}

#[inline(always)]
fn sample_axis<F: Num>([from, to]: [F; 2], profile: Option<Profile<F>>, u: F) -> F {
    match profile {
        None => linear(from, to, u),
        Some(profile) => Edge::new(from, to, profile).sample(u),
    }
}

#[inline(always)]
fn share<F: Num>([from, to]: [F; 2], profile: Option<Profile<F>>, x: F) -> F {
    match profile {
        None => linear_up_to(from, to, x),
        Some(profile) => {
            let edge = Edge::new(from, to, profile);
            edge.up_to(x) / edge.total().max(F::splat(f32::MIN_POSITIVE))
        }
    }
}
