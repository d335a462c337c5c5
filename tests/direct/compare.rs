//! Each mistake of a point that stays silent is found and named, and lobes that only resemble a BRDF are no mistake.

use super::brdfs::{self, BECKMANN, Facets, GGX, Lobe};
use super::light::{Light, TURNED};
use crate::support::maps;
use crate::support::vector::{V3, add, cross, dot, scale, single, unit};
use std::f64::consts::PI;
use wis::brdf::compare::{DIRECTIONS, Match, Mistake, TOGETHER, compare};
use wis::brdf::material::{Material, Shape};
use wis::brdf::point::Point;
use wis::brdf::portal::Portal;
use wis::direct::sampler::{Config, Sampler};
use wis::ffi::check::*;
use wis::points::sobol;
use wis::simd::Level;
use wis::sphere::Frame;
use wis::status::{Error, Status};

/// A shading point of a renderer: axes, and where it is seen from.
#[derive(Clone, Copy, Debug)]
struct Hit {
    normal: V3,
    tangent: V3,
    wo: V3,
}

impl Hit {
    fn local(&self, w: V3) -> V3 {
        [dot(w, self.tangent), dot(w, cross(self.normal, self.tangent)), dot(w, self.normal)]
    }

    /// A tangent that is the hit's after a rotation by some degrees about the normal.
    fn before_rotation(&self, degrees: f64) -> V3 {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        add(scale(self.tangent, cosine), scale(cross(self.normal, self.tangent), -sine))
    }
}

fn failed(direction: usize) -> Error {
    Error::new(Status::CallbackFailed, 0).of(c"target").in_row(direction)
}

/// Points seen at these cosines, in frames that have nothing to do with any axis.
fn hits() -> Vec<Hit> {
    let cosines: [f64; 5] = [0.98, 0.8, 0.5, 0.25, 0.1];
    let seen = |k: usize| {
        let turn = k as f64;
        let normal = unit([(1.3 * turn).sin(), (2.1 + turn).cos(), 0.4 - 0.2 * turn]);
        let tangent = unit(cross(normal, [0.3, 0.9, -0.2]));
        let sine = (1.0 - cosines[k] * cosines[k]).sqrt();
        let side = add(scale(tangent, (0.7 + turn).cos()), scale(cross(normal, tangent), (0.7 + turn).sin()));
        Hit { normal, tangent, wo: add(scale(normal, cosines[k]), scale(side, sine)) }
    };
    (0..cosines.len()).map(seen).collect()
}

/// What a client hands over.
#[derive(Clone, Debug)]
struct Given {
    hit: Hit,
    lobes: Vec<Lobe>,
    cosine_included: bool,
}

impl Given {
    fn new(hit: Hit, lobes: &[Lobe]) -> Given {
        Given { hit, lobes: lobes.to_vec(), cosine_included: false }
    }

    fn material(&self) -> Material {
        let shapes: Vec<Shape> = self.lobes.iter().map(|lobe| lobe.shape).collect();
        Material::new(&shapes).unwrap()
    }

    fn point<'a>(&self, material: &'a Material) -> Point<'a> {
        let mut point = Point::new(material, single(self.hit.normal), single(self.hit.wo));
        (point.tangent, point.cosine_included) = (single(self.hit.tangent), self.cosine_included);
        for (k, lobe) in self.lobes.iter().enumerate() {
            (point.weight[k], point.f0[k]) = ([lobe.weight as f32; 3], [lobe.f0 as f32; 3]);
        }
        point
    }

    /// The comparison with a BRDF x cosine of world directions.
    fn compared(&self, f_cos: impl Fn(V3) -> f64) -> Match {
        let mut all = |wi: &[[f32; 3]], out: &mut [f32]| {
            assert_eq!((wi.len(), out.len()), (TOGETHER, TOGETHER));
            for (wi, out) in wi.iter().zip(out) {
                *out = f_cos(wi.map(f64::from)) as f32;
            }
            true
        };
        let frame = Frame::new(&TURNED).unwrap();
        compare(&self.point(&self.material()), &frame, &mut all).expect("finite and not negative")
    }
}

