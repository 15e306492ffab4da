//! From effects to methods: the requested one where it is able, or the best with its reason.
//!
//! The policy of `auto` is the subject of this file: `for_grids` and `for_views` alone weigh methods against each other.

use std::sync::Arc;

use crate::integrator::components::Component;
use crate::integrator::lamp::beside::all_lamps;
use crate::integrator::method::{Described, Passes, Refusal, RefusalCode, Task};
use crate::integrator::photon::close_points::{dishonest_points, distance_to_surface, near_surfaces};
use crate::integrator::some_sensors::SensorPlace;
use crate::integrator::{
    Method, bidirectional, lamp_responses, light_tracing, path_tracing, photon_mapping, placed_vertices, sppm,
    two_stage,
};
use crate::scene::{EstimateKind, Grid, Scene};
use crate::traceable::luminaire::TraceableLuminaire;
use crate::traceable::{TraceableScene, TraceableTube};

/// Methods of the grids and of the views; `None` where the job has no such output.
#[derive(Clone, Debug)]
pub struct Methods {
    /// The method that computes all grids.
    pub grids: Option<MethodChoice>,
    /// Point sensors for which another method takes its place; `None` where there are none.
    pub beside_surfaces: Option<SomeChoice>,
    /// The method that computes all views.
    pub views: Option<MethodChoice>,
    /// Number of passes that one pass of the grids is made of where their light is told in parts; `None` where it is not.
    pub parts: Option<usize>,
    /// The method that checks the grids, beside theirs; `None` where nothing was asked for.
    pub check: Option<MethodChoice>,
}

/// A method with its settings, and why it was taken.
#[derive(Clone, Debug, PartialEq)]
pub struct MethodChoice {
    /// The method, its settings complete with defaults.
    pub method: Method,
    /// One sentence for the reader of a plan.
    pub reason: String,
}

/// A method for some of the sensors.
#[derive(Clone, Debug, PartialEq)]
pub struct SomeChoice {
    /// The method, and why it was taken.
    pub choice: MethodChoice,
    /// The sensors, at least one.
    pub places: Vec<SensorPlace>,
}

impl SomeChoice {
    /// A grid of one for each of the sensors, in their order; `grids` of the scene.
    pub fn as_grids(&self, grids: &[Grid]) -> Vec<Grid> {
        self.places.iter().filter_map(|place| place.as_grid(grids)).collect()
    }
}

/// Share of all sensors up to which those that lie beside surfaces get a method of their own.
const FEW: f64 = 0.25;

/// The document's `method`.
#[derive(Clone, Debug, PartialEq)]
pub enum MethodRequest {
    /// The program chooses; it takes a method that refuses nothing.
    Auto,
    /// This method, or a refusal.
    Method(Method),
}

impl Methods {
    /// The methods for a compiled scene; a refusal says what the requested method cannot compute, and what can.
    pub fn choose(scene: &Scene, traceable: &Arc<TraceableScene>, request: &MethodRequest) -> Result<Self, Refusal> {
        let task = Task::whole(scene, traceable);
        match request {
            MethodRequest::Auto => Ok(Self::best(&task)),
            MethodRequest::Method(method) => match refuses(method, &task) {
                None => Ok(Self::requested(method, &task)),
                Some(refusal) => Err(with_advice(refusal, method, &Self::best(&task))),
            },
        }
    }

    /// The methods that `auto` picks; they refuse nothing.
    fn best(task: &Task) -> Self {
        let of_grids = (!task.grids.is_empty()).then(|| for_grids(&task.without_views()));
        let (grids, beside_surfaces) = of_grids.map_or((None, None), |(grids, beside)| (Some(grids), beside));
        let views = (!task.views.is_empty()).then(|| for_views(task));
        Self { grids, beside_surfaces, views, parts: None, check: None }
    }

    fn requested(method: &Method, task: &Task) -> Self {
        let mut reason = "asked for in the document".to_owned();
        if let Some(remark) = method.described().remark() {
            reason = format!("{reason}; {remark}");
        }
        let choice = MethodChoice { method: method.clone(), reason };
        Self {
            grids: (!task.grids.is_empty()).then(|| choice.clone()),
            beside_surfaces: None,
            views: (!task.views.is_empty()).then_some(choice),
            parts: None,
            check: None,
        }
    }

