//! Progressive gathering: radii that shrink from pass to pass.
//!
//! By the schedule (Knaus and Zwicker 2011) the radius is a function of the pass' number, the same at all points, and passes are
//! independent.
//!
//! Per point (Hachisuka, Ogaki and Jensen 2008; Hachisuka and Jensen 2009) each visible point keeps its squared radius R^2,
//! a number N of photons and their flux tau. A pass that finds M photons of flux Phi within R keeps N + alpha M of the N + M,
//! as if photons lay evenly on the disc:
//!
//! R'^2 = R^2 (N + alpha M) / (N + M), N' = N + alpha M, tau' = (tau + Phi) R'^2 / R^2, E = tau' / (pi R'^2 emitted).
//!
//! Divided by pi R'^2 the third says tau' / (pi R'^2) = tau / (pi R^2) + Phi / (pi R^2): E is the mean over all passes, the
//! empty ones included, of Phi / (pi R^2) with the R before the pass. So tau is the mean that an estimate holds anyway, and
//! only R^2 and N are kept beside it. Three things follow.
//!
//! - A kernel that is clipped to the area A counts with Phi / A, and its photons as M pi R^2 / A, as many as the full disc
//!   would hold at the same density: each term is then the mean irradiance of what it covers, at any radius, and N / (pi R^2)
//!   the density of photons per area of surface, at points that lie near an edge in some passes only, too. A surface that
//!   fills less than a quarter of the disc (that of a right-angled corner) counts as a quarter, so that one photon in a
//!   sliver does not stall the radius.
//! - R is made of earlier passes alone. Given these, Phi / A has the mean and the variance that it has at a fixed radius: the
//!   deviations of passes from their means are uncorrelated, and their spread gives the standard error of the mean as if
//!   passes were independent. What is left is the bias of the kernel at the radii that came out, estimated as always.
//! - With photons at even density and M equal to its expectation, N after i passes is i times the photons in the present
//!   disc, and R_n = R_0 sqrt(Gamma(n + alpha) / (Gamma(alpha) Gamma(n + 1))), whatever the density.

use std::borrow::Cow;

use glam::DVec3;

/// Default radius of the first pass, as a fraction of the shortest edge of the room.
pub const DEFAULT_RADIUS_SHARE: f64 = 0.05;

/// Gather radius of a trial's first pass, relative to that of the method: with as many photons the noise of the estimated squared bias,
/// scaled to the method's radius, is 64 times less. Much wider kernels would meet the room's edges.
pub const TRIAL_RADIUS: f64 = 2.0;

/// Smallest fraction of the full disc that a clipped kernel is assumed to have when its photons are counted.
const LEAST_COUNTED_SHARE: f64 = 0.25;

/// Rule for the gather radius of a pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Radius {
    /// A function of the pass' number.
    #[default]
    Schedule,
    /// A function of the photons that the point has found in the passes before.
    PerPoint,
}

impl Radius {
    /// Returns a sentence on the rule, for the plan.
    pub fn reason(self) -> &'static str {
        match self {
            Self::Schedule => "the gather radius follows a schedule, so that passes are independent",
            Self::PerPoint => "the gather radius of each point follows the photons that it has found in earlier passes",
        }
    }
}

/// State that a point carries from pass to pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointStatistics {
    /// Squared radius R^2 in m2.
    pub radius_squared: f64,
    /// Number N of photons, not an integer.
    pub photons: f64,
}

impl PointStatistics {
    /// Returns the state before the first pass.
    pub fn new(radius_m: f64) -> Self {
        Self { radius_squared: radius_m * radius_m, photons: 0.0 }
    }

    /// Returns the radius R in m.
    pub fn radius_m(&self) -> f64 {
        self.radius_squared.sqrt()
    }

    /// Adds `found` photons (M, those of clipped kernels scaled to full discs) of one pass and shrinks the radius; 0 changes nothing.
    pub fn update(&mut self, found: f64, alpha: f64) {
        if found > 0.0 {
            let kept = self.photons + alpha * found;
            self.radius_squared *= kept / (self.photons + found);
            self.photons = kept;
        }
    }
}

/// State of the points of each grid and view that passes hand to the next one; empty where passes are independent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Carried {
    /// States of each grid's points; empty where none are kept.
    pub grids: Vec<Vec<PointStatistics>>,
    /// States of each view's points; empty where none are kept.
    pub views: Vec<Vec<PointStatistics>>,
}

