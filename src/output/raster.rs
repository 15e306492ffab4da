//! Raster of sRGB pixels that can be drawn on.

/// A picture of 8-bit sRGB pixels, top row first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Raster {
    /// Number of pixels in a row.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// Red, green and blue byte of every pixel, interleaved.
    pub pixels: Vec<u8>,
}

impl Raster {
    /// Returns a picture filled with one colour.
    pub fn filled(width: usize, height: usize, colour: [u8; 3]) -> Self {
        Self { width, height, pixels: colour.repeat(width * height) }
    }

    /// Sets the colour of a pixel; positions outside of the picture are ignored.
    pub fn set(&mut self, x: usize, y: usize, colour: [u8; 3]) {
        if x < self.width && y < self.height {
            let at = 3 * (y * self.width + x);
            self.pixels[at..at + 3].copy_from_slice(&colour);
        }
    }

    /// Returns the colour of a pixel inside the picture, `x` from the left and `y` from the top.
    pub fn get(&self, x: usize, y: usize) -> [u8; 3] {
        let at = 3 * (y * self.width + x);
        [self.pixels[at], self.pixels[at + 1], self.pixels[at + 2]]
    }

    /// Fills the columns `x` and rows `y` with a colour, clipped to the picture.
    pub fn fill(&mut self, x: std::ops::Range<usize>, y: std::ops::Range<usize>, colour: [u8; 3]) {
        let (left, right) = (x.start.min(self.width), x.end.min(self.width));
        for row in y.start..y.end.min(self.height) {
            let start = row * self.width;
            if let Some(pixels) = self.pixels.get_mut(3 * (start + left)..3 * (start + right)) {
                pixels.chunks_exact_mut(3).for_each(|pixel| pixel.copy_from_slice(&colour));
            }
        }
    }

    /// Draws another picture with its upper left corner at (`x`, `y`), clipped to this one.
    pub fn draw(&mut self, x: usize, y: usize, picture: &Self) {
        let length = 3 * picture.width.min(self.width.saturating_sub(x));
        for row in 0..picture.height.min(self.height.saturating_sub(y)) {
            let (from, to) = (3 * row * picture.width, 3 * ((y + row) * self.width + x));
            self.pixels[to..to + length].copy_from_slice(&picture.pixels[from..from + length]);
        }
    }

    /// Returns the picture with every pixel enlarged to a square of `times` x `times` pixels.
    pub fn enlarged(&self, times: usize) -> Self {
        let mut large = Self { width: self.width * times, height: self.height * times, pixels: Vec::new() };
        large.pixels.reserve_exact(3 * large.width * large.height);
        for row in self.pixels.chunks_exact((3 * self.width).max(1)) {
            let start = large.pixels.len();
            row.chunks_exact(3).for_each(|pixel| (0..times).for_each(|_| large.pixels.extend_from_slice(pixel)));
            let end = large.pixels.len();
            (1..times).for_each(|_| large.pixels.extend_from_within(start..end));
        }
        large
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares row-wise copying with setting pixel by pixel, also where pictures reach over the edge.
    #[test]
    fn rows_are_copied_as_pixels_would_be() {
        let mut small = Raster::filled(3, 2, [0; 3]);
        for (index, byte) in small.pixels.iter_mut().enumerate() {
            *byte = index as u8;
        }
        let large = small.enlarged(4);
        assert_eq!((large.width, large.height, large.pixels.len()), (12, 8, 3 * 96));
        for (x, y) in (0..12).flat_map(|x| (0..8).map(move |y| (x, y))) {
            assert_eq!(large.get(x, y), small.get(x / 4, y / 4));
        }
        for (left, top) in [(0, 0), (2, 1), (8, 6), (9, 7), (20, 0), (0, 20)] {
            let (mut by_rows, mut by_pixels) = (Raster::filled(10, 8, [9; 3]), Raster::filled(10, 8, [9; 3]));
            by_rows.draw(left, top, &small);
            by_rows.fill(left + 1..left + 5, top..top + 3, [7; 3]);
            for (x, y) in (0..3).flat_map(|x| (0..2).map(move |y| (x, y))) {
                by_pixels.set(left + x, top + y, small.get(x, y));
            }
            for (x, y) in (1..5).flat_map(|x| (0..3).map(move |y| (x, y))) {
                by_pixels.set(left + x, top + y, [7; 3]);
            }
            assert_eq!(by_rows, by_pixels, "{left} {top}");
        }
    }
}