    /// The same methods for grids whose light is told in parts; a refusal where theirs cannot.
    pub fn in_parts(self, task: &Task) -> Result<Self, Refusal> {
        let of_grids = self.grids.iter().map(|choice| &choice.method);
        if let Some(method) = of_grids.into_iter().find(|method| method.described().passes() != Passes::Independent) {
            let detail = format!("parts add up in independent passes, and {} has none", method.name());
            return Err(Refusal::new(RefusalCode::DependentPasses, detail));
        }
        Ok(Self { parts: Some(Component::passes(task.traceable)), ..self })
    }

    /// The same methods for grids whose responses are told; a refusal where the requested method cannot, or none can.
    pub fn with_responses(self, task: &Task, request: &MethodRequest) -> Result<Self, Refusal> {
        if self.grids.iter().all(|choice| choice.method.described().tells_responses()) {
            return Ok(self);
        }
        let responses = lamp_responses::Settings::default();
        let instead = Method::LampResponses(responses.clone());
        if let MethodRequest::Method(method) = request {
            let detail = format!("{} tells no responses: use auto or {}", method.name(), instead.name());
            return Err(Refusal::new(RefusalCode::NoResponses, detail));
        }
        if let Some(refusal) = responses.refuses(&task.without_views()) {
            let detail = format!("{} cannot tell responses: {}", instead.name(), refusal.detail);
            return Err(Refusal { detail, ..refusal });
        }
        let reason = "the responses of the room are asked for; they are kept for other skies".to_owned();
        Ok(Self { grids: Some(MethodChoice { method: instead, reason }), beside_surfaces: None, ..self })
    }

    /// The same methods and one that checks the grids; a refusal where none is honest here, or there are no passes to check.
    pub fn checked(self, task: &Task) -> Result<Self, Refusal> {
        let Some(grids) = &self.grids else {
            return Err(Refusal::new(RefusalCode::NoSecondMethod, "grids are checked, and the job has none"));
        };
        let first = &grids.method;
        if first.described().passes() == Passes::None {
            let detail = format!("passes are checked by passes, and {} has none", first.name());
            return Err(Refusal::new(RefusalCode::DependentPasses, detail));
        }
        let Some(check) = check_of(first, &task.without_views()) else {
            let detail = format!("no method but {} computes these grids with honest errors", first.name());
            return Err(Refusal::new(RefusalCode::NoSecondMethod, detail));
        };
        Ok(Self { check: Some(check), ..self })
    }

    /// True if one pass of one method gives both grids and views.
    pub fn share_passes(&self) -> bool {
        match (&self.grids, &self.views) {
            (Some(grids), Some(views)) => grids.method == views.method && self.parts.is_none() && self.check.is_none(),
            _ => false,
        }
    }

    /// The names of the methods of the grids, of sensors beside surfaces, and of the views, where they are others.
    pub fn names(&self) -> Vec<&'static str> {
        let beside = self.beside_surfaces.iter().map(|some| &some.choice);
        let all = self.grids.iter().chain(beside).chain(&self.views);
        let mut names: Vec<_> = all.map(|choice| choice.method.name()).collect();
        names.dedup();
        names
    }
}

/// The best method for grids, the first candidate that fits, and where few point sensors are bad for it, another one for these.
fn for_grids(task: &Task) -> (MethodChoice, Option<SomeChoice>) {
    let placed = placed_vertices::Settings::default();
    if placed.refuses(task).is_none() {
        let reason = placed_reason(task.traceable);
        return (MethodChoice { method: Method::PlacedVertices(placed), reason }, None);
    }
    if let Some(choice) = electric_cells(task).or_else(|| cells_beside_walls(task)) {
        return (choice, None);
    }
    let unseen = || light_tracing::refuses_points(task.traceable).map(|refusal| refusal.detail);
    let noisy = || light_tracing::noisy_points(task.traceable).map(str::to_owned);
    // obstacles of connections from photons to points
    let rare = task.has_points().then(|| unseen().or_else(noisy)).flatten();
    let close = dishonest_points(task.traceable, task.grids).map(|refusal| refusal.detail);
    let both_ways = bidirectional::Settings::default();
    let connects = || MethodChoice {
        method: Method::LightTracing(light_tracing::Settings::default()),
        reason: "unbiased, and connects every scattering to every sensor in closed form".to_owned(),
    };
    let (method, reason) = match (rare, close) {
        (None, None) => return (connects(), None),
        (None, Some(close)) if both_ways.refuses(task).is_none() => {
            let choice = MethodChoice { method: Method::Bidirectional(both_ways), reason: close };
            let places = near_surfaces(task.traceable, task.grids);
            let sensors: usize = task.grids.iter().map(Grid::len).sum();
            let few = places.len() as f64 <= FEW * sensors as f64;
            return if few { (connects(), Some(SomeChoice { choice, places })) } else { (choice, None) };
        }
        // it gathers over the room, not at the sensor: a tenth of the time that sppm takes to the same error
        (Some(reason), _) | (None, Some(reason)) => {
            (Method::PhotonMapping(photon_mapping::Settings::default()), reason)
        }
    };
    (MethodChoice { method, reason }, None)
}

