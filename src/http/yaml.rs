//! YAML that parsers of version 1.1, still common, read as those of version 1.2 do.

/// Quotes the plain words of a document that version 1.1 would read as a truth value, a time, or a number.
pub fn for_all_versions(yaml: &str) -> String {
    let mut text_beyond = None;
    let mut lines = String::with_capacity(yaml.len());
    for line in yaml.lines() {
        let indent = line.len() - line.trim_start().len();
        // lines of a text: as they are
        if text_beyond.is_some_and(|beyond| line.is_empty() || indent > beyond) {
            lines += line;
        } else {
            let line = quoted(line);
            text_beyond = begins_text(&line).then_some(indent);
            lines += &line;
        }
        lines.push('\n');
    }
    lines
}

/// True for a line whose value is the text of the lines that follow.
fn begins_text(line: &str) -> bool {
    let last = line.rsplit(' ').next().unwrap_or(line);
    matches!(last.trim_matches(|letter: char| matches!(letter, '+' | '-') || letter.is_ascii_digit()), "|" | ">")
}

/// Quotes words of a line outside of texts: `- ` of lists, then a name with its value, or one of them.
fn quoted(line: &str) -> String {
    let mut rest = line.trim_start();
    while let Some(item) = rest.strip_prefix("- ") {
        rest = item;
    }
    let start = &line[..line.len() - rest.len()];
    let word = |word: &str| match with_point(word) {
        Some(number) => number,
        None if is_misread(word) => format!("'{word}'"),
        None => word.to_owned(),
    };
    // plain words hold no `: `
    match rest.rsplit_once(": ") {
        Some((name, value)) => format!("{start}{}: {}", word(name), word(value)),
        None => match rest.strip_suffix(':') {
            Some(name) => format!("{start}{}:", word(name)),
            None => format!("{start}{}", word(rest)),
        },
    }
}

/// Returns a number with an exponent and no point, which version 1.1 reads as text, with a point; `None` for other words.
fn with_point(word: &str) -> Option<String> {
    let (digits, exponent) = word.split_once('e')?;
    let is_whole = |digits: &str| !digits.is_empty() && digits.bytes().all(|digit| digit.is_ascii_digit());
    let (sign, power) = match exponent.strip_prefix('-') {
        Some(power) => ('-', power),
        None => ('+', exponent),
    };
    (is_whole(digits.trim_start_matches('-')) && is_whole(power)).then(|| format!("{digits}.0e{sign}{power}"))
}

/// True for a plain word that is text in version 1.2 and something else in 1.1.
fn is_misread(word: &str) -> bool {
    let is_truth = ["y", "yes", "n", "no", "on", "off"].iter().any(|truth| word.eq_ignore_ascii_case(truth));
    is_truth || matches!(word, "=" | "<<") || is_number_or_time(word)
}

/// True for a word that looks like a number, and is none as JSON writes it: 2011-09-15, 12:00, 010, 0b11, 1_000.
fn is_number_or_time(word: &str) -> bool {
    let unsigned = word.trim_start_matches(['-', '+']);
    if !unsigned.starts_with(|first: char| first.is_ascii_digit()) {
        return false;
    }
    let is_octal = unsigned.strip_prefix('0').is_some_and(|rest| rest.starts_with(|next: char| next.is_ascii_digit()));
    let is_divided = unsigned.contains([':', '-', '_']) && word.parse::<f64>().is_err();
    let of_numbers = |letter: char| letter.is_ascii_digit() || "+-._: eETtZz".contains(letter);
    is_octal || unsigned.starts_with("0b") || (is_divided && unsigned.chars().all(of_numbers))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_version_1_1_misreads_is_quoted() {
        for word in [
            "on",
            "No",
            "YES",
            "y",
            "2011-09-15",
            "2011-09-15T15:00:00+02:00",
            "2001-12-14 21:59:43.10 -5",
            "12:00",
            "-190:20:30.15",
            "010",
            "0b1010",
            "1_000",
            "<<",
            "=",
        ] {
            let [value, name] = [format!("a:\n  time: {word}\n  - - {word}\n"), format!("  - {word}:\n    x: 1\n")];
            assert_eq!(for_all_versions(&value), format!("a:\n  time: '{word}'\n  - - '{word}'\n"));
            assert_eq!(for_all_versions(&name), format!("  - '{word}':\n    x: 1\n"));
        }
    }

    #[test]
    fn exponents_need_a_point() {
        assert_eq!(for_all_versions("a: 1e-9\nb:\n- -2e12\nc: 1e\n"), "a: 1.0e-9\nb:\n- -2.0e+12\nc: 1e\n");
    }

    #[test]
    fn the_rest_stays_as_it_is() {
        let yaml = "a: true\nb: 1.5\nc: -0.25\nd: 1.0e-9\ne: null\n'on': 'off'\ng: 2 m above\nh: |-\n  on\n  at: 12:00\n\n  no\n\
                    i: '12:00'\nj: []\nk: 0\nl:\n- 0.5\n- '/v1/jobs'\n- >\n  on\nm: \"a: on\"\nv: 3.1.0\no: 1-5 m\n";
        assert_eq!(for_all_versions(yaml), yaml);
    }
}
