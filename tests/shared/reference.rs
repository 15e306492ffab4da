//! Independent reference numbers, each with its stated error; see `tests/reference/README.md`.

use std::path::PathBuf;

/// Folder of the reference files.
pub fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/reference")
}

/// Rows of a CSV file, the header left out.
pub fn rows(name: &str) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(folder().join(name)).unwrap();
    text.lines().skip(1).filter(|line| !line.is_empty()).map(cells).collect()
}

/// Cells of one line; commas within quotes do not count.
fn cells(line: &str) -> Vec<String> {
    let mut quoted = false;
    let mut cells = vec![String::new()];
    for character in line.chars() {
        match character {
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(String::new()),
            _ => cells.last_mut().unwrap().push(character),
        }
    }
    cells
}

pub fn number(cell: &str) -> f64 {
    cell.trim().parse().unwrap()
}

pub fn json(name: &str) -> serde_json::Value {
    serde_json::from_str(&std::fs::read_to_string(folder().join(name)).unwrap()).unwrap()
}

/// Fails unless |value - truth| <= relative |truth| + half the last printed digit.
#[track_caller]
pub fn assert_close(value: f64, truth: f64, relative: f64, printed: f64, what: &str) {
    let tolerance = relative * truth.abs() + printed;
    assert!((value - truth).abs() <= tolerance, "{what}: {value} is not {truth} within {tolerance}");
}