/// A sound client: a material, and where it is.
struct Client {
    name: &'static str,
    hit: Hit,
    lobes: Vec<Lobe>,
}

impl Client {
    fn f_cos(&self, wi: V3) -> f64 {
        brdfs::sum(&self.lobes, self.transmits(), self.hit.local(self.hit.wo), self.hit.local(wi))
    }

    fn cosine(&self, wi: V3) -> f64 {
        self.hit.local(wi)[2].abs()
    }

    fn transmits(&self) -> bool {
        self.lobes.iter().any(|lobe| lobe.shape.kind.transmits())
    }

    fn is_ggx(&self) -> bool {
        self.lobes.iter().any(|lobe| lobe.shape.kind.is_ggx())
    }

    fn given(&self) -> Given {
        Given::new(self.hit, &self.lobes)
    }

    /// What the client hands over if it takes its lobes for others.
    fn with(&self, change: impl Fn(&mut Lobe)) -> Given {
        let mut given = self.given();
        given.lobes.iter_mut().for_each(change);
        given
    }

    /// The mistake is named, with no difference left.
    fn finds(&self, what: &str, mistake: Mistake, given: &Given, f_cos: impl Fn(V3) -> f64) -> Match {
        let found = given.compared(f_cos);
        let seen = self.hit.local(self.hit.wo)[2];
        assert_eq!(found.mistake, mistake, "{} at {seen:.2}, {what}: {found:?}", self.name);
        assert!(found.explained < 0.002, "{} at {seen:.2}, {what}: {found:?}", self.name);
        found
    }
}

/// Materials of several kinds at all hits.
fn clients() -> Vec<Client> {
    let materials = [
        ("Lambert", vec![Lobe::lambert(0.7)]),
        ("GGX 0.5", vec![Lobe::ggx(0.5, 0.5, 1.0, 0.8)]),
        ("GGX 0.1", vec![Lobe::ggx(0.1, 0.1, 1.0, 0.5)]),
        ("GGX 0.4 x 0.1", vec![Lobe::ggx(0.4, 0.1, 0.9, 0.9)]),
        ("Phong 50", vec![Lobe::phong(50.0, 0.6)]),
        ("plastic", vec![Lobe::lambert(0.5), Lobe::ggx(0.2, 0.2, 1.0, 0.04)]),
        ("brushed paint", vec![Lobe::lambert(0.3), Lobe::ggx(0.3, 0.1, 1.0, 0.1)]),
        ("two coats", vec![Lobe::ggx(0.6, 0.6, 0.5, 0.6), Lobe::ggx(0.1, 0.1, 0.5, 0.1)]),
        ("leaf", vec![Lobe::lambert(0.5), Lobe::leaf(0.2)]),
        ("glass", vec![Lobe::ggx(0.3, 0.3, 1.0, 0.04), Lobe::glass(0.3, 1.5, 1.0, 0.04)]),
        ("waxed leaf", vec![Lobe::lambert(0.4), Lobe::ggx(0.3, 0.3, 1.0, 0.04), Lobe::leaf(0.3)]),
    ];
    let at_hits = |(name, lobes): (&'static str, Vec<Lobe>)| {
        hits().into_iter().map(move |hit| Client { name, hit, lobes: lobes.clone() })
    };
    materials.into_iter().flat_map(at_hits).collect()
}

type Brdf = Box<dyn Fn(V3, V3) -> f64>;

