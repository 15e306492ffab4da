//! Bounds of the fields of a job document, each written once: the checks refuse values by it, and the schema states it.
//!
//! Bounds that depend on other fields, such as the height of the ceiling, are written in the checks; the widest possible ones are
//! here. The settings of methods have their bounds beside them (`document/method`).

use std::fmt;
use std::ops::{Bound, RangeBounds, RangeInclusive};

/// Range of numbers, whose ends may be included, excluded or absent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Lower end.
    pub lowest: Bound<f64>,
    /// Upper end.
    pub highest: Bound<f64>,
}

/// Returns the range with both ends included.
pub const fn within(lowest: f64, highest: f64) -> Range {
    Range { lowest: Bound::Included(lowest), highest: Bound::Included(highest) }
}

/// Returns the range above `bound`, which is excluded, up to `highest`, which is included.
pub const fn above(bound: f64, highest: f64) -> Range {
    Range { lowest: Bound::Excluded(bound), highest: Bound::Included(highest) }
}

/// Returns the range from `lowest`, which is included, up to `bound`, which is excluded.
pub const fn below(lowest: f64, bound: f64) -> Range {
    Range { lowest: Bound::Included(lowest), highest: Bound::Excluded(bound) }
}

/// Returns the range with both ends excluded.
pub const fn between(lowest: f64, highest: f64) -> Range {
    Range { lowest: Bound::Excluded(lowest), highest: Bound::Excluded(highest) }
}

impl Range {
    /// True if the number lies in the range; false for NaN.
    pub fn contains(self, value: f64) -> bool {
        (self.lowest, self.highest).contains(&value)
    }
}

/// Writes the range as it follows "must be" in an error.
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

/// Bound of a field, as a schema states it.
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

/// Range of a reflectance, a transmittance, or any other fraction of light.
pub const RATIO: Range = within(0.0, 1.0);
/// Range of the reflectance of a surface in the room; with 1 the light would never be absorbed.
pub const ALBEDO: Range = below(0.0, 1.0);
/// Range of luminances in cd/m2 and illuminances in lux. No luminance but that of the sun's disc (2e9 cd/m2), and no illuminance
/// on Earth, is above it.
pub const LIGHT: Range = within(0.0, 1e9);
/// Range of an angle of rotation in degrees.
pub const TURN_DEG: Range = within(-360.0, 360.0);
/// Range of the tilt of a pane from the horizontal in degrees.
pub const PANE_TILT_DEG: Range = within(0.0, 90.0);
/// Range of an azimuth of a horizon in degrees, clockwise from north.
pub const HORIZON_AZIMUTH_DEG: Range = within(0.0, 360.0);
/// Range of an azimuth of a horizon of PVGIS in degrees, clockwise from south.
pub const PVGIS_AZIMUTH_DEG: Range = within(-180.0, 180.0);
/// Range of an altitude of a horizon in degrees.
pub const HORIZON_ALTITUDE_DEG: Range = within(0.0, 90.0);
/// Number of points of a horizon: one for each degree, and 360 beside 0.
pub const HORIZON_POINTS: RangeInclusive<usize> = 1..=361;
/// Number of obstructions outdoors.
pub const OBSTRUCTIONS: RangeInclusive<usize> = 0..=64;
/// Range of an edge of a box outdoors in metres: up to that of a large hall or a ridge of hills.
pub const OBSTRUCTION_SIZE_M: Range = within(1e-3, 1e4);
/// Range of a coordinate along one axis in metres: beyond any camera or object.
pub const COORDINATE_M: Range = within(-1e6, 1e6);
/// Range of a coordinate of a mesh's origin in metres; wide enough for meshes with eastings and northings of a survey.
pub const MESH_POSITION_M: Range = within(-1e8, 1e8);
/// Range of a coordinate of the point of a file that is a mesh's origin, in the file's units; wide enough for a survey in millimetres.
pub const MESH_OFFSET: Range = within(-1e12, 1e12);
/// Range of the factor for the coordinates of a mesh; the longest unit of which files are known is a kilometre.
pub const MESH_SCALE: Range = within(1e-9, 1e6);
/// Number of copies of one mesh.
pub const INSTANCES: RangeInclusive<usize> = 1..=1024;
/// Largest number of copies of all meshes of a room: rays look at the bounds of all.
pub const MOST_INSTANCES: usize = 2048;
/// Tolerance in metres for corners that are meant to touch a wall.
pub const TOUCHING_M: f64 = 1e-9;
/// Distance in metres from the plane of a face within which the centre of an opening lies on it; it is moved into the plane.
pub const ON_FACE_M: f64 = 1e-3;

