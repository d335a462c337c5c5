use std::time::Instant;
use wis::environment::Format;
use wis::light::chart::Layout;
use wis::light::decode::Pixels;
use wis::light::environment::Environment;
use wis::light::plan::*;
use wis::simd::Num;
use wis::sphere::Frame;

struct Rng(u64);
impl Rng {
    fn f(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 40) as f32) / 16777216.0
    }
}

struct K<'a> {
    l: &'a wis::light::tables::Light<'a>,
    f: Frame,
    u: &'a [[f32; 2]],
    wi: &'a mut [[f32; 3]],
    pdf: &'a mut [f32],
    q: u32,
}
impl wis::simd::Kernel for K<'_> {
    type Output = ();
    #[inline(always)]
    fn run<F: wis::simd::Lanes>(self) {
        for i in (0..self.u.len()).step_by(8) {
            if self.q == 0 {
                let u0 = <F as Num>::each(|l| self.u[i + l][0]);
                let u1 = <F as Num>::each(|l| self.u[i + l][1]);
                let (w, p) = self.l.sample::<F>(&self.f, [u0, u1]);
                let w = [<F as Num>::store(w[0]), <F as Num>::store(w[1]), <F as Num>::store(w[2])];
                let p = <F as Num>::store(p);
                for l in 0..8 {
                    self.wi[i + l] = [w[0][l], w[1][l], w[2][l]];
                    self.pdf[i + l] = p[l];
                }
            } else {
                let d = [
                    <F as Num>::each(|l| self.wi[i + l][0]),
                    <F as Num>::each(|l| self.wi[i + l][1]),
                    <F as Num>::each(|l| self.wi[i + l][2]),
                ];
                let p = <F as Num>::store(self.l.pdf::<F>(&self.f, d));
                for l in 0..8 {
                    self.pdf[i + l] = p[l];
                }
            }
        }
    }
}
fn main() {
    let maps: Vec<String> = std::env::args().skip(1).collect();
    for m in maps {
        let im = image::open(&m).unwrap().to_rgb32f();
        let (w, h) = im.dimensions();
        let px: Vec<f32> = im.into_raw();
        for filter in [Filter::Nearest, Filter::Bilinear] {
            for budget in
                std::env::var("B").unwrap_or("0,0.01,0.1".into()).split(",").map(|x| x.parse::<f32>().unwrap())
            {
                let plan = Plan::new(&Description {
                    layout: Layout::LatLong,
                    width: w,
                    height: h,
                    filter,
                    rows_at_poles: false,
                    exact_zero: false,
                    compensated: false,
                    budget,
                })
                .unwrap();
                let size = plan.size().unwrap();
                let mut mem = vec![0u64; size.bytes / 8 + 8];
                let mut scr = vec![0u64; size.scratch / 8 + 1];
                let bytes: &[u8] = bytemuck::cast_slice(&px);
                let row = |y: u32| bytes.get((y * w * 12) as usize..((y + 1) * w * 12) as usize);
                let p = Pixels { channels: 3, format: Format::F32, sanitise: false };
                let mut best = 1e9f64;
                for _ in 0..3 {
                    let t = Instant::now();
                    Environment::build_in(
                        &plan,
                        &p,
                        &Frame::IDENTITY,
                        row,
                        bytemuck::cast_slice_mut(&mut mem),
                        bytemuck::cast_slice_mut(&mut scr),
                    )
                    .unwrap();
                    best = best.min(t.elapsed().as_secs_f64() * 1e3);
                }
                let mem8: &[u8] = bytemuck::cast_slice(&mem);
                // align for lines
                let env = Environment::open(mem8).unwrap();
                let l = env.light();
                let lum = |x: i64, y: i64| -> f64 {
                    let (mut x, mut y) = (x, y);
                    if y < 0 {
                        y = -1 - y;
                        x += w as i64 / 2;
                    }
                    if y >= h as i64 {
                        y = 2 * h as i64 - 1 - y;
                        x += w as i64 / 2;
                    }
                    let x = x.rem_euclid(w as i64);
                    let k = ((y * w as i64 + x) * 3) as usize;
                    0.2126 * px[k] as f64 + 0.7152 * px[k + 1] as f64 + 0.0722 * px[k + 2] as f64
                };
                let floor = env.header().mean / 65536.0;
                let lookup = |d: [f32; 3]| -> f64 {
                    let d = d.map(|x| x as f64);
                    let n = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
                    let th = (d[0].hypot(d[1])).atan2(d[2]);
                    let _ = n;
                    let mut ph = d[1].atan2(d[0]);
                    if ph < 0.0 {
                        ph += 2.0 * std::f64::consts::PI
                    }
                    let (x, y) = (ph / (2.0 * std::f64::consts::PI) * w as f64, th / std::f64::consts::PI * h as f64);
                    if filter == Filter::Nearest {
                        return lum((x as i64).min(w as i64 - 1), (y as i64).min(h as i64 - 1)).max(floor);
                    }
                    let (x, y) = (x - 0.5, y - 0.5);
                    let (ix, iy) = (x.floor(), y.floor());
                    let (s, t) = (x - ix, y - iy);
                    let g = |a: i64, b: i64| lum(ix as i64 + a, iy as i64 + b).max(floor);
                    (g(0, 0) * (1.0 - s) + g(1, 0) * s) * (1.0 - t) + (g(0, 1) * (1.0 - s) + g(1, 1) * s) * t
                };
                let n: usize = std::env::var("N").ok().and_then(|s| s.parse().ok()).unwrap_or(1 << 20);
                let mut r = Rng(7);
                let u: Vec<[f32; 2]> = (0..n).map(|_| [r.f(), r.f()]).collect();
                let mut wi = vec![[0f32; 3]; n];
                let mut pdf = vec![0f32; n];
                let mut pdf2 = vec![0f32; n];
                let lev = wis::simd::Level::detect();
                let mut tb = [1e9f64; 4];
                for _ in 0..3 {
                    let t = Instant::now();
                    wis::simd::run(lev, K { l: &l, f: Frame::IDENTITY, u: &u, wi: &mut wi, pdf: &mut pdf, q: 0 });
                    tb[0] = tb[0].min(t.elapsed().as_secs_f64() * 1e9 / n as f64);
                    let t = Instant::now();
                    wis::simd::run(lev, K { l: &l, f: Frame::IDENTITY, u: &u, wi: &mut wi, pdf: &mut pdf2, q: 1 });
                    tb[1] = tb[1].min(t.elapsed().as_secs_f64() * 1e9 / n as f64);
                }
                let mut bad = 0;
                for i in 0..n {
                    if pdf[i].to_bits() != pdf2[i].to_bits() {
                        bad += 1;
                        if bad < 4 {
                            println!("  {i} {} {} {:?} u {:?}", pdf[i], pdf2[i], wi[i], u[i]);
                        }
                    }
                }
                let (mut s1, mut s2, mut mx) = (0f64, 0f64, 0f64);
                for i in 0..n {
                    let x = lookup(wi[i]) / (pdf[i] as f64 * l.power);
                    s1 += x;
                    s2 += x * x;
                    if x > mx {
                        mx = x;
                    }
                }
                let mean = s1 / n as f64;
                let sd = ((s2 / n as f64 - mean * mean) / (mean * mean)).max(0.0).sqrt();
                let t = Instant::now();
                let mut acc = 0f32;
                let mut one = vec![([0f32; 3], 0f32); n];
                for i in 0..n {
                    let (a, b) = l.sample::<f32>(&Frame::IDENTITY, u[i]);
                    one[i] = (a, b);
                    acc += b;
                }
                tb[2] = t.elapsed().as_secs_f64() * 1e9 / n as f64;
                let t = Instant::now();
                for i in 0..n {
                    acc += l.pdf::<f32>(&Frame::IDENTITY, wi[i]);
                }
                tb[3] = t.elapsed().as_secs_f64() * 1e9 / n as f64;
                let diff = (0..n).filter(|&i| one[i].0 != wi[i] || one[i].1.to_bits() != pdf[i].to_bits()).count();
                let mut inv = 0f64;
                let mut inverr = 0;
                for i in 0..20000 {
                    match l.invert(&Frame::IDENTITY, glam::Vec3::from_array(wi[i])) {
                        Some(v) => {
                            let (b, _) = l.sample::<f32>(&Frame::IDENTITY, v);
                            let e = (0..3).map(|k| (b[k] - wi[i][k]).abs()).fold(0f32, f32::max) as f64;
                            if e > inv {
                                inv = e
                            };
                            if e > 1e-3 {
                                inverr += 1
                            }
                        }
                        None => inverr += 1,
                    }
                }
                println!(
                    "{:22} {:?} b={budget} bytes {} build {best:.1} ms sample8 {:.1} pdf8 {:.1} sample1 {:.1} pdf1 {:.1} mean {mean:.5} sd {sd:.5} max {mx:.4} err {:.5} bad {bad} scalar!=lanes {diff} inv {inv:.1e} {inverr} {acc:.0}",
                    m.rsplit('/').next().unwrap(),
                    filter,
                    env.as_bytes().len(),
                    tb[0],
                    tb[1],
                    tb[2],
                    tb[3],
                    env.header().error
                );
            }
        }
    }
}
