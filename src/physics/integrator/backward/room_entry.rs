//! Points where rays of an eye enter the room, and light of closures that an eye sees directly.

use glam::DVec3;

use crate::integrator::photon::descent::Exit;
use crate::optics::Spectrum;
use crate::scene::View;
use crate::traceable::{SurfaceId, TraceableScene};

/// Finds the point at which an eye ray is inside the room: the eye itself, or a point of an open surface; `None` when something opaque
/// closes the room where the ray would enter.
pub fn enter_room(scene: &TraceableScene, eye: DVec3, direction: DVec3) -> Option<DVec3> {
    if scene.enclosure.contains(eye) {
        return Some(eye);
    }
    let entry = scene.enclosure.entry(eye, direction);
    let entry = entry.filter(|(face, _)| scene.optics(SurfaceId::numbered(*face)).is_none()).map(|(_, entry)| entry);
    entry.filter(|entry| *entry == eye || !hidden_by_luminaire(scene, eye, direction, *entry))
}

/// True if the dark side of a luminaire closes an open surface at the point where an eye ray enters.
fn hidden_by_luminaire(scene: &TraceableScene, eye: DVec3, direction: DVec3, entry: DVec3) -> bool {
    let distance = (entry - eye).length();
    let at_entry = |t: f64| (t - distance).abs() <= scene.coinciding();
    scene.luminaires.iter().any(|luminaire| luminaire.intersect(eye, direction).is_some_and(at_entry))
}

/// Returns the pixel of a view that directly sees light leaving a closure, and the luminance in cd/m2 that this adds.
pub fn exit_seen_by<const C: usize>(
    scene: &TraceableScene,
    exit: &Exit<'_, C>,
    view: &View,
) -> Option<(usize, Spectrum<C>)> {
    let (pixel, solid_angle) = view.pixel_of(exit.position)?;
    let to_exit = exit.position - view.eye;
    let distance_squared = to_exit.length_squared();
    let direction = to_exit / distance_squared.sqrt();
    let intensity = exit.intensity(-direction);
    if intensity.max() <= 0.0 {
        return None;
    }
    let entry = enter_room(scene, view.eye, direction)?;
    let visible = scene.visible(exit.position, None, entry, None);
    visible.then(|| (pixel, intensity * (1.0 / (distance_squared * solid_angle))))
}
