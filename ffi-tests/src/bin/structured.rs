//! Goes through the figures and claims of "Structured Importance Sampling" on real maps and meshes, and writes a page with
//! pictures: structured <page>

use anyhow::{Context, Result};
use image::GrayImage;
use plotters::prelude::*;
use std::collections::HashMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;
use wis_ffi_tests::client::raw;
use wis_ffi_tests::data;
use wis_ffi_tests::directions;
use wis_ffi_tests::images::side_by_side;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::{Bsdf, Material};
use wis_ffi_tests::points;
use wis_ffi_tests::scene::{Scene, ShadingPoint, View};
use wis_ffi_tests::structured::{How, Lights, Picture, Raster, Shader, Source, clustered, picture, truth};
use wis_ffi_tests::visibility::{self, Model};

/// Rows of the maps that are not lat-long to begin with: twice as many texels as Galileo's 1024 x 1024 probe.
const ROWS: usize = 1024;
/// Columns and rows of pixels that are left out of a picture.
const STEP: u32 = 2;

fn main() -> Result<()> {
    let page = PathBuf::from(std::env::args().nth(1).context("usage: structured <page>")?);
    let pictures = page.with_extension("");
    std::fs::create_dir_all(&pictures)?;
    let mut page_text = Page { text: String::from(INTRODUCTION), pictures };
    let galileo = data::light("galileo_probe.hdr")?.to_latlong(ROWS);
    let grace = data::light("grace_latlong.exr")?;
    page_text.visibility()?;
    page_text.allocation()?;
    page_text.speed(&[&galileo, &grace])?;
    page_text.teapot(&galileo)?;
    page_text.buddha(&grace)?;
    page_text.indirect(&data::light("venice_sunset_1k.hdr")?)?;
    page_text.flicker(&galileo)?;
    print!("{}", page_text.text);
    Ok(std::fs::write(page, page_text.text)?)
}

const INTRODUCTION: &str = r#"# Structured importance sampling

Written by `make structured`. Agarwal et al. 2003, "Structured Importance Sampling of Environment Maps", claim by claim:
`wis_strata_*` cuts a map into lights, `wis_jitter_*` draws places inside strata. One core; the paper's times are of a
Pentium 4 of 2.4 GHz.

| claim | paper | here | holds |
|---|---|---|---|
| correlation of visibility falls exponentially (Fig. 2) | a line; T = .5, of ten maps .02 to .6 | R^2 .90 to .99, T .43 to 1.04 at points of which one mesh hides half | yes |
| variance in a cone is angle / 3T (Eq. 6) | 1/3 | .12 to .20 | no, see below |
| it reaches 1/4 at 3T/4 | yes | .34 to .60 of it | later |
| small bright regions get fewer lights (Fig. 3) | 25 in place of 35 | 25 in place of 35 | yes |
| 300 lights of 1024 x 1024 | a minute | .4 s, 2048 x 1024 | yes |
| 3000 lights | - | 1.2 s | |
| 300 lights are as good as 3000 samples of stratified importance sampling (Fig. 5) | yes | error .0073 and .0076, in 16 and 1530 us a point | yes |
| 100 lights look convincing, 300 samples of it do not | yes | .013 and .033 | yes |
| k-means (LightGen) shows bands, with 3000 lights too | yes | .0064 with 300, .0028 with 3000 | no |
| uniform stratified sampling is naive | yes | .67 | yes |
| jitter trades bands for noise (Fig. 7) | yes | .0245 without, .0345 by energy, .061 uniform | yes |
| a glossy buddha takes ten times fewer samples (Fig. 6) | 300 against 3000 | 300 lights .23, 1000 samples .21 | three times |
| sampling its BRDF is worse than sampling the map | yes | .053 against .21, with 1000 samples | no |
| sorting needs 4.7 rays a point in place of 300 | as good | 35 rays: .231 in place of .229 | one in three |
| sorting saves three quarters of the teapot's rays | yes | a fifth, at twice the error | no |
| sorting does not save time there | yes | 21 us in place of 16 | yes |
| with indirect light sorting is three times as fast (Fig. 8) | 233 and 74 s | half the rays, 44 and 52 us | no |
| no flicker when objects turn | yes | .003, importance sampling .025 | yes |

