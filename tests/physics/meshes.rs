//! Meshes that are cylinders are computed as cylinders; others are traced, and no ray leaks.

use crate::documents::first_passes;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

use glam::{DVec2, DVec3};
use serde_json::{Value, json};
use skyduct::document::{FileSource, JobDocument, WarningCode};
use skyduct::engine::checkpoint::encode;
use skyduct::engine::progress::StoppedBy;
use skyduct::engine::spent::Spent;
use skyduct::geometry::{Dropped, TriangleMesh};
use skyduct::guide::mesh::Part;
use skyduct::guide::{End, Guide, MeshGuide};
use skyduct::present::prepared::{Prepared, prepare_document};
use skyduct::sampling::{Key, PathRandom, warp};

const RADIUS: f64 = 0.127;

#[derive(Clone, Copy, PartialEq)]
enum Cover {
    Open,
    Flat,
    Dome,
}

/// A round pipe of 1 m with its vertices on the circle, in two storeys, a diffuser and a cover.
fn tube(sides: u32, cover: Cover) -> TriangleMesh {
    let ring = |height: f64, radius: f64| {
        (0..sides).map(move |k| (DVec2::from_angle(TAU / f64::from(sides) * f64::from(k)) * radius).extend(height))
    };
    let mut mesh = TriangleMesh {
        positions: Vec::new(),
        triangles: Vec::new(),
        triangle_materials: Vec::new(),
        materials: ["pipe", "diffuser", "cover"].map(str::to_owned).to_vec(),
        ..TriangleMesh::default()
    };
    let storey = |mesh: &mut TriangleMesh, material: u32, lower: u32, upper: u32| {
        for k in 0..sides {
            let next = (k + 1) % sides;
            mesh.triangles.push([lower + k, lower + next, upper + next]);
            mesh.triangles.push([lower + k, upper + next, upper + k]);
            mesh.triangle_materials.extend([material; 2]);
        }
    };
    let fan = |mesh: &mut TriangleMesh, material: u32, rim: u32, centre: DVec3| {
        mesh.positions.push(centre);
        let centre = mesh.positions.len() as u32 - 1;
        for k in 0..sides {
            mesh.triangles.push([centre, rim + k, rim + (k + 1) % sides]);
            mesh.triangle_materials.push(material);
        }
    };
    for height in [0.0, 0.4, 1.0] {
        mesh.positions.extend(ring(height, RADIUS));
    }
    storey(&mut mesh, 0, 0, sides);
    storey(&mut mesh, 0, sides, 2 * sides);
    fan(&mut mesh, 1, 0, DVec3::ZERO);
    match cover {
        Cover::Open => {
            // a file may name materials that no triangle has
            mesh.materials.pop();
        }
        Cover::Flat => fan(&mut mesh, 2, 2 * sides, DVec3::Z),
        Cover::Dome => {
            let mut lower = 2 * sides;
            for step in 1..8 {
                let (sin, cos) = (FRAC_PI_2 * f64::from(step) / 8.0).sin_cos();
                let upper = mesh.positions.len() as u32;
                mesh.positions.extend(ring(1.0 + RADIUS * sin, RADIUS * cos));
                storey(&mut mesh, 2, lower, upper);
                lower = upper;
            }
            fan(&mut mesh, 2, lower, DVec3::Z * (1.0 + RADIUS));
        }
    }
    mesh
}

struct One(TriangleMesh);

impl FileSource for One {
    fn load(&self, _: &str) -> Result<Arc<TriangleMesh>, String> {
        Ok(Arc::new(self.0.clone()))
    }
}

fn job(tube: Value) -> Value {
    json!({
        "sky": { "cie_type": 12, "sun_position": { "altitude_deg": 35, "azimuth_deg": 225 },
                 "zenith_luminance_cd_m2": 5000, "direct_normal_illuminance_lux": 60000 },
        "room": { "size_m": [2.032, 2.032, 2.032] },
        "tubes": [tube],
        "grids": [{ "name": "floor", "height_m": 0, "cells": [4, 3] }],
        "views": [{ "name": "room", "eye_m": [1.9, 0.1, 0.3], "look_at_m": [0.9, 1.2, 1.3], "up": [0, 0, 1],
                    "vertical_fov_deg": 90, "size_px": [16, 12] }],
        "seed": 5
    })
}

