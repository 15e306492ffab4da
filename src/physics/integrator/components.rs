//! Passes of the light in parts: by source, direct and interreflected, and by tube.
//!
//! Each source has a scene of its own, and daylight one for each tube; the grids are the sum of these, so that the parts add up to the
//! whole in every pass, and so do their errors. Direct light is that of scenes whose surfaces reflect nothing; the remainder is
//! interreflected light, including light that the room reflects up into a tube and gets back.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::{GridPass, Integrator, Pass};
use crate::traceable::{Source, TraceableScene};

/// Part of the light of grids.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    /// Light of a source that no surface of the room has reflected.
    Direct(Source),
    /// Light of a source that surfaces of the room have reflected.
    Interreflected(Source),
    /// Light of sky and sun that enters by the collector of this tube.
    OfTube(usize),
}

impl Component {
    /// Returns the parts of a scene's light, in the order in which passes have them.
    pub fn of_scene(scene: &TraceableScene) -> Vec<Self> {
        let by_source = scene.sources().flat_map(|source| [Self::Direct(source), Self::Interreflected(source)]);
        by_source.chain((0..scene.tubes.len()).map(Self::OfTube)).collect()
    }

    /// Returns the number of passes that make up one pass of a scene in parts.
    pub fn passes(scene: &TraceableScene) -> usize {
        lights(scene).count() + if scene.interreflection { scene.sources().count() } else { 0 }
    }
}

/// Returns each source with the tube through which its light enters; `None` for luminaires.
fn lights(scene: &TraceableScene) -> impl Iterator<Item = (Source, Option<usize>)> {
    scene.sources().flat_map(|source| {
        let daylight = (0..scene.tubes.len()).filter(move |_| source.is_daylight()).map(Some);
        daylight.chain((!source.is_daylight()).then_some(None)).map(move |tube| (source, tube))
    })
}

/// Integrator of grids that computes their light in parts.
pub struct InParts {
    parts: Vec<Component>,
    /// All light of each source; of daylight, that by the collector of one tube.
    all: Vec<(Source, Option<usize>, Box<dyn Integrator>)>,
    /// Direct light of each source by all tubes; empty where no light is reflected, so that all of it is direct.
    direct: Vec<(Source, Box<dyn Integrator>)>,
    grids: usize,
}

impl InParts {
    /// Builds one method for each part: `build` gets the scene and the number of the part; `None` where it returns none. Parts of different
    /// numbers must use different random numbers.
    pub fn new(
        scene: &TraceableScene,
        grids: usize,
        mut build: impl FnMut(Arc<TraceableScene>, u64) -> Option<Box<dyn Integrator>>,
    ) -> Option<Self> {
        let mut number = 0;
        let mut next = |scene: TraceableScene| {
            number += 1;
            build(Arc::new(scene), number)
        };
        let mut all = Vec::new();
        for (source, tube) in lights(scene) {
            all.push((source, tube, next(scene.lit_by(source, tube))?));
        }
        let mut direct = Vec::new();
        for source in scene.sources().filter(|_| scene.interreflection) {
            direct.push((source, next(scene.lit_by(source, None).without_interreflection())?));
        }
        Some(Self { parts: Component::of_scene(scene), all, direct, grids })
    }
}

impl Integrator for InParts {
    fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Pass> {
        let mut whole = Pass::default();
        let mut of_all = Vec::new();
        for (.., light) in &self.all {
            let part = light.pass(pass, cancel)?;
            whole.totals.tubes.resize(part.totals.tubes.len().max(whole.totals.tubes.len()), Default::default());
            whole.totals.add(&part.totals);
            whole.photons += part.photons;
            of_all.push(part.grids);
        }
        let mut of_direct = Vec::new();
        for (source, light) in &self.direct {
            let part = light.pass(pass, cancel)?;
            whole.totals.rays += part.totals.rays;
            whole.totals.not_finite = whole.totals.not_finite.or(part.totals.not_finite);
            whole.photons += part.photons;
            of_direct.push((*source, part.grids));
        }
        for grid in 0..self.grids {
            let sum = |wanted: &dyn Fn(Source, Option<usize>) -> bool| {
                let mut sum = GridPass::default();
                for ((source, tube, _), grids) in self.all.iter().zip(&of_all) {
                    match grids.get(grid) {
                        Some(part) if wanted(*source, *tube) => sum.add(part),
                        Some(part) => sum.make_room_for(part),
                        None => {}
                    }
                }
                sum
            };
            let all_of = |source: Source| sum(&|other, _| other == source);
            let direct_of = |source: Source| {
                let direct = of_direct.iter().find(|(other, _)| *other == source);
                direct.and_then(|(_, grids)| grids.get(grid).cloned()).unwrap_or_else(|| all_of(source))
            };
            let of_part = |part: &Component| match *part {
                Component::Direct(source) => direct_of(source),
                Component::Interreflected(source) => all_of(source).without(&direct_of(source)),
                Component::OfTube(number) => sum(&|_, tube| tube == Some(number)),
            };
            let companions = self.parts.iter().map(of_part).collect();
            whole.grids.push(GridPass { companions, ..sum(&|_, _| true) });
        }
        Some(whole)
    }

    fn start(&self) -> Pass {
        let of_all = self.all.first().map(|(.., light)| light.start()).unwrap_or_default();
        let mut grids = of_all.grids;
        grids.resize(self.grids, GridPass::default());
        for grid in &mut grids {
            // the expected spreads of parts are not that of their sum
            grid.expected_spreads = Vec::new();
            let part = |component: &Component| {
                let residual =
                    if matches!(component, Component::Direct(_)) { Vec::new() } else { grid.residual.clone() };
                GridPass { residual, is_part: true, ..grid.clone() }
            };
            grid.companions = self.parts.iter().map(part).collect();
        }
        Pass { grids, ..Pass::default() }
    }
}
