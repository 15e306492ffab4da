//! Statements of an OBJ file: single lines, or lines joined by a backslash at their ends.

use std::borrow::Cow;

/// One statement of an OBJ file.
pub(super) struct Statement<'a> {
    /// Number of the first line of the statement, from 1.
    pub line: usize,
    /// Total length of its lines in the file, in bytes.
    pub bytes: usize,
    /// Text of the statement, its line ends replaced by spaces.
    text: Cow<'a, str>,
}

/// Keywords of statements with names, which may contain any character; in all others `#` begins a comment.
const NAMING: [&str; 4] = ["usemtl", "g", "o", "mtllib"];

impl Statement<'_> {
    /// Returns the first word, and the rest of the statement without comment.
    pub fn keyword(&self) -> (&str, &str) {
        let (keyword, rest) = split(&self.text);
        (keyword, without_comment(keyword, rest))
    }
}

/// Iterator over the statements of a text that is mostly UTF-8; invalid bytes become U+FFFD.
pub(super) struct Statements<'a> {
    lines: Lines<'a>,
    lines_read: usize,
    most_bytes: usize,
}

impl<'a> Statements<'a> {
    /// Creates the iterator; `most_bytes` is the length of a statement beyond which no more lines are joined to it.
    pub fn of(text: &'a [u8], most_bytes: usize) -> Self {
        Self { lines: lines(text), lines_read: 0, most_bytes }
    }

    /// Returns the number of lines read so far.
    pub fn lines_read(&self) -> usize {
        self.lines_read
    }

    fn line(&mut self) -> Option<&'a [u8]> {
        let line = self.lines.next()?;
        self.lines_read += 1;
        Some(line)
    }
}

impl<'a> Iterator for Statements<'a> {
    type Item = Statement<'a>;

    fn next(&mut self) -> Option<Statement<'a>> {
        let first = self.line()?;
        let mut statement =
            Statement { line: self.lines_read, bytes: first.len(), text: String::from_utf8_lossy(first) };
        let (keyword, rest) = split(&statement.text);
        // nothing but the keyword may stand before the first backslash
        let (keyword, begun) = match keyword.strip_suffix('\\').filter(|_| rest.trim().is_empty()) {
            Some(keyword) => (keyword, Some("")),
            None => (keyword, continued(keyword, rest)),
        };
        let Some(begun) = begun.filter(|_| !keyword.starts_with('#')) else { return Some(statement) };
        let keyword = keyword.to_owned();
        let mut text = format!("{keyword} {}", begun.trim_end());
        while statement.bytes <= self.most_bytes
            && let Some(line) = self.line()
        {
            statement.bytes += line.len();
            let line = String::from_utf8_lossy(line);
            let goes_on = continued(&keyword, &line);
            text.push(' ');
            text.push_str(goes_on.unwrap_or(&line).trim());
            if goes_on.is_none() {
                break;
            }
        }
        Some(Statement { text: Cow::Owned(text), ..statement })
    }
}

/// Returns the text before the backslash at the end of a statement's line; `None` where the statement ends with the line.
fn continued<'a>(keyword: &str, line: &'a str) -> Option<&'a str> {
    without_comment(keyword, line).trim_end().strip_suffix('\\')
}

/// Splits a line into its first word and the rest.
fn split(line: &str) -> (&str, &str) {
    let line = line.trim();
    line.split_once(char::is_whitespace).unwrap_or((line, ""))
}

fn without_comment<'a>(keyword: &str, text: &'a str) -> &'a str {
    let comment = if NAMING.contains(&keyword) { None } else { text.find('#') };
    comment.map_or(text, |comment| &text[..comment])
}

/// Returns the lines of a text; they end with a line feed, a carriage return, or both.
pub(super) fn lines(text: &[u8]) -> Lines<'_> {
    Lines(Some(text))
}

/// Iterator over the remaining lines of a text; `None` inside after the last one.
pub(super) struct Lines<'a>(Option<&'a [u8]>);

impl<'a> Iterator for Lines<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let text = self.0?;
        let Some(end) = text.iter().position(|byte| matches!(byte, b'\n' | b'\r')) else {
            self.0 = None;
            return Some(text);
        };
        let (line, rest) = text.split_at(end);
        // a line end ends its line, and begins none
        self.0 = Some(rest.strip_prefix(b"\r\n").unwrap_or(&rest[1..])).filter(|rest| !rest.is_empty());
        Some(line)
    }
}
