//! Dielectric domes against closed forms, a separate ray tracer that follows every branch, and reciprocity.

use std::f64::consts::PI;

use crate::scenes::{RADIUS, cube, daylight, lambertian, light_tracing, run, straight};
use glam::DVec3;
use skyduct::guide::dome::PipeBelow;
use skyduct::guide::{BentGuide, DomedGuide, End, Guide, StraightGuide};
use skyduct::optics::Collector;
use skyduct::optics::fresnel::slab_transmittance;
use skyduct::sampling::{Key, PathRandom, warp};
use skyduct::scene::{EstimateKind, Scene, Segment, TubeShape};
use skyduct::sky::direction;
use skyduct::statistics::Moments;

fn straight_pipe(length: f64, reflectance: f64) -> StraightGuide {
    StraightGuide { radius: RADIUS, length, reflectance: [reflectance; 3].into(), collector_transmittance: [1.0; 3] }
}

fn domed(length: f64, reflectance: f64, index: f64, thickness: f64, absorption: f64) -> Guide {
    let pipe = PipeBelow::Straight(straight_pipe(length, reflectance));
    Guide::Domed(Box::new(DomedGuide::new(pipe, index, thickness, absorption)))
}

/// Share of the light at a point and direction that arrives in the opening.
fn arrives(guide: &Guide, position: DVec3, direction: DVec3, random: &mut PathRandom) -> f64 {
    let transit = guide.down::<1>(position, direction, random);
    if transit.end == End::Opening { transit.weight().0[0] } else { 0.0 }
}

/// A shell on the plane z = 0, every branch of whose light is followed.
struct BranchingShell {
    inner: f64,
    outer: f64,
    index: f64,
    absorption: f64,
}

/// Light through the plane z = 0 within the inner sphere, and through the outer sphere.
#[derive(Clone, Copy, Default)]
struct Branches {
    aperture: f64,
    outside: f64,
}

impl BranchingShell {
    /// Reflectances by Fresnel's sine and tangent formulas: s, p.
    fn reflectances(sine: f64, index_ratio: f64) -> [f64; 2] {
        let incidence = sine.asin();
        if sine / index_ratio >= 1.0 {
            return [1.0; 2];
        }
        let beyond = (sine / index_ratio).asin();
        if sine < 1e-6 {
            let r = (index_ratio - 1.0) / (index_ratio + 1.0);
            return [r * r; 2];
        }
        let s = (incidence - beyond).sin() / (incidence + beyond).sin();
        let p = (incidence - beyond).tan() / (incidence + beyond).tan();
        [s * s, p * p]
    }

    /// A ray of `shares` (s, p) in the shell or in the air inside of it.
    fn follow(&self, p: DVec3, d: DVec3, in_shell: bool, shares: [f64; 2], sum: &mut Branches) {
        if shares[0] + shares[1] < 1e-6 {
            return;
        }
        // distances beyond a little to both spheres and to the plane
        let sphere = |radius: f64| {
            let b = p.dot(d);
            let under = b * b - p.length_squared() + radius * radius;
            let roots = if under > 0.0 { [-b - under.sqrt(), -b + under.sqrt()] } else { [f64::NAN; 2] };
            roots.into_iter().filter(|t| *t > 1e-9).fold(f64::INFINITY, f64::min)
        };
        let (to_inner, to_outer) = (sphere(self.inner), if in_shell { sphere(self.outer) } else { f64::INFINITY });
        let to_plane = if d.z < 0.0 { -p.z / d.z } else { f64::INFINITY };
        let length = to_inner.min(to_outer).min(to_plane);
        let shares = if in_shell { shares.map(|share| share * (-self.absorption * length).exp()) } else { shares };
        if to_plane <= to_inner.min(to_outer) {
            sum.aperture += if in_shell { 0.0 } else { shares[0] + shares[1] };
            return;
        }
        let at = p + d * length;
        let outward = at.normalize();
        let normal = if outward.dot(d) > 0.0 { -outward } else { outward };
        let sine = normal.cross(d).length();
        let ratio = if in_shell { 1.0 / self.index } else { self.index };
        let reflected = Self::reflectances(sine, ratio);
        let mirrored = d - normal * 2.0 * d.dot(normal);
        let part = |factor: [f64; 2]| [shares[0] * factor[0], shares[1] * factor[1]];
        self.follow(at, mirrored, in_shell, part(reflected), sum);
        if sine / ratio < 1.0 {
            // Snell: the component along the face shrinks by the ratio
            let along = (d - normal * d.dot(normal)) / ratio;
            let onward = along - normal * (1.0 - along.length_squared()).sqrt();
            let passed = part(reflected.map(|r| 1.0 - r));
            if to_outer < to_inner {
                sum.outside += passed[0] + passed[1];
            } else {
                self.follow(at, onward, !in_shell, passed, sum);
            }
        }
    }

