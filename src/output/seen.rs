//! Luminances of a view with a mask of the pixels that see a light source.

/// Fraction of the pixels away from sources that a luminance scale covers, unless its end is given.
const HELD: f64 = 0.99;

/// Luminances of a view and its mask of sources, as stored in its EXR file.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenView {
    /// Width and height in pixels.
    pub size_px: [usize; 2],
    /// Luminance of each pixel in cd/m2, top row first.
    pub luminances: Vec<f64>,
    /// True for pixels whose middle sees a light source, an opening, or out of the room; empty if not recorded.
    pub sources: Vec<bool>,
}

impl SeenView {
    /// Returns the 99th percentile in cd/m2 of the luminance of pixels that neither see a source nor touch a pixel that does; of all finite
    /// pixels where sources are not recorded or no such pixel exists.
    pub fn room_luminance_cd_m2(&self) -> f64 {
        let [width, height] = self.size_px;
        let off_sources = |pixel: usize| {
            let (x, y) = (pixel % width, pixel / width);
            let columns = x.saturating_sub(1)..(x + 2).min(width);
            let mut around = (y.saturating_sub(1)..(y + 2).min(height))
                .flat_map(|row| columns.clone().map(move |column| row * width + column));
            around.all(|pixel| self.sources.get(pixel) == Some(&false))
        };
        let finite = |pixel: &usize| self.luminances[*pixel].is_finite();
        let mut values: Vec<f64> = (0..self.luminances.len())
            .filter(finite)
            .filter(|pixel| off_sources(*pixel))
            .map(|pixel| self.luminances[pixel])
            .collect();
        if values.is_empty() {
            values = self.luminances.iter().copied().filter(|luminance| luminance.is_finite()).collect();
        }
        values.sort_by(f64::total_cmp);
        let index = (HELD * values.len().saturating_sub(1) as f64).round() as usize;
        values.get(index).copied().unwrap_or(0.0)
    }
}