/// BRDFs that lobes only resemble, and the lobes that a client would choose.
fn resembled() -> Vec<(String, Brdf, Vec<Lobe>)> {
    let mut all: Vec<(String, Brdf, Vec<Lobe>)> = Vec::new();
    for sigma in [0.2, 0.5, 1.0] {
        let brdf = move |wo, wi| brdfs::oren_nayar(sigma, wo, wi);
        all.push((format!("Oren-Nayar {sigma}"), Box::new(brdf), vec![Lobe::lambert(1.0)]));
    }
    for roughness in [0.1, 0.5, 1.0] {
        let brdf = move |wo, wi| brdfs::burley(roughness, wo, wi);
        all.push((format!("Burley {roughness}"), Box::new(brdf), vec![Lobe::lambert(1.0)]));
        let brdf = move |wo, wi| brdfs::sheen(roughness, wo, wi);
        all.push((format!("sheen {roughness}"), Box::new(brdf), vec![Lobe::lambert(0.5)]));
    }
    for alpha in [0.02_f32, 0.05, 0.1, 0.2, 0.35, 0.6, 1.0] {
        let a = f64::from(alpha);
        for (name, of) in [("GGX", &GGX), ("Beckmann", &BECKMANN)] {
            let of: &'static Facets = of;
            for base in [0.05, 0.3, 0.8] {
                let brdf = move |wo, wi| brdfs::coated(of, a, base, wo, wi);
                for (what, weight) in [("", 0.9), (" naive", 1.0)] {
                    let lobes = vec![Lobe::lambert(base * weight), Lobe::ggx(alpha, alpha, 1.0, 0.04)];
                    all.push((format!("{name} {alpha} over {base}{what}"), Box::new(brdf), lobes));
                }
                let lobes = vec![Lobe::lambert(base)];
                all.push((format!("{name} {alpha} over {base}, diffuse"), Box::new(brdf), lobes));
            }
            let brdf = move |wo, wi| 0.9 * brdfs::microfacets(of, [a; 2], wo, wi);
            all.push((format!("{name} {alpha}"), Box::new(brdf), vec![Lobe::ggx(alpha, alpha, 1.0, 0.9)]));
            for wrong in [0.7, 0.85, 1.2, 1.5] {
                let lobes = vec![Lobe::ggx(wrong * alpha, wrong * alpha, 1.0, 0.9)];
                all.push((format!("{name} {alpha}, alpha times {wrong}"), Box::new(brdf), lobes));
                let brdf = move |wo, wi| brdfs::coated(of, a, 0.4, wo, wi);
                let lobes = vec![Lobe::lambert(0.4), Lobe::ggx(wrong * alpha, wrong * alpha, 1.0, 0.04)];
                all.push((format!("{name} {alpha} over 0.4, alpha times {wrong}"), Box::new(brdf), lobes));
            }
            let brdf = move |wo, wi| 0.9 * brdfs::microfacets(of, [a, 0.3 * a], wo, wi);
            let lobes = vec![Lobe::ggx(alpha, 0.3 * alpha, 1.0, 0.9)];
            all.push((format!("{name} {alpha} anisotropic"), Box::new(brdf), lobes));
            let lobes = vec![Lobe::ggx(0.55 * alpha, 0.55 * alpha, 1.0, 0.9)];
            all.push((format!("{name} {alpha} anisotropic by an isotropic lobe"), Box::new(brdf), lobes));
            let brdf = move |wo, wi| 0.9 * brdfs::microfacets(of, [a; 2], wo, wi);
            let lobes = vec![Lobe::ggx(1.2 * alpha, 0.8 * alpha, 1.0, 0.9)];
            all.push((format!("{name} {alpha} by an anisotropic lobe"), Box::new(brdf), lobes));
        }
        let exponent = 2.0 / (a * a) - 2.0;
        let brdf = move |wo, wi| 0.1 * brdfs::lambert(wo, wi) + brdfs::blinn(exponent.max(1.0), wo, wi);
        let lobes = vec![Lobe::lambert(0.1), Lobe::ggx(alpha, alpha, 1.0, 0.9)];
        all.push((format!("Blinn for {alpha}"), Box::new(brdf), lobes));
        let lobes = vec![Lobe::lambert(0.1), Lobe::phong(0.25 * exponent.max(1.0) as f32, 0.9)];
        all.push((format!("Blinn for {alpha} by Phong"), Box::new(brdf), lobes));
        let brdf = move |wo, wi| brdfs::ashikhmin(exponent.max(1.0), 0.2, wo, wi);
        all.push((format!("Ashikhmin for {alpha}"), Box::new(brdf), vec![Lobe::ggx(alpha, alpha, 1.0, 0.2)]));
    }
    all
}