*Eq. 6.* The appendix takes the mean b of visibility in a cone around a visible direction and calls b (1 - b) the mean
variance. But a mean of products is not the product of means: in the same model the expected variance in a disc is 1/4 of
what the correlation loses over the mean distance of two of its points, 128 / (45 pi) of the radius. That makes
32 / (45 pi) = .226 of angle / T, the grey line below. Measured is less still, since log correlation bends down from the
origin. That it is proportional to the angle stands, and with it the exponent 1/4 of the metric.

*k-means.* Here it starts from texels spread along the map by weight, and does not get caught: it is as good as the strata
with 300 lights and better with 3000. LightGen itself was not to be had.

*The buddha.* Grey GGX of roughness .2 on a ground of the same: bands on the ground, where 300 lights are too far apart for
the lobe, make most of the error. On the mesh it is .165.

*Sorting* pays where rays are dear. Here a ray costs 50 ns, as much as bringing a light in order.

Not reproduced: the mountain of two million triangles of Fig. 8 (a mesh of 100000 stands in), and LightGen.
"#;

/// What is written.
struct Page {
    text: String,
    pictures: PathBuf,
}

impl Page {
    /// Section 2.1 and Fig. 2.
    fn visibility(&mut self) -> Result<()> {
        let mut models = Vec::new();
        for file in ["teapot.obj", "stanford-bunny.obj", "spot.obj", "dragon_vrip_res3.ply", "buddha.obj"] {
            let scene = data::scene(file, View::Points(1500))?;
            for point in half_hidden(&scene) {
                models.push((scene.name.clone(), visibility::measure(&scene, &point)));
            }
        }
        writeln!(self.text, "\n## Visibility (Section 2.1, Fig. 2)\n\n{VISIBILITY}")?;
        writeln!(self.text, "| mesh | seen | T | fit, R^2 | variance x T / angle at T/4 | at T/2 | at 3T/4, of 1/4 |")?;
        writeln!(self.text, "|---|---:|---:|---:|---:|---:|---:|")?;
        for (name, model) in &models {
            let Model { visible, angle, explained, .. } = model;
            let at = |share: f64| variance_at(model, share * angle);
            let slope =
                |share: f64| if at(share).is_nan() { "-".into() } else { format!("{:.2}", at(share) / 4.0 / share) };
            let tail = at(0.75);
            let tail = if tail.is_nan() { "-".into() } else { format!("{tail:.2}") };
            writeln!(
                self.text,
                "| {name} | {visible:.2} | {angle:.2} | {explained:.2} | {} | {} | {tail} |",
                slope(0.25),
                slope(0.5)
            )?;
        }
        let file = self.pictures.join("visibility.svg");
        plot_visibility(&models, &file).map_err(|error| anyhow::anyhow!("{}: {error}", file.display()))?;
        writeln!(self.text, "\n![log correlation and variance against angle]({})", self.link("visibility.svg"))?;
        Ok(())
    }

    /// Fig. 3.
    fn allocation(&mut self) -> Result<()> {
        let map = three_regions();
        let source = Source::new(&map);
        writeln!(self.text, "\n## Allocation (Fig. 3)\n\n{ALLOCATION}")?;
        writeln!(self.text, "| metric | lights | in the bright region | in the middle one |\n|---|---:|---:|---:|")?;
        let rows = [
            ("area: a = 0, b = 1", [0.0, 1.0], 12.567),
            ("light: a = 1, b = 0", [1.0, 0.0], 0.01),
            ("a = 1, b = 1/4", [1.0, 0.25], 0.01),
        ];
        for (name, exponents, angle_limit) in rows {
            let config =
                raw::wis_strata_config { count: 100, angle_limit, exponents: exponents.as_ptr(), ..Default::default() };
            let strata = source.strata_by(&config)?;
            let angle = |l: &raw::wis_light| l.direction[0].clamp(-1.0, 1.0).acos();
            let within = |low: f32, high: f32| strata.lights.iter().filter(|l| (low..high).contains(&angle(l))).count();
            let (bright, middle) = (within(0.0, BRIGHT), within(BRIGHT, MIDDLE));
            writeln!(self.text, "| {name} | {} | {bright} | {middle} |", strata.lights.len())?;
        }
        Ok(())
    }

