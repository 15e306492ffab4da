//! Choice of methods for the effects that are on: the requested method if it can compute the task, or the best one with its reason.
//!
//! The policy of `auto` is in this file: only `for_grids` and `for_views` weigh methods against each other.

use std::sync::Arc;

use crate::integrator::components::Component;
use crate::integrator::diffuser_source::closure_source::{Beside, all_lambertian};
use crate::integrator::method::{Described, Passes, Refusal, RefusalCode, Task};
use crate::integrator::moments;
use crate::integrator::photon::close_points::dishonest_points;
use crate::integrator::{
    Method, bidirectional, light_tracing, path_tracing, photon_mapping, room_matrix, sppm, two_stage,
};
use crate::scene::Scene;
use crate::traceable::TraceableScene;

/// Methods of the grids and of the views; `None` if the job has no such output.
#[derive(Clone, Debug)]
pub struct Methods {
    /// Method that computes all grids.
    pub grids: Option<MethodChoice>,
    /// Method that computes all views.
    pub views: Option<MethodChoice>,
    /// Number of passes that one pass of the grids consists of if their light is reported in parts; `None` if it is not.
    pub parts: Option<usize>,
    /// Second method, which checks the grids; `None` if no check is requested.
    pub check: Option<MethodChoice>,
    /// Computation of a year; `None` if none is requested.
    pub year: Option<YearMethod>,
}

/// Computation of the illuminances of a year.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum YearMethod {
    /// Responses of the sensors to lumens of the tubes, times the lumens at every moment.
    Responses,
    /// Light tracing at every moment.
    Moments,
    /// Responses to Lambertian closures, and light tracing at every moment of the light of the others, added.
    Both,
}

impl YearMethod {
    /// Returns the name of the computation in plans.
    pub fn name(self) -> &'static str {
        match self {
            Self::Responses => "responses",
            Self::Moments => "moments",
            Self::Both => "responses_and_moments",
        }
    }

    /// Returns the reason for the computation, as a sentence.
    pub fn reason(self) -> &'static str {
        match self {
            Self::Responses => {
                "every closure is Lambertian, so that the illuminances of a moment are the responses of the room times the \
                 lumens of the tubes: the room is traced once, and sky and sun of every moment are exact"
            }
            Self::Moments => {
                "a closure lets light pass with its direction, so that the sun of every moment is traced from its place; \
                 the sky by 577 patches"
            }
            Self::Both => {
                "some closures are Lambertian: their light is the responses of the room times the lumens of the tubes; \
                 others let light pass with its direction: the sun of every moment is traced from its place through these \
                 alone, and their sky by 577 patches; both are added"
            }
        }
    }
}

/// Method with its settings, and the reason of its choice.
#[derive(Clone, Debug, PartialEq)]
pub struct MethodChoice {
    /// Method, its settings complete with defaults.
    pub method: Method,
    /// Reason in one sentence, for the reader of a plan.
    pub reason: String,
}

/// Value of the document's `method`.
#[derive(Clone, Debug, PartialEq)]
pub enum MethodRequest {
    /// The program chooses a method that does not refuse the task.
    Auto,
    /// This method, or a refusal if it cannot compute the task.
    Method(Method),
    /// A method that has replaced another one, by whose name documents may still ask for it.
    InPlaceOf(&'static str, Method),
}

impl Methods {
    /// Chooses the methods for a compiled scene, or returns a refusal that names what the requested method cannot compute, and a method
    /// that can.
    pub fn choose(scene: &Scene, traceable: &Arc<TraceableScene>, request: &MethodRequest) -> Result<Self, Refusal> {
        let task = Task::whole(scene, traceable);
        match request {
            MethodRequest::Auto => Self::best(&task),
            MethodRequest::Method(method) | MethodRequest::InPlaceOf(_, method) => match refuses(method, &task) {
                None => Ok(Self::requested(method, request, &task)),
                Some(refusal) => Err(with_advice(refusal, method, Self::best(&task).ok())),
            },
        }
    }

