//! Throughput of light through a tube: estimated in independent replicates, with as many rays as the error requires, or exact.

use glam::DVec3;

use super::{End, Guide};
use crate::optics::Spectrum;
use crate::sampling::sobol::REPLICATE_LEN;
use crate::sampling::{Key, PathRandom, Replicate, Stream};
use crate::statistics::Moments;

/// Number of independent replicates of each result.
pub const REPLICATES: u64 = 8;

/// Standard error assigned to N rays that all agree, times N: N rays miss an event of probability 3 / N in 5 of 100 cases, and that is 1.96
/// standard errors.
const OPEN: f64 = 1.53;

/// Bounds of the growth factor of the number of rays between checks of the error: at least, so that checks are few (the more, the likelier
/// one finds an error that is small by chance), and at most, because the error of few rays is itself uncertain.
const MORE_RAYS: [f64; 2] = [1.25, 2.0];

/// Number of rays to trace: `least` in each of 8 replicates, then repeatedly as many more as the error suggests, until the standard error
/// of the transmission is at most `standard_error`, or `most` are traced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Sufficient standard error of the transmission, >= 0.
    pub standard_error: f64,
    /// Least number of rays per replicate, > 0.
    pub least: u64,
    /// Largest number of rays per replicate.
    pub most: u64,
}

/// Effort of a fixed number of rays per replicate.
impl From<u64> for Effort {
    fn from(rays: u64) -> Self {
        Self { standard_error: 0.0, least: rays, most: rays }
    }
}

/// Ratio of the light that arrives at the diffuser to the light that reaches the collector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transmission {
    /// Transmission, 0..=1; zero if no light reaches the collector.
    pub value: f64,
    /// Standard error of the ratio to first order, from the replicates and the number of rays.
    pub standard_error: f64,
}

impl Transmission {
    /// Computes the transmission of several lights together that were traced with separate rays, with the error of a ratio of means.
    pub(super) fn of_all(of: &[&Throughput]) -> Self {
        let sum = |part: fn(&Throughput) -> Moments| of.iter().map(|light| part(light).mean).sum::<f64>();
        let (entering, arriving) = (sum(Throughput::entering), sum(Throughput::arriving));
        if entering <= 0.0 {
            return Self { value: 0.0, standard_error: 0.0 };
        }
        let value = arriving / entering;
        let variance: f64 = of.iter().map(|light| light.residuals(value).standard_error().powi(2)).sum();
        let together = Self { value, standard_error: variance.sqrt() / entering };
        together.of_rays(of.iter().filter_map(|light| light.rays).reduce(|a, b| a + b))
    }

    /// Raises the standard error to the least that a number of rays can establish.
    fn of_rays(self, rays: Option<u64>) -> Self {
        let open = rays.filter(|rays| *rays > 0).map_or(0.0, |rays| OPEN / rays as f64);
        Self { standard_error: self.standard_error.max(open), ..self }
    }
}

/// Throughput of light through a tube: light that reaches the collector from outside and light that arrives at the diffuser's top, per
/// replicate. These are effective areas in m2 for a beam of 1 lx, and fluxes in lm for a sky.
#[derive(Clone, Debug)]
pub struct Throughput {
    replicates: Vec<(f64, f64)>,
    /// Total number of rays; `None` for a closed form.
    rays: Option<u64>,
}

impl Throughput {
    /// Returns a throughput without error, from a closed form.
    pub(super) fn exact(entering: f64, arriving: f64) -> Self {
        Self { replicates: vec![(entering, arriving); REPLICATES as usize], rays: None }
    }

    /// Returns a throughput of zero, to which others can be added.
    pub(super) fn nothing() -> Self {
        Self::exact(0.0, 0.0)
    }

    /// Returns mean and spread of the light that reaches the collector.
    pub fn entering(&self) -> Moments {
        self.moments(|(entering, _)| entering)
    }

    /// Returns mean and spread of the light that arrives at the diffuser's top.
    pub fn arriving(&self) -> Moments {
        self.moments(|(_, arriving)| arriving)
    }

    /// Returns the ratio of the light that arrives to the light that enters, with the error of a ratio of means. The error of N rays that
    /// all agree is about 1.5 / N.
    pub fn transmission(&self) -> Transmission {
        Transmission::of_all(&[self])
    }

    /// Returns the moments of the residuals: arriving light less `transmission` times entering light.
    fn residuals(&self, transmission: f64) -> Moments {
        self.moments(|(entering, arriving)| arriving - transmission * entering)
    }

    fn moments(&self, of: impl Fn((f64, f64)) -> f64) -> Moments {
        let mut moments = Moments::default();
        self.replicates.iter().for_each(|replicate| moments.push(of(*replicate)));
        moments
    }

