//! Tubes of job documents: their shape, their mirrors, collectors and diffusers.

use std::sync::Arc;

use crate::given::{SquarePipe, base, mesh_tube, refused, with};
use crate::schema::parse;
use serde_json::{Value, json};
use skyduct::document::{FieldErrorCode, FileSource, to_scene};
use skyduct::geometry::TriangleMesh;
use skyduct::optics::{Collector, Diffuser};
use skyduct::scene::{Channels, TubeShape};

#[test]
fn tubes_bend_touch_and_overlap() {
    let folded = json!([{ "length_m": 1 }, { "length_m": 1, "tilt_deg": 90, "azimuth_deg": 0 },
                        { "length_m": 1, "tilt_deg": 90, "azimuth_deg": 180 }]);
    refused(&with(base(), "/tubes/0/segments", folded), "/tubes/0/segments/2/tilt_deg", FieldErrorCode::Invalid);
    let down = json!([{ "length_m": 0.5 }, { "length_m": 1, "tilt_deg": 90 }, { "length_m": 1, "tilt_deg": 135 }]);
    refused(&with(base(), "/tubes/0/segments", down), "/tubes/0/segments/2/tilt_deg", FieldErrorCode::Invalid);
    refused(
        &with(base(), "/tubes/0/segments", json!(vec![json!({ "length_m": 1 }); 17])),
        "/tubes/0/segments",
        FieldErrorCode::Invalid,
    );
    let tiny = with(base(), "/tubes/0/segments", json!([{ "length_m": 1e-9 }]));
    assert!(parse(&tiny).is_ok());

    let tube = base()["tubes"][0].clone();
    let beside = |y: f64| {
        let mut second = tube.clone();
        second["centre_m"] = json!([1.016, y]);
        with(base(), "/tubes/-", second)
    };
    let overlap = refused(&beside(1.2), "/tubes/1/centre_m", FieldErrorCode::Invalid);
    // a diameter of 0.254 m, of which 0.184 m are there
    assert!(overlap.detail.contains("lie apart if it moves away by 0.07 m"), "{overlap}");
    assert!(parse(&beside(1.016 + 0.254)).is_ok());
    let many: Vec<_> = vec![tube.clone(); 1025];
    refused(&with(base(), "/tubes", json!(many)), "/tubes", FieldErrorCode::TooMany);
    refused(
        &with(base(), "/room/surfaces/ceiling", json!({ "open": true })),
        "/room/surfaces/ceiling/open",
        FieldErrorCode::Invalid,
    );

    let lambertian = json!({ "kind": "lambertian", "transmittance": [0.6, 0.6, 0.6], "reflectance": 0.5 });
    refused(&with(base(), "/tubes/0/diffuser", lambertian), "/tubes/0/diffuser/transmittance", FieldErrorCode::Invalid);
    let mixed = |radius: f64| {
        json!({ "kind": "mixed", "lambertian_radius_m": radius, "inner": "lambertian",
                "lambertian_transmittance": 0.6, "clear_transmittance": 0.9 })
    };
    refused(
        &with(base(), "/tubes/0/diffuser", mixed(0.2)),
        "/tubes/0/diffuser/lambertian_radius_m",
        FieldErrorCode::OutOfRange,
    );
    assert!(parse(&with(base(), "/tubes/0/diffuser", mixed(0.06))).is_ok());
    // a perfect mirror is a bound, not an error
    assert!(parse(&with(base(), "/tubes/0/reflectance", json!(1))).is_ok());
}

