//! Law by which the error of a job falls with its passes, predicted from the few passes of a pilot.
//!
//! The variance of a job's mean after n passes has up to four parts, relative to the values and averaged over sensors or blocks of pixels.
//! Noise falls as 1 / n; where gather radii shrink, as the mean of their inverse squares over n passes, divided by n. The bias of kernels
//! stays, or falls as the mean of the squared radii. The error by the choice of fixed points stays. The job adds the square of its
//! estimated bias, less the variance of this estimate, if that is above zero: an uncertain estimate therefore adds to the error, too. Noise
//! of a residual that sensors share remains as far as the job counts it, with the degrees of freedom that it has. Docs:
//! docs/physics/statistics.md#what-a-pilot-foretells.

use super::spread::Sharing;
use super::stopping::{USUAL_PASSES, next_judgement};
use crate::integrator::pass::LEAST_SHARE_OF_MEAN;
use crate::integrator::photon_map::progressive::Radii;
use crate::integrator::trial::Ratios;
use crate::statistics::interval::{student_quantile_near, two_sided_normal_quantile};

/// Settings by which a job judges its errors.
#[derive(Clone, Copy, Debug)]
pub struct Judged {
    /// Confidence of errors and intervals, 0..1.
    pub confidence: f64,
    /// Number of passes below which an error is not trusted.
    pub least_passes: u64,
}

/// Law by which the relative standard error of an output falls with the passes of a job, estimated from a pilot's passes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ErrorLaw {
    /// Relative variance of one pass by noise, averaged over sensors or blocks; of the first pass if radii shrink.
    pub noise: f64,
    /// Relative variance of one pass by the residuals of sensors, each by itself; not part of `noise`.
    pub residual: f64,
    /// Sensors that share these residuals.
    pub sharing: Sharing,
    /// Standard deviation of the logarithm of the variance by noise and residuals.
    pub noise_deviation: f64,
    /// Relative squared bias of the first pass, averaged over sensors or blocks.
    pub squared_bias: f64,
    /// Standard deviation of `squared_bias`.
    pub bias_deviation: f64,
    /// Relative variance of the bias as estimated by one pass.
    pub bias_noise: f64,
    /// Relative variance by the choice of fixed points.
    pub fixed: f64,
    /// Exponent `alpha` of [`Radii`], if gather radii shrink.
    pub alpha: Option<f64>,
}

/// Results of the passes of a pilot at its places, which are sensors or blocks of pixels.
pub struct PilotResults<'a> {
    /// Values of the places, for every pass.
    pub values: &'a [Vec<f64>],
    /// Estimated bias of the places, for every pass; empty lists for unbiased methods.
    pub bias: &'a [Vec<f64>],
    /// Variance of each place by the choice of fixed points; empty without fixed points.
    pub fixed: &'a [f64],
    /// Residuals of the places, for every pass, which are not part of the values; empty lists, or none, without them.
    pub residual: &'a [Vec<f64>],
    /// Sensors that share these residuals.
    pub sharing: Sharing,
    /// Fraction of all places that the pilot computed, up to 1.
    pub fraction: f64,
}

/// Standard deviation of the logarithm of a variance that is predicted from smaller passes.
const OF_SMALLER_PASSES: f64 = 0.25;

/// Number of standard deviations by which an estimated squared bias must lie above zero to count: below it may be noise alone.
const SIGNIFICANT: f64 = 2.0;

/// Number of passes above which an error counts as out of reach.
const MOST_PASSES: u64 = 1_000_000_000;

/// Means and variances over passes, relative to the mean values.
#[derive(Clone, Copy, Default)]
struct Relative {
    noise: f64,
    /// Part of `noise` that all places have in common.
    shared: f64,
    residual: f64,
    squared_bias: f64,
    bias_noise: f64,
    fixed: f64,
    /// Standard error of `noise` by its spread over the places, relative to `noise`.
    spread: f64,
}

