//! What the plan says of effects: reasons that do not contradict each other, bounds, warnings.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use skyduct::cli::mesh_files::MeshFiles;
use skyduct::document::errors::WarningCode;
use skyduct::document::{JobDocument, ValidJob, to_scene};
use skyduct::plan::{EffectKind, EffectPlan, EffectRequest, Effects};
use skyduct::present::prepared::{Prepared, prepare};
use skyduct::scene::Scene;

fn example(file: &Path) -> ValidJob {
    let value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    JobDocument::from_files(value, &MeshFiles::beside(file)).unwrap()
}

fn examples() -> Vec<PathBuf> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> =
        files.filter(|file| file.extension().is_some_and(|extension| extension == "json")).collect();
    files.sort();
    files
}

/// What one line says of the scene, and another one must not deny.
fn check(scene: &Scene, effects: &Effects, what: &str) {
    let line = |kind: EffectKind| -> &EffectPlan { effects.list.iter().find(|effect| effect.kind == kind).unwrap() };
    let says = |kind: EffectKind, words: &str| line(kind).reason.contains(words);
    let room = &scene.room;
    for effect in &effects.list {
        assert!(!effect.reason.is_empty() && !effect.reason.ends_with('.'), "{what}: {effect:?}");
        assert_eq!(effect.reason.contains("switched off in"), !effect.on && effect.called_for, "{what}: {effect:?}");
        assert_eq!(effect.bound, (!effect.on && !effect.called_for).then_some(0.0), "{what}: {effect:?}");
        assert!(!effect.on || effect.called_for || effect.reason.contains("without influence"), "{what}: {effect:?}");
    }
    let empty = says(EffectKind::Objects, "empty");
    assert_eq!(empty, room.boxes.len() + room.meshes.len() + room.luminaires.len() == 0, "{what}");
    assert!(!empty || says(EffectKind::Luminaires, "no luminaires"), "{what}");
    let no_tubes = scene.tubes.is_empty();
    for kind in [EffectKind::Sky, EffectKind::Sun] {
        assert!(!says(kind, "no tube") || no_tubes, "{what}: {:?}", line(kind));
        assert!(!says(kind, "no sky") || scene.daylight.is_none() && !line(EffectKind::Sky).on, "{what}");
    }
    assert!(!says(EffectKind::GuideReturn, "no tubes") || no_tubes, "{what}");
    assert!(!says(EffectKind::Interreflection, "black") || !effects.is_on(EffectKind::Glossy), "{what}");
    // what is left out with the objects is no reason for anything else
    let mirrors = room.enclosure.surfaces().any(|surface| surface.specular.is_some());
    if !line(EffectKind::Objects).on && effects.is_on(EffectKind::Glossy) {
        assert!(mirrors, "{what}");
    }
}

#[test]
fn reasons_do_not_contradict_each_other() {
    for file in examples() {
        let document = example(&file);
        let (scene, ..) = to_scene(&document, &MeshFiles::beside(&file)).unwrap();
        let electric = Scene { daylight: None, ..scene.clone() };
        let night = Scene { tubes: Vec::new(), ..scene.clone() };
        for (scene, changed) in [(&scene, ""), (&electric, "no sky"), (&night, "no tubes")] {
            for wishes in 0..1u32 << EffectKind::ALL.len() {
                for wish in [EffectRequest::Off, EffectRequest::On] {
                    let wished = EffectKind::ALL.iter().enumerate().filter(|(bit, _)| wishes >> bit & 1 == 1);
                    let requests = wished.map(|(_, kind)| (*kind, wish)).collect();
                    let effects = Effects::of(scene, &requests);
                    check(scene, &effects, &format!("{} {changed} {requests:?}", file.display()));
                    for kind in requests.keys().filter(|kind| kind.can_be_left_out() && wish == EffectRequest::Off) {
                        assert!(!effects.is_followed(*kind));
                    }
                }
            }
        }
    }
}

fn with_effects(name: &str, effects: Value, stop: Value) -> Prepared {
    let file = examples().into_iter().find(|file| file.file_stem().is_some_and(|stem| stem == name)).unwrap();
    let mut document: Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
    document["effects"] = effects;
    document["stop"] = stop;
    prepare(document.to_string().as_bytes(), &MeshFiles::beside(&file)).unwrap()
}

fn told(prepared: &Prepared) -> Vec<&str> {
    let of_effects = prepared.warnings.iter().filter(|warning| warning.code == WarningCode::EffectLeftOut);
    of_effects.map(|warning| warning.detail.as_str()).collect()
}

#[test]
fn what_is_switched_off_and_matters_is_a_warning() {
    let asked = json!({ "relative_error": 0.02 });
    let prepared = with_effects("thesis_room", json!({ "interreflection": "off" }), asked.clone());
    // 0.2 of a floor, 0.5 of four walls, 0.7 of a ceiling of one size: 2.9 of 6
    let text = "the effect interreflection is switched off, but the scene calls for it: about 48 %, at most 70 %, of the light that \
                falls on the room's surfaces is left out";
    assert_eq!(told(&prepared), [text]);
    let plan = prepared.plan_json();
    assert_eq!(plan["effects"][3]["bound"], json!(0.7));
    let all = with_effects("thesis_room", json!({ "sky": "off", "sun": "off" }), asked.clone());
    assert_eq!(told(&all).len(), 2);
    assert!(
        told(&all)[0].starts_with("the effect sky is switched off, but the scene calls for it: about "),
        "{:?}",
        told(&all)
    );
    let boxes = with_effects("two_tubes", json!({ "objects": "off" }), asked.clone());
    assert!(told(&boxes)[0].ends_with(" % of the light in the room meets the objects"), "{:?}", told(&boxes));
    // a small opening in a large room: the bound is a warning only where it is more than what is asked for
    let off = json!({ "guide_return": "off" });
    let bound = with_effects("bent_tube", off.clone(), asked.clone()).plan.effects.list[6].bound.unwrap();
    assert!(bound > 0.0 && bound < 0.5, "{bound}");
    let coarse = with_effects("bent_tube", off.clone(), json!({ "relative_error": 1.01 * bound }));
    assert_eq!(told(&coarse), [""; 0]);
    assert_eq!(told(&with_effects("bent_tube", off, json!({ "relative_error": 0.99 * bound }))).len(), 1);
    assert_eq!(told(&with_effects("bent_tube", json!({ "objects": "off" }), asked)), [""; 0]);
}

#[test]
fn tubes_with_one_guide_are_told() {
    let stop = json!({ "relative_error": 0.02 });
    let twice = with_effects("glossy_room", json!({}), stop.clone());
    let reasons: Vec<_> =
        twice.plan.guides.iter().map(|guide| guide.reason.contains("; 2 tubes have this guide,")).collect();
    assert_eq!(reasons, [true, true]);
    let apart = with_effects("two_tubes", json!({}), stop);
    assert!(apart.plan.guides.iter().all(|guide| !guide.reason.contains("have this guide")));
}

/// What hangs into the room is left out, and told with its share of the area: 0.3 m of a pipe of 0.35 m below a roof over 5 m x 4 m.
#[test]
fn hanging_pipes_are_told() {
    let attic = with_effects("attic", json!({}), json!({ "relative_error": 0.02 }));
    let reason = &attic.plan.guides[0].reason;
    assert!(
        reason.contains("; its opening hangs 0.3 m below the ceiling: the pipe in the room, 0.28 % of"),
        "{reason}"
    );
    let level = with_effects("thesis_room", json!({}), json!({ "relative_error": 0.02 }));
    assert!(!level.plan.guides[0].reason.contains("hangs"));
}
