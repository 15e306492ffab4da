//! From a document to results: prepare, render chunks of passes in order, stop, write the results.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::checkpoint;
use crate::analytic::Solver;
use crate::document::{self, DocumentErrors, FieldError, JobDocument, MeshSource, Provenance, ValidJob, Warning};
use crate::estimate::{Accuracy, Estimate, StopRule};
use crate::integrator::bidirectional::Bidirectional;
use crate::integrator::light_tracing::LightTracing;
use crate::integrator::path_tracing::PathTracing;
use crate::integrator::photon_mapping::PhotonMapping;
use crate::integrator::ppm::Ppm;
use crate::integrator::sppm::Sppm;
use crate::integrator::two_stage::TwoStage;
use crate::integrator::{Integrator, Method, deterministic};
use crate::plan::{self, Effects, Methods, Plan};
use crate::scene::{Channels, Grid, Scene, TubeShape, View};
use crate::statistics::interval::two_sided_normal_quantile;
use crate::traceable::TraceableScene;
use crate::traceable::luminaire::TraceableLuminaire;

/// A job ready to render: immutable, shared by threads.
pub struct Prepared {
    /// The document as understood, all defaults filled in.
    pub document: serde_json::Value,
    pub plan: Plan,
    pub warnings: Vec<Warning>,
    pub stop: StopRule,
    pub name: Option<String>,
    pub(super) scene: Scene,
    pub(super) provenance: Provenance,
    pub(super) kernel: Arc<TraceableScene>,
    engine: Engine,
    /// Largest number of passes that one chunk may have.
    chunk_passes: u64,
}

/// The integrators of a plan.
enum Engine {
    /// Nothing is lit: every value is exactly zero.
    Dark,
    /// One computation gives everything.
    Solver(Box<dyn Solver>),
    /// One method computes grids and views in the same passes.
    Shared(Box<dyn Integrator>),
    Separate {
        grids: Option<Box<dyn Integrator>>,
        views: Option<Box<dyn Integrator>>,
    },
}

/// Why a job ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StoppedBy {
    RelativeError,
    MaxPasses,
    MaxSeconds,
    Exact,
    Cancelled,
}

impl StoppedBy {
    pub fn name(self) -> &'static str {
        match self {
            Self::RelativeError => "relative_error",
            Self::MaxPasses => "max_passes",
            Self::MaxSeconds => "max_seconds",
            Self::Exact => "exact",
            Self::Cancelled => "cancelled",
        }
    }
}

/// One row of the convergence table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PassReport {
    /// Passes done so far, this one included.
    pub passes: u64,
    /// Render seconds of the job so far, earlier chunks included.
    pub seconds: f64,
    pub photons: u64,
    pub rays: u64,
    /// Relative error of the grids at the asked confidence, by which the job stops; null before the second pass.
    pub relative_error: Option<f64>,
    /// Relative error of the views at the asked confidence; null before the second pass.
    pub view_relative_error: Option<f64>,
    /// Mean illuminance of the first grid.
    pub mean_lux: Option<f64>,
}

/// Listener to a running chunk, which may also tell it to stop.
pub trait Observer: Sync {
    /// Looked at every few milliseconds; true ends the chunk within a pass, whose partial work is dropped, as does the end of
    /// the job's `max_seconds`.
    fn cancelled(&self) -> bool;
    /// After every pass; `merged` is everything so far, earlier chunks included.
    fn pass_done(&self, report: &PassReport, merged: &Estimate);
}

/// A rendered range of passes.
pub struct Chunk {
    /// Estimate of these passes alone (and what passes hand on): merge it onto the estimate of all earlier chunks.
    pub estimate: Estimate,
    pub seconds: f64,
    /// The chunk was cut short: cancelled, or out of seconds. The job ends with it.
    pub ended: Option<StoppedBy>,
}

