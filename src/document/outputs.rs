//! Grids and views of a job document.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use glam::DVec3;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::errors::{Checks, FieldError};
use super::hints;
use super::limits::{
    CELLS, COORDINATE_M, FIELD_OF_VIEW_DEG, MOST_GRID_CELLS, MOST_PIXELS, OUTPUT_NAME, OUTPUTS, PIXELS_OF_AN_EDGE,
    POINTS, Range, SPACING_M, TARGET_LUX, below, within,
};
use super::schema::shapes::{CellCounts, PixelCounts, SensorPlace, Vector};
use crate::scene::{Enclosure, EstimateKind, Grid, Responses, Sensor, View};

/// A grid of horizontal sensors that face upward, in `cells` or at a spacing; or sensors at given points that face any direction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct GridDocument {
    /// Name of the grid, unique among the grids, used for the files of the result: 1 to 64 letters, digits, `.`, `_` or `-`,
    /// beginning with a letter or digit; not that of a file of another grid, as `a.csv` beside `a`.
    #[schema(pattern = "^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]
    pub name: String,
    /// Level from which `height_m` is measured: that of the floor, the only one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub on: Option<GridLevel>,
    /// Height of the sensors above the floor in metres, >= 0 and below the ceiling; required but with `points_m`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height_m: Option<f64>,
    /// Number of cells along x and y of the plan's extent, each 1..1000, at most 100000 in all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<CellCounts>)]
    pub cells: Option<[u32; 2]>,
    /// Side of square cells in metres, in place of `cells`: a lattice from the least corner of the plan's extent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spacing_m: Option<f64>,
    /// Sensors at any points, in place of `cells`: x, y and z in metres, and the direction that the sensor faces, of any length.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Vec<SensorPlace>>)]
    pub points_m: Option<Vec<[f64; 6]>>,
    /// Distance in metres from the walls, >= 0 and less than half the room's shorter edge: of the grid's edges, and of all sensors
    /// where the plan is no rectangle or a spacing is given; default: 0.
    #[serde(default)]
    pub margin_m: f64,
    /// Quantity that each sensor gives, `point` or `cell_average`; default: `point`.
    #[serde(default)]
    pub estimate: EstimateDocument,
    /// Reports the illuminance also by source, direct and interreflected, and by tube; each part is then computed separately. No grid of the
    /// same job may have `responses` then.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub components: bool,
    /// Reports also the illuminance of each sensor per lumen of each of the 24 patches of every opening. With these, another sky,
    /// hour or tube above the openings can be computed without tracing the room again. Below mixed and measured diffusers they
    /// cover only the light that leaves as from a Lambertian surface (`into_room_evenly` of the tubes); the rest is only in the
    /// grid's own values. No grid of the same job may have `components` then.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub responses: bool,
    /// Illuminance in lux, > 0, that the mean of the grid should reach; statistics and reports tell whether it does. With `annual`
    /// it is one of the illuminances of the daylight autonomies, too, and reports tell whether the grid has it in `sda.time_percent` of the
    /// occupied hours, averaged over the area.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target_lux: Option<f64>,
}

/// Level from which heights of sensors are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum GridLevel {
    /// Level of the floor, or of its lowest point.
    Floor,
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
    /// beginning with a letter or digit; not that of a file of another view, as `a.csv` beside `a`.
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
    /// Returns the grid in a room.
    pub fn grid(&self, room: &Enclosure) -> Grid {
        let (name, estimate) = (self.name.clone(), self.estimate.into());
        let [low, high] = room.bounds().map(DVec3::truncate);
        let height_m = self.height_m.unwrap_or_default();
        let grid = match (&self.points_m, self.spacing_m, self.cells) {
            (Some(points), _, _) => Grid::points(name, points.iter().map(sensor).collect()),
            (None, Some(spacing), _) => {
                let cells = self.columns_and_rows(room).map(|count| count as usize);
                let grid = Grid::lattice(name, height_m, cells, low.to_array(), [spacing; 2], estimate);
                Grid { from_walls_m: self.margin_m, ..grid }
            }
            (None, None, cells) => {
                let cells = cells.unwrap_or([1; 2]).map(|cells| cells as usize);
                let corner = (low + self.margin_m).to_array();
                let size = [0, 1].map(|axis| ((high - low)[axis] - 2.0 * self.margin_m) / cells[axis] as f64);
                let from_walls_m = if room.as_box().is_some() { 0.0 } else { self.margin_m };
                Grid { from_walls_m, ..Grid::lattice(name, height_m, cells, corner, size, estimate) }
            }
        };
        let responses = if self.responses { Responses::ToPatches } else { Responses::None };
        Grid { components: self.components, responses, target_lux: self.target_lux, ..grid }
    }

    /// Returns the number of cells along x and y in a room.
    fn columns_and_rows(&self, room: &Enclosure) -> [u64; 2] {
        match self.spacing_m {
            Some(spacing) => {
                // a hair less, so that rounding adds no column
                let count = |extent: f64| (extent / spacing * (1.0 - 1e-9)).ceil().max(1.0) as u64;
                [count(room.extent().x), count(room.extent().y)]
            }
            None => self.counts(),
        }
    }

    /// Returns the grid with the number of cells that follows from its spacing in a room.
    pub(crate) fn with_counts(&self, room: &Enclosure) -> Self {
        let counts = || self.columns_and_rows(room).map(|count| u32::try_from(count).unwrap_or(u32::MAX));
        let cells = if self.spacing_m.is_some() { Some(counts()) } else { self.cells };
        Self { cells, points_m: self.points_m.clone(), name: self.name.clone(), ..*self }
    }

    /// Returns the number of columns and rows that the document states; points are one row.
    pub fn counts(&self) -> [u64; 2] {
        match &self.points_m {
            Some(points) => [points.len() as u64, 1],
            None => self.cells.unwrap_or([1; 2]).map(u64::from),
        }
    }
}

