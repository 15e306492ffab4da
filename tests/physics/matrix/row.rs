//! A row of the matrix: a scene, and what its values are.

use std::sync::Arc;

use skyduct::optics::spectrum::REC709_LUMINANCE;
use skyduct::plan::{self, EffectKind, EffectRequest, EffectRequests, Effects};
use skyduct::scene::Scene;
use skyduct::traceable::TraceableScene;

use crate::judge::{KNOWN, Measured, Verdict, Whole, compare};
use crate::reference;

/// A scene, all of whose outputs are compared.
pub struct Row {
    pub scene: Scene,
    pub effects: EffectRequests,
    pub oracle: Oracle,
    pub mirrors: Mirrors,
    /// Columns whose error is known not to know of light that their few samples miss here.
    pub left_out: &'static [&'static str],
    /// Times as many paths and photons as other rows have: what is found rarely has no normal error before it is found often, and what
    /// takes long is found precisely enough by fewer.
    pub work: f64,
    /// Least number of passes, where a method's estimate of its bias is noisy.
    pub passes: u64,
}

/// What is done with methods that warn that they find by chance what a mirror shows: while it has been found a few times
/// only, their error does not know of it.
#[derive(Clone, Copy, PartialEq)]
pub enum Mirrors {
    /// No method warns.
    None,
    /// They are left out.
    LeftOut,
    /// They follow so many times more paths.
    Paths(f64),
}

/// Where the expected values of a row come from.
pub enum Oracle {
    /// Values that are independent of this program.
    Given { values: Values, bound: f64 },
    /// Long renders by methods of this program, stored: each method is judged by the first one of another family.
    Stored(&'static [&'static str]),
    /// The first of the stored renders of another scene, which must look the same.
    Same(Box<Scene>, &'static [&'static str]),
}

/// Values of all outputs of a scene.
pub struct Values {
    /// Sensors of a grid or blocks of a view, and their mean.
    pub outputs: Vec<(Vec<Measured>, Whole)>,
    /// Flux into the room through every tube; empty where it is not known.
    pub tubes: Vec<Measured>,
}

impl Row {
    /// A row that is judged by long renders by light tracing, and light tracing by path tracing.
    pub fn new(scene: Scene) -> Self {
        let oracle = Oracle::Stored(&["light_tracing", "path_tracing"]);
        Self {
            scene,
            effects: EffectRequests::new(),
            oracle,
            mirrors: Mirrors::None,
            left_out: &[],
            work: 1.0,
            passes: 0,
        }
    }

    pub fn left_out(self, left_out: &'static [&'static str]) -> Self {
        Self { left_out, ..self }
    }

    pub fn work(self, work: f64) -> Self {
        Self { work, ..self }
    }

    pub fn passes(self, passes: u64) -> Self {
        Self { passes, ..self }
    }

    pub fn mirrors(self, mirrors: Mirrors) -> Self {
        Self { mirrors, ..self }
    }

    pub fn stored(self, methods: &'static [&'static str]) -> Self {
        Self { oracle: Oracle::Stored(methods), ..self }
    }

    /// Judged by what `methods` find in a scene that must look the same.
    pub fn same(self, scene: Scene, methods: &'static [&'static str]) -> Self {
        Self { oracle: Oracle::Same(Box::new(scene), methods), ..self }
    }

    pub fn given(self, values: Values, bound: f64) -> Self {
        Self { oracle: Oracle::Given { values, bound }, ..self }
    }

    pub fn without(mut self, effect: EffectKind) -> Self {
        self.effects.insert(effect, EffectRequest::Off);
        self
    }

    /// The scene as rays need it.
    pub fn traceable(&self, scene: &Scene) -> Arc<TraceableScene> {
        Arc::new(plan::compile(scene, &Effects::of(scene, &self.effects)).unwrap())
    }

    /// Number of comparisons of one method, from above: not every one knows the fluxes of tubes.
    pub fn comparisons(&self) -> usize {
        let grids = self.scene.grids.iter().map(|grid| grid.len() + 1);
        let blocks = |pixels: usize| pixels.div_ceil(skyduct::estimate::film::BLOCK_PX);
        let views = self.scene.views.iter().map(|view| blocks(view.size_px[0]) * blocks(view.size_px[1]) + 1);
        grids.chain(views).sum::<usize>() + self.scene.tubes.len()
    }
}

