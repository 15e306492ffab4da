//! Extrapolation from a few small passes of a method, its trial, to its passes of full size.

/// Size of a trial's passes, and that of the method's own passes for the requested accuracy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrialPasses {
    /// Size of the trial's pass: its number of photons, or of other samples whose number grows with the accuracy.
    pub tried: f64,
    /// Size of the method's own pass.
    pub size: f64,
    /// Powers of the size by which work and variance of a pass grow.
    pub powers: Powers,
    /// True where the method sizes its passes by a trial in the room, so that these sizes are those of an average room alone.
    pub by_room: bool,
    /// Factor of the variance of a pass by noise, relative to the trial's pass, where the kernels of the trial are wider.
    pub variance_of_kernels: f64,
    /// Squared bias of the kernels, relative to that of the trial's pass.
    pub squared_bias: f64,
    /// Exponent `alpha` of `photon_map::progressive` by which gather radii shrink; `None` where they do not.
    pub alpha: Option<f64>,
}

/// Powers of the size of a pass by which its work and variance grow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Powers {
    /// Power of the work that does not depend on the number of sensors or pixels.
    pub work_of_pass: f64,
    /// Power of the work for each sensor or pixel.
    pub work_of_place: f64,
    /// Power of the variance by noise that is independent between sensors or pixels.
    pub variance: f64,
    /// Power of the variance by noise that all sensors or pixels have in common, that of photons which serve them all.
    pub shared_variance: f64,
}

impl Powers {
    /// Powers of passes that consist of photons alone: twice as many are twice the work and half the variance.
    pub const OF_PHOTONS: Self = Self { work_of_pass: 1.0, work_of_place: 1.0, variance: -1.0, shared_variance: -1.0 };

    /// Returns the powers of passes whose every part grows with this power of the accuracy, so that the same number of passes is enough at
    /// every accuracy.
    pub fn of_growth(growth: f64) -> Self {
        let variance = -2.0 / growth;
        Self { variance, shared_variance: variance, ..Self::OF_PHOTONS }
    }
}

/// Ratios of a method's passes to its trial's passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ratios {
    /// Work of a pass that does not depend on the number of sensors or pixels.
    pub work_of_pass: f64,
    /// Work of a pass for each sensor or pixel.
    pub work_of_place: f64,
    /// Variance of a pass by noise that is independent between sensors or pixels.
    pub variance: f64,
    /// Variance of a pass by noise that all sensors or pixels have in common.
    pub shared_variance: f64,
    /// Squared bias of the kernels.
    pub squared_bias: f64,
}

/// Fewest and most photons of a trial's pass: it takes some milliseconds at most.
const LEAST_PHOTONS: u64 = 64;
const MOST_PHOTONS: u64 = 4096;

impl TrialPasses {
    /// Trial with the method's own passes, which are the same for every accuracy.
    pub const WHOLE: Self = Self {
        tried: 1.0,
        size: 1.0,
        powers: Powers::OF_PHOTONS,
        by_room: false,
        variance_of_kernels: 1.0,
        squared_bias: 1.0,
        alpha: None,
    };

    /// Makes a trial of passes of full size, which the method chooses in the room about this usual `size`.
    pub fn of_size(size: f64, powers: Powers) -> Self {
        Self { tried: size, size, powers, by_room: true, ..Self::WHOLE }
    }

    /// Makes a trial of passes with `tried` photons, where the method's own have `photons`.
    pub fn of_photons(tried: u64, photons: u64, powers: Powers) -> Self {
        Self { tried: tried as f64, size: photons as f64, powers, ..Self::WHOLE }
    }

    /// Returns the number of photons of a trial's pass of a method that emits `photons` in each: about `fraction` of them.
    pub fn fewer(photons: u64, fraction: f64) -> u64 {
        ((photons as f64 * fraction) as u64).clamp(LEAST_PHOTONS, MOST_PHOTONS).min(photons)
    }

    /// Returns the ratios of work and errors of the method's own passes to those of passes of the size `tried`.
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
