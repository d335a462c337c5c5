//! Products and rays where lobes are anisotropic or grazing, where they transmit, under suns of 1e8, one texel, the smallest and the
//! largest radiance, and a map of 16384 x 8192.

use super::bounds::{self, Fault, Figures, Job, LARGEST, Limits, MISSED, Task, wide};
use super::brdf::{Hit, Lobe, V3, dot, single, unit};
use super::huge::Huge;
use super::maps::{Image, sky};
use super::quadrature::Peak;
use crate::client::raw;
use crate::environment::{Environment, material};

/// Rays that bring nothing are picked for the sake of other clients: candidate weights have a floor of 0.05 of their mean
/// (rule 24), and so has the density of a product (rule 16). What is above lies in cells that the horizon divides.
pub const IDLE: f64 = 0.06;
/// Samples of a product that bring nothing: that part of a lobe's own samples, too, which lies below the horizon.
pub const EMPTY: f64 = 0.2;

/// Where radiance comes from.
#[derive(Clone)]
enum Source {
    Image(Image),
    Huge(&'static Huge),
}

/// A hit under a map.
#[derive(Clone)]
pub struct Case {
    pub name: String,
    source: Source,
    hit: Hit,
    limits: Limits,
}

impl Case {
    fn new(name: impl Into<String>, image: &Image, hit: Hit, integral: f64) -> Case {
        let limits = Limits { integral, empty: EMPTY, idle: IDLE, weights: LARGEST, missed: MISSED };
        Case { name: name.into(), source: Source::Image(image.clone()), hit, limits }
    }

    /// Beyond the critical angle only the slopes of a rough surface let light through: most candidates bring nothing, and weights
    /// are large.
    fn nearly_black(self, largest: f64, missed: f64) -> Case {
        Case { limits: Limits { empty: 0.96, idle: 0.96, weights: largest, missed, ..self.limits }, ..self }
    }

    fn radiance(&self, least: f64, wi: V3) -> f64 {
        match &self.source {
            Source::Image(image) => image.radiance(true, false, least, single(wi)),
            Source::Huge(huge) => huge.radiance(least, wide(single(wi))),
        }
    }

