//! Instruments that use the release library as a client does: through its C header only.

pub mod batch;
pub mod client;
pub mod data;
pub mod dense;
pub mod directions;
pub mod embree;
pub mod estimator;
pub mod hardcases;
pub mod images;
pub mod lanes;
pub mod layout;
pub mod light;
pub mod material;
pub mod measure;
pub mod mesh;
pub mod plot;
pub mod points;
pub mod pool;
pub mod reference;
pub mod report;
pub mod rgl;
pub mod scene;
pub mod statistics;
pub mod structured;
pub mod texels;
pub mod visibility;