/// Neither a cause nor a sentence that blames: what lobes that resemble a BRDF may get.
fn is_sound(found: &Match) -> bool {
    matches!(found.mistake, Mistake::None | Mistake::Scaled | Mistake::Resembles | Mistake::Other)
}

#[test]
fn lobes_that_are_the_bsdf_are_no_mistake() {
    for client in clients() {
        let found = client.finds("right", Mistake::None, &client.given(), |wi| client.f_cos(wi));
        assert!(found.error < 1e-5 && (found.scale - 1.0).abs() < 1e-4, "{}: {found:?}", client.name);
        for factor in [0.0, 1e-6, 0.97, 1.0 / PI, 1e6] {
            let found = client.given().compared(|wi| factor * client.f_cos(wi));
            assert_eq!(found.mistake, Mistake::Scaled, "{} times {factor}: {found:?}", client.name);
            assert!((f64::from(found.scale) - factor).abs() <= 1e-4 * factor, "{factor}: {found:?}");
        }
    }
}

/// A surface that lets light through has no normal that points the wrong way, and a wi that does is a wo that does.
#[test]
fn reversed_directions_are_found() {
    for client in clients() {
        let (hit, given) = (client.hit, client.given());
        let f_cos = |wi| client.f_cos(wi);
        let reversed = Given { hit: Hit { wo: scale(hit.wo, -1.0), ..hit }, ..given.clone() };
        client.finds("wo", Mistake::Wo, &reversed, f_cos);
        let reversed = Given { hit: Hit { normal: scale(hit.normal, -1.0), ..hit }, ..given.clone() };
        client.finds("normal", if client.transmits() { Mistake::None } else { Mistake::Normal }, &reversed, f_cos);
        let mistake = if client.transmits() { Mistake::Wo } else { Mistake::Wi };
        client.finds("wi", mistake, &given, |wi| f_cos(scale(wi, -1.0)));
    }
}

#[test]
fn cosines_are_found() {
    for client in clients() {
        let given = client.given();
        let included = Given { cosine_included: true, ..given.clone() };
        let (once, none) = (|wi| client.f_cos(wi), |wi| client.f_cos(wi) / client.cosine(wi).max(1e-9));
        client.finds("missing", Mistake::CosineMissing, &given, none);
        client.finds("included", Mistake::None, &included, none);
        client.finds("included by mistake", Mistake::CosineTwice, &included, once);
        client.finds("twice", Mistake::CosineTwice, &given, |wi| once(wi) * client.cosine(wi));
    }
}

#[test]
fn roughness_for_alpha_is_found() {
    for client in clients().into_iter().filter(Client::is_ggx) {
        let alphas = |lobe: &mut Lobe, of: fn(f32) -> f32| {
            if lobe.shape.kind.is_ggx() {
                (lobe.shape.a, lobe.shape.b) = (of(lobe.shape.a), of(lobe.shape.b));
            }
        };
        let rough = client.with(|lobe| alphas(lobe, f32::sqrt));
        client.finds("not squared", Mistake::AlphaSquare, &rough, |wi| client.f_cos(wi));
        let narrow = client.with(|lobe| alphas(lobe, |alpha| alpha * alpha));
        client.finds("squared twice", Mistake::AlphaRoot, &narrow, |wi| client.f_cos(wi));
    }
}

#[test]
fn rotated_tangents_are_found_with_their_angle() {
    for client in clients().into_iter().filter(|client| client.given().material().kinds().1) {
        for angle in [8.0, 45.0, 90.0, 133.7] {
            let tangent = client.hit.before_rotation(angle);
            let given = Given { hit: Hit { tangent, ..client.hit }, ..client.given() };
            let found = client.finds("tangent", Mistake::Tangent, &given, |wi| client.f_cos(wi));
            assert!((f64::from(found.angle) - angle).abs() < 0.1, "{angle}: {found:?}");
        }
        let swapped = client.with(|lobe| std::mem::swap(&mut lobe.shape.a, &mut lobe.shape.b));
        let found = client.finds("swapped", Mistake::Tangent, &swapped, |wi| client.f_cos(wi));
        assert!((found.angle - 90.0).abs() < 0.1, "{found:?}");
    }
}