    /// Section 5: what it takes to cut a map.
    fn speed(&mut self, lights: &[&Light]) -> Result<()> {
        writeln!(self.text, "\n## Time to cut a map (Section 5)\n\n{SPEED}")?;
        writeln!(
            self.text,
            "| map | texels | lights asked for | lights | seconds | scratch MB |\n|---|---:|---:|---:|---:|---:|"
        )?;
        for light in lights {
            let [width, height] = light.size();
            let source = Source::new(light);
            for count in [300, 3000] {
                let mut best = f64::MAX;
                let mut strata = source.strata(count)?;
                for _ in 0..3 {
                    let start = Instant::now();
                    strata = source.strata(count)?;
                    best = best.min(start.elapsed().as_secs_f64());
                }
                let (lights, megabytes) = (strata.lights.len(), strata.size.scratch_bytes as f64 / 1e6);
                let name = &light.name;
                writeln!(
                    self.text,
                    "| {name} | {width} x {height} | {count} | {lights} | {best:.2} | {megabytes:.0} |"
                )?;
            }
            let start = Instant::now();
            clustered(&source.light.to_latlong(height), 300, ROUNDS);
            let name = &light.name;
            writeln!(
                self.text,
                "| {name} | {width} x {height} | 300 | k-means, {ROUNDS} rounds | {:.2} | - |",
                start.elapsed().as_secs_f64()
            )?;
        }
        Ok(())
    }

    /// Figs. 5 and 7.
    fn teapot(&mut self, light: &Light) -> Result<()> {
        let scene = data::scene("teapot.obj", View::Image(STEP))?;
        let material = Material::lambert();
        let truth = truth(&scene, light, &material)?;
        let (source, raster) = (Source::new(light), Raster::new(light));
        writeln!(self.text, "\n## A teapot in Galileo's tomb (Fig. 5)\n\n{TEAPOT}")?;
        let lights = |count: u32| -> Result<Lights> { Ok(Lights::of(&source.strata(count)?)) };
        let (l50, l100, l300) = (lights(50)?, lights(100)?, lights(300)?);
        let (k300, k3000) = (clustered(light, 300, ROUNDS), clustered(light, 3000, 2));
        let rows = [
            ("uniform stratified, 300", How::Uniform(light, 300)),
            ("stratified importance, 300", How::Importance(&raster, 300)),
            ("stratified importance, 3000", How::Importance(&raster, 3000)),
            ("k-means, 300", How::Lights(&k300)),
            ("k-means, 3000", How::Lights(&k3000)),
            ("structured, 100", How::Lights(&l100)),
            ("structured, 300", How::Lights(&l300)),
            ("structured, 300, sorted to .05", How::Sorted(&l300, 0.05, 4)),
        ];
        let pictures = self.table(&scene, &material, &truth, &rows)?;
        let shown: Vec<_> = [0, 1, 3, 5, 6].map(|i: usize| pictures[i].values.clone()).into();
        self.save("teapot.png", &side_by_side(&scene, &truth, &shown, ERROR_GAIN))?;
        writeln!(
            self.text,
            "\nFrom the left: reference, uniform, importance, k-means, structured 100, structured 300."
        )?;
        writeln!(self.text, "\n## Jitter (Fig. 7)\n\n{JITTER}")?;
        let strata = source.strata(50)?;
        let uniform = source.jitter(&strata, raw::WIS_JITTER_UNIFORM)?;
        let energy = source.jitter(&strata, raw::WIS_JITTER_ENERGY)?;
        let rows = [
            ("50 lights", How::Lights(&l50)),
            ("50 lights, uniform jitter", How::Jittered(&l50, &uniform)),
            ("50 lights, jitter by energy", How::Jittered(&l50, &energy)),
        ];
        let pictures = self.table(&scene, &material, &truth, &rows)?;
        let shown: Vec<_> = pictures.into_iter().map(|picture| picture.values).collect();
        self.save("jitter.png", &side_by_side(&scene, &truth, &shown, ERROR_GAIN))?;
        writeln!(self.text, "\nFrom the left: reference, no jitter, uniform, by energy.")?;
        Ok(())
    }

