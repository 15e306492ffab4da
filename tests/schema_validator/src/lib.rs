//! Validation by JSON schemas for the tests.
//!
//! The library is generic throughout: a test binary that calls it compiles half of it again, optimised. Here it is compiled once.

use serde_json::Value;

/// A schema that values are held to.
pub struct Validator(jsonschema::Validator);

impl Validator {
    /// The validator of a schema of draft 2020-12, whose formats such as `date-time` count; an error says what is wrong with it.
    pub fn new(schema: &Value) -> Result<Self, String> {
        let options = jsonschema::draft202012::options().should_validate_formats(true);
        options.build(schema).map(Self).map_err(|error| error.to_string())
    }

    /// Faults that the schema finds in a value, each with its JSON pointer.
    pub fn faults(&self, value: &Value) -> Vec<String> {
        self.0.iter_errors(value).map(|error| format!("{}: {error}", error.instance_path())).collect()
    }
}
