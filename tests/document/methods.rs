//! Methods in documents: every one is read, understood and written by its name.

use crate::schema::DESCRIPTION;
use serde_json::{Value, json};
use skyduct::document::MethodDocument;
use skyduct::document::method::settings_json;
use skyduct::plan::MethodRequest;

fn read(value: &Value) -> MethodDocument {
    serde_json::from_value(value.clone()).unwrap_or_else(|error| panic!("{value}: {error}"))
}

#[test]
fn every_method_has_its_name_and_its_settings_in_documents_and_results() {
    let names = DESCRIPTION["components"]["schemas"]["MethodKind"]["enum"].as_array().unwrap();
    assert!(names.len() >= 10, "{names:?}");
    for name in names {
        let (by_name, by_kind) = (read(name), read(&json!({ "kind": name })));
        assert_eq!(serde_json::to_value(&by_name).unwrap(), *name);
        assert_eq!(by_name.request(), by_kind.request());
        // with all defaults filled in
        let written = serde_json::to_value(&by_kind).unwrap();
        assert_eq!(written["kind"], *name);
        assert_eq!(read(&written), by_kind);
        let MethodRequest::Method(method) = by_kind.request() else {
            assert_eq!(*name, "auto");
            continue;
        };
        assert_eq!(method.name(), name.as_str().unwrap());
        let settings = settings_json(&method);
        let shown = settings.as_object().unwrap_or_else(|| panic!("{name}: {settings}"));
        assert!(shown.iter().all(|(setting, value)| value.is_null() || written[setting] == *value), "{written}");
    }
}
