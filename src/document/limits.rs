//! Every bound of a job document, once: checks refuse by it, and the schema tells it.
//!
//! What bounds depend on other fields, such as the height of the ceiling, is written in the check; here is the widest that
//! they can be. The settings of methods have their bounds beside them (`document/method`).

use std::fmt;
use std::ops::{Bound, RangeBounds, RangeInclusive};

/// Numbers from one to another; either end may be left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Lower end.
    pub lowest: Bound<f64>,
    /// Upper end.
    pub highest: Bound<f64>,
}

/// Range with both ends included.
pub const fn within(lowest: f64, highest: f64) -> Range {
    Range { lowest: Bound::Included(lowest), highest: Bound::Included(highest) }
}

/// `bound` itself is too small.
pub const fn above(bound: f64, highest: f64) -> Range {
    Range { lowest: Bound::Excluded(bound), highest: Bound::Included(highest) }
}

/// `bound` itself is too large.
pub const fn below(lowest: f64, bound: f64) -> Range {
    Range { lowest: Bound::Included(lowest), highest: Bound::Excluded(bound) }
}

/// Range with both ends excluded.
pub const fn between(lowest: f64, highest: f64) -> Range {
    Range { lowest: Bound::Excluded(lowest), highest: Bound::Excluded(highest) }
}

impl Range {
    /// True if the range has the number; no range has NaN.
    pub fn contains(self, value: f64) -> bool {
        (self.lowest, self.highest).contains(&value)
    }
}

/// Words for the range after "must be" in an error.
impl fmt::Display for Range {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        if let (Bound::Included(lowest), Bound::Included(highest)) = (self.lowest, self.highest) {
            return write!(formatter, "within {lowest}..{highest}");
        }
        let ends = [
            match self.lowest {
                Bound::Included(lowest) => format!(">= {lowest}"),
                Bound::Excluded(lowest) => format!("> {lowest}"),
                Bound::Unbounded => String::new(),
            },
            match self.highest {
                Bound::Included(highest) => format!("<= {highest}"),
                Bound::Excluded(highest) => format!("< {highest}"),
                Bound::Unbounded => String::new(),
            },
        ];
        formatter.write_str(&ends.join(" and "))
    }
}

/// A bound of a field, as a schema tells it.
#[derive(Clone, Debug)]
pub enum Limit {
    /// Range of a number.
    Number(Range),
    /// Number of items of a list.
    Items(RangeInclusive<usize>),
    /// Number of characters of a text.
    Length(RangeInclusive<usize>),
    /// Number of fields of an object whose names are free.
    Fields(RangeInclusive<usize>),
}

/// A reflectance, a transmittance, or any other share of light.
pub const RATIO: Range = within(0.0, 1.0);
/// The reflectance of a surface in the room: with 1, light would never end.
pub const ALBEDO: Range = below(0.0, 1.0);
/// Luminances in cd/m2 and illuminances in lux. Nothing is brighter: the disc of the sun has 2e9 cd/m2, and no illuminance on
/// Earth comes near.
pub const LIGHT: Range = within(0.0, 1e9);
/// Angle of a turn, in degrees.
pub const TURN_DEG: Range = within(-360.0, 360.0);
/// Coordinate along one axis in metres: farther than any camera or object.
pub const COORDINATE_M: Range = within(-1e6, 1e6);
/// Place of a mesh's origin in metres: its coordinates may be eastings and northings of a survey.
pub const MESH_POSITION_M: Range = within(-1e8, 1e8);
/// Slack for corners that are meant to touch a wall, in metres.
pub const TOUCHING_M: f64 = 1e-9;

/// Number of characters of a job's name.
pub const JOB_NAME: RangeInclusive<usize> = 0..=1000;
/// Number of grids, and of views.
pub const OUTPUTS: RangeInclusive<usize> = 0..=64;
/// Number of tubes.
pub const TUBES: RangeInclusive<usize> = 0..=64;

/// Relative errors that a document may ask for.
pub const RELATIVE_ERROR: Range = above(0.0, 1.0);
/// Confidence of errors: below a half an interval would say less than its middle.
pub const CONFIDENCE: Range = below(0.5, 1.0);
/// Number of passes of one job.
pub const PASSES: Range = within(1.0, 1e9);
/// Seconds of rendering that a document may ask for; a service may allow less.
pub const SECONDS: Range = above(0.0, 1e9);

/// Latitude, north positive.
pub const LATITUDE_DEG: Range = within(-90.0, 90.0);
/// Longitude, east positive.
pub const LONGITUDE_DEG: Range = within(-180.0, 180.0);
/// Height above sea level in metres: from below the shore of the Dead Sea to above Mount Everest.
pub const ELEVATION_M: Range = within(-500.0, 9000.0);
/// Years for which the difference of terrestrial and universal time is known: it is needed for the sun's position.
pub const YEAR: Range = within(-500.0, 2999.0);
/// The 15 skies of CIE S 011 and the traditional overcast one.
pub const CIE_TYPE: Range = within(1.0, 16.0);
/// CIE types that have a turbidity.
pub const TURBID_TYPES: RangeInclusive<u8> = 7..=15;
/// Diffuse over extraterrestrial horizontal illuminance: more cannot come down than comes in.
pub const DIFFUSE_RATIO: Range = above(0.0, 1.0);
/// Luminous turbidity: the published fits end at 12.
pub const TURBIDITY: Range = above(0.0, 12.0);
/// Altitude of the sun; below the horizon it gives no light.
pub const ALTITUDE_DEG: Range = within(-90.0, 90.0);

