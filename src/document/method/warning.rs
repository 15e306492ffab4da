//! What a reader of a method's results must know.

use crate::document::errors::Warning;
use crate::integrator::Method;
use crate::scene::{EstimateKind, Grid};
use crate::traceable::TraceableScene;

/// Warning that a reader of a method's results must know of, if there is one.
pub fn method_warning(method: &Method, scene: &TraceableScene, grids: &[Grid]) -> Option<Warning> {
    let mirrors = scene.interreflection && scene.specular().any(|specular| specular.lobe.is_none());
    let points = grids.iter().any(|grid| grid.estimate == EstimateKind::Point);
    let by_chance = match method {
        Method::PathTracing(_) | Method::TwoStage(_) => mirrors,
        Method::Bidirectional(_) => mirrors && points,
        _ => false,
    };
    if by_chance {
        return Some(Warning {
            code: "mirrors_by_chance".to_owned(),
            detail: format!(
                "{} finds a diffuser or luminaire that a mirror shows to a sensor by chance: as long as few paths have, the \
                 standard error is too small; cell averages by light_tracing or bidirectional_path_tracing do not have \
                 this fault",
                method.name()
            ),
        });
    }
    let Method::Jenkins(settings) = method else { return None };
    let excess = settings.coefficient * std::f64::consts::PI;
    Some(Warning {
        code: "jenkins_flux_excess".to_owned(),
        detail: format!(
            "semi-empirical: over the whole plane the formula gives {excess:.3} times the flux that the tube puts into \
             the room; its coefficient {} was fitted with the reflections of a room in it, and the reflectances of this \
             room do not enter; no estimate of the error exists",
            settings.coefficient
        ),
    })
}
