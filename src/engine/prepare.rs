//! Preparation of a job: from a document to a scene and a plan that are ready to render.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use super::annual::AnnualJob;
use super::integrators::Engine;
use super::progress::{PassReport, StoppedBy};
use super::spent::Spent;
use crate::document::errors::WarningCode;
use crate::document::read;
use crate::document::{
    self, DocumentErrors, FieldError, FieldErrorCode, FileSource, JobDocument, Provenance, ValidJob, Warning,
};
use crate::estimate::stopping::{
    WaitingFor, grid_without_light, is_judged, least_passes_of_grids, least_passes_of_views,
};
use crate::estimate::{Accuracy, Estimate, StopRule};
use crate::integrator::Method;
use crate::integrator::components::Component;
use crate::integrator::method::{Passes, Task};
use crate::plan::{self, EffectKind, Effects, Methods, Plan, Span};
use crate::scene::{Grid, MeshObject, Scene, TubeShape};
use crate::traceable::TraceableScene;

/// Job that is ready to render: immutable, shared by threads.
pub struct RenderJob {
    /// Document with all defaults filled in.
    pub document: serde_json::Value,
    /// Effects that are simulated and methods, with reasons.
    pub plan: Plan,
    /// Notes on the document and on its methods.
    pub warnings: Vec<Warning>,
    /// Rule that ends the job.
    pub stop: StopRule,
    /// Name in the document, free text.
    pub name: Option<String>,
    pub(crate) scene: Scene,
    pub(crate) provenance: Provenance,
    pub(crate) traceable: Arc<TraceableScene>,
    /// Integrators of the plan, built by the first pass or by [`Self::make_ready`].
    pub(super) engine: OnceLock<Engine>,
    /// Year of the job.
    pub(crate) annual: Option<AnnualJob>,
    /// Parts of the light that are estimated separately for each grid; empty where none are.
    pub(crate) components: Vec<Component>,
    /// Seed of the random numbers.
    pub(crate) seed: u64,
    /// Methods that documents may name, with the settings of this document.
    pub(crate) offered: Vec<Method>,
}

/// Estimated memory of a prepared job in bytes: a base, and for each tube (tables of the sky), triangle (in the scene and in the bounding
/// volumes), triangle of a copy of a mesh (its surfaces) and sensor (its place).
const BYTES: usize = 64 << 10;
const BYTES_PER_TUBE: usize = 1 << 19;
const BYTES_PER_TRIANGLE: usize = 512;
const BYTES_PER_COPIED_TRIANGLE: usize = 64;
const BYTES_PER_SENSOR: usize = 64;

/// Validates a document (JSON text), loads its meshes, builds the scene and the plan.
pub fn prepare(document: &[u8], meshes: &dyn FileSource) -> Result<RenderJob, DocumentErrors> {
    let document = read::json::value(document)?;
    prepare_document(&JobDocument::from_files(document, meshes)?, meshes)
}

