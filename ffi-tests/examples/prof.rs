use glam::Vec3;
use std::time::Instant;
use wis_ffi_tests::{batch::*, client, estimator::*, light::Light, material::*, scene::*};
fn time(name: &str, n: usize, mut f: impl FnMut(u32)) {
    for i in 0..2000 {
        f(i)
    }
    let mut best = f64::MAX;
    for r in 0..5 {
        let t = Instant::now();
        for i in 0..4000 {
            f(i + r * 4000)
        }
        best = best.min(t.elapsed().as_nanos() as f64 / 4000.0);
    }
    println!("{name:30} {:8.1} ns, {:6.1} each", best, best / n as f64);
}
fn main() {
    let light = Light::sun(1024);
    let environment = light.environment().unwrap();
    let lit = Lit::new(&light, &environment);
    let point = ShadingPoint {
        pixel: [5, 9],
        origin: Vec3::ZERO,
        normal: Vec3::new(0.3, 0.2, 0.93).normalize(),
        wo: Vec3::new(-0.5, 0.3, 0.8).normalize(),
    };
    for material in [Material::lambert(), Material::ggx(0.2)] {
        println!("{}", material.name);
        let setting = Setting::new(&lit, &material);
        let bsdf = Bsdf::new(&material, &point);
        let mut b = Batch::default();
        time("points 64", 64, |p| {
            b.begin([p, 3], 0, 0);
            b.points(Stream::Light, 64);
        });
        time("texels 64", 64, |p| {
            b.begin([p, 3], 0, 0);
            b.from_texels(setting.plain, &light, 64);
        });
        time("bsdf 64", 64, |p| {
            b.begin([p, 3], 0, 0);
            b.from_bsdf(&bsdf, 64);
        });
        b.begin([0, 3], 0, 0);
        b.from_texels(setting.plain, &light, 64);
        time("evaluate 64", 64, |_| b.evaluate(&bsdf, &light, setting.plain));
        let mut e = Estimator::new(&setting).unwrap();
        for m in [Method::MisBalance, Method::Ris(8), Method::Pool(4), Method::Wis] {
            for n in [1, 4, 16, 64] {
                let name = format!("{} {n}", m.name());
                time(&name, n, |p| {
                    e.picks(m, &setting, &ShadingPoint { pixel: [p, 1], ..point }, 0, n).unwrap();
                });
            }
        }
    }
    let _ = client::pixel_seed([0, 0], 0);
}
