//! The report as Markdown with figures.

use std::fmt::Write as _;
use std::path::Path;

use super::{Section, Table};

/// Writes `validation.md` and the figures in the folder `validation` into `out`, which is made when it is not there.
pub fn write(sections: &[Section], out: &Path) -> std::io::Result<()> {
    let figures = out.join("validation");
    std::fs::create_dir_all(&figures)?;
    for figure in sections.iter().flat_map(|section| &section.figures) {
        std::fs::write(figures.join(figure.file), &figure.svg)?;
    }
    std::fs::write(out.join("validation.md"), report(sections))
}

fn report(sections: &[Section]) -> String {
    let checks = || sections.iter().flat_map(|section| &section.checks);
    let compared: usize = checks().map(|check| check.compared).sum();
    let failed = checks().filter(|check| !check.passed()).count();
    let mut text = format!(
        "# Validation\n\n\
         skyduct {} validated against closed forms, published tables and independent programs. `skyduct validate` runs\n\
         every case anew and writes this page; nothing in it is typed by hand. {compared} comparisons in {} checks, of\n\
         which {failed} failed. \"Validated against\" means: deterministic values agree within the stated error of the\n\
         reference, random ones within the stated number of standard errors.\n",
        env!("CARGO_PKG_VERSION"),
        checks().count(),
    );
    for section in sections {
        let Section { title, text: what, checks, tables, figures } = section;
        text += &format!("\n## {title}\n\n{what}\n\n");
        text += "| check | compared | worst deviation | allowed | |\n| --- | ---: | ---: | ---: | --- |\n";
        for check in checks {
            let verdict = if check.passed() { "passed" } else { "**failed**" };
            let (worst, limit) = (number(check.worst), number(check.limit));
            // writing to a String does not fail
            let _ = writeln!(
                text,
                "| {} | {} | {worst} | {limit} {} | {verdict} |",
                check.name, check.compared, check.unit
            );
        }
        tables.iter().for_each(|table| text += &format!("\n{}:\n\n{}", table.caption, rows(table)));
        for figure in figures {
            text += &format!("\n![{0}](validation/{1})\n\n{0}\n", figure.caption, figure.file);
        }
    }
    text
}

fn rows(table: &Table) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let rule = vec!["---:".to_owned(); table.head.len()];
    let rows = table.rows.iter().map(|row| line(row));
    [line(&table.head), line(&rule)].into_iter().chain(rows).collect()
}

/// Three digits, with an exponent where the number is small.
fn number(value: f64) -> String {
    if value == 0.0 || (0.01..1000.0).contains(&value) { format!("{value:.3}") } else { format!("{value:.1e}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::validation::Check;

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
            ..Section::default()
        };
        let text = report(&[section]);
        assert!(text.contains("9 comparisons in 3 checks, of\nwhich 2 failed"), "{text}");
        assert!(text.contains("| h |\n| ---: |\n| 1 |"));
    }
}
