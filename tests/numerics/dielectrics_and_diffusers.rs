//! Covers within covers, sheets that pass nothing, openings flush with the ceiling, and light that meets them from below.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::num::NonZeroUsize;
use std::sync::atomic::AtomicBool;

use gauss_quad::GaussLegendre;
use glam::{DVec2, DVec3};
use serde_json::{Value, json};
use skyduct::document::FieldErrorCode;
use skyduct::engine::progress::StoppedBy;
use skyduct::geometry::TriangleMesh;
use skyduct::geometry::disc::disc_irradiance;
use skyduct::guide::mesh::Part;
use skyduct::guide::{End, Guide, MeshGuide};
use skyduct::sampling::{Key, PathRandom, warp};
use skyduct::scene::{EstimateKind, Face, Scene, Tube};
use skyduct::statistics::Moments;

use crate::given::{base, refused, with};
use crate::jobs::{Obj, cube, lux, prepared, rendered};
use crate::scenes::{self, RADIUS, SIDE, daylight, lambertian, light_tracing, panel, run, straight, values};
use skyduct::engine::spent::Spent;

/// Surfaces of revolution around the z axis.
struct Turned(TriangleMesh);

/// Sides of a turned surface.
const SIDES: u32 = 32;

impl Turned {
    fn new(materials: &[&str]) -> Self {
        let materials = materials.iter().map(|name| (*name).to_owned()).collect();
        Self(TriangleMesh { materials, ..TriangleMesh::default() })
    }

    /// Rings of the given radii and heights, joined from the first to the last; a radius of 0 is a pole.
    fn surface(mut self, material: u32, profile: &[(f64, f64)]) -> Self {
        let first = self.0.positions.len() as u32;
        for (radius, height) in profile {
            let ring = (0..SIDES).map(|k| DVec2::from_angle(TAU * f64::from(k) / f64::from(SIDES)) * *radius);
            self.0.positions.extend(ring.map(|point| point.extend(*height)));
        }
        for ring in 1..profile.len() as u32 {
            let (lower, upper) = (first + (ring - 1) * SIDES, first + ring * SIDES);
            for k in 0..SIDES {
                let next = (k + 1) % SIDES;
                let halves = [[lower + k, lower + next, upper + next], [lower + k, upper + next, upper + k]];
                let has_area = |[a, b, c]: &[u32; 3]| {
                    let [a, b, c] = [a, b, c].map(|corner| self.0.positions[*corner as usize]);
                    (b - a).cross(c - a).length() > 1e-9
                };
                let halves: Vec<_> = halves.into_iter().filter(has_area).collect();
                self.0.triangle_materials.extend(halves.iter().map(|_| material));
                self.0.triangles.extend(halves);
            }
        }
        self
    }

    fn pipe(self) -> Self {
        self.surface(0, &[(RADIUS, 0.0), (RADIUS, 0.5), (RADIUS, 1.0)])
    }

    fn dome(self, material: u32, radius: f64) -> Self {
        let at = |step: u32| (FRAC_PI_2 * f64::from(step) / 8.0).sin_cos();
        let profile: Vec<_> = (0..=8).map(at).map(|(sin, cos)| (radius * cos, 1.0 + radius * sin)).collect();
        self.surface(material, &profile)
    }
}

/// Everything turned inside out.
fn flipped(mesh: &TriangleMesh) -> TriangleMesh {
    let triangles = mesh.triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
    TriangleMesh { triangles, ..mesh.clone() }
}

fn cover(transmittance: f64) -> Part {
    Part::Collector { transmittance: [transmittance; 3], reflectance: [0.0; 3] }
}