/// Length of an edge of a room in metres: no interior is longer, and nearly every one in millimetres is.
pub const ROOM_EDGE_M: Range = within(0.01, 1000.0);
/// An edge of a box: what fits into the largest room.
pub const SIZE_M: Range = above(0.0, 1000.0);
/// Coordinate of a point in the plane of the ceiling, in metres.
pub const IN_PLANE_M: Range = within(0.0, 1000.0);
/// Number of objects in a room.
pub const OBJECTS: RangeInclusive<usize> = 0..=1000;
/// Number of luminaires in a room.
pub const LUMINAIRES: RangeInclusive<usize> = 0..=256;
/// Triangles of all objects of a room together, each copy counted.
pub const MOST_TRIANGLES: usize = 2_000_000;
/// Roughness of a surface; between 0 and [`crate::optics::glossy::LEAST_ROUGHNESS`] it is refused, too.
pub const ROUGHNESS: Range = within(0.0, 1.0);

/// Diameter of a tube in metres: wider than any is, and narrower than any in millimetres.
pub const DIAMETER_M: Range = above(0.0, 100.0);
/// Number of segments of a tube.
pub const SEGMENTS: RangeInclusive<usize> = 1..=16;
/// Length of one segment of a tube in metres: longer than any is, and shorter than any in millimetres.
pub const SEGMENT_LENGTH_M: Range = above(0.0, 100.0);
/// Lean of a segment from the vertical: a guide may turn back up, not far.
pub const TILT_DEG: Range = within(0.0, 135.0);
/// Number of characters of a mesh's id.
pub const MESH_ID: RangeInclusive<usize> = 1..=1024;
/// Number of materials of a mesh tube.
pub const PARTS: RangeInclusive<usize> = 1..=usize::MAX;
/// Refractive index of a dome: from air to beyond diamond.
pub const REFRACTIVE_INDEX: Range = within(1.0, 4.0);
/// Thickness of a dome's shell.
pub const THICKNESS_M: Range = above(0.0, 1.0);
/// Napierian absorption coefficient of a dome's material.
pub const ABSORPTION_PER_M: Range = within(0.0, 1e6);
/// Radius of a zone of a diffuser, where the tube's is not known.
pub const ZONE_RADIUS_M: Range = within(0.0, 50.0);

/// Angle of a row or column of a table, from the normal.
pub const TABLE_ANGLE_DEG: Range = within(0.0, 90.0);
/// Value of a table of scattering, in 1/sr.
pub const SCATTERING_PER_SR: Range = within(0.0, 1e9);
/// Number of angles of a mirror's table.
pub const MIRROR_ROWS: RangeInclusive<usize> = 2..=1000;
/// Number of angles of incidence of a measured diffuser: every quarter of a degree.
pub const INCIDENCES: RangeInclusive<usize> = 2..=361;
/// Number of angles of exit of a measured diffuser: every eighth of a degree.
pub const EXITS: RangeInclusive<usize> = 2..=721;

/// Number of characters of a grid's or a view's name.
pub const OUTPUT_NAME: RangeInclusive<usize> = 1..=64;
/// Height of a grid, where the room's is not known.
pub const GRID_HEIGHT_M: Range = within(0.0, 1000.0);
/// Margin of a grid, where the room's size is not known.
pub const MARGIN_M: Range = within(0.0, 500.0);
/// Number of cells along one axis of a grid.
pub const CELLS: RangeInclusive<u32> = 1..=1000;
/// Largest number of cells of one grid.
pub const MOST_GRID_CELLS: u64 = 100_000;
/// Number of pixels along one edge of a picture.
pub const PIXELS_OF_AN_EDGE: RangeInclusive<u32> = 1..=8192;
/// Largest number of pixels of one picture, 4096 x 4096.
pub const MOST_PIXELS: u64 = 16_777_216;
/// Angle between the edges of a picture: at 180 degrees its plane would be infinite.
pub const FIELD_OF_VIEW_DEG: Range = between(0.0, 179.0);

/// Skies of a request for the fluxes of a tube.
pub const SKIES: RangeInclusive<usize> = 1..=100;
/// Times of such a request.
pub const TIMES: RangeInclusive<usize> = 0..=1000;
/// Skies times times of such a request, at most: some kilobytes of its answer each. Its time is bounded apart.
pub const SKIES_TIMES_TIMES: usize = 5000;
/// Relative error that such a request may ask for: 512 passes of 1024 photons bring 0.1 % through most tubes.
pub const RELATIVE_FLUX_ERROR: Range = within(0.001, 0.5);

