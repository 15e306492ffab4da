//! Luminances of a view, and which of its pixels see a source of light.

/// Share of the pixels off sources that a scale holds, unless its end is given.
const HELD: f64 = 0.99;

/// Luminances of a view, as its EXR file has them.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenView {
    /// Width and height.
    pub size_px: [usize; 2],
    /// Luminance of each pixel in cd/m2, top row first.
    pub luminances: Vec<f64>,
    /// True where the middle of a pixel sees a source of light, an opening, or out of the room; empty: not known.
    pub sources: Vec<bool>,
}

impl SeenView {
    /// Luminance that holds 99 % of the pixels which see no source, and no neighbour of which does; of all pixels where that is
    /// not known, or there are none.
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