/// Prepares a parsed document: builds and plans its scene, and refuses requests that the plan cannot meet.
pub fn prepare_document(document: &ValidJob, meshes: &dyn FileSource) -> Result<RenderJob, DocumentErrors> {
    let still_wanted = || match meshes.is_cancelled() {
        true => Err(DocumentErrors::from(FieldError::new("", "cancelled: the client no longer waits for the answer"))),
        false => Ok(()),
    };
    let (mut scene, mut warnings, mut provenance) = document::to_scene(document, meshes)?;
    still_wanted()?;
    let span = if document.annual.is_some() { Span::Year } else { Span::Moment };
    let mut effects = Effects::over(&scene, &document.effect_requests(), span);
    let traceable = plan::compile(&scene, &effects)
        .map_err(|error| FieldError::new(format!("/tubes/{}/parts", error.tube), error.error.to_string()))?;
    let traceable = Arc::new(traceable);
    still_wanted()?;
    warnings.extend(document::leave_out(document, &mut scene, effects.is_followed(EffectKind::Objects))?);
    still_wanted()?;
    warnings.extend(document::covered_openings(document, &traceable));
    let mut annual = AnnualJob::read(document, meshes, (&scene, &traceable, &effects), &mut warnings)?;
    still_wanted()?;
    let stop = document.stop_rule();
    let missing = effects.weigh(&scene, &traceable, annual.as_ref().map(AnnualJob::outdoors)).into_iter();
    let missing = missing.filter(|(_, left_out)| left_out.largest() > stop.relative_error);
    warnings.extend(missing.map(|(kind, left_out)| {
        let detail =
            format!("the effect {} is switched off, but the scene calls for it: {}", kind.name(), left_out.words(kind));
        Warning { code: WarningCode::EffectLeftOut, detail }
    }));
    let request = document.method.request();
    let methods =
        Methods::choose(&scene, &traceable, &request).map_err(|refusal| FieldError::refused("/method", refusal))?;
    if let Some(annual) = &mut annual {
        let has_responses =
            annual.by_responses && methods.clone().with_responses(&Task::whole(&scene, &traceable), &request).is_ok();
        if annual.at_moments && !has_responses {
            annual.without_responses(&mut scene);
        }
        annual.add_moments(&mut scene);
    }
    let task = Task::whole(&scene, &traceable);
    let methods = match scene.grids.iter().position(|grid| grid.components) {
        Some(grid) => {
            let pointer = format!("/grids/{grid}/components");
            methods.in_parts(&task).map_err(|refusal| FieldError::refused(pointer, refusal))?
        }
        None => methods,
    };
    let methods = match scene.grids.iter().position(|grid| grid.responses.are_reported()) {
        Some(grid) => {
            let pointer = match document.annual {
                Some(_) => "/annual".to_owned(),
                None => format!("/grids/{grid}/responses"),
            };
            methods.with_responses(&task, &request).map_err(|refusal| FieldError::refused(pointer, refusal))?
        }
        None => methods,
    };
    let methods = match scene.moments {
        Some(_) => methods.at_moments(&task).map_err(|refusal| FieldError::refused("/annual", refusal))?,
        None => methods,
    };
    let methods = match document.cross_check {
        true => methods.checked(&task).map_err(|refusal| FieldError::refused("/cross_check", refusal))?,
        false => methods,
    };
    let methods = Methods { year: annual.as_ref().map(AnnualJob::method), ..methods };
    let plan = Plan { guides: plan::guides::guides(&scene, &traceable), effects, methods };
    provenance.interreflection = traceable.interreflection;
    if let Some(sun) = &mut provenance.sun {
        sun.on = traceable.has_sun();
    }
    let Methods { grids, views, .. } = &plan.methods;
    let outputs = [(grids, task.without_views()), (views, task.without_grids())];
    let caveats = outputs.iter().filter_map(|(choice, task)| choice.as_ref()?.method.described().warns(task));
    for caveat in caveats {
        let warning = Warning { code: caveat.code.into(), detail: caveat.detail };
        if !warnings.contains(&warning) {
            warnings.push(warning);
        }
    }
    let components = plan.methods.parts.map_or_else(Vec::new, |_| Component::of_scene(&traceable));
    Ok(RenderJob {
        document: serde_json::to_value(document).unwrap_or_default(),
        warnings,
        stop,
        name: document.name.clone(),
        seed: document.seed,
        offered: document.method.offered(),
        plan,
        scene,
        provenance,
        traceable,
        engine: OnceLock::new(),
        annual,
        components,
    })
}

impl RenderJob {
    /// Builds the integrators of the plan, which try the room for the sizes of their passes. The first pass would do so, too, but within the
    /// time of the job.
    pub fn make_ready(&self) {
        self.engine();
    }

    /// Builds the integrators as [`Self::make_ready`] does, but for the rest of them once `cancel` is raised; returns false then.
    pub fn make_ready_unless(&self, cancel: &AtomicBool) -> bool {
        if self.engine.get().is_none() {
            let built = self.built(cancel);
            if cancel.load(Ordering::Relaxed) {
                return false;
            }
            // where another thread was first, its integrators are the same
            let _ = self.engine.set(built);
        }
        true
    }

    /// Returns the integrators of the plan.
    pub(super) fn engine(&self) -> &Engine {
        self.engine.get_or_init(|| self.built(&AtomicBool::new(false)))
    }

    fn built(&self, cancel: &AtomicBool) -> Engine {
        Engine::new((&self.scene, &self.traceable), &self.plan.methods, &self.stop, self.seed, cancel)
    }

    /// Refuses a job that may be rendered for more than `most` seconds.
    pub fn check_seconds(&self, most: f64) -> Result<(), DocumentErrors> {
        let asked = self.stop.max_seconds;
        if asked <= most {
            return Ok(());
        }
        let detail = format!("must be <= {most} on this service, but is {asked}");
        Err(FieldError::new("/stop/max_seconds", detail).coded(FieldErrorCode::OutOfRange).into())
    }

    /// Returns the row of the convergence table after the last pass of `merged`.
    pub(crate) fn report(&self, merged: &Estimate, spent: Spent) -> PassReport {
        self.report_of(merged, self.accuracy(merged), spent)
    }

    /// Returns the row of the convergence table as [`Self::report`] does, for an estimate of this accuracy.
    pub(crate) fn report_of(&self, merged: &Estimate, accuracy: Accuracy, spent: Spent) -> PassReport {
        PassReport {
            passes: merged.passes,
            seconds: spent.seconds,
            photons: merged.photons,
            rays: merged.rays,
            relative_error: accuracy.grids.filter(|error| error.is_finite()),
            view_relative_error: accuracy.views.filter(|error| error.is_finite()),
            degrees_of_freedom: accuracy.degrees_of_grids.filter(|degrees| degrees.is_finite()),
            mean_lux: merged.grids.first().map(|grid| grid.mean.mean),
            cpu_seconds: spent.cpu_seconds,
        }
    }

