//! Direct light: rays with weights. Unbiased for every client, joint over the hits of a pixel, the same bits on every level.

mod below;
pub mod brdfs;
mod candidates;
mod client;
mod compare;
mod effort;
mod joint;
mod light;
mod picks;
mod portals;
mod rays;
mod samples;
mod shared;
mod target;
mod unbiased;
mod visibility;
mod wave;

use crate::support::Map;
use crate::support::maps::{sky, sun};

/// Light that is smooth, and light of which one disc of half a degree gives the most.
fn maps() -> [(&'static str, Map); 2] {
    [("sky", sky(64, 32)), ("sun", sun(512, 256).reduced(8))]
}
