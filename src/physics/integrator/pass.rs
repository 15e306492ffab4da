//! One pass of one method, and what it gives.

use std::sync::atomic::AtomicBool;

use super::photon::ledger::Account;
use super::photon_map::progressive::{Carried, PointStatistics};

/// One pass of one method.
pub trait Integrator: Send + Sync {
    /// Computes pass `pass` (0, 1, ...) on the current rayon pool, with statistics per point as if none had been before;
    /// `None` when `cancel` was raised meanwhile.
    fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Pass>;

    /// State before the first pass, in the shape of a pass: what the first one starts from, and zeros where points tell
    /// their sampling error; the rest is empty.
    fn start(&self) -> Pass {
        Pass::default()
    }

    /// Computes pass `pass` after those that left `before`, nothing before the first.
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
    /// Where the pass' flux went, and its rays.
    pub account: Account,
    /// Number of photons that set out.
    pub photons: u64,
    /// For the next pass; empty where passes are independent.
    pub carried: Carried,
}

impl Pass {
    /// A pass of grids and views, and what their points leave for the next: nothing where passes are independent.
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

/// Illuminance in lux per sensor.
#[derive(Clone, Debug, Default)]
pub struct GridPass {
    /// Illuminance per sensor, in the order of [`crate::scene::Grid::centre`].
    pub illuminance: Vec<f64>,
    /// Estimated bias per sensor; empty when the method has none.
    pub bias: Vec<f64>,
    /// Contrasts among the points of each sensor, where points are the same in every pass: equally many for each
    /// sensor, and their squares add up to the variance of the choice of points. Else empty.
    pub contrasts: Vec<f64>,
    /// Part of each sensor's illuminance beyond a coarse solution, in lux; empty where the method tells none, or where it is one part
    /// of the light among others.
    pub residual: Vec<f64>,
    /// Part that the coarse solution gives, in lux; as long as `residual`.
    pub gathered: Vec<f64>,
    /// Photons behind each sensor's value; empty where the method's errors need no count of them.
    pub photons: Vec<PhotonCount>,
    /// The same grid in parts of the light, or by another method; as many in every pass.
    pub beside: Vec<GridPass>,
}

impl GridPass {
    /// Adds another part of the light on the same sensors, by the same method. Of several parts no residual is told: these would not add
    /// up as the parts do.
    pub fn add(&mut self, other: &Self) {
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

    /// Makes room for the values of another part of the light, and leaves it out.
    pub fn make_room_for(&mut self, other: &Self) {
        let nothing = |values: &[f64]| vec![0.0; values.len()];
        let photons = vec![PhotonCount::default(); other.photons.len()];
        let (illuminance, bias) = (nothing(&other.illuminance), nothing(&other.bias));
        self.add(&Self { illuminance, bias, contrasts: nothing(&other.contrasts), photons, ..Self::default() });
    }

    /// The same for the parts of sensors that no solid takes, of which these are the shares: what covers the rest is dark in every
    /// pass, so that a mean over the whole is that over the free part times its share. Nothing is left of sensors inside solids, nor
    /// of what stands beside the grid.
    pub fn of_free_parts(&self, free: &[f64]) -> Self {
        let factors: Vec<f64> = free.iter().map(|share| if *share > 0.0 { 1.0 / share } else { 0.0 }).collect();
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
            illuminance: scaled(&self.illuminance),
            bias: scaled(&self.bias),
            contrasts: scaled(&self.contrasts),
            residual: scaled(&self.residual),
            gathered: scaled(&self.gathered),
            photons: photons.collect(),
            beside: Vec::new(),
        }
    }

    /// What is left without a part of the light. The photons stay, which are behind what is left as well.
    pub fn without(&self, part: &Self) -> Self {
        let mut left = Self { residual: Vec::new(), gathered: Vec::new(), ..self.clone() };
        add_each(&mut left.illuminance, &part.illuminance, -1.0);
        add_each(&mut left.bias, &part.bias, -1.0);
        add_each(&mut left.contrasts, &part.contrasts, -1.0);
        left
    }
}

/// Adds `factor` times each of the others; values that are not there count as 0.
fn add_each(values: &mut Vec<f64>, others: &[f64], factor: f64) {
    if values.len() < others.len() {
        values.resize(others.len(), 0.0);
    }
    values.iter_mut().zip(others).for_each(|(value, other)| *value += factor * other);
}

/// Photons that a sensor found in one pass, or in all.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PhotonCount {
    /// Number of photons, or a lower bound of it: what tells 0 from a few, and a few from many.
    pub found: f64,
    /// Lux by which one photon more would raise the pass' value, or in all the sum of these; 0 where it is known that no light
    /// can come.
    pub one_lux: f64,
    /// The same of one of the brightest photons, which many dim ones tell nothing of; 0 where photons are as good as alike.
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

/// Luminance in cd/m2 per pixel, top row first.
#[derive(Clone, Debug, Default)]
pub struct ViewPass {
    /// Luminances of the pixels, channels interleaved.
    pub luminance: Vec<f64>,
    /// Estimated bias of the luminance Y per pixel; empty when the method has none.
    pub bias: Vec<f64>,
    /// Contrasts as of [`GridPass::contrasts`], of the luminance Y of pixels.
    pub contrasts: Vec<f64>,
    /// Rays per pixel that look for what shines into the eye, or one number for all pixels; empty: one of each.
    pub rays: Vec<f64>,
}
