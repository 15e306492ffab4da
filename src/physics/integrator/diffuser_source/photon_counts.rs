//! Number of photons of a pass that go down the tubes.

use crate::guide::Guide;
use crate::integrator::pass_size::PassSize;
use crate::traceable::TraceableTube;

/// Numbers of photons for each tube of a pass: a ray through a straight guide is worth many through bends and facets, some of which turn
/// back. Errors of the flux are errors of all sensors at once: with fewer photons, jobs would miss the requested error much too often. Rays
/// through domes and meshes cost several times as much.
const STRAIGHT: PassSize = PassSize { for_one_percent: 128.0, growth: 1.5, fewest: 0.0, most: f64::INFINITY };
const BENT: PassSize = PassSize { for_one_percent: 512.0, ..STRAIGHT };
const OF_OTHER_GUIDES: PassSize = PassSize { for_one_percent: 256.0, ..STRAIGHT };

/// Number of photons through bends where more than 1 % is requested. Low-discrepancy points gain little there: four times the photons have
/// a third of the variance. If passes grew as those of straight guides do, fine answers would take more passes, and each look at an error
/// is another chance to stop at one that is too small by chance. Of jobs in the scene S3 to a standard error of 0.51 % such passes let 7 % have
/// an error 1.5 times the requested one, and these 4 %. Beyond the largest number, errors would be no smaller for the same time.
const BENT_AND_FINE: PassSize = PassSize { growth: 1.85, most: 24_576.0, ..BENT };

/// Number of photons through facets where more than 1 % is requested. Of jobs in the scene S3_mesh to a standard error of 0.51 % passes
/// that grew like those of straight guides let 10 % have an error 1.5 times the requested one; these let 5 %, for a tenth more time.
const MESHED_AND_FINE: PassSize = PassSize { growth: 2.6, most: 4096.0, ..OF_OTHER_GUIDES };

/// True if all guides are straight, so that a few photons estimate their flux well.
pub fn are_straight(tubes: &[TraceableTube]) -> bool {
    tubes.iter().all(|tube| matches!(tube.guide, Guide::Straight(_)))
}

/// Returns the number of photons of a pass such that a few to a dozen passes find the light of sensors to a relative standard error
/// `target`. A sensor gets light from several tubes, whose errors are independent: each may exceed the target by the root of their number.
pub fn photons_for(tubes: &[TraceableTube], target: f64) -> f64 {
    let of_tube = |tube: &TraceableTube| match tube.guide {
        Guide::Straight(_) => STRAIGHT.of(target, 1.0),
        Guide::Bent(_) => finer(BENT, BENT_AND_FINE, target),
        Guide::Domed(_) => OF_OTHER_GUIDES.of(target, 1.0),
        Guide::Mesh(_) => finer(OF_OTHER_GUIDES, MESHED_AND_FINE, target),
    };
    tubes.iter().map(of_tube).sum::<f64>() / (tubes.len().max(1) as f64).sqrt()
}

/// Returns the number of photons by one law, or by another for fine answers where this is larger.
fn finer(law: PassSize, of_fine: PassSize, target: f64) -> f64 {
    law.of(target, 1.0).max(of_fine.of(target, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks by hand: at 1 % both laws agree, rougher answers follow that of all guides, finer ones their own up to its largest number,
    /// and beyond this the former again.
    #[test]
    fn bends_ask_for_more_where_answers_are_fine() {
        let near = |target: f64, photons: f64| {
            let found = finer(BENT, BENT_AND_FINE, target);
            assert!((found / photons - 1.0).abs() < 1e-3, "{target}");
        };
        near(0.01, 512.0);
        near(0.04, 64.0);
        near(0.005, 512.0 * 3.6050);
        near(0.001, 24_576.0);
        near(0.01 / 64.0, 512.0 * 512.0);
    }
}
