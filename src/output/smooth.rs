//! Denoising of pictures: pixels that differ by no more than their standard errors are averaged.
//!
//! Non-local means by the pixels' own errors (Rousselle, Knaus and Zwicker 2012, section 4.1): the patches around two pixels are compared,
//! and the less they differ, relative to their errors, the larger the weight of one pixel in the average of the other. Smoothed values are
//! for display only; the reported values of a view are never smoothed.

use rayon::prelude::*;

use super::Image;

/// Half widths in pixels of the search window around a pixel (`REACH`) and of the patches that are compared (`AROUND`).
const REACH: usize = 5;
const AROUND: usize = 2;
const PADDING: usize = REACH + AROUND;

/// Tolerated difference of two pixels, in standard errors.
const TOLERANCE: f32 = 0.6;

/// Patch distance from which on a pixel has weight zero: the mean squared difference, less its expected value from noise, over the
/// tolerated squared difference.
const DIFFERENT: f32 = 4.0;

/// Difference that is tolerated even between pixels without error, as a fraction of their luminance.
const ALIKE: f32 = 1e-4;

/// Variance of a pixel, in the mean variance of those around it, above which its weight falls: otherwise a single bright path would be
/// spread over a square as large as the search window.
const OUTLYING: f32 = 16.0;

/// Number of rows that one task smooths.
const STRIP: usize = 16;

/// Returns the values of an image denoised by its standard errors in cd/m2, one per pixel; returns them unchanged where an error or a value
/// is not finite, as after a single pass.
///
/// An image, half black and half noisy grey, keeps its edge, and the grey becomes even:
///
/// ```
/// use skyduct::output::{Image, smooth::smoothed};
///
/// let noise = |pixel: usize| if (pixel * 7 + pixel / 40) % 3 == 0 { 2.0 } else { -1.0 };
/// let value = |pixel: usize| if pixel % 40 < 20 { 0.0 } else { 100.0 + noise(pixel) };
/// let values: Vec<f64> = (0..1600).map(value).collect();
/// let errors: Vec<f64> = (0..1600).map(|pixel| if pixel % 40 < 20 { 0.0 } else { 1.5 }).collect();
/// let smooth = smoothed(Image { size_px: [40, 40], channels: 1, values: &values }, &errors);
/// assert!(smooth.iter().enumerate().all(|(pixel, y)| if pixel % 40 < 20 { *y == 0.0 } else { (y - 100.0).abs() < 0.5 }));
/// ```
pub fn smoothed(image: Image, standard_error: &[f64]) -> Vec<f64> {
    let [width, height] = image.size_px;
    let luminances = image.luminances();
    let mean = luminances.iter().sum::<f64>() / luminances.len() as f64;
    let is_known = mean > 0.0 && mean.is_finite() && standard_error.iter().all(|error| error.is_finite());
    if !is_known || standard_error.len() != luminances.len() {
        return image.values.to_vec();
    }
    let variance = |pixel: usize| (standard_error[pixel] / mean).powi(2) as f32;
    let shared = Shared {
        image,
        y: padded(image.size_px, |pixel| (luminances[pixel] / mean) as f32),
        variance: padded(image.size_px, variance),
        trust: trust(image.size_px, variance),
    };
    let strips: Vec<Vec<f64>> =
        (0..height.div_ceil(STRIP)).into_par_iter().map(|strip| shared.strip(strip * STRIP, width, height)).collect();
    strips.concat()
}

/// Returns the values of all pixels in an image extended by `PADDING` pixels on each side, which repeat those of the edge.
fn padded([width, height]: [usize; 2], of: impl Fn(usize) -> f32) -> Vec<f32> {
    let inside = |at: usize, side: usize| at.saturating_sub(PADDING).min(side - 1);
    let row = |y: usize| (0..width + 2 * PADDING).map(move |x| inside(y, height) * width + inside(x, width));
    (0..height + 2 * PADDING).flat_map(row).map(of).collect()
}

/// Returns the weight of every pixel, 0..1, by its variance and the mean variance of the pixels around it: 1 but for outliers.
fn trust([width, height]: [usize; 2], variance: impl Fn(usize) -> f32 + Sync) -> Vec<f32> {
    let range = |at: usize, side: usize| at.saturating_sub(REACH)..(at + REACH + 1).min(side);
    let of_pixel = |pixel: usize| {
        let (rows, columns) = (range(pixel / width, height), range(pixel % width, width));
        let others = (rows.len() * columns.len() - 1).max(1) as f32;
        let sum: f32 = rows.flat_map(|y| columns.clone().map(move |x| y * width + x)).map(&variance).sum();
        let (own, most) = (variance(pixel), OUTLYING * (sum - variance(pixel)).max(0.0) / others);
        if own > most && most > 0.0 { most / own } else { 1.0 }
    };
    (0..width * height).into_par_iter().map(of_pixel).collect()
}

struct Shared<'a> {
    image: Image<'a>,
    /// Luminance over its mean (`y`) and the variance of that (`variance`), both padded.
    y: Vec<f32>,
    variance: Vec<f32>,
    /// Weight of every pixel by its variance, not padded.
    trust: Vec<f32>,
}

