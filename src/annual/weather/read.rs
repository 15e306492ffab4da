//! Reading of weather files.

use super::line::{WeatherError, text_of};
use super::types::{Format, Weather};
use super::{complete, epw, wea};

/// Reads a weather file; without a format, the first word says which one it is.
pub fn read(bytes: &[u8], format: Option<Format>) -> Result<Weather, WeatherError> {
    let text = text_of(bytes);
    // old editors end a file with the character 26
    let text = text.trim_end_matches(|c: char| c.is_whitespace() || c == '\u{1a}');
    let lines = text.lines().enumerate().map(|(k, line)| (k + 1, line));
    let rows = match format.or_else(|| format_of(text)) {
        Some(Format::Epw) => epw::read(lines)?,
        Some(Format::Wea) => wea::read(lines)?,
        None => {
            let detail = "the file must begin with LOCATION (EPW) or place (WEA)";
            return Err(WeatherError::of_line(1, detail));
        }
    };
    complete::weather(rows)
}

fn format_of(text: &str) -> Option<Format> {
    let word = text.split([',', ' ', '\t', '\r', '\n']).next().unwrap_or_default();
    match word {
        "place" => Some(Format::Wea),
        word if word.eq_ignore_ascii_case("location") => Some(Format::Epw),
        _ => None,
    }
}
