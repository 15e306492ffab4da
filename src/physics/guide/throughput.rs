//! Light of one kind through a tube: estimated in independent replicates, by as many rays as it takes, or known in closed form.

use glam::DVec3;

use super::{End, Guide};
use crate::optics::Spectrum;
use crate::sampling::sobol::REPLICATE_LEN;
use crate::sampling::{Key, PathRandom, Replicate, Stream};
use crate::statistics::Moments;

/// Independent replicates of each figure.
pub const REPLICATES: u64 = 8;

/// Share of the light that rays leave open which all agree, times their number: what happens to a share of 3 / N, N rays miss 5 times in
/// 100, and that is 1.96 standard errors.
const OPEN: f64 = 1.53;

/// More rays after a look at the error, over those before: at least, so that looks are few (the more, the likelier one finds an
/// error that is small by chance), and at most, because an error of few rays is known roughly.
const MORE_RAYS: [f64; 2] = [1.25, 2.0];

/// Rays that go down a guide together, about.
const AT_ONCE: usize = 64;

/// Rays that are followed for a figure: in each of 8 replicates `least`, and then as many as the error lets expect, again and again until
/// the standard error of the transmission is at most `standard_error`, or `most` are followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Standard error of the transmission that is enough, >= 0.
    pub standard_error: f64,
    /// Fewest rays of a replicate, > 0.
    pub least: u64,
    /// Most rays of a replicate.
    pub most: u64,
}

/// That number of rays in each replicate.
impl From<u64> for Effort {
    fn from(rays: u64) -> Self {
        Self { standard_error: 0.0, least: rays, most: rays }
    }
}

/// A ratio of two estimated quantities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transmission {
    /// 0..=1; zero when nothing arrives at the collector.
    pub value: f64,
    /// Standard error of the ratio to first order, from the replicates.
    pub standard_error: f64,
}

impl Transmission {
    /// Transmission of lights together that were followed by rays of their own, with the error of a ratio of means.
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

    /// With the share that a number of rays leaves open.
    fn of_rays(self, rays: Option<u64>) -> Self {
        let open = rays.filter(|rays| *rays > 0).map_or(0.0, |rays| OPEN / rays as f64);
        Self { standard_error: self.standard_error.max(open), ..self }
    }
}

/// Light of one kind through a tube: what reaches the collector from outside and what arrives at the diffuser's top, per
/// replicate. Of a beam of 1 lx these are effective areas in m2, of a sky fluxes in lm.
#[derive(Clone, Debug)]
pub struct Throughput {
    replicates: Vec<(f64, f64)>,
    /// Rays in all; `None` of a closed form.
    rays: Option<u64>,
}

impl Throughput {
    /// Light that is known without rays.
    pub(super) fn exact(entering: f64, arriving: f64) -> Self {
        Self { replicates: vec![(entering, arriving); REPLICATES as usize], rays: None }
    }

    /// No light, yet.
    pub(super) fn nothing() -> Self {
        Self::exact(0.0, 0.0)
    }

    /// Light that reaches the collector.
    pub fn entering(&self) -> Moments {
        self.moments(|(entering, _)| entering)
    }

    /// Light that arrives at the diffuser's top.
    pub fn arriving(&self) -> Moments {
        self.moments(|(_, arriving)| arriving)
    }

    /// Ratio of the light that arrives to the light that enters, with the error of a ratio of means. Rays that all agree may be few: N of
    /// them leave a share of about 1.5 / N open.
    pub fn transmission(&self) -> Transmission {
        Transmission::of_all(&[self])
    }

    /// What arrives beside the share `transmission` of what enters.
    fn residuals(&self, transmission: f64) -> Moments {
        self.moments(|(entering, arriving)| arriving - transmission * entering)
    }

    fn moments(&self, of: impl Fn((f64, f64)) -> f64) -> Moments {
        let mut moments = Moments::default();
        self.replicates.iter().for_each(|replicate| moments.push(of(*replicate)));
        moments
    }