#[test]
fn an_inverted_eta_is_found() {
    for client in clients().into_iter().filter(|client| client.name == "glass") {
        let given = client.with(|lobe| lobe.shape.eta = 1.0 / lobe.shape.eta);
        client.finds("eta", Mistake::Eta, &given, |wi| client.f_cos(wi));
    }
}

/// Also the weight that a lobe lacks, and by what another is wrong.
#[test]
fn weights_are_found() {
    for client in clients() {
        let found = client.with(|lobe| lobe.weight = 0.0).compared(|wi| client.f_cos(wi));
        assert_eq!(found.mistake, Mistake::NoWeight, "{}: {found:?}", client.name);
        if client.lobes.len() == 1 {
            continue;
        }
        for lobe in 0..client.lobes.len() {
            for factor in [0.0, 1.0 / PI, PI] {
                let mut given = client.given();
                given.lobes[lobe].weight *= factor;
                let found = client.finds("weight", Mistake::Weight, &given, |wi| client.f_cos(wi));
                let right = if factor == 0.0 { client.lobes[lobe].weight } else { 1.0 / factor };
                assert!(found.lobe as usize == lobe, "{lobe} times {factor}: {found:?}");
                assert!((f64::from(found.value) - right).abs() < 1e-3 * right, "{lobe} times {factor}: {found:?}");
            }
        }
    }
}

/// Where lobes have one f0. At grazing views f0 hardly shows, and where all of one lobe is wrong it is a factor.
#[test]
fn f0_is_found() {
    for client in clients().into_iter().filter(|client| client.is_ggx() && client.name != "two coats") {
        let found = client.finds("f0", Mistake::F0, &client.with(|lobe| lobe.f0 = 0.0), |wi| client.f_cos(wi));
        let right = client.lobes[found.lobe as usize].f0;
        assert!((f64::from(found.value) - right).abs() < 1e-3, "{}: {found:?}", client.name);
    }
}

#[test]
fn sides_are_found() {
    for client in clients() {
        let given = client.given();
        let above = |w: V3| add(w, scale(client.hit.normal, client.cosine(w) - client.hit.local(w)[2]));
        if client.transmits() {
            let f_cos = |wi: V3| if client.hit.local(wi)[2] > 0.0 { client.f_cos(wi) } else { 0.0 };
            client.finds("opaque", Mistake::Sides, &given, f_cos);
        } else {
            client.finds("two sides", Mistake::Sides, &given, |wi| client.f_cos(above(wi)));
        }
        let missing: Vec<Lobe> = client.lobes.iter().filter(|lobe| !lobe.shape.kind.transmits()).copied().collect();
        if client.transmits() {
            let given = Given::new(client.hit, &missing);
            client.finds("no lobe that transmits", Mistake::Sides, &given, |wi| client.f_cos(wi));
        }
    }
}

#[test]
fn lobes_that_resemble_a_brdf_are_no_mistake() {
    let mut verdicts = [0; 17];
    for (name, brdf, lobes) in resembled() {
        for hit in hits() {
            let found = Given::new(hit, &lobes).compared(|wi| brdf(hit.local(hit.wo), hit.local(wi)));
            assert!(is_sound(&found), "{name} at {:.2}: {found:?}", hit.local(hit.wo)[2]);
            verdicts[found.mistake as usize] += 1;
        }
    }
    println!("{verdicts:?}");
}

