//! Weather files: the synthetic year from end to end, rules and faults of EPW and WEA files, schedules, and files that chance has changed.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a failure is what tests are for"
)]

mod epw;
mod mutated;
mod schedules;
mod synthetic;
mod wea;

use skyduct_annual::weather::{Weather, WeatherError, read};

/// A synthetic year north of Copenhagen, made of formulas and one generator of integers (tests/reference/README.md).
const SYNTHETIC: &str = include_str!("../../../../examples/synthetic.epw");

/// Lines of a file's header.
const HEADER_LINES: usize = 8;

/// EPW file as fields: lines of its header, and records.
#[derive(Clone)]
struct Epw {
    header: Vec<String>,
    records: Vec<Vec<String>>,
}

impl Epw {
    /// The synthetic year.
    fn year() -> Self {
        let mut lines = SYNTHETIC.lines().map(str::to_owned);
        let header = lines.by_ref().take(HEADER_LINES).collect();
        let records = lines.map(|line| line.split(',').map(str::to_owned).collect()).collect();
        Self { header, records }
    }

    /// The first seven days of June of the synthetic year.
    fn week() -> Self {
        let mut epw = Self::year();
        epw.records.retain(|record| record[1] == "6" && record[2].parse::<u8>().unwrap() <= 7);
        epw.header[7] = "DATA PERIODS,1,1,Data,Thursday, 6/ 1, 6/ 7".to_owned();
        epw
    }

    fn text(&self) -> String {
        let records = self.records.iter().map(|record| record.join(","));
        self.header.iter().cloned().chain(records).map(|line| line + "\n").collect()
    }

    fn read(&self) -> Result<Weather, WeatherError> {
        read(self.text().as_bytes())
    }

    /// Sets a field, from 1, of a record, from 0.
    fn with(mut self, record: usize, field: usize, value: &str) -> Self {
        self.records[record][field - 1] = value.to_owned();
        self
    }

    /// Sets a line of the header, from 1.
    fn with_header(mut self, line: usize, text: &str) -> Self {
        self.header[line - 1] = text.to_owned();
        self
    }
}

/// Asserts that a file is refused in a line, and in a field if one is given (0: the whole line).
fn refused(read: Result<Weather, WeatherError>, line: usize, field: usize) {
    let error = read.expect_err("the file must be refused");
    assert_eq!((error.line, error.field.map_or(0, |field| field.number)), (line, field), "{error}");
}