/// Number of characters of a job's name.
pub const JOB_NAME: RangeInclusive<usize> = 0..=1000;
/// Number of grids, and of views.
pub const OUTPUTS: RangeInclusive<usize> = 0..=64;
/// Number of tubes.
pub const TUBES: RangeInclusive<usize> = 0..=1024;

/// Range of the relative error that a document may ask for.
pub const RELATIVE_ERROR: Range = above(0.0, 1.0);
/// Range of the confidence of errors; an interval with a confidence below a half is of no use.
pub const CONFIDENCE: Range = below(0.5, 1.0);
/// Range of the number of passes of one job.
pub const PASSES: Range = within(1.0, 1e9);
/// Range of the render time in seconds that a document may ask for; a service may allow less.
pub const SECONDS: Range = above(0.0, 1e9);

/// Range of the latitude in degrees, north positive.
pub const LATITUDE_DEG: Range = within(-90.0, 90.0);
/// Range of the longitude in degrees, east positive.
pub const LONGITUDE_DEG: Range = within(-180.0, 180.0);
/// Range of the height above sea level in metres: from below the shore of the Dead Sea to above Mount Everest.
pub const ELEVATION_M: Range = within(-500.0, 9000.0);
/// Range of years for which the difference of terrestrial and universal time is known, which the sun's position depends on.
pub const YEAR: Range = within(-500.0, 2999.0);
/// Range of the number of a CIE sky type: the 15 skies of CIE S 011, and 16 for the traditional overcast sky.
pub const CIE_TYPE: Range = within(1.0, 16.0);
/// CIE sky types that have a turbidity.
pub const TURBID_TYPES: RangeInclusive<u8> = 7..=15;
/// Range of the ratio of diffuse to extraterrestrial horizontal illuminance; a sky cannot give more than what enters the
/// atmosphere.
pub const DIFFUSE_RATIO: Range = above(0.0, 1.0);
/// Range of the luminous turbidity; the published fits end at 12.
pub const TURBIDITY: Range = above(0.0, 12.0);
/// Range of direct normal irradiances in W/m2: more than the sun outside the atmosphere is kJ/m2, or another column.
pub const DIRECT_IRRADIANCE_W_M2: Range = within(0.0, 1450.0);
/// Range of diffuse horizontal irradiances in W/m2.
pub const DIFFUSE_IRRADIANCE_W_M2: Range = within(0.0, 1100.0);
/// Range of dew points in degrees Celsius.
pub const DEW_POINT_C: Range = within(-100.0, 50.0);
/// Range of the altitude of the sun in degrees; below the horizon it gives no light.
pub const ALTITUDE_DEG: Range = within(-90.0, 90.0);

/// Number of characters of the id or the path of a weather file.
pub const FILE_ID: RangeInclusive<usize> = 1..=1024;
/// Range of the minutes by which the sun of a weather file's record is later than its stamp.
pub const SUN_OFFSET_MINUTES: Range = within(-90.0, 60.0);
/// Range of the number of positions of the sun in an hour of a year.
pub const SUNS_PER_HOUR: Range = within(1.0, 12.0);
/// Number of weather files of a job.
pub const WEATHER_FILES: RangeInclusive<usize> = 1..=32;
/// Largest number of positions of the sun in the years of a job: some seconds.
pub const SUNS: usize = 1_000_000;
/// Largest number of sensors times records of a year.
pub const SENSORS_TIMES_RECORDS: usize = 20_000_000;
/// Largest number of sensors times records of all weather files of a job.
pub const SENSORS_TIMES_ALL_RECORDS: usize = 5 * SENSORS_TIMES_RECORDS;
/// Largest number of sensors times moments with light of a year below closures that let light pass with its direction.
pub const SENSORS_TIMES_MOMENTS: usize = 2_500_000;

