//! Patches, and images of sources in surfaces with a lobe, that are much brighter than most patches: some rays are aimed at them, because
//! few would meet them by chance.

use glam::DVec3;

use super::area::Area;
use super::source_images::SourceImage;
use crate::traceable::SurfaceId;

/// Luminance above which a patch is bright, relative to the mean luminance that rays meet from the starts of paths.
const BRIGHT: f64 = 4.0;

/// Largest fraction of rays that are aimed, relative to the absorptance of a surface. Rays that are not aimed represent all rays: if more
/// than this were aimed their weights would grow from one reflection to the next, and their variance without bound.
const MOST_AIMED: f64 = 0.5;

/// Aim of a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// Patch with this number.
    Patch(u32),
    /// Image of a source in this surface.
    Image(SurfaceId),
}

/// Bright patches and images, each with the probability with which it is chosen, in proportion to its flux.
#[derive(Clone, Debug, Default)]
pub struct BrightPatches {
    /// Each with its area, and the sum of the probabilities up to it.
    chosen: Vec<(Target, Area, f64)>,
    /// Fraction of the aimed rays that end in a patch, per m2, by its number; 0 where it is not bright.
    densities: Vec<f64>,
    /// Surface and area of each image, with the fraction of the aimed rays that go to it, per m2.
    images: Vec<(SurfaceId, Area, f64)>,
    /// Fraction of all flux that comes from these.
    fraction: f64,
}

/// Choice of a ray's direction, made by a point of the unit square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aim {
    /// Direction toward a point of a bright patch or image.
    At(Target, DVec3),
    /// Direction by the scattering distribution, which a remaining point of the unit square chooses.
    Elsewhere([f64; 2]),
}

impl BrightPatches {
    /// Finds the bright ones among patches of these luminances in cd/m2 and areas, and among images; `mean` is the mean luminance that rays
    /// meet. Patches without an area cannot be bright.
    pub fn new(patches: impl Iterator<Item = (f64, Option<Area>)> + Clone, images: &[SourceImage], mean: f64) -> Self {
        let is_bright = |luminance: f64| luminance > BRIGHT * mean;
        let with_area = |(number, (luminance, area)): (usize, (f64, Option<Area>))| {
            let flux = luminance * area?.area_m2();
            Some((Target::Patch(number as u32), area?, luminance, flux))
        };
        let of_images =
            images.iter().map(|image| (Target::Image(image.surface), image.area, image.luminance, image.flux));
        let all = patches.clone().enumerate().filter_map(with_area).chain(of_images);
        let bright = all.clone().filter(|(.., luminance, flux)| is_bright(*luminance) && *flux > 0.0);
        let [flux, of_bright] = [all.map(|(.., flux)| flux).sum::<f64>(), bright.clone().map(|(.., flux)| flux).sum()];
        if of_bright <= 0.0 {
            return Self::default();
        }
        let fraction = of_bright / flux;
        let mut found = Self { densities: vec![0.0; patches.count()], fraction, ..Self::default() };
        let mut sum = 0.0;
        for (target, area, _, flux) in bright {
            sum += flux / of_bright;
            found.chosen.push((target, area, sum));
            let density = flux / (of_bright * area.area_m2());
            match target {
                Target::Patch(number) => found.densities[number as usize] = density,
                Target::Image(surface) => found.images.push((surface, area, density)),
            }
        }
        found
    }

    /// True if nothing is bright.
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
        let (target, point) = self.at([u / fraction, v]);
        Aim::At(target, point)
    }

    /// Chooses a bright patch or image and a point of it by a point of the unit square; there must be one.
    pub fn at(&self, [choice, v]: [f64; 2]) -> (Target, DVec3) {
        let place = self.chosen.partition_point(|(.., sum)| *sum <= choice).min(self.chosen.len() - 1);
        let before = if place > 0 { self.chosen[place - 1].2 } else { 0.0 };
        let (target, Area { corner, edges }, sum) = self.chosen[place];
        let within = ((choice - before) / (sum - before)).min(1.0);
        (target, corner + edges[0] * within + edges[1] * v)
    }

    /// Returns the fraction of the aimed rays that end in a patch, per m2.
    #[inline]
    pub fn density(&self, number: u32) -> f64 {
        self.densities.get(number as usize).copied().unwrap_or(0.0)
    }

    /// Returns the density per sr of the rays from a place that are aimed at images in a surface and meet it at a point.
    #[inline]
    pub fn density_of_images(&self, surface: SurfaceId, from: DVec3, point: DVec3) -> f64 {
        let of_surface = self.images.iter().filter(|(of, ..)| *of == surface);
        of_surface.filter_map(|(_, area, per_area)| Some(per_area * area.squared_over_cosine(from, point)?)).sum()
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
        let bright = BrightPatches::new(std::iter::repeat_n((1.0, area(1.0)), 10).chain(few), &[], 2.0);
        assert_eq!([0.0, 0.5, 1.0].map(|reflectance| bright.fraction(reflectance)), [0.5, 0.25, 0.0]);
        assert_eq!(bright.aim(0.5, [0.125, 0.5]), Aim::At(Target::Patch(10), DVec3::new(0.125, 0.5, 0.0)));
        assert_eq!(bright.aim(0.5, [0.375, 0.5]), Aim::At(Target::Patch(11), DVec3::new(0.125, 0.5, 0.0)));
        assert_eq!(bright.aim(0.5, [0.75, 0.25]), Aim::Elsewhere([0.5, 0.25]));
        assert_eq!([9, 10, 12].map(|number| bright.density(number)), [0.0, 2.0, 0.0]);
        assert!(BrightPatches::new(std::iter::repeat_n((1.0, area(1.0)), 10), &[], 2.0).is_empty());
    }

    /// Checks that rays which are aimed at images have the density that is told: the mean of its inverse is the solid angle of the area that
    /// both images cover together, here that of a square of 2 m seen from 1 m above its middle, 2 pi / 3 sr.
    #[test]
    fn rays_aimed_at_images_have_the_density_that_is_told() {
        let surface = SurfaceId::numbered(3);
        let image = |x: f64, flux: f64| {
            let area = Area { corner: DVec3::new(x, -1.0, -1.0), edges: [DVec3::X * 1.25, DVec3::Y * 2.0] };
            SourceImage { surface, area, luminance: 100.0, flux }
        };
        let bright = BrightPatches::new(std::iter::empty(), &[image(-1.0, 3.0), image(-0.25, 1.0)], 1.0);
        let count = 200;
        let mut sum = 0.0;
        for number in 0..count * count {
            let [row, column] = [number / count, number % count].map(|part| (part as f64 + 0.5) / count as f64);
            let (target, place) = bright.at([row, column]);
            assert_eq!(target, Target::Image(surface));
            // the surface lies anywhere on the way
            sum += bright.density_of_images(surface, DVec3::ZERO, place * 0.3).recip();
        }
        let mean = sum / f64::from(count * count);
        assert!((mean / (2.0 * std::f64::consts::FRAC_PI_3) - 1.0).abs() < 1e-3, "{mean}");
        assert_eq!(bright.density_of_images(SurfaceId::numbered(2), DVec3::ZERO, -DVec3::Z), 0.0);
        assert_eq!(bright.density_of_images(surface, DVec3::ZERO, DVec3::Z), 0.0);
    }
}