#[test]
fn mesh_tubes() {
    let document = with(base(), "/tubes/0", mesh_tube());
    let parsed = parse(&document).unwrap();
    let (scene, ..) = to_scene(&parsed, &SquarePipe).unwrap();
    let TubeShape::Mesh(mesh) = &scene.tubes[0].shape else { panic!("a mesh") };
    assert_eq!(mesh.parts.len(), 3);

    let bad = |pointer: &str, value: Value| with(document.clone(), pointer, value);
    refused(&bad("/tubes/0/mesh", json!("nothing")), "/tubes/0/mesh", FieldErrorCode::Invalid);
    refused(&bad("/tubes/0/unit", Value::Null), "/tubes/0/unit", FieldErrorCode::Missing);
    refused(&bad("/tubes/0/unit", json!("inch")), "/tubes/0/unit", FieldErrorCode::Invalid);
    let without = refused(&bad("/tubes/0/parts/a~1b", Value::Null), "/tubes/0/parts", FieldErrorCode::Invalid);
    assert!(without.detail.contains("\"a/b\""), "{without}");
    refused(
        &bad("/tubes/0/parts/glue", json!({ "role": "pipe", "reflectance": 0.9 })),
        "/tubes/0/parts/glue",
        FieldErrorCode::Invalid,
    );
    refused(
        &bad("/tubes/0/parts/a~1b/reflectance", json!(2)),
        "/tubes/0/parts/a~1b/reflectance",
        FieldErrorCode::OutOfRange,
    );
    refused(
        &bad("/tubes/0/parts/cover/reflectance", json!(0.5)),
        "/tubes/0/parts/cover/transmittance",
        FieldErrorCode::Invalid,
    );
    refused(&bad("/tubes/0/parts/diffuser/kind", Value::Null), "/tubes/0/parts/diffuser/kind", FieldErrorCode::Missing);
    refused(&bad("/tubes/0/parts/a~1b/role", json!("diffuser")), "/tubes/0/parts/a~1b/kind", FieldErrorCode::Missing);
    let second = json!({ "role": "diffuser", "kind": "clear", "transmittance": 0.9 });
    refused(&bad("/tubes/0/parts/cover", second), "/tubes/0/parts/diffuser", FieldErrorCode::NotSupported);
    let high = json!({ "role": "diffuser", "kind": "lambertian", "transmittance": 0.6 });
    refused(&bad("/tubes/0/parts/cover", high), "/tubes/0/parts/cover", FieldErrorCode::NotSupported);
    // millimetres given as metres: out of every bound of a building
    let mut far = TriangleMesh::clone(&SquarePipe.load("pipe").unwrap());
    far.positions.iter_mut().for_each(|position| *position *= 1e8);
    struct Far(Arc<TriangleMesh>);
    impl FileSource for Far {
        fn load(&self, _: &str) -> Result<Arc<TriangleMesh>, String> {
            Ok(self.0.clone())
        }
    }
    let errors = to_scene(&parsed, &Far(Arc::new(far))).unwrap_err();
    assert_eq!(errors.0[0].pointer, "/tubes/0/mesh");
}

#[test]
fn dielectric_domes_are_read() {
    let read = |dome: Value| {
        let document = with(base(), "/tubes/0/collector", dome);
        let (scene, ..) = to_scene(&parse(&document).unwrap(), &SquarePipe).unwrap();
        let TubeShape::Cylinders(cylinders) = &scene.tubes[0].shape else { panic!("a mesh") };
        cylinders.collector
    };
    let mut dome = json!({ "kind": "dielectric_dome", "refractive_index": 1.49, "thickness_m": 0.003 });
    let clear = Collector::DielectricDome { refractive_index: 1.49, thickness_m: 0.003, absorption_per_m: 0.0 };
    assert_eq!(read(dome.clone()), clear);
    dome["absorption_per_m"] = json!(2);
    let grey = Collector::DielectricDome { refractive_index: 1.49, thickness_m: 0.003, absorption_per_m: 2.0 };
    assert_eq!(read(dome), grey);
}

