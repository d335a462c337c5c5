//! Windows as renderers without the library sample them: uniformly in their solid angle (Urena, Fajardo, King 2013), and by the window
//! of a rectified map that a point sees (Bitterli, Novak, Jarosz 2015), as pbrt-v4 does it.

use crate::client::{Density, Result, raw};
use crate::light::Light;
use glam::{DVec3, Vec3};
use std::f64::consts::{PI, TAU};

/// A rectangle in the world. `edges[0]` x `edges[1]` points into the room.
#[derive(Clone, Copy, Debug)]
pub struct Portal {
    pub corner: Vec3,
    pub edges: [Vec3; 2],
}

impl Portal {
    /// As the library takes it at a point.
    pub fn at(&self, origin: Vec3) -> raw::wis_portal {
        raw::wis_portal { corner: (self.corner - origin).to_array(), edges: self.edges.map(|edge| edge.to_array()) }
    }

    /// Along both edges, and out of the room.
    fn axes(&self) -> [Vec3; 3] {
        let [x, y] = self.edges.map(Vec3::normalize);
        [x, y, y.cross(x)]
    }

    fn seen_from(&self, origin: Vec3) -> Option<Seen> {
        let (axes, corner) = (self.axes(), (self.corner - origin).as_dvec3());
        let [x, y, distance] = axes.map(|axis| axis.as_dvec3().dot(corner));
        let [width, height] = self.edges.map(|edge| f64::from(edge.length()));
        (distance > 0.0).then_some(Seen { axes, distance, low: [x, y], high: [x + width, y + height] })
    }
}

/// A portal before a point: the rectangle from `low` to `high` at a distance along the third axis.
pub struct Seen {
    axes: [Vec3; 3],
    distance: f64,
    low: [f64; 2],
    high: [f64; 2],
}

impl Seen {
    /// Where a direction goes through the plane, over the distance; none behind.
    fn tangents(&self, wi: [f32; 3]) -> Option<[f64; 2]> {
        let [x, y, z] = self.axes.map(|axis| f64::from(axis.dot(Vec3::from(wi))));
        (z > 0.0).then_some([x / z, y / z])
    }

    fn shows(&self, [x, y]: [f64; 2]) -> bool {
        let inside = |k: usize, t: f64| (self.low[k]..=self.high[k]).contains(&(t * self.distance));
        inside(0, x) && inside(1, y)
    }

    fn direction(&self, [x, y, z]: [f64; 3]) -> [f32; 3] {
        let local = DVec3::new(x, y, z).normalize().as_vec3();
        let [a, b, c] = self.axes;
        (a * local.x + b * local.y + c * local.z).to_array()
    }
}

/// What the portals of a point are sampled by: each in proportion to what its own measure says of it.
pub trait Measure {
    /// How much a portal has.
    fn total(&self) -> f64;
    fn seen(&self) -> &Seen;
    /// A point of the plane at distance 1, by a measure of `total`.
    fn sample(&self, u: [f64; 2]) -> [f64; 2];
    /// The measure of a solid angle about such a point.
    fn density(&self, tangents: [f64; 2]) -> f64;
}

/// The portals that a point sees, as one density.
pub struct Portals<M>(Vec<M>);

impl<M> Default for Portals<M> {
    fn default() -> Portals<M> {
        Portals(Vec::new())
    }
}

impl<M: Measure> Portals<M> {
    fn total(&self) -> f64 {
        self.0.iter().map(Measure::total).sum()
    }

    fn pdf_of(&self, wi: [f32; 3], total: f64) -> f32 {
        let of = |m: &M| m.seen().tangents(wi).filter(|&t| m.seen().shows(t)).map_or(0.0, |t| m.density(t));
        (self.0.iter().map(of).sum::<f64>() / total) as f32
    }

    /// Whether there is light to sample.
    pub fn are_there(&self) -> bool {
        self.total() > 0.0
    }
}

impl<M: Measure> Density for Portals<M> {
    fn sample_n(&self, u: &[[f32; 2]], drawn: &mut [raw::wis_drawn]) -> Result<()> {
        let total = self.total();
        for (u, drawn) in u.iter().zip(drawn) {
            // The portal by the first number, of which the rest is as good as new.
            let (mut rest, mut chosen) = (f64::from(u[0]) * total, &self.0[0]);
            for m in self.0.iter().filter(|m| m.total() > 0.0) {
                chosen = m;
                if rest < m.total() {
                    break;
                }
                rest -= m.total();
            }
            let first = (rest / chosen.total()).clamp(0.0, 1.0 - f64::EPSILON);
            let [x, y] = chosen.sample([first, f64::from(u[1])]);
            drawn.wi = chosen.seen().direction([x, y, 1.0]);
            drawn.pdf = self.pdf_of(drawn.wi, total);
        }
        Ok(())
    }

    fn pdf_n(&self, wi: &[[f32; 3]], pdf: &mut [f32]) -> Result<()> {
        let total = self.total();
        wi.iter().zip(pdf).for_each(|(wi, pdf)| *pdf = self.pdf_of(*wi, total));
        Ok(())
    }
}

