//! How many photons, vertices and rays a pass has.

use crate::integrator::lamp::beside::photons_beside;
use crate::integrator::lamp::sizes::{are_straight, photons_for};
use crate::integrator::pass_size::PassSize;
use crate::sampling::power_of_two;
use crate::traceable::TraceableTube;

/// Fewest and most photons, and vertices, of a pass, unless the document says how many.
const LEAST: f64 = 64.0;
pub const MOST: f64 = 65_536.0;

/// Vertices of a pass, unless the document says how many.
pub const VERTICES: PassSize = PassSize { for_one_percent: 192.0, growth: 1.4, fewest: LEAST, most: MOST };
/// The same where the flux of a tube has its part in the error.
const BESIDE_NOISY_FLUX: PassSize = PassSize { for_one_percent: 256.0, ..VERTICES };

/// Where sensors gather: rays of a sensor that sees no opening, and vertices. Even points gain less than where nothing stands.
/// Measured in the room of the thesis with boxes and a chair: of the variance at 1 % rays have a half, vertices a third.
pub const GATHERED_RAYS: PassSize = PassSize { for_one_percent: 192.0, growth: 1.7, fewest: 16.0, most: MOST_RAYS };
const GATHERED_VERTICES: PassSize = PassSize { for_one_percent: 80.0, growth: 1.8, fewest: 8.0, most: MOST };
const MOST_RAYS: f64 = 16_384.0;

/// Photons are as many times more where sensors gather: they cost a tenth of the pass.
const GATHERED_PHOTONS: f64 = 3.0;

/// Where obstacles stand, photons and vertices are as many times more as a power of what the spread of vertices
/// (that of `Importance`) has above this, in units of that: their shadows take from even points
/// what these gain elsewhere. Measured in the room of the thesis with 1 to 64 boxes and a chair, so that 8 to 10 passes are enough: spreads
/// of 0.64 to 7.6, and 1 to 17 times as many. Nothing depends on it but how many passes there are.
const SPREAD_OF_NO_EFFECT: f64 = 0.426;
const UNIT_OF_SPREAD: f64 = 0.179;
const GROWTH_BY_SPREAD: f64 = 0.77;
const MOST_BY_SPREAD: f64 = 20.0;

/// What is sized.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum By {
    /// Vertices send all light, where obstacles ask for so many times more than where nothing stands: 1 for none.
    Vertices(f64),
    /// Sensors gather light from patches, and vertices send the residual.
    Gathering,
}

/// Numbers of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sizes {
    /// Photons from sky and sun.
    pub photons: u64,
    /// Vertices on the surfaces of the room.
    pub vertices: u64,
    /// Rays of a sensor that sees no opening, where sensors gather: a multiple of 32.
    pub rays: u64,
}

/// As many times more photons and vertices as where nothing stands, by the spread of vertices where something does; a share of the
/// sensors is lit, the others are in boxes.
pub fn more_by_obstacles(spread: f64, lit_share: f64) -> f64 {
    let above = ((spread * lit_share - SPREAD_OF_NO_EFFECT) / UNIT_OF_SPREAD).max(1.0);
    libm::pow(above, GROWTH_BY_SPREAD).min(MOST_BY_SPREAD)
}

/// The sizes of a pass for a relative standard error `target`; photons and vertices by the document where that says them.
pub fn sizes([photons, vertices]: [Option<u64>; 2], target: f64, tubes: &[TraceableTube], by: By) -> Sizes {
    let are_straight = are_straight(tubes);
    let (more_photons, vertices_by_target) = match by {
        By::Vertices(more) => {
            let law = if are_straight { VERTICES } else { BESIDE_NOISY_FLUX };
            (more, even_size(law.of(target, more), more <= 1.0))
        }
        By::Gathering => (GATHERED_PHOTONS, (GATHERED_VERTICES.of(target, 1.0) / 8.0).round() as u64 * 8),
    };
    let photons_by_target = (photons_for(tubes, target) * more_photons).max(photons_beside(tubes, target));
    let photons_by_target = even_size(photons_by_target, more_photons <= 1.0 && are_straight);
    Sizes {
        photons: photons.unwrap_or(photons_by_target),
        vertices: vertices.unwrap_or(vertices_by_target),
        rays: (GATHERED_RAYS.of(target, 1.0) / 32.0).round().max(1.0) as u64 * 32,
    }
}

/// Whole rows of small nets, and whole nets where these are small enough and nothing takes from what they gain.
fn even_size(number: f64, gains: bool) -> u64 {
    match (number.clamp(LEAST, MOST) / LEAST).round() as u64 {
        rows if rows < 4 || !gains => rows * LEAST as u64,
        _ => power_of_two(number.min(MOST)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nothing more where nothing stands or vertices spread as without obstacles, the measured power of what is above, of the
    /// sensors that are lit alone, and a bound.
    #[test]
    fn obstacles_ask_for_more_by_their_spread() {
        let more = |units: f64| more_by_obstacles(SPREAD_OF_NO_EFFECT + units * UNIT_OF_SPREAD, 1.0);
        assert_eq!([more_by_obstacles(0.0, 1.0), more_by_obstacles(SPREAD_OF_NO_EFFECT, 1.0), more(1.0)], [1.0; 3]);
        for (units, times) in [(2.0, 1.7053), (10.0, 5.8884), (40.0, 17.1232)] {
            assert!((more(units) / times - 1.0).abs() < 1e-4, "{units}: {}", more(units));
            let spread = SPREAD_OF_NO_EFFECT + units * UNIT_OF_SPREAD;
            assert!((more_by_obstacles(4.0 * spread, 0.25) / more(units) - 1.0).abs() < 1e-12);
        }
        assert_eq!(more(1e6), MOST_BY_SPREAD);
    }

    /// More vertices are whole rows of small nets, and without obstacles whole nets; rays fill whole groups for whatever is asked.
    #[test]
    fn passes_grow_with_what_is_asked_for() {
        let by_target = |target: f64, by: By| sizes([None; 2], target, &[], by);
        let none = by_target(0.01, By::Vertices(1.0)).vertices;
        for more in [1.7, 5.9, 20.0] {
            let vertices = by_target(0.01, By::Vertices(more)).vertices;
            assert!(
                vertices.is_multiple_of(64) && (vertices as f64 / (more * none as f64) - 1.0).abs() < 0.1,
                "{vertices}"
            );
        }
        assert!(by_target(0.001, By::Vertices(1.0)).vertices.is_power_of_two());
        let mut before = Sizes { photons: 0, vertices: 0, rays: 0 };
        for target in [0.1, 0.02, 0.01, 0.005, 0.001] {
            let sizes = by_target(target, By::Gathering);
            assert!(sizes.rays.is_multiple_of(32) && sizes.rays >= 32, "{sizes:?}");
            assert!(sizes.vertices >= before.vertices && sizes.rays >= before.rays, "{sizes:?} {before:?}");
            before = sizes;
        }
        for by in [By::Vertices(20.0), By::Gathering] {
            let Sizes { photons, vertices, .. } = sizes([Some(99), Some(77)], 0.01, &[], by);
            assert_eq!([photons, vertices], [99, 77]);
        }
    }
}
