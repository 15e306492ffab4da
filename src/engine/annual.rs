//! Years of a job: its document and its weather files.

use std::sync::Arc;

use crate::annual::eyes::is_eye;
use crate::annual::fluxes::{TubeLight, traced_tubes};
use crate::annual::light::{Illuminances, LitMoment, Sources, by_record, lit};
use crate::annual::moment::{Convention, Moments, moments};
use crate::annual::response::TubeRecord;
use crate::annual::schedule::{Schedule, daylight_hours, occupied};
use crate::annual::weather::{Record, Site, Weather};
use crate::document::annual::{AnnualDocument, DaylightSavingDocument, IlluminanceSource, ScheduleDocument, Weekday};
use crate::document::limits::{
    EYES_TIMES_TUBES, SENSORS_TIMES_ALL_RECORDS, SENSORS_TIMES_MOMENTS, SENSORS_TIMES_RECORDS, SUNS,
    TRACED_TUBES_TIMES_MOMENTS, TUBES_TIMES_MOMENTS,
};
use crate::document::sky::LocationDocument;
use crate::document::weather::notes_on;
use crate::document::{DocumentErrors, FieldError, FieldErrorCode, FileSource, ValidJob, Warning};
use crate::guide::sky_rings::SkyRings;
use crate::integrator::diffuser_source::closure_source::{all_lambertian, is_lambertian};
use crate::integrator::moments::COEFFICIENTS;
use crate::output::npy::Array;
use crate::plan::{EffectKind, Effects, YearMethod};
use crate::scene::{Grid, Responses, Scene};
use crate::sky::{self, SkyMoment};
use crate::traceable::TraceableScene;

/// Largest difference in degrees of the latitude and the longitude of a document and of its weather file.
const NEAR_DEG: f64 = 0.5;

/// Years of a job.
pub(crate) struct AnnualJob {
    /// Part of the document that asks for them.
    pub document: AnnualDocument,
    /// Azimuth of the room's +y axis in radians, clockwise from north.
    pub rotation: f64,
    /// Weather files, at least one, in the order of the document.
    pub files: Vec<WeatherYear>,
    /// Sources of daylight that are simulated.
    pub sources: Sources,
    /// True if grids are computed at every moment, because some closure lets light pass with its direction.
    pub at_moments: bool,
    /// True if grids have responses to the closures that are Lambertian, whose light is not computed at every moment.
    pub by_responses: bool,
    /// Other daylight of each grid in lux, sensors x records.
    pub others: Vec<Option<Arc<Array>>>,
}

/// Year of a weather file.
pub(crate) struct WeatherYear {
    /// Name or id of the file, as the document has it.
    pub name: String,
    /// Weather of the document's period, at the place of the document if it has one.
    pub weather: Arc<Weather>,
    /// Records in which the room is occupied.
    pub occupied: Vec<bool>,
    /// Daylight hours of EN 17037.
    pub daylight: Vec<bool>,
    /// Choice of the moments for which records stand.
    pub convention: Convention,
    /// Sky and sun of the moments with light, in the room's frame.
    pub lit: Vec<LitMoment>,
}

impl AnnualJob {
    /// Reads the weather files of a document with a year, and adds notes on them to the warnings; `None` for a document without one.
    pub fn read(
        document: &ValidJob,
        files: &dyn FileSource,
        (scene, traceable, effects): (&Scene, &TraceableScene, &Effects),
        warnings: &mut Vec<Warning>,
    ) -> Result<Option<Self>, DocumentErrors> {
        let Some(annual) = &document.annual else { return Ok(None) };
        let (mut years, mut suns) = (Vec::new(), 0);
        for (name, pointer) in annual.weather.with_pointers() {
            // the sun of a file is computed before the next one is read
            suns += suns_of(annual, &*files.weather(name).map_err(|detail| FieldError::new(&pointer, detail))?);
            check_suns(suns)?;
            years.push(WeatherYear::read(document, annual, (name, &pointer), files, warnings)?);
        }
        check_size(annual, &years, scene)?;
        check_tracing(traceable, years.iter().map(|year| year.lit.len()).sum())?;
        let at_moments = !all_lambertian(&traceable.tubes);
        let by_responses = !at_moments || traceable.tubes.iter().any(is_lambertian);
        if at_moments {
            check_moments(&years, scene)?;
        }
        let records = years.first().map_or(0, |year| year.weather.records.len());
        let others = scene.grids.iter().map(|grid| other_daylight(annual, grid, records, files));
        let others = others.collect::<Result<_, _>>()?;
        let rotation = document.room.rotation_deg.to_radians();
        let document = with_targets(annual, &scene.grids);
        let sources = Sources { skies: effects.is_on(EffectKind::Sky), suns: effects.is_on(EffectKind::Sun) };
        Ok(Some(Self { document, rotation, files: years, sources, at_moments, by_responses, others }))
    }

