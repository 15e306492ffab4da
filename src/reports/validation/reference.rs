//! Reference files: CSV tables and JSON.

use std::path::Path;

use serde_json::Value;

use super::error::ValidationError;
use skyduct::sky::CieType;

/// CSV file whose rows are read by the names in its header.
pub struct CsvTable {
    file: String,
    head: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl CsvTable {
    pub fn read(folder: &Path, file: &str) -> Result<Self, ValidationError> {
        let text = std::fs::read_to_string(folder.join(file)).map_err(|error| failed(file, error))?;
        let mut lines = text.lines().filter(|line| !line.is_empty()).map(cells);
        let head = lines.next().ok_or_else(|| failed(file, "is empty"))?;
        Ok(Self { file: file.to_owned(), head, rows: lines.collect() })
    }

    pub fn rows(&self) -> impl Iterator<Item = Row<'_>> {
        self.rows.iter().map(|cells| Row { table: self, cells })
    }
}

/// Row of a table.
pub struct Row<'a> {
    table: &'a CsvTable,
    cells: &'a [String],
}

impl Row<'_> {
    pub fn text(&self, column: &str) -> Result<&str, ValidationError> {
        let index = self.table.head.iter().position(|name| name == column);
        index
            .and_then(|index| self.cells.get(index))
            .map(|cell| cell.trim())
            .ok_or_else(|| failed(&self.table.file, format!("a row has no {column}")))
    }

    pub fn number(&self, column: &str) -> Result<f64, ValidationError> {
        let text = self.text(column)?;
        text.parse().map_err(|_| failed(&self.table.file, format!("{column} is not a number: {text:?}")))
    }
}

/// Splits a line into cells; commas within quotes do not separate.
fn cells(line: &str) -> Vec<String> {
    let mut quoted = false;
    let mut cells = vec![String::new()];
    for character in line.chars() {
        match character {
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(String::new()),
            _ => {
                if let Some(cell) = cells.last_mut() {
                    cell.push(character);
                }
            }
        }
    }
    cells
}

pub fn json(folder: &Path, file: &str) -> Result<Value, ValidationError> {
    let text = std::fs::read_to_string(folder.join(file)).map_err(|error| failed(file, error))?;
    serde_json::from_str(&text).map_err(|error| failed(file, error))
}

/// Returns all numbers of nested arrays, in order.
pub fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(values) => values.iter().flat_map(numbers).collect(),
        value => value.as_f64().into_iter().collect(),
    }
}

pub fn failed(file: &str, reason: impl ToString) -> ValidationError {
    ValidationError::Reference { file: file.to_owned(), reason: reason.to_string() }
}

/// Parses the number of a sky type; an error if there is no such type.
pub fn cie_type(text: &str) -> Result<CieType, ValidationError> {
    let number = text.parse().ok().and_then(CieType::new);
    number.ok_or_else(|| failed("sky type", format!("{text:?} is not 1..16")))
}
