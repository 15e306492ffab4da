//! Update of a hit point as the thesis' Appendix A prints it, with its faults, beside the correct one.

use skyduct::sampling::{Key, PathRandom};
use skyduct::statistics::Moments;

/// Faults of Appendix A, lines 21 to 49, which can be switched on one by one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Faults {
    /// Division by the area of the old radius of a flux that is scaled to the new one (lines 41 and 47).
    pub old_radius: bool,
    /// Stale values: a pass that finds no photon keeps the value of the last one that did, divided by fewer emitted photons
    /// (line 21).
    pub stale: bool,
    /// Accumulated counts rounded down to whole numbers (section 5.5.2), although alpha M is not whole.
    pub whole_counts: bool,
}

impl Faults {
    /// Correct update.
    pub const NONE: Self = Self { old_radius: false, stale: false, whole_counts: false };
    /// Printed code, with counts that keep their fraction.
    pub const PRINTED: Self = Self { old_radius: true, stale: true, whole_counts: false };
    /// Printed code with the printed data structure, i.e. whole counts.
    pub const PRINTED_WHOLE: Self = Self { old_radius: true, stale: true, whole_counts: true };
}

/// State that progressive photon mapping keeps of one point (Hachisuka, Ogaki and Jensen 2008).
#[derive(Clone, Copy, Debug)]
pub struct HitPoint {
    /// Search radius relative to the first one, squared.
    radius_squared: f64,
    /// Accumulated photon count N.
    count: f64,
    /// Accumulated flux tau.
    flux: f64,
    /// Displayed value: flux per area of the first disc and per emitted photon.
    shown: f64,
}

impl Default for HitPoint {
    fn default() -> Self {
        Self { radius_squared: 1.0, count: 0.0, flux: 0.0, shown: 0.0 }
    }
}

impl HitPoint {
    /// Returns the search radius relative to the first one.
    pub fn radius(&self) -> f64 {
        self.radius_squared.sqrt()
    }

    /// Adds the `found` photons of a pass, with the sum of their `flux`; `emitted`: photons emitted in all passes so far, this
    /// one included.
    pub fn update(&mut self, found: f64, flux: f64, emitted: f64, alpha: f64, faults: Faults) {
        let old = self.radius_squared;
        if found > 0.0 {
            let scale = (self.count + alpha * found) / (self.count + found);
            self.radius_squared *= scale;
            self.flux = (self.flux + flux) * scale;
            self.count += alpha * found;
            if faults.whole_counts {
                self.count = self.count.floor();
            }
        }
        if found > 0.0 || !faults.stale {
            let area = if faults.old_radius { old } else { self.radius_squared };
            self.shown = self.flux / (area * emitted);
        }
    }

    /// Returns the displayed value: flux per area of the first disc and per emitted photon.
    pub fn shown(&self) -> f64 {
        self.shown
    }
}

/// Ratio of an update's result to the true value, for a uniform irradiance.
#[derive(Clone, Copy, Debug)]
pub struct Uniform {
    /// Moments of the ratio over the discs.
    pub ratio: Moments,
    /// Largest ratio of any disc.
    pub highest: f64,
    /// Mean radius relative to the first one.
    pub radius: f64,
}

/// Simulates `discs` hit points under a uniform irradiance of `expected` photons per first disc and pass, for `passes`.
pub fn uniform(expected: f64, passes: u64, alpha: f64, faults: Faults, discs: u64, key: Key) -> Uniform {
    let (mut ratio, mut highest, mut radius) = (Moments::default(), 0.0f64, Moments::default());
    for disc in 0..discs {
        let mut random = PathRandom::new(key.child(disc));
        let mut point = HitPoint::default();
        for pass in 1..=passes {
            let found = poisson(expected * point.radius_squared, &mut random);
            // in units of the flux that a first disc gets in a pass
            point.update(found, found / expected, pass as f64, alpha, faults);
        }
        ratio.push(point.shown);
        highest = highest.max(point.shown);
        radius.push(point.radius());
    }
    Uniform { ratio, highest, radius: radius.mean }
}

/// Draws a Poisson variable of a small mean: exponential waiting times, as products of uniform numbers (Knuth).
fn poisson(mean: f64, random: &mut PathRandom) -> f64 {
    let end = libm::exp(-mean);
    let (mut product, mut count) = (random.uniform(), 0.0);
    while product > end {
        product *= random.uniform();
        count += 1.0;
    }
    count
}
