//! Encoders of results as pictures and tables: plain numbers in, bytes out.
//!
//! Images are top row first, channels interleaved: 1 (luminance in cd/m2) or 3 (linear Rec.709, each so that Y is in
//! cd/m2). Grids are row by row from the south, west to east.

pub mod csv;
pub mod exr;
pub mod npy;
pub mod png;
mod raster;
pub mod seen;
pub mod smooth;

pub use raster::Raster;

use crate::optics::spectrum::REC709_LUMINANCE;

/// Reason why a picture could not be read or written: its size or the codec, never its values.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OutputError {
    /// Error of the EXR codec, in the codec's words.
    #[error("EXR: {0}")]
    Exr(String),
    /// Error of the PNG codec, in the codec's words.
    #[error("PNG: {0}")]
    Png(String),
    /// Error of the plotting library, in the library's words.
    #[error("plot: {0}")]
    Plot(String),
    /// Number of values that does not match width, height and channels, or an image without pixels.
    #[error("{values} values do not match {width} x {height} pixels of {channels} channels")]
    Size {
        /// Number of values given.
        values: usize,
        /// Pixels in a row.
        width: usize,
        /// Number of rows.
        height: usize,
        /// Numbers per pixel.
        channels: usize,
    },
}

/// An image of 64-bit floats, as passed to the encoders.
#[derive(Clone, Copy, Debug)]
pub struct Image<'a> {
    /// Width and height in pixels, each > 0.
    pub size_px: [usize; 2],
    /// Number of channels, 1 or 3.
    pub channels: usize,
    /// Pixel values in cd/m2, top row first, channels interleaved.
    pub values: &'a [f64],
}

impl Image<'_> {
    fn check(&self) -> Result<(), OutputError> {
        let [width, height] = self.size_px;
        let pixels = width.checked_mul(height);
        let expected = pixels.and_then(|pixels| pixels.checked_mul(self.channels));
        if width == 0 || height == 0 || !matches!(self.channels, 1 | 3) || expected != Some(self.values.len()) {
            return Err(OutputError::Size { values: self.values.len(), width, height, channels: self.channels });
        }
        Ok(())
    }

    /// Returns the luminance Y of every pixel in cd/m2, top row first.
    pub fn luminances(&self) -> Vec<f64> {
        match self.channels {
            3 => {
                let y = |rgb: &[f64]| rgb.iter().zip(REC709_LUMINANCE).map(|(value, weight)| value * weight).sum();
                self.values.chunks_exact(3).map(y).collect()
            }
            _ => self.values.to_vec(),
        }
    }
}

/// Returns the quantile of the finite `values` at the fraction `share` (0..1); `None` without finite values.
pub fn percentile(values: impl Iterator<Item = f64>, share: f64) -> Option<f64> {
    let mut values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    let index = (share * values.len().checked_sub(1)? as f64).round() as usize;
    let (_, value, _) = values.select_nth_unstable_by(index, f64::total_cmp);
    Some(*value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_of_few_values() {
        assert_eq!(percentile([].into_iter(), 0.5), None);
        assert_eq!(percentile([f64::NAN, f64::INFINITY].into_iter(), 0.5), None);
        assert_eq!(percentile([3.0, 1.0, 2.0].into_iter(), 0.0), Some(1.0));
        assert_eq!(percentile([3.0, 1.0, 2.0].into_iter(), 0.5), Some(2.0));
        assert_eq!(percentile([3.0, f64::NAN, 1.0, 2.0].into_iter(), 1.0), Some(3.0));
    }
}
