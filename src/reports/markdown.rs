//! Reports as Markdown with figures.

use std::fmt::Write as _;
use std::path::Path;

use super::page::{Check, Figure, Report, Section, Table};

/// Writes the page `name.md` and its figures, in the folder `name`, into the folder `out`, which is created if needed.
pub fn write(report: &Report, out: &Path) -> std::io::Result<()> {
    let folder = out.join(report.name);
    std::fs::create_dir_all(&folder)?;
    for Figure { file, bytes, .. } in report.sections.iter().flat_map(|section| &section.figures) {
        std::fs::write(folder.join(file), bytes)?;
    }
    std::fs::write(out.join(report.name).with_extension("md"), page(report))
}

fn page(report: &Report) -> String {
    let mut text = format!("# {}\n\n{}\n{}", report.title, report.introduction, summary(report));
    for Section { title, text: what, checks, tables, figures, conclusion } in &report.sections {
        text += &format!("\n## {title}\n\n{what}\n");
        if !checks.is_empty() {
            text += &table_of(checks);
        }
        tables.iter().for_each(|table| text += &format!("\n{}:\n\n{}", table.caption, rows(table)));
        for figure in figures {
            text += &format!("\n![{0}]({1}/{2})\n\n{0}\n", figure.caption, report.name, figure.file);
        }
        if !conclusion.is_empty() {
            text += &format!("\n{conclusion}\n");
        }
    }
    text
}

/// Returns a line for each section with checks or a conclusion: the number of checks and of failures, and the first sentence of
/// the conclusion.
fn summary(report: &Report) -> String {
    let line = |Section { title, checks, conclusion, .. }: &Section| {
        let failed = checks.iter().filter(|check| !check.passed()).count();
        let nearest = checks.iter().map(|check| check.worst / check.limit).filter(|share| share.is_finite());
        let nearest = nearest.fold(0.0, f64::max);
        let count = match checks.len() {
            0 => String::new(),
            1 => format!("one check, whose deviation is {:.0} % of the allowed one", 100.0 * nearest),
            count => format!("{count} checks, whose largest deviation is {:.0} % of the allowed one", 100.0 * nearest),
        };
        let failed = if failed > 0 { format!(", **{failed} failed**") } else { String::new() };
        let parts = [format!("{count}{failed}"), first_sentence(conclusion).to_owned()];
        let parts: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
        (!parts.is_empty()).then(|| format!("- **{title}**: {}\n", parts.join(". ")))
    };
    let lines: String = report.sections.iter().filter_map(line).collect();
    if lines.is_empty() { lines } else { format!("\nIn short:\n\n{lines}") }
}

/// Returns the text up to the first full stop before a capital letter, or else the whole first paragraph; a paragraph that only
/// introduces a list is skipped.
fn first_sentence(text: &str) -> &str {
    let text = text.split("\n\n").find(|paragraph| !paragraph.ends_with(':')).unwrap_or(text);
    let text = text.strip_prefix("- ").unwrap_or(text);
    let ends = text.match_indices(". ").find(|(at, _)| text[at + 2..].starts_with(char::is_uppercase));
    ends.map_or(text, |(at, _)| &text[..=at])
}

fn table_of(checks: &[Check]) -> String {
    let mut text =
        "\n| check | compared | worst deviation | allowed | |\n| --- | ---: | ---: | ---: | --- |\n".to_owned();
    for check in checks {
        let verdict = if check.passed() { "passed" } else { "**failed**" };
        let (worst, limit) = (number(check.worst), number(check.limit));
        // writing to a String does not fail
        let _ =
            writeln!(text, "| {} | {} | {worst} | {limit} {} | {verdict} |", check.name, check.compared, check.unit);
    }
    text
}

fn rows(table: &Table) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let rule = vec!["---:".to_owned(); table.head.len()];
    let rows = table.rows.iter().map(|row| line(row));
    [line(&table.head), line(&rule)].into_iter().chain(rows).collect()
}

/// Formats a number with three decimals, or with an exponent below 0.01 and from 1000 on.
fn number(value: f64) -> String {
    if value == 0.0 || (0.01..1000.0).contains(&value) { format!("{value:.3}") } else { format!("{value:.1e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failures_are_named() {
        let check = |worst: f64| Check { name: "a".to_owned(), compared: 3, worst, limit: 1.0, unit: "x" };
        let section = Section {
            title: "T".to_owned(),
            checks: vec![check(0.5), check(2.0), check(f64::INFINITY)],
            tables: vec![Table {
                caption: "c".to_owned(),
                head: vec!["h".to_owned()],
                rows: vec![vec!["1".to_owned()]],
            }],
            conclusion: "Bright by 0.3 inch. So.".to_owned(),
            ..Section::default()
        };
        let text = page(&Report { name: "n", title: "R", introduction: "I.".to_owned(), sections: vec![section] });
        let short = "- **T**: 3 checks, whose largest deviation is 200 % of the allowed one, **2 failed**. Bright by \
                     0.3 inch.";
        assert!(text.starts_with(&format!("# R\n\nI.\n\nIn short:\n\n{short}\n\n## T\n")), "{text}");
        assert_eq!(text.matches("**failed**").count(), 2);
        assert!(text.contains("| h |\n| ---: |\n| 1 |"));
        assert!(text.ends_with("\nBright by 0.3 inch. So.\n"));
        assert_eq!(summary(&Report::default()), "");
    }

    #[test]
    fn a_sentence_is_the_first_of_what_follows() {
        assert_eq!(first_sentence("Bright by 0.3 inch. So."), "Bright by 0.3 inch.");
        assert_eq!(first_sentence("What they say:\n\n- One of 2. Two.\n- Three."), "One of 2.");
        assert_eq!(first_sentence("All of it\n\nOr more"), "All of it");
        assert_eq!(first_sentence(""), "");
    }
}