fn mesh_tube(cover: Cover) -> Value {
    let mut tube = json!({
        "mesh": "tube", "unit": "m", "centre_m": [1.016, 1.016], "opening_diameter_m": 2.0 * RADIUS, "rotation_deg": 11,
        "parts": {
            "pipe": { "role": "pipe", "reflectance": 0.98 },
            "diffuser": { "role": "diffuser", "kind": "lambertian", "transmittance": 0.6, "reflectance": 0.1 },
        }
    });
    if cover != Cover::Open {
        tube["parts"]["cover"] = json!({ "role": "collector", "transmittance": 0.92 });
    }
    tube
}

fn prepare(tube: Value, mesh: TriangleMesh) -> Prepared {
    prepare_document(&JobDocument::parse(job(tube).to_string().as_bytes()).unwrap(), &One(mesh)).unwrap()
}

fn bits(prepared: &Prepared) -> Vec<u8> {
    encode(&first_passes(prepared, 8))
}

fn reason(prepared: &Prepared) -> String {
    prepared.plan_json()["guides"][0]["reason"].as_str().unwrap().to_owned()
}

fn switch(prepared: &Prepared) -> Value {
    prepared.summary_json(&prepared.empty_estimate(), Spent::NOTHING, StoppedBy::MaxPasses)["provenance"]["guides"][0]
        .clone()
}

/// A round mesh gives the bits of the parametric tube, whatever thin cover it has.
#[test]
fn a_round_mesh_is_the_cylinder() {
    for (cover, kind) in [(Cover::Open, "open"), (Cover::Flat, "flat"), (Cover::Dome, "dome")] {
        let recognised = prepare(mesh_tube(cover), tube(96, cover));
        let mut collector = json!({ "kind": kind });
        if cover != Cover::Open {
            collector["transmittance"] = json!(0.92);
        }
        let parametric = json!({
            "centre_m": [1.016, 1.016], "diameter_m": 2.0 * RADIUS, "reflectance": 0.98,
            "segments": [{ "length_m": 1.0 }], "collector": collector,
            "diffuser": { "kind": "lambertian", "transmittance": 0.6, "reflectance": 0.1 }
        });
        let parametric = prepare(parametric, tube(96, cover));
        assert!(bits(&recognised) == bits(&parametric), "{kind}");
        assert_eq!(recognised.plan_json()["guides"][0]["kind"], "closed_form_straight");
        assert_eq!(switch(&recognised), "closed_form_straight_recognised");
        assert_eq!(switch(&parametric), "closed_form_straight");
    }
}

/// The mesh with an elbow at 0.4 m: the middle ring on its mitre, what is above turned by `bend` rad toward +x.
fn bent(mut mesh: TriangleMesh, bend: f64) -> TriangleMesh {
    let (sin, cos) = bend.sin_cos();
    for position in &mut mesh.positions {
        let (x, up) = (position.x, position.z - 0.4);
        if up == 0.0 {
            position.z -= x * (0.5 * bend).tan();
        } else if up > 0.0 {
            (position.x, position.z) = (x * cos + up * sin, 0.4 - x * sin + up * cos);
        }
    }
    mesh
}