    /// Light from outside at a point of the outer sphere.
    fn enter(&self, p: DVec3, d: DVec3) -> Branches {
        let normal = p.normalize();
        let along = (d - normal * d.dot(normal)) / self.index;
        let onward = along - normal * (1.0 - along.length_squared()).sqrt();
        let reflected = Self::reflectances(normal.cross(d).length(), self.index);
        let mut sum = Branches { outside: 0.5 * (reflected[0] + reflected[1]), ..Branches::default() };
        self.follow(p, onward, true, reflected.map(|r| 0.5 * (1.0 - r)), &mut sum);
        sum
    }
}

/// Parallel light at several altitudes and light from within, ray by ray: the mean difference between the guide, which
/// chooses branches, and the tracer, which follows them all, is within 4 standard errors.
#[test]
fn agrees_with_all_branches() {
    let mut random = PathRandom::new(Key::new(4));
    for (thickness, absorption) in [(0.003, 0.0), (0.003, 20.0), (0.04, 2.0)] {
        let guide = domed(1e-9, 1.0, 1.49, thickness, absorption);
        let shell = BranchingShell { inner: RADIUS, outer: RADIUS + thickness, index: 1.49, absorption };
        let n = 4000;
        for altitude in [-40.0, 0.0, 5.0, 15.0, 35.0, 60.0, 90.0f64] {
            let d = -direction(altitude.to_radians(), 1.0);
            let (mut difference, mut truth) = (Moments::default(), Moments::default());
            for _ in 0..n {
                let entry = guide.entry(random.uniform2(), d).unwrap();
                let all = shell.enter(entry.position - DVec3::Z * 1e-9, d).aperture;
                truth.push(all);
                difference.push(arrives(&guide, entry.position, d, &mut random) - all);
            }
            println!(
                "{thickness} m, {altitude} deg: {:.5}, off by {:.1e} +- {:.1e}",
                truth.mean,
                difference.mean,
                difference.standard_error()
            );
            // a branch of less than 1e-6 of the light is not followed
            assert!(difference.mean.abs() < 4.0 * difference.standard_error() + 1e-5, "{altitude}");
            assert!(truth.mean > 5e-4);
        }
        let mut difference = Moments::default();
        for _ in 0..n {
            let d = warp::cosine_hemisphere(random.uniform2());
            let p = (warp::disc(random.uniform2()) * RADIUS).extend(0.0);
            let mut sum = Branches::default();
            shell.follow(p, d, false, [0.5; 2], &mut sum);
            let transit = guide.up::<1>(p, d, &mut random);
            let chosen = if transit.end == End::Top { transit.weight().0[0] } else { 0.0 };
            difference.push(chosen - sum.outside);
        }
        assert!(difference.mean.abs() < 4.0 * difference.standard_error() + 1e-5, "{}", difference.mean);
    }
}

/// A vanishing shell over an axial beam: at each point the pane of its slope.
#[test]
fn thin_dome_is_a_curved_pane() {
    let guide = domed(1e-9, 1.0, 1.49, 1e-7, 0.0);
    let mut random = PathRandom::new(Key::new(8));
    let mut mean = Moments::default();
    for _ in 0..20_000 {
        let entry = guide.entry(random.uniform2(), DVec3::NEG_Z).unwrap();
        let pane = slab_transmittance(entry.position.z / RADIUS, 1.49, 0.0);
        let weight = arrives(&guide, entry.position, DVec3::NEG_Z, &mut random);
        // light that goes once more round the shell has the same weight
        mean.push(weight - pane);
    }
    assert!(mean.mean.abs() < 4.0 * mean.standard_error() + 1e-6, "{} {}", mean.mean, mean.standard_error());
    assert!(mean.standard_error() * 20_000f64.sqrt() < 0.02, "the entry is not a coin");
    let pole = arrives(&guide, DVec3::Z * (RADIUS + 1e-7 + 1e-9), DVec3::NEG_Z, &mut random);
    assert!((pole - 0.9254371).abs() < 1e-7);
}

/// An index of one does nothing: every ray that meets the aperture goes the way that it has without the dome.
#[test]
fn index_one_is_open() {
    let (guide, open) = (domed(1.0, 0.98, 1.0, 0.003, 0.0), Guide::Straight(straight_pipe(1.0, 0.98)));
    let mut random = PathRandom::new(Key::new(6));
    let (mut with, mut without) = (Moments::default(), Moments::default());
    for _ in 0..20_000 {
        let d = -warp::cosine_hemisphere(random.uniform2());
        let entry = guide.entry(random.uniform2(), d).unwrap();
        let a = guide.down::<1>(entry.position, d, &mut random);
        let to_aperture = entry.position + d * ((1.0 - entry.position.z) / d.z);
        let meets = to_aperture.truncate().length() < RADIUS;
        assert_eq!(a.end == End::Opening, meets);
        if meets {
            let b = open.down::<1>(to_aperture, d, &mut random);
            assert!((a.weight().0[0] - b.weight().0[0]).abs() < 1e-12);
            let tolerance = 1e-9 * (1.0 + d.truncate().length() / -d.z);
            assert!((a.position - b.position).length() < tolerance, "{:?} {:?}", a.position, b.position);
        }
        let up = guide.up::<1>(warp::disc(random.uniform2()).extend(0.0) * RADIUS, -d, &mut random);
        assert_eq!(up.end, End::Top);
        // flux of parallel light, whose cosine is in the directions' density
        with.push(a.weight().0[0] * f64::from(meets) * entry.projected_area_m2 / -d.z);
        let entry = open.entry(random.uniform2(), d).unwrap();
        without.push(arrives(&open, entry.position, d, &mut random) * entry.projected_area_m2 / -d.z);
    }
    let error = with.standard_error().hypot(without.standard_error());
    assert!((with.mean - without.mean).abs() < 4.0 * error, "{} {}", with.mean, without.mean);
}

