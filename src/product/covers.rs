//! Whether a product may serve another hit of the same environment: how well it fits, never whether results are right on average.

use super::peak::width;
use super::stored::{Header, flags};
use crate::brdf::material::Shape;
use crate::brdf::point::Point;
use crate::brdf::surface::shares;
use crate::numeric::min;
use crate::sphere::unit;

/// Widths of lobes may differ by this factor.
const WIDTHS: f32 = 1.5;
/// Normals and views may differ by this share of the narrowest lobe's width (rule 26): what it mirrors then stays in that lobe.
const REACH: f32 = 0.5;
/// And by so much at the most, in radians.
const FARTHEST: f32 = 0.1;
/// Lobes of at least this width hardly depend on the view.
const DIFFUSE: f32 = 0.7;
/// A lobe's share of what a hit scatters may be this many times its share at the product. Weights grow by as much.
const SHARES: f32 = 1.25;

impl Header {
    /// Whether a hit's normal lies within the cone, its lobes are of the same kinds and about as wide, none has a much larger share of
    /// what is scattered than at the product, and it is seen from about the same side.
    pub fn covers(&self, point: &Point<'_>) -> bool {
        let flags = flags(point.whole_sphere || point.material.transmits(), point.cosine_included);
        let lobes = point.material.lobes();
        if flags != self.flags || lobes.len() != self.lobes as usize {
            return false;
        }
        let (Some(normal), Some(wo)) = (unit(point.normal), unit(point.wo)) else { return false };
        let (own_normal, own_wo) = (glam::Vec3::from_array(self.normal), glam::Vec3::from_array(self.wo));
        /// The hit that the product was prepared for is covered, whatever rounding does.
        const ROUNDING: f32 = 1e-6;
        if normal.dot(own_normal) < self.cone - ROUNDING {
            return false;
        }
        // As the product was seen: the normal and the view are compared by themselves.
        let [.., cosine] = self.local_wo;
        let mut narrowest = f32::MAX;
        let parameters = point.weight.iter().zip(shares(point, cosine));
        for ((shape, (weight, share)), own) in lobes.iter().zip(parameters).zip(&self.lobe) {
            if shape.kind.code() != own.kind || shape.eta != own.eta {
                return false;
            }
            if !weight.iter().any(|&w| w > 0.0) {
                continue;
            }
            let served = !(cosine > 0.0) || own.scattered > 0.0 && share <= SHARES * own.scattered;
            if !served || !alike(shape, &Shape { kind: shape.kind, a: own.a, b: own.b, eta: own.eta }) {
                return false;
            }
            narrowest = min(narrowest, width(shape, 1.0));
        }
        let reach = min(REACH * narrowest, FARTHEST) + ROUNDING;
        let near = |a: glam::Vec3, b: glam::Vec3| (a - b).length_squared() <= reach * reach;
        near(normal, own_normal) && (narrowest >= DIFFUSE || near(wo, own_wo))
    }
}

/// Whether two lobes of a kind are about as wide, along each axis.
fn alike(a: &Shape, b: &Shape) -> bool {
    let near = |x: f32, y: f32| x <= WIDTHS * y && y <= WIDTHS * x;
    if a.kind.is_ggx() { near(a.a, b.a) && near(a.b, b.b) } else { near(width(a, 1.0), width(b, 1.0)) }
}
