use std::time::Instant;
use wis::brdf::{material::*, point::*, surface::*};
use wis::direct::{candidates::*, joint::*, *};
use wis::environment::Format;
use wis::light::{chart::Layout, decode::Pixels, environment::Environment, plan::*, tables::Light};
use wis::sphere::Frame;
struct Rng(u64);
impl Rng {
    fn f(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 40) as f32) / 16777216.0
    }
    fn dir(&mut self) -> [f32; 3] {
        let z = 2.0 * self.f() - 1.0;
        let p = 6.2831853 * self.f();
        let r = (1.0 - z * z).max(0.0).sqrt();
        [r * p.cos(), r * p.sin(), z]
    }
}
fn dot3(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
fn main() {
    let k_env: usize = std::env::var("K").ok().and_then(|s| s.parse().ok()).unwrap_or(0);
    for m in std::env::args().skip(1) {
        let im = image::open(&m).unwrap().to_rgb32f();
        let (w, h) = im.dimensions();
        let px = im.into_raw();
        let plan = Plan::new(&Description {
            layout: Layout::LatLong,
            width: w,
            height: h,
            filter: Filter::Bilinear,
            rows_at_poles: false,
            exact_zero: false,
            compensated: false,
            budget: 0.0,
        })
        .unwrap();
        let size = plan.size().unwrap();
        let mut mem = vec![0u64; size.bytes / 8 + 8];
        let mut scr = vec![0u64; size.scratch / 8 + 1];
        let bytes: &[u8] = bytemuck::cast_slice(&px);
        let row = |y: u32| bytes.get((y * w * 12) as usize..((y + 1) * w * 12) as usize);
        let p = Pixels { channels: 3, format: Format::F32, sanitise: false };
        let env = Environment::build_in(
            &plan,
            &p,
            &Frame::IDENTITY,
            row,
            bytemuck::cast_slice_mut(&mut mem),
            bytemuck::cast_slice_mut(&mut scr),
        )
        .unwrap();
        let l: Light = env.light();
        let fr = Frame::IDENTITY;
        let lev = wis::simd::Level::detect();
        let mats = [
            ("lambert", Material::new(&[Shape::LAMBERT]).unwrap()),
            ("ggx.5", Material::new(&[Shape::ggx(0.5, 0.5)]).unwrap()),
            ("ggx.2", Material::new(&[Shape::ggx(0.2, 0.2)]).unwrap()),
            ("ggx.05", Material::new(&[Shape::ggx(0.05, 0.05)]).unwrap()),
            ("mix", Material::new(&[Shape::LAMBERT, Shape::ggx(0.1, 0.1)]).unwrap()),
        ];
        for (name, mat) in &mats {
            let mut r = Rng(5);
            let pts = 100;
            let mut acc = [[0f64; 4]; 8];
            let mut tm = [0f64; 8];
            let mut bias = [0f64; 8];
            for _ in 0..pts {
                let n = r.dir();
                let mut wo = r.dir();
                if dot3(n, wo) < 0.05 {
                    for k in 0..3 {
                        wo[k] = wo[k] - 2.0 * dot3(n, wo).min(0.0) * n[k] + 0.2 * n[k];
                    }
                    let q = dot3(wo, wo).sqrt();
                    for k in 0..3 {
                        wo[k] /= q;
                    }
                }
                let mut pt = Point::new(mat, n, wo);
                pt.f0 = [[0.9; 3]; 4];
                if mat.lobes().len() == 2 {
                    pt.weight = [[0.4; 3], [0.6; 3], [0.0; 3], [0.0; 3]];
                }
                let s = Surface::new(&pt, &fr).unwrap();
                // blockers: three cones
                let cones = [(r.dir(), 0.8f32), (r.dir(), 0.7), (r.dir(), 0.9)];
                let vis = |d: [f32; 3]| if cones.iter().any(|(c, a)| dot3(*c, d) > *a) { 0.0f64 } else { 1.0 };
                let f = |d: [f32; 3]| -> f64 {
                    let lo = s.to_local::<f32>(d);
                    if lo[2] <= 0.0 {
                        return 0.0;
                    }
                    let (v, _) = s.eval::<f32>(lo);
                    (v * l.density::<f32>(d)) as f64 * l.power
                };
                // reference by MIS many
                let nref = 20000;
                let mut refv = 0f64;
                let mut mis1 = 0f64;
                let mut mis2 = 0f64;
                for i in 0..nref {
                    let u = wis::points::sobol(11, i);
                    let v = wis::points::sobol(12, i);
                    let d = l.candidates::<f32>(u).0;
                    let lo = s.to_local::<f32>(d);
                    let pb = s.eval::<f32>(lo).1;
                    let pl = l.density::<f32>(d);
                    let mut e = f(d) * vis(d) / (pl + pb) as f64;
                    let wl = s.sample::<f32>(v);
                    let d2 = s.to_map::<f32>(wl);
                    let pb = s.eval::<f32>(wl).1;
                    let pl = l.density::<f32>(d2);
                    if wl[2] > 0.0 && pb + pl > 0.0 {
                        e += f(d2) * vis(d2) / (pl + pb) as f64;
                    }
                    refv += e;
                    mis1 += e;
                    mis2 += e * e;
                }
                refv /= nref as f64;
                if refv <= 0.0 {
                    continue;
                }
                let var = (mis2 / nref as f64 - refv * refv).max(0.0);
                acc[0][0] += var / (refv * refv);
                acc[0][1] += var;
                for (j, (rays, k)) in
                    [(1, 4), (1, 8), (1, 16), (1, 32), (4, 4), (4, 8), (16, 2), (16, 4)].iter().enumerate()
                {
                    if j == 0 {}
                    let _ = k_env;
                    let c = candidate_count(*rays, *k);
                    let mut b = vec![vec![0f32; c]; 5];
                    let nn = 400;
                    let (mut s1, mut s2) = (0f64, 0f64);
                    let mut out = vec![Ray::default(); *rays];
                    let mut t = 0f64;
                    for i in 0..nn {
                        let turn = Turn::new(1000 + i as u32, 0, 0);
                        let t0 = Instant::now();
                        let (x, rest) = b.split_at_mut(1);
                        let (y, rest) = rest.split_at_mut(1);
                        let (z, rest) = rest.split_at_mut(1);
                        let (d, q) = rest.split_at_mut(1);
                        let mut cand = Candidates {
                            x: &mut x[0],
                            y: &mut y[0],
                            z: &mut z[0],
                            density: &mut d[0],
                            weight: &mut q[0],
                        };
                        let got = wis::simd::run(
                            lev,
                            Request {
                                light: &l,
                                frame: &fr,
                                surface: &s,
                                turn,
                                rays: *rays,
                                candidates: &mut cand,
                                out: &mut out,
                            },
                        );
                        t += t0.elapsed().as_secs_f64();
                        let mut e = 0f64;
                        for q in &out[..got] {
                            e += f(q.wi) * vis(q.wi) * q.weight as f64;
                        }
                        s1 += e;
                        s2 += e * e;
                    }
                    let mean = s1 / nn as f64;
                    let var = (s2 / nn as f64 - mean * mean).max(0.0);
                    bias[j] += (mean - refv) / (var / nn as f64).sqrt().max(1e-30) / (pts as f64).sqrt();
                    if j < 7 {
                        acc[j + 1][0] += var * *rays as f64 / (refv * refv);
                        acc[j + 1][1] += var * *rays as f64;
                    } else {
                        acc[7][2] += var * *rays as f64 / (refv * refv);
                    }
                    tm[j] += t / nn as f64 * 1e9 / pts as f64;
                }
            }
            print!(
                "{:12} {name:8} MIS(2 rays) rel {:.3} |",
                m.rsplit('/').next().unwrap().split('_').next().unwrap(),
                acc[0][0] / pts as f64 * 2.0
            );
            for j in 0..7 {
                print!(" {:.3} ({:.0}ns z{:.1})", acc[j + 1][0] / pts as f64, tm[j], bias[j]);
            }
            println!(" 16x4 {:.3} ({:.0}) z{:.1}", acc[7][2] / pts as f64, tm[7], bias[7]);
        }
    }
}
