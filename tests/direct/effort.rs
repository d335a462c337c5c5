//! How many candidates a point has: fewer for each ray where there are many, and never more than a sampler has room for.

use super::client::{self, Client};
use crate::support::Random;
use wis::brdf::material::Shape;
use wis::brdf::surface::Surface;
use wis::direct::candidates::Counts;
use wis::direct::effort::Effort;
use wis::sphere::Frame;

fn surface(shapes: &[Shape]) -> Surface {
    let client = Client::new(shapes, client::lambert);
    Surface::new(&client.point(), &Frame::IDENTITY).unwrap()
}

fn plain(rays: usize) -> Effort {
    Effort { rays, wanted: 0, compensated: false, targeted: false, portals: false, dark: false }
}

fn counts(rays: usize, wanted: usize, shape: Shape) -> Counts {
    Effort { wanted, ..plain(rays) }.counts(&surface(&[shape]))
}

/// One ray of a lobe has 8 of each source, 16 or 32, by its width. More rays have 8 each up to 16 of them; of a diffuse lobe half as many.
#[test]
fn many_rays_have_fewer_candidates_each() {
    for (shape, one) in
        [(Shape::LAMBERT, 8), (Shape::ggx(0.5, 0.5), 8), (Shape::ggx(0.1, 0.3), 32), (Shape::ggx(0.5, 0.05), 32)]
    {
        for (rays, each) in [(1, one), (2, 16), (4, 32), (8, 64), (9, 64), (17, 128), (64, 256)] {
            let each = if shape == Shape::LAMBERT && (2..=8).contains(&rays) { each / 2 } else { each };
            assert_eq!(counts(rays, 0, shape), Counts { light: each, lobes: each, portals: 0 }, "{shape:?}, {rays}");
        }
    }
}

#[test]
fn a_number_of_the_clients_is_rounded_up_to_a_power_of_two() {
    for (rays, wanted, each) in [(1, 1, 8), (1, 16, 8), (1, 32, 16), (1, 33, 32), (3, 16, 32), (4, 256, 512)] {
        assert_eq!(
            counts(rays, wanted, Shape::ggx(0.05, 0.05)),
            Counts { light: each, lobes: each, portals: 0 },
            "{rays} {wanted}"
        );
    }
}

/// Where earlier passes saw little, the library takes fewer; the client's own number stays, and so do the lamps' of the compensated light.
#[test]
fn dark_places_have_fewer_candidates() {
    let surface = surface(&[Shape::ggx(0.1, 0.1)]);
    let of = |effort: Effort| [false, true].map(|dark| Effort { dark, ..effort }.counts(&surface).light);
    assert_eq!(of(plain(1)), [32, 8]);
    assert_eq!(of(plain(4)), [32, 16]);
    assert_eq!(of(Effort { wanted: 16, ..plain(4) }), [32, 32]);
    assert_eq!(of(Effort { compensated: true, ..plain(4) }), [8, 8]);
}

/// Sources are powers of two and whole lanes, and fit into the room of a sampler for as many rays or more.
#[test]
fn candidates_fit_into_the_room() {
    let mut random = Random(17);
    let shapes = [Shape::LAMBERT, Shape::ggx(0.5, 0.5), Shape::ggx(0.2, 0.05), Shape::ggx(0.01, 0.01)];
    for _ in 0..4000 {
        let bits = random.bits();
        let most = 1 + ((bits as usize % 4096) >> ((bits >> 40) % 12));
        let wanted = ((bits >> 20) as usize % 257) >> ((bits >> 50) % 9);
        let rays = 1 + (bits >> 32) as usize % most;
        let [compensated, targeted, portals, dark] = [60, 61, 62, 63].map(|bit| bits >> bit & 1 == 1);
        let counts = Effort { rays, wanted, compensated, targeted, portals, dark }
            .counts(&surface(&shapes[(bits >> 56) as usize % 4..][..1]));
        let room = Effort { wanted, ..plain(most) }.most();
        assert!(counts.sum() <= room, "{rays} of {most} rays, {wanted}: {counts:?} in {room}");
        assert!(
            [counts.light, counts.lobes, counts.portals].iter().all(|&n| n == 0 || n >= 8 && n.is_power_of_two()),
            "{counts:?}"
        );
    }
}
