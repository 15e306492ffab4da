//! Lumens of tubes by the hour.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::atomic::AtomicBool;

use glam::{DVec2, DVec3};
use skyduct_annual::fluxes::TubeYear;
use skyduct_annual::light::LitMoment;
use skyduct_annual::pattern::left_out;
use skyduct_annual::response::{RecordLight, Response, Responses, TubeRecord};
use skyduct_physics::guide::exit_moment::beam_exit_moment;
use skyduct_physics::guide::transmittance::{beam_transmission, sky_exitance};
use skyduct_physics::integrator::diffuser_source::cells::OpeningReceiver;
use skyduct_physics::integrator::diffuser_source::flux::patched_flux;
use skyduct_physics::optics::{Collector, Diffuser, DiffuserZone, Mirror};
use skyduct_physics::sampling::{Key, PathRandom};
use skyduct_physics::scene::{OpeningPlane, Segment, Sensor, StraightOrBent, Tube};
use skyduct_physics::sky::{Sky, SkyDistribution, Sun, direction};

use crate::given::{EXIT_CENTROID, TUBES, YEAR, compiled, rows, shaped, tube, years};

/// Compares every hour of the synthetic year: transmissions, and lumens to 3e-4 with the sun above 10 degrees, to 0.5 lm below. Printed
/// altitudes have 1e-4 degrees, which counts at low suns.
#[test]
fn hours_of_the_thesis_room() {
    let (tube, area) = (&TUBES[0], PI * 0.127 * 0.127 * 0.6);
    let mut sum = 0.0;
    for ((row, moment), light) in YEAR.rows.iter().zip(&YEAR.lit).zip(&tube.moments) {
        let expected = area * moment.diffuse_horizontal_lux * row.transmissions[0];
        assert!((light.sky_lm - expected).abs() <= 1e-4 * expected, "{}: {}", row.altitude_deg, light.sky_lm);
        for (lumens, expected) in [light.sky_lm, light.sun_lm].into_iter().zip(row.lumens) {
            let tolerance = if row.altitude_deg > 10.0 { 3e-4 * expected + 0.01 } else { 0.5 };
            assert!((lumens - expected).abs() < tolerance, "{}: {lumens} {expected}", row.altitude_deg);
        }
        sum += 1e-3 * light.lumens();
    }
    assert!((sum / 3508.35 - 1.0).abs() < 2e-4, "{sum}");
    assert_eq!(tube.relative_error, 0.0);
}

/// Compares the rule of few nodes with the quadrature of the exact series, which is right to 1e-9: 24 zenith angles err by about 1e-4.
#[test]
fn skies_by_rings_agree_with_the_exact_series() {
    let area = PI * 0.127 * 0.127 * 0.6;
    for (moment, light) in YEAR.lit.iter().zip(&TUBES[0].moments).step_by(97) {
        let sky = Sky::new(moment.distribution.clone(), 1.0);
        let exact = sky_exitance(&sky, 1.0 / 0.254, 0.98) / sky.horizontal_illuminance_lux();
        let found = light.sky_lm / (area * moment.diffuse_horizontal_lux);
        assert!((found / exact - 1.0).abs() < 2e-4, "{:?}: {found} {exact}", moment.record);
    }
}

#[test]
fn centroids_of_beams_are_those_of_the_table() {
    for row in rows(EXIT_CENTROID) {
        let tangent = row[0].to_radians().tan();
        if row[0] >= 90.0 {
            continue;
        }
        let transmission = beam_transmission(1.0 / 0.254, tangent, 0.98);
        assert!((transmission - row[1]).abs() < 1e-6, "{row:?}: {transmission}");
        let centroid = beam_exit_moment(1.0 / 0.254, tangent, 0.98) / transmission;
        assert!((centroid - row[2]).abs() < 1.5e-5, "{row:?}: {centroid}");
    }
    assert_eq!(beam_exit_moment(0.0, 3.0, 1.0), 0.0);
}

/// Checks that a perfect pipe without losses passes all light, that light without sun is that of skies, and that the turn of a room is of
/// no effect on a straight tube but for the centroid's direction.
#[test]
fn perfect_pipes_pass_all_light() {
    let segments = vec![Segment { length_m: 2.0, tilt: 0.0, azimuth: 0.0 }];
    let pipe =
        StraightOrBent { reflectance: Mirror::Constant([1.0; 3]), segments, collector: Collector::Open, cut: None };
    let scene = compiled(vec![shaped(0.5, pipe, 1.0, 0.0)]);
    let lit: Vec<LitMoment> = YEAR.lit.iter().step_by(50).cloned().collect();
    let area = PI * 0.25 * 0.25;
    for (moment, light) in lit.iter().zip(&years(&scene, &lit)[0].moments) {
        assert!((light.sky_lm / (area * moment.diffuse_horizontal_lux) - 1.0).abs() < 1e-12);
        assert!((light.sun_lm - area * moment.direct_horizontal_lux()).abs() <= 1e-12 * light.sun_lm);
    }
}

