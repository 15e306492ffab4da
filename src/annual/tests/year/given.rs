//! Reference tables, the two rooms of the reference, and the year of its synthetic weather.

use std::sync::LazyLock;

use glam::{DVec2, DVec3};
use skyduct_annual::fluxes::{TubeYear, tube_years};
use skyduct_annual::light::LitMoment;
use skyduct_annual::response::{Response, Responses};
use skyduct_annual::weather::Record;
use skyduct_physics::optics::{Collector, Diffuser, Mirror};
use skyduct_physics::scene::{
    Channels, Daylight, Enclosure, OpeningPlane, Room, Scene, Segment, StraightOrBent, Tube, TubeShape,
};
use skyduct_physics::sky::{Irradiances, PerezSky, SkyDistribution, direction};
use skyduct_physics::traceable::{Follow, TraceableScene};

pub const PEREZ_POINTS: &str = include_str!("../../../../tests/reference/annual/perez_points.csv");
pub const HOURS: &str = include_str!("../../../../tests/reference/annual/hours_synthetic.csv");
pub const EXIT_CENTROID: &str = include_str!("../../../../tests/reference/annual/S1_exit_centroid.csv");
pub const THESIS_POINTS: &str = include_str!("../../../../tests/reference/annual/S1_synthetic_points.csv");
pub const THESIS_POINTS_CENTROID: &str =
    include_str!("../../../../tests/reference/annual/S1_synthetic_points_centroid.csv");
pub const CLASSROOM_RESPONSE: &str = include_str!("../../../../tests/reference/annual/A2_response.csv");

/// Returns the numbers of a table, by rows, without its header.
pub fn rows(table: &str) -> Vec<Vec<f64>> {
    let cells = |line: &str| line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect();
    table.lines().skip(1).map(cells).collect()
}

/// Row of the table of hours.
pub struct HourRow {
    pub altitude_deg: f64,
    pub transmissions: [f64; 2],
    pub lumens: [f64; 2],
}

/// Synthetic year: its records without irradiances, its lit moments, and the table of hours.
pub struct GivenYear {
    pub records: Vec<Record>,
    pub lit: Vec<LitMoment>,
    pub rows: Vec<HourRow>,
}

/// Days before each month of 2017, for which the table of hours was made.
const BEFORE: [usize; 12] = [0, 31, 59, 90, 120, 151, 181, 212, 243, 273, 304, 334];

pub static YEAR: LazyLock<GivenYear> = LazyLock::new(|| {
    let blank = |number: usize| {
        let day = number / 24;
        let month = BEFORE.partition_point(|before| *before <= day);
        Record {
            month: month as u8,
            day: (day - BEFORE[month - 1] + 1) as u8,
            middle_hour: (number % 24) as f64 + 0.5,
            direct_normal_w_m2: 0.0,
            diffuse_horizontal_w_m2: 0.0,
            dew_point_c: 11.0,
            illuminances_lux: None,
        }
    };
    let rows = rows(HOURS);
    let lit = rows.iter().map(|row| lit(row)).collect();
    let rows = rows
        .iter()
        .map(|row| HourRow { altitude_deg: row[3], transmissions: [row[10], row[11]], lumens: [row[12], row[13]] })
        .collect();
    GivenYear { records: (0..8760).map(blank).collect(), lit, rows }
});

/// Returns the moment of a row of the table of hours, with irradiances that have its clearness and brightness.
fn lit(row: &[f64]) -> LitMoment {
    let sun = direction(row[3].to_radians(), row[4].to_radians());
    let zenith_deg = 90.0 - row[3];
    let (clearness, brightness) = (row[6], row[7]);
    let air_mass = 1.0 / (sun.z + 0.15 * (93.885 - zenith_deg).powf(-1.253));
    let diffuse = brightness * 1367.0 / air_mass;
    let direct = diffuse * (clearness - 1.0) * (1.0 + 1.041 * zenith_deg.to_radians().powi(3));
    let irradiances = Irradiances { direct_normal_w_m2: direct, diffuse_horizontal_w_m2: diffuse, dew_point_c: 11.0 };
    let sky = PerezSky::new(irradiances, sun, None);
    let record = 24 * (BEFORE[row[0] as usize - 1] + row[1] as usize - 1) + row[2] as usize - 1;
    LitMoment {
        record,
        share: 1.0,
        sun,
        compass_sun: sun,
        clearness,
        brightness,
        diffuse_horizontal_lux: row[8],
        direct_normal_lux: row[9],
        distribution: SkyDistribution::new(sky.sky_type(), sun),
    }
}