/// Returns the sensor of a point of a document; the direction of a valid one has a length.
fn sensor(&[x, y, z, across, along, up]: &[f64; 6]) -> Sensor {
    let normal = DVec3::new(across, along, up).normalize_or(DVec3::Z);
    Sensor { position: DVec3::new(x, y, z), normal }
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

/// Name of the grid of the patches of the room's faces in a scene; no grid of a document can have it.
pub const SURFACES: &str = "surfaces of the room";

/// Checks all grids and views; `room` is `None` if the room's faces were refused.
pub(crate) fn check_outputs(
    grids: &[GridDocument],
    views: &[ViewDocument],
    room: Option<&Enclosure>,
    checks: &mut Checks,
) {
    let judged = *OUTPUTS.end();
    let mut names = BTreeMap::new();
    for (index, grid) in grids.iter().enumerate().take(judged) {
        let pointer = format!("/grids/{index}");
        check_name(("grids", index), &grid.name, &mut names, checks);
        check_grid(&pointer, grid, room, checks);
    }
    let in_parts = grids.iter().any(|grid| grid.components);
    if let Some(index) = grids.iter().position(|grid| grid.responses).filter(|_| in_parts) {
        checks.refuse(
            format!("/grids/{index}/responses"),
            "must be false if a grid of the same job has `components`: use two jobs",
        );
    }
    check_file_names("grids", &names, checks);
    names.clear();
    for (index, view) in views.iter().enumerate().take(judged) {
        let pointer = format!("/views/{index}");
        check_name(("views", index), &view.name, &mut names, checks);
        check_view(&pointer, view, checks);
    }
    check_file_names("views", &names, checks);
    checks.at_most("/grids", grids.len(), &OUTPUTS, "");
    checks.at_most("/views", views.len(), &OUTPUTS, "");
}

/// Returns the range of the whole numbers within `bounds`.
fn whole(bounds: &RangeInclusive<u32>) -> Range {
    within((*bounds.start()).into(), (*bounds.end()).into())
}

/// Endings of the files of outputs.
pub const FILE_ENDINGS: [&str; 11] = ["json", "csv", "png", "svg", "pdf", "exr", "html", "npy", "ill", "glb", "txt"];

/// Refuses names that are those of files of other outputs, so that a path would mean two things: `a.csv` beside `a`.
fn check_file_names(outputs: &str, names: &BTreeMap<&str, usize>, checks: &mut Checks) {
    for (name, index) in names {
        let file = name.rsplit_once('.').filter(|(_, ending)| FILE_ENDINGS.contains(ending));
        if let Some((other, _)) = file.filter(|(other, _)| names.contains_key(other)) {
            let detail = format!("must not be that of a file of {other:?}, but is {name:?}");
            checks.refuse(format!("/{outputs}/{index}/name"), detail);
        }
    }
}

/// Checks a name that becomes a file name: it must not leave its folder, be hidden, or equal another one.
fn check_name<'a>(
    (outputs, index): (&str, usize),
    name: &'a str,
    names: &mut BTreeMap<&'a str, usize>,
    checks: &mut Checks,
) {
    let pointer = format!("/{outputs}/{index}/name");
    let starts_well = name.starts_with(|c: char| c.is_ascii_alphanumeric());
    let all_well = name.chars().all(|c| c.is_ascii_alphanumeric() || "._-".contains(c));
    if !starts_well || !all_well || name.len() > *OUTPUT_NAME.end() {
        let (least, most) = (OUTPUT_NAME.start(), OUTPUT_NAME.end());
        let letters = "letters, digits, `.`, `_` or `-`, and begin with a letter or digit";
        checks.refuse(pointer, format!("must have {least}..{most} {letters}, but is {name:?}"));
    } else if names.contains_key(name) {
        checks.refuse(pointer, format!("must be unique, but {name:?} is used before"));
    } else {
        names.insert(name, index);
    }
}