impl Relative {
    /// Computes the moments of all passes but `left_out`.
    fn of(found: &PilotResults<'_>, left_out: Option<usize>, alpha: Option<f64>) -> Self {
        let kept = || (0..found.values.len()).filter(move |pass| Some(*pass) != left_out);
        let passes = kept().count() as f64;
        let places = found.values.first().map_or(0, Vec::len);
        let moments = |of: &[Vec<f64>], place: usize| {
            let mean = kept().map(|pass| of[pass][place]).sum::<f64>() / passes;
            let squares: f64 = kept().map(|pass| (of[pass][place] - mean).powi(2)).sum();
            (mean, squares / (passes - 1.0))
        };
        let values: Vec<(f64, f64)> = (0..places).map(|place| moments(found.values, place)).collect();
        let least = LEAST_SHARE_OF_MEAN * values.iter().map(|(mean, _)| mean).sum::<f64>() / places as f64;
        let fraction = |variance: f64, place: usize| match values[place].0.max(least) {
            scale if scale > 0.0 => variance / (scale * scale),
            _ => 0.0,
        };
        let mean = |of: &dyn Fn(usize) -> f64| (0..places).map(of).sum::<f64>() / places as f64;
        let noise = mean(&|place| fraction(values[place].1, place));
        let deviations = mean(&|place| (fraction(values[place].1, place) - noise).powi(2));
        let spread = if noise > 0.0 { (deviations / places as f64).sqrt() / noise } else { 0.0 };
        // relative to the radius of the first pass
        let radii = |pass: usize| alpha.map_or(1.0, |alpha| Radii::square(pass as f64, alpha));
        let inverse = kept().map(|pass| 1.0 / radii(pass)).sum::<f64>() / passes;
        let square = kept().map(radii).sum::<f64>() / passes;
        let deviation = |pass: usize, place: usize| match values[place].0.max(least) {
            scale if scale > 0.0 => (found.values[pass][place] - values[place].0) / scale,
            _ => 0.0,
        };
        let of_means: f64 = kept().map(|pass| mean(&|place| deviation(pass, place)).powi(2)).sum();
        let shared = shared_part(noise, of_means / (passes - 1.0), places);
        let mut relative = Self { noise: noise / inverse, shared: shared / inverse, spread, ..Self::default() };
        let are_given = |lists: &[Vec<f64>]| {
            places > 0 && lists.len() == found.values.len() && lists.iter().all(|list| list.len() == places)
        };
        if are_given(found.residual) {
            relative.residual = mean(&|place| fraction(moments(found.residual, place).1, place)) / inverse;
        }
        if are_given(found.bias) {
            let bias: Vec<(f64, f64)> = (0..places).map(|place| moments(found.bias, place)).collect();
            let without_noise = |place: usize| fraction(bias[place].0.powi(2) - bias[place].1 / passes, place);
            relative.squared_bias = mean(&without_noise) / (square * square);
            relative.bias_noise = mean(&|place| fraction(bias[place].1, place)) / inverse;
        }
        if found.fixed.len() == places {
            relative.fixed = mean(&|place| fraction(found.fixed[place], place)).max(0.0);
        }
        relative
    }
}

/// Returns the part of a mean variance `noise` of a number of places that all of them have in common, from the variance `of_mean` of their
/// mean, to which each place's own noise contributes one part in `places`. For a single place it is 0, because the parts cannot be
/// separated.
pub fn shared_part(noise: f64, of_mean: f64, places: usize) -> f64 {
    if places < 2 {
        return 0.0;
    }
    let places = places as f64;
    ((places * of_mean - noise) / (places - 1.0)).clamp(0.0, noise.max(0.0))
}

