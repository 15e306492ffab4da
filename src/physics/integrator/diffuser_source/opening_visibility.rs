//! Visibility of an opening from a vertex of a path: whole, in part, or not at all.

use super::cells::is_far;
use crate::geometry::OpeningFrame;
use crate::integrator::backward::vertex::Vertex;
use crate::optics::Spectrum;
use crate::traceable::TraceableScene;

/// Estimator of an opening's light at a vertex, by how the vertex sees it.
#[derive(Clone, Copy, Debug)]
pub enum OpeningVisibility<const C: usize> {
    /// Scattered rays: the vertex has so narrow a lobe, or is a sensor so near, that connections would have too much variance.
    ByRays,
    /// None: the opening lies below the horizon.
    Never,
    /// Closed form: nothing can stand between, and the vertex is Lambertian; the path's weight times pi times BSDF.
    Whole(Spectrum<C>),
    /// Connections to photons, in all other cases.
    InPart,
}

/// Fraction of the radius by which a horizon may cut a disc from rounding alone.
const HORIZON: f64 = 1e-9;

/// Determines how `vertex` sees an opening of `radius` m.
pub fn opening_visibility<const C: usize>(
    scene: &TraceableScene,
    vertex: &Vertex<'_, C>,
    opening: &OpeningFrame,
    radius: f64,
) -> OpeningVisibility<C> {
    let far = is_far(opening, radius, vertex.position, 0.0);
    if vertex.is_narrow() || (vertex.is_sensor() && !far) {
        return OpeningVisibility::ByRays;
    }
    let height = (opening.origin - vertex.position).dot(vertex.normal);
    let reach = radius * opening.levelled_direction(vertex.normal).truncate().length();
    if height + reach <= 0.0 {
        return OpeningVisibility::Never;
    }
    // a wall that touches the disc is not cut by it
    let above = height >= reach - HORIZON * radius;
    let clear = || scene.leaves_clear(vertex.position, 0.0, vertex.surface, opening, radius);
    match vertex.lambertian().filter(|_| far && above && clear()) {
        Some(albedo) => OpeningVisibility::Whole(albedo),
        None => OpeningVisibility::InPart,
    }
}
