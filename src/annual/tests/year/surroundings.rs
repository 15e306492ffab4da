//! Lumens of tubes before horizons, and of those that see the ground.

use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::DVec3;
use skyduct_annual::light::LitMoment;
use skyduct_physics::integrator::diffuser_source::flux::patched_flux;
use skyduct_physics::optics::{Collector, Mirror};
use skyduct_physics::sampling::Key;
use skyduct_physics::scene::{Daylight, Segment, StraightOrBent, Tube};
use skyduct_physics::sky::zenith::ZenithFormula;
use skyduct_physics::sky::{CieType, Horizon, Sky, SkyDistribution, Sun, direction};
use skyduct_physics::traceable::Source;

use crate::given::{YEAR, compiled, compiled_under, shaped, tube, years};

/// Luminance below the horizon over the mean of the sky, and reflectance of the ground.
const RATIOS: [f64; 2] = [0.3, 0.4];

fn horizon(points: &[(f64, f64)]) -> Option<Horizon> {
    Horizon::new(points.iter().map(|(azimuth, altitude)| (azimuth.to_radians(), altitude.to_radians())).collect(), 0.3)
}

/// Returns sky and sun of a moment.
fn daylight(moment: &LitMoment) -> Daylight {
    let distribution = moment.distribution.clone();
    let zenith_luminance_cd_m2 = moment.diffuse_horizontal_lux / distribution.horizontal_ratio();
    Daylight {
        sky: Some(Sky::new(distribution, zenith_luminance_cd_m2)),
        sun: Some(Sun { direction: moment.sun, normal_illuminance_lux: moment.direct_normal_lux }),
        formula: ZenithFormula::GivenHorizontalIlluminance,
    }
}

/// Puts surroundings under the daylight of a moment around a tube.
fn surrounded(tube: &Tube, moment: &LitMoment, horizon: Option<Horizon>) -> Tube {
    Tube { surroundings: Some(Arc::new(daylight(moment).surroundings(horizon, RATIOS, 0.0))), ..tube.clone() }
}

/// Compares a straight tube, one that leans to the south with a tilted pane, and one under a dome with photons of single moments before a jagged
/// horizon with a vertical edge, within 4 standard errors of both, and 2e-3 of the open sky for the edge between two azimuths.
#[test]
fn moments_agree_with_photons() {
    let jagged = || horizon(&[(0.0, 10.0), (80.0, 0.0), (150.0, 25.0), (210.0, 25.0), (210.001, 5.0), (300.0, 45.0)]);
    let level = |length_m: f64| Segment { length_m, tilt: 0.0, azimuth: 0.0 };
    let cylinders = |segments: Vec<Segment>, collector: Collector, cut: Option<DVec3>| StraightOrBent {
        reflectance: Mirror::Constant([0.95; 3]),
        segments,
        collector,
        cut,
    };
    let dome = Collector::DielectricDome { refractive_index: 1.49, thickness_m: 0.003, absorption_per_m: 2.0 };
    // mirrors of vertical pipes send no light down that comes from below
    let leaning = Segment { length_m: 0.5, tilt: 0.9, azimuth: PI };
    let to_the_south = direction(0.6, PI);
    let lit: Vec<LitMoment> = YEAR.lit.iter().skip(400).step_by(900).cloned().collect();
    for (cylinders, sees_ground) in [
        (cylinders(vec![level(0.6)], Collector::Open, None), false),
        (cylinders(vec![level(0.3), leaning], Collector::Open, Some(to_the_south)), true),
        (cylinders(vec![level(0.6)], dome, None), true),
    ] {
        let tube = shaped(0.3, cylinders, 0.5, 0.0);
        let year = &years(&compiled(vec![surrounded(&tube, &lit[0], jagged())]), &lit)[0];
        let mut of_ground = 0;
        for (moment, light) in lit.iter().zip(&year.moments) {
            let scene = compiled_under(Some(daylight(moment)), vec![surrounded(&tube, moment, jagged())]);
            for (source, lumens) in [(Source::Sky, light.sky_lm), (Source::Sun, light.sun_lm)] {
                let scene = scene.lit_by(source, None);
                let photons = patched_flux(&scene, Key::new(7), 0.005, &AtomicBool::new(false)).unwrap().into_room;
                let error = photons.standard_error().hypot(2.0 * year.relative_error * lumens);
                let edge = 2e-3 * PI * 0.15 * 0.15 * 0.5 * moment.diffuse_horizontal_lux;
                assert!((lumens - photons.mean).abs() <= 4.0 * error + edge, "{source:?} {lumens} {photons:?} {error}");
            }
            let on_black = Tube { surroundings: None, ..tube.clone() };
            let brighter = Daylight { sun: None, ..daylight(moment) }.surroundings(jagged(), [RATIOS[0], 0.0], 0.0);
            let on_black = Tube { surroundings: Some(Arc::new(brighter)), ..on_black };
            let without = years(&compiled(vec![on_black]), std::slice::from_ref(moment))[0].moments[0].sky_lm;
            of_ground += usize::from(light.sky_lm > without);
        }
        assert_eq!(of_ground > 0, sees_ground);
    }
}