/// Largest number of sensors that face about level times tubes, for glare ratings of a year.
pub const EYES_TIMES_TUBES: usize = 200_000;
/// Largest number of tubes times positions of the sun in the years of a job.
pub const TUBES_TIMES_MOMENTS: usize = 10_000_000;
/// Largest number of traced tubes that differ times moments with light in the years of a job.
pub const TRACED_TUBES_TIMES_MOMENTS: usize = 50_000;
/// Largest number of obstructions times tubes.
pub const OBSTRUCTIONS_TIMES_TUBES: usize = 4096;
/// Largest size of a weather file in bytes.
pub const WEATHER_BYTES: usize = 16 << 20;
/// Largest size of a file of a Honeybee model in bytes.
pub const MODEL_BYTES: usize = 32 << 20;
/// Largest size of an array of other daylight in bytes: numbers of 8 bytes, and a header.
pub const ARRAY_BYTES: usize = 8 * SENSORS_TIMES_RECORDS + (1 << 16);
/// Number of illuminances of daylight autonomies.
pub const THRESHOLDS: RangeInclusive<usize> = 1..=16;
/// Range of an illuminance in lux that a metric of a year compares with.
pub const THRESHOLD_LUX: Range = above(0.0, 1e6);
/// Range of a share in percent, above none.
pub const PERCENT: Range = above(0.0, 100.0);
/// Number of days of a weekly schedule.
pub const WEEKDAYS: RangeInclusive<usize> = 1..=7;
/// Range of the least fraction of its light to which a luminaire is dimmed.
pub const MINIMUM_LIGHT: Range = below(0.0, 1.0);
/// Range of the electric power of luminaires in W/m2.
pub const POWER_W_M2: Range = within(0.0, 1000.0);

/// Range of the length of a room's edge in metres: no interior is longer, while nearly every length in millimetres is.
pub const ROOM_EDGE_M: Range = within(0.01, 1000.0);
/// Number of corners of a polygon.
pub const CORNERS: RangeInclusive<usize> = 3..=256;
/// Largest number of corners of a plan, its holes included.
pub const MOST_CORNERS: usize = 2000;
/// Number of holes of a plan.
pub const HOLES: RangeInclusive<usize> = 0..=64;
/// Number of faces of a room that is given by them: a tetrahedron has the fewest.
pub const FACES: RangeInclusive<usize> = 4..=2000;
/// Number of characters of a face's name.
pub const FACE_NAME: RangeInclusive<usize> = 1..=100;
/// Number of partitions of a room.
pub const PARTITIONS: RangeInclusive<usize> = 0..=256;
/// Range of the height of a ceiling or a partition in metres.
pub const CEILING_HEIGHT_M: Range = within(0.01, 1000.0);
/// Range of the angle of a ceiling from the horizontal in degrees.
pub const PITCH_DEG: Range = within(0.0, 80.0);
/// Range of the length in metres by which an opening hangs below the ceiling.
pub const DROP_M: Range = below(0.0, 1000.0);
/// Range of the side of a grid's cells in metres.
pub const SPACING_M: Range = within(0.001, 1000.0);
/// Number of sensors of a grid at given points.
pub const POINTS: RangeInclusive<usize> = 1..=100_000;
/// Range of the length of a box's edge in metres, up to the longest edge of a room.
pub const SIZE_M: Range = above(0.0, 1000.0);
/// Number of objects in a room.
pub const OBJECTS: RangeInclusive<usize> = 0..=1000;
/// Number of luminaires in a room.
pub const LUMINAIRES: RangeInclusive<usize> = 0..=256;
/// Largest number of triangles of all mesh objects of a room together, each copy counted.
pub const MOST_TRIANGLES: usize = 2_000_000;
/// Range of the roughness of a surface; values between 0 and [`crate::optics::glossy::LEAST_ROUGHNESS`] are refused, too.
pub const ROUGHNESS: Range = within(0.0, 1.0);

