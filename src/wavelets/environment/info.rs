//! What an environment says of itself.

use super::Header;

/// What was built.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct EnvironmentInfo {
    /// sizeof(wis_wavelet_light_info), set by the caller.
    pub size: u32,
    /// Cells along each side of the square.
    pub resolution: u32,
    /// WIS_STORAGE_*.
    pub storage: u32,
    /// WIS_WAVELET_LIGHT_*.
    pub flags: u32,
    /// Bytes of the environment: that much of the block is in use and needs to be saved.
    pub bytes: u64,
    /// Squares stored, each the averages of four children.
    pub squares: u64,
    /// Texels that were replaced.
    pub sanitised: u64,
    /// Tells environments apart: a hash of the bytes.
    pub content_id: u64,
    /// The integral of luminance over the sphere, in the units of the map times steradian.
    pub power: f64,
    /// Sparse storage: the variance that pruning added, relative.
    pub error: f64,
}

impl Header {
    /// What was built.
    pub fn info(&self) -> EnvironmentInfo {
        EnvironmentInfo {
            size: size_of::<EnvironmentInfo>() as u32,
            resolution: 1 << self.depth,
            storage: self.storage,
            flags: self.flags,
            bytes: self.bytes,
            squares: self.squares.into(),
            sanitised: self.sanitised,
            content_id: self.content_id,
            power: self.power,
            error: self.error,
        }
    }
}