/// Traces a bent tube, one under a dielectric dome, and one that comes through a wall, all with diffusers that reflect, and compares some hours with photons of the job's
/// own method, within 4 standard errors of both.
#[test]
fn traced_tubes_agree_with_photons() {
    let segment = |length_m: f64, tilt: f64| Segment { length_m, tilt, azimuth: 0.7 };
    let dome = Collector::DielectricDome { refractive_index: 1.49, thickness_m: 0.003, absorption_per_m: 2.0 };
    let mirror = || Mirror::Constant([0.95; 3]);
    let bent = StraightOrBent {
        reflectance: mirror(),
        segments: vec![segment(0.5, 0.0), segment(0.6, 0.6)],
        collector: Collector::Open,
        cut: None,
    };
    let domed = StraightOrBent { reflectance: mirror(), segments: vec![segment(0.6, 0.0)], collector: dome, cut: None };
    let through_wall = StraightOrBent {
        reflectance: mirror(),
        segments: vec![Segment { azimuth: FRAC_PI_2, ..segment(0.4, FRAC_PI_2) }, segment(0.6, 0.2)],
        collector: Collector::Open,
        cut: None,
    };
    let [bent, domed, through_wall] = [bent, domed, through_wall].map(|cylinders| shaped(0.3, cylinders, 0.5, 0.4));
    let in_wall =
        Tube { face: 1, plane: OpeningPlane::OfFace { height_m: 1.0 }, centre: DVec2::new(2.032, 1.0), ..through_wall };
    let lit: Vec<LitMoment> = YEAR.lit.iter().step_by(1100).cloned().collect();
    for tube in [bent, domed, in_wall] {
        let mut scene = compiled(vec![tube]);
        let year = &years(&scene, &lit)[0];
        assert!(year.relative_error > 0.0 && year.relative_error < 0.02, "{}", year.relative_error);
        for (moment, light) in lit.iter().zip(&year.moments) {
            let distribution: SkyDistribution = moment.distribution.clone();
            let zenith_luminance_cd_m2 = moment.diffuse_horizontal_lux / distribution.horizontal_ratio();
            let sky = Sky::new(distribution, zenith_luminance_cd_m2);
            let sun = Sun { direction: moment.sun, normal_illuminance_lux: moment.direct_normal_lux };
            for (of_sky, of_sun, lumens) in [(Some(sky), None, light.sky_lm), (None, Some(sun), light.sun_lm)] {
                scene.set_daylight(of_sky, of_sun);
                let photons = patched_flux(&scene, Key::new(7), 0.01, &AtomicBool::new(false)).unwrap().into_room;
                // errors of single hours are larger than that of the year, whose sum they share
                let error = photons.standard_error().hypot(2.0 * year.relative_error * lumens) + 1e-3 * lumens;
                assert!((lumens - photons.mean).abs() <= 4.0 * error, "{lumens} {photons:?} {error}");
            }
        }
    }
}

/// Compares the centroids of beams and skies in traced rays with the closed form, through a pipe that is bent by nothing.
#[test]
fn traced_centroids_agree_with_the_closed_form() {
    let segments = |tilt: f64| {
        vec![Segment { length_m: 0.5, tilt: 0.0, azimuth: 0.0 }, Segment { length_m: 0.5, tilt, azimuth: 0.0 }]
    };
    let pipe = |tilt: f64| {
        let cylinders = StraightOrBent {
            reflectance: Mirror::Constant([0.98; 3]),
            segments: segments(tilt),
            collector: Collector::Open,
            cut: None,
        };
        shaped(0.254, cylinders, 0.6, 0.0)
    };
    let scene = compiled(vec![pipe(0.0), pipe(1e-7)]);
    let lit: Vec<LitMoment> =
        YEAR.lit.iter().filter(|moment| moment.direct_normal_lux > 0.0).step_by(150).cloned().collect();
    let [exact, traced] = [0, 1].map(|tube| years(&scene, &lit)[tube].clone());
    assert!(exact.relative_error == 0.0 && traced.relative_error > 0.0);
    for (exact, traced) in exact.moments.iter().zip(&traced.moments) {
        // positions of 1024 rays have a standard deviation of up to half a radius
        assert!(
            (exact.sun_centroid_m - traced.sun_centroid_m).length() < 4.0 * 0.5 * 0.127 / 32.0,
            "{exact:?} {traced:?}"
        );
        // 4096 rays of the sky
        assert!(
            (exact.sky_centroid_m - traced.sky_centroid_m).length() < 4.0 * 0.5 * 0.127 / 64.0,
            "{exact:?} {traced:?}"
        );
        assert!((traced.lumens() / exact.lumens() - 1.0).abs() < 0.02, "{exact:?} {traced:?}");
    }
}

