//! Colours of figures by what they are for, so that a figure can be read on a dark page, too.

/// A colour, by what it is for; fixed ones are the same on light and dark pages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colour {
    /// What a figure is drawn on.
    Paper,
    /// Letters, axes and outlines.
    Ink,
    /// Words of less weight.
    Muted,
    /// Lines of a grid.
    Faint,
    /// 8-bit sRGB.
    Fixed([u8; 3]),
}

/// Black, for letters and lines on colours that are light on any page.
pub const BLACK: Colour = Colour::Fixed([0, 0, 0]);

/// White, for letters and lines on colours that are dark on any page.
pub const WHITE: Colour = Colour::Fixed([255, 255, 255]);

/// Colours of series, apart for every eye and seen on light and dark paper: those of Okabe and Ito.
pub const SERIES: [Colour; 6] = [
    Colour::Fixed([0, 114, 178]),
    Colour::Fixed([213, 94, 0]),
    Colour::Fixed([0, 158, 115]),
    Colour::Fixed([204, 121, 167]),
    Colour::Fixed([86, 180, 233]),
    Colour::Fixed([230, 159, 0]),
];

impl Colour {
    /// Red, green and blue on a light page.
    pub fn on_light(self) -> [u8; 3] {
        match self {
            Self::Paper => [255, 255, 255],
            Self::Ink => [27, 31, 36],
            Self::Muted => [87, 96, 106],
            Self::Faint => [221, 225, 230],
            Self::Fixed(rgb) => rgb,
        }
    }

    /// Red, green and blue on a dark page.
    pub fn on_dark(self) -> [u8; 3] {
        match self {
            Self::Paper => [22, 25, 29],
            Self::Ink => [232, 234, 237],
            Self::Muted => [165, 173, 182],
            Self::Faint => [56, 62, 70],
            Self::Fixed(rgb) => rgb,
        }
    }

    /// Name of the style by which a page changes the colour; `None` of fixed ones.
    pub fn style(self) -> Option<&'static str> {
        match self {
            Self::Paper => Some("paper"),
            Self::Ink => Some("ink"),
            Self::Muted => Some("muted"),
            Self::Faint => Some("faint"),
            Self::Fixed(_) => None,
        }
    }
}
