//! Colours of figures by their role, so that a figure is legible on light and dark pages.

/// Colour by its role, which differs between light and dark pages, or fixed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colour {
    /// Background of the figure.
    Paper,
    /// Letters, axes and outlines.
    Ink,
    /// Text of less weight.
    Muted,
    /// Grid lines.
    Faint,
    /// Fixed 8-bit sRGB, the same on light and dark pages.
    Fixed([u8; 3]),
}

/// Black, for letters and lines on colours that are light on any page.
pub const BLACK: Colour = Colour::Fixed([0, 0, 0]);

/// White, for letters and lines on colours that are dark on any page.
pub const WHITE: Colour = Colour::Fixed([255, 255, 255]);

/// Colours of series, distinguishable with colour vision deficiencies and on light and dark paper: those of Okabe and Ito.
pub const SERIES: [Colour; 6] = [
    Colour::Fixed([0, 114, 178]),
    Colour::Fixed([213, 94, 0]),
    Colour::Fixed([0, 158, 115]),
    Colour::Fixed([204, 121, 167]),
    Colour::Fixed([86, 180, 233]),
    Colour::Fixed([230, 159, 0]),
];

impl Colour {
    /// Returns red, green and blue on a light page.
    pub fn on_light(self) -> [u8; 3] {
        match self {
            Self::Paper => [255, 255, 255],
            Self::Ink => [27, 31, 36],
            Self::Muted => [87, 96, 106],
            Self::Faint => [221, 225, 230],
            Self::Fixed(rgb) => rgb,
        }
    }

    /// Returns red, green and blue on a dark page.
    pub fn on_dark(self) -> [u8; 3] {
        match self {
            Self::Paper => [22, 25, 29],
            Self::Ink => [232, 234, 237],
            Self::Muted => [165, 173, 182],
            Self::Faint => [56, 62, 70],
            Self::Fixed(rgb) => rgb,
        }
    }

    /// Returns the name of the CSS class by which dark pages change the colour; `None` for fixed colours.
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