/// Uniform in the solid angle.
pub struct Uniform {
    seen: Seen,
    /// The z of the normals of two opposite sides of the cone, and an angle of it.
    b: [f64; 2],
    k: f64,
    solid_angle: f64,
}

impl Uniform {
    pub fn of(portals: &[Portal], origin: Vec3) -> Portals<Uniform> {
        Portals(portals.iter().filter_map(|portal| portal.seen_from(origin)).map(Uniform::new).collect())
    }

    fn new(seen: Seen) -> Uniform {
        let corner = |x: f64, y: f64| DVec3::new(x, y, -seen.distance);
        let ([x0, y0], [x1, y1]) = (seen.low, seen.high);
        let corners = [corner(x0, y0), corner(x1, y0), corner(x1, y1), corner(x0, y1)];
        let n = [0, 1, 2, 3].map(|i| corners[i].cross(corners[(i + 1) % 4]).normalize());
        let angle = |i: usize| (-n[i].dot(n[(i + 1) % 4])).clamp(-1.0, 1.0).acos();
        let k = TAU - angle(2) - angle(3);
        Uniform { b: [n[0].z, n[2].z], k, solid_angle: angle(0) + angle(1) - k, seen }
    }
}

impl Measure for Uniform {
    fn total(&self) -> f64 {
        self.solid_angle.max(0.0)
    }

    fn seen(&self) -> &Seen {
        &self.seen
    }

    fn sample(&self, u: [f64; 2]) -> [f64; 2] {
        let Uniform { seen: Seen { distance, low, high, .. }, b, k, solid_angle } = self;
        let (sin, cos) = (u[0] * solid_angle + k).sin_cos();
        let f = (cos * b[0] - b[1]) / sin;
        let c = (f.signum() / f.hypot(b[0])).clamp(-1.0, 1.0);
        let x = (c * distance / (1.0 - c * c).max(1e-18).sqrt()).clamp(low[0], high[0]);
        let d = x.hypot(*distance);
        let [h0, h1] = [low[1], high[1]].map(|y| y / y.hypot(d));
        let h = h0 + u[1] * (h1 - h0);
        let y = (h * d / (1.0 - h * h).max(1e-18).sqrt()).clamp(low[1], high[1]);
        [x / distance, y / distance]
    }

    fn density(&self, _: [f64; 2]) -> f64 {
        1.0
    }
}

/// Cells along each side of a rectified map: as fine as a map of 1024 x 512 texels.
const SIDE: usize = 512;

/// The light through a portal over the angles by which directions lean along both edges: every point of the room sees a rectangle of it.
struct Rectified {
    portal: Portal,
    /// Sums of all cells before a column and a row.
    sums: Vec<f64>,
}

/// The angle of a tangent as a place in the map, and back.
fn place(tangent: f64) -> f64 {
    (tangent.atan() / PI + 0.5) * SIDE as f64
}

fn tangent(place: f64) -> f64 {
    ((place / SIDE as f64 - 0.5) * PI).tan()
}

/// Solid angle for a cell of the map, at tangents.
fn solid_angle([x, y]: [f64; 2]) -> f64 {
    let step = PI / SIDE as f64;
    (1.0 + x * x) * (1.0 + y * y) / (1.0 + x * x + y * y).powf(1.5) * step * step
}

impl Rectified {
    fn new(portal: Portal, light: &Light) -> Rectified {
        let [x, y, z] = portal.axes();
        let value = |i: usize, j: usize| {
            let t = [i, j].map(|c| tangent(c as f64 + 0.5));
            let wi = (x * t[0] as f32 + y * t[1] as f32 + z).normalize();
            f64::from(light.radiance(wi)) * solid_angle(t)
        };
        let mut sums = vec![0.0; (SIDE + 1) * (SIDE + 1)];
        for j in 0..SIDE {
            let mut row = 0.0;
            for i in 0..SIDE {
                row += value(i, j);
                sums[(j + 1) * (SIDE + 1) + i + 1] = sums[j * (SIDE + 1) + i + 1] + row;
            }
        }
        Rectified { portal, sums }
    }

    /// The sum before a column, which may lie between two, and a row, likewise.
    fn before(&self, x: f64, y: f64) -> f64 {
        let (i, j) = ((x as usize).min(SIDE - 1), (y as usize).min(SIDE - 1));
        let (a, b) = (x - i as f64, y - j as f64);
        let row = |j: usize| {
            let at = j * (SIDE + 1) + i;
            self.sums[at] + a * (self.sums[at + 1] - self.sums[at])
        };
        row(j) + b * (row(j + 1) - row(j))
    }
}

