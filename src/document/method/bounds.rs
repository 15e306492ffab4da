//! Settings that several methods have: their bounds, and what they keep.

use crate::document::limits::{Range, above, between, within};
use crate::document::outputs::{EstimateDocument, GridDocument, ViewDocument};

/// Number of photons emitted per pass.
pub const PHOTONS_PER_PASS: Range = within(64.0, 16_777_216.0);
/// Paths per sensor and pass, or rays.
pub const SAMPLES_PER_SENSOR: Range = within(1.0, 65_536.0);
/// Number of paths per pixel and pass.
pub const SAMPLES_PER_PIXEL: Range = within(1.0, 4_096.0);
/// Gather radius of the first pass.
pub const INITIAL_RADIUS_M: Range = above(0.0, 10_000.0);
/// Rate at which squared radii shrink.
pub const ALPHA: Range = between(0.0, 1.0);

/// Largest number of points of which a method keeps statistics from pass to pass: 16 bytes each, in a few copies.
pub const MOST_POINTS: u64 = 4_194_304;

/// A setting that is a number: its name, its value, which may be left to the scene, and its bounds.
pub struct Setting {
    /// Name of the field in the document.
    pub name: &'static str,
    /// What the document asks for; `None`: the method takes it from the scene.
    pub value: Option<f64>,
    /// Values that are good.
    pub range: Range,
}

/// A setting with a value.
pub fn setting(name: &'static str, value: impl Into<f64>, range: Range) -> Setting {
    Setting { name, value: Some(value.into()), range }
}

/// The number of photons per pass, with the bounds of a method.
pub fn photons(value: u64, range: Range) -> Setting {
    // beyond 2^53 the nearest number, which is beyond every bound, too
    Setting { name: "photons_per_pass", value: Some(value as f64), range }
}

/// A setting without a default.
pub fn optional(name: &'static str, value: Option<f64>, range: Range) -> Setting {
    Setting { name, value, range }
}

/// Sensors of all grids, `per_cell` for a cell average.
pub fn points_of_grids(grids: &[GridDocument], per_cell: u32) -> u64 {
    let of = |grid: &GridDocument| {
        points(grid.cells, if grid.estimate == EstimateDocument::CellAverage { per_cell } else { 1 })
    };
    grids.iter().map(of).fold(0, u64::saturating_add)
}

/// Pixels of all views, `per_pixel` points each.
pub fn points_of_views(views: &[ViewDocument], per_pixel: u32) -> u64 {
    views.iter().map(|view| points(view.size_px, per_pixel)).fold(0, u64::saturating_add)
}

fn points([a, b]: [u32; 2], each: u32) -> u64 {
    (u64::from(a) * u64::from(b)).saturating_mul(u64::from(each))
}
