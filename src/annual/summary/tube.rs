//! Lumens of a tube over a year.

use std::f64::consts::PI;

use crate::fluxes::TubeYear;
use crate::light::{LitMoment, by_record};
use crate::metrics::Value;
use crate::metrics::glare::ClosureLuminance;
use crate::response::{RecordLight, TubeRecord};
use crate::weather::Weather;

use super::Hours;

/// Light of a tube over a year, or of the sky outside.
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
    /// Luminance of the closure.
    pub luminance: ClosureLuminance,
}

/// Light outside over a year.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outside {
    /// Diffuse horizontal illuminance in klx h.
    pub diffuse_klxh: f64,
    /// Horizontal illuminance of the sun in klx h.
    pub direct_klxh: f64,
    /// Median of the diffuse horizontal illuminance over the daylight hours of EN 17037, in lux.
    pub median_diffuse_lux: f64,
    /// Number of records with light.
    pub lit_records: usize,
}

impl Outside {
    /// Adds up the moments of a year.
    pub(super) fn new(lit: &[LitMoment], hours: &Hours, lit_records: usize) -> Self {
        let sum = |of: fn(&LitMoment) -> f64| 1e-3 * hours.each * lit.iter().map(|at| at.share * of(at)).sum::<f64>();
        let (diffuse, _) = by_record(lit, hours.daylight.len());
        let counting = diffuse.iter().zip(hours.daylight).filter(|(_, counts)| **counts);
        let mut counting: Vec<f64> = counting.map(|(lux, _)| *lux).collect();
        counting.sort_unstable_by(f64::total_cmp);
        let last = counting.len().saturating_sub(1);
        let at = |place: usize| counting.get(place).copied().unwrap_or(0.0);
        Self {
            diffuse_klxh: sum(|moment| moment.diffuse_horizontal_lux),
            direct_klxh: sum(LitMoment::direct_horizontal_lux),
            median_diffuse_lux: 0.5 * (at(last / 2) + at(last - last / 2)),
            lit_records,
        }
    }
}

impl TubeSummary {
    /// Sums up the year of tube `number`, whose closure has a `radius` in m.
    pub(super) fn new(
        (number, year, radius): (usize, &TubeYear, f64),
        lit: &[LitMoment],
        light: &RecordLight,
        weather: &Weather,
        hours: &Hours,
        outside: &Outside,
    ) -> Self {
        let none: &[TubeRecord] = &[];
        let lights = light.tubes.get(number).map_or(none, Vec::as_slice);
        let mut summary = Self {
            luminance: ClosureLuminance::new(lights, &light.records, hours.occupied, radius, hours.each),
            ..Self::default()
        };
        for (of_record, record) in lights.iter().zip(&light.records) {
            let klm_h = 1e-3 * hours.each * of_record.lumens;
            summary.klm_h.value += klm_h;
            summary.largest_lm = summary.largest_lm.max(of_record.lumens);
            if hours.occupied.get(*record) == Some(&true) {
                summary.occupied_klm_h += klm_h;
            }
            let month = weather.records.get(*record).map_or(0, |record| usize::from(record.month));
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
