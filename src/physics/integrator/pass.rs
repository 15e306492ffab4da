//! Passes of a method and their results.

use std::sync::atomic::AtomicBool;

use super::photon::energy_balance::PhotonTotals;
use super::photon_map::progressive::{Carried, PointStatistics};

/// Method whose results are computed pass by pass.
pub trait Integrator: Send + Sync {
    /// Computes pass `pass` (0, 1, ...) on the current rayon pool, with statistics per point as if it were the first; `None` when `cancel`
    /// was raised meanwhile.
    fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Pass>;

    /// Returns the state before the first pass, in the shape of a pass: the values that the first one starts from, and zeros where points
    /// estimate their sampling error; the rest is empty.
    fn start(&self) -> Pass {
        Pass::default()
    }

    /// Computes pass `pass` from the state `before` that earlier passes left, which is empty before the first.
    fn pass_after(&self, pass: u64, _before: &Carried, cancel: &AtomicBool) -> Option<Pass> {
        self.pass(pass, cancel)
    }
}

/// Result of one pass: a replicate of every output.
#[derive(Clone, Debug, Default)]
pub struct Pass {
    /// Illuminances, in the order of the grids that the method was built for.
    pub grids: Vec<GridPass>,
    /// Luminances, in the order of the views that the method was built for.
    pub views: Vec<ViewPass>,
    /// Energy balance of the pass, the fluxes of its tubes, and the number of its rays.
    pub totals: PhotonTotals,
    /// Number of emitted photons.
    pub photons: u64,
    /// State for the next pass; empty where passes are independent.
    pub carried: Carried,
}

impl Pass {
    /// Makes a pass of grids and views with the point statistics that they carry to the next one: none where passes are independent.
    pub fn carrying(
        grids: Vec<(GridPass, Vec<PointStatistics>)>,
        views: Vec<(ViewPass, Vec<PointStatistics>)>,
    ) -> Self {
        let (grids, of_grids): (Vec<_>, Vec<_>) = grids.into_iter().unzip();
        let (views, of_views): (Vec<_>, Vec<_>) = views.into_iter().unzip();
        let kept = |points: Vec<Vec<PointStatistics>>| points.into_iter().filter(|points| !points.is_empty()).collect();
        Self { grids, views, carried: Carried { grids: kept(of_grids), views: kept(of_views) }, ..Self::default() }
    }
}

/// Fewest sensors whose residuals are pooled: fewer contain too little information on how they differ.
pub const LEAST_SENSORS: usize = 8;

/// Fraction of the residual's variance that remains in each sensor however many share it, where nothing tells how much sensors differ.
const DIFFERENT: f64 = 0.04;

/// Returns the fraction of the variance of a sensor's residual that remains where so many `sensors` share theirs, and nothing tells how much
/// they differ: with the noise y of each, n sensors show no spread below y / n^(1/2).
pub fn remaining_noise(sensors: usize) -> f64 {
    if sensors < LEAST_SENSORS { 1.0 } else { (DIFFERENT + 1.0 / (sensors as f64).sqrt()).min(1.0) }
}

/// Least scale of a sensor's residual, as a fraction of the median over the grid.
pub const LEAST_SCALE: f64 = 0.1;

/// Factor by which the true spread of residuals may exceed the expected one: patches are not equally bright everywhere, and their errors
/// depend on each other. In ten rooms true variances were 0.25 to 4 times the expected ones.
pub const CAUTION: f64 = 3.0;

/// Fraction of the mean of a grid below which the value of a sensor is judged as if it were this large.
pub const LEAST_SHARE_OF_MEAN: f64 = 0.01;

/// Illuminances of a grid in lx, one per sensor, with what their errors are computed from.
#[derive(Clone, Debug, Default)]
pub struct GridPass {
    /// Illuminance per sensor in lx, in the order of [`crate::scene::Grid::centre`].
    pub illuminance: Vec<f64>,
    /// Estimated bias per sensor in lx; empty when the method has none.
    pub bias: Vec<f64>,
    /// Contrasts (differences in lx) among the points of each sensor, where points are the same in every pass: equally many for each
    /// sensor, and their squares add up to the variance of the choice of points. Of sunlight that is computed once it is the estimated error.
    /// Empty elsewhere.
    pub contrasts: Vec<f64>,
    /// Residual of each sensor in lx: the part of its illuminance that a coarse solution leaves out; empty where the method does not
    /// estimate it.
    pub residual: Vec<f64>,
    /// Part of each sensor's illuminance in lx that the coarse solution gives; as long as `residual`.
    pub gathered: Vec<f64>,
    /// Variance of each sensor's true residual about the common one that is expected, relative to its squared gathered light; in the state
    /// before the first pass, and empty where it is not known.
    pub expected_spreads: Vec<f64>,
    /// True for a part of the light of the grid that it is a companion of; in the state before the first pass.
    pub is_part: bool,
    /// Number of photons behind each sensor's value; empty where the method's errors do not depend on it.
    pub photons: Vec<PhotonCount>,
    /// Illuminances in lx at many moments, with what is summed over them, sensor by sensor; empty where they are not requested.
    pub moments: Vec<f64>,
    /// Values of the same grid for single parts of the light, or by another method; equally many in every pass.
    pub companions: Vec<GridPass>,
}

