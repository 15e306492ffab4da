//! Text as outlines, so that it looks the same everywhere and needs no installed font.
//!
//! The glyphs are those of Open Sans: Latin with accents, some Greek and signs. Any other character is drawn as a box.

use std::collections::BTreeMap;
use std::sync::{LazyLock, OnceLock};

use glam::DVec2;

use super::outline::{Outline, Part};

/// Outlines of the glyphs; the head of the file says how they were made.
const OPEN_SANS: &str = include_str!("letters/open_sans.txt");

/// Units of the glyphs' coordinates per size of the type (em).
pub const UNITS: f64 = 2048.0;

/// Box that is drawn for a character without a glyph.
static UNKNOWN: Letter = Letter {
    code: 0,
    advance: 1200.0,
    path: "M150 0L150 -1462L1050 -1462L1050 0ZM250 -100L950 -100L950 -1362L250 -1362Z",
    parts: OnceLock::new(),
};

/// Height of capital letters and digits, in sizes of the type.
pub const CAPITAL_HEIGHT: f64 = 1462.0 / UNITS;

/// Glyph in font units, [`UNITS`] of which are the size of the type; y points down.
pub struct Letter {
    /// Code point of the character; 0 for the box.
    pub code: u32,
    /// Advance width: distance to the origin of the next glyph.
    pub advance: f64,
    /// Outline as an SVG path.
    pub path: &'static str,
    /// Outline parsed from the path, cached at its first use.
    parts: OnceLock<Outline>,
}

impl Letter {
    fn outline(&self) -> &Outline {
        self.parts.get_or_init(|| parsed(self.path))
    }
}

static LETTERS: LazyLock<BTreeMap<char, Letter>> = LazyLock::new(|| {
    let line = |line: &'static str| {
        let mut fields = line.splitn(3, ' ');
        let code = u32::from_str_radix(fields.next()?, 16).ok()?;
        let advance = fields.next()?.parse().ok()?;
        let path = fields.next().unwrap_or("");
        Some((char::from_u32(code)?, Letter { code, advance, path, parts: OnceLock::new() }))
    };
    OPEN_SANS.lines().filter(|line| !line.starts_with('#')).filter_map(line).collect()
});

/// Returns the glyph of a character.
pub fn letter(character: char) -> &'static Letter {
    // a tab or line break in a name is a space in a figure
    let character = if character.is_whitespace() { ' ' } else { character };
    match ASCII.get(character as usize) {
        Some(letter) => letter,
        None => found(character),
    }
}

/// Glyphs of the ASCII characters, which nearly all text consists of, for fast look-up.
static ASCII: LazyLock<[&Letter; 128]> = LazyLock::new(|| std::array::from_fn(|code| found(char::from(code as u8))));

fn found(character: char) -> &'static Letter {
    LETTERS.get(&character).unwrap_or(&UNKNOWN)
}

/// True if any character of the text has an outline, i.e. is not a space.
pub fn has_ink(text: &str) -> bool {
    text.chars().any(|character| !letter(character).path.is_empty())
}

/// Returns the width of a text in pixels in type of `size`.
pub fn width(text: &str, size: f64) -> f64 {
    text.chars().map(|character| letter(character).advance).sum::<f64>() * size / UNITS
}

/// Returns the text, or as much of its beginning as fits into `most` pixels in type of `size`, followed by an ellipsis.
pub fn fitted(text: &str, size: f64, most: f64) -> String {
    if width(text, size) <= most {
        return text.to_owned();
    }
    let mut fitted = String::new();
    let mut taken = width("…", size);
    for character in text.chars() {
        taken += letter(character).advance * size / UNITS;
        if taken > most {
            break;
        }
        fitted.push(character);
    }
    format!("{}…", fitted.trim_end())
}

/// Returns the text in lines that fit into `most` pixels in type of `size`, broken between words; a longer word is cut.
pub fn wrapped(text: &str, size: f64, most: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        let longer = lines.last().map(|line| format!("{line} {word}")).filter(|line| width(line, size) <= most);
        match (longer, lines.last_mut()) {
            (Some(longer), Some(last)) => *last = longer,
            _ => lines.push(fitted(word, size, most)),
        }
    }
    lines
}

/// Returns the outline of a text in type of `size` to the right of `at`, with its base line at the height of `at`.
pub fn outline(text: &str, size: f64, at: DVec2) -> Outline {
    let mut outline = Outline::default();
    let mut pen = at;
    let scale = size / UNITS;
    for character in text.chars() {
        let letter = letter(character);
        outline.0.extend(letter.outline().mapped(|point| pen + scale * point).0);
        pen.x += scale * letter.advance;
    }
    outline
}

/// Parses an SVG path of absolute moves, lines and quadratic curves; other commands are left out.
fn parsed(path: &str) -> Outline {
    let mut outline = Outline::default();
    let mut rest = path;
    while let Some(command) = rest.chars().next() {
        let end = rest[1..].find(|c: char| c.is_ascii_uppercase()).map_or(rest.len(), |end| end + 1);
        let mut numbers = rest[1..end].split(' ').filter_map(|number| number.parse::<f64>().ok());
        let mut point = || Some(DVec2::new(numbers.next()?, numbers.next()?));
        let part = match command {
            'M' => point().map(Part::Move),
            'L' => point().map(Part::Line),
            'Q' => point().and_then(|control| Some(Part::Quadratic(control, point()?))),
            'Z' => Some(Part::Close),
            _ => None,
        };
        outline.0.extend(part);
        rest = &rest[end..];
    }
    outline
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_of_the_letters_is_read() {
        let lines = OPEN_SANS.lines().filter(|line| !line.starts_with('#'));
        assert_eq!(LETTERS.len(), lines.count());
        for (character, letter) in LETTERS.iter() {
            let outline = letter.outline();
            let commands = letter.path.chars().filter(char::is_ascii_uppercase).count();
            assert_eq!(outline.0.len(), commands, "{character}");
            assert!(letter.advance > 0.0 || outline.0.is_empty(), "{character}");
        }
        for character in "AZaz09°±×·²µ–−…æøåčďřßλθ∞≈≤".chars() {
            assert!(LETTERS.contains_key(&character), "{character}");
        }
    }

    #[test]
    fn digits_are_equally_wide_so_that_columns_of_numbers_stand_in_line() {
        let zero = width("0", 10.0);
        assert!((1..10).all(|digit: i32| width(&digit.to_string(), 10.0) == zero));
        assert!((width("00", 20.0) - 4.0 * zero).abs() < 1e-12);
    }

    #[test]
    fn long_texts_are_broken_between_words() {
        let lines = wrapped("a bathroom of four by six metres", 10.0, 80.0);
        assert!(lines.len() > 1 && lines.iter().all(|line| width(line, 10.0) <= 80.0), "{lines:?}");
        assert_eq!(lines.join(" "), "a bathroom of four by six metres");
        assert_eq!(wrapped("bath", 10.0, 5.0).len(), 1);
        assert!(wrapped(" ", 10.0, 50.0).is_empty());
    }

    #[test]
    fn long_texts_are_cut() {
        assert_eq!(fitted("bath", 10.0, 1000.0), "bath");
        let short = fitted("a bathroom of four by six metres", 10.0, 60.0);
        assert!(short.ends_with('…') && width(&short, 10.0) <= 60.0, "{short}");
        assert_eq!(outline("中", 10.0, DVec2::ZERO), outline("文", 10.0, DVec2::ZERO), "both are a box");
        assert!(!outline("中", 10.0, DVec2::ZERO).0.is_empty());
        assert!(has_ink(" 中") && !has_ink(" \t\n") && !has_ink(""));
    }
}
