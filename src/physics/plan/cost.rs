//! What a pass costs, before it has run: only the division of a job into chunks, and when it looks at its errors, depend on it.
//!
//! Seconds here and in the methods' own files are rough, of one core; they were measured on 2026-11-21, while the methods
//! were written, on a machine that was not recorded. They need not be true elsewhere: a chunk is then longer or shorter.

use super::{GuidePlan, MethodChoice, Methods, Plan};
use crate::integrator::method::Work;
use crate::plan::{EffectKind, GuideKind};
use crate::scene::Scene;
use crate::traceable::TraceableScene;

/// Seconds to follow one path through a tube whose guide has a closed form, and through a room of faces and boxes.
const PATH: f64 = 0.5e-6;

/// Seconds to follow one path through a tube that is traced facet by facet.
const PATH_THROUGH_FACETS: f64 = 8e-6;

/// Seconds that the rays of one path take more among the triangles of objects.
const AMONG_TRIANGLES: f64 = 4e-6;

/// Seconds to connect one vertex to one sensor in an inner loop that looks for no obstacles.
const CONNECTION: f64 = 10e-9;

/// Seconds to connect one vertex to one sensor where a lobe is evaluated: lobes cost more than a cosine.
const CONNECTION_OF_LOBE: f64 = 50e-9;

/// Seconds to connect one vertex to one sensor by a ray among the triangles of objects.
const CONNECTION_AMONG_TRIANGLES: f64 = 500e-9;

/// A pass of all grids and views of a scene, and what its parts take, where a relative standard error `target` is asked for. Meshes
/// that `traceable` has as boxes cost what boxes do.
pub fn work(scene: &Scene, traceable: &TraceableScene, plan: &Plan, target: f64) -> Work {
    let of_guide = |guide: &GuidePlan| if guide.kind == GuideKind::Mesh { PATH_THROUGH_FACETS } else { PATH };
    let path = plan.guides.iter().map(of_guide).fold(PATH, f64::max);
    let (path, connection) = if traceable.meshes.is_none() {
        (path, CONNECTION)
    } else {
        (path + AMONG_TRIANGLES, CONNECTION_AMONG_TRIANGLES)
    };
    let glossy = plan.effects.is_on(EffectKind::Glossy);
    Work {
        sensors: scene.grids.iter().map(|grid| grid.len()).sum::<usize>() as f64,
        pixels: scene.views.iter().map(|view| view.size_px[0] * view.size_px[1]).sum::<usize>() as f64,
        tubes: scene.tubes.len() as f64,
        target,
        seconds_per_path: path,
        seconds_per_connection: if glossy { f64::max(connection, CONNECTION_OF_LOBE) } else { connection },
    }
}

/// Rough seconds per pass on one core of the machine that the constants were measured on.
///
/// A function of the job alone, never of the machine or of a clock, so that every worker divides a job alike.
pub fn seconds_per_pass(scene: &Scene, traceable: &TraceableScene, plan: &Plan, target: f64) -> f64 {
    let both = work(scene, traceable, plan, target);
    let grids = Work { pixels: 0.0, ..both };
    let views = Work { sensors: 0.0, ..both };
    let methods: &Methods = &plan.methods;
    match (&methods.grids, &methods.views) {
        (Some(choice), Some(_)) if methods.share_passes() => choice.method.described().seconds_per_pass(&both),
        (of_grids, of_views) => {
            let of_passes = |choice: &MethodChoice| choice.method.described().seconds_per_pass(&grids);
            let parts = methods.parts.unwrap_or(1) as f64;
            parts * of_grids.as_ref().map_or(0.0, of_passes)
                + methods.check.as_ref().map_or(0.0, of_passes)
                + of_views.as_ref().map_or(0.0, |choice| choice.method.described().seconds_per_pass(&views))
        }
    }
}