/// Bounds of the fields by component and field, for the schema.
pub const FIELDS: &[(&str, &str, Limit)] = &[
    ("JobDocument", "name", Limit::Length(JOB_NAME)),
    ("JobDocument", "tubes", Limit::Items(TUBES)),
    ("JobDocument", "grids", Limit::Items(OUTPUTS)),
    ("JobDocument", "views", Limit::Items(OUTPUTS)),
    ("TubeFluxDocument", "skies", Limit::Items(SKIES)),
    ("TubeFluxDocument", "times", Limit::Items(TIMES)),
    ("TubeFluxDocument", "relative_error", Limit::Number(RELATIVE_FLUX_ERROR)),
    ("StopDocument", "relative_error", Limit::Number(RELATIVE_ERROR)),
    ("StopDocument", "view_relative_error", Limit::Number(RELATIVE_ERROR)),
    ("StopDocument", "confidence", Limit::Number(CONFIDENCE)),
    ("StopDocument", "max_passes", Limit::Number(PASSES)),
    ("StopDocument", "max_seconds", Limit::Number(SECONDS)),
    ("LocationDocument", "latitude_deg", Limit::Number(LATITUDE_DEG)),
    ("LocationDocument", "longitude_deg", Limit::Number(LONGITUDE_DEG)),
    ("LocationDocument", "elevation_m", Limit::Number(ELEVATION_M)),
    ("SkyDocument", "cie_type", Limit::Number(CIE_TYPE)),
    ("SkyDocument", "zenith_luminance_cd_m2", Limit::Number(LIGHT)),
    ("SkyDocument", "diffuse_horizontal_illuminance_lux", Limit::Number(LIGHT)),
    ("SkyDocument", "dv_ev", Limit::Number(DIFFUSE_RATIO)),
    ("SkyDocument", "luminous_turbidity", Limit::Number(TURBIDITY)),
    ("SkyDocument", "direct_normal_illuminance_lux", Limit::Number(LIGHT)),
    ("SunPositionDocument", "altitude_deg", Limit::Number(ALTITUDE_DEG)),
    ("SunPositionDocument", "azimuth_deg", Limit::Number(TURN_DEG)),
    ("RoomDocument", "rotation_deg", Limit::Number(TURN_DEG)),
    ("RoomDocument", "objects", Limit::Items(OBJECTS)),
    ("RoomDocument", "luminaires", Limit::Items(LUMINAIRES)),
    ("SurfaceDocument", "roughness", Limit::Number(ROUGHNESS)),
    ("BoxObject", "rotation_deg", Limit::Number(TURN_DEG)),
    ("MeshObject", "rotation_deg", Limit::Number(TURN_DEG)),
    ("ParametricTube", "diameter_m", Limit::Number(DIAMETER_M)),
    ("ParametricTube", "segments", Limit::Items(SEGMENTS)),
    ("SegmentDocument", "length_m", Limit::Number(SEGMENT_LENGTH_M)),
    ("SegmentDocument", "tilt_deg", Limit::Number(TILT_DEG)),
    ("SegmentDocument", "azimuth_deg", Limit::Number(TURN_DEG)),
    ("MeshTubeDocument", "mesh", Limit::Length(MESH_ID)),
    ("MeshTubeDocument", "opening_diameter_m", Limit::Number(DIAMETER_M)),
    ("MeshTubeDocument", "rotation_deg", Limit::Number(TURN_DEG)),
    ("MeshTubeDocument", "parts", Limit::Fields(PARTS)),
    ("DielectricDomeCollector", "refractive_index", Limit::Number(REFRACTIVE_INDEX)),
    ("DielectricDomeCollector", "thickness_m", Limit::Number(THICKNESS_M)),
    ("DielectricDomeCollector", "absorption_per_m", Limit::Number(ABSORPTION_PER_M)),
    ("MixedDiffuser", "lambertian_radius_m", Limit::Number(ZONE_RADIUS_M)),
    ("MeasuredDiffuser", "incidence_deg", Limit::Items(INCIDENCES)),
    ("MeasuredDiffuser", "exit_deg", Limit::Items(EXITS)),
    ("MeasuredDiffuser", "btdf_per_sr", Limit::Items(INCIDENCES)),
    ("MeasuredDiffuser", "brdf_per_sr", Limit::Items(INCIDENCES)),
    ("MirrorTableDocument", "incidence_deg", Limit::Items(MIRROR_ROWS)),
    ("MirrorTableDocument", "reflectance", Limit::Items(MIRROR_ROWS)),
    ("GridDocument", "height_m", Limit::Number(GRID_HEIGHT_M)),
    ("GridDocument", "margin_m", Limit::Number(MARGIN_M)),
    ("ViewDocument", "vertical_fov_deg", Limit::Number(FIELD_OF_VIEW_DEG)),
];