#[test]
fn mirrors_may_depend_on_the_angle() {
    let read = |reflectance: Value| {
        let document = with(base(), "/tubes/0/reflectance", reflectance);
        parse(&document).map(|document| to_scene(&document, &SquarePipe).unwrap().0)
    };
    let table = json!({ "incidence_deg": [0, 60, 90], "reflectance": [0.9, [0.8, 0.7, 0.6], 1] });
    let scene = read(table.clone()).unwrap();
    assert_eq!(scene.channels, Channels::Rgb);
    let TubeShape::Cylinders(cylinders) = &scene.tubes[0].shape else { panic!("a mesh") };
    let middle = cylinders.reflectance.reflectance(|| 30f64.to_radians().cos());
    for (value, truth) in middle.iter().zip([0.85, 0.8, 0.75]) {
        assert!((value - truth).abs() < 1e-12, "{middle:?}");
    }
    let at = |field: &str, value: Value| with(base(), "/tubes/0/reflectance", with(table.clone(), field, value));
    let cases = [
        ("/incidence_deg", json!([0, 90, 60]), "/incidence_deg/2", FieldErrorCode::Invalid),
        ("/incidence_deg", json!([0, 60, 89]), "/incidence_deg/2", FieldErrorCode::Invalid),
        ("/incidence_deg", json!([1, 60, 90]), "/incidence_deg/0", FieldErrorCode::Invalid),
        ("/reflectance", json!([0.9, 1]), "/reflectance", FieldErrorCode::Invalid),
        ("/reflectance/1", json!(1.2), "/reflectance/1", FieldErrorCode::OutOfRange),
        ("/reflectance", Value::Null, "/reflectance", FieldErrorCode::Missing),
        ("/angle", json!(1), "/angle", FieldErrorCode::UnknownField),
    ];
    for (field, value, pointer, code) in cases {
        refused(&at(field, value), &format!("/tubes/0/reflectance{pointer}"), code);
    }
    // what does not depend on the angle says so
    let document = with(base(), "/tubes/0", mesh_tube());
    let on_cover = with(document, "/tubes/0/parts/cover/reflectance", table);
    refused(&on_cover, "/tubes/0/parts/cover/reflectance", FieldErrorCode::Invalid);
}

#[test]
fn measured_diffusers_are_read_and_judged() {
    let table = json!({
        "kind": "measured", "incidence_deg": [0, 60, 90], "exit_deg": [0, 30, 90],
        "btdf_per_sr": [[0.3, 0.2, 0.1], [0.2, 0.2, 0.1], [0, 0, 0]], "brdf_per_sr": [[0.1, 0.1, 0.1], [0.1, 0.1, 0.1], [0.3, 0.3, 0.3]]
    });
    let document = |table: Value| with(base(), "/tubes/0/diffuser", table);
    let parsed = parse(&document(table.clone())).unwrap();
    let (scene, ..) = to_scene(&parsed, &SquarePipe).unwrap();
    let Diffuser::Measured(measured) = &scene.tubes[0].diffuser else { panic!("not measured") };
    assert_eq!(measured.per_sr(true, 1.0, 1.0), 0.3);
    let [_, back] = measured.albedos(1.0);
    assert!((back - 0.1 * std::f64::consts::PI).abs() < 1e-12);
    let mut on_mesh = mesh_tube();
    on_mesh["parts"]["diffuser"] = table.clone();
    on_mesh["parts"]["diffuser"]["role"] = json!("diffuser");
    let (on_mesh, ..) = {
        let document = with(base(), "/tubes/0", on_mesh);
        to_scene(&parse(&document).unwrap(), &SquarePipe).unwrap()
    };
    assert_eq!(on_mesh.tubes[0].diffuser, scene.tubes[0].diffuser);
    let cases = [
        // 2 pi int 0.35 cos sin = 1.0996, which with the reflected tenth of pi is more
        ("/btdf_per_sr/1", json!([0.35, 0.35, 0.35]), "/btdf_per_sr/1", FieldErrorCode::Invalid),
        ("/btdf_per_sr", json!([[0, 0, 0], [0, 0, 0]]), "/btdf_per_sr", FieldErrorCode::Invalid),
        ("/brdf_per_sr/2", json!([0, 0]), "/brdf_per_sr/2", FieldErrorCode::Invalid),
        ("/btdf_per_sr/0/1", json!(-0.1), "/btdf_per_sr/0/1", FieldErrorCode::OutOfRange),
        ("/exit_deg/2", json!(80), "/exit_deg/2", FieldErrorCode::Invalid),
        ("/incidence_deg/1", json!(0), "/incidence_deg/1", FieldErrorCode::Invalid),
        ("/exit_deg", Value::Null, "/exit_deg", FieldErrorCode::Missing),
        ("/transmittance", json!(0.5), "/transmittance", FieldErrorCode::UnknownField),
    ];
    for (field, value, pointer, code) in cases {
        let bad = document(with(table.clone(), field, value));
        refused(&bad, &format!("/tubes/0/diffuser{pointer}"), code);
    }
    refused(
        &with(base(), "/tubes/0/diffuser/exit_deg", json!([0, 90])),
        "/tubes/0/diffuser/exit_deg",
        FieldErrorCode::UnknownField,
    );
}