/// A failure that is ours: a non-finite tally, with the pass and the sensor.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    #[error("pass {pass}: {place} is not finite")]
    NotFinite { pass: u64, place: String },
    #[error("{file}: {reason}")]
    Output { file: String, reason: String },
}

/// A file of the results, e.g. `grids/workplane.json`.
pub struct ResultFile {
    pub name: String,
    pub media_type: &'static str,
    pub bytes: Vec<u8>,
}

/// Passes of a first chunk; later ones double the job until they reach [`CHUNK_SECONDS`].
const FIRST_CHUNK: u64 = 8;

/// About how long one chunk takes on the machine that the plan's costs were measured on: what a crash can lose.
const CHUNK_SECONDS: f64 = 2.0;

/// Estimates of the memory that a prepared job holds, beside which are a tube's tables of the sky, a triangle in the scene
/// and in the trees of rays, and a sensor's place.
const BYTES: usize = 64 << 10;
const BYTES_PER_TUBE: usize = 1 << 19;
const BYTES_PER_TRIANGLE: usize = 512;
const BYTES_PER_SENSOR: usize = 64;

/// Interval between looks whether a running pass is cancelled, or has used up the job's seconds.
const STOP_POLL: Duration = Duration::from_millis(20);

/// Validates a document (JSON text), loads its meshes, builds the scene and the plan.
pub fn prepare(document: &[u8], meshes: &dyn MeshSource) -> Result<Prepared, DocumentErrors> {
    prepare_document(&JobDocument::parse(document)?, meshes)
}

/// Prepares a parsed document: builds and plans its scene, and refuses what the plan cannot do.
pub fn prepare_document(document: &ValidJob, meshes: &dyn MeshSource) -> Result<Prepared, DocumentErrors> {
    let refused = |pointer: &str, detail: String| DocumentErrors(vec![FieldError { pointer: pointer.into(), detail }]);
    let still_wanted = || match meshes.is_cancelled() {
        true => Err(refused("", "nobody waits for this document any more".into())),
        false => Ok(()),
    };
    let (scene, mut warnings, mut provenance) = document::to_scene(document, meshes)?;
    still_wanted()?;
    let effects = Effects::of(&scene, &document.effect_requests());
    let kernel = plan::compile(&scene, &effects)
        .map_err(|error| refused(&format!("/tubes/{}/parts", error.tube), error.error.to_string()))?;
    still_wanted()?;
    let request = document.method.request();
    let methods =
        Methods::choose(&scene, &kernel, &request).map_err(|refusal| refused("/method", refusal.to_string()))?;
    let plan = Plan { guides: plan::guides(&kernel), effects, methods };
    provenance.interreflection = kernel.interreflection;
    if let Some(sun) = &mut provenance.sun {
        sun.on = kernel.sun.is_some();
    }
    warnings.extend(
        plan.methods.grids.iter().filter_map(|choice| document::method_warning(&choice.method, &kernel, &scene.grids)),
    );
    let stop = document.stop_rule();
    let kernel = Arc::new(kernel);
    let engine = Engine::new(kernel.clone(), &scene, &plan.methods, &stop, document.seed);
    let per_chunk = CHUNK_SECONDS / plan::cost::seconds_per_pass(&scene, &plan).max(1e-9);
    Ok(Prepared {
        document: serde_json::to_value(document).unwrap_or_default(),
        warnings,
        stop,
        name: document.name.clone(),
        chunk_passes: (per_chunk as u64).clamp(1, 4096),
        plan,
        scene,
        provenance,
        kernel,
        engine,
    })
}