/// Range of the diameter of a tube in metres: wider than any real tube, and narrower than any in millimetres.
pub const DIAMETER_M: Range = above(0.0, 100.0);
/// Number of segments of a tube.
pub const SEGMENTS: RangeInclusive<usize> = 1..=16;
/// Range of the length of one segment of a tube in metres: longer than any real one, and shorter than any in millimetres.
pub const SEGMENT_LENGTH_M: Range = above(0.0, 100.0);
/// Range of the tilt of a segment from the vertical in degrees; above 90 the guide runs downward.
pub const TILT_DEG: Range = within(0.0, 135.0);
/// Number of characters of a mesh's id.
pub const MESH_ID: RangeInclusive<usize> = 1..=1024;
/// Number of materials of a mesh tube.
pub const PARTS: RangeInclusive<usize> = 1..=usize::MAX;
/// Range of the refractive index of a dome, from air to beyond diamond.
pub const REFRACTIVE_INDEX: Range = within(1.0, 4.0);
/// Range of the thickness of a dome's shell in metres.
pub const THICKNESS_M: Range = above(0.0, 1.0);
/// Range of the Napierian absorption coefficient of a dome's material in 1/m.
pub const ABSORPTION_PER_M: Range = within(0.0, 1e6);
/// Range of the radius in metres of a zone of a diffuser, where the tube's radius is not available.
pub const ZONE_RADIUS_M: Range = within(0.0, 50.0);

/// Range of an angle from the normal in a table, in degrees.
pub const TABLE_ANGLE_DEG: Range = within(0.0, 90.0);
/// Range of a value of a scattering table, in 1/sr.
pub const SCATTERING_PER_SR: Range = within(0.0, 1e9);
/// Number of angles of incidence of a mirror's reflectance table.
pub const MIRROR_ROWS: RangeInclusive<usize> = 2..=1000;
/// Number of angles of incidence of a measured diffuser; at most one every quarter of a degree.
pub const INCIDENCES: RangeInclusive<usize> = 2..=361;
/// Number of angles of exit of a measured diffuser; at most one every eighth of a degree.
pub const EXITS: RangeInclusive<usize> = 2..=721;

/// Number of characters of a grid's or a view's name.
pub const OUTPUT_NAME: RangeInclusive<usize> = 1..=64;
/// Range of the height of a grid in metres, where the room's height is not available.
pub const GRID_HEIGHT_M: Range = within(0.0, 1000.0);
/// Range of the margin of a grid in metres, where the room's size is not available.
pub const MARGIN_M: Range = within(0.0, 500.0);
/// Illuminance in lux that a grid should reach.
pub const TARGET_LUX: Range = above(0.0, 1e6);
/// Number of cells along one axis of a grid.
pub const CELLS: RangeInclusive<u32> = 1..=1000;
/// Largest number of cells of one grid.
pub const MOST_GRID_CELLS: u64 = 100_000;
/// Number of pixels along one edge of a picture.
pub const PIXELS_OF_AN_EDGE: RangeInclusive<u32> = 1..=8192;
/// Largest number of pixels of one picture, 4096 x 4096.
pub const MOST_PIXELS: u64 = 16_777_216;
/// Range of the angle in degrees between two edges of a picture; at 180 degrees its plane would be infinite.
pub const FIELD_OF_VIEW_DEG: Range = between(0.0, 179.0);

/// Number of hours of a request for the illuminances of a kept room: those of a leap year.
pub const HOURS: RangeInclusive<usize> = 1..=8784;

/// Length in bytes that the body of such a request may have in any case: indented, with all fields, an hour has about 220.
pub const HOURS_BYTES: usize = 256 * *HOURS.end();

/// Number of jobs of a set, which a study is, too.
pub const JOBS_OF_SET: RangeInclusive<usize> = 1..=200;

/// Number of skies of a request for the fluxes of a tube.
pub const SKIES: RangeInclusive<usize> = 1..=100;
/// Number of times of a request for the fluxes of a tube.
pub const TIMES: RangeInclusive<usize> = 0..=1000;
/// Largest number of pairs of a sky and a time in a request for the fluxes of a tube: each adds some kilobytes to the response.
/// The computing time is limited separately.
pub const SKIES_TIMES_TIMES: usize = 5000;
/// Range of the relative error that a request for the fluxes of a tube may ask for: 512 passes of 1024 photons reach 0.1 % in
/// most tubes.
pub const RELATIVE_FLUX_ERROR: Range = within(0.001, 0.5);