impl Carried {
    /// Returns this state, or before any pass the state from which the first pass starts.
    pub fn or(&self, start: impl FnOnce() -> Self) -> Cow<'_, Self> {
        if self.grids.is_empty() && self.views.is_empty() { Cow::Owned(start()) } else { Cow::Borrowed(self) }
    }

    /// Returns the states of a grid's points; empty if none are kept.
    pub fn grid(&self, number: usize) -> &[PointStatistics] {
        self.grids.get(number).map_or(&[], Vec::as_slice)
    }

    /// Returns the states of a view's points; empty if none are kept.
    pub fn view(&self, number: usize) -> &[PointStatistics] {
        self.views.get(number).map_or(&[], Vec::as_slice)
    }

    /// Replaces the states by those of `later`, where it has any.
    pub fn replace(&mut self, later: &Self) {
        if !later.grids.is_empty() {
            self.grids.clone_from(&later.grids);
        }
        if !later.views.is_empty() {
            self.views.clone_from(&later.views);
        }
    }

    /// Calls `f` on every value in a fixed order.
    pub fn for_each_value(&mut self, f: &mut impl FnMut(&mut f64)) {
        for point in self.grids.iter_mut().chain(&mut self.views).flatten() {
            f(&mut point.radius_squared);
            f(&mut point.photons);
        }
    }
}

/// Gather radii of one method in one scene.
#[derive(Clone, Debug)]
pub struct Radii {
    /// Rule by which radii shrink.
    pub rule: Radius,
    initial_m: f64,
    alpha: f64,
}

impl Radii {
    /// Creates the radii from the radius `initial_m` of the first pass in m, by default a twentieth of the shortest edge of a room of
    /// `size` metres; 0 < `alpha` < 1.
    pub fn new(rule: Radius, initial_m: Option<f64>, alpha: f64, size: DVec3) -> Self {
        Self { rule, initial_m: Self::initial_m(initial_m, size), alpha }
    }

    /// Returns the gather radius of the first pass in metres: `initial_m`, or a twentieth of the shortest edge of a room of `size` metres.
    pub fn initial_m(initial_m: Option<f64>, size: DVec3) -> f64 {
        initial_m.unwrap_or(DEFAULT_RADIUS_SHARE * size.min_element())
    }

    /// Returns the squared gather radius relative to that of the first pass, averaged over `passes` passes of the schedule: the mean of a
    /// bias that grows with the squared radius falls by this factor. The sum has a closed form, because its terms telescope; 0 < `alpha` <
    /// 1.
    ///
    /// The second pass has 5/6 of the first one's squared radius with alpha 2/3:
    ///
    /// ```
    /// use skyduct_physics::integrator::photon_map::progressive::Radii;
    ///
    /// assert!((Radii::mean_square(2.0, 2.0 / 3.0) - 11.0 / 12.0).abs() < 1e-14);
    /// assert!((Radii::mean_inverse_square(2.0, 2.0 / 3.0) - 11.0 / 10.0).abs() < 1e-14);
    /// ```
    pub fn mean_square(passes: f64, alpha: f64) -> f64 {
        let after =
            libm::exp(libm::lgamma(passes + 1.0 + alpha) - libm::lgamma(passes + 1.0) - libm::lgamma(1.0 + alpha));
        (after - 1.0) / (alpha * passes)
    }

    /// Returns the squared gather radius of the first pass relative to that of a pass, averaged over `passes` passes of the schedule: the
    /// mean variance of the passes grows by this factor, because their noise is that of the photons in a disc.
    pub fn mean_inverse_square(passes: f64, alpha: f64) -> f64 {
        let gammas = libm::lgamma(passes + 2.0) - libm::lgamma(passes + alpha) + libm::lgamma(1.0 + alpha);
        (libm::exp(gammas) - alpha) / ((2.0 - alpha) * passes)
    }

    /// Returns the gather radius of a pass in metres by the schedule: r_1 sqrt(prod_{k=1..i} (k + alpha) / (k + 1)), Knaus and Zwicker
    /// 2011. With radii per point, it is the radius for which the photons are sorted.
    pub fn scheduled(&self, pass: u64) -> f64 {
        self.initial_m * libm::exp(0.5 * Self::log_square(pass as f64, self.alpha))
    }

