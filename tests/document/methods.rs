//! Methods in documents: every one is read, understood and written by its name.

use crate::given::{SquarePipe, base, with};
use crate::schema::DESCRIPTION;
use serde_json::{Value, json};
use skyduct::document::method::settings_json;
use skyduct::document::{FieldErrorCode, MethodDocument, RefusalName};
use skyduct::integrator::method::RefusalCode;
use skyduct::plan::MethodRequest;
use skyduct::present::prepared::prepare;

fn read(value: &Value) -> MethodDocument {
    serde_json::from_value(value.clone()).unwrap_or_else(|error| panic!("{value}: {error}"))
}

#[test]
fn every_method_has_its_name_and_its_settings_in_documents_and_results() {
    let names = DESCRIPTION["components"]["schemas"]["MethodKind"]["enum"].as_array().unwrap();
    assert!(names.len() >= 10, "{names:?}");
    for name in names {
        let (by_name, by_kind) = (read(name), read(&json!({ "kind": name })));
        assert_eq!(serde_json::to_value(&by_name).unwrap(), *name);
        assert_eq!(by_name.request(), by_kind.request());
        // with all defaults filled in
        let written = serde_json::to_value(&by_kind).unwrap();
        assert_eq!(written["kind"], *name);
        assert_eq!(read(&written), by_kind);
        let method = match by_kind.request() {
            MethodRequest::Method(method) => method,
            MethodRequest::InPlaceOf(former, method) => {
                assert!(["placed_vertices", "lamp_responses"].contains(&former), "{former}");
                assert_eq!(method.name(), "two_stage");
                assert_eq!(*name, former);
                continue;
            }
            MethodRequest::Auto => {
                assert_eq!(*name, "auto");
                continue;
            }
        };
        assert_eq!(method.name(), name.as_str().unwrap());
        let settings = settings_json(&method);
        let shown = settings.as_object().unwrap_or_else(|| panic!("{name}: {settings}"));
        assert!(shown.iter().all(|(setting, value)| value.is_null() || written[setting] == *value), "{written}");
    }
}

#[test]
fn a_method_that_refuses_says_so_in_codes() {
    // views of a method that computes grids only
    let document = with(base(), "/method", json!("holigilm"));
    let Err(errors) = prepare(document.to_string().as_bytes(), &SquarePipe) else { panic!("not refused") };
    let [error] = errors.0.as_slice() else { panic!("{errors:?}") };
    assert_eq!((error.pointer.as_str(), error.code), ("/method", FieldErrorCode::MethodRefuses));
    assert_eq!(error.refusal, Some(RefusalName(RefusalCode::GridsOnly)));
    // answers have the codes as texts
    let told = serde_json::to_value(error).unwrap();
    assert_eq!((&told["code"], &told["refusal"]), (&json!("method_refuses"), &json!("grids_only")));
}

/// Cells and points, beside walls and in the middle of a room, are computed by paths from sensors to what the tubes send.
#[test]
fn tubes_light_points_and_cells_by_paths() {
    let mut document: Value = serde_json::from_str(include_str!("../../examples/thesis_room.json")).unwrap();
    document.as_object_mut().unwrap().remove("views");
    for (estimate, margin) in [("cell_average", 0.0), ("cell_average", 0.4), ("point", 0.0)] {
        let grid = json!({ "name": "floor", "height_m": 0, "cells": [9, 9], "margin_m": margin, "estimate": estimate });
        document["grids"] = json!([grid]);
        let prepared =
            prepare(document.to_string().as_bytes(), &SquarePipe).unwrap_or_else(|errors| panic!("{errors:?}"));
        assert_eq!(prepared.method_names(), "two_stage", "{estimate} {margin}");
    }
}

/// So they are where luminaires alone light the room.
#[test]
fn luminaires_light_points_and_cells_by_paths() {
    let mut document: Value = serde_json::from_str(include_str!("../../examples/cornell_box.json")).unwrap();
    document.as_object_mut().unwrap().remove("views");
    document["method"] = json!("auto");
    for estimate in ["cell_average", "point"] {
        document["grids"] = json!([{ "name": "floor", "height_m": 0.1, "cells": [4, 4], "estimate": estimate }]);
        let prepared =
            prepare(document.to_string().as_bytes(), &SquarePipe).unwrap_or_else(|errors| panic!("{errors:?}"));
        assert_eq!(prepared.method_names(), "two_stage", "{estimate}");
    }
}

/// The reason speaks of the tubes that there are.
#[test]
fn reasons_fit_the_tubes() {
    let reason = |change: &dyn Fn(&mut Value)| {
        let mut document: Value = serde_json::from_str(include_str!("../../examples/thesis_room.json")).unwrap();
        document.as_object_mut().unwrap().remove("views");
        document["method"] = json!("auto");
        document["grids"] = json!([{ "name": "floor", "height_m": 0, "cells": [2, 2] }]);
        change(&mut document);
        let prepared =
            prepare(document.to_string().as_bytes(), &SquarePipe).unwrap_or_else(|errors| panic!("{errors:?}"));
        let grids = prepared.plan.methods.grids.clone().unwrap();
        assert_eq!(grids.method.name(), "two_stage", "{}", grids.reason);
        grids.reason
    };
    let desk = json!([{ "kind": "box", "size_m": [0.6, 0.6, 0.7], "position_m": [0.5, 0.5, 0], "surface": { "reflectance": 0.5 } }]);
    let mixed = json!({ "kind": "mixed", "lambertian_radius_m": 0.06, "inner": "lambertian",
                        "lambertian_transmittance": 0.6, "clear_transmittance": 0.9 });
    let lamps = [reason(&|_| ()), reason(&|document| document["room"]["objects"] = desk.clone())];
    assert!(lamps.iter().all(|reason| reason.contains("light that leaves the diffusers")), "{lamps:?}");
    assert!(lamps[1].contains("coarse radiosity solution"), "{lamps:?}");
    let in_part = reason(&|document| document["tubes"][0]["diffuser"] = mixed.clone());
    assert!(in_part.contains("Lambertian zones") && in_part.contains("traced separately"), "{in_part}");
    let electric = reason(&|document| {
        document["tubes"] = json!([]);
        document.as_object_mut().unwrap().remove("sky");
        document["room"]["luminaires"] = json!([{ "kind": "rectangle", "corner_m": [0.5, 0.5, 2], "edge_u_m": [0, 0.5, 0],
                                                  "edge_v_m": [0.5, 0, 0], "luminance_cd_m2": 1000 }]);
    });
    assert!(electric.contains("luminaires alone") && !electric.contains("tube"), "{electric}");
}
