//! Patches of the sky: the 145 of Tregenza (1987), and their subdivisions by Reinhart (2001).

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec3;

use super::direction;

/// Numbers of patches in the bands of Tregenza, from the horizon up.
const COUNTS: [u32; 7] = [30, 30, 24, 24, 18, 12, 6];

/// A patch of the sky.
#[derive(Clone, Copy, Debug)]
pub struct SkyPatch {
    /// Unit vector toward the centre of the patch.
    pub toward: DVec3,
    /// Solid angle of the patch in sr.
    pub solid_angle_sr: f64,
    /// Heights (z) of its lower and upper edge on the unit sphere.
    heights: [f64; 2],
    /// Azimuth of its centre and its width in azimuth, in rad.
    azimuths: [f64; 2],
}

impl SkyPatch {
    /// Returns the solid angle of the patch in sr, weighted with the cosine of the zenith angle.
    pub fn projected_sr(&self) -> f64 {
        let [low, high] = self.heights;
        0.5 * (high - low) * (high + low) * self.azimuths[1]
    }

    /// True if the lower edge is below an altitude in rad.
    pub fn begins_below(&self, altitude: f64) -> bool {
        self.heights[0] < libm::sin(altitude)
    }

    /// Samples a unit vector toward a point of the patch, uniform in solid angle, from numbers in 0..1, the first along the azimuth.
    pub fn point(&self, [u, v]: [f64; 2]) -> DVec3 {
        let [lower, upper] = self.heights;
        self.toward_place(u, lower + (upper - lower) * v)
    }

    /// Computes the mean over the patch of a function of the direction, weighted with the cosine of the zenith angle, by the four nodes of
    /// Gauss and Legendre.
    pub fn mean(&self, of: impl Fn(DVec3) -> f64) -> f64 {
        let node = 0.5 / 3f64.sqrt();
        let [low, high] = self.heights.map(|height| height * height);
        let places = [-node, node].map(|place| (low + (high - low) * (0.5 + place)).sqrt());
        let at = |u: f64, z: f64| of(self.toward_place(0.5 + u, z));
        0.25 * places.map(|z| at(-node, z) + at(node, z)).into_iter().sum::<f64>()
    }

    fn toward_place(&self, u: f64, z: f64) -> DVec3 {
        let (sin, cos) = libm::sincos(self.azimuths[0] + self.azimuths[1] * (u - 0.5));
        let radius = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
        DVec3::new(radius * sin, radius * cos, z)
    }
}

/// Patches of the whole sky, in bands of equal height from the horizon up, and the zenith, half as high.
#[derive(Clone, Debug)]
pub struct SkyPatches {
    patches: Vec<SkyPatch>,
    /// Height of a band in rad.
    height: f64,
    /// Number of the first patch of each band, and the number of its patches; the zenith is the last one.
    bands: Vec<(usize, u32)>,
}

impl SkyPatches {
    /// Divides the sky into the patches of Tregenza, each of which is divided again along both directions.
    ///
    /// ```
    /// use skyduct_physics::sky::patches::SkyPatches;
    ///
    /// assert_eq!([1, 2, 4].map(|division| SkyPatches::new(division).all().len()), [145, 577, 2305]);
    /// let whole: f64 = SkyPatches::new(2).all().iter().map(|patch| patch.solid_angle_sr).sum();
    /// assert!((whole - std::f64::consts::TAU).abs() < 1e-12);
    /// ```
    pub fn new(division: u32) -> Self {
        let counts = COUNTS.into_iter().flat_map(|count| std::iter::repeat_n(count * division, division as usize));
        let number = COUNTS.len() as u32 * division;
        let height = FRAC_PI_2 / (f64::from(number) + 0.5);
        let (mut patches, mut bands) = (Vec::new(), Vec::new());
        for (band, count) in counts.enumerate() {
            bands.push((patches.len(), count));
            let edges = [band, band + 1].map(|edge| libm::sin(height * edge as f64));
            let width = TAU / f64::from(count);
            patches.extend((0..count).map(|number| {
                let middle = width * f64::from(number);
                patch(direction(height * (band as f64 + 0.5), middle), edges, [middle, width])
            }));
        }
        bands.push((patches.len(), 1));
        patches.push(patch(DVec3::Z, [libm::sin(height * f64::from(number)), 1.0], [0.0, TAU]));
        Self { patches, height, bands }
    }

    /// Returns all patches, band after band.
    pub fn all(&self) -> &[SkyPatch] {
        &self.patches
    }

    /// Returns the number of the patch toward a unit vector; `None` below the horizon.
    pub fn number_at(&self, toward: DVec3) -> Option<usize> {
        if toward.z < 0.0 {
            return None;
        }
        let altitude = libm::atan2(toward.z, toward.truncate().length());
        let band = ((altitude / self.height) as usize).min(self.bands.len() - 1);
        let (first, count) = self.bands[band];
        let place = libm::atan2(toward.x, toward.y) / TAU * f64::from(count);
        Some(first + (place.round() as i64).rem_euclid(i64::from(count)) as usize)
    }
}

fn patch(toward: DVec3, heights: [f64; 2], azimuths: [f64; 2]) -> SkyPatch {
    SkyPatch { toward, solid_angle_sr: (heights[1] - heights[0]) * azimuths[1], heights, azimuths }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn patches_cover_the_sky() {
        let tregenza = SkyPatches::new(1);
        let patches = tregenza.all();
        let whole: f64 = patches.iter().map(|patch| patch.solid_angle_sr).sum();
        assert!((whole / TAU - 1.0).abs() < 1e-12);
        // the middle of a band overestimates the horizontal illuminance of a uniform sky by 1 / cos(half a band)
        let half_band = 6f64.to_radians();
        let bands: f64 = patches[..144].iter().map(|patch| patch.solid_angle_sr * patch.toward.z).sum();
        let cap = PI * half_band.sin().powi(2);
        assert!(((bands * half_band.cos() + cap) / PI - 1.0).abs() < 1e-12);
    }

    /// Checks that points of a patch have its number, also across north, where azimuths begin.
    #[test]
    fn points_belong_to_their_patch() {
        for division in [1, 2] {
            let patches = SkyPatches::new(division);
            for (number, patch) in patches.all().iter().enumerate() {
                for point in [[0.01, 0.01], [0.5, 0.5], [0.99, 0.01], [0.01, 0.99], [0.99, 0.99]] {
                    assert_eq!(patches.number_at(patch.point(point)), Some(number));
                }
            }
            assert_eq!(patches.number_at(DVec3::NEG_Z), None);
        }
    }

    /// Checks the means of a constant and of the height, which is a root of what the nodes are even in: it errs most in the lowest band.
    #[test]
    fn means_are_weighted_with_the_cosine() {
        for patch in SkyPatches::new(2).all() {
            let [low, high] = patch.heights;
            // 2/3 (high^3 - low^3) / (high^2 - low^2)
            let exact = 2.0 / 3.0 * (high.powi(3) - low.powi(3)) / (high.powi(2) - low.powi(2));
            assert!((patch.mean(|_| 3.0) - 3.0).abs() < 1e-14);
            assert!((patch.mean(|toward| toward.z) - exact).abs() < 1.2e-2 * exact, "{low} {high}");
        }
    }
}
