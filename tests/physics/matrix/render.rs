//! A method on a row: all its values with errors, or its refusal.

use std::sync::atomic::AtomicBool;

use skyduct::document::stop::StopDocument;
use skyduct::estimate::grid::error_with_bias;
use skyduct::estimate::{Estimate, FilmEstimate};
use skyduct::integrator::Method;
use skyduct::integrator::method::{CaveatCode, Computation, RefusalCode, Task};
use skyduct::plan::{MethodRequest, Methods};
use skyduct::scene::{EstimateKind, Scene};
use skyduct::statistics::Moments;

use super::columns::{Column, Work};
use super::row::{Mirrors, Row, Values};
use crate::judge::{Measured, Whole};
use crate::measured_values::{degrees, grid, mean_bias};

/// Relative error that passes are sized for where a column names no sizes, and that a solver is asked for: that of documents
/// which name none. What a solver is judged by are its own errors.
const USUAL_TARGET: f64 = 0.02;

/// Relative error that a solver is asked for in the long trial.
const FINE_SOLVER_TARGET: f64 = 5e-3;

/// Passes that a job by default may take to its accuracy, in those of the others.
const MOST: u64 = 4;

/// Passes from which on it may end: its standard error's own error is 18 %.
const LEAST: u64 = 16;

/// Least number of passes of methods whose kernels shrink from pass to pass: with 16 an error in common of 1.1 % in all that `sppm` does
/// would stay unseen.
const SHRINKING: u64 = 24;

/// True if a job that names no accuracy would end.
fn accurate_enough(estimate: &Estimate) -> bool {
    StopDocument::default().rule().accurate_enough(estimate)
}

/// Passes, and size of each.
#[derive(Clone, Copy)]
pub struct Effort {
    pub passes: u64,
    pub factor: f64,
    /// The passes are so many that light which is found by chance is found often.
    pub long: bool,
}

/// Random numbers of their own for every place in the matrix: comparisons are independent.
pub fn seed(place: &[&str]) -> u64 {
    let hash = blake3::hash(place.join(" ").as_bytes());
    u64::from_le_bytes(*hash.as_bytes().first_chunk().unwrap()) >> 11
}

/// Why a cell has no values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Left {
    /// The method refuses.
    Refused(RefusalCode),
    /// The row leaves it out, by name or because it warns ([`Mirrors::LeftOut`]).
    ByChance,
    /// What is chosen by default is in another column, or is more than one method; at points `ppm` is `sppm`; other rows have this
    /// law of radii.
    Elsewhere,
}

fn has_cells(scene: &Scene) -> bool {
    scene.grids.iter().any(|grid| grid.estimate == EstimateKind::CellAverage)
}

