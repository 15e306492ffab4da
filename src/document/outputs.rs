//! Grids and views of a job document.

use std::collections::BTreeSet;
use std::ops::RangeInclusive;

use glam::DVec3;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::errors::Checks;
use super::hints;
use super::limits::{
    CELLS, COORDINATE_M, FIELD_OF_VIEW_DEG, MOST_GRID_CELLS, MOST_PIXELS, OUTPUT_NAME, OUTPUTS, PIXELS_OF_AN_EDGE,
    Range, below, within,
};
use super::schema::shapes::{CellCounts, PixelCounts, Vector};
use crate::scene::{EstimateKind, Grid, View};

/// A grid of horizontal sensors that face upward.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct GridDocument {
    /// Name of the grid, unique among the grids, used for the files of the result: 1 to 64 letters, digits, `.`, `_` or `-`,
    /// beginning with a letter or digit.
    #[schema(pattern = "^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]
    pub name: String,
    /// Height of the sensors above the floor in metres, >= 0 and below the ceiling.
    pub height_m: f64,
    /// Number of cells along x and y, each 1..1000, at most 100000 in all.
    #[schema(value_type = CellCounts)]
    pub cells: [u32; 2],
    /// Distance in metres of the grid's edges from the walls, >= 0 and less than half the room's shorter edge; default: 0.
    #[serde(default)]
    pub margin_m: f64,
    /// Quantity that each sensor gives, `point` or `cell_average`; default: `point`.
    #[serde(default)]
    pub estimate: EstimateDocument,
    /// Reports the illuminance also by source, direct and interreflected, and by tube; each part is then computed separately.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub components: bool,
    /// Reports also the illuminance of each sensor per lumen of each of the 24 patches of every opening. With these, another sky,
    /// hour or tube above the openings can be computed without tracing the room again. Below mixed and measured diffusers they
    /// cover only the light that leaves as from a Lambertian surface (`into_room_evenly` of the tubes); the rest is only in the
    /// grid's own values.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub responses: bool,
}

/// Quantity that a sensor gives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum EstimateDocument {
    /// Illuminance at the cell's centre.
    #[default]
    Point,
    /// Mean illuminance over the cell.
    CellAverage,
}

impl From<EstimateDocument> for EstimateKind {
    fn from(estimate: EstimateDocument) -> Self {
        match estimate {
            EstimateDocument::Point => Self::Point,
            EstimateDocument::CellAverage => Self::CellAverage,
        }
    }
}

impl From<EstimateKind> for EstimateDocument {
    fn from(estimate: EstimateKind) -> Self {
        match estimate {
            EstimateKind::Point => Self::Point,
            EstimateKind::CellAverage => Self::CellAverage,
        }
    }
}

/// A perspective view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ViewDocument {
    /// Name of the view, unique among the views, used for the files of the result: 1 to 64 letters, digits, `.`, `_` or `-`,
    /// beginning with a letter or digit.
    #[schema(pattern = "^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]
    pub name: String,
    /// Position of the camera in metres, outside all solids.
    #[schema(value_type = Vector)]
    pub eye_m: [f64; 3],
    /// Point in metres that the camera looks at; differs from `eye_m`.
    #[schema(value_type = Vector)]
    pub look_at_m: [f64; 3],
    /// Upward direction of the picture, not parallel to the viewing direction; default: `[0, 0, 1]`.
    #[serde(default = "default_up")]
    #[schema(value_type = Vector)]
    pub up: [f64; 3],
    /// Angle in degrees between the lower and the upper edge of the picture, above 0 and below 179; default: 60.
    #[serde(default = "default_fov")]
    pub vertical_fov_deg: f64,
    /// Width and height in pixels, each 1..8192, at most 16777216 pixels in all; default: 512 x 512.
    #[serde(default = "default_size")]
    #[schema(value_type = PixelCounts)]
    pub size_px: [u32; 2],
}

fn default_up() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

fn default_fov() -> f64 {
    60.0
}

fn default_size() -> [u32; 2] {
    [512, 512]
}

impl GridDocument {
    /// Returns the grid above a floor of `width` times `depth` metres.
    pub fn grid(&self, [width, depth]: [f64; 2]) -> Grid {
        let cells = self.cells.map(|cells| cells as usize);
        let name = self.name.clone();
        let grid = Grid::new(name, self.height_m, cells, self.margin_m, [width, depth], self.estimate.into());
        Grid { components: self.components, responses: self.responses, ..grid }
    }
}

impl ViewDocument {
    /// Returns the camera; `None` if its vectors do not span a picture.
    pub fn view(&self) -> Option<View> {
        View::new(
            self.name.clone(),
            DVec3::from(self.eye_m),
            DVec3::from(self.look_at_m),
            DVec3::from(self.up),
            self.vertical_fov_deg.to_radians(),
            self.size_px.map(|size| size as usize),
        )
    }
}

