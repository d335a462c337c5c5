//! The figure of ARCHITECTURE.md, from a map: strata, candidates, weights and rays of one call. `figure MAP.hdr FIGURE.svg`.
//!
//! Strata are those of the built light. Candidates and picks follow rule 24 of docs/design.md for a diffuse point, in plain code.

use std::error::Error;
use std::fmt::Write;
use wis::points::sobol;
use wis::{Block, Map};

/// Candidates of each source, and the rays of the call.
const EACH: u32 = 16;
const RAYS: usize = 4;
/// Cells of the map in the picture, along both axes; a panel in pixels, and the gap between two.
const CELLS: [usize; 2] = [80, 40];
const PANEL: [f32; 2] = [400.0, 200.0];
const GAP: f32 = 16.0;
/// Room for the captions.
const TOP: f32 = 22.0;

struct Candidate {
    direction: [f32; 3],
    density: f32,
    weight: f32,
    of_light: bool,
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn unit(a: [f32; 3]) -> [f32; 3] {
    a.map(|x| x / dot(a, a).sqrt())
}

fn direction([u, v]: [f32; 2]) -> [f32; 3] {
    let ((sp, cp), (st, ct)) = ((std::f32::consts::TAU * u).sin_cos(), (std::f32::consts::PI * v).sin_cos());
    [st * cp, st * sp, ct]
}

/// Where a direction lies in a panel.
fn place(d: [f32; 3]) -> [f32; 2] {
    let turns = d[1].atan2(d[0]) / std::f32::consts::TAU;
    [turns.rem_euclid(1.0) * PANEL[0], d[2].clamp(-1.0, 1.0).acos() / std::f32::consts::PI * PANEL[1]]
}

/// Cosine-distributed about a normal.
fn cosine_sample(normal: [f32; 3], [u, v]: [f32; 2]) -> [f32; 3] {
    let around = direction([u, ((1.0 - 2.0 * v).clamp(-1.0, 1.0)).acos() / std::f32::consts::PI]);
    unit([0, 1, 2].map(|k| normal[k] + around[k] * 0.9999))
}

fn main() -> Result<(), Box<dyn Error>> {
    let paths: Vec<String> = std::env::args().skip(1).collect();
    let [map, figure] = &paths[..] else { return Err("figure MAP.hdr FIGURE.svg".into()) };
    let image = image::open(map)?.into_rgb32f();
    let (width, height) = image.dimensions();
    let pixels = image.into_raw();
    let map = Map { error_budget: 0.05, ..Map::latlong(width, height, 3, &pixels) };
    let size = map.size()?;
    let mut memory = vec![Block::ZERO; Block::count(size.bytes)];
    let mut scratch = vec![Block::ZERO; Block::count(size.scratch)];
    let environment = map.build_in(&mut memory, &mut scratch)?;
    let light = environment.source();
    let radiance = |d: [f32; 3]| {
        let place = light.chart.place(d);
        light.radiance.of(&light.radiance.texels(&light.chart, place.face, place.position))
    };

    // A diffuse point that sees the sky and half of what lies on the side of the brightest texel.
    let texels = pixels.chunks_exact(3).map(|rgb| rgb.iter().sum::<f32>());
    let brightest = texels.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(i, _)| i as u32);
    let sun = direction([(brightest % width) as f32 / width as f32, (brightest / width) as f32 / height as f32]);
    let normal = unit([sun[0], sun[1], sun[2] + 0.7]);

    let mut candidates = Vec::new();
    for of_light in [true, false] {
        for i in 0..EACH {
            let u = sobol(u32::from(of_light), i);
            let (direction, inverse) = if of_light {
                let (d, _, _, inverse) = light.sample(u);
                (d, inverse)
            } else {
                (cosine_sample(normal, u), 1.0)
            };
            let (l, cosine) = (radiance(direction), dot(normal, direction).max(0.0));
            let lobe = cosine / std::f32::consts::PI;
            let mixed = EACH as f32 * (light.stand_in(l) + lobe);
            let density = if of_light { mixed / (inverse * light.stand_in(l)) } else { mixed };
            let weight = if cosine > 0.0 { l * lobe / density } else { 0.0 };
            candidates.push(Candidate { direction, density, weight, of_light });
        }
    }
    let floor = 0.05 * candidates.iter().map(|c| c.weight).sum::<f32>() / candidates.len() as f32;
    for c in candidates.iter_mut().filter(|c| dot(normal, c.direction) > 0.0) {
        c.weight += floor;
    }
    let sum: f32 = candidates.iter().map(|c| c.weight).sum();
    let (mut before, mut picked) = (0.0, Vec::new());
    for (i, c) in candidates.iter().enumerate() {
        let ends = [before, before + c.weight].map(|x| (x / sum * RAYS as f32 + 0.5).floor());
        before += c.weight;
        if ends[1] > ends[0] {
            picked.push((i, (ends[1] - ends[0]) * sum / (RAYS as f32 * c.weight * c.density)));
        }
    }

