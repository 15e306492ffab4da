//! Sensors of grids and cameras of views that lie outside the room or inside solids: such sensors have no value, such cameras see nothing.

use std::sync::Arc;

use super::errors::{Checks, DocumentErrors, Warning, WarningCode};
use super::job::JobDocument;
use super::outputs::SURFACES;
use super::room::object::ObjectDocument;
use crate::scene::{EstimateKind, Scene};
use crate::traceable::{OccupiedParts, RoomObject, solids_around};

/// Excludes the sensors of a scene's grids that lie outside the room or, where objects are simulated, inside solids, and returns a warning
/// for each grid that loses any but those beside the plan. Errors name the grids of which no sensor is left, and views from within solids.
pub fn leave_out(document: &JobDocument, scene: &mut Scene, has_objects: bool) -> Result<Vec<Warning>, DocumentErrors> {
    let mut checks = Checks::default();
    let mut warnings = Vec::new();
    let occupied: Vec<OccupiedParts> = match has_objects {
        true => scene.grids.iter().map(|grid| OccupiedParts::of(scene, grid)).collect(),
        false => scene.grids.iter().map(|grid| OccupiedParts::outside(scene, grid)).collect(),
    };
    for (number, (grid, occupied)) in scene.grids.iter_mut().zip(occupied).enumerate() {
        if occupied.free.is_empty() {
            continue;
        }
        let outside = occupied.area.iter().filter(|area| **area == 0.0).count();
        if grid.name == SURFACES {
            // furniture stands on patches
            grid.free = Some(occupied.free.into());
            continue;
        }
        let (without_value, all) = (occupied.without_value(), grid.len());
        let things = match grid.estimate {
            EstimateKind::Point => "points",
            EstimateKind::CellAverage => "cells",
        };
        let objects = pointers(document, &occupied.by);
        if without_value == all {
            let detail = match outside {
                0 => format!("all {things} lie inside solids ({objects}): choose another height or move the objects"),
                _ if outside == all => format!("all {things} lie outside the room, or within `margin_m` of its walls"),
                _ => format!("all {things} lie outside the room or inside solids ({objects})"),
            };
            checks.refuse(format!("/grids/{number}"), detail);
            continue;
        }
        if outside > 0 && grid.placed.is_some() {
            let detail = format!("/grids/{number}: {outside} of {all} points lie outside the room: they have no value");
            warnings.push(Warning { code: WarningCode::PointsOutside, detail });
        }
        if !occupied.by.is_empty() {
            let mut detail = format!(
                "/grids/{number}: {} of {all} {things} lie inside solids ({objects}): they have no value and are left \
                 out of all statistics",
                without_value - outside
            );
            if grid.estimate == EstimateKind::CellAverage && occupied.partly() > 0 {
                detail += &format!(
                    "; {} lie partly inside, and their values are means over the free part",
                    occupied.partly()
                );
            }
            warnings.push(Warning { code: WarningCode::PointsInsideSolids, detail });
        }
        grid.area = Some(occupied.area.into()).filter(|area: &Arc<[f64]>| !area.is_empty());
        grid.free = Some(occupied.free.into());
    }
    for (number, view) in scene.views.iter().enumerate().filter(|_| has_objects) {
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
pub(super) fn pointers(document: &JobDocument, objects: &[RoomObject]) -> String {
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
