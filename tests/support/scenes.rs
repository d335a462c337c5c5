//! The grid of shading points on which densities are judged: lobes, normals and views.

use super::maps::Filter;
use super::material::Material;
use super::quadrature::Scene;
use super::vector::{V3, add, cross, dot, rotate, rotate_back, scale, single, sub, unit};
use super::{Environment, Map, Product, ggx, lambert, product_config, query};
use glam::Vec3;
use wis::ffi::wavelets::product::ProductConfig;
use wis::sphere::square;
use wis::wavelets::query::{Lobe, Query};

/// Rough to sharp, and a mixture.
pub fn lobes() -> [(&'static str, Vec<Lobe>); 6] {
    let diffuse = Lobe { weight: [0.8, 0.5, 0.2], ..lambert(0.0) };
    let mix = vec![diffuse, Lobe { weight: [0.4; 3], ..ggx(0.1) }];
    [
        ("Lambert", vec![lambert(0.8)]),
        ("GGX .5", vec![ggx(0.5)]),
        ("GGX .2", vec![ggx(0.2)]),
        ("GGX .05", vec![ggx(0.05)]),
        ("GGX .01", vec![ggx(0.01)]),
        ("mix", mix),
    ]
}

/// Normals and views about the brightest direction of a world: it stands in the mirror direction; apart from it;
/// close above the horizon; in the mirror direction of a grazing view.
pub fn views(key: V3) -> [(&'static str, V3, V3); 4] {
    let side = unit(cross(key, if key[2].abs() < 0.9 { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] }));
    let up = cross(side, key);
    let tilted = |along_key: f64, along_side: f64, along_up: f64| {
        unit(add(scale(key, along_key), add(scale(side, along_side), scale(up, along_up))))
    };
    let mirrored = |n: V3| sub(scale(n, 2.0 * dot(n, key)), key);
    let (facing, apart, low, grazed) =
        (tilted(0.8, 0.5, 0.3), tilted(0.5, -0.3, 0.8), tilted(0.05, 0.6, -0.8), tilted(0.1, 0.7, 0.7));
    [
        ("mirrored", facing, mirrored(facing)),
        ("apart", apart, unit(add(apart, scale(side, 0.8)))),
        ("low", low, unit(add(low, scale(side, -0.4)))),
        ("grazing", grazed, mirrored(grazed)),
    ]
}

/// A shading point of the grid, and the matrix that turns the map.
pub struct ShadingPoint {
    pub name: String,
    pub query: Query,
    pub world_from_map: [f32; 9],
}

impl ShadingPoint {
    pub fn prepare<'a>(&self, environment: &'a Environment) -> Product<'a> {
        let world_from_map = self.world_from_map.as_ptr();
        environment.prepare(&self.query, &ProductConfig { world_from_map, ..product_config() })
    }

    /// What a client evaluates there.
    pub fn scene<'a>(&self, map: &'a Map, filter: Filter) -> Scene<'a> {
        Scene { map, filter, world_from_map: self.world_from_map, material: Material::new(&self.query) }
    }

    /// The direction of world space for one of map space.
    pub fn world(&self, map: V3) -> [f32; 3] {
        single(rotate(&self.world_from_map, map))
    }

    /// The point of the square for a direction of world space.
    pub fn square(&self, wi: [f32; 3]) -> [f32; 2] {
        square(Vec3::from_array(single(rotate_back(&self.world_from_map, wi.map(f64::from)))))
    }
}

/// Points that [`grid`] gives.
pub const GRID: usize = 24;

/// Every lobe in every view under a map; the matrices take turns.
pub fn grid(map: &Map) -> Vec<ShadingPoint> {
    let mut grid = Vec::new();
    for (lobe, lobes) in lobes() {
        for view in 0..4 {
            let world_from_map = matrices()[grid.len() % 3];
            let (name, normal, wo) = views(rotate(&world_from_map, map.key()))[view];
            let query = query(single(normal), single(wo), &lobes);
            grid.push(ShadingPoint { name: format!("{lobe}, {name}"), query, world_from_map });
        }
    }
    grid
}

/// Rotations and a reflection of the world against the map, row-major.
pub fn matrices() -> [[f32; 9]; 3] {
    let identity = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let turned = rows(unit([1.0, 2.0, -0.5]), unit([0.3, -1.0, 2.0]), 1.0);
    let reflected = rows(unit([-0.7, 0.2, 1.0]), unit([1.0, 1.0, 0.1]), -1.0);
    [identity, turned, reflected]
}

/// The orthonormal matrix with the first row `a`, the second in the plane of `a` and `b`, and this determinant.
pub fn rows(a: V3, b: V3, determinant: f64) -> [f32; 9] {
    let second = unit(sub(b, scale(a, dot(a, b))));
    let third = scale(cross(a, second), determinant);
    let all: Vec<f32> = [a, second, third].into_iter().flatten().map(|c| c as f32).collect();
    all.try_into().unwrap()
}
