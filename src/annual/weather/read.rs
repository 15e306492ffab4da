//! Reading of weather files.

use super::file::Weather;
use super::line::{WeatherError, text_of};
use super::{complete, epw, wea};

/// Reads a weather file, whose first word says which kind it is.
pub fn read(bytes: &[u8]) -> Result<Weather, WeatherError> {
    let text = text_of(bytes);
    // old editors end a file with the character 26
    let text = text.trim_end_matches(|c: char| c.is_whitespace() || c == '\u{1a}');
    let lines = text.lines().enumerate().map(|(k, line)| (k + 1, line));
    let word = text.split([',', ' ', '\t', '\r', '\n']).next().unwrap_or_default();
    let rows = match word {
        "place" => wea::read(lines)?,
        word if word.eq_ignore_ascii_case("location") => epw::read(lines)?,
        _ => return Err(WeatherError::of_line(1, "the file must begin with LOCATION (EPW) or place (WEA)")),
    };
    complete::weather(rows)
}