/// Light through two thin domes, one within the other, keeps the product of both shares, downward and upward; through a
/// closed sphere it keeps the square of one. Turning the triangles inside out changes no share.
#[test]
fn covers_within_covers_multiply() {
    let mirror = || Part::Pipe { reflectance: [1.0; 3].into() };
    let nested = Turned::new(&["pipe", "inner", "outer"]).pipe().dome(1, RADIUS).dome(2, 1.5 * RADIUS);
    let nested_parts = [mirror(), cover(0.9), cover(0.7)];
    let at = |step: u32| (-FRAC_PI_2 + PI * f64::from(step) / 16.0).sin_cos();
    let sphere = |(sin, cos): (f64, f64)| (1.4 * RADIUS * cos, 1.0 + 1.5 * RADIUS + 1.4 * RADIUS * sin);
    let profile: Vec<_> = (0..=16).map(at).map(sphere).collect();
    let closed = Turned::new(&["pipe", "sphere"]).pipe().surface(1, &profile);
    for (mesh, parts, share) in [(nested.0, &nested_parts[..], 0.63), (closed.0, &[mirror(), cover(0.8)][..], 0.64)] {
        let guides =
            [mesh.clone(), flipped(&mesh)].map(|mesh| Guide::Mesh(MeshGuide::new(&mesh, parts, RADIUS).unwrap()));
        for k in 0..2000 {
            // in a cone that the sphere's shadow on the pipe covers
            let tilt = 0.3 * f64::from(k) / 2000.0;
            let toward = DVec3::new(tilt.sin() * f64::from(k).cos(), tilt.sin() * f64::from(k).sin(), tilt.cos());
            let point = (warp::disc(PathRandom::new(Key::new(k as u64)).uniform2()) * (0.5 * RADIUS)).extend(1.0);
            let of = |guide: &Guide, up: bool| {
                let mut random = PathRandom::new(Key::new(0));
                match up {
                    true => guide.up::<1>(point.truncate().extend(0.0), DVec3::Z, &mut random),
                    false => guide.down::<1>(point + toward * 2.0, -toward, &mut random),
                }
            };
            for (up, end) in [(false, End::Opening), (true, End::Top)] {
                let [one, other] = [&guides[0], &guides[1]].map(|guide| of(guide, up));
                assert_eq!(one.end, end, "{share} {k}: {one:?}");
                assert!((one.weight().0[0] - share).abs() < 1e-15, "{one:?}");
                assert!((one.position - other.position).length() < 1e-14 && one.weight().0 == other.weight().0);
            }
        }
    }
}

/// Methods that follow photons, and others, each as small as it can be.
fn photon_methods() -> [Value; 4] {
    ["light_tracing", "sppm", "ppm", "photon_mapping"].map(|kind| json!({ "kind": kind, "photons_per_pass": 256 }))
}

fn other_methods() -> [Value; 4] {
    let paths = |kind: &str| json!({ "kind": kind, "samples_per_sensor": 4 });
    [paths("path_tracing"), paths("two_stage"), json!("bidirectional_path_tracing"), json!("holigilm")]
}

/// The cube under a sheet that passes nothing, by one method: zero without an error, as what one photon more would add is
/// nothing, and a job that ends as accurate or as one that no light reaches. Nothing is divided by the mean.
fn assert_known_to_be_dark(method: &Value) {
    let mut document = with(cube(), "/tubes/0/diffuser/transmittance", json!(0));
    document["method"] = method.clone();
    document["stop"] = json!({ "relative_error": 0.02, "max_passes": 64 });
    let prepared = prepared(&document);
    let (estimate, stopped_by) = rendered(&prepared);
    assert_eq!(lux(&estimate), [0.0; 9], "{method}");
    let summary = prepared.summary_json(&estimate, Spent::NOTHING, StoppedBy::MaxPasses);
    assert!(summary["grids"][0]["statistics"]["uniformity"].is_null(), "{summary}");
    assert!((0..9).all(|sensor| estimate.grids[0].standard_error_lux(sensor) == 0.0), "{method}");
    assert!(
        matches!(stopped_by, StoppedBy::RelativeError | StoppedBy::Exact | StoppedBy::NoLight),
        "{method}: {stopped_by:?}"
    );
    // of what no pass brought light to, no relative error is told
    let told = (stopped_by != StoppedBy::NoLight).then_some(0.0);
    assert_eq!(prepared.accuracy(&estimate).grids, told, "{method}");
}

/// A diffuser that passes nothing: zero by every method, and no sensor or statistic that is not a number. Openings without an
/// area are refused.
#[test]
fn a_sheet_that_passes_nothing_leaves_a_dark_room() {
    photon_methods().iter().chain(&other_methods()).for_each(assert_known_to_be_dark);
    refused(&with(base(), "/tubes/0/diameter_m", json!(0)), "/tubes/0/diameter_m", FieldErrorCode::OutOfRange);
    let flat = "v 0 0 0\nv 1 0 0\nv 2 0 0\nusemtl diffuser\nf 1 2 3\n";
    let error = skyduct::document::FileSource::load(&Obj(flat.to_owned()), "").unwrap_err();
    assert!(error.contains("no face in this file has an area"), "{error}");
}