/// Coated bases whose lobes are wrong by up to 40 % in every number. A lobe whose alpha is by chance the square of the right one is
/// told so; of these seeds one in a thousand is.
#[test]
fn careless_lobes_are_no_mistake() {
    let mut named = Vec::new();
    for k in 0..4000 {
        let hit = hits()[k as usize % 5];
        let u: Vec<f64> = (0..6).flat_map(|seed| sobol(seed, k)).map(f64::from).collect();
        let careless = |x: f64, u: f64| x * 0.6f64.powf(1.0 - 2.0 * u);
        let (alpha, base, f0) = (0.02f64.powf(u[0]), 0.9 * u[1], if u[2] < 0.5 { 0.04 } else { u[3] });
        let index = (1.0 + f0.sqrt()) / (1.0 - f0.sqrt()).max(0.01);
        let of = if u[4] < 0.5 { &GGX } else { &BECKMANN };
        let (wo, rough) = (hit.local(hit.wo), u[5] < 0.3);
        let brdf = |wi: V3| {
            let cosine = dot(wo, unit(add(wo, wi)));
            let coat = if u[6] < 0.5 { brdfs::schlick(f0, cosine) } else { brdfs::dielectric(index, cosine) };
            let base_brdf = if rough { brdfs::oren_nayar(u[7], wo, wi) } else { brdfs::lambert(wo, wi) };
            coat * brdfs::microfacets(of, [alpha; 2], wo, wi) + base * (1.0 - coat) * base_brdf
        };
        let a = careless(alpha, u[8]) as f32;
        let lobes =
            [Lobe::lambert(careless(base, u[9])), Lobe::ggx(a, a, careless(1.0, u[10]), careless(f0, u[11]).min(1.0))];
        let found = Given::new(hit, &lobes).compared(|wi| brdf(hit.local(wi)));
        if !is_sound(&found) {
            named.push(format!("{alpha:.3} by {lobes:?}: {found:?}"));
        }
    }
    println!("{} of 4000: {named:#?}", named.len());
    assert!(named.len() <= 4, "{named:#?}");
}

/// A wo that is reversed is worth telling most where lobes resemble a BRDF: also then it is.
#[test]
fn reversed_directions_of_other_brdfs_are_found() {
    for hit in hits().into_iter().take(4) {
        let wo = hit.local(hit.wo);
        let lobes = [Lobe::lambert(0.3), Lobe::ggx(0.2, 0.2, 1.0, 0.04)];
        let given = Given::new(hit, &lobes);
        let f_cos = |wi: V3| brdfs::coated(&BECKMANN, 0.2, 0.3, wo, hit.local(wi));
        let found = given.compared(f_cos);
        assert_eq!(found.mistake, Mistake::Resembles, "{found:?}");
        let reversed = Given { hit: Hit { wo: scale(hit.wo, -1.0), ..hit }, ..given.clone() };
        assert_eq!(reversed.compared(f_cos).mistake, Mistake::Wo);
        let reversed = Given { hit: Hit { normal: scale(hit.normal, -1.0), ..hit }, ..given.clone() };
        assert_eq!(reversed.compared(f_cos).mistake, Mistake::Normal);
        assert_eq!(given.compared(|wi| f_cos(scale(wi, -1.0))).mistake, Mistake::Wi);
    }
}

/// A window whose edges are given in the other order guides no ray, and is said to do so; one of two that face the point is enough, and a
/// mistake of the lobes is named first.
#[test]
fn portals_that_face_away_are_found() {
    let given = Given::new(hits()[2], &[Lobe::lambert(1.0)]);
    let window = |edges| Portal { corner: [-0.5, 2.0, 0.0], edges };
    let (a, b) = ([1.0f32, 0.0, 0.0], [0.0, 0.0, 1.0]);
    let (faces, away) = (window([a, b]), window([b, a]));
    let found = |portals: &[Portal], factor: f64| {
        let material = given.material();
        let mut f_cos = |wi: &[[f32; 3]], out: &mut [f32]| {
            let cosine = |wi: &[f32; 3]| given.hit.local(wi.map(f64::from))[2];
            out.iter_mut().zip(wi).for_each(|(out, wi)| *out = (cosine(wi).max(0.0).powf(factor) / PI) as f32);
            true
        };
        compare(&Point { portals, ..given.point(&material) }, &Frame::IDENTITY, &mut f_cos).unwrap().mistake
    };
    assert_eq!(found(&[], 1.0), Mistake::None);
    assert_eq!(found(&[Portal::default(), faces], 1.0), found(&[Portal::default()], 1.0));
    assert_eq!(found(&[faces, away], 1.0), Mistake::None);
    assert_eq!(found(&[away, Portal::default()], 1.0), Mistake::Portals);
    assert_ne!(found(&[away], 0.0), Mistake::Portals);
}

