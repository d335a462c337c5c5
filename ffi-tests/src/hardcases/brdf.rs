//! The naive twin of the lobes: published formulas in f64. What the library answers is held against it.

use crate::client::raw;
use std::f64::consts::PI;

/// A vector of the client.
pub type V3 = [f64; 3];

pub fn dot(a: V3, b: V3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: V3, b: V3) -> V3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub fn unit(a: V3) -> V3 {
    a.map(|x| x / dot(a, a).sqrt())
}

/// The nearest direction in single precision.
pub fn single(a: V3) -> [f32; 3] {
    a.map(|x| x as f32)
}

/// A lobe, of weight 1 but where it says otherwise.
#[derive(Clone, Copy, Debug)]
pub enum Lobe {
    Lambert(f64),
    /// Alphas along tangent and bitangent, and the reflectance at normal incidence.
    Ggx([f64; 2], f64),
    /// Alphas, and the refractive index beyond the surface over that before it; nothing is reflected at normal incidence.
    Through([f64; 2], f64),
    LambertThrough,
}

impl Lobe {
    /// The smallest half-angle, seen at the angle of the view.
    fn narrow(&self, cosine: f64) -> f64 {
        match self {
            Lobe::Lambert(_) | Lobe::LambertThrough => 1.0,
            Lobe::Ggx([a, b], _) | Lobe::Through([a, b], _) => a.min(*b) * cosine.max(0.02),
        }
    }

    /// For the library.
    pub fn shape(&self) -> raw::wis_lobe {
        let (kind, a, b, eta) = match *self {
            Lobe::Lambert(_) => (raw::WIS_LOBE_LAMBERT, 0.0, 0.0, 1.0),
            Lobe::Ggx([a, b], _) => (raw::WIS_LOBE_GGX, a, b, 1.0),
            Lobe::Through([a, b], eta) => (raw::WIS_LOBE_GGX_TRANSMISSION, a, b, eta),
            Lobe::LambertThrough => (raw::WIS_LOBE_LAMBERT_TRANSMISSION, 0.0, 0.0, 1.0),
        };
        raw::wis_lobe { kind, a: a as f32, b: b as f32, eta: eta as f32 }
    }

    /// Weight and reflectance for the library.
    pub fn factors(&self) -> (f32, f32) {
        match *self {
            Lobe::Lambert(weight) => (weight as f32, 0.0),
            Lobe::Ggx(_, f0) => (1.0, f0 as f32),
            _ => (1.0, 0.0),
        }
    }

    /// Without the cosine, in the frame of tangent, bitangent and normal; wo is above the surface.
    fn value(&self, wo: V3, wi: V3) -> f64 {
        match *self {
            Lobe::Lambert(weight) if wi[2] > 0.0 => f64::from(weight as f32) / PI,
            Lobe::LambertThrough if wi[2] < 0.0 => 1.0 / PI,
            Lobe::Ggx(alpha, f0) if wi[2] > 0.0 => ggx(alpha, f0, wo, wi),
            Lobe::Through(alpha, eta) if wi[2] < 0.0 => through(alpha, eta, wo, wi),
            _ => 0.0,
        }
    }
}

/// Walter et al. 2007, in the form of Heitz 2014: D and Smith's Lambda.
fn d(alpha: [f64; 2], h: V3) -> f64 {
    let [a, b] = alpha.map(|a| f64::from(a as f32));
    let slope = (h[0] / a).powi(2) + (h[1] / b).powi(2) + h[2] * h[2];
    1.0 / (PI * a * b * slope * slope)
}

fn lambda(alpha: [f64; 2], v: V3) -> f64 {
    let [a, b] = alpha.map(|a| f64::from(a as f32));
    0.5 * ((1.0 + ((a * v[0]).powi(2) + (b * v[1]).powi(2)) / (v[2] * v[2])).sqrt() - 1.0)
}

fn schlick(f0: f64, cosine: f64) -> f64 {
    let f0 = f64::from(f0 as f32);
    f0 + (1.0 - f0) * (1.0 - cosine.abs()).powi(5)
}

fn ggx(alpha: [f64; 2], f0: f64, wo: V3, wi: V3) -> f64 {
    let h = unit([0, 1, 2].map(|k| wo[k] + wi[k]));
    let g = 1.0 / (1.0 + lambda(alpha, wo) + lambda(alpha, wi));
    schlick(f0, dot(wo, h)) * d(alpha, h) * g / (4.0 * wo[2] * wi[2])
}

