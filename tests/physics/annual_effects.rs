//! Years without the light of their skies or of their suns.

use serde_json::{Value, json};
use skyduct::present::outputs::{Annual, Format};

use crate::annual::{classroom, file, prepared, summary};

/// A year whose skies or suns are switched off has exactly the light of the others: of tubes, at points, and by the hour, by responses and by moments,
/// before a horizon and bright ground. The plan says so, and how much is left out.
#[test]
fn what_is_switched_off_gives_no_light_over_the_year() {
    let mut document = classroom();
    document["tubes"] = json!([document["tubes"][0]]);
    document["grids"][0]["cells"] = json!([3, 2]);
    document["annual"]["period"] = json!({ "from": "06-01", "to": "06-07" });
    document["stop"] = json!({ "relative_error": 0.05 });
    let of = |document: &Value, effects: Value| {
        let mut document = document.clone();
        document["effects"] = effects;
        let prepared = prepared(&document);
        let year = summary(&prepared, 8);
        let hours = String::from_utf8(file(&prepared, 8, Annual::Hours, Format::Csv)).unwrap();
        let head: Vec<&str> = hours.lines().next().unwrap().split(',').collect();
        let column = |name: &str| head.iter().position(|column| *column == name).unwrap();
        let sum = |name: &str| -> f64 {
            let fields = hours.lines().skip(1).map(|row| row.split(',').nth(column(name)).unwrap());
            fields.map(|field| field.parse::<f64>().unwrap()).sum()
        };
        let lumens = [sum("tube_1_sky_lm"), sum("tube_1_sun_lm")];
        let grid = year.grids[0].clone();
        (prepared, lumens, grid.exposure_klxh.value, year.outside.direct_klxh)
    };
    for diffuser in [classroom()["tubes"][0]["diffuser"].clone(), json!({ "kind": "clear", "transmittance": 0.8 })] {
        document["tubes"][0]["diffuser"] = diffuser;
        let (all, lumens, klxh, outside) = of(&document, json!({}));
        let sun = &all.plan.effects.list[1];
        assert!(sun.on && sun.reason.contains("the sun of every moment"), "{sun:?}");
        let (no_sun, without_sun, of_skies, same_outside) = of(&document, json!({ "sun": "off" }));
        let (no_sky, without_sky, of_suns, _) = of(&document, json!({ "sky": "off" }));
        assert_eq!((without_sun, without_sky, same_outside), ([lumens[0], 0.0], [0.0, lumens[1]], outside));
        assert!(of_skies > 0.1 * klxh && of_suns > 0.1 * klxh);
        assert!(((of_skies + of_suns) / klxh - 1.0).abs() < 1e-6, "{of_skies} {of_suns} {klxh}");
        for (prepared, name, index) in [(&no_sky, "sky", 0), (&no_sun, "sun", 1)] {
            let plan = &prepared.plan.effects.list[index];
            assert!(!plan.on && plan.reason.contains("of the year give no light"), "{plan:?}");
            let words = format!("the effect {name} is switched off, but the scene calls for it: about ");
            assert!(
                prepared.warnings.iter().any(|warning| warning.detail.starts_with(&words)),
                "{:?}",
                prepared.warnings
            );
        }
        let surroundings = json!({ "horizon": [[0, 20]], "luminance_ratio": 0.2, "ground_reflectance": 0.3 });
        let around = json!({ "kind": "flat", "transmittance": 0.9, "tilt_deg": 35, "azimuth_deg": 180 });
        let mut before = document.clone();
        before["surroundings"] = surroundings;
        before["tubes"][0]["collector"] = around;
        before["grids"][0]["estimate"] = json!("cell_average");
        let (_, lumens, none, _) = of(&before, json!({ "sky": "off", "sun": "off" }));
        assert_eq!((lumens, none), ([0.0; 2], 0.0));
        let (_, lumens, of_suns, _) = of(&before, json!({ "sky": "off" }));
        assert!(lumens[0] == 0.0 && lumens[1] > 0.0 && of_suns > 0.0);
    }
}
