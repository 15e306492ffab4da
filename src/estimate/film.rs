//! Luminance images.

use crate::statistics::Moments;

/// Side of the blocks over which a view's accuracy is judged, in pixels.
pub const BLOCK_PX: usize = 8;

/// Luminance of one view in cd/m2, top row first: one replicate a pass.
#[derive(Clone, Debug, Default)]
pub struct FilmEstimate {
    pub size_px: [usize; 2],
    /// 1 (luminance) or 3 (linear Rec.709).
    pub channels: usize,
    pub passes: f64,
    /// Mean per pixel and channel, channels interleaved.
    pub mean: Vec<f64>,
    /// Sum of squared deviations of each pixel's luminance Y.
    pub m2: Vec<f64>,
    /// Luminance Y of blocks of 8 x 8 pixels, row by row.
    pub blocks: Vec<Moments>,
    /// Estimated bias of the blocks.
    pub block_bias: Vec<Moments>,
}
