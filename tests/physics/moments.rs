//! Grids at many moments, each with its own sky and sun, against light tracing of the same moments one by one.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use skyduct::integrator::Integrator;
use skyduct::integrator::method::{RefusalCode, Task};
use skyduct::integrator::moments::{DIRECT_LUX, at_moments, columns, columns_of_all, refuses};
use skyduct::optics::{DiffuserZone, Surface};
use skyduct::scene::{Daylight, EstimateKind, Face, Grid, Scene, Sensor, StraightOrBent, Tube, TubeShape};
use skyduct::sky::zenith::ZenithFormula;
use skyduct::sky::{CieType, Horizon, Moments as YearsOf, Sky, SkyDistribution, SkyMoment, Sun, direction};
use skyduct::statistics::Moments;

use crate::scenes::{
    SIDE, bent, clear, cube, daylight, furnished, lambertian, light_tracing, mixed, peaked, run, straight, traceable,
    values,
};

/// A clear sky with a high sun, an overcast sky, a low sun, and a moment of a sun alone.
fn moments() -> Vec<SkyMoment> {
    let moment = |cie_type: u8, diffuse: f64, direct: f64, altitude_deg: f64, azimuth_deg: f64| {
        let sun = direction(altitude_deg.to_radians(), azimuth_deg.to_radians());
        SkyMoment {
            distribution: SkyDistribution::new(CieType::new(cie_type).unwrap(), sun),
            diffuse_horizontal_lux: diffuse,
            sun,
            direct_normal_lux: direct,
            hours: 1.0,
            occupied_hours: 0.5,
        }
    };
    vec![
        moment(12, 12_000.0, 80_000.0, 62.0, 150.0),
        moment(1, 18_000.0, 0.0, 40.0, 10.0),
        moment(11, 9_000.0, 40_000.0, 24.0, 275.0),
        moment(5, 0.0, 50_000.0, 45.0, 90.0),
    ]
}

/// Computes the values of the first grid of a scene at all moments, in eight passes.
fn by_years(scene: &Scene, under: &dyn Fn(&mut Scene, &Daylight)) -> Vec<Moments> {
    let overcast = daylight(1, 4000.0, 90.0, 0.0);
    let years = YearsOf { years: vec![moments()], of_directional_alone: false, surroundings_shine: true };
    let mut scene = Scene { daylight: Some(overcast.clone()), moments: Some(Arc::new(years)), ..scene.clone() };
    under(&mut scene, &overcast);
    let method = at_moments_of(&scene, 0.002);
    run(&scene, &*method, 8).grids[0].moments.clone()
}

/// Builds light tracing of the moments of a scene for a relative standard error.
fn at_moments_of(scene: &Scene, target: f64) -> Box<dyn Integrator> {
    at_moments(light_tracing(scene, 256, 3), &Task::whole(scene, &traceable(scene)), 5, target)
}

/// Fails unless all sensors have the illuminances that light tracing finds at each moment alone, within 4.5 standard errors (of some
/// hundred values), and half a percent of the sky's light for its division into patches.
#[track_caller]
fn agrees(scene: &Scene, what: &str) {
    agrees_with(scene, what, &|_, _| ());
}

/// Compares as [`agrees`] does a scene to which `under` adds what is around it under a daylight.
#[track_caller]
fn agrees_with(scene: &Scene, what: &str, under: &dyn Fn(&mut Scene, &Daylight)) {
    let found = by_years(scene, under);
    let count = moments().len();
    let mut squares = Moments::default();
    for (number, moment) in moments().iter().enumerate() {
        let zenith = moment.diffuse_horizontal_lux / moment.distribution.horizontal_ratio();
        let sun = Sun { direction: moment.sun, normal_illuminance_lux: moment.direct_normal_lux };
        let daylight = Daylight {
            sky: (zenith > 0.0).then(|| Sky::new(moment.distribution.clone(), zenith)),
            sun: (moment.direct_normal_lux > 0.0).then_some(sun),
            formula: ZenithFormula::GivenZenithLuminance,
        };
        let mut alone = Scene { daylight: Some(daylight.clone()), ..scene.clone() };
        under(&mut alone, &daylight);
        let (lux, errors) = values(&run(&alone, light_tracing(&alone, 4096, 8).as_ref(), 8));
        for (sensor, (lux, error)) in lux.into_iter().zip(errors).enumerate() {
            let value = found[sensor * columns(count) + number];
            let error = error.hypot(value.standard_error());
            let excess = ((value.mean - lux).abs() - 0.005 * lux).max(0.0);
            assert!(
                excess <= 4.5 * error,
                "{what}, moment {number}, sensor {sensor}: {} instead of {lux} +- {error}",
                value.mean
            );
            squares.push((excess / error.max(f64::MIN_POSITIVE)).powi(2));
        }
    }
    assert!(squares.mean < 1.6, "{what}: mean square {}", squares.mean);
}

fn room(tubes: Vec<Tube>, estimate: EstimateKind) -> Scene {
    let mut scene = cube(0.3, 0.5, 0.7, tubes, daylight(1, 4000.0, 90.0, 0.0), estimate);
    scene.grids = vec![Grid::new("desks".into(), 0.7, [4, 4], 0.1, [SIDE, SIDE], estimate)];
    scene
}

#[test]
fn points_below_a_clear_closure() {
    agrees(&room(vec![straight(0.8, 0.95, clear())], EstimateKind::Point), "clear, points");
}

#[test]
fn cells_below_a_bent_tube() {
    agrees(&room(vec![bent(clear())], EstimateKind::CellAverage), "bent, cells");
}

