//! Faults of the parameters of a query, collected so that all are reported at once.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer};

use crate::document::FieldError;
use crate::http::problem::Problem;

/// Reads a parameter that is a whole number of 1 to `MOST`.
pub fn up_to<'de, D: Deserializer<'de>, const MOST: u32>(source: D) -> Result<Option<u32>, D::Error> {
    let text = String::deserialize(source)?;
    let number = text.parse().ok().filter(|number| (1..=MOST).contains(number));
    number.map(Some).ok_or_else(|| D::Error::custom(format!("must be 1 to {MOST}, but is {text}")))
}

/// Refuses a number that is not above 0, and infinity.
pub fn check_positive(parameter: &str, value: Option<f64>) -> Result<(), Problem> {
    match value.filter(|value| !(value.is_finite() && *value > 0.0)) {
        Some(value) => {
            Err(Problem::invalid_parameter(parameter, format!("must be above 0 and finite, but is {value}")))
        }
        None => Ok(()),
    }
}

/// Faults of the parameters, each with the parameter's name.
#[derive(Default)]
pub struct QueryFaults {
    pub found: Vec<FieldError>,
}

impl QueryFaults {
    /// Adds a fault, and returns `None` for the value.
    pub fn refuse<T>(&mut self, parameter: &str, detail: impl Into<String>) -> Option<T> {
        self.found.push(FieldError::of_parameter(parameter, detail));
        None
    }

    /// Reads a number within `lowest` and `highest`, both included; the smallest positive number as `lowest` stands for "above 0".
    pub fn number(&mut self, parameter: &str, text: &str, lowest: f64, highest: f64) -> Option<f64> {
        let number: Option<f64> = text.trim().parse().ok();
        match number {
            Some(number) if number >= lowest && number <= highest => Some(number),
            Some(number) if lowest == f64::MIN_POSITIVE => {
                let most = if highest == f64::MAX { String::new() } else { format!(" and <= {highest}") };
                self.refuse(parameter, format!("must be > 0{most}, but is {number}"))
            }
            Some(number) if highest == f64::MAX => {
                self.refuse(parameter, format!("must be a number >= {lowest}, but is {number}"))
            }
            Some(number) => self.refuse(parameter, format!("must be within {lowest}..{highest}, but is {number}")),
            None => self.refuse(parameter, format!("must be a number, but is {text:?}")),
        }
    }
}
