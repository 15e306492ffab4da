//! A year that is traced moment by moment, against the same year by responses and against its kept files.

use serde_json::json;
use skyduct::document::JobDocument;
use skyduct::document::result::annual::{WithInterval, YearResult};
use skyduct::plan::YearMethod;
use skyduct::present::outputs::{Annual, Format, Output};
use skyduct::present::prepared::prepare_document;
use skyduct::present::reader::{Kept, ResultReader as _};

use crate::annual::{classroom, prepared, summary, years};
use crate::documents::{Folder, first_passes};

/// Compares a year by responses with the same year traced moment by moment, for which a second tube calls whose clear closure passes nothing,
/// by a method that tells no responses: metrics agree within four combined standard errors, lumens to the bit; there is no direct sun.
#[test]
fn a_year_moment_by_moment_is_the_same() {
    let mut by_responses = classroom();
    by_responses["tubes"] = json!([by_responses["tubes"][0]]);
    by_responses["grids"][0]["cells"] = json!([3, 3]);
    by_responses["annual"]["period"] = json!({ "from": "03-10", "to": "04-20" });
    let mut at_moments = by_responses.clone();
    let mut opaque = at_moments["tubes"][0].clone();
    opaque["centre_m"] = json!([4.5, 4.5]);
    opaque["diffuser"] = json!({ "kind": "clear", "transmittance": 0.0 });
    at_moments["tubes"].as_array_mut().unwrap().push(opaque);
    at_moments["stop"] = json!({ "relative_error": 0.02 });
    at_moments["method"] = json!("light_tracing");
    assert_eq!(prepared(&at_moments).plan.methods.year, Some(YearMethod::Moments));
    let [expected, found] =
        [(&by_responses, 8), (&at_moments, 4)].map(|(document, passes)| summary(&prepared(document), passes));
    assert_eq!(found.tubes[0].klm_h.value, expected.tubes[0].klm_h.value);
    assert_eq!((found.tubes[1].klm_h.value, found.grids[0].ase_percent), (0.0, Some(0.0)));
    assert_same(&found, &expected, 0.05);
}

/// Fails unless the metrics of the first grid agree within four combined standard errors, which must be below a fraction of the values.
#[track_caller]
fn assert_same(found: &YearResult, expected: &YearResult, most: f64) {
    let values = |result: &YearResult| {
        let grid = &result.grids[0];
        let udi = [&grid.udi.below_percent, &grid.udi.supplementary_percent, &grid.udi.autonomous_percent];
        let autonomies = grid.autonomies.iter().flat_map(|autonomy| [&autonomy.da_percent, &autonomy.cda_percent]);
        let all = autonomies.chain(udi).chain([&grid.exposure_klxh, &grid.mean_lux, &grid.median_lux]);
        all.cloned().collect::<Vec<WithInterval>>()
    };
    let error = |value: &WithInterval| (value.high - value.low) / (2.0 * 1.959_964);
    for (found, expected) in values(found).iter().zip(&values(expected)) {
        let tolerance = 4.0 * error(found).hypot(error(expected));
        assert!((found.value - expected.value).abs() <= tolerance, "{found:?} {expected:?}");
        assert!(error(found) < most * expected.value.max(2.0), "{found:?}");
    }
}

/// A Lambertian and a clear closure in one room: the light of one by responses and of the other moment by moment, added, is that of all
/// moments traced through both.
#[test]
fn tubes_of_both_kinds_are_added() {
    let mut added = classroom();
    added["tubes"] = json!([added["tubes"][0], added["tubes"][3]]);
    added["tubes"][1]["diffuser"] = json!({ "kind": "clear", "transmittance": 0.5 });
    added["grids"][0]["cells"] = json!([3, 2]);
    added["annual"]["period"] = json!({ "from": "03-10", "to": "04-10" });
    added["stop"] = json!({ "relative_error": 0.02 });
    let mut traced = added.clone();
    traced["method"] = json!("light_tracing");
    let found = [&added, &traced].map(prepared);
    assert_eq!(
        [&found[0], &found[1]].map(|of| of.plan.methods.year),
        [Some(YearMethod::Both), Some(YearMethod::Moments)]
    );
    let [found, expected] = [&found[0], &found[1]].map(|prepared| summary(prepared, 10));
    assert_same(&found, &expected, 0.12);
    assert_eq!(found.grids[0].ase_percent.is_some(), expected.grids[0].ase_percent.is_some());
}

/// Checks that a year of traced moments is made again from the files that are kept of it, to what single precision leaves.
#[test]
fn traced_moments_are_kept() {
    let mut document = classroom();
    document["tubes"] = json!([document["tubes"][0]]);
    document["tubes"][0]["diffuser"] = json!({ "kind": "clear", "transmittance": 0.9 });
    document["grids"][0]["cells"] = json!([2, 1]);
    document["annual"]["period"] = json!({ "from": "06-20", "to": "06-30" });
    document["stop"] = json!({ "relative_error": 0.05 });
    let prepared = prepared(&document);
    let estimate = first_passes(&prepared, 2);
    let files = prepared.results(&estimate).kept_files().unwrap();
    let kept = Kept {
        subject: prepared.subject().clone(),
        files: files.iter().map(|file| (file.name.clone(), file.bytes.clone())).collect(),
        tubes: Vec::new(),
        prepare: Box::new(move || {
            prepare_document(&JobDocument::parse(document.to_string().as_bytes()).unwrap(), &Folder)
        }),
        year: None,
        years: None,
    };
    let hours = Output::Annual(Annual::Hours, Format::Csv);
    let [one, other] =
        [prepared.results(&estimate).file(&hours).unwrap().unwrap().bytes, kept.file(&hours).unwrap().unwrap().bytes];
    let lux = |table: &[u8]| -> Vec<f64> {
        let table = String::from_utf8(table.to_vec()).unwrap();
        table.lines().skip(1).map(|line| line.rsplit(',').next().unwrap().parse().unwrap()).collect()
    };
    assert!(lux(&one).len() > 100 && lux(&one).iter().zip(lux(&other)).all(|(one, other)| (one - other).abs() < 0.02));
    assert!(lux(&one).iter().sum::<f64>() > 100.0);
}

/// Moments of two files are traced together: the year of the first has the bits that it has alone, that of half the light about half of it.
#[test]
fn several_weather_files_are_traced_together() {
    let mut document = classroom();
    document["tubes"] = json!([document["tubes"][0]]);
    document["tubes"][0]["diffuser"] = json!({ "kind": "clear", "transmittance": 0.9 });
    document["grids"][0]["cells"] = json!([2, 2]);
    document["annual"]["period"] = json!({ "from": "06-01", "to": "06-07" });
    document["stop"] = json!({ "relative_error": 0.05 });
    let alone = years(&prepared(&document), 2);
    document["annual"]["weather"] = json!(["synthetic.epw", "half:synthetic.epw"]);
    let found = years(&prepared(&document), 2);
    assert_eq!((&found.first, found.others.len()), (&alone.first, 1));
    let [half, whole] = [&found.others[0], &found.first].map(|year| year.grids[0].exposure_klxh.value);
    assert!(half > 0.3 * whole && half < 0.7 * whole, "{half} {whole}");
}