/// Tubes that pass through each other, by their segments, their elbows or a bend back, and through themselves.
#[test]
fn tubes_share_no_space() {
    let tube = |x: f64, segments: Value| {
        let mut tube = base()["tubes"][0].clone();
        tube["centre_m"] = json!([x, 1.0]);
        tube["segments"] = segments;
        tube
    };
    let leaning =
        |azimuth: f64| json!([{ "length_m": 0.6 }, { "length_m": 3, "tilt_deg": 60, "azimuth_deg": azimuth }]);
    let upright = json!([{ "length_m": 3 }]);
    // the segment at fault, and whether the one that it passes through is named
    let errors = |tubes: Vec<Value>, through: &str| match parse(&with(base(), "/tubes", tubes.into())) {
        Ok(_) => Vec::new(),
        Err(errors) => errors.0.into_iter().map(|error| (error.pointer, error.detail.contains(through))).collect(),
    };
    // toward each other, over another one, and into one that stands behind
    let met = errors(vec![tube(0.4, leaning(90.0)), tube(1.6, leaning(270.0))], "/tubes/0/segments/1: near [1, 1, ");
    assert_eq!(met, [("/tubes/1/segments/1".to_owned(), true)]);
    for crossing in [
        vec![tube(0.4, leaning(90.0)), tube(1.6, upright.clone())],
        vec![tube(0.4, upright.clone()), tube(1.6, leaning(270.0))],
        // past the outer edge of an elbow, which reaches out farther than the axes do
        vec![
            tube(0.7, json!([{ "length_m": 1 }, { "length_m": 1, "tilt_deg": 90, "azimuth_deg": 270 }])),
            with(
                tube(0.85, json!([{ "length_m": 1.234 }, { "length_m": 1, "tilt_deg": 90, "azimuth_deg": 180 }])),
                "/centre_m/1",
                json!(1.6),
            ),
        ],
    ] {
        let found = errors(crossing, "/tubes/0/segments/");
        assert!(found.len() == 1 && found[0].0.starts_with("/tubes/1/") && found[0].1, "{found:?}");
    }
    for apart in [
        vec![tube(0.4, leaning(270.0)), tube(1.6, leaning(90.0))],
        vec![tube(0.4, leaning(90.0)), tube(1.6, leaning(90.0))],
        vec![tube(0.4, leaning(0.0)), tube(0.654, leaning(0.0))],
        // a tube that ends below another one
        vec![tube(0.4, leaning(90.0)), tube(1.6, json!([{ "length_m": 0.9 }]))],
    ] {
        assert_eq!(errors(apart, ""), []);
    }
    // up, over, down and back through its own first segment
    let segment =
        |length: f64, tilt: f64, azimuth: f64| json!({ "length_m": length, "tilt_deg": tilt, "azimuth_deg": azimuth });
    let knot = |last: f64| {
        json!([segment(2.0, 0.0, 0.0), segment(0.6, 90.0, 90.0), segment(0.9, 135.0, 90.0), segment(last, 90.0, 270.0)])
    };
    let own = errors(vec![tube(0.4, knot(2.0))], "/tubes/0/segments/");
    assert!(own.len() == 1 && own[0].0.starts_with("/tubes/0/segments/") && own[0].1, "{own:?}");
    assert_eq!(errors(vec![tube(0.4, knot(0.6))], ""), []);
    // elbows of short gores
    let gores: Vec<Value> = (0..7).map(|k| segment(0.254 * 0.1317, 15.0 * f64::from(k), 0.0)).collect();
    assert_eq!(errors(vec![tube(0.4, gores.into())], ""), []);
}