/// Walter et al. 2007, Eq. 21, with the index 1 on the side of wo.
fn through(alpha: [f64; 2], eta: f64, wo: V3, wi: V3) -> f64 {
    let eta = f64::from(eta as f32);
    let h = unit([0, 1, 2].map(|k| wo[k] + eta * wi[k]));
    let h = if h[2] < 0.0 { h.map(|x| -x) } else { h };
    let (o, i) = (dot(wo, h), dot(wi, h));
    if o <= 0.0 || i >= 0.0 {
        return 0.0;
    }
    let g = 1.0 / (1.0 + lambda(alpha, wo) + lambda(alpha, wi));
    let jacobian = eta * eta / (o + eta * i).powi(2);
    (1.0 - schlick(0.0, o)) * d(alpha, h) * g * (o * i).abs() * jacobian / (wo[2] * -wi[2])
}

/// A hit as the client evaluates it.
#[derive(Clone, Debug)]
pub struct Hit {
    pub lobes: Vec<Lobe>,
    axes: [V3; 3],
    wo: V3,
}

impl Hit {
    /// A view of so many degrees off the normal, in a plane that stands `around` off the tangent.
    pub fn new(lobes: &[Lobe], normal: V3, degrees: f64, around: f64) -> Hit {
        let n = unit(normal);
        let t = unit(cross(n, if n[0].abs() < 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] }));
        let ((sine, cosine), (y, x)) = (degrees.to_radians().sin_cos(), around.sin_cos());
        // What the library is given is what the client has.
        let [n, t] = [n, t].map(|v| unit(single(v).map(f64::from)));
        let t = unit([0, 1, 2].map(|k| t[k] - n[k] * dot(n, t)));
        let axes = [t, cross(n, t), n];
        let wo = [0, 1, 2].map(|k| n[k] * cosine + sine * (axes[0][k] * x + axes[1][k] * y));
        let wo = unit(single(wo).map(f64::from));
        Hit { lobes: lobes.to_vec(), axes, wo: axes.map(|axis| dot(axis, wo)) }
    }

    /// In the world.
    pub fn world(&self, local: V3) -> V3 {
        [0, 1, 2].map(|k| (0..3).map(|i| self.axes[i][k] * local[i]).sum())
    }

    /// Along tangent, bitangent and normal.
    pub fn local(&self, world: V3) -> V3 {
        self.axes.map(|axis| dot(axis, world))
    }

    /// The mirror direction of wo, or where it goes on through the surface.
    pub fn peak(&self) -> V3 {
        let [x, y, z] = self.wo;
        self.world(match self.lobes.last() {
            Some(Lobe::Through(_, eta)) => {
                let sine = 1.0 - (1.0 - z * z) / (eta * eta);
                // Beyond the critical angle: along the surface.
                let length = if sine > 0.0 { 1.0 / eta } else { 1.0 / x.hypot(y) };
                [-x * length, -y * length, -sine.max(1e-6).sqrt()]
            }
            Some(Lobe::LambertThrough) => [0.0, 0.0, -1.0],
            _ => [-x, -y, z],
        })
    }

    /// The angle over which the narrowest lobe varies.
    pub fn detail(&self) -> f64 {
        self.lobes.iter().map(|lobe| lobe.narrow(self.wo[2])).fold(1.0, f64::min)
    }

    /// BRDF x cosine of a direction of the world.
    pub fn f_cos(&self, wi: V3) -> f64 {
        let wi = self.local(wi);
        if wi[2] == 0.0 || self.wo[2] <= 0.0 {
            return 0.0;
        }
        self.lobes.iter().map(|lobe| lobe.value(self.wo, wi)).sum::<f64>() * wi[2].abs()
    }

    /// For the library; `material` is that of the lobes.
    pub fn point(&self, material: &raw::wis_material) -> raw::wis_point {
        let mut point = raw::wis_point {
            size: size_of::<raw::wis_point>() as u32,
            material,
            normal: single(self.axes[2]),
            tangent: single(self.axes[0]),
            wo: single(unit(self.world(self.wo))),
            ..Default::default()
        };
        for (k, (weight, f0)) in self.lobes.iter().map(Lobe::factors).enumerate() {
            (point.weight[k], point.f0[k]) = ([weight; 3], [f0; 3]);
        }
        point
    }
}