/// Nothing to see is no mistake; lobes of another kind have no cause.
#[test]
fn black_points_and_other_lobes() {
    let hit = hits()[1];
    let below = Hit { wo: scale(hit.wo, -1.0), ..hit };
    assert_eq!(Given::new(below, &[Lobe::lambert(1.0)]).compared(|_| 0.0).mistake, Mistake::None);
    assert_eq!(Given::new(hit, &[Lobe::lambert(0.0)]).compared(|_| 0.0).mistake, Mistake::None);
    let mirror = |wi: V3| brdfs::microfacets(&GGX, [0.05; 2], hit.local(hit.wo), hit.local(wi));
    let found = Given::new(hit, &[Lobe::lambert(1.0)]).compared(mirror);
    assert!(found.mistake == Mistake::Other && found.error > 0.8, "{found:?}");
    let found = Given::new(hit, &[]).compared(mirror);
    assert_eq!(found.mistake, Mistake::Other, "{found:?}");
}

#[test]
fn bad_values_are_blamed_on_their_direction() {
    let given = Given::new(hits()[1], &[Lobe::lambert(1.0)]);
    let material = given.material();
    let point = given.point(&material);
    for bad in [f32::NAN, f32::INFINITY, -1.0] {
        let mut called = 0;
        let mut all = |_: &[[f32; 3]], out: &mut [f32]| {
            called += 1;
            out.fill(1.0);
            if called == 3 {
                out[5] = bad;
            }
            true
        };
        assert_eq!(compare(&point, &Frame::IDENTITY, &mut all), Err(failed(2 * TOGETHER + 5)));
    }
    assert_eq!(compare(&point, &Frame::IDENTITY, &mut |_, _| false), Err(failed(0)));
    let fallen = Point { normal: [0.0; 3], ..point };
    assert_eq!(compare(&fallen, &Frame::IDENTITY, &mut |_, _| false), Err(Error::transform(c"normal")));
}

/// The call of a renderer in Rust, the numbers of the C interface, and sentences that differ.
#[test]
fn callers() {
    let light = Light::of(&maps::sky(16, 8));
    let config = Config::for_rays(1);
    let mut memory = vec![0u64; config.bytes().div_ceil(8)];
    let sampler = Sampler::new(Level::detect(), config, bytemuck::cast_slice_mut(&mut memory)).unwrap();
    let hit = hits()[2];
    let given = Given::new(hit, &[Lobe::lambert(0.5)]);
    let material = given.material();
    let mut calls = 0;
    let found = sampler.check_point(&light.environment(), &given.point(&material), |wi| {
        calls += 1;
        (hit.local(wi.map(f64::from))[2].max(0.0) / PI) as f32
    });
    let found = found.expect("a point");
    assert_eq!((found.mistake, calls), (Mistake::Scaled, DIRECTIONS));
    let answer = sampler.check_point(&light.environment(), &given.point(&material), |_| f32::NAN);
    assert_eq!(answer, Err(failed(0)));
    let verdict = PointVerdict::from(found);
    assert_eq!((verdict.mistake, verdict.scale), (Mistake::Scaled as u32, found.scale));
    let all = [
        Mistake::None,
        Mistake::Scaled,
        Mistake::Wo,
        Mistake::Normal,
        Mistake::Wi,
        Mistake::NoWeight,
        Mistake::Weight,
        Mistake::CosineMissing,
        Mistake::CosineTwice,
        Mistake::AlphaSquare,
        Mistake::AlphaRoot,
        Mistake::Tangent,
        Mistake::Eta,
        Mistake::Sides,
        Mistake::F0,
        Mistake::Resembles,
        Mistake::Other,
        Mistake::Portals,
    ];
    let sentences: std::collections::BTreeSet<String> = all.iter().map(ToString::to_string).collect();
    assert!(all.iter().zip(0..).all(|(mistake, number)| *mistake as u32 == number) && sentences.len() == all.len());
}
