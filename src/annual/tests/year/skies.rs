//! All-weather skies against an independent program.

use skyduct_physics::sky::{Irradiances, PerezSky, SkyType, direction};

use crate::given::rows;

/// Compares clearness, brightness, parameters, level and efficacies of 62 states, within half the last printed digit; the level, which is
/// from a quadrature, within 1e-5. The table has the distance of the sun of the day before the first.
#[test]
fn states_of_skies_are_those_of_the_table() {
    for row in rows("perez_points.csv") {
        let [altitude, direct, diffuse] = [row[0], row[1], row[2]];
        let irradiances =
            Irradiances { direct_normal_w_m2: direct, diffuse_horizontal_w_m2: diffuse, dew_point_c: 10.97 };
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