    /// Computes all light at every moment, if there are moments, because the room has no responses.
    pub fn without_responses(&mut self, scene: &mut Scene) {
        self.by_responses = false;
        scene.grids.iter_mut().for_each(|grid| grid.responses = Responses::None);
    }

    /// Returns the way in which the illuminances are computed.
    pub fn method(&self) -> YearMethod {
        match (self.by_responses, self.at_moments) {
            (true, true) => YearMethod::Both,
            (false, true) => YearMethod::Moments,
            (_, false) => YearMethod::Responses,
        }
    }

    /// Adds the moments to a scene whose grids are computed at them.
    pub fn add_moments(&self, scene: &mut Scene) {
        if !self.at_moments {
            return;
        }
        let moment = |year: &WeatherYear, lit: &LitMoment| {
            let hours = lit.share / f64::from(year.weather.records_per_hour.max(1));
            // dirt on the tubes counts as if the sky were darker
            let factor = self.document.maintenance_factor(year.weather.records[lit.record].month);
            SkyMoment {
                distribution: lit.distribution.clone(),
                diffuse_horizontal_lux: factor * lit.diffuse_horizontal_lux,
                sun: lit.sun,
                direct_normal_lux: factor * lit.direct_normal_lux,
                hours,
                occupied_hours: if year.occupied[lit.record] { hours } else { 0.0 },
            }
        };
        let of_year = |year: &WeatherYear| self.sources.of(&year.lit).iter().map(|lit| moment(year, lit)).collect();
        scene.moments = Some(Arc::new(sky::Moments {
            years: self.files.iter().map(of_year).collect(),
            of_directional_alone: self.by_responses,
            surroundings_shine: self.sources.skies,
        }));
    }

    /// Sums up the horizontal light outdoors over all years: that of the skies and that of the suns, in lux times the time of a record.
    pub fn outdoors(&self) -> [f64; 2] {
        let lit = || self.files.iter().flat_map(|year| &year.lit);
        [
            lit().map(|lit| lit.share * lit.diffuse_horizontal_lux).sum(),
            lit().map(|lit| lit.share * lit.direct_horizontal_lux()).sum(),
        ]
    }

    /// Estimates the memory in bytes that the years of this number of tubes hold: weather, moments with their skies, and the light of every
    /// tube at every moment and in every record.
    pub fn bytes(&self, tubes: usize) -> usize {
        let of_tubes = tubes * (2 * size_of::<TubeLight>() + size_of::<TubeRecord>());
        let of_file = |file: &WeatherYear| {
            size_of_val(file.weather.records.as_slice())
                + file.lit.len() * (size_of::<SkyMoment>() + size_of::<LitMoment>() + size_of::<SkyRings>() + of_tubes)
        };
        let of_others = self.others.iter().flatten().map(|array| size_of_val(array.values.as_slice()));
        let of_patches = if self.at_moments { COEFFICIENTS * size_of::<f64>() } else { 0 };
        let luminances = self.files.iter().map(|file| of_patches * file.lit.len());
        self.files.iter().map(of_file).chain(of_others).chain(luminances).sum()
    }
}

/// Adds the targets of the grids to the illuminances of the daylight autonomies, by which targets are judged over a year.
fn with_targets(annual: &AnnualDocument, grids: &[Grid]) -> AnnualDocument {
    let mut document = annual.clone();
    for lux in grids.iter().filter_map(|grid| grid.target_lux) {
        if !document.thresholds_lux.contains(&lux) {
            document.thresholds_lux.push(lux);
            document.thresholds_lux.sort_by(f64::total_cmp);
        }
    }
    document
}