/// Where sums up to a place, which grow from `low` to `high` and are straight within cells, reach `share` of the whole.
fn bisect([mut low, mut high]: [f64; 2], share: f64, up_to: impl Fn(f64) -> f64) -> f64 {
    let ends = [low, high].map(&up_to);
    let wanted = ends[0] + share * (ends[1] - ends[0]);
    let mut at = ends;
    while high.ceil() - low.floor() > 1.0 {
        let middle = ((low.floor() + high.ceil()) / 2.0).floor().clamp(low, high);
        let sum = up_to(middle);
        if sum > wanted { (high, at[1]) = (middle, sum) } else { (low, at[0]) = (middle, sum) }
    }
    low + (high - low) * ((wanted - at[0]) / (at[1] - at[0]).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
}

/// By the light that the point sees through the portal.
pub struct Window<'a> {
    seen: Seen,
    map: &'a Rectified,
    low: [f64; 2],
    high: [f64; 2],
    total: f64,
}

impl Window<'_> {
    fn new(map: &Rectified, seen: Seen) -> Window<'_> {
        let ends = |ends: [f64; 2]| ends.map(|end| place(end / seen.distance));
        let (low, high) = (ends(seen.low), ends(seen.high));
        let window = Window { seen, map, low, high, total: 0.0 };
        Window { total: window.columns(high[0]) - window.columns(low[0]), ..window }
    }

    /// The sum of the window before a column.
    fn columns(&self, x: f64) -> f64 {
        self.map.before(x, self.high[1]) - self.map.before(x, self.low[1])
    }
}

impl Measure for Window<'_> {
    fn total(&self) -> f64 {
        self.total.max(0.0)
    }

    fn seen(&self) -> &Seen {
        &self.seen
    }

    fn sample(&self, u: [f64; 2]) -> [f64; 2] {
        let x = bisect([self.low[0], self.high[0]], u[0], |x| self.columns(x));
        // The rows of that column alone.
        let sides = [x.floor().min(SIDE as f64 - 1.0), x.floor().min(SIDE as f64 - 1.0) + 1.0];
        let y =
            bisect([self.low[1], self.high[1]], u[1], |y| self.map.before(sides[1], y) - self.map.before(sides[0], y));
        [tangent(x), tangent(y)]
    }

    fn density(&self, tangents: [f64; 2]) -> f64 {
        let [x, y] = tangents.map(|t| place(t).floor().clamp(0.0, SIDE as f64 - 1.0));
        let before = |x, y| self.map.before(x, y);
        (before(x + 1.0, y + 1.0) - before(x, y + 1.0) - before(x + 1.0, y) + before(x, y)) / solid_angle(tangents)
    }
}

/// The portals of a scene under a light.
pub struct Room {
    pub portals: Vec<Portal>,
    /// Whether no light comes from elsewhere.
    pub is_complete: bool,
    maps: Vec<Rectified>,
}

impl Room {
    /// None without portals.
    pub fn new(portals: &[Portal], is_complete: bool, light: &Light) -> Option<Room> {
        let maps = portals.iter().map(|&portal| Rectified::new(portal, light)).collect();
        (!portals.is_empty()).then(|| Room { portals: portals.into(), is_complete, maps })
    }

    /// What pbrt-v4 samples at a point.
    pub fn windows(&self, origin: Vec3) -> Portals<Window<'_>> {
        let seen = self.maps.iter().filter_map(|map| Some((map, map.portal.seen_from(origin)?)));
        Portals(seen.map(|(map, seen)| Window::new(map, seen)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both densities integrate to 1, and samples have them: the mean of 1 / pdf is the solid angle, and of any function its integral.
    #[test]
    fn samples_have_the_densities_that_are_stated() {
        let portals = [
            Portal { corner: Vec3::new(-0.5, -0.2, 1.0), edges: [Vec3::Y * 0.9, Vec3::X * 1.3] },
            Portal { corner: Vec3::new(2.0, 0.3, 0.1), edges: [Vec3::Z * 0.8, Vec3::Y * 0.5] },
            Portal { corner: Vec3::new(-0.5, -0.2, -1.0), edges: [Vec3::Y * 0.9, Vec3::X * 1.3] },
        ];
        let light = Light::room(64);
        let room = Room::new(&portals, true, &light).unwrap();
        let u = crate::points::of(3, 1 << 16);
        let check = |density: &dyn Density| {
            let mut drawn = vec![raw::wis_drawn::default(); u.len()];
            density.sample_n(&u, &mut drawn).unwrap();
            assert!(drawn.iter().all(|drawn| drawn.pdf > 0.0));
            let mean = |f: fn([f32; 3]) -> f64| {
                drawn.iter().map(|drawn| f(drawn.wi) / f64::from(drawn.pdf)).sum::<f64>() / u.len() as f64
            };
            [mean(|_| 1.0), mean(|wi| f64::from(wi[2])), mean(|wi| f64::from(wi[0] * wi[1]))]
        };
        let [uniform, window] = [check(&Uniform::of(&portals, Vec3::ZERO)), check(&room.windows(Vec3::ZERO))];
        let whole: f64 = Uniform::of(&portals, Vec3::ZERO).total();
        // The third portal is seen from behind.
        assert!(Uniform::of(&portals, Vec3::ZERO).0.len() == 2 && (uniform[0] / whole - 1.0).abs() < 1e-3);
        for (a, b) in uniform.iter().zip(window) {
            assert!((a - b).abs() < 5e-3 * whole, "{uniform:?} {window:?}");
        }
    }
}