/// Isotropic light: as much flux comes down from a sphere of luminance 1 as goes up from an opening of luminance 1.
#[test]
fn down_and_up_are_reciprocal() {
    let (sin, cos) = 40f64.to_radians().sin_cos();
    let bend = [(0.4, DVec3::Z), (0.4, DVec3::new(sin, 0.0, cos))];
    let pipes = [
        PipeBelow::Straight(straight_pipe(0.5, 0.9)),
        PipeBelow::Bent(BentGuide::new(RADIUS, &bend, [0.95; 3].into(), [1.0; 3])),
    ];
    let mut random = PathRandom::new(Key::new(3));
    for pipe in pipes {
        let guide = Guide::Domed(Box::new(DomedGuide::new(pipe, 1.6, 0.01, 3.0)));
        let (mut down, mut up, mut back) = (Moments::default(), Moments::default(), Moments::default());
        for _ in 0..200_000 {
            let d = warp::cone(random.uniform2(), PI);
            let entry = guide.entry(random.uniform2(), d).unwrap();
            let weight = arrives(&guide, entry.position, d, &mut random);
            down.push(4.0 * PI * entry.projected_area_m2 * weight);
            let p = (warp::disc(random.uniform2()) * RADIUS).extend(0.0);
            let transit = guide.up::<1>(p, warp::cosine_hemisphere(random.uniform2()), &mut random);
            let weight = PI * PI * RADIUS * RADIUS * transit.weight().0[0];
            up.push(if transit.end == End::Top { weight } else { 0.0 });
            back.push(if transit.end == End::Opening { weight } else { 0.0 });
        }
        let error = down.standard_error().hypot(up.standard_error());
        println!("down {} up {} back {} +- {error}", down.mean, up.mean, back.mean);
        assert!((down.mean - up.mean).abs() < 4.0 * error, "{} {}", down.mean, up.mean);
        assert!(back.mean > 0.01 * up.mean, "a dome sends light back down");
    }
}

fn room(collector: Collector, bend_deg: f64) -> Scene {
    let mut tube = straight(0.6, 0.95, lambertian(0.6, 0.3));
    if let TubeShape::Cylinders(cylinders) = &mut tube.shape {
        cylinders.collector = collector;
        if bend_deg > 0.0 {
            cylinders.segments.push(Segment { length_m: 0.4, tilt: bend_deg.to_radians(), azimuth: 0.3 });
        }
    }
    cube(0.2, 0.5, 0.7, vec![tube], daylight(12, 5000.0, 25.0, 225.0), EstimateKind::Point)
}

fn dome(refractive_index: f64, absorption_per_m: f64) -> Collector {
    Collector::DielectricDome { refractive_index, thickness_m: 0.003, absorption_per_m }
}

/// The energy balance closes, and fluxes are those of an open tube when the dome does nothing.
#[test]
fn rooms_under_domes_balance() {
    for bend_deg in [0.0, 50.0] {
        let estimate = |collector: Collector| {
            let scene = room(collector, bend_deg);
            let estimate = run(&scene, &*light_tracing(&scene, 8192, 5), 24);
            assert!(estimate.energy.relative_closure_error().abs() < 1e-9, "{:?}", estimate.energy);
            estimate
        };
        let (open, nothing) = (estimate(Collector::Open), estimate(dome(1.0, 0.0)));
        let (glass, grey) = (estimate(dome(1.49, 0.0)), estimate(dome(1.49, 10.0)));
        let flux = |estimate: &skyduct::estimate::Estimate| estimate.tubes[0].into_room;
        let error = flux(&open).standard_error().hypot(flux(&nothing).standard_error());
        assert!((flux(&open).mean - flux(&nothing).mean).abs() < 4.0 * error);
        let share = flux(&glass).mean / flux(&open).mean;
        println!("bend {bend_deg}: a dome of glass leaves {share:.4}");
        assert!(share > 0.85 && share < 1.0, "{share}");
        assert!(flux(&grey).mean < flux(&glass).mean * 0.98);
        assert!(glass.energy.collector > 0.0);
    }
}
