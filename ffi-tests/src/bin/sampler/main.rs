//! Measures products of light and BRDF at shading points beside those of version 0.1: sampler <page> <ablation>
//!
//! The second file is what `ablation` wrote.

mod cost;
mod estimators;
mod own;
mod page;

use anyhow::{Context, Result};
use cost::{Cost, costs};
use estimators::Figures;
use own::Own;
use wis_ffi_tests::client::{Density, Preparation, Product};
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::Material;
use wis_ffi_tests::products::{Case, DEVELOPER, OTHERS, POINTS, lights, materials, points};
use wis_ffi_tests::scene::ShadingPoint;

/// All that stands on the page.
pub struct Results {
    pub materials: Vec<String>,
    /// Of products now and of version 0.1, by material.
    pub costs: Vec<[Cost; 2]>,
    pub timed: String,
    /// By group of maps.
    pub errors: [Vec<Errors>; 2],
}

/// The errors of products now and of version 0.1 under a light, by material.
pub struct Errors {
    pub light: String,
    pub each: Vec<[f64; 2]>,
    /// Of estimators by the stated integral.
    pub estimators: Vec<Figures>,
}

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let mut next = || arguments.next().context("usage: sampler <page> <ablation>");
    let (page, ablation) = (next()?, std::fs::read_to_string(next()?)?);
    let [mut developer, others] = [lights(&DEVELOPER)?, lights(&OTHERS)?];
    if developer.is_empty() {
        developer.extend([Light::windows(512), Light::room(512)].map(Light::bilinear));
    }
    let (materials, points) = (materials(), points(POINTS)?);
    let timed = developer.iter().find(|light| light.name.contains("fagans")).unwrap_or(&developer[0]);
    let costs = materials.iter().map(|material| costs(timed, material)).collect::<Result<_, _>>()?;
    let errors = [errors(&developer, &materials, &points)?, errors(&others, &materials, &points)?];
    let names = materials.iter().map(|material| material.name.clone()).collect();
    let written = page::write(&Results { materials: names, costs, timed: timed.name.clone(), errors }, &ablation)?;
    print!("{written}");
    Ok(std::fs::write(page, written)?)
}

fn errors(lights: &[Light], materials: &[Material], points: &[ShadingPoint]) -> Result<Vec<Errors>> {
    let mut all = Vec::new();
    for light in lights {
        let environment = light.environment()?;
        let preparation = Preparation { world_from_map: Some(light.world_from_map()), ..Default::default() };
        let mut memory = preparation.memory()?;
        let mut each = Vec::new();
        for material in materials {
            let case = Case::new(light, material, points);
            let mut own = Own::new(light, material)?;
            let now = case.error(|point, u, wi, pdf| {
                own.prepare(material, point)?;
                for ((wi, pdf), drawn) in wi.iter_mut().zip(pdf).zip(own.sample(u)?) {
                    (*wi, *pdf) = (drawn.wi, drawn.pdf);
                }
                Ok(())
            })?;
            let before = case.error(|point, u, wi, pdf| {
                let product = Product::prepare(&environment, &material.query(point), &preparation, &mut memory)?;
                product.sample_n(u, wi, pdf)
            })?;
            each.push([now, before]);
        }
        eprintln!("{}", light.name);
        let estimators = estimators::figures(light, materials, &points[..points.len().min(estimators::POINTS)])?;
        all.push(Errors { light: light.name.clone(), each, estimators });
    }
    Ok(all)
}
