//! All-weather skies against an independent program.

use glam::DVec3;
use skyduct_annual::light::{Illuminances, by_record, lit};
use skyduct_annual::moment::Moment;
use skyduct_annual::weather::Record;
use skyduct_physics::sky::{Irradiances, PerezSky, SkyType, direction};

use crate::given::{PEREZ_POINTS, rows};

/// Compares clearness, brightness, parameters, level and efficacies of 62 states, to their seven digits; the level, which is
/// from a quadrature, within 1e-5. The table has the distance of the sun of the day before the first,
/// and a dew point by which there are two centimetres of water.
#[test]
fn states_of_skies_are_those_of_the_table() {
    let water_of_two_centimetres = (2f64.ln() + 0.075) / 0.07;
    for row in rows(PEREZ_POINTS) {
        let [altitude, direct, diffuse] = [row[0], row[1], row[2]];
        let irradiances = Irradiances {
            direct_normal_w_m2: direct,
            diffuse_horizontal_w_m2: diffuse,
            dew_point_c: water_of_two_centimetres,
        };
        let sun = direction(altitude.to_radians(), 1.0);
        let perez = PerezSky::new(irradiances, sun, Some(0));
        let close = |value: f64, expected: f64, relative: f64| {
            assert!((value - expected).abs() <= relative * expected.abs() + 1e-7, "{row:?}: {value} {expected}");
        };
        close(perez.clearness, row[3], 1e-6);
        close(perez.brightness, row[4], 1e-6);
        for (value, expected) in perez.parameters().into_iter().zip(&row[5..10]) {
            close(value, *expected, 1e-6);
        }
        close(perez.diffuse_horizontal_illuminance_lux() / diffuse, row[16], 1e-6);
        close(perez.direct_normal_illuminance_lux(), row[14], 1e-6);
        // luminance over the formula's own value, for which the parameters of the general sky are divided by 1 + K
        let sky = perez.sky();
        let [a, b, c, d, e] = perez.parameters();
        let toward = direction(0.9, 1.7);
        let cos = sun.dot(toward);
        let formula = (1.0 + a * (b / toward.z).exp()) * (1.0 + c * (d * cos.acos()).exp() + e * cos * cos);
        close(sky.luminance(toward) / formula, row[10], 1e-5);
        assert!(matches!(sky.distribution.sky_type(), SkyType::Free(_)));
    }
}

/// Checks records with and without light and illuminances of their own, in a room whose +y axis points east: there the sun of the east is.
#[test]
fn moments_have_the_light_of_their_records() {
    let record = |direct: f64, diffuse: f64, illuminances_lux: Option<[f64; 2]>| Record {
        month: 1,
        day: 1,
        middle_hour: 0.5,
        direct_normal_w_m2: direct,
        diffuse_horizontal_w_m2: diffuse,
        dew_point_c: 11.0,
        illuminances_lux,
    };
    let of_file = Some([30_000.0, 9000.0]);
    let records = [record(0.0, 0.0, of_file), record(300.0, 80.0, of_file), record(0.0, 100.0, None)];
    let sun = direction(0.5, 90f64.to_radians());
    let moment = |record: usize, share: f64| Moment { record, share, represented_hour: 8.5, day_of_year: 1, sun };
    let below = Moment { sun: DVec3::new(0.8, 0.0, -0.6), ..moment(2, 1.0) };
    let moments = [moment(0, 1.0), moment(1, 0.5), moment(1, 0.5), moment(2, 1.0), below, moment(9, 1.0)];
    let turned = 90f64.to_radians();
    let by_efficacy = lit(&records, &moments, Illuminances::Perez, turned);
    assert_eq!(by_efficacy.iter().map(|moment| moment.record).collect::<Vec<_>>(), [1, 1, 2]);
    assert!((by_efficacy[0].sun - direction(0.5, 0.0)).length() < 1e-12 && by_efficacy[0].compass_sun == sun);
    let irradiances = Irradiances { direct_normal_w_m2: 300.0, diffuse_horizontal_w_m2: 80.0, dew_point_c: 11.0 };
    let perez = PerezSky::new(irradiances, sun, Some(1));
    assert!((by_efficacy[0].direct_normal_lux / perez.direct_normal_illuminance_lux() - 1.0).abs() < 1e-12);
    let by_file = lit(&records, &moments, Illuminances::File, turned);
    assert_eq!((by_file[0].direct_normal_lux, by_file[0].diffuse_horizontal_lux), (30_000.0, 9000.0));
    assert_eq!(by_file[2].diffuse_horizontal_lux, by_efficacy[2].diffuse_horizontal_lux);
    let (diffuse, sines) = by_record(&by_file, 3);
    assert_eq!(diffuse, [0.0, 9000.0, by_file[2].diffuse_horizontal_lux]);
    assert_eq!(sines, [0.0, by_file[0].sun.z, by_file[2].sun.z]);
}