/// Words on vertices that are placed where sensors need them, in this scene.
fn placed_reason(scene: &TraceableScene) -> String {
    let (found, beside) = if scene.tubes.is_empty() {
        ("luminaires alone light the room: what they send is found once", "")
    } else if all_lamps(&scene.tubes) {
        ("all tubes are lamps: what leaves their diffusers is found once", "")
    } else {
        let found = "tubes are lamps in part: what their Lambertian zones send is found once";
        (found, "; what passes unscattered is traced beside")
    };
    let reflected = if placed_vertices::gathers(scene) {
        "sensors gather what walls and boxes reflect of it from a coarse radiosity solution, and points on the surfaces send the residual"
    } else {
        "and lights points placed where sensors need them"
    };
    format!("unbiased, and {found}, {reflected}{beside}")
}

/// For cell averages in a room that luminaires alone light: a photon seldom falls into a cell, and a lamp is seen from everywhere. A
/// quarter of the time that light tracing takes to the same error in the Cornell box.
fn electric_cells(task: &Task) -> Option<MethodChoice> {
    let paths = two_stage::Settings::default();
    let electric = !is_daylit(task.traceable) && task.traceable.luminaires.iter().any(TraceableLuminaire::emits);
    let able = paths.refuses(task).is_none() && paths.warns(task).is_none();
    let reason = "unbiased: luminaires alone light the room, and paths from the cells find them at every reflection";
    (electric && able && !task.has_points())
        .then(|| MethodChoice { method: Method::TwoStage(paths), reason: reason.to_owned() })
}

/// Share of cells beside surfaces among the sensors above which these decide.
const FEW_CELLS: f64 = 0.04;

/// For cell averages beside the walls of an empty room with lamps for tubes: connections would be too bright there, and a photon seldom
/// crosses a cell. A quarter of the time that light tracing takes to the same error in the thesis' room, and three times as much where
/// its cells keep 0.3 m from the walls.
fn cells_beside_walls(task: &Task) -> Option<MethodChoice> {
    let paths = two_stage::Settings::default();
    let scene = task.traceable;
    let able = all_lamps(&scene.tubes) && paths.refuses(task).is_none() && paths.warns(task).is_none();
    if !(scene.is_plain() && able && is_daylit(scene)) {
        return None;
    }
    let is_beside = |(grid, sensor): (&Grid, usize)| {
        // to the cell's far edge, and half of the longer edge on
        let [width, depth] = grid.cell_size_m;
        let average = grid.estimate == EstimateKind::CellAverage;
        average && distance_to_surface(scene, grid.centre(sensor), width.max(depth)).is_some()
    };
    let valued = |grid: &'_ Grid| (0..grid.len()).filter(|sensor| !grid.is_inside(*sensor)).collect::<Vec<_>>();
    let sensors = || task.grids.iter().flat_map(|grid| valued(grid).into_iter().map(move |sensor| (grid, sensor)));
    let beside = sensors().filter(|sensor| is_beside(*sensor)).count();
    let reason = "unbiased, and all tubes are lamps; photons seldom cross cells beside walls, and paths from these find the walls";
    (beside as f64 > FEW_CELLS * sensors().count() as f64)
        .then(|| MethodChoice { method: Method::TwoStage(paths), reason: reason.to_owned() })
}