impl Engine {
    fn new(kernel: Arc<TraceableScene>, scene: &Scene, methods: &Methods, stop: &StopRule, seed: u64) -> Self {
        let electric = kernel.luminaires.iter().any(TraceableLuminaire::emits);
        if kernel.sky.is_none() && kernel.sun.is_none() && !electric {
            return Self::Dark;
        }
        let target = stop.relative_error / two_sided_normal_quantile(stop.confidence);
        if let Some(choice) = &methods.grids
            && let Some(solver) = deterministic::solver(&choice.method, &kernel, scene, target, seed)
        {
            return Self::Solver(solver);
        }
        let build = |method: &Method, grids: &[Grid], views: &[View]| -> Option<Box<dyn Integrator>> {
            match scene.channels {
                Channels::Photopic => integrator::<1>(method, kernel.clone(), grids, views, seed),
                Channels::Rgb => integrator::<3>(method, kernel.clone(), grids, views, seed),
            }
        };
        let shared = methods.grids.as_ref().filter(|_| methods.share_passes());
        if let Some(integrator) = shared.and_then(|choice| build(&choice.method, &scene.grids, &scene.views)) {
            return Self::Shared(integrator);
        }
        let Methods { grids, views } = methods;
        Self::Separate {
            grids: grids.as_ref().and_then(|choice| build(&choice.method, &scene.grids, &[])),
            views: views.as_ref().and_then(|choice| build(&choice.method, &[], &scene.views)),
        }
    }

    /// Prepares an estimate of no passes.
    fn begin(&self, estimate: &mut Estimate) {
        match self {
            Self::Dark | Self::Solver(_) => {}
            Self::Shared(integrator) => {
                let start = integrator.start();
                estimate.begin(Some(&start), Some(&start));
            }
            Self::Separate { grids, views } => {
                let [grids, views] = [grids, views].map(|method| method.as_ref().map(|method| method.start()));
                estimate.begin(grids.as_ref(), views.as_ref());
            }
        }
    }

    /// Adds pass `number` to an estimate of those before it; false when cancelled.
    fn add_pass(&self, number: u64, estimate: &mut Estimate, cancel: &AtomicBool) -> bool {
        let run =
            |integrator: &dyn Integrator, estimate: &Estimate| integrator.pass_after(number, &estimate.carried, cancel);
        match self {
            Self::Dark => {
                let dark = estimate.dark_pass();
                estimate.push(Some(&dark), Some(&dark));
            }
            Self::Solver(solver) => {
                let Some(solution) = solver.solve(cancel) else { return false };
                estimate.push_solution(&solution);
            }
            Self::Shared(integrator) => {
                let Some(pass) = run(integrator.as_ref(), estimate) else { return false };
                estimate.push(Some(&pass), Some(&pass));
            }
            Self::Separate { grids, views } => {
                let grid_pass = grids.as_ref().map(|integrator| run(integrator.as_ref(), estimate));
                let view_pass = views.as_ref().map(|integrator| run(integrator.as_ref(), estimate));
                if matches!(grid_pass, Some(None)) || matches!(view_pass, Some(None)) {
                    return false;
                }
                estimate.push(grid_pass.flatten().as_ref(), view_pass.flatten().as_ref());
            }
        }
        true
    }
}

/// The integrator of a method that computes passes.
fn integrator<const C: usize>(
    method: &Method,
    kernel: Arc<TraceableScene>,
    grids: &[Grid],
    views: &[View],
    seed: u64,
) -> Option<Box<dyn Integrator>> {
    match method {
        Method::LightTracing(settings) => Some(Box::new(LightTracing::<C>::new(kernel, grids, settings, seed))),
        Method::Ppm(settings) => Some(Box::new(Ppm::<C>::new(kernel, grids, views, settings, seed))),
        Method::Sppm(settings) => Some(Box::new(Sppm::<C>::new(kernel, grids, views, settings, seed))),
        Method::PathTracing(settings) => Some(Box::new(PathTracing::<C>::new(kernel, grids, views, settings, seed))),
        Method::Bidirectional(settings) => {
            Some(Box::new(Bidirectional::<C>::new(kernel, grids, views, settings, seed)))
        }
        Method::PhotonMapping(settings) => {
            Some(Box::new(PhotonMapping::<C>::new(kernel, grids, views, settings, seed)))
        }
        Method::TwoStage(settings) => Some(Box::new(TwoStage::<C>::new(kernel, grids, views, settings, seed))),
        Method::Holigilm | Method::Jenkins(_) => None,
    }
}

