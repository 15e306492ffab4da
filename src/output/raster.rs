//! A picture in sRGB that can be drawn on.

use font8x8::UnicodeFonts;

/// Side of a letter in pixels: the 8 x 8 font drawn at twice its size.
pub const LETTER_PX: usize = 16;

/// 8-bit sRGB, top row first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Raster {
    pub width: usize,
    pub height: usize,
    /// Red, green, blue of every pixel.
    pub pixels: Vec<u8>,
}

impl Raster {
    pub fn filled(width: usize, height: usize, colour: [u8; 3]) -> Self {
        Self { width, height, pixels: colour.repeat(width * height) }
    }

    /// Ignored outside of the picture.
    pub fn set(&mut self, x: usize, y: usize, colour: [u8; 3]) {
        if x < self.width && y < self.height {
            let at = 3 * (y * self.width + x);
            self.pixels[at..at + 3].copy_from_slice(&colour);
        }
    }

    pub fn get(&self, x: usize, y: usize) -> [u8; 3] {
        let at = 3 * (y * self.width + x);
        [self.pixels[at], self.pixels[at + 1], self.pixels[at + 2]]
    }

    /// Fills the columns `x` and rows `y`.
    pub fn fill(&mut self, x: std::ops::Range<usize>, y: std::ops::Range<usize>, colour: [u8; 3]) {
        for row in y {
            for column in x.clone() {
                self.set(column, row, colour);
            }
        }
    }

    /// Draws another picture with its upper left corner at (`x`, `y`).
    pub fn draw(&mut self, x: usize, y: usize, picture: &Self) {
        for row in 0..picture.height {
            for column in 0..picture.width {
                self.set(x + column, y + row, picture.get(column, row));
            }
        }
    }

    /// Every pixel as a square of `times` x `times`.
    pub fn enlarged(&self, times: usize) -> Self {
        let mut large = Self::filled(self.width * times, self.height * times, [0; 3]);
        for y in 0..self.height {
            for x in 0..self.width {
                large.fill(x * times..(x + 1) * times, y * times..(y + 1) * times, self.get(x, y));
            }
        }
        large
    }

    /// Writes ASCII with its upper left corner at (`x`, `y`).
    pub fn write(&mut self, x: usize, y: usize, text: &str, colour: [u8; 3]) {
        const SCALE: usize = LETTER_PX / 8;
        for (index, letter) in text.chars().enumerate() {
            let Some(glyph) = font8x8::BASIC_FONTS.get(letter) else {
                continue;
            };
            for (row, bits) in glyph.into_iter().enumerate() {
                for column in (0..8).filter(|column| bits >> column & 1 == 1) {
                    let left = x + index * LETTER_PX + column * SCALE;
                    let top = y + row * SCALE;
                    self.fill(left..left + SCALE, top..top + SCALE, colour);
                }
            }
        }
    }
}