impl WeatherYear {
    fn read(
        document: &ValidJob,
        annual: &AnnualDocument,
        (name, pointer): (&str, &str),
        files: &dyn FileSource,
        warnings: &mut Vec<Warning>,
    ) -> Result<Self, DocumentErrors> {
        let fault = |pointer: &str, detail: String| FieldError::new(pointer, detail);
        let mut weather = files.weather(name).map_err(|detail| fault(pointer, detail))?;
        if let Some(location) = &document.location {
            let site = place(location, &weather.site).map_err(|detail| fault("/location", detail))?;
            weather = Arc::new(Weather { site, ..Weather::clone(&weather) });
        }
        if let ScheduleDocument::Hours(hours) = &annual.schedule {
            let needed = weather.records.len() / weather.records_per_hour.max(1) as usize;
            if hours.occupied.len() != needed {
                let found = hours.occupied.len();
                let detail = format!("must have a value for each of the {needed} hours of the file, but has {found}");
                return Err(fault("/annual/schedule/occupied", detail).into());
            }
        }
        if let Some(period) = annual.period
            && !weather.records.iter().any(|record| period.contains(record.month, record.day))
        {
            return Err(fault("/annual/period", "must contain days of the weather file".to_owned()).into());
        }
        let convention = Convention {
            sun_offset_minutes: annual.sun_offset_minutes.unwrap_or(weather.sun_offset_minutes),
            suns_per_hour: annual.suns_per_hour,
        };
        let occupied = occupied_records(annual, &weather, convention);
        let (weather, occupied) = within_period(annual, weather, occupied);
        let Moments { moments, dropped } =
            moments(&weather, convention).map_err(|error| fault(pointer, error.to_string()))?;
        warnings.extend(notes_on(&weather, dropped));
        let rotation = document.room.rotation_deg.to_radians();
        let lit = lit(&weather.records, &moments, illuminances(source_of(annual, &weather)), rotation);
        let (diffuse, sines) = by_record(&lit, weather.records.len());
        let daylight = daylight_hours(&diffuse, &sines);
        let occupied = occupied.unwrap_or_else(|| daylight.clone());
        Ok(Self { name: name.to_owned(), weather, occupied, daylight, convention, lit })
    }
}

/// Reads the other daylight of a grid, if the document has any.
fn other_daylight(
    annual: &AnnualDocument,
    grid: &Grid,
    records: usize,
    files: &dyn FileSource,
) -> Result<Option<Arc<Array>>, FieldError> {
    let named = annual.other_daylight.iter().enumerate().find(|(_, other)| other.grid == grid.name);
    let Some((index, other)) = named else { return Ok(None) };
    let fault = |detail: String| FieldError::new(format!("/annual/other_daylight/{index}/file"), detail);
    let array = files.array(&other.file).map_err(fault)?;
    let (needed, [rows, columns]) = (grid.len(), array.shape);
    if [rows, columns] != [needed, records] {
        let detail = format!(
            "must have {needed} rows, the sensors of the grid, and {records} columns, the records of the year, but has {rows} and {columns}"
        );
        return Err(fault(detail));
    }
    Ok(Some(array))
}

/// Returns for each record of a file whether the room is occupied; `None` where the light says so.
fn occupied_records(document: &AnnualDocument, weather: &Weather, convention: Convention) -> Option<Vec<bool>> {
    let summer = match document.daylight_saving {
        DaylightSavingDocument::None => None,
        DaylightSavingDocument::File => weather.daylight_saving,
        DaylightSavingDocument::Days(days) => Some([days.start, days.end].map(|day| (day.month, day.day))),
    };
    let schedule = match &document.schedule {
        ScheduleDocument::Lm83 => Schedule::lm83(),
        ScheduleDocument::DaylightHours => return None,
        ScheduleDocument::Weekly(weekly) => {
            let [from_hour, to_hour] = weekly.hours();
            let days =
                [Weekday::Mon, Weekday::Tue, Weekday::Wed, Weekday::Thu, Weekday::Fri, Weekday::Sat, Weekday::Sun];
            Schedule::Weekly { days: days.map(|day| weekly.days.contains(&day)), from_hour, to_hour }
        }
        ScheduleDocument::Hours(hours) => Schedule::Hours(hours.occupied.iter().map(|value| *value == 1).collect()),
    };
    Some(occupied(weather, &schedule, summer, convention.sun_offset_minutes))
}

/// Returns the records of the document's period, and which of them are occupied.
fn within_period(
    document: &AnnualDocument,
    weather: Arc<Weather>,
    occupied: Option<Vec<bool>>,
) -> (Arc<Weather>, Option<Vec<bool>>) {
    let Some(period) = document.period else { return (weather, occupied) };
    let is_within = |record: &Record| period.contains(record.month, record.day);
    let occupied = occupied.map(|occupied| {
        let kept = weather.records.iter().zip(occupied).filter(|(record, _)| is_within(record));
        kept.map(|(_, occupied)| occupied).collect()
    });
    let records = weather.records.iter().filter(|record| is_within(record)).copied().collect();
    (Arc::new(Weather { records, ..Weather::clone(&weather) }), occupied)
}