    /// Figs. 1 and 6.
    fn buddha(&mut self, light: &Light) -> Result<()> {
        let scene = data::scene("buddha.obj", View::Image(STEP))?;
        let material = Material::ggx(0.2);
        let truth = truth(&scene, light, &material)?;
        let (source, raster) = (Source::new(light), Raster::new(light));
        writeln!(self.text, "\n## A glossy buddha in Grace cathedral (Figs. 1 and 6)\n\n{BUDDHA}")?;
        let lights = |count: u32| -> Result<Lights> { Ok(Lights::of(&source.strata(count)?)) };
        let (l1, l10, l100, l300) = (lights(1)?, lights(10)?, lights(100)?, lights(300)?);
        let rows = [
            ("stratified importance, 1", How::Importance(&raster, 1)),
            ("stratified importance, 10", How::Importance(&raster, 10)),
            ("stratified importance, 100", How::Importance(&raster, 100)),
            ("stratified importance, 300", How::Importance(&raster, 300)),
            ("stratified importance, 1000", How::Importance(&raster, 1000)),
            ("BRDF, 1000", How::Brdf(light, 1000)),
            ("structured, 1", How::Lights(&l1)),
            ("structured, 10", How::Lights(&l10)),
            ("structured, 100", How::Lights(&l100)),
            ("structured, 300", How::Lights(&l300)),
            ("300, sorted to .01", How::Sorted(&l300, 0.01, 2)),
            ("300, sorted to .05", How::Sorted(&l300, 0.05, 2)),
            ("300, sorted to .1", How::Sorted(&l300, 0.1, 2)),
            ("300, sorted to .2", How::Sorted(&l300, 0.2, 2)),
            ("300, sorted to .4", How::Sorted(&l300, 0.4, 2)),
        ];
        let pictures = self.table(&scene, &material, &truth, &rows)?;
        let shown: Vec<_> = [3, 4, 9, 11, 13].map(|i: usize| pictures[i].values.clone()).into();
        self.save("buddha.png", &side_by_side(&scene, &truth, &shown, ERROR_GAIN))?;
        writeln!(
            self.text,
            "\nFrom the left: reference, importance 300 and 1000, structured 300, the same sorted to .05 and to .2."
        )?;
        Ok(())
    }

    /// In place of Fig. 8.
    fn indirect(&mut self, light: &Light) -> Result<()> {
        let (mesh, scene) = (data::mesh("buddha.obj")?, data::scene("buddha.obj", View::Image(STEP))?);
        let material = Material::lambert();
        let lights = Lights::of(&Source::new(light).strata(300)?);
        writeln!(
            self.text,
            "\n## Indirect light (in place of Fig. 8)\n\n{INDIRECT}\nMesh: {}, {} triangles. Light: {}.\n",
            scene.name,
            mesh.triangles.len(),
            light.name
        )?;
        let rows = [
            ("no sorting", How::Lights(&lights), How::Lights(&lights)),
            ("sorted to .05", How::Sorted(&lights, 0.05, 2), How::Sorted(&lights, 0.05, 2)),
            ("sorted to .05, indirect to .3", How::Sorted(&lights, 0.05, 2), How::Sorted(&lights, 0.3, 2)),
        ];
        let mut pictures = Vec::new();
        for (_, direct, far) in &rows {
            pictures.push(with_bounce(&scene, &material, direct, far)?);
        }
        let truth = pictures[0].values.clone();
        writeln!(self.text, "| lights | shadow rays a point | us a point | differs by |\n|---|---:|---:|---:|")?;
        for ((name, ..), picture) in rows.iter().zip(&pictures) {
            let Picture { rays, us, .. } = picture;
            writeln!(self.text, "| {name} | {rays:.0} | {us:.0} | {:.3} |", picture.error(&truth))?;
        }
        let direct = picture(&scene, &material, &rows[0].1, 0)?.values;
        let shown = [direct, pictures[2].values.clone()];
        self.save("indirect.png", &side_by_side(&scene, &truth, &shown, ERROR_GAIN))?;
        writeln!(self.text, "\nFrom the left: no sorting, the same without indirect light, sorted to .05 and .3.")?;
        Ok(())
    }