impl GridPass {
    /// Adds another part of the light on the same sensors, by the same method.
    pub fn add(&mut self, other: &Self) {
        add_each(&mut self.residual, &other.residual, 1.0);
        add_each(&mut self.gathered, &other.gathered, 1.0);
        add_each(&mut self.illuminance, &other.illuminance, 1.0);
        add_each(&mut self.bias, &other.bias, 1.0);
        add_each(&mut self.contrasts, &other.contrasts, 1.0);
        if self.photons.len() < other.photons.len() {
            self.photons.resize(other.photons.len(), PhotonCount::default());
        }
        for (count, other) in self.photons.iter_mut().zip(&other.photons) {
            count.found += other.found;
            count.one_lux = count.one_lux.max(other.one_lux);
            count.brightest_lux = count.brightest_lux.max(other.brightest_lux);
        }
    }

    /// Resizes the lists as [`add`](Self::add) would, without adding the values of this part of the light.
    pub fn make_room_for(&mut self, other: &Self) {
        let nothing = |values: &[f64]| vec![0.0; values.len()];
        let photons = vec![PhotonCount::default(); other.photons.len()];
        let [illuminance, bias, contrasts] = [&other.illuminance, &other.bias, &other.contrasts].map(|of| nothing(of));
        let [residual, gathered] = [&other.residual, &other.gathered].map(|of| nothing(of));
        self.add(&Self { illuminance, bias, contrasts, residual, gathered, photons, ..Self::default() });
    }

    /// Converts means over whole sensors to means over their parts outside solids, of which `free` has the fractions of the area: the rest
    /// is dark in every pass, so a mean over the whole sensor is that over the free part times this fraction. Sensors inside solids become
    /// 0, and the values beside the grid are dropped.
    pub fn of_free_parts(&self, free: &[f64]) -> Self {
        let factors: Vec<f64> =
            free.iter().map(|fraction| if *fraction > 0.0 { 1.0 / fraction } else { 0.0 }).collect();
        let scaled = |values: &[f64]| -> Vec<f64> {
            // as many values of one sensor after the other
            let each = (values.len() / factors.len().max(1)).max(1);
            values.iter().enumerate().map(|(place, value)| value * factors[place / each]).collect()
        };
        let photons = self.photons.iter().zip(&factors).map(|(count, factor)| match *factor {
            0.0 => PhotonCount::default(),
            factor => {
                PhotonCount { one_lux: factor * count.one_lux, brightest_lux: factor * count.brightest_lux, ..*count }
            }
        });
        Self {
            expected_spreads: self.expected_spreads.clone(),
            is_part: self.is_part,
            illuminance: scaled(&self.illuminance),
            bias: scaled(&self.bias),
            contrasts: scaled(&self.contrasts),
            residual: scaled(&self.residual),
            gathered: scaled(&self.gathered),
            photons: photons.collect(),
            moments: scaled(&self.moments),
            companions: Vec::new(),
        }
    }

    /// Subtracts the direct light. The photon counts and the residual stay: the same photons are behind the remainder.
    pub fn without(&self, part: &Self) -> Self {
        let mut left = self.clone();
        add_each(&mut left.illuminance, &part.illuminance, -1.0);
        add_each(&mut left.bias, &part.bias, -1.0);
        add_each(&mut left.contrasts, &part.contrasts, -1.0);
        left
    }
}

/// Adds `factor` times each of the other values; missing values count as 0.
fn add_each(values: &mut Vec<f64>, others: &[f64], factor: f64) {
    if values.len() < others.len() {
        values.resize(others.len(), 0.0);
    }
    values.iter_mut().zip(others).for_each(|(value, other)| *value += factor * other);
}

/// Number of photons that a sensor found in one pass or in all passes, and their illuminances.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PhotonCount {
    /// Number of photons, or a lower bound of it: enough to distinguish 0 from a few, and a few from many.
    pub found: f64,
    /// Illuminance in lx by which one photon more would raise the value of the pass, or the sum of these over all passes; 0 where certainly
    /// no light can arrive.
    pub one_lux: f64,
    /// Illuminance in lx by which one of the brightest photons would raise the value, which many dim photons say nothing about; 0 where
    /// photons are nearly equal.
    pub brightest_lux: f64,
}

impl PhotonCount {
    /// Adds the photons of other passes, or of other points of the same sensor.
    pub fn add(&mut self, other: &Self) {
        self.found += other.found;
        self.one_lux += other.one_lux;
        self.brightest_lux += other.brightest_lux;
    }
}

/// Luminances of a view in cd/m2, one per pixel, top row first.
#[derive(Clone, Debug, Default)]
pub struct ViewPass {
    /// Luminances of the pixels in cd/m2, channels interleaved.
    pub luminance: Vec<f64>,
    /// Estimated bias of the luminance Y per pixel in cd/m2; empty when the method has none.
    pub bias: Vec<f64>,
    /// Contrasts, as in [`GridPass::contrasts`], of the luminance Y of pixels.
    pub contrasts: Vec<f64>,
    /// Number of rays per pixel that look for light shining straight into the eye, or one number for all pixels; if empty, one ray each.
    pub rays: Vec<f64>,
}
