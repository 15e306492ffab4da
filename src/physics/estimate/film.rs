//! Estimates of luminance images.

use super::grid::{contrasts_of, error_with_bias, push_each, sampling_variance};
use crate::integrator::ViewPass;
use crate::optics::spectrum::REC709_LUMINANCE;
use crate::statistics::Moments;

/// Side in pixels of the blocks over which a view's accuracy is judged.
pub const BLOCK_PX: usize = 8;

/// Luminance of one view in cd/m2, top row first, with one replicate per pass.
#[derive(Clone, Debug, Default)]
pub struct FilmEstimate {
    /// Width and height of the image.
    pub size_px: [usize; 2],
    /// 1 (luminance) or 3 (linear Rec.709).
    pub channels: usize,
    /// Number of passes so far, as a float so that checkpoints are one list of numbers.
    pub passes: f64,
    /// Mean per pixel and channel, channels interleaved.
    pub mean: Vec<f64>,
    /// Sum of squared deviations of each pixel's luminance Y.
    pub m2: Vec<f64>,
    /// Luminance Y of blocks of 8 x 8 pixels, row by row: pixels of a pass share photons, so blocks are replicated whole.
    pub blocks: Vec<Moments>,
    /// Estimated bias of the blocks.
    pub block_bias: Vec<Moments>,
    /// Number of rays of each pixel in all passes, which limits the error where few rays may miss an edge: [`Self::standard_error_cd_m2`].
    pub rays: Vec<f64>,
    /// Contrasts among the rays of each pixel, equally many for each, if rays are the same in every pass; else empty.
    pub contrasts: Vec<Moments>,
}

/// Returns the number of blocks over which a view of this width and height is judged.
pub fn block_count(size_px: [usize; 2]) -> usize {
    size_px[0].div_ceil(BLOCK_PX) * size_px[1].div_ceil(BLOCK_PX)
}

impl FilmEstimate {
    /// Creates the estimate of no passes, for an image of `channels` 1 or 3.
    pub fn empty(size_px: [usize; 2], channels: usize) -> Self {
        let pixels = size_px[0] * size_px[1];
        let blocks = vec![Moments::default(); block_count(size_px)];
        Self {
            size_px,
            channels,
            passes: 0.0,
            mean: vec![0.0; pixels * channels],
            m2: vec![0.0; pixels],
            rays: vec![0.0; pixels],
            blocks: blocks.clone(),
            block_bias: blocks,
            contrasts: Vec::new(),
        }
    }

    /// Adds one pass of the same size and channels.
    pub fn push(&mut self, pass: &ViewPass) {
        self.passes += 1.0;
        let luminances: Vec<f64> = pass.luminance.chunks_exact(self.channels).map(luminance).collect();
        for (pixel, y) in luminances.iter().enumerate() {
            let range = pixel * self.channels..(pixel + 1) * self.channels;
            let before = y - luminance(&self.mean[range.clone()]);
            for (mean, value) in self.mean[range.clone()].iter_mut().zip(&pass.luminance[range.clone()]) {
                *mean += (value - *mean) / self.passes;
            }
            self.m2[pixel] += before * (y - luminance(&self.mean[range]));
        }
        for (pixel, rays) in self.rays.iter_mut().enumerate() {
            *rays += pass.rays.get(pixel).or(pass.rays.first()).copied().unwrap_or(1.0);
        }
        self.push_blocks(&luminances, &pass.bias);
        push_each(&mut self.contrasts, &pass.contrasts);
    }

    fn push_blocks(&mut self, luminances: &[f64], bias: &[f64]) {
        for (moments, value) in self.blocks.iter_mut().zip(block_means(self.size_px, luminances)) {
            moments.push(value);
        }
        if !bias.is_empty() {
            for (moments, value) in self.block_bias.iter_mut().zip(block_means(self.size_px, bias)) {
                moments.push(value);
            }
        }
    }

    /// Returns the luminance Y of a pixel in cd/m2.
    pub fn luminance_cd_m2(&self, pixel: usize) -> f64 {
        luminance(&self.mean[pixel * self.channels..(pixel + 1) * self.channels])
    }

    /// Returns the standard error of a pixel's luminance in cd/m2, including the estimated bias of its block and the error by the choice of
    /// fixed rays: the pixel's own, which is uncertain with few rays, but at least the mean over its block. The standard error is not below
    /// the effect of one more ray that sees the luminance of a neighbour: rays that all missed a corner of it agree, whatever light they
    /// miss.
    pub fn standard_error_cd_m2(&self, pixel: usize) -> f64 {
        let value = Moments { count: self.passes, mean: 0.0, m2: self.m2[pixel] };
        let block = self.block_of(pixel);
        let error = error_with_bias(&value, self.block_bias.get(block)).max(self.error_of_one_ray_cd_m2(pixel));
        if self.contrasts.is_empty() {
            return error;
        }
        let pixels = self.pixels_of(block).count() as f64;
        let sampling = self.pixel_sampling_variance(pixel).max(self.block_sampling_variance(block) * pixels);
        libm::hypot(error, sampling.max(0.0).sqrt())
    }