fn check_grid(pointer: &str, grid: &GridDocument, room: Option<&Enclosure>, checks: &mut Checks) {
    if let Some(target) = grid.target_lux {
        checks.number(&format!("{pointer}/target_lux"), target, TARGET_LUX);
    }
    let forms = [
        ("cells", grid.cells.is_some()),
        ("spacing_m", grid.spacing_m.is_some()),
        ("points_m", grid.points_m.is_some()),
    ];
    let mut given = forms.iter().filter(|(_, is_given)| *is_given).map(|(name, _)| *name);
    let Some(form) = given.next() else {
        checks.errors.push(FieldError::missing(format!("{pointer}/cells")));
        check_height(pointer, grid.height_m, room, checks);
        return;
    };
    for other in given {
        checks.refuse(format!("{pointer}/{other}"), format!("must be left out if `{form}` is given"));
    }
    if let Some(points) = &grid.points_m {
        check_points(pointer, grid, points, checks);
        return;
    }
    let cells_ok = grid.cells.is_none_or(|cells| checks.numbers(&format!("{pointer}/cells"), &cells, whole(&CELLS)));
    let spacing_ok =
        grid.spacing_m.is_none_or(|spacing| checks.number(&format!("{pointer}/spacing_m"), spacing, SPACING_M));
    if let (true, true, Some(room)) = (cells_ok, spacing_ok, room) {
        let counts = grid.columns_and_rows(room);
        let (cells, most) = (counts[0].saturating_mul(counts[1]), u64::from(*CELLS.end()));
        let detail = match counts.iter().max() {
            Some(along) if *along > most => format!("at most {most} cells along an axis, but there are {along}"),
            _ if cells > MOST_GRID_CELLS => format!("at most {MOST_GRID_CELLS} cells, but there are {cells}"),
            _ => String::new(),
        };
        if !detail.is_empty() {
            checks.refuse(format!("{pointer}/{form}"), detail);
        }
    }
    let extent = room.map_or(DVec3::splat(f64::MAX), Enclosure::extent);
    check_height(pointer, grid.height_m, room, checks);
    let [width, depth] = extent.truncate().to_array();
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

/// Checks that the height of a grid is given, and that a level plane at it meets the room.
fn check_height(pointer: &str, height_m: Option<f64>, room: Option<&Enclosure>, checks: &mut Checks) {
    let pointer = format!("{pointer}/height_m");
    let Some(height_m) = height_m else {
        checks.errors.push(FieldError::missing(pointer));
        return;
    };
    let ceiling = room.map_or(f64::MAX, |room| room.bounds()[1].z);
    let heights = below(0.0, ceiling);
    if !heights.contains(height_m) {
        let hint = hints::of_number(&pointer, height_m, |meant| heights.contains(meant));
        let detail = format!("must be >= 0 and below the ceiling ({ceiling} m), but is {height_m}{hint}");
        checks.refuse(pointer, detail);
    }
}

/// Checks sensors at given points, and that no field of other grids is given with them.
fn check_points(pointer: &str, grid: &GridDocument, points: &[[f64; 6]], checks: &mut Checks) {
    if !POINTS.contains(&points.len()) {
        let (least, most) = (POINTS.start(), POINTS.end());
        let detail = format!("must have {least}..{most} points, but has {}", points.len());
        checks.refuse(format!("{pointer}/points_m"), detail);
        return;
    }
    for (number, point) in points.iter().enumerate() {
        let pointer = format!("{pointer}/points_m/{number}");
        if checks.numbers(&pointer, point, COORDINATE_M) && DVec3::from_slice(&point[3..]).try_normalize().is_none() {
            checks.refuse(pointer, "the direction that the sensor faces, the last three numbers, must not be zero");
        }
    }
    let alien = [
        ("on", grid.on.is_some()),
        ("height_m", grid.height_m.is_some()),
        ("margin_m", grid.margin_m != 0.0),
        ("estimate", grid.estimate != EstimateDocument::Point),
    ];
    for (name, _) in alien.into_iter().filter(|(_, is_given)| *is_given) {
        checks.refuse(format!("{pointer}/{name}"), "must be left out if `points_m` is given");
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