impl Prepared {
    /// The passes of chunk `index`, fixed by the job alone; `None` past the last.
    pub fn chunk(&self, index: u64) -> Option<Range<u64>> {
        if matches!(self.engine, Engine::Solver(_)) {
            return (index == 0).then_some(0..1);
        }
        chunk_range(index, self.chunk_passes, self.stop.max_passes)
    }

    /// Renders chunk `index` on the current rayon pool; `before` is the merged estimate of all earlier chunks and
    /// `seconds_before` their render time.
    pub fn render_chunk(
        &self,
        index: u64,
        before: &Estimate,
        seconds_before: f64,
        observer: &dyn Observer,
    ) -> Result<Chunk, RenderError> {
        let passes = self.chunk(index).unwrap_or(0..0);
        let clock = Clock { start: Instant::now(), before: seconds_before };
        let stop = PassStop::default();
        let done = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let watcher = scope.spawn(|| {
                while !done.load(Ordering::Acquire) {
                    if let Some(reason) = self.must_stop(&clock, observer) {
                        stop.set(reason);
                        return;
                    }
                    std::thread::park_timeout(STOP_POLL);
                }
            });
            // also when a pass panics: the scope waits for the watcher before the panic goes on
            let _ends_watcher = EndsWatcher { done: &done, watcher: watcher.thread() };
            self.render_passes(passes, before, &clock, &stop, observer)
        })
    }

    /// Reason why the running pass must end at once, if there is one.
    fn must_stop(&self, clock: &Clock, observer: &dyn Observer) -> Option<StoppedBy> {
        if observer.cancelled() {
            return Some(StoppedBy::Cancelled);
        }
        (clock.seconds() >= self.stop.max_seconds).then_some(StoppedBy::MaxSeconds)
    }

    fn render_passes(
        &self,
        passes: Range<u64>,
        before: &Estimate,
        clock: &Clock,
        stop: &PassStop,
        observer: &dyn Observer,
    ) -> Result<Chunk, RenderError> {
        let mut estimate = self.empty_estimate();
        estimate.carried.clone_from(&before.carried);
        let mut ended = None;
        for pass in passes {
            if !self.engine.add_pass(pass, &mut estimate, &stop.now) {
                ended = Some(stop.reason());
                break;
            }
            if let Some(place) = estimate.first_not_finite() {
                return Err(RenderError::NotFinite { pass, place });
            }
            let seconds = clock.seconds();
            let mut merged = before.clone();
            merge(&mut merged, &estimate);
            observer.pass_done(&self.report(&merged, seconds), &merged);
            let complete = merged.passes >= self.stop.max_passes || matches!(self.engine, Engine::Solver(_));
            if seconds >= self.stop.max_seconds && !complete {
                ended = Some(StoppedBy::MaxSeconds);
                break;
            }
        }
        Ok(Chunk { estimate, seconds: clock.start.elapsed().as_secs_f64(), ended })
    }

    /// The row of the convergence table after the last pass of `merged`.
    pub(super) fn report(&self, merged: &Estimate, seconds: f64) -> PassReport {
        let accuracy = self.accuracy(merged);
        PassReport {
            passes: merged.passes,
            seconds,
            photons: merged.photons,
            rays: merged.rays,
            relative_error: accuracy.grids.filter(|error| error.is_finite()),
            view_relative_error: accuracy.views.filter(|error| error.is_finite()),
            mean_lux: merged.grids.first().map(|grid| grid.mean.mean),
        }
    }

    /// The methods of the plan: that of the grids, and that of the views where it is another one.
    pub fn method_names(&self) -> String {
        let Methods { grids, views } = &self.plan.methods;
        let mut names: Vec<_> = grids.iter().chain(views).map(|choice| choice.method.name()).collect();
        names.dedup();
        names.join(", ")
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

    pub fn grids(&self) -> &[Grid] {
        &self.scene.grids
    }

    /// An estimate of no passes.
    pub fn empty_estimate(&self) -> Estimate {
        let mut estimate = Estimate::empty(&self.scene);
        self.engine.begin(&mut estimate);
        estimate
    }

    /// Reason why the job is done after chunk `index` with everything merged into `merged`; `None` when it is not.
    pub fn stop_after(&self, index: u64, merged: &Estimate) -> Option<StoppedBy> {
        if matches!(self.engine, Engine::Dark | Engine::Solver(_)) {
            Some(StoppedBy::Exact)
        } else if self.stop.accurate_enough(merged) {
            Some(StoppedBy::RelativeError)
        } else if self.chunk(index + 1).is_none() {
            Some(StoppedBy::MaxPasses)
        } else {
            None
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

    pub fn accuracy(&self, merged: &Estimate) -> Accuracy {
        self.stop.accuracy(merged)
    }
}

/// Clock of the job's render time.
struct Clock {
    start: Instant,
    /// Render seconds of earlier chunks.
    before: f64,
}

impl Clock {
    fn seconds(&self) -> f64 {
        self.before + self.start.elapsed().as_secs_f64()
    }
}

/// Tells a running pass to end; its partial work is dropped.
#[derive(Default)]
struct PassStop {
    now: AtomicBool,
    /// True once the time is used up; written before `now`.
    out_of_time: AtomicBool,
}

impl PassStop {
    fn set(&self, reason: StoppedBy) {
        self.out_of_time.store(reason == StoppedBy::MaxSeconds, Ordering::Relaxed);
        self.now.store(true, Ordering::Release);
    }

    fn reason(&self) -> StoppedBy {
        match self.out_of_time.load(Ordering::Relaxed) {
            true => StoppedBy::MaxSeconds,
            false => StoppedBy::Cancelled,
        }
    }
}

/// Tells the thread that watches for a cancel that the chunk is over.
struct EndsWatcher<'a> {
    done: &'a AtomicBool,
    watcher: &'a std::thread::Thread,
}

impl Drop for EndsWatcher<'_> {
    fn drop(&mut self) {
        self.done.store(true, Ordering::Release);
        self.watcher.unpark();
    }
}

