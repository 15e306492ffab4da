//! Every bound names its field, and all that are broken are told at once.

use crate::given::{SquarePipe, base, errors, refused, with};
use crate::schema::parse;
use serde_json::{Value, json};
use skyduct::document::{FieldErrorCode, to_scene};
use skyduct::scene::Channels;

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
        ("/sky/cie_type", json!(0), "1..16"),
        ("/sky/cie_type", json!(17), "17"),
        ("/sky/cie_type", json!("clear"), "invalid type"),
        ("/sky/cie_type", Value::Null, "required"),
        ("/sky/sun_position/altitude_deg", json!(90.5), "-90..90"),
        ("/sky/sun_position/azimuth_deg", json!(-361), "-360..360"),
        ("/sky/sun_position", Value::Null, "location"),
        ("/sky/zenith_luminance_cd_m2", json!(-1), "0.."),
        ("/sky/direct_normal_illuminance_lux", json!(1e12), "1000000000"),
        ("/sky/luminous_turbidity", json!(3), "only one of"),
        ("/sky/turbidity", json!(3), "unknown field"),
        // room
        ("/room/size_m", json!([1, 2]), "length 2"),
        ("/room/surfaces", json!([]), "sequence, expected an object"),
        ("/stop", json!([0.1]), "sequence, expected an object"),
        ("/tubes/0/segments/0", json!([1]), "sequence, expected an object"),
        ("/room/size_m/1", json!(0.001), "0.01..1000"),
        ("/room/size_m/2", json!(-3), "-3"),
        ("/room/surfaces/floor/reflectance", json!(1.2), "0..1"),
        ("/room/surfaces/floor/reflectance", json!(1), "albedo must be < 1"),
        ("/room/surfaces/walls/reflectance", json!([0.5, 1.0, 0.5]), "invalid"),
        ("/room/surfaces/floor/specular", json!(1.5), "within 0..1"),
        ("/room/surfaces/floor/open", json!(1), "invalid type"),
        ("/room/surfaces/roof", json!({}), "unknown field"),
        ("/room/surfaces/wall_north", json!({ "reflectance": "white" }), "invalid type"),
        ("/room/objects/0/position_m/0", json!(0.2), "inside the room"),
        ("/room/objects/0/size_m/2", json!(0), "> 0"),
        ("/room/objects/0/mesh", json!("x"), "not a field of"),
        ("/room/objects/0/surface", Value::Null, "missing"),
        ("/room/objects/0/surface/reflectance", json!(1), "albedo"),
        // tubes
        ("/tubes", json!([]), "at least one tube or luminaire"),
        ("/tubes/0/centre_m/0", json!(0.1), "inside the ceiling"),
        ("/tubes/0/diameter_m", json!(0), "> 0"),
        ("/tubes/0/diameter_m", json!(-0.254), "> 0"),
        ("/tubes/0/reflectance", json!(1.01), "0..1"),
        ("/tubes/0/segments", json!([]), "1..16"),
        ("/tubes/0/segments/0/length_m", json!(0), "> 0"),
        ("/tubes/0/segments/0/tilt_deg", json!(10), "not supported yet"),
        ("/tubes/0/segments/1/tilt_deg", json!(136), "0..135"),
        ("/tubes/0/segments/1/length_m", json!(0.05), "mitres"),
        ("/tubes/0/collector/kind", json!("sphere"), "unknown variant"),
        ("/tubes/0/collector/transmittance", json!(1.5), "0..1"),
        ("/tubes/0/collector/transmittance", Value::Null, "missing"),
        ("/tubes/0/collector/thickness_m", json!(0.003), "not a field of"),
        (
            "/tubes/0/collector",
            json!({ "kind": "dielectric_dome", "refractive_index": 0.9, "thickness_m": 0.003 }),
            "1..4",
        ),
        ("/tubes/0/collector", json!({ "kind": "dielectric_dome", "refractive_index": 1.49 }), "missing"),
        ("/tubes/0/collector/absorption_per_m", json!(2), "not a field of"),
        ("/tubes/0/diffuser/transmittance", json!(1.1), "0..1"),
        ("/tubes/0/diffuser/inner", json!("clear"), "not a field of"),
        // outputs
        ("/grids/0/name", json!("../x"), "begin with a letter"),
        ("/grids/0/name", json!(""), "1..64"),
        ("/grids/0/cells/0", json!(0), "1..1000"),
        ("/grids/0/cells", json!([1000, 1000]), "100000"),
        ("/grids/0/height_m", json!(2.032), "below the ceiling"),
        ("/grids/0/margin_m", json!(1.016), "half the room"),
        ("/grids/0/estimate", json!("mean"), "unknown variant"),
        ("/views/0/size_px/0", json!(8193), "1..8192"),
        ("/views/0/size_px", json!([8192, 8192]), "16777216"),
        ("/views/0/vertical_fov_deg", json!(179), "< 179"),
        ("/views/0/look_at_m", json!([1.9, 0.1, 1.6]), "differ"),
        ("/views/0/up", json!([0, 0, 0]), "zero"),
        // method, stop, effects, seed
        ("/method", json!("light_tracing"), "grids only"),
        ("/method", json!("magic"), "unknown variant"),
        ("/method/samples_per_pixel", json!(4), "not a field of"),
        ("/method/alpha", json!(1), "< 1"),
        ("/method/photons_per_pass", json!(63), "64.."),
        ("/method/initial_radius_m", json!(0), "> 0"),
        ("/method/radius", json!(1), "invalid type"),
        ("/method/radius", json!("knn"), "unknown variant"),
        ("/method/radii", json!(1), "unknown field"),
        ("/stop/relative_error", json!(0), "> 0"),
        ("/stop/confidence", json!(1), "< 1"),
        ("/stop/max_passes", json!(0), "1.."),
        ("/stop/max_seconds", json!(-5), "> 0"),
        ("/effects/bloom", json!("on"), "unknown effect"),
        ("/effects/glossy", json!("maybe"), "unknown variant"),
        ("/seed", json!(-1), "invalid value"),
        ("/seed", json!(1.5), "invalid type"),
        ("/extra~field", json!(1), "unknown field"),
        ("/name", json!(7), "invalid type"),
    ];
    for (pointer, value, detail) in cases {
        let document = with(base(), &pointer.replace("extra~field", "extra~0field"), value.clone());
        // the error is where the change is, or just inside or around it
        let expected: (&str, &str) = match (pointer, detail) {
            ("/room/surfaces/walls/reflectance", _) => ("/room/surfaces/walls/reflectance/1", "albedo"),
            ("/room/surfaces/wall_north", _) => ("/room/surfaces/wall_north/reflectance", detail),
            ("/tubes/0/collector", "1..4") => ("/tubes/0/collector/refractive_index", "1..4"),
            ("/tubes/0/collector", "missing") => ("/tubes/0/collector/thickness_m", "missing"),
            ("/extra~field", _) => ("/extra~0field", detail),
            _ => (pointer, detail),
        };
        refused(&document, expected.0, expected.1);
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
