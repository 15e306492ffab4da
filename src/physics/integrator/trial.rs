//! What a few small passes of a method tell of its own.

/// Passes of a trial, and those of the method itself for the accuracy that is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrialPasses {
    /// Size of the trial's pass: its photons, or what else grows with the accuracy.
    pub tried: f64,
    /// Size of the method's own pass.
    pub size: f64,
    /// How passes go with their size.
    pub powers: Powers,
    /// Variance of a pass by noise, in that of the trial's pass, where the kernels of the trial are wider.
    pub variance_of_kernels: f64,
    /// Squared bias of the kernels, in that of the trial's pass.
    pub squared_bias: f64,
    /// Where gather radii shrink: `alpha` of `photon_map::progressive`.
    pub alpha: Option<f64>,
}

/// Powers of the size of a pass by which it goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Powers {
    /// Of the work that does not depend on the number of sensors or pixels.
    pub work_of_pass: f64,
    /// Of the work for each sensor or pixel.
    pub work_of_place: f64,
    /// Of the variance by the noise that each sensor or pixel has of its own.
    pub variance: f64,
    /// Of the variance by the noise that all have in common, that of photons which serve them all.
    pub shared_variance: f64,
}

impl Powers {
    /// Photons are all that there is: twice as many are twice the work and half the variance.
    pub const OF_PHOTONS: Self = Self { work_of_pass: 1.0, work_of_place: 1.0, variance: -1.0, shared_variance: -1.0 };

    /// All that a pass has grows with this power of the accuracy, so that as many passes are enough at every accuracy.
    pub fn of_growth(growth: f64) -> Self {
        let variance = -2.0 / growth;
        Self { variance, shared_variance: variance, ..Self::OF_PHOTONS }
    }
}

/// What passes of a method have in that of its trial's passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ratios {
    /// Work of a pass that does not depend on the number of sensors or pixels.
    pub work_of_pass: f64,
    /// Work of a pass for each sensor or pixel.
    pub work_of_place: f64,
    /// Variance of a pass by the noise that each sensor or pixel has of its own.
    pub variance: f64,
    /// Variance of a pass by the noise that all have in common.
    pub shared_variance: f64,
    /// Squared bias of the kernels.
    pub squared_bias: f64,
}

/// Fewest and most photons of a trial's pass: some milliseconds at most.
const LEAST_PHOTONS: u64 = 64;
const MOST_PHOTONS: u64 = 4096;

impl TrialPasses {
    /// The method's own passes, which are the same for every accuracy.
    pub const WHOLE: Self = Self {
        tried: 1.0,
        size: 1.0,
        powers: Powers::OF_PHOTONS,
        variance_of_kernels: 1.0,
        squared_bias: 1.0,
        alpha: None,
    };

    /// Passes of their whole size.
    pub fn of_size(size: f64, powers: Powers) -> Self {
        Self { tried: size, size, powers, ..Self::WHOLE }
    }

    /// Passes with `tried` photons of `photons`.
    pub fn of_photons(tried: u64, photons: u64, powers: Powers) -> Self {
        Self { tried: tried as f64, size: photons as f64, powers, ..Self::WHOLE }
    }

    /// Photons of a trial's pass of a method that emits `photons` in each: about a `share` of them.
    pub fn fewer(photons: u64, share: f64) -> u64 {
        ((photons as f64 * share) as u64).clamp(LEAST_PHOTONS, MOST_PHOTONS).min(photons)
    }

    /// What the method's own passes have in that of passes of a size `tried`.
    pub fn ratios(&self, tried: f64) -> Ratios {
        let to = |power: f64| libm::pow(self.size / tried, power);
        Ratios {
            work_of_pass: to(self.powers.work_of_pass),
            work_of_place: to(self.powers.work_of_place),
            variance: to(self.powers.variance) * self.variance_of_kernels,
            shared_variance: to(self.powers.shared_variance) * self.variance_of_kernels,
            squared_bias: self.squared_bias,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_of_another_size_are_foretold_by_powers() {
        let whole = TrialPasses::WHOLE.ratios(1.0);
        assert_eq!(
            [whole.work_of_pass, whole.work_of_place, whole.variance, whole.shared_variance, whole.squared_bias],
            [1.0; 5]
        );
        // half the error by passes 2^1.6 times as large, which have a quarter of the variance
        let larger = TrialPasses::of_size(libm::exp2(1.6), Powers::of_growth(1.6)).ratios(1.0);
        assert!((larger.variance - 0.25).abs() < 1e-15 && larger.work_of_place == libm::exp2(1.6), "{larger:?}");
        let photons = 1 << 14;
        let smaller = TrialPasses::of_photons(TrialPasses::fewer(photons, 0.5), photons, Powers::OF_PHOTONS);
        assert_eq!(smaller.tried, 4096.0);
        let ratios = smaller.ratios(4096.0);
        assert_eq!([ratios.work_of_pass, ratios.work_of_place], [4.0, 4.0]);
        assert_eq!([ratios.variance, ratios.squared_bias], [0.25, 1.0]);
        // passes of half the size were tried instead
        assert_eq!(smaller.ratios(2048.0).shared_variance, 0.125);
    }
}