    /// Returns the methods that `auto` picks, which do not refuse the task, or the refusal of the last method where all refuse it.
    fn best(task: &Task) -> Result<Self, Refusal> {
        let grids = (!task.grids.is_empty()).then(|| for_grids(&task.without_views())).transpose()?;
        let views = (!task.views.is_empty()).then(|| for_views(&task.without_grids()));
        Ok(Self { grids, views, parts: None, check: None, year: None })
    }

    fn requested(method: &Method, request: &MethodRequest, task: &Task) -> Self {
        let mut reason = match request {
            MethodRequest::InPlaceOf(former, _) => {
                format!("asked for in the document as {former}, which it replaces")
            }
            _ => "asked for in the document".to_owned(),
        };
        if let Some(remark) = method.described().remark() {
            reason = format!("{reason}; {remark}");
        }
        let choice = MethodChoice { method: method.clone(), reason };
        Self {
            grids: (!task.grids.is_empty()).then(|| choice.clone()),
            views: (!task.views.is_empty()).then_some(choice),
            parts: None,
            check: None,
            year: None,
        }
    }

    /// Returns these methods for grids whose light is reported in parts, or a refusal if the grids' method has no independent passes.
    pub fn in_parts(self, task: &Task) -> Result<Self, Refusal> {
        let of_grids = self.grids.iter().map(|choice| &choice.method);
        if let Some(method) = of_grids.into_iter().find(|method| method.described().passes() != Passes::Independent) {
            let detail = format!(
                "`components` need a method with independent passes, which {} does not have: use auto or another \
                 method",
                method.name()
            );
            return Err(Refusal::new(RefusalCode::DependentPasses, detail));
        }
        Ok(Self { parts: Some(Component::passes(task.traceable)), ..self })
    }

    /// Returns methods for grids whose responses (illuminance per lumen of each patch of the openings) are reported, or a refusal if the
    /// requested method, or every method, cannot report them.
    pub fn with_responses(self, task: &Task, request: &MethodRequest) -> Result<Self, Refusal> {
        let instead = Method::TwoStage(two_stage::Settings::default());
        let computes = |choice: &MethodChoice| choice.method.described().computes_responses();
        if let MethodRequest::Method(method) | MethodRequest::InPlaceOf(_, method) = request
            && !self.grids.iter().all(computes)
        {
            let detail = format!("{} cannot report `responses`: use auto or {}", method.name(), instead.name());
            return Err(Refusal::new(RefusalCode::NoResponses, detail));
        }
        let of_room = || room_matrix::refuses(task);
        if let Some(refusal) = of_room().or_else(|| instead.described().refuses(&task.without_views())) {
            let detail = format!("{} cannot compute responses of the room: {}", instead.name(), refusal.detail);
            return Err(Refusal { detail, ..refusal });
        }
        if self.grids.iter().all(computes) {
            return Ok(self);
        }
        let reason = "the document asks for the `responses` of a grid".to_owned();
        Ok(Self { grids: Some(MethodChoice { method: instead, reason }), ..self })
    }

    /// Returns methods for grids that are computed at many moments, too, or a refusal if these cannot be computed, or have no passes to be
    /// computed in.
    pub fn at_moments(self, task: &Task) -> Result<Self, Refusal> {
        if let Some(choice) = &self.grids
            && choice.method.described().passes() == Passes::None
        {
            let name = choice.method.name();
            let detail = format!(
                "below closures that let light pass with its direction a year is computed in passes, and {name} has \
                 none: use auto or another method"
            );
            return Err(Refusal::new(RefusalCode::DependentPasses, detail));
        }
        moments::refuses(task).map_or(Ok(self), Err)
    }

