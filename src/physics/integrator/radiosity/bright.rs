//! Patches that are much brighter than most, to which vertices are connected as to sources: few rays would meet them.

use glam::DVec3;

/// Luminance from which on a patch is bright, in that of the mean.
const BRIGHT: f64 = 4.0;

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
    /// By number of the patch: probability per m2; 0 where it is not bright.
    densities: Vec<f64>,
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
        let mut densities = vec![0.0; patches.count()];
        let mut sum = 0.0;
        let add = |(number, area, flux): (u32, Area, f64)| {
            densities[number as usize] = flux / (all * area.area_m2());
            sum += flux / all;
            (number, area, sum)
        };
        Self { chosen: bright.into_iter().map(add).collect(), densities }
    }

    /// True if no patch is bright.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.chosen.is_empty()
    }

    /// A point of a bright patch by three numbers in 0..1, and the number of the patch.
    pub fn choose(&self, choice: f64, [u, v]: [f64; 2]) -> Option<(u32, DVec3)> {
        let place = self.chosen.partition_point(|(.., sum)| *sum <= choice).min(self.chosen.len().checked_sub(1)?);
        let (number, Area { corner, edges }, _) = self.chosen[place];
        Some((number, corner + edges[0] * u + edges[1] * v))
    }

    /// Density of the points of a patch, per m2.
    #[inline]
    pub fn density(&self, number: u32) -> f64 {
        self.densities.get(number as usize).copied().unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of ten patches of 1 m2 and 1 cd/m2 and one of 0.5 m2 and 100 cd/m2 the last alone is bright: its points have a density of 2 per m2.
    #[test]
    fn the_brightest_are_chosen() {
        let area = |edge: f64| Some(Area { corner: DVec3::ZERO, edges: [DVec3::X * edge, DVec3::Y] });
        let patches = std::iter::repeat_n((1.0, area(1.0)), 10).chain([(100.0, area(0.5)), (500.0, None)]);
        let bright = Bright::new(patches);
        assert_eq!(bright.choose(0.99, [0.5, 0.5]), Some((10, DVec3::new(0.25, 0.5, 0.0))));
        assert_eq!([9, 10, 11].map(|number| bright.density(number)), [0.0, 2.0, 0.0]);
        assert!(Bright::new(std::iter::repeat_n((1.0, area(1.0)), 10)).is_empty());
    }
}