/// The ceiling gets nothing straight from an opening in its plane: with a white ceiling the floor has the bits that it has
/// with a black one, walls and floor being black. A panel in the plane of the ceiling and 1e-6 m below light alike to 1e-5.
#[test]
fn an_opening_in_the_ceiling_lights_no_ceiling() {
    for diffuser in [lambertian(0.5, 0.2), skyduct::optics::Diffuser::Open] {
        let bits = |ceiling: f64| {
            let tube = straight(0.5, 0.95, diffuser.clone());
            let scene =
                scenes::cube(0.0, 0.0, ceiling, vec![tube], daylight(12, 5000.0, 35.0, 225.0), EstimateKind::Point);
            let estimate = run(&scene, &*light_tracing(&scene, 2048, 1), 2);
            values(&estimate).0.iter().map(|lux| lux.to_bits()).collect::<Vec<_>>()
        };
        assert_eq!(bits(0.0), bits(0.9));
    }
    let lit = |below: f64| {
        let centre = DVec3::new(1.0, 1.2, 2.5 - below);
        let mut scene = scenes::electric_room(
            DVec3::new(2.0, 2.4, 2.5),
            0.5,
            vec![panel(centre, 0.4, 0.6, 1000.0)],
            [3, 3],
            EstimateKind::Point,
        );
        scene.room.enclosure.paint(Face::Floor as usize, None);
        values(&run(&scene, &*light_tracing(&scene, 4096, 1), 4)).0
    };
    let flush = lit(0.0);
    for (flush, hanging) in flush.iter().zip(lit(1e-6)) {
        assert!((hanging / flush - 1.0).abs() < 1e-5, "{hanging} {flush}");
    }
}

/// A room whose floor alone reflects, under a uniform disc: what goes up the tube.
fn reflecting_floor(transmittance: f64, reflectance: f64) -> Scene {
    let tube: Tube = straight(1e-9, 1.0, lambertian(transmittance, reflectance));
    scenes::cube(0.5, 0.0, 0.0, vec![tube], daylight(5, 5000.0, 35.0, 0.0), EstimateKind::Point)
}

/// Light that meets a diffuser from below leaves upward: irradiance times area times its transmittance. From a floor of
/// reflectance rho below a disc of exitance M, U = rho M int F^2 dA with the disc's form factor F arrives, as F is that from
/// a point to the disc and back. What a sheet keeps and what it lets up from there are in the ratio of its shares.
#[test]
fn light_from_below_leaves_through_the_diffuser() {
    let transmittance = 0.4;
    let scene = reflecting_floor(transmittance, 0.0);
    let method = light_tracing(&scene, 65_536, 1);
    let (mut top, mut absorbed) = (Moments::default(), Moments::default());
    for pass in 0..16 {
        let energy = method.pass(pass, &AtomicBool::new(false)).unwrap().totals.energy;
        let above = energy.emitted - energy.collector - energy.guide;
        top.push(energy.guide_top);
        absorbed.push(energy.diffuser - (1.0 - transmittance) * above);
    }
    let rule = GaussLegendre::new(NonZeroUsize::new(32).unwrap());
    let factor = |x: f64, y: f64| disc_irradiance(RADIUS, SIDE, (x - 0.5 * SIDE).hypot(y - 0.5 * SIDE)).vertical;
    let squared = rule.integrate(0.0, SIDE, |x| rule.integrate(0.0, SIDE, |y| factor(x, y).powi(2)));
    let arriving = 0.5 * transmittance * PI * 5000.0 * squared;
    println!("{top:?}, {}", transmittance * arriving);
    assert!((top.mean - transmittance * arriving).abs() < 4.0 * top.standard_error(), "{top:?} {arriving}");
    assert!(top.standard_error() < 0.05 * top.mean);
    assert!((absorbed.mean / top.mean - (1.0 - transmittance) / transmittance).abs() < 1e-9, "{absorbed:?} {top:?}");

    // with a share sent back, below as above
    let (transmittance, reflectance) = (0.4, 0.35);
    let scene = reflecting_floor(transmittance, reflectance);
    let energy = light_tracing(&scene, 65_536, 2).pass(0, &AtomicBool::new(false)).unwrap().totals.energy;
    let above = energy.emitted - energy.collector - energy.guide;
    let kept = 1.0 - transmittance - reflectance;
    let (up, absorbed) = (energy.guide_top - reflectance * above, energy.diffuser - kept * above);
    assert!(up > 0.0 && (absorbed / up - kept / transmittance).abs() < 1e-9, "{absorbed} {up}");
}
