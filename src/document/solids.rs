//! Sensors of grids and cameras of views that lie inside solids: such sensors have no value, such cameras see nothing.

use super::errors::{Checks, DocumentErrors, Warning, WarningCode};
use super::job::JobDocument;
use super::room::object::ObjectDocument;
use crate::scene::{EstimateKind, Scene};
use crate::traceable::{RoomObject, Taken, solids_around};

/// Excludes the sensors of a scene's grids that lie inside solids, and returns a warning for each grid that loses any. Errors
/// name the grids of which no sensor is left, and views from within solids.
pub fn leave_out_solids(document: &JobDocument, scene: &mut Scene) -> Result<Vec<Warning>, DocumentErrors> {
    let mut checks = Checks::default();
    let mut warnings = Vec::new();
    let taken: Vec<Taken> = scene.grids.iter().map(|grid| Taken::of(scene, grid)).collect();
    for (number, (grid, taken)) in scene.grids.iter_mut().zip(taken).enumerate() {
        if taken.by.is_empty() {
            continue;
        }
        let (inside, partly, all) = (taken.inside(), taken.partly(), grid.len());
        let objects = pointers(document, &taken.by);
        let (things, cells) = match grid.estimate {
            EstimateKind::Point => ("points", false),
            EstimateKind::CellAverage => ("cells", true),
        };
        if inside == all {
            let detail =
                format!("all {things} lie inside solids ({objects}): choose another height or move the objects");
            checks.refuse(format!("/grids/{number}"), detail);
            continue;
        }
        let mut detail = format!(
            "/grids/{number}: {inside} of {all} {things} lie inside solids ({objects}): they have no value and are \
             left out of all statistics"
        );
        if cells && partly > 0 {
            detail += &format!("; {partly} lie partly inside, and their values are means over the free part");
        }
        warnings.push(Warning { code: WarningCode::PointsInsideSolids, detail });
        grid.free = Some(taken.free.into());
    }
    for (number, view) in scene.views.iter().enumerate() {
        let around = solids_around(scene, view.eye);
        if !around.is_empty() {
            let objects = pointers(document, &around);
            let detail = format!("lies inside a solid ({objects}), where nothing is seen: move the eye or the object");
            checks.refuse(format!("/views/{number}/eye_m"), detail);
        }
    }
    if checks.errors.is_empty() { Ok(warnings) } else { Err(DocumentErrors(checks.errors)) }
}

/// Largest number of objects that a message names.
const MOST_NAMED: usize = 8;

/// Returns the pointers to some of a scene's objects in its document, for messages.
fn pointers(document: &JobDocument, objects: &[RoomObject]) -> String {
    let is_box = |object: &ObjectDocument| matches!(object, ObjectDocument::Box(_));
    let place = |object: &RoomObject| {
        let (wanted, number) = match object {
            RoomObject::Box(number) => (true, *number),
            RoomObject::Mesh(number) => (false, *number),
        };
        let of_kind = document.room.objects.iter().enumerate().filter(|(_, object)| is_box(object) == wanted);
        of_kind.map(|(place, _)| place).nth(number)
    };
    let mut places: Vec<usize> = objects.iter().filter_map(place).collect();
    places.sort_unstable();
    let mut named: Vec<String> = places.iter().take(MOST_NAMED).map(|place| format!("/room/objects/{place}")).collect();
    if places.len() > MOST_NAMED {
        named.push(format!("{} more", places.len() - MOST_NAMED));
    }
    named.join(", ")
}