impl ErrorLaw {
    /// Estimates the law of a method's own passes from the passes of its trial, with the ratios between the two; `None` with fewer than
    /// three passes. Deviations are those of leaving out one pass after the other (the jackknife), and of the places that the pilot did not
    /// compute. `alpha` is given if gather radii shrink.
    pub fn of(found: &PilotResults<'_>, ratios: &Ratios, alpha: Option<f64>) -> Option<Self> {
        let passes = found.values.len();
        if passes < 3 || found.values.first().is_none_or(Vec::is_empty) {
            return None;
        }
        let all = Relative::of(found, None, alpha);
        let without: Vec<_> = (0..passes).map(|pass| Relative::of(found, Some(pass), alpha)).collect();
        let jackknife = |of: &dyn Fn(&Relative) -> f64| {
            let mean = without.iter().map(of).sum::<f64>() / passes as f64;
            let squares: f64 = without.iter().map(|relative| (of(relative) - mean).powi(2)).sum();
            (squares * (passes - 1) as f64 / passes as f64).sqrt()
        };
        let law = |relative: &Relative| Self {
            noise: (relative.noise - relative.shared) * ratios.variance + relative.shared * ratios.shared_variance,
            residual: relative.residual * ratios.variance,
            sharing: found.sharing,
            alpha,
            ..Self::default()
        };
        let noise = |relative: &Relative| law(relative).by_passes(USUAL_PASSES as f64).iter().sum::<f64>();
        let by_passes = jackknife(&|relative| libm::log(noise(relative).max(f64::MIN_POSITIVE)));
        let by_places = all.spread * (1.0 - found.fraction.min(1.0)).sqrt();
        let by_size = if ratios.variance == 1.0 && ratios.shared_variance == 1.0 { 0.0 } else { OF_SMALLER_PASSES };
        let bias_deviation = jackknife(&|relative| relative.squared_bias);
        let is_significant = all.squared_bias > SIGNIFICANT * bias_deviation;
        let law = Self {
            noise_deviation: libm::hypot(libm::hypot(by_passes, by_places), by_size),
            squared_bias: if is_significant { all.squared_bias * ratios.squared_bias } else { 0.0 },
            bias_deviation: bias_deviation * ratios.squared_bias,
            bias_noise: all.bias_noise * ratios.shared_variance,
            fixed: all.fixed,
            ..law(&all)
        };
        [law.noise, law.residual, law.squared_bias, law.bias_noise, law.fixed]
            .iter()
            .all(|part| part.is_finite())
            .then_some(law)
    }

    /// Returns the variance of the mean of `passes` passes in units of that of one, and the mean of their squared radii.
    fn of_mean(&self, passes: f64) -> (f64, f64) {
        match self.alpha {
            None => (1.0 / passes, 1.0),
            Some(alpha) => (Radii::mean_inverse_square(passes, alpha) / passes, Radii::mean_square(passes, alpha)),
        }
    }

    /// Returns the parts of the squared error after `passes` passes that differ from pass to pass: by noise, by the own residuals of
    /// sensors, and by the residual that they share.
    fn by_passes(&self, passes: f64) -> [f64; 3] {
        let [own, shared] = self.sharing.predicted_variances(self.residual, passes);
        [self.noise * self.of_mean(passes).0, own, shared]
    }

    /// Returns the relative standard error that a job estimates after `passes` passes, at least 2, averaged over its seeds.
    pub fn standard_error(&self, passes: f64) -> f64 {
        let (noise, square) = self.of_mean(passes);
        let bias = reported_square(self.squared_bias.max(0.0) * square * square, self.bias_noise * noise);
        (self.by_passes(passes).iter().sum::<f64>() + self.fixed + bias).sqrt()
    }

    /// Returns the degrees of freedom of this error after `passes` passes, at least 2, by Welch and Satterthwaite as a job computes them.
    pub fn degrees_of_freedom(&self, passes: f64) -> f64 {
        let [noise, own, shared] = self.by_passes(passes);
        let of_passes = passes - 1.0;
        if self.residual <= 0.0 {
            return of_passes;
        }
        of_passes * (noise + own + shared).powi(2) / (noise * noise + own * own)
    }

    /// Returns the law with its uncertain parts shifted by `deviations` times their standard deviations.
    pub fn shifted(&self, deviations: f64) -> Self {
        let scale = libm::exp(deviations * self.noise_deviation);
        Self {
            noise: self.noise * scale,
            residual: self.residual * scale,
            bias_noise: self.bias_noise * scale,
            squared_bias: (self.squared_bias + deviations * self.bias_deviation).max(0.0),
            ..*self
        }
    }

