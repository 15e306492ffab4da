//! From effects to methods.

use crate::integrator::{Method, bidirectional, deterministic, light_tracing, path_tracing, ppm, sppm, two_stage};
use crate::scene::{EstimateKind, Scene};
use crate::traceable::TraceableScene;

/// Which method computes the grids and which the views; `None` where the job has no such output.
#[derive(Clone, Debug)]
pub struct Methods {
    pub grids: Option<MethodChoice>,
    pub views: Option<MethodChoice>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct MethodChoice {
    pub method: Method,
    pub reason: String,
}

/// The document's `method`.
#[derive(Clone, Debug, PartialEq)]
pub enum MethodRequest {
    Auto,
    Method(Method),
}

/// A method that cannot compute what the job asks for.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct PlanRefusal(pub String);

impl Methods {
    /// The methods for a compiled scene: the requested one where it is able, or the best with its reason.
    pub fn choose(scene: &Scene, traceable: &TraceableScene, request: &MethodRequest) -> Result<Self, PlanRefusal> {
        let has_points = scene.grids.iter().any(|grid| grid.estimate == EstimateKind::Point);
        let refusal = has_points.then(|| light_tracing::refuses_points(traceable)).flatten();
        let choice = |method: Method, reason: &str| Some(MethodChoice { method, reason: reason.into() });
        let requested = "asked for in the document";
        let (grids, views) = match request {
            MethodRequest::Auto => {
                let noise = || has_points.then(|| light_tracing::noisy_points(traceable)).flatten();
                let close = light_tracing::dishonest_points(traceable, &scene.grids);
                let both_ways = close.filter(|_| bidirectional::refuses(traceable, &scene.grids, &[]).is_none());
                let grids = match refusal.or_else(noise) {
                    None if let Some(reason) = both_ways => {
                        choice(Method::Bidirectional(bidirectional::Settings::default()), reason)
                    }
                    None if let Some(reason) = close => choice(Method::Sppm(sppm::Settings::default()), reason),
                    None => choice(
                        Method::LightTracing(light_tracing::Settings::default()),
                        "unbiased, and connects every scattering to every sensor in closed form",
                    ),
                    Some(reason) => choice(Method::Sppm(sppm::Settings::default()), reason),
                };
                let views = choice(
                    Method::Sppm(sppm::Settings::default()),
                    "sees light through clear closures and mirrors, which no eye ray finds by chance",
                );
                (grids, views)
            }
            MethodRequest::Method(method @ Method::LightTracing(_)) => {
                if !scene.views.is_empty() {
                    return Err(PlanRefusal("light_tracing computes grids only: use auto or sppm for views".into()));
                }
                if let Some(reason) = refusal.or_else(|| light_tracing::dishonest_points(traceable, &scene.grids)) {
                    let advice = "use auto, sppm, or the estimate cell_average";
                    return Err(PlanRefusal(format!("not supported yet: {reason}; {advice}")));
                }
                (choice(method.clone(), requested), None)
            }
            MethodRequest::Method(
                method @ (Method::Ppm(ppm::Settings { radius, .. }) | Method::Sppm(sppm::Settings { radius, .. })),
            ) => {
                let reason = format!("{requested}; {}", radius.reason());
                (choice(method.clone(), &reason), choice(method.clone(), &reason))
            }
            MethodRequest::Method(method @ Method::PathTracing(_)) => {
                if let Some(reason) = path_tracing::refuses(traceable) {
                    let advice =
                        if scene.views.is_empty() { "use auto, light_tracing or sppm" } else { "use auto or sppm" };
                    return Err(PlanRefusal(format!("not supported by path_tracing: {reason}; {advice}")));
                }
                (choice(method.clone(), requested), choice(method.clone(), requested))
            }
            MethodRequest::Method(method @ Method::Bidirectional(_)) => {
                if let Some(reason) = bidirectional::refuses(traceable, &scene.grids, &scene.views) {
                    let advice = "use auto or sppm";
                    return Err(PlanRefusal(format!("not supported by {}: {reason}; {advice}", method.name())));
                }
                (choice(method.clone(), requested), choice(method.clone(), requested))
            }
            MethodRequest::Method(method @ Method::PhotonMapping(_)) => {
                let reason = "asked for in the document; the bias of its gather radius does not shrink with passes: its \
                              estimate is part of every error";
                (choice(method.clone(), reason), choice(method.clone(), reason))
            }
            MethodRequest::Method(method @ Method::TwoStage(_)) => {
                if let Some(reason) = two_stage::refuses(traceable) {
                    let advice =
                        if scene.views.is_empty() { "use auto, light_tracing or sppm" } else { "use auto or sppm" };
                    return Err(PlanRefusal(format!("not supported by two_stage: {reason}; {advice}")));
                }
                let reason = "asked for in the document; photons to the diffusers, then backward paths in the room";
                (choice(method.clone(), reason), choice(method.clone(), reason))
            }
            MethodRequest::Method(method @ (Method::Holigilm | Method::Jenkins(_))) => {
                if let Some(reason) = deterministic::refuses(method, scene, traceable) {
                    return Err(PlanRefusal(reason));
                }
                (choice(method.clone(), requested), None)
            }
        };
        Ok(Self { grids: grids.filter(|_| !scene.grids.is_empty()), views: views.filter(|_| !scene.views.is_empty()) })
    }

    /// True if one pass of one method gives both grids and views.
    pub fn share_passes(&self) -> bool {
        match (&self.grids, &self.views) {
            (Some(grids), Some(views)) => grids.method == views.method,
            _ => false,
        }
    }
}