    /// Returns the condition that the job waits for after the passes of `merged`, which have this accuracy; `None` after its last pass.
    pub(crate) fn waiting_for(&self, merged: &Estimate, accuracy: Accuracy) -> Option<WaitingFor> {
        self.stop.waiting_for(merged, accuracy).filter(|_| !self.is_complete(merged.passes))
    }

    /// Returns the numbers of passes below which the errors of the grids, and of the views, are not trusted; `None` without such outputs.
    pub(crate) fn least_passes(&self) -> [Option<u64>; 2] {
        [least_passes_of_grids(&self.scene.grids), least_passes_of_views(&self.scene.views)]
    }

    /// Returns the names of the plan's methods: that of the grids, and that of the views where it is another one.
    pub fn method_names(&self) -> String {
        self.plan.methods.names().join(", ")
    }

    /// Estimates the memory that this job holds in bytes, rather too many than too few.
    pub fn bytes(&self) -> usize {
        let Scene { room, tubes, grids, .. } = &self.scene;
        let triangles: usize = room.meshes.iter().map(MeshObject::kept_triangles).sum();
        let copied: usize = room.meshes.iter().map(MeshObject::copied_triangles).sum();
        let of_tubes: usize = tubes
            .iter()
            .map(|tube| match &tube.shape {
                TubeShape::Cylinders(_) => 0,
                TubeShape::Mesh(mesh) => mesh.mesh.triangles.len(),
            })
            .sum();
        let sensors: usize = grids.iter().map(Grid::len).sum();
        let of_year = self.annual.as_ref().map_or(0, |annual| annual.bytes(tubes.len()));
        BYTES
            + of_year
            + tubes.len() * BYTES_PER_TUBE
            + (triangles + of_tubes) * BYTES_PER_TRIANGLE
            + copied * BYTES_PER_COPIED_TRIANGLE
            + sensors * BYTES_PER_SENSOR
    }

    /// True if the job has images to render.
    pub fn has_views(&self) -> bool {
        !self.scene.views.is_empty()
    }

    /// Returns the illuminance grids, in the document's order.
    pub fn grids(&self) -> &[Grid] {
        &self.scene.grids
    }

    /// Returns an estimate of no passes; the integrators are built for it.
    pub fn empty_estimate(&self) -> Estimate {
        let mut estimate = Estimate::empty(&self.scene);
        self.engine().begin(&mut estimate);
        estimate
    }

    /// Returns an estimate of no passes as [`Self::empty_estimate`] does; if `cancel` is raised before the integrators are built, one that no
    /// pass may be added to.
    pub fn empty_estimate_unless(&self, cancel: &AtomicBool) -> Estimate {
        if self.make_ready_unless(cancel) { self.empty_estimate() } else { Estimate::empty(&self.scene) }
    }

    /// True after the last pass that the job can have.
    pub(crate) fn is_complete(&self, passes: u64) -> bool {
        passes >= self.stop.max_passes || self.has_solver()
    }

    /// Returns the reason why the job is done after the passes of `merged`; `None` when it is not.
    pub fn stop_after(&self, merged: &Estimate) -> Option<StoppedBy> {
        let is_complete = self.is_complete(merged.passes);
        if self.has_solver() {
            // the error of a formula is not known
            let within = self.accuracy(merged).grids.is_none_or(|error| error <= self.stop.relative_error);
            Some(if within { StoppedBy::Exact } else { StoppedBy::MaxPasses })
        } else if self.is_dark() {
            Some(StoppedBy::Exact)
        } else if (is_complete || is_judged(merged.passes)) && self.stop.accurate_enough(merged) {
            Some(if grid_without_light(merged).is_some() { StoppedBy::NoLight } else { StoppedBy::RelativeError })
        } else {
            is_complete.then_some(StoppedBy::MaxPasses)
        }
    }

    /// Returns the reason why a job that ran out of time before its first pass ended has no results; `None` for all other jobs, cancelled
    /// ones included.
    pub fn no_results(&self, stopped_by: StoppedBy, merged: &Estimate) -> Option<String> {
        (stopped_by == StoppedBy::MaxSeconds && merged.passes == 0).then(|| {
            format!(
                "/stop/max_seconds: no pass was finished within {} s; allow more seconds, or make passes smaller: \
                 fewer pixels, cells, samples or photons",
                self.stop.max_seconds
            )
        })
    }

    /// True if nothing is lit, so that every value is exactly zero.
    pub(crate) fn is_dark(&self) -> bool {
        Engine::is_dark(&self.traceable, &self.scene)
    }

    /// True if one computation gives all results, and no passes.
    fn has_solver(&self) -> bool {
        let grids = self.plan.methods.grids.as_ref();
        !self.is_dark() && grids.is_some_and(|choice| choice.method.described().passes() == Passes::None)
    }

    /// Returns the relative errors of `merged` at the confidence of the job's stop rule.
    pub fn accuracy(&self, merged: &Estimate) -> Accuracy {
        self.stop.accuracy(merged)
    }
}
