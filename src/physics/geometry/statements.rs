//! Statements of an OBJ file: a line, or lines that end with a backslash and the one after them.

use std::borrow::Cow;

/// A statement.
pub(super) struct Statement<'a> {
    /// Number of its first line, from 1.
    pub line: usize,
    /// Length of its lines in the file together.
    pub bytes: usize,
    /// Its lines as one, each line end a space.
    text: Cow<'a, str>,
}

/// Statements with names, which may have any character: of all others, what follows `#` is a comment.
const NAMING: [&str; 4] = ["usemtl", "g", "o", "mtllib"];

impl Statement<'_> {
    /// The first word, and what follows it.
    pub fn keyword(&self) -> (&str, &str) {
        let (keyword, rest) = split(&self.text);
        (keyword, without_comment(keyword, rest))
    }
}

/// The statements of a text that is UTF-8, for the most part; other bytes become U+FFFD.
pub(super) struct Statements<'a> {
    lines: Lines<'a>,
    lines_read: usize,
    most_bytes: usize,
}

impl<'a> Statements<'a> {
    /// `most_bytes`: length of a statement beyond which no more lines are added to it.
    pub fn of(text: &'a [u8], most_bytes: usize) -> Self {
        Self { lines: lines(text), lines_read: 0, most_bytes }
    }

    /// Number of lines of the statements so far.
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

/// The first word of a line, and what follows it.
fn split(line: &str) -> (&str, &str) {
    let line = line.trim();
    line.split_once(char::is_whitespace).unwrap_or((line, ""))
}

fn without_comment<'a>(keyword: &str, text: &'a str) -> &'a str {
    let comment = if NAMING.contains(&keyword) { None } else { text.find('#') };
    comment.map_or(text, |comment| &text[..comment])
}

/// The lines of a text; they end with a line feed, a carriage return, or both.
pub(super) fn lines(text: &[u8]) -> Lines<'_> {
    Lines(Some(text))
}

/// Lines that are left of a text; `None` after the last one.
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
        self.0 = Some(rest.strip_prefix(b"\r\n").unwrap_or(&rest[1..]));
        Some(line)
    }
}
