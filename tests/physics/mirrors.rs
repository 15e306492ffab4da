//! Mirrors whose reflectance depends on the angle of incidence.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use glam::DVec3;
use skyduct::geometry::TriangleMesh;
use skyduct::guide::mesh::Part;
use skyduct::guide::{BentGuide, End, Guide, MeshGuide, StraightGuide};
use skyduct::optics::Mirror;
use skyduct::optics::mirror::MirrorTable;
use skyduct::sampling::{Key, PathRandom, Replicate, warp};

const RADIUS: f64 = 0.127;

fn table(rows: &[(f64, f64)]) -> Mirror {
    let rows: Vec<_> = rows.iter().map(|(angle, value)| (*angle, [*value; 3])).collect();
    Mirror::ByAngle(Arc::new(MirrorTable::new(&rows).unwrap()))
}

fn straight(length: f64, reflectance: Mirror) -> Guide {
    Guide::Straight(StraightGuide { radius: RADIUS, length, reflectance, collector_transmittance: [1.0; 3] })
}

fn bent(bend_deg: f64, reflectance: Mirror) -> Guide {
    let (sin, cos) = bend_deg.to_radians().sin_cos();
    let axes = [(0.5, DVec3::Z), (0.5, DVec3::new(sin, 0.0, cos))];
    Guide::Bent(BentGuide::new(RADIUS, &axes, reflectance, [1.0; 3]))
}

/// An open prism of 12 sides.
fn prism(reflectance: Mirror) -> Guide {
    let ring = |z: f64| (0..12).map(move |k| (glam::DVec2::from_angle(PI / 6.0 * f64::from(k)) * RADIUS).extend(z));
    let triangles = (0..12).flat_map(|k| {
        let next = (k + 1) % 12;
        [[k, next, next + 12], [k, next + 12, k + 12]]
    });
    let triangles: Vec<[u32; 3]> = triangles.collect();
    let mesh = TriangleMesh {
        positions: ring(0.0).chain(ring(1.0)).collect(),
        triangle_materials: vec![0; triangles.len()],
        triangles,
        materials: vec!["pipe".into()],
        ..TriangleMesh::default()
    };
    Guide::Mesh(MeshGuide::new(&mesh, &[Part::Pipe { reflectance }], RADIUS).unwrap())
}

/// A table of one value is that number, in every kind of guide; the same paths, weights to 1e-12.
#[test]
fn constant_tables_are_numbers() {
    let flat = || table(&[(0.0, 0.93), (1.0, 0.93), (FRAC_PI_2, 0.93)]);
    let number = || Mirror::Constant([0.93; 3]);
    let pairs = [
        (straight(1.0, flat()), straight(1.0, number())),
        (bent(40.0, flat()), bent(40.0, number())),
        (prism(flat()), prism(number())),
    ];
    let mut random = PathRandom::new(Key::new(1));
    for (with_table, with_number) in pairs {
        let mut arrived = 0;
        for k in 0..3000 {
            let d = -warp::cosine_hemisphere(random.uniform2());
            let Some(entry) = with_table.entry(random.uniform2(), d) else { continue };
            let own = || PathRandom::new(Key::new(k));
            let a = with_table.down::<1>(entry.position, d, &mut own());
            let b = with_number.down::<1>(entry.position, d, &mut own());
            assert_eq!((a.end, a.position), (b.end, b.position));
            assert!((a.weight().0[0] - b.weight().0[0]).abs() < 1e-12);
            arrived += i32::from(a.end == End::Opening);
        }
        assert!(arrived > 1000);
    }
}

/// The integral of Swift and Smith (1995) with the reflectance of each chord: it meets the wall at cos i = sin(theta) s.
fn beam_quadrature(aspect: f64, theta: f64, reflectance: impl Fn(f64) -> f64) -> f64 {
    let nodes = 400_000;
    let sum: f64 = (0..nodes)
        .map(|k| {
            // s = sin(phi) takes the singularity away
            let s = ((f64::from(k) + 0.5) / f64::from(nodes) * FRAC_PI_2).sin();
            let chords = aspect * theta.tan() / s;
            let n = chords.floor();
            let r = reflectance(theta.sin() * s);
            s * s * r.powf(n) * (1.0 - (1.0 - r) * (chords - n))
        })
        .sum();
    sum * 4.0 / PI * FRAC_PI_2 / f64::from(nodes)
}

/// Parallel light through a straight tube. 16 replicates of 4096 points each: 5 standard errors of their mean, with the
/// heavier tails of Student's t, plus 1e-5 for the quadrature's jumps.
#[test]
fn beams_follow_the_integral_over_chords() {
    let rows = [(0.0, 0.80), (0.8, 0.9), (1.3, 0.7), (FRAC_PI_2, 1.0)];
    let guide = straight(1.0, table(&rows));
    let reflectance = |cosine: f64| {
        let angle = cosine.acos();
        let next = rows.iter().position(|row| row.0 > angle).unwrap_or(rows.len() - 1);
        let ((a, from), (b, to)) = (rows[next - 1], rows[next]);
        from + (to - from) * (angle - a) / (b - a)
    };
    let mut random = PathRandom::new(Key::new(0));
    for theta_deg in [10.0, 35.0, 60.0, 75.0f64] {
        let theta = theta_deg.to_radians();
        let truth = beam_quadrature(1.0 / (2.0 * RADIUS), theta, reflectance);
        let d = DVec3::new(theta.sin(), 0.0, -theta.cos());
        let mut means = skyduct::statistics::Moments::default();
        for block in 0..16 {
            let (replicate, _) = Replicate::of(Key::new(block), 0);
            let mut sum = 0.0;
            for index in 0..4096 {
                let [u, v, ..] = replicate.point(index, 0);
                let entry = guide.entry([u, v], d).unwrap();
                sum += guide.down::<1>(entry.position, d, &mut random).weight().0[0];
            }
            means.push(sum / 4096.0);
        }
        println!("{theta_deg}: {} is {truth} +- {}", means.mean, means.standard_error());
        assert!(
            (means.mean - truth).abs() < 5.0 * means.standard_error() + 1e-5,
            "{theta_deg}: {} {truth}",
            means.mean
        );
    }
}

/// A bend of nothing is the straight tube, with a table too.
#[test]
fn no_bend_equals_straight() {
    let mirror = || table(&[(0.0, 0.8), (1.0, 0.9), (FRAC_PI_2, 1.0)]);
    let (a, b) = (straight(1.0, mirror()), bent(0.0, mirror()));
    let mut random = PathRandom::new(Key::new(2));
    for _ in 0..2000 {
        let d = -warp::cosine_hemisphere(random.uniform2());
        let entry = a.entry(random.uniform2(), d).unwrap();
        let (a, b) = (a.down::<1>(entry.position, d, &mut random), b.down::<1>(entry.position, d, &mut random));
        assert!((a.weight().0[0] - b.weight().0[0]).abs() < 1e-11, "{a:?} {b:?}");
    }
}