/// Chunks of passes 0..`most`: the first of 8, then each as long as all before it, never longer than `longest`.
fn chunk_range(index: u64, longest: u64, most: u64) -> Option<Range<u64>> {
    let mut range = 0..FIRST_CHUNK.min(longest).min(most);
    for _ in 0..index {
        let length = range.end.min(longest);
        range = range.end..(range.end + length).min(most);
        if range.is_empty() {
            return None;
        }
    }
    (!range.is_empty()).then_some(range)
}

/// Adds a chunk to everything before it; the order of merges fixes the bits.
pub fn merge(before: &mut Estimate, chunk: &Estimate) {
    before.merge(chunk);
}

/// An estimate as bytes, bit-exact: little-endian words with a length and a hash.
pub fn encode(estimate: &Estimate) -> Vec<u8> {
    checkpoint::encode(estimate)
}

/// The estimate of `bytes` for this job; an error names what is wrong with them.
pub fn decode(prepared: &Prepared, bytes: &[u8]) -> Result<Estimate, String> {
    checkpoint::decode(prepared.empty_estimate(), bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_cover_all_passes_once() {
        for (longest, most) in [(1, 5), (8, 8), (64, 1000), (4096, 4096), (3, 1), (7, 20)] {
            let mut next = 0;
            for index in 0.. {
                let Some(range) = chunk_range(index, longest, most) else { break };
                assert_eq!(range.start, next);
                assert!(range.end - range.start <= longest);
                next = range.end;
            }
            assert_eq!(next, most);
        }
    }
}
