//! Lumens of a tube over a year.

use std::f64::consts::PI;

use crate::fluxes::TubeYear;
use crate::light::LitMoment;
use crate::metrics::Value;
use crate::metrics::glare::ClosureLuminance;
use crate::response::{RecordLight, TubeRecord};
use crate::weather::Record;

use super::input::Hours;
use super::outside::Outside;

/// Light of a tube over a year.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TubeSummary {
    /// Light into the room in klm h.
    pub klm_h: Value,
    /// Part of it in occupied records.
    pub occupied_klm_h: f64,
    /// Fraction of it that comes from the sky, without the sun.
    pub sky_share: f64,
    /// Light of each month in klm h.
    pub monthly_klm_h: [f64; 12],
    /// Largest mean flux of a record in lm.
    pub largest_lm: f64,
    /// Light into the room over the light that falls on a horizontal surface as large as the opening.
    pub transmission: f64,
    /// Luminance of the closure; `None` unless it is Lambertian.
    pub luminance: Option<ClosureLuminance>,
}

impl TubeSummary {
    /// Sums up the year of tube `number`, whose closure has a `radius` in m.
    pub(super) fn new(
        (number, year, radius): (usize, &TubeYear, f64),
        lit: &[LitMoment],
        light: &RecordLight,
        records: &[Record],
        hours: &Hours,
        outside: &Outside,
    ) -> Self {
        let none: &[TubeRecord] = &[];
        let lights = light.tubes.get(number).map_or(none, Vec::as_slice);
        let mut summary = Self {
            luminance: year
                .is_lambertian
                .then(|| ClosureLuminance::new(lights, &light.records, hours.occupied, radius, hours.each)),
            ..Self::default()
        };
        for (of_record, record) in lights.iter().zip(&light.records) {
            let klm_h = 1e-3 * hours.each * of_record.lumens;
            summary.klm_h.value += klm_h;
            summary.largest_lm = summary.largest_lm.max(of_record.lumens);
            if hours.occupied.get(*record) == Some(&true) {
                summary.occupied_klm_h += klm_h;
            }
            let month = records.get(*record).map_or(0, |record| usize::from(record.month));
            if let Some(of_month) = month.checked_sub(1).and_then(|month| summary.monthly_klm_h.get_mut(month)) {
                *of_month += klm_h;
            }
        }
        let of_sky = year.moments.iter().zip(lit).map(|(light, moment)| moment.share * light.sky_lm).sum::<f64>();
        let over = |part: f64, whole: f64| if whole > 0.0 { part / whole } else { 0.0 };
        summary.sky_share = over(1e-3 * hours.each * of_sky, summary.klm_h.value);
        let on_opening = PI * radius * radius * (outside.diffuse_klxh + outside.direct_klxh);
        summary.transmission = over(summary.klm_h.value, on_opening);
        summary.klm_h.standard_error = summary.klm_h.value * year.relative_error;
        summary
    }
}