    /// Returns the number of passes after which a job would end that requests a relative error; `None` if it is out of reach.
    pub fn passes_to(&self, relative_error: f64, judged: Judged) -> Option<u64> {
        let z = two_sided_normal_quantile(judged.confidence);
        let error = |passes: u64| {
            let passes = passes as f64;
            student_quantile_near(z, self.degrees_of_freedom(passes)) * self.standard_error(passes)
        };
        let (mut below, mut enough) = (judged.least_passes, judged.least_passes.max(2));
        while error(enough) > relative_error {
            below = enough;
            enough *= 2;
            if enough > MOST_PASSES {
                return None;
            }
        }
        while enough > below + 1 {
            let middle = below + (enough - below) / 2;
            if error(middle) > relative_error { below = middle } else { enough = middle }
        }
        Some(next_judgement(enough))
    }
}

/// Returns the mean of the square of an estimated bias less the variance `noise` of that estimate, cut off below zero, for normal
/// deviations about the bias whose square is `square`.
///
/// With Z normal and b the bias in its standard deviations, E max((b + Z)^2 - 1, 0) is b^2 less the part between b + Z = -1 and 1.
fn reported_square(square: f64, noise: f64) -> f64 {
    if noise <= 0.0 {
        return square;
    }
    let bias = (square / noise).sqrt();
    let (from, to) = (-1.0 - bias, 1.0 - bias);
    let density = |z: f64| libm::exp(-0.5 * z * z) / (2.0 * std::f64::consts::PI).sqrt();
    let below = |z: f64| 0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2);
    let between =
        bias * bias * (below(to) - below(from)) + 2.0 * bias * (density(from) - density(to)) + from * density(from)
            - to * density(to);
    (noise * (bias * bias - between)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::trial::TrialPasses;
    use crate::sampling::{Key, PathRandom};
    use crate::statistics::Moments;
    use crate::statistics::interval::two_sided_student_quantile;

    const JUDGED: Judged = Judged { confidence: 0.95, least_passes: 8 };

    const NOTHING_ELSE: PilotResults<'static> = PilotResults {
        values: &[],
        bias: &[],
        fixed: &[],
        residual: &[],
        sharing: Sharing { sensors: 0, expected_spread: None },
        fraction: 1.0,
    };

    fn normal(random: &mut PathRandom) -> f64 {
        let [u, v] = random.uniform2();
        (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }

    #[test]
    fn noise_alone_takes_the_passes_that_a_job_takes() {
        let law = ErrorLaw { noise: 0.04, ..ErrorLaw::default() };
        for accuracy in [0.5, 0.05, 0.01, 0.001] {
            let error =
                |passes: u64| two_sided_student_quantile(0.95, passes as f64 - 1.0) * 0.2 / (passes as f64).sqrt();
            let needed = (8..).find(|passes| error(*passes) <= accuracy).unwrap();
            let predicted = law.passes_to(accuracy, JUDGED).unwrap();
            // the expansion of Student's quantile is right to 0.4 %
            assert!(predicted >= next_judgement(needed - needed / 100) && predicted <= next_judgement(needed + 1));
        }
        assert_eq!(law.passes_to(0.5, JUDGED), Some(8));
        let few = Judged { least_passes: 32, ..JUDGED };
        assert_eq!(law.passes_to(0.5, few), Some(next_judgement(32)));
    }

    /// Checks by hand: half of the variance by noise, and a residual that a million equal sensors share all but wholly, have the degrees of
    /// freedom of the passes and of many; two equal parts that are not shared have twice those of the passes.
    #[test]
    fn what_sensors_share_has_many_degrees_of_freedom() {
        let sharing = |sensors: usize| Sharing { sensors, expected_spread: Some(0.0) };
        let law = ErrorLaw { noise: 0.04, residual: 0.04, sharing: sharing(1), ..ErrorLaw::default() };
        assert!((law.degrees_of_freedom(9.0) - 16.0).abs() < 1e-12);
        assert!((law.standard_error(8.0) - 0.1).abs() < 1e-12);
        let shared = ErrorLaw { sharing: sharing(1_000_000), ..law };
        assert!((shared.degrees_of_freedom(9.0) / 8.0 - 1.0).abs() < 0.01, "{}", shared.degrees_of_freedom(9.0));
        assert!((shared.standard_error(8.0) / 0.005f64.sqrt() - 1.0).abs() < 0.01);
        assert!(shared.passes_to(0.05, JUDGED) < law.passes_to(0.05, JUDGED));
        let alone = ErrorLaw { residual: 0.0, ..law };
        assert_eq!(alone.degrees_of_freedom(9.0), 8.0);
    }

    #[test]
    fn what_no_pass_brings_down_is_never_reached() {
        let fixed = ErrorLaw { noise: 1e-4, fixed: 1e-4, ..ErrorLaw::default() };
        let biased = ErrorLaw { noise: 1e-4, squared_bias: 1e-4, ..ErrorLaw::default() };
        for law in [fixed, biased] {
            assert_eq!(law.passes_to(0.0195, JUDGED), None);
            assert!(law.passes_to(0.0205, JUDGED).is_some());
        }
        // an uncertain bias may be larger, too
        let uncertain = ErrorLaw { noise: 1e-4, bias_deviation: 1e-4, ..ErrorLaw::default() };
        assert!(uncertain.passes_to(0.001, JUDGED).is_some());
        assert_eq!(uncertain.shifted(2.0).passes_to(0.001, JUDGED), None);
    }

    /// With alpha 2/3 noise and bias both fall as the cube root of the passes in the end.
    #[test]
    fn shrinking_radii_have_their_exponent() {
        let alpha = 2.0 / 3.0;
        for law in [
            ErrorLaw { noise: 1.0, alpha: Some(alpha), ..ErrorLaw::default() },
            ErrorLaw { squared_bias: 1.0, alpha: Some(alpha), ..ErrorLaw::default() },
        ] {
            let exponent = (law.standard_error(8e6) / law.standard_error(1e6)).ln() / 8f64.ln();
            assert!((exponent + 1.0 / 3.0).abs() < 0.005, "{exponent}");
        }
    }

    /// Mean square that a job adds for a bias: 400 000 normal deviations, within 4 of their standard errors.
    #[test]
    fn the_square_of_an_uncertain_bias_is_what_a_job_adds() {
        let mut random = PathRandom::new(Key::new(3));
        for bias in [0.0, 0.3, 1.0, 2.5, 8.0] {
            let mut reported = Moments::default();
            for _ in 0..400_000 {
                reported.push(((bias + normal(&mut random)).powi(2) - 1.0).max(0.0));
            }
            let expected = reported_square(0.01 * bias * bias, 0.01) / 0.01;
            assert!(
                (reported.mean - expected).abs() < 4.0 * reported.standard_error(),
                "{bias}: {reported:?} {expected}"
            );
        }
        assert_eq!(reported_square(0.25, 0.0), 0.25);
    }

    /// Laws of normal passes, 6 at 20 places: the mean of the logarithm of the noise is right within 4 standard errors and its own bias, 1
    /// / (5 * 20), and intervals of 95 % contain it for that fraction of 300 seeds at least, within 4 standard errors.
    #[test]
    fn the_law_of_a_trial_is_as_certain_as_it_says() {
        let ratios = Ratios { variance: 0.5, shared_variance: 0.5, ..TrialPasses::WHOLE.ratios(1.0) };
        let (mut logarithms, mut held) = (Moments::default(), 0u32);
        for seed in 0..300 {
            let mut random = PathRandom::new(Key::new(seed));
            let pass = |random: &mut PathRandom| (0..20).map(|_| 10.0 + 2.0 * normal(random)).collect();
            let values: Vec<Vec<f64>> = (0..6).map(|_| pass(&mut random)).collect();
            let found = PilotResults { values: &values, bias: &vec![Vec::new(); 6], ..NOTHING_ELSE };
            let law = ErrorLaw::of(&found, &ratios, None).unwrap();
            assert_eq!((law.squared_bias, law.bias_noise, law.fixed), (0.0, 0.0, 0.0));
            let off = (law.noise / (0.04 * 0.5)).ln();
            logarithms.push(off);
            // the deviation added for smaller passes is not tested here
            let own = (law.noise_deviation.powi(2) - OF_SMALLER_PASSES.powi(2)).sqrt();
            held += u32::from(off.abs() < two_sided_student_quantile(0.95, 5.0) * own);
        }
        // the scale is the mean over the passes, whose variance is 0.04 / 6
        assert!(logarithms.mean.abs() < 4.0 * logarithms.standard_error() + 0.01 + 0.02, "{logarithms:?}");
        let tolerance = 4.0 * (0.95 * 0.05 / 300f64).sqrt();
        assert!(f64::from(held) / 300.0 > 0.95 - tolerance, "{held}");
    }

    /// Noise of 0.04 and 0.01, common to all of 12 places and of their own, in 2000 passes: each is estimated within 4 standard errors of
    /// about sqrt(2 / 2000) of the former; only the latter stays if the former falls by a hundred.
    #[test]
    fn noise_that_places_share_is_separated_from_their_own() {
        let mut random = PathRandom::new(Key::new(11));
        let mut law = |shared: f64, own: f64, ratios: &Ratios| {
            let pass = |random: &mut PathRandom| -> Vec<f64> {
                let common = shared * normal(random);
                (0..12).map(|_| 10.0 * (1.0 + common + own * normal(random))).collect()
            };
            let values: Vec<Vec<f64>> = (0..2000).map(|_| pass(&mut random)).collect();
            let found = PilotResults { values: &values, bias: &vec![Vec::new(); 2000], ..NOTHING_ELSE };
            ErrorLaw::of(&found, ratios, None).unwrap().noise
        };
        let ratios = Ratios { shared_variance: 0.01, ..TrialPasses::WHOLE.ratios(1.0) };
        let noise = law(0.2, 0.1, &ratios);
        assert!((noise - (0.01 + 0.0004)).abs() < 4.0 * 0.01 * (2.0 / 2000.0f64 / 12.0).sqrt() + 0.001, "{noise}");
        let own_alone = law(0.0, 0.1, &ratios);
        assert!((own_alone / 0.01 - 1.0).abs() < 0.03, "{own_alone}");
        assert_eq!(shared_part(0.05, 0.2, 1), 0.0);
        assert!((shared_part(0.05, 0.04 + 0.01 / 12.0, 12) - 0.04).abs() < 1e-15);
    }

    #[test]
    fn a_bias_counts_where_it_is_more_than_noise() {
        let ratios = Ratios { squared_bias: 0.0625, ..TrialPasses::WHOLE.ratios(1.0) };
        let mut random = PathRandom::new(Key::new(5));
        let mut law = |bias: f64| {
            let mut pass = |mean: f64| -> Vec<f64> { (0..30).map(|_| mean + 0.5 * normal(&mut random)).collect() };
            let (values, bias): (Vec<_>, Vec<_>) = (0..6).map(|_| (pass(10.0), pass(bias))).unzip();
            ErrorLaw::of(
                &PilotResults { values: &values, bias: &bias, fixed: &[0.01; 30], ..NOTHING_ELSE },
                &ratios,
                None,
            )
            .unwrap()
        };
        assert_eq!(law(0.0).squared_bias, 0.0);
        let clear = law(2.0);
        assert!((clear.squared_bias / (0.04 * 0.0625) - 1.0).abs() < 0.2, "{clear:?}");
        assert!((clear.fixed / 1e-4 - 1.0).abs() < 0.1);
        let two = PilotResults { values: &[vec![1.0], vec![2.0]], bias: &[Vec::new(), Vec::new()], ..NOTHING_ELSE };
        assert_eq!(ErrorLaw::of(&two, &ratios, None), None);
    }
}
