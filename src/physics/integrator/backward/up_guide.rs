//! Directions in which a backward path continues from a closure up into its guide.

use glam::DVec3;

use crate::optics::scatter::Kind;
use crate::optics::{Closure, Scatter, SheetSide, Spectrum, Travel};
use crate::sampling::{CONES_SHARE, PathSamples};
use crate::traceable::TraceableTube;

/// Samples the direction in which a path against the light, that comes from `from`, leaves a point of a tube's closure on the upper `side`,
/// and its weight; `None` where nothing is scattered there.
///
/// The direction follows the closure's BSDF, or, where its guide passes only a narrow cone, mostly this cone: the BSDF alone would find it
/// once in thousands of rays.
pub fn upward<const C: usize>(
    tube: &TraceableTube,
    closure: &Closure<'_>,
    from: DVec3,
    side: SheetSide,
    samples: &mut PathSamples,
) -> Option<(DVec3, Spectrum<C>)> {
    let scattered = Scatter::<C>::sample(closure, Travel::AgainstLight, from, side, samples)?;
    let Some(cones) = tube.cones.as_ref().filter(|_| scattered.kind != Kind::Through) else {
        return Some((scattered.toward, scattered.weight));
    };
    let by_cones = samples.random.uniform() < CONES_SHARE;
    let toward = if by_cones { cones.sample(samples.random.uniform2()) } else { scattered.toward };
    let (value, pdf): (Spectrum<C>, f64) = closure.value_and_pdf(Travel::AgainstLight, from, toward);
    let mixed = (1.0 - CONES_SHARE) * pdf + CONES_SHARE * cones.density(toward);
    (mixed > 0.0).then(|| (toward, value * (1.0 / mixed)))
}