/// Checks level rings before a perfect pipe, which passes all light: below the altitude a lies (3 sin^2 a + 4 sin^3 a) / 7 of a traditional
/// overcast sky. A year without sun has no light but that.
#[test]
fn rings_take_their_part_of_overcast_skies() {
    let pipe = StraightOrBent {
        reflectance: Mirror::Constant([1.0; 3]),
        segments: vec![Segment { length_m: 2.0, tilt: 0.0, azimuth: 0.0 }],
        collector: Collector::Open,
        cut: None,
    };
    let pipe = shaped(0.5, pipe, 1.0, 0.0);
    let overcast = |moment: &LitMoment| LitMoment {
        direct_normal_lux: 0.0,
        distribution: SkyDistribution::new(CieType::TRADITIONAL_OVERCAST, moment.sun),
        ..moment.clone()
    };
    let lit: Vec<LitMoment> = YEAR.lit.iter().step_by(500).map(overcast).collect();
    for altitude_deg in [10.0f64, 20.0, 30.0] {
        let z = altitude_deg.to_radians().sin();
        let expected = 1.0 - (3.0 * z * z + 4.0 * z * z * z) / 7.0 + RATIOS[0] * z * z;
        let scene = compiled(vec![surrounded(&pipe, &lit[0], horizon(&[(0.0, altitude_deg)]))]);
        let year = &years(&scene, &lit)[0];
        for (moment, light) in lit.iter().zip(&year.moments) {
            let found = light.sky_lm / (PI * 0.25 * 0.25 * moment.diffuse_horizontal_lux);
            assert!((found / expected - 1.0).abs() < 1e-4, "{altitude_deg}: {found} {expected}");
            assert_eq!(light.sun_lm, 0.0);
        }
    }
}

/// Checks that a ring takes all suns below it and none above, that tubes of one kind before two horizons differ, and that two before equal
/// ones do not.
#[test]
fn suns_below_a_ring_are_gone() {
    let lit: Vec<LitMoment> =
        YEAR.lit.iter().filter(|moment| moment.direct_normal_lux > 0.0).step_by(40).cloned().collect();
    let tube = tube(0.254, 1.0, 1.0, 0.6);
    let ring = || horizon(&[(0.0, 20.0)]);
    let before = |horizon: Option<Horizon>| surrounded(&tube, &lit[0], horizon);
    let scene = compiled(vec![tube.clone(), before(ring()), before(ring()), before(horizon(&[(0.0, 90.0)]))]);
    let found = years(&scene, &lit);
    assert_eq!(found[1], found[2]);
    let half_disc = 0.27f64.to_radians();
    let mut below = 0;
    for ((moment, open), ringed) in lit.iter().zip(&found[0].moments).zip(&found[1].moments) {
        let altitude = moment.sun.z.asin();
        match altitude - 20f64.to_radians() {
            away if away > half_disc => assert_eq!(ringed.sun_lm, open.sun_lm),
            away if away < -half_disc => assert_eq!(ringed.sun_lm, 0.0),
            _ => assert!(ringed.sun_lm <= open.sun_lm),
        }
        below += usize::from(altitude < 20f64.to_radians());
        assert!(ringed.sky_lm < open.sky_lm);
    }
    assert!(below > 10 && below < lit.len() - 10);
    // below a horizon all round there is its own luminance alone, through the transmission of a uniform sky
    for (moment, light) in lit.iter().zip(&found[3].moments) {
        let per_lux = light.lumens() / moment.diffuse_horizontal_lux;
        assert!((per_lux / (found[3].moments[0].lumens() / lit[0].diffuse_horizontal_lux) - 1.0).abs() < 0.02);
        assert_eq!(light.sun_lm, 0.0);
    }
}
