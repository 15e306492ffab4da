//! Moments of a year for which records of a weather file stand.

use glam::DVec3;
use rayon::prelude::*;
use skyduct_physics::sky::sun::SunPositionError;

use crate::sun::SunOverSite;
use crate::weather::{Record, Represented, Weather};

/// Most minutes between two looks at the sun that tell when it rises or sets.
const LOOK_MINUTES: f64 = 5.0;

/// Degrees of altitude by which the sun moves in an hour at most, and by which refraction moves it: without these, it is up or down all the time.
const FASTEST_DEG_PER_HOUR: f64 = 15.05;
const REFRACTION_DEG: f64 = 1.0;

/// Degrees of altitude by which the sun can be lower or higher between three moments of an hour, its beginning, middle and end, than at all of
/// them: its altitude changes by at most (15 degrees)^2 per hour^2, which is 0.12 degrees half an hour apart, and refraction near the
/// horizon by a fifth of that.
const SAG_DEG: f64 = 0.2;

/// Moment for which a record of a weather file stands, while the sun is up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Number of the record in [`Weather::records`].
    pub record: usize,
    /// Part of the record's time for which the moment stands, over all of it: 1 where a record has one moment; the moments of a record with
    /// light add up to 1.
    pub share: f64,
    /// Hours of the day in standard time of the file's zone, 0..24: the middle of the interval, by which schedules know the record.
    pub represented_hour: f64,
    /// Number of the day in its year, from 1.
    pub day_of_year: u16,
    /// Unit vector toward the apparent centre of the sun (refracted), x east, y north, z up, at the middle of the sunlit part of the interval.
    pub sun: DVec3,
}

/// Choice of the moments for which records stand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Convention {
    /// Minutes from the stamp of a record to the middle of the time for which it stands.
    pub sun_offset_minutes: f64,
    /// Positions of the sun in an hour, 1..=12; a record has at least one.
    pub suns_per_hour: u32,
}

impl Convention {
    /// Returns the number of positions of the sun in a record.
    pub fn suns_per_record(&self, weather: &Weather) -> u32 {
        (self.suns_per_hour / weather.records_per_hour.max(1)).max(1)
    }

    /// Returns one sun per record, where the file's tests found it.
    pub fn of(weather: &Weather) -> Self {
        Self { sun_offset_minutes: weather.sun_offset_minutes, suns_per_hour: 1 }
    }
}

/// Moments of a weather file in the order of its records: those with light while the sun is up.
#[derive(Clone, Debug, PartialEq)]
pub struct Moments {
    /// Moments, in order.
    pub moments: Vec<Moment>,
    /// Light without sun, which has no moments.
    pub dropped: Dropped,
}

/// Records with light whose sun is down all the time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Dropped {
    /// Number of the records.
    pub records: usize,
    /// Number of the first one in [`Weather::records`](crate::weather::Weather::records).
    pub first_record: Option<usize>,
    /// Share of these records in the sum of all direct normal and diffuse horizontal irradiances.
    pub share_of_light: f64,
}

/// Returns the moments for which the records of a weather file stand. Fails for a site or a year that the sun's positions are not known of.
pub fn moments(weather: &Weather, convention: Convention) -> Result<Moments, SunPositionError> {
    let sun = SunOverSite::new(&weather.site, weather.year_of_sun);
    let of_record = |(k, record): (usize, &Record)| match record.has_light() {
        true => moments_of(k, weather, convention, &sun),
        false => Ok(Vec::new()),
    };
    let found: Vec<Vec<Moment>> =
        weather.records.par_iter().enumerate().map(of_record).collect::<Result<_, SunPositionError>>()?;
    let light = |record: &Record| record.direct_normal_w_m2 + record.diffuse_horizontal_w_m2;
    let mut dropped = Dropped::default();
    for (k, record) in
        weather.records.iter().enumerate().filter(|(k, record)| record.has_light() && found[*k].is_empty())
    {
        dropped.records += 1;
        dropped.first_record = dropped.first_record.or(Some(k));
        dropped.share_of_light += light(record);
    }
    if dropped.records > 0 {
        dropped.share_of_light /= weather.records.iter().map(light).sum::<f64>();
    }
    Ok(Moments { moments: found.into_iter().flatten().collect(), dropped })
}

fn moments_of(
    record: usize,
    weather: &Weather,
    convention: Convention,
    sun: &SunOverSite,
) -> Result<Vec<Moment>, SunPositionError> {
    let sun_offset_minutes = convention.sun_offset_minutes;
    let Represented { day_of_year, hour: represented_hour, .. } =
        weather.represented(&weather.records[record], sun_offset_minutes);
    let parts = convention.suns_per_record(weather);
    let hours = 1.0 / f64::from(weather.records_per_hour * parts);
    let looks = (60.0 * hours / LOOK_MINUTES).ceil();
    let mut moments = Vec::new();
    for part in 0..parts {
        let middle = represented_hour + (f64::from(part) + 0.5 - 0.5 * f64::from(parts)) * hours;
        if let Some((sun, lit)) = sunlit_part(day_of_year, middle, (hours, looks), sun)? {
            moments.push(Moment { record, share: lit, represented_hour, day_of_year, sun });
        }
    }
    let lit: f64 = moments.iter().map(|moment| moment.share).sum();
    moments.iter_mut().for_each(|moment| moment.share /= lit);
    Ok(moments)
}

/// Returns the sun at the middle of the sunlit part of an interval around an hour, and the share of that part; none if the sun is down.
fn sunlit_part(
    day: u16,
    middle: f64,
    (hours, looks): (f64, f64),
    sun: &SunOverSite,
) -> Result<Option<(DVec3, f64)>, SunPositionError> {
    let at_middle = sun.at(day, middle)?;
    let sure = libm::sin((0.5 * hours * FASTEST_DEG_PER_HOUR + REFRACTION_DEG).to_radians());
    if at_middle.z > sure {
        return Ok(Some((at_middle, 1.0)));
    }
    if at_middle.z < -sure {
        return Ok(None);
    }
    let ends = [sun.at(day, middle - 0.5 * hours)?, sun.at(day, middle + 0.5 * hours)?];
    let sag = libm::sin(SAG_DEG.to_radians());
    if ends.iter().all(|end| end.z > sag) && at_middle.z > sag {
        return Ok(Some((at_middle, 1.0)));
    }
    if ends.iter().all(|end| end.z < -sag) && at_middle.z < -sag {
        return Ok(None);
    }
    let (mut highest, mut lit, mut sum_of_hours) = (at_middle, 0.0, 0.0);
    for look in 0..looks as u32 {
        let hour = middle + ((f64::from(look) + 0.5) / looks - 0.5) * hours;
        let there = sun.at(day, hour)?;
        if there.z > 0.0 {
            lit += 1.0;
            sum_of_hours += hour;
        }
        if there.z > highest.z {
            highest = there;
        }
    }
    if lit == 0.0 {
        return Ok(None);
    }
    // a sun that sets and rises in one interval is down in the middle
    let there = sun.at(day, sum_of_hours / lit)?;
    Ok(Some((if there.z > 0.0 { there } else { highest }, lit / looks)))
}