/// Checks all grids and views; `room_size_m` is `None` if the room's size was refused.
pub(crate) fn check_outputs(
    grids: &[GridDocument],
    views: &[ViewDocument],
    room_size_m: Option<[f64; 3]>,
    checks: &mut Checks,
) {
    if grids.is_empty() && views.is_empty() {
        checks.refuse("/grids", "`grids` or `views` must name at least one output");
    }
    let judged = *OUTPUTS.end();
    let mut names = BTreeSet::new();
    for (index, grid) in grids.iter().enumerate().take(judged) {
        let pointer = format!("/grids/{index}");
        check_name(&pointer, &grid.name, &mut names, checks);
        check_grid(&pointer, grid, room_size_m, checks);
    }
    let in_parts = grids.iter().any(|grid| grid.components);
    if let Some(index) = grids.iter().position(|grid| grid.responses).filter(|_| in_parts) {
        checks.refuse(
            format!("/grids/{index}/responses"),
            "must be false if a grid of the same job has `components`: use two jobs",
        );
    }
    names.clear();
    for (index, view) in views.iter().enumerate().take(judged) {
        let pointer = format!("/views/{index}");
        check_name(&pointer, &view.name, &mut names, checks);
        check_view(&pointer, view, checks);
    }
    checks.at_most("/grids", grids.len(), &OUTPUTS, "");
    checks.at_most("/views", views.len(), &OUTPUTS, "");
}

/// Returns the range of the whole numbers within `bounds`.
fn whole(bounds: &RangeInclusive<u32>) -> Range {
    within((*bounds.start()).into(), (*bounds.end()).into())
}

/// Checks a name that becomes a file name: it must not leave its folder, be hidden, or equal another one.
fn check_name<'a>(pointer: &str, name: &'a str, names: &mut BTreeSet<&'a str>, checks: &mut Checks) {
    let pointer = format!("{pointer}/name");
    let starts_well = name.starts_with(|c: char| c.is_ascii_alphanumeric());
    let all_well = name.chars().all(|c| c.is_ascii_alphanumeric() || "._-".contains(c));
    if !starts_well || !all_well || name.len() > *OUTPUT_NAME.end() {
        let (least, most) = (OUTPUT_NAME.start(), OUTPUT_NAME.end());
        let letters = "letters, digits, `.`, `_` or `-`, and begin with a letter or digit";
        checks.refuse(pointer, format!("must have {least}..{most} {letters}, but is {name:?}"));
    } else if !names.insert(name) {
        checks.refuse(pointer, format!("must be unique, but {name:?} is used before"));
    }
}

fn check_grid(pointer: &str, grid: &GridDocument, room_size_m: Option<[f64; 3]>, checks: &mut Checks) {
    let ok = checks.numbers(&format!("{pointer}/cells"), &grid.cells, whole(&CELLS));
    let cells = u64::from(grid.cells[0]) * u64::from(grid.cells[1]);
    if ok && cells > MOST_GRID_CELLS {
        checks.refuse(format!("{pointer}/cells"), format!("at most {MOST_GRID_CELLS} cells, but there are {cells}"));
    }
    let [width, depth, ceiling] = room_size_m.unwrap_or([f64::MAX; 3]);
    let heights = below(0.0, ceiling);
    if !heights.contains(grid.height_m) {
        let pointer = format!("{pointer}/height_m");
        let hint = hints::of_number(&pointer, grid.height_m, |meant| heights.contains(meant));
        let detail = format!("must be >= 0 and below the ceiling ({ceiling} m), but is {}{hint}", grid.height_m);
        checks.refuse(pointer, detail);
    }
    let widest = 0.5 * width.min(depth);
    let margins = below(0.0, widest);
    if !margins.contains(grid.margin_m) {
        let pointer = format!("{pointer}/margin_m");
        let hint = hints::of_number(&pointer, grid.margin_m, |meant| margins.contains(meant));
        let detail =
            format!("must be >= 0 and < {widest} m (half the room's shorter edge), but is {}{hint}", grid.margin_m);
        checks.refuse(pointer, detail);
    }
}

fn check_view(pointer: &str, view: &ViewDocument, checks: &mut Checks) {
    let mut ok = checks.numbers(&format!("{pointer}/size_px"), &view.size_px, whole(&PIXELS_OF_AN_EDGE));
    let pixels = u64::from(view.size_px[0]) * u64::from(view.size_px[1]);
    if ok && pixels > MOST_PIXELS {
        checks.refuse(format!("{pointer}/size_px"), format!("at most {MOST_PIXELS} pixels, but there are {pixels}"));
    }
    let fov = view.vertical_fov_deg;
    ok &= checks.number(&format!("{pointer}/vertical_fov_deg"), fov, FIELD_OF_VIEW_DEG);
    for (name, vector) in [("eye_m", view.eye_m), ("look_at_m", view.look_at_m), ("up", view.up)] {
        ok &= checks.numbers(&format!("{pointer}/{name}"), &vector, COORDINATE_M);
    }
    if !ok {
        return;
    }
    let (eye, look_at, up) = (DVec3::from(view.eye_m), DVec3::from(view.look_at_m), DVec3::from(view.up));
    if (look_at - eye).try_normalize().is_none() {
        checks.refuse(format!("{pointer}/look_at_m"), "must differ from `eye_m`");
    } else if up.try_normalize().is_none() {
        checks.refuse(format!("{pointer}/up"), "must not be zero");
    } else if view.view().is_none() {
        checks.refuse(format!("{pointer}/up"), "must not be parallel to the viewing direction");
    }
}