    /// Returns the logarithm of the squared radius of pass `i` by the schedule, relative to that of the first pass.
    fn log_square(i: f64, alpha: f64) -> f64 {
        // the product is Gamma(i + 1 + alpha) / (Gamma(1 + alpha) Gamma(i + 2)) with i passes before
        libm::lgamma(i + 1.0 + alpha) - libm::lgamma(1.0 + alpha) - libm::lgamma(i + 2.0)
    }

    /// Returns the squared gather radius of pass `i` by the schedule, relative to that of the first pass.
    pub fn square(i: f64, alpha: f64) -> f64 {
        libm::exp(Self::log_square(i, alpha))
    }

    /// Returns the state that the points of each grid and view carry into the first pass; the arguments are numbers of points.
    pub fn start(&self, grids: impl Iterator<Item = usize>, views: impl Iterator<Item = usize>) -> Carried {
        let new = |points: usize| vec![PointStatistics::new(self.initial_m); points];
        match self.rule {
            Radius::Schedule => Carried::default(),
            Radius::PerPoint => Carried { grids: grids.map(new).collect(), views: views.map(new).collect() },
        }
    }

    /// Returns the states of an output's points after a pass that found the given numbers of photons; empty if `before` is.
    pub fn after(&self, before: &[PointStatistics], found: impl Iterator<Item = f64>) -> Vec<PointStatistics> {
        let mut after = before.to_vec();
        after.iter_mut().zip(found).for_each(|(point, found)| point.update(found, self.alpha));
        after
    }
}

/// Scales the number of photons of a clipped kernel to the full disc: `count` photons lie on the `area` that is left of `full`.
pub fn scaled_count(count: u64, full: f64, area: f64) -> f64 {
    count as f64 * full / area.max(LEAST_COUNTED_SHARE * full)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// R_n / R_0 by the closed form, as tabulated for alpha 0.8 and 2/3 with the recursion of expected counts, whatever the
    /// density of photons.
    #[test]
    fn expected_counts_give_the_closed_form() {
        let tabulated = [
            (0.8, [(10, 0.733266), (200, 0.545495), (1024, 0.463376), (10_000, 0.36896), (1_000_000, 0.232799)]),
            (2.0 / 3.0, [(10, 0.582246), (200, 0.35526), (1024, 0.270665), (10_000, 0.185141), (1_000_000, 0.085935)]),
        ];
        let ln_gamma = statrs::function::gamma::ln_gamma;
        for (alpha, rows) in tabulated {
            for density in [0.01, 50.0, 1e6] {
                let mut point = PointStatistics::new(0.3);
                let mut pass = 0;
                for (passes, tabulated) in rows {
                    while pass < passes {
                        point.update(density * point.radius_squared / 0.09, alpha);
                        pass += 1;
                    }
                    let n = f64::from(passes);
                    let exact = (0.5 * (ln_gamma(n + alpha) - ln_gamma(alpha) - ln_gamma(n + 1.0))).exp();
                    let ratio = point.radius_m() / 0.3;
                    assert!((ratio / exact - 1.0).abs() < 1e-8 && (ratio - tabulated).abs() < 1e-6, "{ratio} {exact}");
                    // N is the photons of all passes at the density of the present disc
                    let expected = n * density * point.radius_squared / 0.09;
                    assert!((point.photons / expected - 1.0).abs() < 1e-8);
                }
            }
        }
    }

    #[test]
    fn means_over_the_schedule_are_those_of_its_passes() {
        for alpha in [0.3, 2.0 / 3.0, 0.8] {
            for passes in [1u32, 5, 100] {
                let mean = |of: &dyn Fn(f64) -> f64| {
                    (0..passes).map(|pass| of(Radii::square(f64::from(pass), alpha))).sum::<f64>() / f64::from(passes)
                };
                let squares = Radii::mean_square(f64::from(passes), alpha) / mean(&|square| square);
                let inverses = Radii::mean_inverse_square(f64::from(passes), alpha) / mean(&|square| 1.0 / square);
                assert!((squares - 1.0).abs() < 1e-12 && (inverses - 1.0).abs() < 1e-12, "{alpha} {passes}");
            }
        }
    }

    #[test]
    fn empty_passes_change_nothing() {
        let mut point = PointStatistics::new(0.5);
        point.update(0.0, 0.5);
        assert_eq!(point, PointStatistics::new(0.5));
        point.update(1.0, 0.5);
        let once = point;
        point.update(0.0, 0.5);
        assert!(point == once && point.radius_squared == 0.125 && point.photons == 0.5);
    }
}
