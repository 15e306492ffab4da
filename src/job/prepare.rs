//! From a document to a job that is ready to render.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use super::engine::Engine;
use super::forecast::Forecaster;
use super::predictions::Predictions;
use super::progress::{PassReport, StoppedBy};
use super::spent::Spent;
use super::subject::Subject;
use super::tube_performance::TubePerformance;
use crate::document::errors::WarningCode;
use crate::document::{self, DocumentErrors, FieldError, JobDocument, MeshSource, Provenance, ValidJob, Warning};
use crate::estimate::film::block_count;
use crate::estimate::stopping::{WaitingFor, grid_without_light, is_judged, least_passes};
use crate::estimate::{Accuracy, Estimate, StopRule};
use crate::integrator::Method;
use crate::integrator::components::Component;
use crate::integrator::method::Task;
use crate::plan::{self, EffectKind, Effects, Methods, Plan};
use crate::scene::{Grid, Scene, TubeShape};
use crate::traceable::TraceableScene;

/// A job ready to render: immutable, shared by threads.
pub struct Prepared {
    /// The document as understood, all defaults filled in.
    pub document: serde_json::Value,
    /// What is simulated and by which methods, with reasons.
    pub plan: Plan,
    /// Notes on the document and on its methods.
    pub warnings: Vec<Warning>,
    /// Rule that ends the job.
    pub stop: StopRule,
    /// Free text that the document has as its name.
    pub name: Option<String>,
    pub(super) scene: Scene,
    pub(super) provenance: Provenance,
    pub(super) traceable: Arc<TraceableScene>,
    pub(super) engine: Engine,
    /// Parts of the light that estimates have beside their grids; none where they have none.
    pub(super) components: Vec<Component>,
    /// Selects the random numbers.
    pub(super) seed: u64,
    /// What each method would take, where a pilot was asked.
    pub(super) predictions: Option<Predictions>,
    /// What figures say of the job, once somebody has asked for it.
    pub(super) subject: OnceLock<Subject>,
    /// What reports on each tube say beside the passes, once somebody has asked for it.
    pub(super) performances: Vec<OnceLock<Arc<TubePerformance>>>,
    /// Every method that documents may name, with the settings of this one.
    pub(super) offered: Vec<Method>,
}

/// Estimates of the memory that a prepared job holds, beside which are a tube's tables of the sky, a triangle in the scene
/// and in the trees of rays, and a sensor's place.
const BYTES: usize = 64 << 10;
const BYTES_PER_TUBE: usize = 1 << 19;
const BYTES_PER_TRIANGLE: usize = 512;
const BYTES_PER_SENSOR: usize = 64;

impl Prepared {
    /// Keeps what a pilot foretold of the job, for its results and for the figure of its convergence.
    pub fn foretell(&mut self, predictions: Predictions) {
        self.subject = OnceLock::new();
        self.predictions = Some(predictions);
    }
}

/// Validates a document (JSON text), loads its meshes, builds the scene and the plan.
pub fn prepare(document: &[u8], meshes: &dyn MeshSource) -> Result<Prepared, DocumentErrors> {
    prepare_document(&JobDocument::parse(document)?, meshes)
}

