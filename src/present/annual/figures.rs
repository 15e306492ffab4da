//! Figures of a year: maps of daylight autonomy and of useful daylight over the plan, and temporal maps of light by day and hour.

use super::JobYear;
use crate::annual::summary::PointYear;
use crate::document::result::annual::WithInterval;
use crate::figure::isolines::levels;
use crate::figure::scale::{ColourScale, Palette};
use crate::figure::temporal_map::TemporalMap;
use crate::figure::ticks::{short, significant, with_error};
use crate::figure::{Drawing, Heading};
use crate::output::OutputError;
use crate::present::grid_figure::map_of_values;
use crate::present::subject::{Subject, place};
use crate::present::target::{TargetPart, WantedTarget};

impl JobYear {
    /// Draws the daylight autonomy of a grid over the plan: for the target `wanted`, else for that of the document, or else for the illuminance
    /// of the document's spatial daylight autonomy. `None` if there is no grid of this name.
    pub fn autonomy_figure(
        &self,
        subject: &Subject,
        name: &str,
        wanted: Option<WantedTarget>,
    ) -> Option<Result<Drawing, OutputError>> {
        let (number, of) = self.grid(name)?;
        let year = &self.first.year.grids[number];
        let sda = &self.document.sda;
        let whole = of.result.whole_in_words();
        let target = wanted.or_else(|| of.own_target());
        // the part of an area is judged by its spatial daylight autonomy, which has an illuminance of its own
        let of_mean = target.filter(|target| target.part == TargetPart::Mean);
        let threshold =
            of_mean.and_then(|target| self.document.thresholds_lux.iter().position(|lux| *lux == target.lux));
        let (lux, found) = match threshold {
            Some(threshold) => {
                let lux = self.document.thresholds_lux[threshold];
                let share = with_half_width(year.autonomies_percent[threshold].into(), "%");
                (lux, format!("{} lx in {share} of the occupied hours, mean of the {whole}", short(lux)))
            }
            None => {
                let area = percent(year.spatial_percent.into());
                let (lux, time) = (short(sda.threshold_lux), short(sda.time_percent));
                (sda.threshold_lux, format!("{lux} lx in {time} % of the occupied hours on {area} of the {whole}"))
            }
        };
        let title = format!("Daylight autonomy {} lx, {}", short(lux), subject.name());
        self.map_of_hours(subject, name, (title, found), |point| match threshold {
            Some(threshold) => point.autonomies_percent[threshold].value,
            None => point.spatial_percent.value,
        })
    }

    /// Draws the share of the occupied hours in which the light of a grid is useful without electric light, over the plan; `None` if there is
    /// no grid of this name.
    pub fn useful_figure(&self, subject: &Subject, name: &str) -> Option<Result<Drawing, OutputError>> {
        let (number, of) = self.grid(name)?;
        let [_, least, most] = self.document.udi_lux;
        let mean: WithInterval = self.first.year.grids[number].useful.autonomous_percent.into();
        let title = format!("Useful daylight, {least} to {most} lx, {}", subject.name());
        let (share, whole) = (with_half_width(mean, "%"), of.result.whole_in_words());
        let found = format!("{least} to {most} lx in {share} of the occupied hours, mean of the {whole}");
        self.map_of_hours(subject, name, (title, found), |point| point.useful.autonomous_percent.value)
    }

    /// Draws a share of hours in percent of the sensors of a grid over the plan, under a title and what is found of the whole grid.
    fn map_of_hours(
        &self,
        subject: &Subject,
        name: &str,
        (title, found): (String, String),
        value: impl Fn(&PointYear) -> f64,
    ) -> Option<Result<Drawing, OutputError>> {
        let (number, of) = self.grid(name)?;
        let points = self.first.year.grids[number].points.iter().zip(&of.weights);
        let values = points.map(|(point, weight)| if *weight > 0.0 { value(point) } else { f64::NAN });
        let values: Vec<f64> = values.collect();
        let heading = subject.heading(title, vec![self.circumstances(), of.result.place_in_words(), found]);
        let known = values.iter().copied().filter(|value| value.is_finite());
        let [least, most] = known.fold([100.0, 0.0], |[low, high]: [f64; 2], value| [low.min(value), high.max(value)]);
        let scale = ColourScale::from_zero(100.0, Palette::Viridis);
        Some(map_of_values(subject, &of.result, (heading, values), (scale, "%", levels(least, most))).draw())
    }

