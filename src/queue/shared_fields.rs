//! Division of the documents of jobs that belong together: fields that are the same in them are kept once.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// Fields of some documents, each by its name with the value that the first document with such a field had.
#[derive(Clone, Debug, Default)]
pub struct SharedFields(Map<String, Value>);

/// Remainder of a document beside the fields that it shares with others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OwnFields {
    /// Names of the fields that it shares.
    shared: Vec<String>,
    /// Other fields.
    own: Map<String, Value>,
}

impl OwnFields {
    /// Gives a field a value of this document's own.
    pub fn set(&mut self, field: &str, value: Value) {
        self.shared.retain(|name| name != field);
        self.own.insert(field.to_owned(), value);
    }
}

impl SharedFields {
    /// Divides a document into shared fields and its own; fields that no document before had are shared from now on.
    pub fn divide(&mut self, document: Map<String, Value>) -> OwnFields {
        let mut divided = OwnFields { shared: Vec::new(), own: Map::new() };
        for (name, value) in document {
            if *self.0.entry(&name).or_insert_with(|| value.clone()) == value {
                divided.shared.push(name);
            } else {
                divided.own.insert(name, value);
            }
        }
        divided
    }

    /// Returns the fields as JSON.
    pub fn into_value(self) -> Value {
        Value::Object(self.0)
    }
}

/// Rebuilds the document from which `own` (JSON of [`OwnFields`]) was divided; `shared` is the JSON of the shared fields.
pub fn joined(shared: &str, own: &str) -> serde_json::Result<Value> {
    let mut shared: Map<String, Value> = serde_json::from_str(shared)?;
    let divided: OwnFields = serde_json::from_str(own)?;
    let mut document = divided.own;
    document.extend(divided.shared.into_iter().filter_map(|name| shared.remove_entry(&name)));
    Ok(Value::Object(document))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// Documents with any fields are rebuilt as they were, and a field that several have in common is kept once.
    #[test]
    fn documents_come_back_as_they_were() {
        let long = "a long text ".repeat(100);
        let documents = [
            json!({ "a": long, "seed": 1, "stop": { "x": 0.1 } }),
            json!({ "a": long, "seed": 2, "stop": { "x": 0.1 }, "views": [1.5e-7, null] }),
            json!({ "seed": 3, "views": [] }),
            json!({ "a": "short", "shared": ["a"], "own": {} }),
            json!({}),
        ];
        let mut shared = SharedFields::default();
        let own = documents.clone().map(|document| shared.divide(document.as_object().unwrap().clone()));
        let of_third = own[2].clone();
        let own = own.map(|own| serde_json::to_string(&own).unwrap());
        let shared = shared.into_value().to_string();
        assert_eq!(own.iter().chain([&shared]).filter(|text| text.contains(&long)).count(), 1);
        for (document, own) in documents.iter().zip(&own) {
            assert_eq!(joined(&shared, own).unwrap(), *document);
        }
        let mut other = of_third;
        other.set("seed", json!(9));
        other.set("views", json!([1]));
        let other = serde_json::to_string(&other).unwrap();
        assert_eq!(joined(&shared, &other).unwrap(), json!({ "seed": 9, "views": [1] }));
    }
}
