//! Checks of tubes.

use glam::DVec3;

use super::diffuser::DiffuserDocument;
use super::part::PartDocument;
use super::{MeshTubeDocument, OpeningNormal, ParametricTube, TubeDocument};
use crate::document::errors::Checks;
use crate::document::horizon::check_points;
use crate::document::limits::{
    DIAMETER_M, HORIZON_AZIMUTH_DEG, MESH_ID, SEGMENT_LENGTH_M, SEGMENTS, TILT_DEG, TUBES, TURN_DEG,
};
use crate::document::read::pointer::escape;

/// Largest bend in degrees: beyond it the ellipse of the mitre grows without bound, and 180 degrees would fold the guide onto
/// itself.
const STEEPEST_BEND_DEG: f64 = 175.0;

/// Largest angle in degrees of a pane from lying across the tube: its ellipse is then 4 times as long as wide.
const STEEPEST_PANE_DEG: f64 = 75.0;

/// Adds the faults of each tube by itself; false if there are too many tubes to be checked at all.
pub(crate) fn check_tubes(tubes: &[TubeDocument], checks: &mut Checks) -> bool {
    if !checks.at_most("/tubes", tubes.len(), &TUBES, " tubes") {
        return false;
    }
    for (index, tube) in tubes.iter().enumerate() {
        let pointer = format!("/tubes/{index}");
        let (diameter_m, diameter) = tube.diameter();
        let diameter_ok = checks.number(&format!("{pointer}/{diameter}"), diameter_m, DIAMETER_M);
        if let Some(points) = tube.horizon() {
            check_points(&format!("{pointer}/horizon"), points, HORIZON_AZIMUTH_DEG, checks);
        }
        check_plane(&pointer, tube, checks);
        match tube {
            TubeDocument::Parametric(tube) => check_parametric(&pointer, tube, diameter_ok, checks),
            TubeDocument::Mesh(tube) => check_mesh_tube(&pointer, tube, checks),
        }
    }
    true
}

/// Checks that the fields of an opening's place belong to its plane.
fn check_plane(pointer: &str, tube: &TubeDocument, checks: &mut Checks) {
    match tube.normal() {
        OpeningNormal::Plumb if tube.centre_m().height_m.is_some() => {
            let detail = "must be [x, y]: a level opening lies in the ceiling above it, or hangs `drop_m` below";
            checks.refuse(format!("{pointer}/centre_m"), detail);
        }
        OpeningNormal::Plumb => {}
        OpeningNormal::Face => {
            if tube.hangs().1 > 0.0 {
                checks.refuse(format!("{pointer}/drop_m"), "must be 0: the opening lies in the plane of its face");
            }
        }
    }
}

fn check_parametric(pointer: &str, tube: &ParametricTube, diameter_ok: bool, checks: &mut Checks) {
    tube.reflectance.check(&format!("{pointer}/reflectance"), checks);
    tube.collector.check(&format!("{pointer}/collector"), checks);
    tube.diffuser.check(&format!("{pointer}/diffuser"), 0.5 * tube.diameter_m, checks);
    if let Some(shape) = &tube.closure_shape {
        shape.check(pointer, diameter_ok.then_some(tube.diameter_m), &tube.diffuser, checks);
    }
    check_segments(pointer, tube, diameter_ok, checks);
}

fn check_segments(pointer: &str, tube: &ParametricTube, diameter_ok: bool, checks: &mut Checks) {
    let segments = &tube.segments;
    if !SEGMENTS.contains(&segments.len()) {
        let (least, most) = (SEGMENTS.start(), SEGMENTS.end());
        let detail = format!("must have {least}..{most} segments, but has {}", segments.len());
        checks.refuse(format!("{pointer}/segments"), detail);
        return;
    }
    let mut ok = diameter_ok;
    for (index, segment) in segments.iter().enumerate() {
        let pointer = format!("{pointer}/segments/{index}");
        ok &= checks.number(&format!("{pointer}/length_m"), segment.length_m, SEGMENT_LENGTH_M);
        ok &= checks.number(&format!("{pointer}/tilt_deg"), segment.tilt_deg, TILT_DEG);
        ok &= checks.number(&format!("{pointer}/azimuth_deg"), segment.azimuth_deg, TURN_DEG);
        if index == 0 && segment.tilt_deg > 0.0 {
            match tube.normal {
                OpeningNormal::Plumb => {
                    checks.not_supported(format!("{pointer}/tilt_deg"), "a first segment that is not vertical");
                }
                OpeningNormal::Face => {
                    let detail = "must be left out: the first segment runs along the normal of the face";
                    checks.refuse(format!("{pointer}/tilt_deg"), detail);
                }
            }
            ok = false;
        }
    }
    // the normal of a face is known once the room is
    if ok && tube.normal == OpeningNormal::Plumb {
        check_course(pointer, tube, DVec3::Z, checks);
    }
}