/// Bounds of fields for the schema, by the names of component and field.
pub const FIELDS: &[(&str, &str, Limit)] = &[
    ("JobDocument", "name", Limit::Length(JOB_NAME)),
    ("JobDocument", "tubes", Limit::Items(TUBES)),
    ("JobDocument", "grids", Limit::Items(OUTPUTS)),
    ("JobDocument", "views", Limit::Items(OUTPUTS)),
    ("JobSetRequest", "name", Limit::Length(JOB_NAME)),
    ("JobSetRequest", "jobs", Limit::Items(JOBS_OF_SET)),
    ("HourListDocument", "hours", Limit::Items(HOURS)),
    ("HourDocument", "direct_normal_irradiance_w_m2", Limit::Number(DIRECT_IRRADIANCE_W_M2)),
    ("HourDocument", "diffuse_horizontal_irradiance_w_m2", Limit::Number(DIFFUSE_IRRADIANCE_W_M2)),
    ("HourDocument", "dew_point_c", Limit::Number(DEW_POINT_C)),
    ("TubeFluxDocument", "skies", Limit::Items(SKIES)),
    ("TubeFluxDocument", "times", Limit::Items(TIMES)),
    ("TubeFluxDocument", "relative_error", Limit::Number(RELATIVE_FLUX_ERROR)),
    ("FaceDirectionDocument", "tilt_deg", Limit::Number(PANE_TILT_DEG)),
    ("FaceDirectionDocument", "azimuth_deg", Limit::Number(TURN_DEG)),
    ("StopDocument", "relative_error", Limit::Number(RELATIVE_ERROR)),
    ("StopDocument", "view_relative_error", Limit::Number(RELATIVE_ERROR)),
    ("StopDocument", "confidence", Limit::Number(CONFIDENCE)),
    ("StopDocument", "max_passes", Limit::Number(PASSES)),
    ("StopDocument", "max_seconds", Limit::Number(SECONDS)),
    ("AnnualDocument", "sun_offset_minutes", Limit::Number(SUN_OFFSET_MINUTES)),
    ("AnnualDocument", "suns_per_hour", Limit::Number(SUNS_PER_HOUR)),
    ("AnnualDocument", "thresholds_lux", Limit::Items(THRESHOLDS)),
    ("AnnualDocument", "other_daylight", Limit::Items(0..=*OUTPUTS.end())),
    ("OtherDaylightDocument", "file", Limit::Length(FILE_ID)),
    ("WeeklySchedule", "days", Limit::Items(WEEKDAYS)),
    ("SdaDocument", "threshold_lux", Limit::Number(THRESHOLD_LUX)),
    ("SdaDocument", "time_percent", Limit::Number(PERCENT)),
    ("DimmingDocument", "setpoint_lux", Limit::Number(THRESHOLD_LUX)),
    ("DimmingDocument", "power_w_m2", Limit::Number(POWER_W_M2)),
    ("DimmingDocument", "minimum_power", Limit::Number(RATIO)),
    ("DimmingDocument", "minimum_light", Limit::Number(MINIMUM_LIGHT)),
    ("LocationDocument", "latitude_deg", Limit::Number(LATITUDE_DEG)),
    ("LocationDocument", "longitude_deg", Limit::Number(LONGITUDE_DEG)),
    ("LocationDocument", "elevation_m", Limit::Number(ELEVATION_M)),
    ("SkyDocument", "cie_type", Limit::Number(CIE_TYPE)),
    ("SkyDocument", "zenith_luminance_cd_m2", Limit::Number(LIGHT)),
    ("SkyDocument", "diffuse_horizontal_illuminance_lux", Limit::Number(LIGHT)),
    ("SkyDocument", "dv_ev", Limit::Number(DIFFUSE_RATIO)),
    ("SkyDocument", "luminous_turbidity", Limit::Number(TURBIDITY)),
    ("SkyDocument", "direct_normal_illuminance_lux", Limit::Number(LIGHT)),
    ("PerezDocument", "direct_normal_irradiance_w_m2", Limit::Number(DIRECT_IRRADIANCE_W_M2)),
    ("PerezDocument", "diffuse_horizontal_irradiance_w_m2", Limit::Number(DIFFUSE_IRRADIANCE_W_M2)),
    ("PerezDocument", "dew_point_c", Limit::Number(DEW_POINT_C)),
    ("SunPositionDocument", "altitude_deg", Limit::Number(ALTITUDE_DEG)),
    ("SunPositionDocument", "azimuth_deg", Limit::Number(TURN_DEG)),
    ("SurroundingsDocument", "horizon", Limit::Items(HORIZON_POINTS)),
    ("SurroundingsDocument", "horizon_pvgis", Limit::Items(HORIZON_POINTS)),
    ("SurroundingsDocument", "obstructions", Limit::Items(OBSTRUCTIONS)),
    ("BoxObstruction", "rotation_deg", Limit::Number(TURN_DEG)),
    ("ParametricTube", "horizon", Limit::Items(HORIZON_POINTS)),
    ("MeshTubeDocument", "horizon", Limit::Items(HORIZON_POINTS)),
    ("FlatCollector", "tilt_deg", Limit::Number(PANE_TILT_DEG)),
    ("FlatCollector", "azimuth_deg", Limit::Number(TURN_DEG)),
    ("SurroundingsDocument", "luminance_ratio", Limit::Number(RATIO)),
    ("SurroundingsDocument", "ground_reflectance", Limit::Number(RATIO)),
    ("RoomDocument", "rotation_deg", Limit::Number(TURN_DEG)),
    ("RoomDocument", "objects", Limit::Items(OBJECTS)),
    ("RoomDocument", "partitions", Limit::Items(PARTITIONS)),
    ("RoomDocument", "faces", Limit::Items(FACES)),
    ("FaceDocument", "name", Limit::Length(FACE_NAME)),
    ("FaceDocument", "boundary_m", Limit::Items(CORNERS)),
    ("FaceDocument", "holes_m", Limit::Items(HOLES)),
    ("PlanDocument", "outline_m", Limit::Items(CORNERS)),
    ("PlanDocument", "holes_m", Limit::Items(HOLES)),
    ("FlatCeiling", "height_m", Limit::Number(CEILING_HEIGHT_M)),
    ("SlopedCeiling", "rise_toward_deg", Limit::Number(TURN_DEG)),
    ("SlopedCeiling", "pitch_deg", Limit::Number(PITCH_DEG)),
    ("GableCeiling", "eaves_m", Limit::Number(CEILING_HEIGHT_M)),
    ("GableCeiling", "ridge_m", Limit::Number(CEILING_HEIGHT_M)),
    ("GableCeiling", "ridge_azimuth_deg", Limit::Number(TURN_DEG)),
    ("PartitionDocument", "height_m", Limit::Number(CEILING_HEIGHT_M)),
    ("RoomDocument", "luminaires", Limit::Items(LUMINAIRES)),
    ("SurfaceDocument", "roughness", Limit::Number(ROUGHNESS)),
    ("BoxObject", "rotation_deg", Limit::Number(TURN_DEG)),
    ("MeshObject", "scale", Limit::Number(MESH_SCALE)),
    ("MeshObject", "instances", Limit::Items(INSTANCES)),
    ("ParametricTube", "diameter_m", Limit::Number(DIAMETER_M)),
    ("ClosureShapeDocument", "side_m", Limit::Number(DIAMETER_M)),
    ("ClosureShapeDocument", "rotation_deg", Limit::Number(TURN_DEG)),
    ("ClosureShapeDocument", "transition_transmittance", Limit::Number(RATIO)),
    ("ParametricTube", "drop_m", Limit::Number(DROP_M)),
    ("ParametricTube", "segments", Limit::Items(SEGMENTS)),
    ("SegmentDocument", "length_m", Limit::Number(SEGMENT_LENGTH_M)),
    ("SegmentDocument", "tilt_deg", Limit::Number(TILT_DEG)),
    ("SegmentDocument", "azimuth_deg", Limit::Number(TURN_DEG)),
    ("MeshTubeDocument", "mesh", Limit::Length(MESH_ID)),
    ("MeshTubeDocument", "opening_diameter_m", Limit::Number(DIAMETER_M)),
    ("MeshTubeDocument", "rotation_deg", Limit::Number(TURN_DEG)),
    ("MeshTubeDocument", "drop_m", Limit::Number(DROP_M)),
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
    ("GridDocument", "spacing_m", Limit::Number(SPACING_M)),
    ("GridDocument", "target_lux", Limit::Number(TARGET_LUX)),
    ("GridDocument", "points_m", Limit::Items(POINTS)),
    ("ViewDocument", "vertical_fov_deg", Limit::Number(FIELD_OF_VIEW_DEG)),
];
