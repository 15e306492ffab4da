//! Objects that stand right below the opening of a tube, or above one that hangs: their owner may have meant another place.

use std::collections::BTreeMap;

use glam::DVec3;

use super::errors::{Warning, WarningCode};
use super::job::JobDocument;
use super::solids::pointers;
use crate::traceable::{Place, RoomObject, TraceableScene};

/// Number of points along each side of the lattice in an opening from which it is asked what lies below.
const LATTICE: u32 = 8;

/// Fraction of an opening from which on an object that covers it is reported.
const COVERED: f64 = 0.5;

/// Fraction of the distance from an opening straight to the opposite face within which an object must lie below it: tables and cupboards stand deeper.
const NEAR: f64 = 0.5;

/// Returns a warning for each object that stands before half or more of an opening, in the nearer half of the way to the opposite face, or above
/// an opening that hangs, where its pipe comes down.
pub fn covered_openings(document: &JobDocument, scene: &TraceableScene) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if scene.boxes.is_empty() && scene.meshes.is_none() {
        return warnings;
    }
    for (number, tube) in scene.tubes.iter().enumerate() {
        let side = if tube.frame.is_level() { "under" } else { "before" };
        let below = (side, "the most of the light that leaves it straight falls on the object", tube.frame.normal());
        let above = ("over", "its pipe, which is not simulated in the room, would pass through the object", DVec3::Z);
        for (side, what, toward) in std::iter::once(below).chain(tube.hangs.then_some(above)) {
            let ahead = || scene.enclosure.ahead(tube.frame.origin, toward).distance;
            let reach = if side == "over" { f64::INFINITY } else { NEAR * ahead() };
            let hair = toward * (4.0 * scene.coinciding());
            let mut met: BTreeMap<RoomObject, (u32, f64)> = BTreeMap::new();
            for place in 0..LATTICE * LATTICE {
                let at = [place / LATTICE, place % LATTICE].map(|k| (f64::from(k) + 0.5) / f64::from(LATTICE));
                let origin = tube.point(at) + hair;
                let hit = scene.intersect(origin, toward, None);
                let Place::Surface(surface) = hit.place else { continue };
                let distance = (hit.position - origin).length();
                if let Some(object) = scene.object_of(surface).filter(|_| distance < reach) {
                    let (points, nearest) = met.entry(object).or_insert((0, distance));
                    (*points, *nearest) = (*points + 1, nearest.min(distance));
                }
            }
            for (object, (points, distance)) in met {
                let share = f64::from(points) / f64::from(LATTICE * LATTICE);
                let name = pointers(document, &[object]);
                // partitions have no name among the objects
                if share >= COVERED && !name.is_empty() {
                    let detail = format!(
                        "{name} stands {side} the opening of /tubes/{number} and covers {:.0} % of it, {distance:.3} m from it: {what}",
                        100.0 * share
                    );
                    warnings.push(Warning { code: WarningCode::OpeningCovered, detail });
                }
            }
        }
    }
    warnings
}