#[test]
fn points_below_lambertian_and_measured_closures() {
    let tubes = [straight(0.8, 0.95, lambertian(0.6, 0.2)), straight(0.5, 0.9, peaked())];
    let mut scene = furnished(tubes, EstimateKind::Point);
    scene.room.luminaires.clear();
    agrees(&scene, "Lambertian and measured, furnished");
}

#[test]
fn cells_below_mixed_closures() {
    let tubes = [straight(0.8, 0.95, mixed(DiffuserZone::Lambertian)), straight(0.5, 0.9, mixed(DiffuserZone::Clear))];
    let mut scene = furnished(tubes, EstimateKind::CellAverage);
    scene.room.luminaires.clear();
    // few of the photons of a moment cross a cell in a glossy lobe
    scene.room.enclosure.paint(Face::East as usize, Some(Surface::diffuse([0.5; 3])));
    agrees(&scene, "mixed, furnished");
}

/// Checks tubes whose panes see a horizon, which covers the low sun of one of the moments, and the ground.
#[test]
fn points_behind_a_horizon() {
    let tilted = |tube: Tube| {
        let TubeShape::Cylinders(shape) = tube.shape else { unreachable!() };
        let cut = Some(direction(1.0, 2.5));
        Tube { shape: TubeShape::Cylinders(StraightOrBent { cut, ..shape }), ..tube }
    };
    let mut scene = room(
        vec![straight(0.8, 0.95, lambertian(0.6, 0.2)), tilted(straight(0.8, 0.95, lambertian(0.6, 0.2)))],
        EstimateKind::Point,
    );
    scene.tubes[0].centre = DVec2::new(0.6, 0.7);
    let clear = Tube { centre: DVec2::new(1.5, 0.6), ..straight(0.8, 0.95, clear()) };
    scene.tubes.push(clear);
    let horizon = Horizon::new(vec![(0.0, 0.15), (1.5, 0.3), (3.0, 0.2), (4.7, 0.6)], 0.2);
    let surroundings = |daylight: &Daylight| Arc::new(daylight.surroundings(horizon.clone(), [0.3, 0.4], 0.0));
    agrees_with(&scene, "behind a horizon", &|scene, daylight| {
        scene.tubes.iter_mut().for_each(|tube| tube.surroundings = Some(surroundings(daylight)));
    });
}

/// Checks what is summed over the moments of each year: the exposure, and the hours in which direct sunlight alone gives 1000 lx. The beam of
/// a sun in the zenith above a short clear pipe lights the point below it, and no other.
#[test]
fn sums_over_moments() {
    let mut scene = room(vec![straight(0.1, 0.95, clear())], EstimateKind::Point);
    scene.grids = vec![Grid::new("row".into(), 0.7, [3, 1], 0.1, [SIDE, SIDE], EstimateKind::Point)];
    let sun = DVec3::Z;
    let moment = |direct_normal_lux: f64, occupied_hours: f64| SkyMoment {
        distribution: SkyDistribution::new(CieType::UNIFORM, sun),
        diffuse_horizontal_lux: 5000.0,
        sun,
        direct_normal_lux,
        hours: 2.0,
        occupied_hours,
    };
    // 0.8 pass the closure
    let lit = DIRECT_LUX / 0.8;
    let years = vec![
        vec![moment(1.05 * lit, 2.0), moment(0.95 * lit, 1.0), moment(2.0 * lit, 0.5)],
        vec![moment(3.0 * lit, 0.25)],
    ];
    let all = columns_of_all(years.iter().map(Vec::len));
    scene.moments = Some(Arc::new(YearsOf { years, of_directional_alone: false, surroundings_shine: true }));
    let values = run(&scene, &*at_moments_of(&scene, 0.05), 2).grids[0].moments.clone();
    assert_eq!((all, values.len()), (8, 24));
    let hours = |place: usize| [0, 1, 2].map(|sensor| values[sensor * all + place].mean);
    assert_eq!([hours(4), hours(7)], [[0.0, 2.5, 0.0], [0.0, 0.25, 0.0]]);
    for of_sensor in values.chunks_exact(all) {
        let sum: f64 = of_sensor[..3].iter().map(|value| 2.0 * value.mean).sum();
        assert!((of_sensor[3].mean / sum - 1.0).abs() < 1e-12);
        assert!((of_sensor[6].mean / (2.0 * of_sensor[5].mean) - 1.0).abs() < 1e-12);
    }
}

/// Checks what is refused: points whose beams come from a bent pipe, and sensors that are in no level grid.
#[test]
fn what_cannot_be_computed_is_refused() {
    let refusal = |scene: &Scene| {
        let traceable = traceable(scene);
        refuses(&Task::whole(scene, &traceable)).map(|refusal| refusal.code)
    };
    let of_tube = |tube: Tube, estimate| refusal(&room(vec![tube], estimate));
    assert_eq!(of_tube(bent(clear()), EstimateKind::Point), Some(RefusalCode::ClearClosuresOfBentTubes));
    assert_eq!(of_tube(bent(clear()), EstimateKind::CellAverage), None);
    assert_eq!(of_tube(straight(0.8, 0.95, clear()), EstimateKind::Point), None);
    let mut scene = room(vec![straight(0.8, 0.95, clear())], EstimateKind::Point);
    let sensor = Sensor { position: DVec3::new(1.0, 1.0, 1.0), normal: DVec3::X };
    scene.grids = vec![Grid::points("wall".into(), vec![sensor])];
    assert_eq!(refusal(&scene), Some(RefusalCode::PlacedSensors));
}
