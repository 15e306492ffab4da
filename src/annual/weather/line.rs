//! Lines of weather files and their fields.

use std::borrow::Cow;
use std::fmt::{self, Display};
use std::ops::RangeInclusive;

/// Most fields of a line that are kept: records have 35. Without a bound, a file of commas would take many times its length of memory.
const MOST_FIELDS: usize = 100;

/// Field of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// Number of the field in its line, from 1.
    pub number: usize,
    /// Name for people.
    pub name: &'static str,
}

/// Error in a weather file, with the number of its line and, if there is one, the field.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct WeatherError {
    /// Number of the line, from 1; the last one read for errors of the whole file.
    pub line: usize,
    /// Field of the line.
    pub field: Option<Field>,
    /// Description of the error, worded for the user of the file.
    pub detail: String,
}

impl Display for WeatherError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { line, field, detail } = self;
        match field {
            Some(Field { number, name }) => write!(f, "line {line}, field {number} ({name}): {detail}"),
            None => write!(f, "line {line}: {detail}"),
        }
    }
}

impl WeatherError {
    /// Returns an error of a whole line.
    pub(super) fn of_line(line: usize, detail: impl Into<String>) -> Self {
        Self { line, field: None, detail: detail.into() }
    }
}

/// Line of a file, divided into fields without blanks around them.
#[derive(Debug)]
pub(super) struct Line<'a> {
    /// Number of the line, from 1.
    pub number: usize,
    pub fields: Vec<Cow<'a, str>>,
}

impl<'a> Line<'a> {
    /// Divides a line at commas.
    pub fn at_commas(number: usize, text: &'a str) -> Self {
        Self { number, fields: text.split(',').take(MOST_FIELDS).map(|field| Cow::Borrowed(field.trim())).collect() }
    }

    /// Divides a line at blanks.
    pub fn at_blanks(number: usize, text: &'a str) -> Self {
        Self { number, fields: text.split_whitespace().take(MOST_FIELDS).map(Cow::Borrowed).collect() }
    }

    /// Divides a line at commas that are not in quotation marks (RFC 4180).
    pub fn quoted(number: usize, text: &str) -> Self {
        let (mut written, mut ends) = (vec![0; text.len() + 1], vec![0; MOST_FIELDS]);
        let mut reader = csv_core::Reader::new();
        let (.., bytes, fields) = reader.read_record(text.as_bytes(), &mut written, &mut ends);
        // the end of the line ends the last field, also one whose quotation mark is missing
        let (.., more) = reader.read_record(&[], &mut written[bytes..], &mut ends[fields..]);
        let starts = [0].into_iter().chain(ends.iter().copied());
        let field = |(start, end): (usize, &usize)| {
            let text = String::from_utf8_lossy(&written[start..*end]);
            Cow::Owned(text.trim().to_owned())
        };
        Self { number, fields: starts.zip(&ends[..fields + more]).map(field).collect() }
    }

    /// Returns an error of a field.
    pub fn error(&self, field: Field, detail: impl Into<String>) -> WeatherError {
        WeatherError { line: self.number, field: Some(field), detail: detail.into() }
    }

    /// Returns the text of a field; empty if the line ends before it.
    pub fn text(&self, field: Field) -> &str {
        self.fields.get(field.number - 1).map_or("", |text| text)
    }

    /// Returns the finite number in a field.
    pub fn value(&self, field: Field) -> Result<f64, WeatherError> {
        let text = self.text(field);
        let value: Option<f64> = text.parse().ok();
        value.filter(|value| value.is_finite()).ok_or_else(|| match text {
            "" => self.error(field, "must be a number, but is empty"),
            _ => self.error(field, format!("must be a number, but is \"{}\"", shortened(text))),
        })
    }

    /// Returns the number in a field, which must be in a range.
    pub fn within(&self, field: Field, range: RangeInclusive<f64>) -> Result<f64, WeatherError> {
        let value = self.value(field)?;
        let (low, high) = (range.start(), range.end());
        let outside = || self.error(field, format!("must be within {low}..{high}, but is {value}"));
        range.contains(&value).then_some(value).ok_or_else(outside)
    }

    /// Returns the whole number in a field, which must be in a range.
    pub fn whole(&self, field: Field, range: RangeInclusive<u8>) -> Result<u8, WeatherError> {
        let value = self.within(field, f64::from(*range.start())..=f64::from(*range.end()))?;
        let whole = value.fract() == 0.0;
        whole.then_some(value as u8).ok_or_else(|| self.error(field, format!("must be a whole number, but is {value}")))
    }
}

/// Returns the beginning of a text for a message.
fn shortened(text: &str) -> String {
    text.chars().take(40).collect()
}

/// Returns the text of a file: UTF-8, with or without its mark, or else Latin-1, which cities with accents are often written in.
pub(super) fn text_of(bytes: &[u8]) -> Cow<'_, str> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    match std::str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => Cow::Owned(bytes.iter().copied().map(char::from).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commas_in_quotation_marks_divide_nothing() {
        let fields = |text: &'static str| Line::quoted(1, text).fields;
        assert_eq!(fields(r#"COMMENTS 1,"a, ""b""", c "d" "#), ["COMMENTS 1", r#"a, "b""#, r#"c "d""#]);
        assert_eq!(fields(r#"a,"never closed, b"#), ["a", "never closed, b"]);
        assert_eq!(fields("a,"), ["a", ""]);
        assert_eq!(fields("é,b"), ["é", "b"]);
        assert!(fields("").is_empty());
    }

    #[test]
    fn numbers_are_finite() {
        let line = Line::at_commas(7, "-0.00, 1. ,.5,NaN,inf,1e400,,x");
        let value = |number| line.value(Field { number, name: "some" });
        assert_eq!([1, 2, 3].map(|number| value(number).unwrap()), [0.0, 1.0, 0.5]);
        for number in 4..=9 {
            let error = value(number).unwrap_err();
            assert_eq!((error.line, error.field.unwrap().number), (7, number), "{error}");
        }
    }

    #[test]
    fn bytes_are_utf8_or_else_latin_1() {
        assert_eq!(text_of(b"\xef\xbb\xbfZ\xc3\xbcrich"), "Zürich");
        assert_eq!(text_of(b"Z\xfcrich"), "Zürich");
    }
}