/// A round mesh with an elbow gives the light of the parametric tube, whatever thin cover it has, and however it is turned: the
/// same photons to rounding.
#[test]
fn a_round_mesh_with_an_elbow_is_the_bent_guide() {
    for (cover, kind) in [(Cover::Open, "open"), (Cover::Flat, "flat"), (Cover::Dome, "dome")] {
        let recognised = prepare(mesh_tube(cover), bent(tube(96, cover), 30_f64.to_radians()));
        let mut collector = json!({ "kind": kind });
        if cover != Cover::Open {
            collector["transmittance"] = json!(0.92);
        }
        let parametric = json!({
            "centre_m": [1.016, 1.016], "diameter_m": 2.0 * RADIUS, "reflectance": 0.98,
            // +x is east, and the mesh is turned by 11 degrees
            "segments": [{ "length_m": 0.4 }, { "length_m": 0.6, "tilt_deg": 30, "azimuth_deg": 101 }], "collector": collector,
            "diffuser": { "kind": "lambertian", "transmittance": 0.6, "reflectance": 0.1 }
        });
        let parametric = prepare(parametric, tube(96, cover));
        let values = |prepared: &Prepared| -> Vec<f64> {
            let chunk = first_passes(prepared, 8);
            (0..12).map(|sensor| chunk.grids[0].illuminance_lux(sensor)).collect()
        };
        for (found, wanted) in values(&recognised).iter().zip(values(&parametric)) {
            assert!((found / wanted - 1.0).abs() < 1e-6, "{kind}: {found} {wanted}");
        }
        assert_eq!(recognised.plan_json()["guides"][0]["kind"], "closed_form_bent");
        assert_eq!(switch(&recognised), "closed_form_bent_recognised");
    }
}

/// Bends that are something else keep their facets.
#[test]
fn other_bends_keep_their_facets() {
    type Edit = fn(&mut TriangleMesh);
    let cases: [(&str, f64, Edit); 4] = [
        ("does not consist of cylinders", 30.0, |mesh| mesh.positions[100].x += 1e-3),
        ("holes, or is not a single wall", 30.0, |mesh| {
            mesh.triangles.remove(7);
            mesh.triangle_materials.remove(7);
        }),
        ("neither a flat cover nor a hemisphere", 30.0, |mesh| mesh.positions.last_mut().unwrap().x += 0.01),
        ("begin vertically", 30.0, |mesh| mesh.positions[96..].iter_mut().for_each(|at| at.y += 0.2 * at.z)),
    ];
    for (why, degrees, edit) in cases {
        let mut mesh = bent(tube(96, Cover::Dome), degrees.to_radians());
        edit(&mut mesh);
        let prepared = prepare(mesh_tube(Cover::Dome), mesh);
        let reason = reason(&prepared);
        assert!(reason.contains(why), "{why}: {reason}");
        assert_eq!(switch(&prepared), "mesh", "{why}");
    }
}

/// Where a cylinder would be something else, the facets stay, and the plan says why and what they do.
#[test]
fn other_meshes_keep_their_facets() {
    type Edit = fn(&mut Value, &mut TriangleMesh);
    let cases: [(&str, u32, Edit); 8] = [
        ("`recognise` set to false", 96, |tube, _| tube["recognise"] = json!(false)),
        ("at least 16 sides", 12, |_, _| {}),
        ("collector reflects", 96, |tube, _| tube["parts"]["cover"]["reflectance"] = json!(0.05)),
        ("not a straight vertical cylinder", 96, |_, mesh| mesh.positions[100].x += 1e-4),
        ("not a straight vertical cylinder", 96, |tube, _| tube["opening_diameter_m"] = json!(0.26)),
        ("holes, or ends that are not level", 96, |_, mesh| {
            mesh.triangles.remove(7);
            mesh.triangle_materials.remove(7);
        }),
        ("not level", 96, |_, mesh| mesh.positions[200].z += 1e-3),
        ("neither a flat cover nor a hemisphere", 96, |_, mesh| mesh.positions.last_mut().unwrap().z += 0.01),
    ];
    for (why, sides, edit) in cases {
        let (mut document, mut mesh) = (mesh_tube(Cover::Dome), tube(sides, Cover::Dome));
        edit(&mut document, &mut mesh);
        let prepared = prepare(document, mesh);
        let reason = reason(&prepared);
        assert!(reason.contains(why), "{why}: {reason}");
        assert_eq!(switch(&prepared), "mesh", "{why}");
    }
    let kept = prepare(mesh_tube(Cover::Flat), tube(12, Cover::Flat));
    // (12 / 2 pi) sin(2 pi / 12) and 1 / cos(pi / 12)
    let reason = reason(&kept);
    assert!(["0.95493", "1.03528"].iter().all(|factor| reason.contains(factor)), "{reason}");
}