/// True if daylight comes through a tube.
fn is_daylit(scene: &TraceableScene) -> bool {
    scene.tubes.iter().any(|tube| tube.daylit) && (scene.sky.is_some() || scene.sun.is_some())
}

/// A method that finds the same as `first` in another way, with errors that tell the truth: the first that is able.
///
/// Those that cut paths at the diffusers share what comes down the tubes, so that neither checks the other.
fn check_of(first: &Method, task: &Task) -> Option<MethodChoice> {
    let rare = || {
        light_tracing::refuses_points(task.traceable).is_some() || light_tracing::noisy_points(task.traceable).is_some()
    };
    let close = || dishonest_points(task.traceable, task.grids).is_some();
    let connects = Method::LightTracing(light_tracing::Settings::default());
    let light_tracing = (!task.has_points() || !(rare() || close())).then_some(connects);
    let candidates = [
        light_tracing,
        Some(Method::PlacedVertices(placed_vertices::Settings::default())),
        Some(Method::Bidirectional(bidirectional::Settings::default())),
        Some(Method::PathTracing(path_tracing::Settings::default())),
        Some(Method::PhotonMapping(photon_mapping::Settings::default())),
    ];
    // what comes in beside lamps is found by light tracing
    let beside = !all_lamps(&task.traceable.tubes);
    let traces_light = |method: &Method| {
        let cuts = matches!(method, Method::PlacedVertices(_) | Method::TwoStage(_) | Method::LampResponses(_));
        cuts || matches!(method, Method::LightTracing(_))
    };
    let is_able = |method: &Method| {
        let described = method.described();
        let is_alike = beside && traces_light(first) && traces_light(method);
        !is_alike
            && method.name() != first.name()
            && described.refuses(task).is_none()
            && described.warns(task).is_none()
    };
    let method = candidates.into_iter().flatten().find(is_able)?;
    let reason = format!("checks {}: it finds the same light in another way", first.name());
    Some(MethodChoice { method, reason })
}

/// The best method for views.
fn for_views(task: &Task) -> MethodChoice {
    let lamps = two_stage::Settings { samples_per_pixel: 1, ..two_stage::Settings::default() };
    let scene = task.traceable;
    let daylit = is_daylit(scene);
    let electric = scene.luminaires.iter().any(TraceableLuminaire::emits);
    if daylit && !electric && lamps.refuses(task).is_none() && lamps.warns(task).is_none() {
        let reason = "unbiased, and all tubes are lamps: what leaves their diffusers is found once, and paths from the eye \
                      count it in closed form";
        return MethodChoice { method: Method::TwoStage(lamps), reason: reason.to_owned() };
    }
    let paths = path_tracing::Settings::default();
    let found = paths.refuses(task).is_none() && paths.warns(task).is_none();
    if daylit && !electric && found && scene.tubes.iter().all(scatters_all) {
        let reason =
            "gathers over the room what photons bring: closures scatter all light, and no mirror shows the sun";
        return MethodChoice {
            method: Method::PhotonMapping(photon_mapping::Settings::default()),
            reason: reason.to_owned(),
        };
    }
    let reason = "sees light through clear closures and mirrors, which no eye ray finds by chance".to_owned();
    MethodChoice { method: Method::Sppm(sppm::Settings::default()), reason }
}

/// True if no light passes a tube's closure unscattered.
fn scatters_all(tube: &TraceableTube) -> bool {
    tube.diffuser.specular_zone(tube.opening_radius).is_none()
}

/// Reason why a method cannot compute a task, if it cannot.
pub fn refuses(method: &Method, task: &Task) -> Option<Refusal> {
    let described = method.described();
    if !described.knows().views && !task.views.is_empty() {
        return Some(Refusal::new(RefusalCode::GridsOnly, "it computes grids only"));
    }
    described.refuses(task)
}

/// A refusal for the user, with the name of the method and what to ask for instead.
fn with_advice(refusal: Refusal, method: &Method, best: &Methods) -> Refusal {
    let instead = refusal.instead.map_or(String::new(), |instead| format!("{instead}, or "));
    let (name, best) = (method.name(), best.names().join(" and "));
    let detail = format!("not supported by {name}: {}; use {instead}auto, which takes {best} here", refusal.detail);
    Refusal { detail, ..refusal }
}