    /// Adds another throughput times a factor; both must have independent keys.
    pub(super) fn add(&mut self, other: &Self, factor: f64) {
        for (sum, part) in self.replicates.iter_mut().zip(&other.replicates) {
            sum.0 += factor * part.0;
            sum.1 += factor * part.1;
        }
        self.rays = match (self.rays, other.rays) {
            (Some(a), Some(b)) => Some(a + b),
            (a, b) => a.or(b),
        };
    }
}

/// A ray to be traced from a collector.
pub(super) struct Aim<const N: usize> {
    /// Point of the unit square that selects the entry point.
    pub point: [f64; 2],
    /// Unit vector toward its origin.
    pub toward: DVec3,
    /// Illuminance in lx, normal to the ray, that it represents in each of the `N` results.
    pub weights: [f64; N],
}

/// State of rays that are traced for `N` results together, and can be continued.
pub(super) struct Rays<const N: usize> {
    key: Key,
    /// Random numbers of each replicate, and the sums of entering and arriving light.
    replicates: Vec<(PathRandom, [(f64, f64); N])>,
    /// Number of rays per replicate so far.
    count: u64,
}

impl<const N: usize> Rays<N> {
    /// Creates the state of 8 replicates without rays.
    pub(super) fn new(key: Key) -> Self {
        let choices = |number| PathRandom::new(key.child(number).stream(Stream::ThroughputChoices, 0));
        Self { key, replicates: (0..REPLICATES).map(|number| (choices(number), [(0.0, 0.0); N])).collect(), count: 0 }
    }

    /// Returns the means over the rays so far.
    pub(super) fn throughputs(&self) -> [Throughput; N] {
        let count = self.count.max(1) as f64;
        let mean = |(entering, arriving): (f64, f64)| (entering / count, arriving / count);
        std::array::from_fn(|figure| Throughput {
            replicates: self.replicates.iter().map(|(_, sums)| mean(sums[figure])).collect(),
            rays: Some(self.replicates.len() as u64 * self.count),
        })
    }

    /// Returns the largest standard error of the transmissions.
    pub(super) fn standard_error(&self) -> f64 {
        self.throughputs().iter().map(|found| found.transmission().standard_error).fold(0.0, f64::max)
    }
}

/// Traces rays of several kinds, which have equal counts so far, through a guide until each replicate of each has `count`; `aim` creates a
/// ray from the index of its kind and a Sobol point.
pub(super) fn follow<const N: usize>(
    guide: &Guide,
    kinds: &mut [Rays<N>],
    count: u64,
    aim: impl Fn(usize, [f64; 4]) -> Aim<N>,
) {
    debug_assert!(count <= REPLICATE_LEN, "{count} rays are more than one randomisation has");
    for (kind, Rays { key, replicates, count: done }) in kinds.iter_mut().enumerate() {
        for (number, (random, sums)) in replicates.iter_mut().enumerate() {
            let stream = key.child(number as u64);
            for ray in *done..count {
                let (replicate, index) = Replicate::of(stream, ray);
                let aim = aim(kind, replicate.point(index, 0));
                let Some(entry) = guide.entry(aim.point, -aim.toward) else { continue };
                let transit = guide.down(entry.position, -aim.toward, random);
                if !transit.entered {
                    continue;
                }
                let fraction =
                    if transit.end == End::Opening { Spectrum::<3>::luminance(&transit.weight()) } else { 0.0 };
                for (sum, weight) in sums.iter_mut().zip(aim.weights) {
                    sum.0 += weight * entry.projected_area_m2;
                    sum.1 += weight * entry.projected_area_m2 * fraction;
                }
            }
        }
        *done = count;
    }
}

/// Calls `look` with increasing numbers of rays per replicate, as `effort` requires; `look` traces as many and returns the standard error.
pub(super) fn until_exact(effort: Effort, mut look: impl FnMut(u64) -> f64) {
    let mut rays = effort.least.min(effort.most);
    loop {
        let error = look(rays);
        if error <= effort.standard_error || rays >= effort.most {
            break;
        }
        let [least, most] = MORE_RAYS;
        let factor = (error / effort.standard_error).powi(2).clamp(least, most);
        rays = ((rays as f64 * factor).ceil() as u64).min(effort.most);
    }
}

/// Computes throughputs by tracing rays that `aim` creates from Sobol points.
pub(super) fn replicated<const N: usize>(
    guide: &Guide,
    key: Key,
    effort: Effort,
    aim: impl Fn([f64; 4]) -> Aim<N>,
) -> [Throughput; N] {
    let mut rays = [Rays::new(key)];
    until_exact(effort, |count| {
        follow(guide, &mut rays, count, |_, point| aim(point));
        // the error need not be computed if the number of rays is fixed
        if effort.least < effort.most { rays[0].standard_error() } else { 0.0 }
    });
    rays[0].throughputs()
}