/// Rays aimed at vertices and points of edges of the pipe, up and down its length: in a mesh of perfect mirrors under a
/// clear cover none is lost, and none loses weight.
#[test]
fn rays_at_vertices_and_edges_do_not_leak() {
    for cover in [Cover::Flat, Cover::Dome] {
        let mesh = tube(24, cover);
        let clear = Part::Collector { transmittance: [1.0; 3], reflectance: [0.0; 3] };
        let parts = [Part::Pipe { reflectance: [1.0; 3].into() }, Part::Diffuser, clear];
        let guide = Guide::Mesh(MeshGuide::new(&mesh, &parts, RADIUS).unwrap());
        let mut random = PathRandom::new(Key::new(7));
        for (triangle, material) in mesh.triangles.iter().zip(&mesh.triangle_materials) {
            if *material == 1 {
                continue;
            }
            let corner = |k: usize| mesh.positions[triangle[k % 3] as usize];
            for k in 0..3 {
                for share in [0.0, 0.5, random.uniform()] {
                    let target = corner(k).lerp(corner(k + 1), share);
                    let from = (warp::disc(random.uniform2()) * (0.9 * RADIUS)).extend(0.0);
                    let d = (target - from).normalize();
                    if d.z < 1e-3 {
                        continue;
                    }
                    let transit = guide.up::<1>(from, d, &mut random);
                    assert_eq!(transit.end, End::Top, "{target}");
                    assert_eq!(transit.weight().0, [1.0]);
                    // and from outside through the cover, but for its rim
                    if *material == 2 && (target.z > 1.01 || target.truncate().length() < 0.9 * RADIUS) {
                        let d = (from - target).normalize();
                        let down = guide.down::<1>(target - d, d, &mut random);
                        assert!(down.entered && down.end != End::Lost, "{target} {:?}", down.end);
                    }
                }
            }
        }
    }
}

/// Light through a hole in a pipe is counted as lost and its rays are counted, by methods that follow light and by those that
/// follow paths backward, with a warning; a whole pipe loses none.
#[test]
fn rays_through_a_hole_are_counted() {
    let whole = tube(12, Cover::Flat);
    let mut holed = whole.clone();
    holed.triangles.remove(29);
    holed.triangle_materials.remove(29);
    for method in ["light_tracing", "sppm", "two_stage", "path_tracing", "bidirectional_path_tracing", "photon_mapping"]
    {
        for (mesh, leaks) in [(&whole, false), (&holed, true)] {
            let mut document = job(mesh_tube(Cover::Flat));
            document["method"] = json!(method);
            document["stop"] = json!({ "max_passes": 2 });
            if method == "light_tracing" {
                document["views"] = json!([]);
            }
            let document = JobDocument::parse(document.to_string().as_bytes()).unwrap();
            let prepared = prepare_document(&document, &One(mesh.clone())).unwrap();
            let estimate = first_passes(&prepared, 8);
            assert_eq!(estimate.lost_rays > 0, leaks, "{method}: {} of {}", estimate.lost_rays, estimate.rays);
            let warnings: Vec<_> = prepared.render_warnings(&estimate).iter().map(|warning| warning.code).collect();
            assert_eq!(warnings, if leaks { vec![WarningCode::LostRays] } else { vec![] }, "{method}");
            let energy = estimate.energy;
            assert!(energy.relative_closure_error().abs() < 1e-9, "{method}: {energy:?}");
            if energy.emitted > 0.0 {
                assert_eq!(energy.lost > 0.0, leaks, "{method}: {energy:?}");
            }
        }
    }
}

/// Triangles that the reader of a file left out are told by number.
#[test]
fn dropped_triangles_are_told() {
    let mut mesh = tube(96, Cover::Flat);
    assert_eq!(prepare(mesh_tube(Cover::Flat), mesh.clone()).warnings, []);
    mesh.dropped = Dropped { without_area: 2, repeated: 3 };
    let warnings = prepare(mesh_tube(Cover::Flat), mesh).warnings.clone();
    assert_eq!(warnings.len(), 1);
    assert_eq!(warnings[0].code, WarningCode::DroppedTriangles);
    assert!(warnings[0].detail.starts_with("/tubes/0/mesh: 2 triangles of the file have no area and 3 repeat"));
}