/// Checks the bends of a tube from an opening with this unit normal out of the room, and that it stays outside; the segments must be valid by
/// themselves.
pub(super) fn check_course(pointer: &str, tube: &ParametricTube, outward: DVec3, checks: &mut Checks) {
    let segments = &tube.segments;
    let mut ok = true;
    let axes = tube.axes(outward);
    let bends = bends(&axes);
    for (index, bend) in bends.iter().enumerate() {
        if bend.to_degrees() >= STEEPEST_BEND_DEG {
            let detail = format!(
                "a bend of {:.6} degrees: successive segments must turn by less than {STEEPEST_BEND_DEG} degrees; \
                 a bend of 180 degrees folds the guide onto itself",
                bend.to_degrees()
            );
            checks.refuse(format!("{pointer}/segments/{}/tilt_deg", index + 1), detail);
            ok = false;
        }
    }
    if !ok {
        return;
    }
    let radius = 0.5 * tube.diameter_m;
    let Some(pane) = pane_angle(pointer, tube, &axes, checks) else { return };
    // the ellipse of a mitre between axes that turn by b reaches r tan(b / 2) along each of them, that of a pane as if b were twice its angle
    let reach = |bend: Option<&f64>| bend.map_or(0.0, |bend| radius * libm::tan(0.5 * bend));
    let ends: Vec<f64> = bends.into_iter().chain([2.0 * pane]).collect();
    let mut end = DVec3::ZERO;
    for (index, segment) in segments.iter().enumerate() {
        let pointer = format!("{pointer}/segments/{index}");
        let lower = reach(index.checked_sub(1).and_then(|below| ends.get(below)));
        let shortest = lower + reach(ends.get(index));
        if segment.length_m < shortest {
            let detail = format!(
                "must be >= {shortest} m, so that its mitres and a tilted pane do not cross, but is {}",
                segment.length_m
            );
            checks.refuse(format!("{pointer}/length_m"), detail);
        }
        end += axes[index] * segment.length_m;
        // of the ellipse in which the plane of a pane, or across the axis, cuts the segment
        let across = tube.collector.pane().filter(|_| index + 1 == segments.len()).unwrap_or(axes[index]);
        let rise = axes[index].dot(outward);
        let lowest = end.dot(outward) - radius * (outward - across * (rise / across.dot(axes[index]))).length();
        if index > 0 && lowest < 0.0 {
            let detail = match tube.normal {
                OpeningNormal::Plumb => {
                    format!("the guide must stay above the ceiling (0 m), but reaches down to {lowest} m")
                }
                OpeningNormal::Face => format!("the guide must stay behind its face, but is {} m before it", -lowest),
            };
            checks.refuse(format!("{pointer}/tilt_deg"), detail);
        }
    }
}

/// Returns the angle in radians between the last axis and the normal of a tilted pane, 0 without one.
pub(super) fn pane(tube: &ParametricTube, axes: &[DVec3]) -> f64 {
    let of_pane = |(axis, pane): (&DVec3, DVec3)| libm::atan2(axis.cross(pane).length(), axis.dot(pane));
    axes.last().zip(tube.collector.pane()).map_or(0.0, of_pane)
}

/// Returns the angle of [`pane`]; `None` after an error.
fn pane_angle(pointer: &str, tube: &ParametricTube, axes: &[DVec3], checks: &mut Checks) -> Option<f64> {
    let angle = pane(tube, axes);
    if angle.to_degrees() > STEEPEST_PANE_DEG {
        let detail = format!(
            "the pane must be within {STEEPEST_PANE_DEG} degrees of lying across the axis of the last segment, but is {:.6} degrees away",
            angle.to_degrees()
        );
        checks.refuse(format!("{pointer}/collector/tilt_deg"), detail);
        return None;
    }
    Some(angle)
}

/// Returns the angles in radians between successive axes.
pub(super) fn bends(axes: &[DVec3]) -> Vec<f64> {
    axes.windows(2).map(|pair| libm::atan2(pair[0].cross(pair[1]).length(), pair[0].dot(pair[1]))).collect()
}

fn check_mesh_tube(pointer: &str, tube: &MeshTubeDocument, checks: &mut Checks) {
    if !MESH_ID.contains(&tube.mesh.len()) {
        let (least, most) = (MESH_ID.start(), MESH_ID.end());
        checks.refuse(format!("{pointer}/mesh"), format!("must have {least}..{most} characters"));
    }
    checks.number(&format!("{pointer}/rotation_deg"), tube.rotation_deg, TURN_DEG);
    if tube.parts.is_empty() {
        checks.refuse(format!("{pointer}/parts"), "must name at least one material");
    }
    let mut first_diffuser: Option<(&String, &DiffuserDocument)> = None;
    for (name, part) in &tube.parts {
        let pointer = format!("{pointer}/parts/{}", escape(name));
        part.check(&pointer, 0.5 * tube.opening_diameter_m, checks);
        let PartDocument::Diffuser(diffuser) = part else { continue };
        match first_diffuser {
            Some((first, optics)) if optics != diffuser => {
                checks.not_supported(&pointer, format_args!("diffuser optics that differ from those of {first:?}"));
            }
            Some(_) => {}
            None => first_diffuser = Some((name, diffuser)),
        }
    }
}