    /// Adds a second method that checks the grids, or returns a refusal if no other method computes them with reliable errors, or if the
    /// grids' method has no passes.
    pub fn checked(self, task: &Task) -> Result<Self, Refusal> {
        let Some(grids) = &self.grids else {
            return Err(Refusal::new(
                RefusalCode::NoSecondMethod,
                "`cross_check` compares grids, and the job has none",
            ));
        };
        let first = &grids.method;
        if first.described().passes() == Passes::None {
            let detail = format!("`cross_check` needs a method that computes in passes, and {} does not", first.name());
            return Err(Refusal::new(RefusalCode::DependentPasses, detail));
        }
        let Some(check) = check_of(first, &task.without_views()) else {
            let detail = format!(
                "`cross_check` needs a second method, but only {} computes these grids with reliable errors",
                first.name()
            );
            return Err(Refusal::new(RefusalCode::NoSecondMethod, detail));
        };
        Ok(Self { check: Some(check), ..self })
    }

    /// True if one pass of one method computes both grids and views.
    pub fn passes_are_common(&self) -> bool {
        match (&self.grids, &self.views) {
            (Some(grids), Some(views)) => grids.method == views.method && self.parts.is_none() && self.check.is_none(),
            _ => false,
        }
    }

    /// Returns the names of the methods of the grids and of the views; one name if both are the same.
    pub fn names(&self) -> Vec<&'static str> {
        let all = self.grids.iter().chain(&self.views);
        let mut names: Vec<_> = all.map(|choice| choice.method.name()).collect();
        names.dedup();
        names
    }
}

/// Returns the best method for grids, the first candidate that fits, or a refusal where none computes sensors that do not look up.
fn for_grids(task: &Task) -> Result<MethodChoice, Refusal> {
    let paths = two_stage::Settings::default();
    if paths.refuses(task).is_none() && paths.warns(task).is_none() {
        return Ok(MethodChoice { method: Method::TwoStage(paths), reason: two_stage_reason(task) });
    }
    if task.has_placed_sensors() {
        let path_tracing = path_tracing::Settings::default();
        if let Some(refusal) = path_tracing.refuses(task) {
            let detail = format!(
                "only {} computes `points_m` here, but {}; use a level grid",
                path_tracing.name(),
                refusal.detail
            );
            return Err(Refusal { detail, ..refusal });
        }
        let reason = "unbiased at sensors of any position and direction, also for light that closures pass unscattered"
            .to_owned();
        return Ok(MethodChoice { method: Method::PathTracing(path_tracing), reason });
    }
    let unseen = || light_tracing::refuses_points(task.traceable).map(|refusal| refusal.detail);
    let noisy = || light_tracing::noisy_points(task.traceable).map(str::to_owned);
    // obstacles of connections from photons to points
    let rare = task.has_points().then(|| unseen().or_else(noisy)).flatten();
    let close = dishonest_points(task.traceable, task.grids).map(|refusal| refusal.detail);
    let both_ways = bidirectional::Settings::default();
    let (method, reason) = match (rare, close) {
        (None, None) => (
            Method::LightTracing(light_tracing::Settings::default()),
            "unbiased: connects every scattering of light to every sensor in closed form".to_owned(),
        ),
        (None, Some(close)) if both_ways.refuses(task).is_none() => (Method::Bidirectional(both_ways), close),
        // it gathers over the room, not at the sensor: a tenth of the time that sppm takes to the same error
        (Some(reason), _) | (None, Some(reason)) => {
            let reason = format!("{reason}; averages over cells take less time, by light tracing");
            (Method::PhotonMapping(photon_mapping::Settings::default()), reason)
        }
    };
    Ok(MethodChoice { method, reason })
}

/// Describes in words how light from openings and luminaires is computed in two stages for this task.
fn two_stage_reason(task: &Task) -> String {
    let (scene, beside) = (task.traceable, Beside::of(task));
    let (found, beside) = if scene.tubes.is_empty() {
        ("luminaires alone light the room", "")
    } else if all_lambertian(&scene.tubes) {
        ("light that leaves the diffusers of the tubes is computed once for all sensors", "")
    } else {
        (
            "light that leaves the Lambertian zones of the closures is computed once for all sensors",
            match beside {
                Beside::Connected => "; sensors and paths are connected to the light that passes unscattered",
                Beside::Traced | Beside::Nothing => "; light that passes unscattered is traced separately",
            },
        )
    };
    let reflected = "sensors gather reflected light from a coarse radiosity solution, and paths compute what that \
                     solution leaves out";
    format!("{found}; {reflected}{beside}")
}