/// Returns a tube of a diameter and straight length in m with a thin collector, 98 % mirror, and a Lambertian diffuser.
pub fn tube(diameter: f64, length: f64, collector: f64, transmittance: f64) -> Tube {
    let segments = vec![Segment { length_m: length, tilt: 0.0, azimuth: 0.0 }];
    let collector = Collector::Dome { transmittance: [collector; 3] };
    shaped(
        diameter,
        StraightOrBent { reflectance: Mirror::Constant([0.98; 3]), segments, collector, cut: None },
        transmittance,
        0.0,
    )
}

/// Number of the ceiling among the faces of a cuboid.
const CEILING: usize = 5;

/// Returns a tube with cylinders of a diameter in m above a Lambertian diffuser.
pub fn shaped(diameter: f64, cylinders: StraightOrBent, transmittance: f64, reflectance: f64) -> Tube {
    Tube {
        face: CEILING,
        plane: OpeningPlane::Level { drop_m: 0.0 },
        centre: DVec2::splat(1.016),
        opening_radius: 0.5 * diameter,
        transition: None,
        surroundings: None,
        shape: TubeShape::Cylinders(cylinders),
        diffuser: Diffuser::Lambertian { transmittance: [transmittance; 3], reflectance: [reflectance; 3] },
    }
}

/// Compiles a black room below tubes.
pub fn compiled(tubes: Vec<Tube>) -> TraceableScene {
    compiled_under(None, tubes)
}

/// Compiles a black room below tubes under a daylight.
pub fn compiled_under(daylight: Option<Daylight>, tubes: Vec<Tube>) -> TraceableScene {
    let enclosure = Enclosure::cuboid(DVec3::splat(2.032), std::array::from_fn(|_| None));
    let scene = Scene {
        daylight,
        moments: None,
        room: Room { enclosure, boxes: Vec::new(), meshes: Vec::new(), luminaires: Vec::new() },
        tubes,
        grids: Vec::new(),
        views: Vec::new(),
        channels: Channels::Photopic,
    };
    TraceableScene::new(&scene, Follow { interreflection: true, guide_return: true, objects: true }).unwrap()
}

/// Computes the year of tubes.
pub fn years(scene: &TraceableScene, lit: &[LitMoment]) -> Vec<TubeYear> {
    tube_years(scene, lit, 1)
}

/// Year of the tube of the thesis room, and that of one of the four tubes of the classroom.
pub static TUBES: LazyLock<[TubeYear; 2]> = LazyLock::new(|| {
    let scene = compiled(vec![tube(0.254, 1.0, 1.0, 0.6), tube(0.53, 1.5, 0.92, 0.8)]);
    let years = years(&scene, &YEAR.lit);
    [years[0].clone(), years[1].clone()]
});

/// Returns responses in lx/klm with errors, the same for each of `tubes` tubes.
pub fn responses(of: impl Iterator<Item = (f64, f64)>, tubes: usize) -> Responses {
    let response = |(lux_per_klm, error): (f64, f64)| Response {
        lux_per_lumen: 1e-3 * lux_per_klm,
        gradient: DVec2::ZERO,
        left_out: 0.0,
        standard_error: 1e-3 * error,
    };
    Responses::new(vec![of.map(response).collect(); tubes], Vec::new(), None)
}

/// Returns whether each record of the year is occupied from 8 to 18 h.
pub fn occupied() -> Vec<bool> {
    (0..8760).map(|record| (8..18).contains(&(record % 24))).collect()
}

/// Returns the 4380 records of the year with most diffuse light, with more sun among equal ones.
pub fn daylight() -> Vec<bool> {
    let (diffuse, sines) = skyduct_annual::light::by_record(&YEAR.lit, 8760);
    let mut order: Vec<usize> = (0..8760).collect();
    order.sort_by(|a, b| diffuse[*b].total_cmp(&diffuse[*a]).then(sines[*b].total_cmp(&sines[*a])));
    let mut is_daylight = vec![false; 8760];
    order[..4380].iter().for_each(|record| is_daylight[*record] = true);
    is_daylight
}
