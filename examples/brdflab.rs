use wis::brdf::{material::*, point::*, surface::*};
use wis::sphere::Frame;
fn main() {
    let mats = [
        ("lambert", Material::new(&[Shape::LAMBERT]).unwrap()),
        ("ggx.5", Material::new(&[Shape::ggx(0.5, 0.5)]).unwrap()),
        ("ggx.05", Material::new(&[Shape::ggx(0.05, 0.05)]).unwrap()),
        ("ggx.3x.1", Material::new(&[Shape::ggx(0.3, 0.1)]).unwrap()),
        ("phong20", Material::new(&[Shape { kind: Kind::Phong, a: 20.0, b: 0.0, eta: 1.0 }]).unwrap()),
        ("trans.3", Material::new(&[Shape { kind: Kind::GgxTransmission, a: 0.3, b: 0.3, eta: 1.5 }]).unwrap()),
        ("trans.3i", Material::new(&[Shape { kind: Kind::GgxTransmission, a: 0.3, b: 0.3, eta: 0.66 }]).unwrap()),
        ("lt", Material::new(&[Shape { kind: Kind::LambertTransmission, a: 0.3, b: 0.3, eta: 0.66 }]).unwrap()),
        ("mix", Material::new(&[Shape::LAMBERT, Shape::ggx(0.1, 0.1)]).unwrap()),
    ];
    for (name, m) in &mats {
        for wz in [0.95f32, 0.5, 0.1] {
            let wo = [(1.0 - wz * wz).sqrt(), 0.0, wz];
            let mut p = Point::new(m, [0.0, 0.0, 1.0], wo);
            p.tangent = [0.8, 0.6, 0.0];
            if m.transmits() {
                p.f0 = [[0.04; 3]; 4];
            } else {
                p.f0 = [[0.9; 3]; 4];
            }
            let s = Surface::new(&p, &Frame::IDENTITY).unwrap();
            let n = 400000;
            let (mut a, mut b, mut c, mut d) = (0f64, 0f64, 0f64, 0f64);
            let mut mx = 0f64;
            for i in 0..n {
                let u = wis::points::sobol(3, i);
                let w = s.sample::<f32>(u);
                let len = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
                if (len - 1.0).abs() > 1e-4 {
                    panic!("{len}")
                }
                let (v, p) = s.eval::<f32>(w);
                if p > 0.0 && v > 0.0 {
                    let q = v as f64 / p as f64;
                    a += q;
                    if q > mx {
                        mx = q;
                    }
                }
                if p > 0.0 {
                    d += 1.0;
                }
                let u = wis::points::sobol(4, i);
                let z = 2.0 * u[0] - 1.0;
                let r = (1.0 - z * z).max(0.0).sqrt();
                let ph = 6.28318530718 * u[1];
                let (v, p) = s.eval::<f32>([r * ph.cos(), r * ph.sin(), z]);
                b += v as f64 * 12.566370614;
                c += p as f64 * 12.566370614;
            }
            println!(
                "{name:9} wz {wz} albedo by lobes {:.4} by sphere {:.4} pdf integral {:.4} valid samples {:.4} max w {:.2}",
                a / n as f64,
                b / n as f64,
                c / n as f64,
                d / n as f64,
                mx
            );
        }
    }
}
