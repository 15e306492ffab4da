//! Sentences as HTML.

use crate::figure::svg::escaped;

/// Returns a sentence as HTML in which the names of fields, which stand between backticks, are code. A backtick without a partner is itself.
pub(super) fn prose(sentence: &str) -> String {
    let mut html = String::new();
    let mut rest = sentence;
    while let Some((before, (name, after))) =
        rest.split_once('`').and_then(|(before, rest)| Some((before, rest.split_once('`')?)))
    {
        html += &format!("{}<code>{}</code>", escaped(before), escaped(name));
        rest = after;
    }
    html + &escaped(rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_between_backticks_are_code() {
        assert_eq!(prose("without `sky`, `a<b` & more"), "without <code>sky</code>, <code>a&lt;b</code> &amp; more");
        assert_eq!(prose("one ` alone"), "one ` alone");
    }
}
