//! JSON pointers and the list of what is wrong.

use std::fmt::Display;

use super::{FieldError, hints};

/// `token` escaped for a JSON pointer (RFC 6901, section 3).
pub fn escape(token: &str) -> String {
    token.replace('~', "~0").replace('/', "~1")
}

/// Collects everything that is wrong with a document.
#[derive(Default)]
pub struct Checks {
    pub errors: Vec<FieldError>,
}

impl Checks {
    pub fn refuse(&mut self, pointer: impl Into<String>, detail: impl Into<String>) {
        self.errors.push(FieldError { pointer: pointer.into(), detail: detail.into() });
    }

    /// Refuses what the engine cannot compute yet.
    pub fn not_supported(&mut self, pointer: impl Into<String>, what: impl Display) {
        self.refuse(pointer, format!("{what}: not supported yet"));
    }

    /// Refuses unless `lowest <= value <= highest`.
    pub fn within<T: PartialOrd + Display>(&mut self, pointer: &str, value: T, lowest: T, highest: T) -> bool {
        let ok = value >= lowest && value <= highest;
        if !ok {
            let [number, from, to] = [&value, &lowest, &highest].map(number);
            let hint = hints::of_number(pointer, number, |meant| meant >= from && meant <= to);
            self.refuse(pointer, format!("must be within {lowest}..{highest}, but is {value}{hint}"));
        }
        ok
    }

    /// Refuses unless `bound < value <= highest`.
    pub fn above(&mut self, pointer: &str, value: f64, bound: f64, highest: f64) -> bool {
        let ok = value > bound && value <= highest;
        if !ok {
            let hint = hints::of_number(pointer, value, |meant| meant > bound && meant <= highest);
            self.refuse(pointer, format!("must be > {bound} and <= {highest}, but is {value}{hint}"));
        }
        ok
    }
}

/// A number of any type, read back from its digits; NaN of what is no number.
fn number(printed: &impl Display) -> f64 {
    printed.to_string().parse().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    #[test]
    fn escapes_of_rfc_6901() {
        assert_eq!(super::escape("a/b~c"), "a~1b~0c");
    }
}
