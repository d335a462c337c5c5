use std::time::Instant;
use wis::brdf::{material::*, point::*, surface::*};
use wis::direct::{candidates::*, joint::*, *};
use wis::environment::Format;
use wis::light::{chart::Layout, decode::Pixels, environment::Environment, plan::*, tables::Light};
use wis::sphere::Frame;
fn main() {
    let m = std::env::args().nth(1).unwrap();
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
    let mat = Material::new(&[Shape::LAMBERT, Shape::ggx(0.1, 0.1)]).unwrap();
    let pt = Point::new(&mat, [0.0, 0.6, 0.8], [0.0, 0.0, 1.0]);
    let n = 100000;
    let mut b = vec![vec![0f32; 16]; 5];
    let mut out = [Ray::default(); 1];
    let mut acc = 0f32;
    for _ in 0..3 {
        let t0 = Instant::now();
        for i in 0..n {
            let s = Surface::new(&pt, &fr).unwrap();
            let turn = Turn::new(i as u32, 0, 0);
            let (x, rest) = b.split_at_mut(1);
            let (y, rest) = rest.split_at_mut(1);
            let (z, rest) = rest.split_at_mut(1);
            let (d, q) = rest.split_at_mut(1);
            let mut cand =
                Candidates { x: &mut x[0], y: &mut y[0], z: &mut z[0], density: &mut d[0], weight: &mut q[0] };
            let got = wis::simd::run(
                lev,
                Request { light: &l, frame: &fr, surface: &s, turn, rays: 1, candidates: &mut cand, out: &mut out },
            );
            acc += out[0].weight + got as f32;
        }
        println!("{:.0} ns {acc}", t0.elapsed().as_secs_f64() * 1e9 / n as f64);
    }
}
