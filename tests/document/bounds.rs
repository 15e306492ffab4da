//! Every bound names its field, and all that are broken are told at once.

use crate::given::{SquarePipe, base, errors, refused, with};
use crate::schema::parse;
use serde_json::{Value, json};
use skyduct::document::FieldErrorCode::{
    self, Invalid, MethodRefuses, Missing, NotSupported, OutOfRange, UnknownField,
};
use skyduct::document::to_scene;
use skyduct::scene::Channels;

/// Surfaces may be left out, but none is null, as the schema says.
#[test]
fn faces_without_a_surface_are_told() {
    for face in ["wall_north", "walls"] {
        let mut document = base();
        document["room"]["surfaces"] = json!({ face: null });
        refused(&document, &format!("/room/surfaces/{face}"), Invalid);
    }
}

#[test]
fn the_base_document_is_good() {
    let document = parse(&base()).unwrap();
    let (scene, warnings, provenance) = to_scene(&document, &SquarePipe).unwrap();
    assert_eq!(warnings, vec![]);
    assert_eq!(scene.channels, Channels::Photopic);
    assert!(!provenance.sun.unwrap().on);
    assert_eq!(scene.daylight.unwrap().sky.unwrap().zenith_luminance_cd_m2, 5000.0);
}

#[test]
fn every_bound_names_its_field() {
    let cases = [
        // place and sky
        ("/sky/cie_type", json!(0), OutOfRange, "1..16"),
        ("/sky/cie_type", json!(17), OutOfRange, "17"),
        ("/sky/cie_type", json!("clear"), Invalid, ""),
        ("/sky/cie_type", Value::Null, Invalid, ""),
        ("/sky/sun_position/altitude_deg", json!(90.5), OutOfRange, "-90..90"),
        ("/sky/sun_position/azimuth_deg", json!(-361), OutOfRange, "-360..360"),
        ("/sky/sun_position", Value::Null, Invalid, ""),
        ("/sky/zenith_luminance_cd_m2", json!(-1), OutOfRange, "0.."),
        ("/sky/direct_normal_illuminance_lux", json!(1e12), OutOfRange, "1000000000"),
        ("/sky/luminous_turbidity", json!(3), Invalid, ""),
        ("/sky/turbidity", json!(3), UnknownField, ""),
        // room
        ("/room/size_m", json!([1, 2]), Invalid, ""),
        ("/room/surfaces", json!([]), Invalid, ""),
        ("/stop", json!([0.1]), Invalid, ""),
        ("/tubes/0/segments/0", json!([1]), Invalid, ""),
        ("/room/size_m/1", json!(0.001), OutOfRange, "0.01..1000"),
        ("/room/size_m/2", json!(-3), OutOfRange, "-3"),
        ("/room/surfaces/floor/reflectance", json!(1.2), OutOfRange, "0..1"),
        ("/room/surfaces/floor/reflectance", json!(1), Invalid, ""),
        ("/room/surfaces/walls/reflectance", json!([0.5, 1.0, 0.5]), Invalid, ""),
        ("/room/surfaces/floor/specular", json!(1.5), OutOfRange, "within 0..1"),
        ("/room/surfaces/floor/open", json!(1), Invalid, ""),
        ("/room/surfaces/roof", json!({}), UnknownField, ""),
        ("/room/surfaces/wall_north", json!({ "reflectance": "white" }), Invalid, ""),
        ("/room/objects/0/position_m/0", json!(0.2), Invalid, ""),
        ("/room/objects/0/size_m/2", json!(0), OutOfRange, "> 0"),
        ("/room/objects/0/mesh", json!("x"), UnknownField, ""),
        ("/room/objects/0/surface", Value::Null, Missing, ""),
        ("/room/objects/0/surface/reflectance", json!(1), Invalid, ""),
        // tubes
        ("/tubes", json!([]), Invalid, ""),
        ("/tubes/0/centre_m/0", json!(0.1), Invalid, ""),
        ("/tubes/0/diameter_m", json!(0), OutOfRange, "> 0"),
        ("/tubes/0/diameter_m", json!(-0.254), OutOfRange, "> 0"),
        ("/tubes/0/reflectance", json!(1.01), OutOfRange, "0..1"),
        ("/tubes/0/segments", json!([]), Invalid, "1..16"),
        ("/tubes/0/segments/0/length_m", json!(0), OutOfRange, "> 0"),
        ("/tubes/0/segments/0/tilt_deg", json!(10), NotSupported, ""),
        ("/tubes/0/segments/1/tilt_deg", json!(136), OutOfRange, "0..135"),
        ("/tubes/0/segments/1/length_m", json!(0.05), Invalid, ""),
        ("/tubes/0/collector/kind", json!("sphere"), Invalid, ""),
        ("/tubes/0/collector/transmittance", json!(1.5), OutOfRange, "0..1"),
        ("/tubes/0/collector/transmittance", Value::Null, Missing, ""),
        ("/tubes/0/collector/thickness_m", json!(0.003), UnknownField, ""),
        (
            "/tubes/0/collector",
            json!({ "kind": "dielectric_dome", "refractive_index": 0.9, "thickness_m": 0.003 }),
            OutOfRange,
            "1..4",
        ),
        ("/tubes/0/collector", json!({ "kind": "dielectric_dome", "refractive_index": 1.49 }), Missing, ""),
        ("/tubes/0/collector/absorption_per_m", json!(2), UnknownField, ""),
        ("/tubes/0/diffuser/transmittance", json!(1.1), OutOfRange, "0..1"),
        ("/tubes/0/diffuser/inner", json!("clear"), UnknownField, ""),
        // outputs
        ("/grids/0/name", json!("../x"), Invalid, ""),
        ("/grids/0/name", json!(""), Invalid, "1..64"),
        ("/grids/0/cells/0", json!(0), OutOfRange, "1..1000"),
        ("/grids/0/cells", json!([1000, 1000]), Invalid, "100000"),
        ("/grids/0/height_m", json!(2.032), Invalid, ""),
        ("/grids/0/margin_m", json!(1.016), Invalid, ""),
        ("/grids/0/estimate", json!("mean"), Invalid, ""),
        ("/views/0/size_px/0", json!(8193), OutOfRange, "1..8192"),
        ("/views/0/size_px", json!([8192, 8192]), Invalid, "16777216"),
        ("/views/0/vertical_fov_deg", json!(179), OutOfRange, "< 179"),
        ("/views/0/look_at_m", json!([1.9, 0.1, 1.6]), Invalid, ""),
        ("/views/0/up", json!([0, 0, 0]), Invalid, ""),
        // method, stop, effects, seed
        ("/method", json!("light_tracing"), MethodRefuses, ""),
        ("/method", json!("magic"), Invalid, ""),
        ("/method/samples_per_pixel", json!(4), UnknownField, ""),
        ("/method/alpha", json!(1), OutOfRange, "< 1"),
        ("/method/photons_per_pass", json!(63), OutOfRange, "64.."),
        ("/method/initial_radius_m", json!(0), OutOfRange, "> 0"),
        ("/method/radius", json!(1), Invalid, ""),
        ("/method/radius", json!("knn"), Invalid, ""),
        ("/method/radii", json!(1), UnknownField, ""),
        ("/stop/relative_error", json!(0), OutOfRange, "> 0"),
        ("/stop/confidence", json!(1), OutOfRange, "< 1"),
        ("/stop/max_passes", json!(0), OutOfRange, "1.."),
        ("/stop/max_seconds", json!(-5), OutOfRange, "> 0"),
        ("/effects/bloom", json!("on"), Invalid, ""),
        ("/effects/glossy", json!("maybe"), Invalid, ""),
        ("/seed", json!(-1), Invalid, ""),
        ("/seed", json!(1.5), Invalid, ""),
        ("/extra~field", json!(1), UnknownField, ""),
        ("/name", json!(7), Invalid, ""),
    ];
    for (pointer, value, code, bound) in cases {
        let document = with(base(), &pointer.replace("extra~field", "extra~0field"), value.clone());
        // the error is where the change is, or just inside or around it
        let at = match (pointer, code) {
            ("/room/surfaces/walls/reflectance", _) => "/room/surfaces/walls/reflectance/1",
            ("/room/surfaces/wall_north", _) => "/room/surfaces/wall_north/reflectance",
            ("/tubes/0/collector", OutOfRange) => "/tubes/0/collector/refractive_index",
            ("/tubes/0/collector", Missing) => "/tubes/0/collector/thickness_m",
            ("/extra~field", _) => "/extra~0field",
            _ => pointer,
        };
        let error = refused(&document, at, code);
        assert!(error.detail.contains(bound), "{bound}: {error}");
    }
}