/// Checks that rays are not traced through more different tubes at more moments than time allows.
pub(crate) fn check_tracing(traceable: &TraceableScene, moments: usize) -> Result<(), FieldError> {
    let traced = traced_tubes(traceable);
    let product = traced.saturating_mul(moments);
    if product <= TRACED_TUBES_TIMES_MOMENTS {
        return Ok(());
    }
    let detail = format!(
        "{traced} different tubes are bent, tilted, meshed, domed or have mirrors by angle, where eight others before horizons count as one; \
         their number times the {moments} moments with light must be <= {TRACED_TUBES_TIMES_MOMENTS}, but is {product}"
    );
    Err(FieldError::new("/tubes", detail).coded(FieldErrorCode::TooMany))
}

/// Checks that grids are not computed at more moments than memory and time allow.
fn check_moments(years: &[WeatherYear], scene: &Scene) -> Result<(), FieldError> {
    let sensors: usize = scene.grids.iter().map(Grid::len).sum();
    let moments: usize = years.iter().map(|year| year.lit.len()).sum();
    let product = sensors.saturating_mul(moments);
    if product <= SENSORS_TIMES_MOMENTS {
        return Ok(());
    }
    let detail = format!(
        "below closures that let light pass with its direction every moment is traced: the number of sensors times the {moments} moments with light must be <= {SENSORS_TIMES_MOMENTS}, but is {product}"
    );
    Err(FieldError::new("/grids", detail).coded(FieldErrorCode::TooMany))
}

fn illuminances(source: IlluminanceSource) -> Illuminances {
    match source {
        IlluminanceSource::Perez => Illuminances::Perez,
        IlluminanceSource::File => Illuminances::File,
    }
}

/// Returns the source of the illuminances: the file where it has nothing else.
pub(crate) fn source_of(document: &AnnualDocument, weather: &Weather) -> IlluminanceSource {
    if weather.file.is_photometric { IlluminanceSource::File } else { document.illuminance }
}

/// Checks that years have no more values than memory and time allow.
fn check_size(annual: &AnnualDocument, years: &[WeatherYear], scene: &Scene) -> Result<(), FieldError> {
    let records = || years.iter().map(|year| year.weather.records.len());
    let suns = |year: &WeatherYear| suns_of(annual, &year.weather);
    let sensors: usize = scene.grids.iter().map(Grid::len).sum();
    let eyes =
        scene.grids.iter().flat_map(|grid| (0..grid.len()).filter(|sensor| is_eye(&grid.sensor(*sensor)))).count();
    let (longest, all, suns) = (records().max().unwrap_or(0), records().sum(), years.iter().map(suns).sum());
    for (pointer, things, count, others, most) in [
        ("/grids", "sensors", sensors, (longest, "records of a year"), SENSORS_TIMES_RECORDS),
        ("/grids", "sensors", sensors, (all, "records of all years"), SENSORS_TIMES_ALL_RECORDS),
        ("/tubes", "tubes", scene.tubes.len(), (suns, "positions of the sun"), TUBES_TIMES_MOMENTS),
        ("/grids", "sensors that face about level", eyes, (scene.tubes.len(), "tubes"), EYES_TIMES_TUBES),
    ] {
        let (number, others) = others;
        let product = count.saturating_mul(number);
        if product > most {
            let detail =
                format!("the number of {things} times the {number} {others} must be <= {most}, but is {product}");
            return Err(FieldError::new(pointer, detail).coded(FieldErrorCode::TooMany));
        }
    }
    Ok(())
}

/// Returns the number of positions of the sun in the year of a weather file.
fn suns_of(annual: &AnnualDocument, weather: &Weather) -> usize {
    annual.suns_per_hour.div_ceil(weather.records_per_hour.max(1)) as usize * weather.records.len()
}

/// Checks the number of positions of the sun in the weather files that are read so far.
fn check_suns(suns: usize) -> Result<(), FieldError> {
    if suns <= SUNS {
        return Ok(());
    }
    let detail = format!(
        "the records of the weather files times the positions of the sun in each must be <= {SUNS}, but are {suns} or more"
    );
    Err(FieldError::new("/annual/suns_per_hour", detail).coded(FieldErrorCode::TooMany))
}

/// Returns the place of a document, which must be near that of its weather file.
fn place(location: &LocationDocument, site: &Site) -> Result<Site, String> {
    let turn = (location.longitude_deg - site.longitude_deg).rem_euclid(360.0);
    let away = (location.latitude_deg - site.latitude_deg).abs().max(turn.min(360.0 - turn));
    if away > NEAR_DEG {
        return Err(format!(
            "must be within {NEAR_DEG} degrees of the weather file's place, {:.3}, {:.3}; it may be left out",
            site.latitude_deg, site.longitude_deg
        ));
    }
    let LocationDocument { latitude_deg, longitude_deg, elevation_m } = *location;
    Ok(Site { latitude_deg, longitude_deg, elevation_m, ..site.clone() })
}