    /// Measures, and says what is out of bounds.
    pub fn measure(&self, fault: Fault) -> Result<Figures, String> {
        let built;
        let environment = match &self.source {
            Source::Image(image) => {
                built = Environment::new(&image.map())?;
                &built
            }
            Source::Huge(huge) => huge.environment(),
        };
        let mean = environment.info.mean;
        let brings = |wi: V3| {
            let f_cos = self.hit.f_cos(wi);
            if f_cos > 0.0 { f_cos * self.radiance(mean / 65536.0, wi) / mean } else { 0.0 }
        };
        let mut peaks = vec![Peak { at: self.hit.peak(), detail: self.hit.detail() }];
        if let Source::Huge(huge) = self.source {
            peaks.push(huge.sun());
        }
        let task = Task::new(&brings, peaks, 1e-4, fault);
        let shapes: Vec<raw::wis_lobe> = self.hit.lobes.iter().map(Lobe::shape).collect();
        let material = material(&shapes)?;
        let point = self.hit.point(&material);
        let figures = bounds::product(environment, &point, &task, &self.limits)?;
        let rays = bounds::rays(environment, &point, None, &task, &self.limits)?;
        Ok(Figures { rays: Some(rays), ..figures })
    }
}

/// A normal that is aligned with no axis, texel or edge.
pub const NORMAL: V3 = [0.36, 0.48, 0.8];

/// A sun of one texel of 1e8 on a sky of 1, about this direction.
pub fn sun(at: V3) -> Image {
    let image = Image::new(64, 32, |_, _| 1.0);
    let texels = (0..32).flat_map(|y| (0..64).map(move |x| (x, y)));
    let nearness = |&(x, y): &(u32, u32)| (dot(wide(image.centre(x, y)), at) * 1e9) as i64;
    let (x, y) = texels.max_by_key(nearness).expect("a texel");
    Image::new(64, 32, |i, j| if (i, j) == (x, y) { 1e8 } else { 1.0 })
}

fn scaled(image: &Image, factor: f32) -> Image {
    Image::new(image.width, image.height, |x, y| factor * image.texels[(y * image.width + x) as usize])
}

fn hit(lobes: &[Lobe], degrees: f64) -> Hit {
    Hit::new(lobes, NORMAL, degrees, 0.7)
}

fn glossy(a: f64, b: f64) -> Lobe {
    Lobe::Ggx([a, b], 0.9)
}

const DIFFUSE: Lobe = Lobe::Lambert(0.8);
const ANISOTROPIC: [(f64, f64); 3] = [(0.5, 0.02), (0.3, 0.05), (0.02, 1.0)];
const GRAZING: [f64; 3] = [80.0, 85.0, 89.0];

/// All cases but that of the large map. The last number of each is how far apart the product's integral and the reference may be: the
/// figure when the row was written, and a quarter of it at least.
pub fn cases() -> Vec<Case> {
    [reflecting(), under_suns(), magnitudes(), through()].concat()
}

fn reflecting() -> Vec<Case> {
    let mut cases = Vec::new();
    let sky = sky();
    for ((a, b), limits) in ANISOTROPIC.into_iter().zip([[0.03, 0.15, 0.1, 0.1], [0.01, 0.15, 0.15, 0.15], [0.2; 4]]) {
        for (degrees, limit) in [45.0].into_iter().chain(GRAZING).zip(limits) {
            let name = format!("GGX {a} x {b}, view at {degrees} degrees, smooth sky");
            cases.push(Case::new(name, &sky, hit(&[glossy(a, b)], degrees), limit));
        }
    }
    for (alpha, limits) in [(0.1, [0.3, 0.2, 0.1]), (0.02, [0.05, 0.2, 0.01])] {
        for (degrees, limit) in GRAZING.into_iter().zip(limits) {
            let name = format!("GGX {alpha}, view at {degrees} degrees, smooth sky");
            cases.push(Case::new(name, &sky, hit(&[glossy(alpha, alpha)], degrees), limit));
        }
    }
    cases
}

fn under_suns() -> Vec<Case> {
    let mut cases = Vec::new();
    let limits = [[0.65, 0.2], [0.3, 0.2], [1.25, 0.2], [0.02, 0.35]];
    for ((a, b), limits) in ANISOTROPIC.into_iter().chain([(0.1, 0.1)]).zip(limits) {
        for (degrees, limit) in [45.0, 85.0].into_iter().zip(limits) {
            let hit = hit(&[glossy(a, b)], degrees);
            let name = format!("GGX {a} x {b}, view at {degrees} degrees, a sun of 1e8 in its mirror direction");
            cases.push(Case::new(name, &sun(hit.peak()), hit, limit));
        }
    }
    let (above, below) = (sun(NORMAL), sun(NORMAL.map(|x| -x)));
    let horizon = sun(unit([0.8, -0.48, -0.03]));
    let plastic = [DIFFUSE, Lobe::Ggx([0.02; 2], 0.05)];
    for (name, image, lobes, limit) in [
        ("Lambert, a sun of 1e8 above", &above, &[DIFFUSE][..], 0.001),
        ("Lambert, a sun of 1e8 on the horizon", &horizon, &[DIFFUSE], 0.07),
        ("Lambert, a sun of 1e8 below the surface", &below, &[DIFFUSE], 0.04),
        ("GGX 0.1, a sun of 1e8 below the surface", &below, &[glossy(0.1, 0.1)], 0.1),
        ("GGX 0.1, a sun of 1e8 far from its mirror direction", &above, &[glossy(0.1, 0.1)], 0.001),
        ("Lambert and GGX 0.02, a sun of 1e8 above", &above, &plastic, 0.01),
    ] {
        cases.push(Case::new(name, image, hit(lobes, 45.0), limit));
    }
    cases
}

fn magnitudes() -> Vec<Case> {
    let mut cases = Vec::new();
    let one = Image::new(1, 1, |_, _| 3.0);
    for (name, lobe, degrees, limit) in [
        ("Lambert", DIFFUSE, 45.0, 0.03),
        ("GGX 0.1", glossy(0.1, 0.1), 45.0, 0.06),
        ("GGX 0.3 x 0.05, view at 85 degrees", glossy(0.3, 0.05), 85.0, 0.07),
        ("GGX 0.2 through, index 1.5", Lobe::Through([0.2; 2], 1.5), 45.0, 0.06),
    ] {
        cases.push(Case::new(format!("{name}, map of 1 x 1"), &one, hit(&[lobe], degrees), limit));
    }
    for factor in [1e-40, 1e38] {
        for (name, lobe, limit) in [("Lambert", DIFFUSE, 0.02), ("GGX 0.1", glossy(0.1, 0.1), 0.06)] {
            let name = format!("{name}, smooth sky times {factor:e}");
            cases.push(Case::new(name, &scaled(&sky(), factor), hit(&[lobe], 45.0), limit));
        }
    }
    cases
}

fn through() -> Vec<Case> {
    let mut cases = Vec::new();
    let sky = sky();
    for (alpha, limits) in [(0.1, [0.1, 0.15, 0.2]), (0.3, [0.15; 3])] {
        for (degrees, limit) in GRAZING.into_iter().zip(limits) {
            let name = format!("GGX {alpha} through, index 1.5, view at {degrees} degrees, smooth sky");
            cases.push(Case::new(name, &sky, hit(&[Lobe::Through([alpha; 2], 1.5)], degrees), limit));
        }
    }
    for (degrees, limit, largest, missed) in
        [(80.0, 0.2, LARGEST, MISSED), (85.0, 0.5, 150.0, MISSED), (89.0, 1.0, 300.0, 0.06)]
    {
        let name = format!("GGX 0.3 through, index 1 / 1.5, view at {degrees} degrees, smooth sky");
        let hit = hit(&[Lobe::Through([0.3; 2], 1.0 / 1.5)], degrees);
        cases.push(Case::new(name, &sky, hit, limit).nearly_black(largest, missed));
    }
    let glass = hit(&[Lobe::Ggx([0.1; 2], 0.04), Lobe::Through([0.1; 2], 1.5)], 85.0);
    let name = "GGX 0.1 reflecting and through, view at 85 degrees, a sun of 1e8 behind";
    cases.push(Case::new(name, &sun(glass.peak()), glass, 0.07));
    let leaf = hit(&[Lobe::LambertThrough], 89.0);
    cases.push(Case::new("Lambert through, view at 89 degrees, smooth sky", &sky, leaf, 0.07));
    cases
}

/// The hits under the large map.
fn under(huge: &'static Huge) -> Vec<Case> {
    let of = |name: &str, lobe: Lobe, limit: f64| {
        let case = Case::new(format!("{name}, {HUGE}"), &Image::new(1, 1, |_, _| 0.0), hit(&[lobe], 45.0), limit);
        Case { source: Source::Huge(huge), ..case }
    };
    vec![
        of("Lambert", DIFFUSE, 0.002),
        of("GGX 0.1", glossy(0.1, 0.1), 0.03),
        of("GGX 0.5 x 0.02", glossy(0.5, 0.02), 1.1),
    ]
}

pub const HUGE: &str = "map of 16384 x 8192 with a sun of 1e8";

/// Adds the rows, without those of the large map where the machine has too little memory for it.
pub fn add(jobs: &mut Vec<Job>) {
    let under = match Huge::get() {
        Ok(huge) => huge.map(under),
        Err(fault) => {
            jobs.push(Job::new(HUGE, move || Err(fault.clone())));
            None
        }
    };
    for case in cases().into_iter().chain(under.into_iter().flatten()) {
        jobs.push(Job::new(case.name.clone(), move || case.measure(Fault::None)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows are red if densities, weights, frequencies or integrals are wrong by little, or if a density has a hole.
    #[test]
    fn every_injected_fault_is_noticed() {
        let cases = cases();
        for name in [
            "GGX 0.3 x 0.05, view at 45",
            "GGX 0.5 x 0.02, view at 85 degrees, a sun",
            "Lambert, smooth sky times 1e-40",
        ] {
            let case = cases.iter().find(|case| case.name.starts_with(name)).expect("a case");
            assert_eq!(case.measure(Fault::None).err(), None, "{name}");
            for (fault, says) in [
                (Fault::Density, "samples: the mean"),
                (Fault::Weight, "ray: the mean"),
                (Fault::Frequency, "frequencies"),
                (Fault::Integral, "the stated integral"),
                (Fault::Hole, "a weight of"),
                (Fault::Idle, "of the rays bring nothing"),
            ] {
                let answer = case.measure(fault).err().unwrap_or_default();
                assert!(answer.contains(says), "{name}, {fault:?}: {answer:?}");
            }
        }
    }
}
