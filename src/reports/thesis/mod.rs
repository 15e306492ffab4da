//! "The thesis, reproduced": what A. Schou found in 2012 beside what this program finds, and what was left open there.
//!
//! Every number of ours comes from a live run; those that the thesis prints stand in `printed`. A report holds no times,
//! so that the same settings give the same bytes.

mod boundary;
mod cornell;
pub mod distance;
mod excess;
mod methods;
mod photons;
mod printed;
mod progress;
mod ring;
mod scenes;
pub mod update;
mod views;

use std::path::Path;
use std::sync::Mutex;
use std::sync::PoisonError;

use serde_json::Value;

use crate::job::prepare::Prepared;
use crate::reports::page::{Report, ReportError, Section};
use crate::reports::run::prepare;

/// Amount of computation of the report.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Passes of the longest series; all other numbers of passes are shares of it.
    pub passes: u64,
    pub photons_per_pass: u64,
    /// Side of the pictures.
    pub size_px: usize,
    /// Cells along each side of the floor's grid; an odd number, so that one is under the pipe.
    pub cells: usize,
    /// Hit points along each side of the floor for the printed update.
    pub points: usize,
    /// Discs of the simulated updates.
    pub discs: u64,
}

/// Passes for which the shares of [`Settings::share`] are given.
const FULL_PASSES: u64 = 1024;

/// Fewer tell no standard error.
const LEAST_PASSES: u64 = 8;

impl Settings {
    /// The settings of the report with `passes` in the longest series.
    pub fn new(passes: u64) -> Self {
        Self {
            passes,
            photons_per_pass: printed::PHOTONS_PER_PASS,
            size_px: 128,
            cells: 21,
            points: 256,
            discs: 65_536,
        }
    }

    /// Passes of a job that has `full` when the longest series has 1024.
    fn share(&self, full: u64) -> u64 {
        (full * self.passes).div_ceil(FULL_PASSES).max(LEAST_PASSES)
    }
}

/// Hears the name of each part before it runs.
type Progress<'a> = &'a (dyn Fn(&str) + Sync);

/// Computes the whole report.
pub fn run(settings: &Settings, progress: impl Fn(&str) + Sync) -> Result<Report, ReportError> {
    type Part = fn(&Settings, Progress) -> Result<Vec<Section>, ReportError>;
    let parts: [Part; 6] = [
        cornell::sections,
        methods::sections,
        progress::sections,
        excess::sections,
        ring::sections,
        boundary::sections,
    ];
    let mut sections = Vec::new();
    for part in parts {
        sections.extend(part(settings, &progress)?);
    }
    Ok(Report { name: "thesis", title: "The thesis, reproduced", introduction: introduction(settings), sections })
}

fn introduction(settings: &Settings) -> String {
    let Settings { passes, photons_per_pass, .. } = settings;
    let fewer = if *passes < FULL_PASSES {
        format!(" This is a short run: the report is meant for {FULL_PASSES} passes.")
    } else {
        String::new()
    };
    format!(
        "A. Schou, *Investigation of light pipe simulation algorithms* (B.Sc. thesis, DTU Informatics, IMM-B.Sc-2012-01),\n\
         followed light through a light pipe by progressive photon mapping (PPM) and stochastic progressive photon mapping\n\
         (SPPM), and compared with path tracing and with HOLIGILM. This page repeats its experiments with skyduct {}.\n\
         `skyduct thesis` runs everything anew and writes it: numbers of the thesis stand with their section or figure, all\n\
         others are computed. A second run gives the same bytes.\n\n\
         The longest series has {passes} passes of {photons_per_pass} photons.{fewer} \"The thesis' settings\" are {} photons\n\
         per pass, a first radius of 0.3 inch ({:.5} m), alpha = {} (its section 6.3), and radii that follow each point's own\n\
         photons, as there (Hachisuka, Ogaki and Jensen 2008), but by the right update; \"own settings\" are as many photons, a\n\
         first radius of a twentieth of the room's shortest edge, alpha = 2/3, and radii by the number of the pass (Knaus and\n\
         Zwicker 2011). Photon mapping here gathers only light that was reflected: light straight from a diffuser or a lamp\n\
         is connected, and kernels are clipped to their surface. PPM looks through {} fixed points of each pixel. Errors\n\
         are standard errors.",
        env!("CARGO_PKG_VERSION"),
        printed::PHOTONS_PER_PASS,
        printed::INITIAL_RADIUS_M,
        printed::ALPHA,
        scenes::POINTS_PER_PIXEL,
    )
}

/// A job of the report: what it is called, and its document.
struct Case {
    name: String,
    document: Value,
}

impl Case {
    fn new(name: &str, mut document: Value, method: Value) -> Self {
        document["method"] = method;
        Self { name: name.to_owned(), document }
    }

    /// Ready to render, or why this program does not compute it.
    fn prepare(&self) -> Result<Prepared, String> {
        prepare(&self.document, Path::new("")).map_err(|errors| errors.to_string().replace('\n', "; "))
    }
}

/// Results of some cases in their order, and a sentence for each case that this program refuses.
struct Tried<T> {
    results: Vec<T>,
    left_out: String,
}

/// Runs the cases that this program computes.
fn try_all<T: Send>(
    cases: Vec<Case>,
    work: impl Fn(Case, &Prepared) -> Result<T, ReportError> + Sync,
) -> Result<Tried<T>, ReportError> {
    let outcomes = side_by_side(cases, |case| match case.prepare() {
        Ok(prepared) => work(case, &prepared).map(Ok),
        Err(reason) => Ok(Err(format!(" {} is left out: {reason}.", case.name))),
    });
    let mut tried = Tried { results: Vec::new(), left_out: String::new() };
    for outcome in outcomes {
        match outcome? {
            Ok(result) => tried.results.push(result),
            Err(reason) => tried.left_out += &reason,
        }
    }
    if tried.results.is_empty() { Err(ReportError::Case(tried.left_out)) } else { Ok(tried) }
}

/// Runs `work` on all `items`, two at a time: half of a photon pass is on one thread.
fn side_by_side<T: Send, R: Send>(items: Vec<T>, work: impl Fn(T) -> R + Sync) -> Vec<R> {
    let count = items.len();
    let queue = Mutex::new(items.into_iter().enumerate());
    let done: Mutex<Vec<Option<R>>> = Mutex::new((0..count).map(|_| None).collect());
    std::thread::scope(|scope| {
        for _ in 0..2.min(count) {
            scope.spawn(|| {
                loop {
                    let next = queue.lock().unwrap_or_else(PoisonError::into_inner).next();
                    let Some((index, item)) = next else { return };
                    let result = work(item);
                    done.lock().unwrap_or_else(PoisonError::into_inner)[index] = Some(result);
                }
            });
        }
    });
    done.into_inner().unwrap_or_else(PoisonError::into_inner).into_iter().flatten().collect()
}
