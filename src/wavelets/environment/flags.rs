//! What a configuration says in numbers, in Rust and in C.

/// Every cell is stored: 16 bytes for four cells, and a third more for the coarser levels. If the resolution is left
/// to the library and WIS_WAVELET_LIGHT_NEAREST is set, cells in which light varies much (a sun, the edge of a lamp) are
/// divided further, down to 16384 along each side: 24 bytes a square, in as much room as cells / 8 or 4096 squares take.
pub const WIS_STORAGE_PYRAMID: u32 = 1;
/// A wavelet tree pruned to `error_budget`: 24 bytes for each square that is kept.
pub const WIS_STORAGE_SPARSE: u32 = 2;

/// The client looks texels up without filtering: importance is not spread to neighbouring texels.
pub const WIS_WAVELET_LIGHT_NEAREST: u32 = 1;
/// Black stays black, with density 0. Otherwise no cell is darker than 2^-16 of the mean.
pub const WIS_WAVELET_LIGHT_EXACT_ZERO: u32 = 2;
/// RGB averages are stored too, for wis_wavelet_product_estimate_rgb: 48 bytes for four cells, and a third more.
pub const WIS_WAVELET_LIGHT_RGB: u32 = 4;
/// Channels that are not finite are replaced instead of rejected: NaN and -Inf by 0, +Inf by 65504, the largest half float. Negative
/// channels always count as 0: clamp your look-up at 0.
pub const WIS_WAVELET_LIGHT_SANITISE: u32 = 8;

/// Every flag.
pub const ALL_FLAGS: u32 =
    WIS_WAVELET_LIGHT_NEAREST | WIS_WAVELET_LIGHT_EXACT_ZERO | WIS_WAVELET_LIGHT_RGB | WIS_WAVELET_LIGHT_SANITISE;