impl Shared<'_> {
    /// Smooths the rows of the strip that begins at row `first`.
    fn strip(&self, first: usize, width: usize, height: usize) -> Vec<f64> {
        let Image { channels, values, .. } = self.image;
        let rows = STRIP.min(height - first);
        let mut sums = vec![0.0; rows * width * channels];
        let mut weights = vec![0.0; rows * width];
        let wide = width + 2 * AROUND;
        let mut apart = vec![0.0; (rows + 2 * AROUND) * wide];
        let mut of_columns = vec![0.0; wide];
        for (dy, dx) in (0..=2 * REACH).flat_map(|dy| (0..=2 * REACH).map(move |dx| (dy, dx))) {
            for (row, apart) in apart.chunks_exact_mut(wide).enumerate() {
                self.differences(first + row, (dy, dx), apart);
            }
            for row in (0..rows).filter(|row| (REACH..height + REACH).contains(&(first + row + dy))) {
                of_columns.copy_from_slice(&apart[row * wide..(row + 1) * wide]);
                for other in 1..=2 * AROUND {
                    let rows = &apart[(row + other) * wide..(row + other + 1) * wide];
                    of_columns.iter_mut().zip(rows).for_each(|(sum, value)| *sum += value);
                }
                // columns whose neighbour at this offset is inside the image
                let columns = REACH.saturating_sub(dx)..width.min((width + REACH).saturating_sub(dx));
                for x in columns {
                    let square: f32 = of_columns[x..=x + 2 * AROUND].iter().sum();
                    let difference = square * (1.0 / ((2 * AROUND + 1) * (2 * AROUND + 1)) as f32);
                    let alike = (1.0 - difference.max(0.0) * (1.0 / DIFFERENT)).max(0.0);
                    let other = (first + row + dy - REACH) * width + x + dx - REACH;
                    let weight = f64::from(alike * alike * self.trust[other]);
                    weights[row * width + x] += weight;
                    for channel in 0..channels {
                        sums[(row * width + x) * channels + channel] += weight * values[other * channels + channel];
                    }
                }
            }
        }
        // each pixel has some weight in its own average, so that no sum of weights is zero
        sums.iter().enumerate().map(|(at, sum)| sum / weights[at / channels]).collect()
    }

    /// Computes the normalised squared differences, less the part expected from noise, between the pixels of a row and those at the offset
    /// (`dy`, `dx`).
    fn differences(&self, row: usize, (dy, dx): (usize, usize), apart: &mut [f32]) {
        let wide = self.image.size_px[0] + 2 * PADDING;
        let (own, other) = ((row + REACH) * wide + REACH, (row + dy) * wide + dx);
        let count = apart.len();
        let [y, variance] = [&self.y, &self.variance].map(|values| &values[own..own + count]);
        let [other_y, other_variance] = [&self.y, &self.variance].map(|values| &values[other..other + count]);
        for (x, apart) in apart.iter_mut().enumerate() {
            let (a, b) = (variance[x], other_variance[x]);
            let difference = y[x] - other_y[x];
            // squares of both, so that one that is much brighter than the room decides nothing
            let alike = ALIKE * ALIKE * (y[x] * y[x] + other_y[x] * other_y[x]) + f32::MIN_POSITIVE;
            *apart = (difference * difference - (a + a.min(b))) / (alike + TOLERANCE * TOLERANCE * (a + b));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An edge stays where a picture shows the sun, too.
    #[test]
    fn an_edge_beside_the_sun_stays_sharp() {
        let value = |pixel: usize| match (pixel % 64, pixel / 64) {
            (0..4, 0..4) => 1.3e9,
            (0..32, _) => 20.0,
            _ => 30.0,
        };
        let values: Vec<f64> = (0..64 * 64).map(value).collect();
        let smooth = smoothed(Image { size_px: [64, 64], channels: 1, values: &values }, &[0.05; 64 * 64]);
        let off = |pixel: usize| (smooth[pixel] / values[pixel] - 1.0).abs();
        assert!((0..64 * 64).all(|pixel| off(pixel) < 1e-6));
    }

    /// Some pixels of an even noisy picture that are fifty times as bright, with errors as large, leave no squares around them.
    #[test]
    fn outliers_leave_no_squares() {
        let is_outlier = |pixel: usize| pixel % 64 % 20 == 10 && pixel / 64 % 20 == 10;
        let noise = |pixel: usize| ((pixel * 7919) % 13) as f64 / 6.0 - 1.0;
        let value = |pixel: usize| if is_outlier(pixel) { 500.0 } else { 10.0 + noise(pixel) };
        let values: Vec<f64> = (0..64 * 64).map(value).collect();
        let errors: Vec<f64> = (0..64 * 64).map(|pixel| if is_outlier(pixel) { 490.0 } else { 0.7 }).collect();
        let smooth = smoothed(Image { size_px: [64, 64], channels: 1, values: &values }, &errors);
        let off = smooth.iter().map(|y| (y / 10.0 - 1.0).abs()).fold(0.0, f64::max);
        assert!(off < 0.05, "{off}");
    }
}