    let [w, h] = PANEL;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"sans-serif\" font-size=\"13\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n<defs><g id=\"map\">\n",
        3.0 * w + 2.0 * GAP,
        TOP + h + 2.0
    );
    let mut colours = std::collections::BTreeMap::<String, String>::new();
    for y in 0..CELLS[1] {
        for x in 0..CELLS[0] {
            let at = |k: usize, n: usize, of: u32| ((k as f32 + 0.5) / n as f32 * of as f32) as usize;
            let texel = at(y, CELLS[1], height) * width as usize + at(x, CELLS[0], width);
            let tone = |v: f32| ((v * 0.5 / light.mean).powf(0.45) * 9.0).clamp(0.0, 15.0) as u32;
            let rgb = &pixels[3 * texel..3 * texel + 3];
            let colour = format!("#{:x}{:x}{:x}", tone(rgb[0]), tone(rgb[1]), tone(rgb[2]));
            let size = [w / CELLS[0] as f32, h / CELLS[1] as f32];
            write!(
                colours.entry(colour).or_default(),
                "M{} {}h{}v{}h-{}z",
                x as f32 * size[0],
                y as f32 * size[1],
                size[0],
                size[1],
                size[0]
            )?;
        }
    }
    for (colour, path) in colours {
        writeln!(svg, "<path d=\"{path}\" fill=\"{colour}\" stroke=\"{colour}\" stroke-width=\".4\"/>")?;
    }
    svg += "</g></defs>\n";
    let captions = [
        format!("1. {} strata of equal probability", light.strata.len()),
        format!("2. {EACH} candidates of the light (yellow), {EACH} of the lobe (blue)"),
        format!("3. weights (areas), and {} rays picked (rings)", picked.len()),
    ];
    for (panel, caption) in captions.iter().enumerate() {
        writeln!(
            svg,
            "<g transform=\"translate({} {TOP})\"><text y=\"-7\">{caption}</text><use href=\"#map\"/>",
            panel as f32 * (w + GAP)
        )?;
        if panel == 0 {
            svg += "<path fill=\"none\" stroke=\"#ff0\" stroke-width=\".3\" d=\"";
            for &[x, y, dx, dy] in light.strata {
                let scale = [w / width as f32, h / height as f32];
                write!(
                    svg,
                    "M{:.1} {:.1}h{:.1}v{:.1}",
                    x * scale[0],
                    (y + dy) * scale[1],
                    dx * scale[0],
                    -dy * scale[1]
                )?;
            }
            svg += "\"/>\n";
        } else {
            let border: Vec<String> = (0..=100)
                .map(|k| {
                    // The horizon: where the cosine is 0.
                    let phi = std::f32::consts::TAU * k as f32 / 100.0;
                    let across = normal[0] * phi.cos() + normal[1] * phi.sin();
                    format!("{:.1},{:.1}", k as f32 * 0.01 * w, (normal[2].atan2(-across)) / std::f32::consts::PI * h)
                })
                .collect();
            writeln!(svg, "<path d=\"M{}V{h}H0z\" fill=\"#000\" fill-opacity=\".55\"/>", border.join(" "))?;
            let largest = candidates.iter().map(|c| c.weight).fold(0.0, f32::max);
            for c in &candidates {
                let ([x, y], colour) = (place(c.direction), if c.of_light { "#fd0" } else { "#5bf" });
                let radius = if panel == 1 { 3.0 } else { 11.0 * (c.weight / largest).sqrt() };
                writeln!(
                    svg,
                    "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" fill=\"{colour}\" stroke=\"#000\" stroke-width=\".6\"/>"
                )?;
            }
            for (i, _) in picked.iter().filter(|_| panel == 2) {
                let [x, y] = place(candidates[*i].direction);
                writeln!(
                    svg,
                    "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"14\" fill=\"none\" stroke=\"#f22\" stroke-width=\"2.5\"/>"
                )?;
            }
        }
        svg += "</g>\n";
    }
    svg += "</svg>\n";
    std::fs::write(figure, svg)?;
    for (i, weight) in &picked {
        println!("ray {:?}, weight {weight:.3}", candidates[*i].direction);
    }
    Ok(())
}