    /// Section 4: an object that turns.
    fn flicker(&mut self, light: &Light) -> Result<()> {
        const FRAMES: usize = 8;
        let mesh = data::mesh("teapot.obj")?;
        let turned = |frame: usize| Scene::turned("teapot", &mesh, 0.02 * frame as f32, View::Image(3));
        let scenes = (0..FRAMES).map(turned).collect::<Result<Vec<_>>>()?;
        let material = Material::lambert();
        let (source, raster) = (Source::new(light), Raster::new(light));
        let strata = [source.strata(100)?, source.strata(300)?];
        let [l100, l300] = strata.each_ref().map(Lights::of);
        let energy = source.jitter(&strata[0], raw::WIS_JITTER_ENERGY)?;
        let k300 = clustered(light, 300, ROUNDS);
        writeln!(self.text, "\n## Flicker when the object turns (Section 4)\n\n{FLICKER}")?;
        writeln!(self.text, "| method | flicker |\n|---|---:|")?;
        let rows = [
            ("structured, 100", How::Lights(&l100)),
            ("structured, 300", How::Lights(&l300)),
            ("structured, 100, jitter by energy", How::Jittered(&l100, &energy)),
            ("k-means, 300", How::Lights(&k300)),
            ("stratified importance, 300", How::Importance(&raster, 300)),
            ("stratified importance, 3000", How::Importance(&raster, 3000)),
        ];
        for (name, how) in &rows {
            let mut frames = Vec::with_capacity(FRAMES);
            for (frame, scene) in (0..).zip(&scenes) {
                frames.push(on_the_ground(scene, &picture(scene, &material, how, frame)?.values));
            }
            writeln!(self.text, "| {name} | {:.4} |", second_difference(&frames))?;
        }
        Ok(())
    }

    /// A table of methods; answers their pictures.
    fn table(
        &mut self,
        scene: &Scene,
        material: &Material,
        truth: &[f64],
        rows: &[(&str, How)],
    ) -> Result<Vec<Picture>> {
        writeln!(self.text, "| method | error | on the mesh | shadow rays a point | us a point |")?;
        writeln!(self.text, "|---|---:|---:|---:|---:|")?;
        let on_mesh: Vec<bool> = scene.points.iter().map(|point| !is_ground(point)).collect();
        let of_mesh = |values: &[f64]| -> Vec<f64> {
            values.iter().zip(&on_mesh).filter(|(_, on)| **on).map(|(value, _)| *value).collect()
        };
        let mut pictures = Vec::with_capacity(rows.len());
        for (name, how) in rows {
            let picture = picture(scene, material, how, 0)?;
            let Picture { rays, us, .. } = picture;
            let there = Picture { values: of_mesh(&picture.values), rays, us }.error(&of_mesh(truth));
            writeln!(self.text, "| {name} | {:.4} | {there:.4} | {rays:.1} | {us:.1} |", picture.error(truth))?;
            pictures.push(picture);
        }
        Ok(pictures)
    }

    fn save(&mut self, file: &str, image: &GrayImage) -> Result<()> {
        image.save(self.pictures.join(file))?;
        writeln!(self.text, "\n![{file}]({})", self.link(file))?;
        Ok(())
    }

    fn link(&self, file: &str) -> String {
        let folder = self.pictures.file_name().and_then(|n| n.to_str()).unwrap_or(".");
        format!("{folder}/{file}")
    }
}

/// How much brighter errors are than pictures.
const ERROR_GAIN: f64 = 4.0;

/// Rounds of k-means.
const ROUNDS: usize = 8;

const VISIBILITY: &str = "Ten visibility maps, two for each mesh. The correlation of visibility at an angle is fitted by \
exp(-angle / T), on the logarithms, where it is above .1. The variance is that within cones of a half-angle, in units in \
which the hemisphere has 1/4; Eq. 6 says variance x T / angle = 1/3 for small angles.
";

const ALLOCATION: &str =
    "A map made for it: a bright disc with 35 % of the light that spans .26 of the limiting solid \
angle, so that the metric counts it 25 / 35 as much as light alone does; a middle ring and a dark rest.
";

const SPEED: &str =
    "The fastest of three runs on one core. The paper: a minute for 300 lights at 1024 x 1024, LightGen an \
hour, and ten hours for 3000. k-means starts from texels spread by weight and runs a fixed number of rounds.
";

