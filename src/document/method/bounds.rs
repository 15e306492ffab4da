//! Settings that several methods have, with their bounds, and the number of points that they need.

use crate::document::limits::{Range, above, between, within};
use crate::document::outputs::{EstimateDocument, GridDocument, ViewDocument};

/// Range of the number of photons emitted per pass.
pub const PHOTONS_PER_PASS: Range = within(64.0, 16_777_216.0);
/// Range of the number of paths or rays per sensor and pass.
pub const SAMPLES_PER_SENSOR: Range = within(1.0, 65_536.0);
/// Range of the number of paths per pixel and pass.
pub const SAMPLES_PER_PIXEL: Range = within(1.0, 4_096.0);
/// Range of the gather radius of the first pass in metres.
pub const INITIAL_RADIUS_M: Range = above(0.0, 10_000.0);
/// Range of alpha, which determines how fast squared radii shrink.
pub const ALPHA: Range = between(0.0, 1.0);

/// Largest number of points for which a method keeps statistics from pass to pass: 16 bytes each, in a few copies.
pub const MOST_POINTS: u64 = 4_194_304;

/// A numeric setting: its name, its value if given, and its bounds.
pub struct Setting {
    /// Name of the field in the document.
    pub name: &'static str,
    /// Value that the document gives; `None` if the method derives it from the scene.
    pub value: Option<f64>,
    /// Range of valid values.
    pub range: Range,
}

/// Returns a setting with a value.
pub fn setting(name: &'static str, value: impl Into<f64>, range: Range) -> Setting {
    Setting { name, value: Some(value.into()), range }
}

/// Returns the setting `photons_per_pass` with the bounds of a method.
pub fn photons(value: u64, range: Range) -> Setting {
    // beyond 2^53 the nearest number, which is beyond every bound, too
    Setting { name: "photons_per_pass", value: Some(value as f64), range }
}

/// Returns a setting that a document may leave out, so that the method derives it from the scene.
pub fn optional(name: &'static str, value: Option<f64>, range: Range) -> Setting {
    Setting { name, value, range }
}

/// Returns the number of points of all grids: `per_cell` for each cell average, and one for each point.
pub fn points_of_grids(grids: &[GridDocument], per_cell: u32) -> u64 {
    let of = |grid: &GridDocument| {
        points(grid.counts(), if grid.estimate == EstimateDocument::CellAverage { per_cell } else { 1 })
    };
    grids.iter().map(of).fold(0, u64::saturating_add)
}

/// Returns the number of points of all views, `per_pixel` for each pixel.
pub fn points_of_views(views: &[ViewDocument], per_pixel: u32) -> u64 {
    views.iter().map(|view| points(view.size_px, per_pixel)).fold(0, u64::saturating_add)
}

fn points([a, b]: [impl Into<u64>; 2], each: u32) -> u64 {
    a.into().saturating_mul(b.into()).saturating_mul(u64::from(each))
}