/// Sends beams of 15 altitudes through wide short pipes, and compares the direct light at places below with what flux and centroid tell: the root
/// mean square of the errors is that of the told ones.
#[test]
fn patterns_of_beams_err_as_told() {
    let square = (0..10_000).map(|point| [point % 100, point / 100].map(|of| 0.01 * (f64::from(of) + 0.5)));
    let square: Vec<[f64; 2]> = square.collect();
    for (length, reflectance) in [(0.4, 0.95), (0.8, 0.9)] {
        let scene = compiled(vec![tube(0.7, length, reflectance, 1.0)]);
        let tube = &scene.tubes[0];
        let [mut found, mut told] = [0.0; 2];
        for (number, (depth, aside)) in [0.4, 0.7].iter().flat_map(|depth| (0..4).map(move |n| (depth, n))).enumerate()
        {
            let place = DVec2::from_angle(number as f64) * 0.15 * f64::from(aside);
            let sensor = Sensor { position: tube.frame.origin + place.extend(-depth), normal: DVec3::Z };
            let receiver = OpeningReceiver::new(sensor.position, sensor.normal, &tube.frame);
            let of = |away: DVec2| receiver.point(tube.frame.origin.truncate() + away);
            let (mut even, mut moment) = (0.0, DVec2::ZERO);
            let places = square.iter().map(|point| tube.opening.point(*point));
            for away in places {
                even += of(away) / square.len() as f64;
                moment += of(away) * away / square.len() as f64;
            }
            let response = Response {
                lux_per_lumen: even,
                gradient: moment * (4.0 / (0.35 * 0.35)),
                left_out: left_out(&scene, tube, &sensor),
                standard_error: 0.0,
            };
            let responses = Responses::new(vec![vec![response]], Vec::new(), None);
            for step in 0..15 {
                let toward = direction((19.0 + 4.0 * f64::from(step)).to_radians(), 2.0 + f64::from(step * step));
                let (mut lumens, mut centre, mut lux) = (0.0, DVec2::ZERO, 0.0);
                let mut random = PathRandom::new(Key::new(1));
                for point in &square {
                    let Some(entry) = tube.guide.entry(*point, -toward) else { continue };
                    let transit = tube.guide.down::<1>(entry.position, -toward, &mut random);
                    let weight = transit.weight().0[0];
                    lumens += weight;
                    centre += weight * transit.position.truncate();
                    lux += weight * of(transit.position.truncate());
                }
                let beam = TubeRecord { lumens, beam_lumens: lumens, moment: centre };
                let light = RecordLight::of_records(vec![0], vec![vec![beam]], vec![0.0]);
                let by_centroid = responses.illuminances_lux(0, &light)[0];
                found += ((by_centroid - lux) / (even * lumens)).powi(2);
                told += responses.relative_error(0, &light).powi(2);
            }
        }
        let share = (found / told).sqrt();
        assert!((0.7..1.0).contains(&share), "{length}: {share}");
    }
}

/// Checks the turn of the centroid with the sun, and equal bits on one thread.
#[test]
fn suns_turn() {
    let mut lit: Vec<LitMoment> =
        YEAR.lit.iter().filter(|moment| moment.direct_normal_lux > 0.0).step_by(300).cloned().collect();
    let scene = compiled(vec![tube(0.254, 1.0, 1.0, 0.6), tube(0.254, 1.0, 1.0, 0.6)]);
    let before = years(&scene, &lit);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(one.install(|| years(&scene, &lit)), before);
    for moment in &mut lit {
        moment.sun = DVec3::new(-moment.sun.y, moment.sun.x, moment.sun.z);
    }
    for (turned, before) in years(&scene, &lit)[0].moments.iter().zip(&before[0].moments) {
        assert!((turned.sun_centroid_m - before.sun_centroid_m.perp()).length() < 1e-12);
        assert!((turned.sun_lm - before.sun_lm).abs() < 1e-9 * before.sun_lm);
    }
}

/// Checks that a clear closure passes what a Lambertian one of the same transmittance does, to the bit, and one of two zones that pass alike
/// too, within the error of its rays.
#[test]
fn other_closures_pass_their_share() {
    let lit: Vec<LitMoment> = YEAR.lit.iter().step_by(200).cloned().collect();
    let mut scene = compiled(vec![tube(0.254, 1.0, 0.98, 0.6); 3]);
    scene.tubes[1].diffuser = Diffuser::Clear { transmittance: [0.6; 3] };
    scene.tubes[2].diffuser = Diffuser::Mixed {
        lambertian_radius_m: 0.08,
        inner: DiffuserZone::Clear,
        lambertian_transmittance: [0.6; 3],
        lambertian_reflectance: [0.0; 3],
        clear_transmittance: [0.6; 3],
    };
    let found = years(&scene, &lit);
    assert_eq!(found[0], found[1]);
    let sum = |year: &TubeYear| year.moments.iter().map(|light| light.lumens()).sum::<f64>();
    assert!(found[2].relative_error > 0.0 && found[2].relative_error < 5e-3);
    assert!((sum(&found[2]) / sum(&found[0]) - 1.0).abs() < 4.0 * found[2].relative_error, "{found:?}");
}