const TEAPOT: &str =
    "Error: root mean squared, over the mean of the picture. The reference is sampled by MIS without the \
library. Rays: those that are not below the horizon.
";

const JITTER: &str = "One visibility ray a stratum, from its centre or from a random place in it.
";

const BUDDHA: &str =
    "GGX of roughness .2 in place of Phong of exponent 50. Sorted: lights by what they may add, until the \
rest is below a share of the whole; two of the rest, drawn by what they may add, tell how much of it is seen.
";

const INDIRECT: &str =
    "One bounce of 16 cosine-distributed rays a point, at whose hits the strata light a Lambert surface \
again. Differences are to the picture without sorting.
";

const FLICKER: &str = "The teapot turns by .02 radians a frame; flicker is the root mean squared second difference in time \
over the ground's pixels, divided by sqrt 6 and by the mean: the noise of a frame if noise is all there is. Random numbers \
change from frame to frame.
";

/// Two points of which about half of the hemisphere is hidden.
fn half_hidden(scene: &Scene) -> Vec<ShadingPoint> {
    let mut points: Vec<_> = scene.points.iter().map(|p| (visibility::visible_share(scene, p), *p)).collect();
    points.sort_by(|a, b| (a.0 - 0.5).abs().total_cmp(&(b.0 - 0.5).abs()));
    let second = points.len() / 16;
    [0, second].iter().filter_map(|&i| points.get(i)).map(|p| p.1).collect()
}

/// The relative variance at a half-angle, between those that were measured.
fn variance_at(model: &Model, angle: f64) -> f64 {
    let pair = model.variance.windows(2).find(|pair| (pair[0].0..pair[1].0).contains(&angle));
    pair.map_or(f64::NAN, |pair| {
        let [(a, low), (b, high)] = [pair[0], pair[1]];
        low + (high - low) * (angle - a) / (b - a)
    })
}

fn plot_visibility(models: &[(String, Model)], file: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let root = SVGBackend::new(file, (1120, 440)).into_drawing_area();
    root.fill(&WHITE)?;
    let (left, right) = root.split_horizontally(560);
    let colour = |i: usize| Palette99::pick(i / 2).stroke_width(1 + i as u32 % 2);
    let mut chart = ChartBuilder::on(&left)
        .margin(8)
        .caption("log correlation of visibility", ("sans-serif", 18))
        .x_label_area_size(36)
        .y_label_area_size(48)
        .build_cartesian_2d(0.0..f64::from(visibility::WIDEST), -3.0..0.0)?;
    chart.configure_mesh().x_desc("angle in radians").light_line_style(TRANSPARENT).draw()?;
    for (i, (_, model)) in models.iter().enumerate() {
        let line = model.correlation.iter().take_while(|p| p.1 > 0.05).map(|p| (p.0, p.1.ln()));
        chart.draw_series(LineSeries::new(std::iter::once((0.0, 0.0)).chain(line), colour(i)))?;
    }
    let mut chart = ChartBuilder::on(&right)
        .margin(8)
        .caption("variance of visibility in a cone", ("sans-serif", 18))
        .x_label_area_size(36)
        .y_label_area_size(48)
        .build_cartesian_2d(0.0..2.0, 0.0..0.27)?;
    chart.configure_mesh().x_desc("half-angle / T").light_line_style(TRANSPARENT).draw()?;
    for (i, (name, model)) in models.iter().enumerate() {
        let line = model.variance.iter().map(|p| (p.0 / model.angle, p.1 / 4.0)).filter(|p| p.0 <= 2.0);
        let series = chart.draw_series(LineSeries::new(line, colour(i)))?;
        if i % 2 == 0 {
            let style = colour(i);
            series.label(name).legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], style));
        }
    }
    let model = |slope: f64| [(0.0, 0.0), (0.75, 0.75 * slope)];
    for (name, slope, colour) in
        [("Eq. 6: 1/3", 1.0 / 3.0, BLACK), ("32 / (45 pi)", MEAN_DISTANCE, RGBColor(150, 150, 150))]
    {
        let series = chart.draw_series(LineSeries::new(model(slope), colour.stroke_width(3)))?;
        series.label(name).legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], colour.stroke_width(3)));
    }
    chart
        .configure_series_labels()
        .border_style(BLACK)
        .background_style(WHITE)
        .position(SeriesLabelPosition::LowerRight)
        .draw()?;
    Ok(root.present()?)
}