/// Finds a method that computes the same light as `first` independently and with reliable errors: the first candidate that can.
///
/// Methods that cut paths at the diffusers use the same light from the tubes, so that none of them checks another.
fn check_of(first: &Method, task: &Task) -> Option<MethodChoice> {
    let rare = || {
        light_tracing::refuses_points(task.traceable).is_some() || light_tracing::noisy_points(task.traceable).is_some()
    };
    let close = || dishonest_points(task.traceable, task.grids).is_some();
    let connects = Method::LightTracing(light_tracing::Settings::default());
    let light_tracing = (!task.has_points() || !(rare() || close())).then_some(connects);
    let candidates = [
        light_tracing,
        Some(Method::TwoStage(two_stage::Settings::default())),
        Some(Method::Bidirectional(bidirectional::Settings::default())),
        Some(Method::PathTracing(path_tracing::Settings::default())),
        Some(Method::PhotonMapping(photon_mapping::Settings::default())),
    ];
    // unscattered light beside Lambertian closures is computed by light tracing
    let beside = !all_lambertian(&task.traceable.tubes);
    let traces_light = |method: &Method| matches!(method, Method::TwoStage(_) | Method::LightTracing(_));
    let is_able = |method: &Method| {
        let described = method.described();
        let is_alike = beside && traces_light(first) && traces_light(method);
        !is_alike && method.name() != first.name() && refuses(method, task).is_none() && described.warns(task).is_none()
    };
    let method = candidates.into_iter().flatten().find(is_able)?;
    let reason = format!("checks {}: it computes the same light independently", first.name());
    Some(MethodChoice { method, reason })
}

/// Returns the best method for views: the first candidate that fits.
fn for_views(task: &Task) -> MethodChoice {
    let paths = two_stage::Settings { samples_per_pixel: 1, ..two_stage::Settings::default() };
    if paths.refuses(task).is_none() && paths.warns(task).is_none() {
        let reason = "unbiased: light that leaves diffusers is computed once, and paths from the eye receive it, and \
                      that of luminaires, in closed form";
        return MethodChoice { method: Method::TwoStage(paths), reason: reason.to_owned() };
    }
    let both_ways = bidirectional::Settings::default();
    if both_ways.refuses(task).is_none() && both_ways.warns(task).is_none() {
        let reason = "unbiased: paths from the eye are connected with paths from the sky and the sun, which clear \
                      closures let through";
        return MethodChoice { method: Method::Bidirectional(both_ways), reason: reason.to_owned() };
    }
    let reason = "its photons find light through clear closures and mirrors, which paths from the eye alone would miss"
        .to_owned();
    MethodChoice { method: Method::Sppm(sppm::Settings::default()), reason }
}

/// Returns the reason why a method cannot compute a task, if there is one.
pub fn refuses(method: &Method, task: &Task) -> Option<Refusal> {
    let described = method.described();
    if !described.outputs().views && !task.views.is_empty() {
        return Some(Refusal::new(RefusalCode::GridsOnly, "it computes grids only"));
    }
    if !described.outputs().any_sensors && task.has_placed_sensors() {
        return Some(Refusal::new(RefusalCode::PlacedSensors, "it computes only horizontal sensors that face upward"));
    }
    described.refuses(task)
}

/// Completes a refusal for the user, with the name of the method and what to ask for instead.
fn with_advice(refusal: Refusal, method: &Method, best: Option<Methods>) -> Refusal {
    let auto = best.map(|best| format!("auto, which chooses {} here", best.names().join(" and ")));
    let advice: Vec<String> = refusal.instead.map(str::to_owned).into_iter().chain(auto).collect();
    let advice = if advice.is_empty() { String::new() } else { format!("; use {}", advice.join(", or ")) };
    let detail = format!("{} cannot compute this: {}{advice}", method.name(), refusal.detail);
    Refusal { detail, ..refusal }
}
