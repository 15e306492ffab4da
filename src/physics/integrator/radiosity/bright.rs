//! Patches that are much brighter than most, at which rays are aimed: few would meet them by chance.

use glam::DVec3;

/// Luminance from which on a patch is bright, in that of the mean.
const BRIGHT: f64 = 4.0;

/// Share of rays that are aimed, at most.
const MOST_AIMED: f64 = 0.5;

/// A parallelogram that reflects.
#[derive(Clone, Copy, Debug)]
pub struct Area {
    pub corner: DVec3,
    pub edges: [DVec3; 2],
}

impl Area {
    /// In m2.
    pub fn area_m2(&self) -> f64 {
        self.edges[0].cross(self.edges[1]).length()
    }
}

/// Bright patches, each with the probability by which it is chosen: as its flux demands.
#[derive(Clone, Debug, Default)]
pub struct Bright {
    /// Number of each among the patches, its area, and the sum of the probabilities up to it.
    chosen: Vec<(u32, Area, f64)>,
    /// By number of the patch: aimed rays that end there per m2; 0 where it is not bright.
    densities: Vec<f64>,
    /// Share of rays that are aimed: that of all flux which bright patches send, or half.
    share: f64,
}

/// Choice of a ray by a point of the unit square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aim {
    /// It is aimed at a point of a bright patch, by number.
    At(u32, DVec3),
    /// It goes by what scatters it, for which a point of the unit square is left.
    Elsewhere([f64; 2]),
}

impl Bright {
    /// Finds the bright ones among patches of these luminances in cd/m2 (any one for each) and areas; those without an area are none.
    pub fn new(patches: impl Iterator<Item = (f64, Option<Area>)> + Clone) -> Self {
        let areas = patches.clone().filter_map(|(luminance, area)| Some((luminance, area?.area_m2())));
        let (flux, area) =
            areas.fold((0.0, 0.0), |(flux, all), (luminance, area)| (flux + luminance * area, all + area));
        let is_bright = |luminance: f64| luminance * area > BRIGHT * flux;
        let bright: Vec<(u32, Area, f64)> = patches
            .clone()
            .enumerate()
            .filter_map(|(number, (luminance, area))| {
                let area = area.filter(|area| is_bright(luminance) && area.area_m2() > 0.0)?;
                Some((number as u32, area, luminance * area.area_m2()))
            })
            .collect();
        let all: f64 = bright.iter().map(|(.., flux)| flux).sum();
        if all <= 0.0 {
            return Self::default();
        }
        let share = (all / flux).min(MOST_AIMED);
        let mut densities = vec![0.0; patches.count()];
        let mut sum = 0.0;
        let add = |(number, area, flux): (u32, Area, f64)| {
            densities[number as usize] = share * flux / (all * area.area_m2());
            sum += flux / all;
            (number, area, sum)
        };
        Self { chosen: bright.into_iter().map(add).collect(), densities, share }
    }

    /// True if no patch is bright.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.chosen.is_empty()
    }

    /// Share of rays that are aimed.
    pub fn share(&self) -> f64 {
        self.share
    }

    /// Decides where a ray goes; even points have even choices.
    pub fn aim(&self, [u, v]: [f64; 2]) -> Aim {
        if u >= self.share {
            return Aim::Elsewhere([(u - self.share) / (1.0 - self.share), v]);
        }
        let choice = u / self.share;
        let place = self.chosen.partition_point(|(.., sum)| *sum <= choice).min(self.chosen.len() - 1);
        let before = if place > 0 { self.chosen[place - 1].2 } else { 0.0 };
        let (number, Area { corner, edges }, sum) = self.chosen[place];
        let within = ((choice - before) / (sum - before)).min(1.0);
        Aim::At(number, corner + edges[0] * within + edges[1] * v)
    }

    /// Aimed rays that end in a patch, per m2 and ray.
    #[inline]
    pub fn density(&self, number: u32) -> f64 {
        self.densities.get(number as usize).copied().unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of ten patches of 1 m2 and 1 cd/m2 and two of 0.25 m2 and 100 cd/m2 these alone are bright; they send five sixths of the light, and
    /// half of the rays are aimed at them: one in m2 each.
    #[test]
    fn rays_are_aimed_at_the_brightest() {
        let area = |edge: f64| Some(Area { corner: DVec3::ZERO, edges: [DVec3::X * edge, DVec3::Y] });
        let few = [(100.0, area(0.25)), (100.0, area(0.25)), (500.0, None)];
        let bright = Bright::new(std::iter::repeat_n((1.0, area(1.0)), 10).chain(few));
        assert_eq!(bright.share(), 0.5);
        assert_eq!(bright.aim([0.125, 0.5]), Aim::At(10, DVec3::new(0.125, 0.5, 0.0)));
        assert_eq!(bright.aim([0.375, 0.5]), Aim::At(11, DVec3::new(0.125, 0.5, 0.0)));
        assert_eq!(bright.aim([0.75, 0.25]), Aim::Elsewhere([0.5, 0.25]));
        assert_eq!([9, 10, 12].map(|number| bright.density(number)), [0.0, 1.0, 0.0]);
        assert!(Bright::new(std::iter::repeat_n((1.0, area(1.0)), 10)).is_empty());
    }
}