/// One grid in closed form, its errors a share of each value.
pub fn exact(values: &[f64], relative_error: f64) -> Values {
    let measured = |value: f64| Measured { value, error: relative_error * value, degrees: KNOWN };
    let mean = measured(values.iter().sum::<f64>() / values.len() as f64);
    let whole = Whole { value: mean.value, noise: mean.error, bias: 0.0, degrees: KNOWN };
    Values { outputs: vec![(values.iter().map(|value| measured(*value)).collect(), whole)], tubes: Vec::new() }
}

/// A grid of 9 x 9 sensors by an independent light tracer (`reference/scenes`).
pub fn traced(name: &str) -> Values {
    let truth = reference::json(&format!("scenes/{name}.reference.json"));
    let grid = |key: &str| {
        let rows = truth[key].as_array().unwrap().iter().flat_map(|row| row.as_array().unwrap());
        rows.map(|value| value.as_f64().unwrap()).collect::<Vec<_>>()
    };
    let errors = grid("standard_error_lux");
    let sensors = grid("illuminance_lux").into_iter().zip(errors);
    // millions of paths each
    let sensors = sensors.map(|(value, error)| Measured { value, error, degrees: KNOWN }).collect();
    let of = |key: &str| truth[key].as_f64().unwrap();
    let whole = Whole { value: of("mean_lux"), noise: of("mean_standard_error_lux"), bias: 0.0, degrees: KNOWN };
    Values { outputs: vec![(sensors, whole)], tubes: Vec::new() }
}

/// Blocks of the Cornell box along each side of the reference's image.
const CORNELL: usize = 32;

/// The Cornell box in `blocks` x `blocks` blocks by a public path tracer and light tracer.
pub fn cornell(blocks: usize) -> Values {
    let truth = reference::json("scenes/S4.blocks.reference.json");
    // the errors of the channels are one path's: fully correlated
    let luminance = |key: &str, block: usize| -> f64 {
        let value = &truth[key][block / CORNELL][block % CORNELL];
        (0..3).map(|channel| REC709_LUMINANCE[channel] * value[channel].as_f64().unwrap()).sum()
    };
    let each = CORNELL / blocks;
    let mean = |places: &[usize]| {
        let n = places.len() as f64;
        let value = places.iter().map(|block| luminance("rgb", *block)).sum::<f64>() / n;
        let square = places.iter().map(|block| luminance("standard_error", *block).powi(2)).sum::<f64>();
        Measured { value, error: square.sqrt() / n, degrees: KNOWN }
    };
    let of_block = |block: usize| {
        let (x, y) = (block % blocks * each, block / blocks * each);
        (0..each * each).map(|k| (y + k / each) * CORNELL + x + k % each).collect::<Vec<_>>()
    };
    let whole = mean(&(0..CORNELL * CORNELL).collect::<Vec<_>>());
    let whole = Whole { value: whole.value, noise: whole.error, bias: 0.0, degrees: KNOWN };
    let blocks = (0..blocks * blocks).map(|block| mean(&of_block(block))).collect();
    Values { outputs: vec![(blocks, whole)], tubes: Vec::new() }
}

/// Compares all values, each with a sentence for the case that they differ.
pub fn compare_all(found: &Values, oracle: &Values, bound: f64) -> Vec<(String, Verdict)> {
    let mut verdicts = Vec::new();
    let mut judge = |what: &str, found: &[Measured], oracle: &[Measured], bound: f64| {
        assert_eq!(found.len(), oracle.len());
        for (place, (found, oracle)) in found.iter().zip(oracle).enumerate() {
            let sentence = format!("{what}, place {place}: {found:?} is not {oracle:?}");
            verdicts.push((sentence, compare(*found, *oracle, bound)));
        }
    };
    assert_eq!(found.outputs.len(), oracle.outputs.len());
    for (output, (found, oracle)) in found.outputs.iter().zip(&oracle.outputs).enumerate() {
        judge(&format!("output {output}"), &found.0, &oracle.0, bound);
        judge(&format!("mean of output {output}"), &[found.1.measured()], &[oracle.1.measured()], bound);
    }
    if !found.tubes.is_empty() && !oracle.tubes.is_empty() {
        judge("flux through tubes", &found.tubes, &oracle.tubes, 0.0);
    }
    verdicts
}