/// 1/4 of the mean distance in a disc of radius 1: see the notes.
const MEAN_DISTANCE: f64 = 32.0 / (45.0 * std::f64::consts::PI);

/// The radii of the regions of Fig. 3's map, about +x.
const BRIGHT: f32 = 0.0287;
const MIDDLE: f32 = 0.25;

/// A disc, a ring and a rest, each of constant radiance, with .35, .4 and .25 of the light.
fn three_regions() -> Light {
    let (width, height) = (2048usize, 1024usize);
    let share = |angle: f32| 2.0 * std::f32::consts::PI * (1.0 - angle.cos());
    let (disc, ring) = (share(BRIGHT), share(MIDDLE) - share(BRIGHT));
    let rest = 4.0 * std::f32::consts::PI - disc - ring;
    let texel = |i: usize| {
        let phi = std::f32::consts::TAU * ((i % width) as f32 + 0.5) / width as f32;
        let theta = std::f32::consts::PI * ((i / width) as f32 + 0.5) / height as f32;
        match (theta.sin() * phi.cos()).acos() {
            angle if angle < BRIGHT => 0.35 / disc,
            angle if angle < MIDDLE => 0.4 / ring,
            _ => 0.25 / rest,
        }
    };
    Light::latlong("three regions", width, height, (0..width * height).map(texel).collect())
}

/// Direct light and that of one bounce.
fn with_bounce(scene: &Scene, material: &Material, direct: &How, far: &How) -> Result<Picture> {
    const BOUNCES: usize = 16;
    let (mut shader, mut u) = (Shader::default(), [[0.0; 2]; BOUNCES]);
    let start = Instant::now();
    let mut values = Vec::with_capacity(scene.points.len());
    for point in &scene.points {
        let mut value = shader.estimate(scene, point, &Bsdf::new(material, point), direct, 0)?;
        points::sobol(wis_ffi_tests::client::pixel_seed(point.pixel, 1), 0, &mut u);
        for u in u {
            let wi = directions::cosine(point.normal, u);
            let Some(hit) = scene.tracer.intersect(point.origin, wi) else { continue };
            let normal = if hit.normal.dot(wi) < 0.0 { hit.normal } else { -hit.normal };
            let origin = point.origin + wi * hit.distance + normal * 1e-4;
            let there = ShadingPoint { origin, normal, wo: -wi, ..*point };
            let radiance = shader.estimate(scene, &there, &Bsdf::new(material, &there), far, 2)?;
            value += ALBEDO * radiance / BOUNCES as f64;
        }
        values.push(value);
    }
    let points = scene.points.len() as f64;
    Ok(Picture { values, rays: shader.rays as f64 / points, us: start.elapsed().as_secs_f64() * 1e6 / points })
}

/// What the Lambert surface reflects.
const ALBEDO: f64 = 0.7;

fn is_ground(point: &ShadingPoint) -> bool {
    point.origin.z < 2e-4 && point.normal.z > 0.999
}

/// The pixels of a picture that show the ground.
fn on_the_ground(scene: &Scene, values: &[f64]) -> HashMap<[u32; 2], f64> {
    scene.points.iter().zip(values).filter(|(p, _)| is_ground(p)).map(|(p, v)| (p.pixel, *v)).collect()
}

/// The root mean squared second difference in time, over sqrt 6 and over the mean.
fn second_difference(frames: &[HashMap<[u32; 2], f64>]) -> f64 {
    let (mut squares, mut sum, mut count) = (0.0, 0.0, 0.0);
    for three in frames.windows(3) {
        for (pixel, middle) in &three[1] {
            if let (Some(before), Some(after)) = (three[0].get(pixel), three[2].get(pixel)) {
                squares += (before - 2.0 * middle + after).powi(2) / 6.0;
                sum += middle;
                count += 1.0;
            }
        }
    }
    (squares / count).sqrt() / (sum / count)
}
