//! Years of grids with cells in solids, which have no values.

use serde_json::{Value, json};
use skyduct::output::npy;
use skyduct::present::outputs::{Annual, Format};

use crate::annual::{classroom, file, prepared};

/// Checks that cells in a cupboard are null in every file of a year and count in no statistic, by responses and by traced moments.
#[test]
fn cells_in_solids_have_no_year() {
    let mut document = classroom();
    let cupboard =
        json!({ "kind": "box", "size_m": [3, 2, 2], "position_m": [1.5, 1, 0], "surface": { "reflectance": 0.5 } });
    document["room"]["objects"] = json!([cupboard]);
    document["grids"][0]["cells"] = json!([4, 3]);
    document["annual"]["period"] = json!({ "from": "06-10", "to": "06-20" });
    document["stop"] = json!({ "relative_error": 0.05 });
    let mut clear = document.clone();
    clear["tubes"][0]["diffuser"] = json!({ "kind": "clear", "transmittance": 0.9 });
    for document in [document, clear] {
        let prepared = prepared(&document);
        let bytes = |format: Format| file(&prepared, 2, Annual::Points("desks".to_owned()), format);
        let points: Value = serde_json::from_slice(&bytes(Format::Json)).unwrap();
        let nulls =
            |column: &Value| column["values"].as_array().unwrap().iter().filter(|value| value.is_null()).count();
        let columns = points["columns"].as_array().unwrap();
        let gaps = nulls(&columns[0]);
        assert!((1..12).contains(&gaps), "{gaps}");
        assert!(columns.iter().all(|column| nulls(column) == gaps), "{points}");
        let csv = String::from_utf8(bytes(Format::Csv)).unwrap();
        assert_eq!(csv.lines().count(), 13);
        let array = npy::decode(&bytes(Format::Npy)).unwrap();
        let [rows, columns] = array.shape;
        let without =
            (0..rows).filter(|row| array.values[row * columns..(row + 1) * columns].iter().all(|lux| lux.is_nan()));
        assert_eq!((rows, columns, without.count()), (12, 11 * 24, gaps));
        let summary: Value = serde_json::from_slice(&file(&prepared, 2, Annual::Summary, Format::Json)).unwrap();
        let autonomy = summary["grids"][0]["autonomies"][0]["da_percent"]["value"].as_f64().unwrap();
        assert!((20.0..=100.0).contains(&autonomy), "{autonomy}");
        for format in [Format::Svg, Format::Ill] {
            let part = if format == Format::Svg {
                Annual::Autonomy("desks".to_owned())
            } else {
                Annual::Points("desks".to_owned())
            };
            assert!(!file(&prepared, 2, part, format).is_empty());
        }
    }
}