    /// Draws the mean illuminance of a grid by day and hour; `None` if there is no grid of this name.
    pub fn hours_figure(&self, subject: &Subject, name: &str) -> Option<Result<Drawing, OutputError>> {
        let (number, of) = self.grid(name)?;
        let mean: WithInterval = self.first.year.grids[number].mean_lux.into();
        let heading = subject.heading(
            format!("Mean illuminance by the hour, {}", subject.name()),
            vec![
                self.circumstances(),
                of.result.place_in_words(),
                format!("mean of the occupied hours {}", with_half_width(mean, "lx")),
            ],
        );
        let values = self.first.year.hours.iter().map(|hour| (hour.record, hour.grids_lux[number]));
        Some(self.temporal_map(heading, values, "lx").draw())
    }

    /// Draws the flux of all tubes into the room by day and hour.
    pub fn fluxes_figure(&self, subject: &Subject) -> Result<Drawing, OutputError> {
        let sum: f64 = self.first.year.tubes.iter().map(|tube| tube.klm_h.value).sum();
        let heading = subject.heading(
            format!("Light of the tubes by the hour, {}", subject.name()),
            vec![self.circumstances(), format!("{} klm h over the year", significant(sum, 4))],
        );
        let flux = |tubes: &[[f64; 2]]| tubes.iter().flatten().sum();
        let values = self.first.year.hours.iter().map(|hour| (hour.record, flux(&hour.tubes_lm)));
        self.temporal_map(heading, values, "lm").draw()
    }

    /// Makes a temporal map of the values of records with light.
    fn temporal_map(
        &self,
        heading: Heading,
        lit: impl Iterator<Item = (usize, f64)>,
        unit: &'static str,
    ) -> TemporalMap {
        let mut values = vec![f64::NAN; self.first.weather.records.len()];
        lit.for_each(|(record, value)| values[record] = value);
        let greatest = values.iter().copied().filter(|value| value.is_finite()).fold(0.0, f64::max);
        let per_day = self.first.weather.records_per_day();
        let firsts = self.first.weather.records.iter().step_by(per_day.max(1)).enumerate();
        let firsts = firsts.filter(|(_, record)| record.day == 1).map(|(day, record)| (record.month, day));
        let months = firsts.collect();
        let scale = ColourScale::from_zero(greatest.max(1e-9), Palette::Viridis);
        TemporalMap { heading, values, per_day, months, scale, unit }
    }

    /// Describes the weather in one line.
    pub fn circumstances(&self) -> String {
        let site = &self.first.weather.site;
        let hours = self.first.year.hours.len() as f64 / f64::from(self.first.weather.records_per_hour.max(1));
        let place = place(site.latitude_deg, site.longitude_deg);
        format!("{}, {place} · {hours} hours with light", site.name)
    }
}

/// Formats a value in a unit with half of its interval.
pub(super) fn with_half_width(value: WithInterval, unit: &str) -> String {
    let half = 0.5 * (value.high - value.low);
    match half > 0.0 {
        true => format!("{} {unit} (95 % interval)", with_error(value.value, half)),
        false => format!("{} {unit}", significant(value.value, 4)),
    }
}

/// Formats a share in percent with its interval where it has a width, with the digits that tell its ends apart.
pub(super) fn percent(share: WithInterval) -> String {
    let WithInterval { value, low, high } = share;
    if high - low <= 0.05 {
        return format!("{value:.0} %");
    }
    let digits = if format!("{low:.0}") == format!("{high:.0}") { 1 } else { 0 };
    format!("{value:.digits$} % ({low:.digits$} to {high:.digits$})")
}