/// Prepares a parsed document: builds and plans its scene, and refuses what the plan cannot do.
pub fn prepare_document(document: &ValidJob, meshes: &dyn MeshSource) -> Result<Prepared, DocumentErrors> {
    let still_wanted = || match meshes.is_cancelled() {
        true => Err(DocumentErrors::from(FieldError::new("", "nobody waits for this document any more"))),
        false => Ok(()),
    };
    let (mut scene, mut warnings, mut provenance) = document::to_scene(document, meshes)?;
    still_wanted()?;
    let mut effects = Effects::of(&scene, &document.effect_requests());
    let traceable = plan::compile(&scene, &effects)
        .map_err(|error| FieldError::new(format!("/tubes/{}/parts", error.tube), error.error.to_string()))?;
    let traceable = Arc::new(traceable);
    still_wanted()?;
    if effects.is_followed(EffectKind::Objects) {
        warnings.extend(document::leave_out_solids(document, &mut scene)?);
        still_wanted()?;
    }
    let stop = document.stop_rule();
    let missing = effects.weigh(&scene, &traceable).into_iter();
    let missing = missing.filter(|(_, left_out)| left_out.largest() > stop.relative_error);
    warnings.extend(missing.map(|(kind, left_out)| {
        let detail = format!("{} is switched off, but the scene calls for it: {}", kind.name(), left_out.words(kind));
        Warning { code: WarningCode::EffectLeftOut, detail }
    }));
    let request = document.method.request();
    let methods =
        Methods::choose(&scene, &traceable, &request).map_err(|refusal| FieldError::refused("/method", refusal))?;
    let task = Task::whole(&scene, &traceable);
    let methods = match scene.grids.iter().position(|grid| grid.components) {
        Some(grid) => {
            let pointer = format!("/grids/{grid}/components");
            methods.in_parts(&task).map_err(|refusal| FieldError::refused(pointer, refusal))?
        }
        None => methods,
    };
    let methods = match scene.grids.iter().position(|grid| grid.responses) {
        Some(grid) => {
            let pointer = format!("/grids/{grid}/responses");
            methods.with_responses(&task, &request).map_err(|refusal| FieldError::refused(pointer, refusal))?
        }
        None => methods,
    };
    let methods = match document.cross_check {
        true => methods.checked(&task).map_err(|refusal| FieldError::refused("/cross_check", refusal))?,
        false => methods,
    };
    let plan = Plan { guides: plan::guides::guides(&scene, &traceable), effects, methods };
    provenance.interreflection = traceable.interreflection;
    if let Some(sun) = &mut provenance.sun {
        sun.on = traceable.sun.is_some();
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
    let engine = Engine::new(&traceable, &scene, &plan.methods, &stop, document.seed);
    let components = plan.methods.parts.map_or_else(Vec::new, |_| Component::of_scene(&traceable));
    let performances = scene.tubes.iter().map(|_| OnceLock::new()).collect();
    Ok(Prepared {
        document: serde_json::to_value(document).unwrap_or_default(),
        warnings,
        stop,
        name: document.name.clone(),
        seed: document.seed,
        offered: document.method.offered(),
        predictions: None,
        subject: OnceLock::new(),
        performances,
        plan,
        scene,
        provenance,
        traceable,
        engine,
        components,
    })
}

impl Prepared {
    /// The passes that a job may still have after so many.
    pub fn passes_after(&self, passes: u64) -> Range<u64> {
        passes..if matches!(self.engine, Engine::Solver(_)) { 1 } else { self.stop.max_passes }
    }

    /// The row of the convergence table after the last pass of `merged`.
    pub(super) fn report(&self, merged: &Estimate, spent: Spent) -> PassReport {
        self.report_of(merged, self.accuracy(merged), spent)
    }

    /// As [`Self::report`], of an estimate of this accuracy.
    pub(super) fn report_of(&self, merged: &Estimate, accuracy: Accuracy, spent: Spent) -> PassReport {
        PassReport {
            passes: merged.passes,
            seconds: spent.seconds,
            photons: merged.photons,
            rays: merged.rays,
            relative_error: accuracy.grids.filter(|error| error.is_finite()),
            view_relative_error: accuracy.views.filter(|error| error.is_finite()),
            mean_lux: merged.grids.first().map(|grid| grid.mean.mean),
            cpu_seconds: spent.cpu_seconds,
        }
    }

    /// What the job goes on for after the passes of `merged`, which have this accuracy; `None` after its last pass.
    pub(super) fn waiting_for(&self, merged: &Estimate, accuracy: Accuracy) -> Option<WaitingFor> {
        self.stop.waiting_for(merged, accuracy).filter(|_| !self.is_complete(merged.passes))
    }

    /// What is to foretell the job's end, before its first pass.
    pub fn forecaster(&self) -> Forecaster {
        Forecaster::new(self.stop, self.least_passes_of_grids(), self.least_passes_of_views())
    }

    /// Passes below which the error of the grids is not trusted; `None` without any.
    pub(super) fn least_passes_of_grids(&self) -> Option<u64> {
        self.scene.grids.iter().map(|grid| least_passes(grid.valued())).max()
    }

    /// Passes below which the error of the views is not trusted; `None` without any.
    pub(super) fn least_passes_of_views(&self) -> Option<u64> {
        self.scene.views.iter().map(|view| least_passes(block_count(view.size_px))).max()
    }

    /// The methods of the plan: that of the grids, and that of the views where it is another one.
    pub fn method_names(&self) -> String {
        self.plan.methods.names().join(", ")
    }

    /// About how many bytes of memory it holds, rather too many than too few.
    pub fn bytes(&self) -> usize {
        let Scene { room, tubes, grids, .. } = &self.scene;
        let triangles: usize = room.meshes.iter().map(|object| object.mesh.triangles.len()).sum();
        let of_tubes: usize = tubes
            .iter()
            .map(|tube| match &tube.shape {
                TubeShape::Cylinders(_) => 0,
                TubeShape::Mesh(mesh) => mesh.mesh.triangles.len(),
            })
            .sum();
        let sensors: usize = grids.iter().map(Grid::len).sum();
        BYTES + tubes.len() * BYTES_PER_TUBE + (triangles + of_tubes) * BYTES_PER_TRIANGLE + sensors * BYTES_PER_SENSOR
    }

    /// True if the job has images to render.
    pub fn has_views(&self) -> bool {
        !self.scene.views.is_empty()
    }

    /// Illuminance grids, in the document's order.
    pub fn grids(&self) -> &[Grid] {
        &self.scene.grids
    }

    /// An estimate of no passes.
    pub fn empty_estimate(&self) -> Estimate {
        let mut estimate = Estimate::empty(&self.scene);
        self.engine.begin(&mut estimate);
        estimate
    }

    /// True after the last pass that a job can have.
    pub(super) fn is_complete(&self, passes: u64) -> bool {
        passes >= self.stop.max_passes || matches!(self.engine, Engine::Solver(_))
    }

    /// Reason why the job is done after the passes of `merged`; `None` when it is not.
    pub fn stop_after(&self, merged: &Estimate) -> Option<StoppedBy> {
        let is_complete = self.is_complete(merged.passes);
        if matches!(self.engine, Engine::Solver(_)) {
            // of a formula no error is known
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

    /// Reason why a job has no results that ended before its first pass did; `None` for a cancelled one.
    pub fn no_results(&self, stopped_by: StoppedBy, merged: &Estimate) -> Option<String> {
        (stopped_by == StoppedBy::MaxSeconds && merged.passes == 0).then(|| {
            format!(
                "/stop/max_seconds: not one pass ended within {} s; allow more seconds, or ask for smaller passes: fewer pixels, \
                 cells, samples or photons",
                self.stop.max_seconds
            )
        })
    }

    /// True if every value is exactly zero.
    pub(super) fn is_dark(&self) -> bool {
        matches!(self.engine, Engine::Dark)
    }

    /// Relative errors of `merged` at the confidence of the job's rule.
    pub fn accuracy(&self, merged: &Estimate) -> Accuracy {
        self.stop.accuracy(merged)
    }
}