#[test]
fn all_errors_are_collected() {
    let mut document = base();
    document["room"]["surfaces"]["floor"]["reflectance"] = json!(-0.1);
    document["room"]["colour"] = json!("red");
    document["tubes"][0]["segments"][0]["lenght_m"] = json!(1);
    document["stop"]["confidence"] = json!(0.2);
    document["method"] = json!({ "kind": "sppm", "photons_per_pass": 1 });
    let mut pointers: Vec<_> = errors(&document).0.into_iter().map(|error| error.pointer).collect();
    pointers.sort();
    let expected = [
        "/method/photons_per_pass",
        "/room/colour",
        "/room/surfaces/floor/reflectance",
        "/stop/confidence",
        "/tubes/0/segments/0/lenght_m",
    ];
    assert_eq!(pointers, expected);
}

#[test]
fn faults_have_codes() {
    let code = |pointer: &str, value: Value| errors(&with(base(), pointer, value)).0[0].code;
    assert_eq!(code("/room/size_m", Value::Null), FieldErrorCode::Missing);
    assert_eq!(code("/room/siez_m", json!(1)), FieldErrorCode::UnknownField);
    assert_eq!(code("/tubes/0/reflectance", json!(1.5)), FieldErrorCode::OutOfRange);
    assert_eq!(code("/grids/0/cells", json!("nine")), FieldErrorCode::Invalid);
    assert_eq!(code("/tubes", json!(vec![base()["tubes"][0].clone(); 1025])), FieldErrorCode::TooMany);
    assert_eq!(code("/tubes/0/segments/0/tilt_deg", json!(10)), FieldErrorCode::NotSupported);
}