    /// Returns the change of a pixel's luminance in cd/m2 if one of its rays saw, instead of the pixel's own mean, that of the one of its
    /// eight neighbours that differs most. Fixed rays are the same in every pass.
    fn error_of_one_ray_cd_m2(&self, pixel: usize) -> f64 {
        let [width, height] = self.size_px;
        let (column, row) = (pixel % width, pixel / width);
        let own = self.luminance_cd_m2(pixel);
        let rows = row.saturating_sub(1)..(row + 2).min(height);
        let around =
            rows.flat_map(|row| (column.saturating_sub(1)..(column + 2).min(width)).map(move |c| row * width + c));
        let most = around.map(|other| (self.luminance_cd_m2(other) - own).abs()).fold(0.0, f64::max);
        let rays = if self.contrasts.is_empty() { self.rays[pixel] } else { self.rays[pixel] / self.passes };
        if rays > 0.0 { most / rays } else { 0.0 }
    }

    /// Returns the standard error of a block's luminance in cd/m2, including the estimated bias and the error of fixed rays.
    pub fn block_standard_error_cd_m2(&self, block: usize) -> f64 {
        let error = error_with_bias(&self.blocks[block], self.block_bias.get(block));
        if self.contrasts.is_empty() {
            error
        } else {
            libm::hypot(error, self.block_sampling_variance(block).max(0.0).sqrt())
        }
    }

    /// Returns the variance of a pixel by the choice of its fixed rays.
    fn pixel_sampling_variance(&self, pixel: usize) -> f64 {
        sampling_variance(contrasts_of(&self.contrasts, self.size_px[0] * self.size_px[1], pixel))
    }

    /// Returns the variance of a block's mean by the choice of fixed rays, which is independent for each pixel.
    pub fn block_sampling_variance(&self, block: usize) -> f64 {
        let count = self.pixels_of(block).count() as f64;
        self.pixels_of(block).map(|pixel| self.pixel_sampling_variance(pixel)).sum::<f64>() / (count * count)
    }

    /// Calls `f` on every number in a fixed order, to read or to replace them, as checkpoints do.
    pub fn for_each_value(&mut self, f: &mut impl FnMut(&mut f64)) {
        f(&mut self.passes);
        self.mean.iter_mut().chain(&mut self.m2).chain(&mut self.rays).for_each(&mut *f);
        let Self { blocks, block_bias, contrasts, .. } = self;
        blocks.iter_mut().chain(block_bias).chain(contrasts).for_each(|moments| moments.for_each_value(f));
    }

    fn pixels_of(&self, block: usize) -> impl Iterator<Item = usize> {
        let [width, height] = self.size_px;
        let across = width.div_ceil(BLOCK_PX);
        let (x, y) = (block % across * BLOCK_PX, block / across * BLOCK_PX);
        (y..(y + BLOCK_PX).min(height))
            .flat_map(move |row| (x..(x + BLOCK_PX).min(width)).map(move |c| row * width + c))
    }

    fn block_of(&self, pixel: usize) -> usize {
        let (x, y) = (pixel % self.size_px[0], pixel / self.size_px[0]);
        y / BLOCK_PX * self.size_px[0].div_ceil(BLOCK_PX) + x / BLOCK_PX
    }
}

fn luminance(channels: &[f64]) -> f64 {
    match channels {
        [y] => *y,
        _ => channels.iter().zip(REC709_LUMINANCE).map(|(value, weight)| value * weight).sum(),
    }
}

/// Returns the means of the blocks of [`BLOCK_PX`] pixels of an image of one value a pixel, row by row.
pub fn block_means(size_px: [usize; 2], values: &[f64]) -> Vec<f64> {
    let [width, height] = size_px;
    let across = width.div_ceil(BLOCK_PX);
    (0..across * height.div_ceil(BLOCK_PX))
        .map(|block| {
            let (x, y) = (block % across * BLOCK_PX, block / across * BLOCK_PX);
            let (x_end, y_end) = ((x + BLOCK_PX).min(width), (y + BLOCK_PX).min(height));
            let sum: f64 = (y..y_end).map(|row| values[row * width + x..row * width + x_end].iter().sum::<f64>()).sum();
            sum / ((x_end - x) * (y_end - y)) as f64
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn passes() -> Vec<ViewPass> {
        let value = |pass: usize, k: usize| ((pass * 31 + k * 17) % 101) as f64;
        (0..10)
            .map(|pass| ViewPass {
                luminance: (0..11 * 9 * 3).map(|k| value(pass, k)).collect(),
                bias: (0..11 * 9).map(|k| value(pass, k) - 50.0).collect(),
                contrasts: (0..11 * 9).map(|k| 0.1 * value(pass + 3, k) - 2.0).collect(),
                rays: vec![4.0],
            })
            .collect()
    }

    #[test]
    fn moments_of_pixels_and_blocks_are_those_of_their_values() {
        let mut all = FilmEstimate::empty([11, 9], 3);
        passes().iter().for_each(|pass| all.push(pass));
        for pixel in 0..99 {
            let values: Vec<f64> = passes().iter().map(|p| luminance(&p.luminance[pixel * 3..pixel * 3 + 3])).collect();
            let mean = values.iter().sum::<f64>() / 10.0;
            let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 9.0;
            assert!((all.m2[pixel] / 9.0 - variance).abs() < 1e-9 * variance);
        }
        assert_eq!(all.blocks.len(), 4);
    }
}