    /// Weighted sum of replicates that were drawn with independent keys.
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

/// A ray to a collector.
pub(super) struct Aim<const N: usize> {
    /// Point of the unit square for the place where it enters.
    pub point: [f64; 2],
    /// Unit vector to where it comes from.
    pub toward: DVec3,
    /// Illuminance in lx across the ray that it stands for, in each of the figures.
    pub weights: [f64; N],
}

/// Rays that are followed for `N` figures at once, more and more of them.
pub(super) struct Rays<const N: usize> {
    key: Key,
    /// Of each replicate its choices, and the sums of what enters and arrives.
    replicates: Vec<(PathRandom, [(f64, f64); N])>,
    /// Rays of each replicate so far.
    count: u64,
}

impl<const N: usize> Rays<N> {
    /// None, yet, of 8 replicates.
    pub(super) fn new(key: Key) -> Self {
        let choices = |number| PathRandom::new(key.child(number).stream(Stream::ThroughputChoices, 0));
        Self { key, replicates: (0..REPLICATES).map(|number| (choices(number), [(0.0, 0.0); N])).collect(), count: 0 }
    }

    /// The means over the rays so far.
    pub(super) fn throughputs(&self) -> [Throughput; N] {
        let count = self.count.max(1) as f64;
        let mean = |(entering, arriving): (f64, f64)| (entering / count, arriving / count);
        std::array::from_fn(|figure| Throughput {
            replicates: self.replicates.iter().map(|(_, sums)| mean(sums[figure])).collect(),
            rays: Some(self.replicates.len() as u64 * self.count),
        })
    }

    /// The largest standard error of their transmissions.
    pub(super) fn standard_error(&self) -> f64 {
        self.throughputs().iter().map(|found| found.transmission().standard_error).fold(0.0, f64::max)
    }
}

/// Follows rays of several kinds, equally many so far, through a guide until each replicate of each has `count`: `aim` makes one of the
/// number of its kind and a Sobol point.
pub(super) fn follow<const N: usize>(
    guide: &Guide,
    kinds: &mut [Rays<N>],
    count: u64,
    aim: impl Fn(usize, [f64; 4]) -> Aim<N>,
) {
    debug_assert!(count <= REPLICATE_LEN, "{count} rays are more than one randomisation has");
    let mut done = kinds.first().map_or(count, |rays| rays.count);
    // rays of all replicates side by side, some at a time
    let at_once = (AT_ONCE / (kinds.len() * REPLICATES as usize).max(1)).max(1) as u64;
    let mut aimed = Vec::with_capacity(2 * AT_ONCE);
    while done < count {
        let rays = done..(done + at_once).min(count);
        aimed.clear();
        for (kind, Rays { key, .. }) in kinds.iter().enumerate() {
            for number in 0..REPLICATES {
                let stream = key.child(number);
                for ray in rays.clone() {
                    let (replicate, index) = Replicate::of(stream, ray);
                    let aim = aim(kind, replicate.point(index, 0));
                    let entry = guide.entry(aim.point, -aim.toward);
                    aimed.extend(entry.map(|entry| (kind, number as usize, aim, entry)));
                }
            }
        }
        let entering: Vec<_> = aimed.iter().map(|(_, _, aim, entry)| (entry.position, -aim.toward)).collect();
        let mut ways = guide.down_together::<3>(&entering).map(Vec::into_iter);
        for (kind, number, aim, entry) in &aimed {
            let (random, sums) = &mut kinds[*kind].replicates[*number];
            let way = ways.as_mut().and_then(Iterator::next);
            let way = way.unwrap_or_else(|| guide.down(entry.position, -aim.toward, random));
            if !way.entered {
                continue;
            }
            let share = if way.end == End::Opening { Spectrum::luminance(&way.weight()) } else { 0.0 };
            for (sum, weight) in sums.iter_mut().zip(aim.weights) {
                sum.0 += weight * entry.projected_area_m2;
                sum.1 += weight * entry.projected_area_m2 * share;
            }
        }
        done = rays.end;
        kinds.iter_mut().for_each(|rays| rays.count = done);
    }
}

/// The numbers of rays of a replicate after which `effort` looks at the error: `look` follows as many and answers it.
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

/// Means over rays of what `aim` makes of a Sobol point.
pub(super) fn replicated<const N: usize>(
    guide: &Guide,
    key: Key,
    effort: Effort,
    aim: impl Fn([f64; 4]) -> Aim<N>,
) -> [Throughput; N] {
    let mut rays = [Rays::new(key)];
    until_exact(effort, |count| {
        follow(guide, &mut rays, count, |_, point| aim(point));
        // rays that are wanted in any case need no judgement
        if effort.least < effort.most { rays[0].standard_error() } else { 0.0 }
    });
    rays[0].throughputs()
}
