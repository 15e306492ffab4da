//! Patches that are much brighter than most, at which some rays are aimed: few would meet them by chance.

use glam::DVec3;

/// Luminance above which a patch is bright, relative to the mean luminance that rays meet from the starts of paths.
const BRIGHT: f64 = 4.0;

/// Largest fraction of rays that are aimed, relative to the absorptance of a surface. Rays that are not aimed represent all rays: if more
/// than this were aimed their weights would grow from one reflection to the next, and their variance without bound.
const MOST_AIMED: f64 = 0.5;

/// Parallelogram that reflects light.
#[derive(Clone, Copy, Debug)]
pub struct Area {
    pub corner: DVec3,
    pub edges: [DVec3; 2],
}

impl Area {
    /// Returns the area in m2.
    pub fn area_m2(&self) -> f64 {
        self.edges[0].cross(self.edges[1]).length()
    }

    /// Returns the squared length of the longer edges in m2.
    pub fn length_squared(&self) -> f64 {
        self.edges[0].length_squared().max(self.edges[1].length_squared())
    }
}

/// Bright patches, each with the probability with which it is chosen, in proportion to its flux.
#[derive(Clone, Debug, Default)]
pub struct BrightPatches {
    /// Number of each among the patches, its area, and the sum of the probabilities up to it.
    chosen: Vec<(u32, Area, f64)>,
    /// Fraction of the aimed rays that end in a patch, per m2, by its number; 0 where it is not bright.
    densities: Vec<f64>,
    /// Fraction of all flux that bright patches send.
    fraction: f64,
}

/// Choice of a ray's direction, made by a point of the unit square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aim {
    /// Direction toward a point of the bright patch with this number.
    At(u32, DVec3),
    /// Direction by the scattering distribution, which a remaining point of the unit square chooses.
    Elsewhere([f64; 2]),
}

impl BrightPatches {
    /// Finds the bright ones among patches of these luminances in cd/m2 and areas; `mean` is the mean luminance that rays meet. Patches
    /// without an area cannot be bright.
    pub fn new(patches: impl Iterator<Item = (f64, Option<Area>)> + Clone, mean: f64) -> Self {
        let flux: f64 = patches.clone().filter_map(|(luminance, area)| Some(luminance * area?.area_m2())).sum();
        let is_bright = |luminance: f64| luminance > BRIGHT * mean;
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
        let fraction = all / flux;
        let mut densities = vec![0.0; patches.count()];
        let mut sum = 0.0;
        let add = |(number, area, flux): (u32, Area, f64)| {
            densities[number as usize] = flux / (all * area.area_m2());
            sum += flux / all;
            (number, area, sum)
        };
        Self { chosen: bright.into_iter().map(add).collect(), densities, fraction }
    }

    /// True if no patch is bright.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.chosen.is_empty()
    }

    /// Returns the fraction of the rays that are aimed from a surface of this reflectance; a sensor counts as reflectance 0.
    pub fn fraction(&self, reflectance: f64) -> f64 {
        self.fraction.min(MOST_AIMED * (1.0 - reflectance)).max(0.0)
    }

    /// Chooses the direction of a ray where this fraction is aimed; uniform points give uniform choices.
    pub fn aim(&self, fraction: f64, [u, v]: [f64; 2]) -> Aim {
        if u >= fraction {
            return Aim::Elsewhere([(u - fraction) / (1.0 - fraction), v]);
        }
        let (number, point) = self.at([u / fraction, v]);
        Aim::At(number, point)
    }

    /// Chooses a bright patch and a point of it by a point of the unit square; there must be one.
    pub fn at(&self, [choice, v]: [f64; 2]) -> (u32, DVec3) {
        let place = self.chosen.partition_point(|(.., sum)| *sum <= choice).min(self.chosen.len() - 1);
        let before = if place > 0 { self.chosen[place - 1].2 } else { 0.0 };
        let (number, Area { corner, edges }, sum) = self.chosen[place];
        let within = ((choice - before) / (sum - before)).min(1.0);
        (number, corner + edges[0] * within + edges[1] * v)
    }

    /// Returns the fraction of the aimed rays that end in a patch, per m2.
    #[inline]
    pub fn density(&self, number: u32) -> f64 {
        self.densities.get(number as usize).copied().unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that two patches of 0.25 m2 and 100 cd/m2 among ten of 1 m2 and 1 cd/m2 are the only bright ones; they send five sixths of
    /// the light. Half of a sensor's rays are aimed at them, and from a surface half of what it absorbs.
    #[test]
    fn rays_are_aimed_at_the_brightest() {
        let area = |edge: f64| Some(Area { corner: DVec3::ZERO, edges: [DVec3::X * edge, DVec3::Y] });
        let few = [(100.0, area(0.25)), (100.0, area(0.25)), (500.0, None)];
        let bright = BrightPatches::new(std::iter::repeat_n((1.0, area(1.0)), 10).chain(few), 2.0);
        assert_eq!([0.0, 0.5, 1.0].map(|reflectance| bright.fraction(reflectance)), [0.5, 0.25, 0.0]);
        assert_eq!(bright.aim(0.5, [0.125, 0.5]), Aim::At(10, DVec3::new(0.125, 0.5, 0.0)));
        assert_eq!(bright.aim(0.5, [0.375, 0.5]), Aim::At(11, DVec3::new(0.125, 0.5, 0.0)));
        assert_eq!(bright.aim(0.5, [0.75, 0.25]), Aim::Elsewhere([0.5, 0.25]));
        assert_eq!([9, 10, 12].map(|number| bright.density(number)), [0.0, 2.0, 0.0]);
        assert!(BrightPatches::new(std::iter::repeat_n((1.0, area(1.0)), 10), 2.0).is_empty());
    }
}