/// Everything that a method finds in a scene, under the effects of a row.
pub fn render(row: &Row, scene: &Scene, column: &Column, effort: Effort, seed: u64) -> Result<(Method, Values), Left> {
    let traceable = row.traceable(scene);
    let paths = match row.mirrors {
        Mirrors::Paths(paths) if !effort.long => paths,
        _ => 1.0,
    };
    let request = column.request(&Work::of(scene, effort.factor * row.work, paths));
    let methods = Methods::choose(scene, &traceable, &request).map_err(|refusal| Left::Refused(refusal.code))?;
    let by_default = request == MethodRequest::Auto;
    let only = !(methods.grids.is_some() && methods.views.is_some());
    let method = match (request, methods.grids.or(methods.views)) {
        (MethodRequest::Method(method) | MethodRequest::InPlaceOf(_, method), _) => method,
        (MethodRequest::Auto, Some(choice)) if only && !matches!(choice.method, Method::TwoStage(_)) => choice.method,
        (MethodRequest::Auto, _) => return Err(Left::Elsewhere),
    };
    if row.left_out.contains(&column.name) {
        return Err(Left::ByChance);
    }
    if matches!(method, Method::Ppm(_)) && scene.views.is_empty() && !has_cells(scene) {
        return Err(Left::Elsewhere);
    }
    let task = Task::whole(scene, &traceable);
    if method.described().warns(&task).is_some_and(|caveat| caveat.code == CaveatCode::MirrorsByChance) {
        assert!(row.mirrors != Mirrors::None, "{} finds by chance what a mirror shows", column.name);
        if row.mirrors == Mirrors::LeftOut && !effort.long {
            return Err(Left::ByChance);
        }
    }
    if by_default {
        println!("auto is {}", method.name());
    }
    let mut estimate = Estimate::empty(scene);
    let mut images = vec![Moments::default(); scene.views.len()];
    let target = match (&method, effort.long) {
        (Method::Holigilm(_), true) => FINE_SOLVER_TARGET,
        _ => USUAL_TARGET,
    };
    match method.described().build(&task, seed, target) {
        Computation::Passes(integrator) => {
            let start = integrator.start();
            estimate.begin(Some(&start), Some(&start));
            let least = if matches!(method, Method::Ppm(_) | Method::Sppm(_)) { SHRINKING } else { row.passes };
            let passes = effort.passes.max(least);
            let most = if by_default { MOST * passes } else { passes };
            for number in 0..most {
                let pass = integrator.pass_after(number, &estimate.carried, &AtomicBool::new(false)).unwrap();
                estimate.push(Some(&pass), Some(&pass));
                for (mean, film) in images.iter_mut().zip(&estimate.views) {
                    let blocks = film.blocks.iter().map(|block| block.mean).sum::<f64>() / film.blocks.len() as f64;
                    // the mean so far of so many passes: the pass' own part of it
                    mean.push(blocks * film.passes - mean.mean * mean.count);
                }
                if number + 1 >= LEAST && by_default && accurate_enough(&estimate) {
                    break;
                }
            }
        }
        Computation::Solution(solver) => estimate.push_solution(&solver.solve(&AtomicBool::new(false)).unwrap()),
    }
    assert_eq!(estimate.first_not_finite(), None);
    let supported = method.described().outputs();
    if supported.energy {
        // a solver's balance is numerical
        let most = if matches!(method, Method::Holigilm(_)) { 2e-3 } else { 1e-9 };
        assert!(estimate.energy.relative_closure_error().abs() < most, "{}: {:?}", column.name, estimate.energy);
    }
    let grids = estimate.grids.iter().map(grid);
    let views = estimate.views.iter().zip(&images).map(|(film, image)| view(film, image));
    let outputs = grids.chain(views).collect();
    let flux = |moments: &Moments| Measured {
        value: moments.mean,
        error: moments.standard_error(),
        degrees: degrees(moments, estimate.grids.iter().any(|grid| grid.numerical)),
    };
    let tubes = if supported.tube_fluxes { &estimate.tubes[..] } else { &[] };
    Ok((method, Values { outputs, tubes: tubes.iter().map(|tube| flux(&tube.into_room)).collect() }))
}

fn view(film: &FilmEstimate, image: &Moments) -> (Vec<Measured>, Whole) {
    let blocks = film.blocks.iter().enumerate().map(|(block, moments)| Measured {
        value: moments.mean,
        error: film.block_standard_error_cd_m2(block),
        degrees: moments.count - 1.0,
    });
    let blocks: Vec<_> = blocks.collect();
    let n = blocks.len() as f64;
    // what the choice of fixed rays adds to a block's error
    let without = |block: usize| error_with_bias(&film.blocks[block], film.block_bias.get(block));
    let fixed: f64 = blocks.iter().enumerate().map(|(k, block)| block.error.powi(2) - without(k).powi(2)).sum();
    let whole = Whole {
        value: image.mean,
        noise: (image.variance_of_mean() + fixed.max(0.0) / (n * n)).sqrt(),
        bias: mean_bias(&film.block_bias),
        degrees: image.count - 1.0,
    };
    (blocks, whole)
}
