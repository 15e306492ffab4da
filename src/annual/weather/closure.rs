//! Test for the moments that the records of a file stand for: global irradiance is diffuse irradiance and the direct one on a level plane,
//! with the sun where it was when they were measured or computed.

use rayon::prelude::*;
use skyduct_physics::sky::sun::SunPositionError;

use super::record::usual_offset_minutes;
use super::rows::{Row, Rows};
use crate::calendar::day_of_year;
use crate::sun::{SINE_OF_LOW_SUN, SunOverSite};

/// Least records with sun for a test.
const LEAST_RECORDS: usize = 200;

/// Most records that are tested, and by which the best offset is sought: files with more have some left out evenly.
const MOST_RECORDS: usize = 10_000;
const SEARCHED_RECORDS: usize = 500;

/// Direct normal irradiance in W/m2 above which a record says where the sun was.
const LEAST_DIRECT_W_M2: f64 = 50.0;

/// Offsets of the sun from the stamp that are tried, in minutes: a coarse step finds where the error falls, a fine one the minimum.
const FIRST_MINUTES: f64 = -90.0;
const LAST_MINUTES: f64 = 60.0;
const COARSE_MINUTES: f64 = 15.0;
const FINE_MINUTES: f64 = 5.0;

/// Minutes by which the best offset may differ from one that is agreed with: the minimum is found in steps, and real files have noise.
const AGREEING_MINUTES: f64 = 10.0;

/// Begin of the number in the comments of PVGIS' files, in hours of UTC.
const OFFSET_IN_COMMENT: &str = "irradiance time offset (h):";

/// Sun that fits the irradiances of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closure {
    /// Number of records with sun that were tested.
    pub records: usize,
    /// Minutes from the stamp of a record to the position of the sun that fits best, in steps of 5.
    pub best_offset_minutes: f64,
    /// Root of the mean squared error of the global irradiance at the best offset, W/m2.
    pub rms_at_best_w_m2: f64,
    /// Offset of the middle of the intervals in minutes.
    pub usual_offset_minutes: f64,
    /// Root of the mean squared error of the global irradiance with the sun in the middle of the intervals, W/m2.
    pub rms_at_usual_w_m2: f64,
    /// Sun that is used.
    pub sun: SunOfFile,
}

/// Moment within its interval that a record's sun is taken of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SunOfFile {
    /// The middle of the interval, as it fits.
    Usual,
    /// Minutes from the stamp that the file's comments have, as they fit.
    OfComment(f64),
    /// The middle of the interval, though another moment fits better: the user may know why.
    Doubtful,
}

/// Tests the rows of a file; none of those with few records with sun.
pub(super) fn test(rows: &Rows, sun: &SunOverSite) -> Result<Option<Closure>, SunPositionError> {
    let usable: Vec<Measured> = rows.rows.iter().filter_map(|row| Measured::of(row, rows)).collect();
    let (usable, searched) = (thinned(&usable, MOST_RECORDS), thinned(&usable, SEARCHED_RECORDS));
    let usual = usual_offset_minutes(rows.format, rows.records_per_hour);
    let Some((records, rms_at_usual_w_m2)) = error(&usable, usual, sun)?.filter(|(count, _)| *count >= LEAST_RECORDS)
    else {
        return Ok(None);
    };
    let mut best = (usual, error(&searched, usual, sun)?.map_or(f64::INFINITY, |(_, rms)| rms));
    let coarse = |_| (FIRST_MINUTES, LAST_MINUTES, COARSE_MINUTES);
    let fine = |best: f64| (best + FINE_MINUTES - COARSE_MINUTES, best - FINE_MINUTES + COARSE_MINUTES, FINE_MINUTES);
    for range in [coarse, fine] {
        let (first, last, step) = range(best.0);
        for k in 0..=((last - first) / step) as u32 {
            let minutes = first + f64::from(k) * step;
            if let Some((_, rms)) = error(&searched, minutes, sun)?
                && rms < best.1
            {
                best = (minutes, rms);
            }
        }
    }
    let (best_offset_minutes, rms_of_searched) = best;
    let rms_at_best_w_m2 = match best_offset_minutes == usual {
        true => rms_at_usual_w_m2,
        false => error(&usable, best_offset_minutes, sun)?.map_or(rms_of_searched, |(_, rms)| rms),
    };
    let agrees = |minutes: f64| (best_offset_minutes - minutes).abs() <= AGREEING_MINUTES;
    let of_comment = offset_in_comments(&rows.comments).map(|hours| 60.0 * (hours + rows.site.utc_offset_hours));
    let sun = match of_comment {
        _ if agrees(usual) => SunOfFile::Usual,
        Some(minutes) if agrees(minutes) => SunOfFile::OfComment(minutes),
        _ => SunOfFile::Doubtful,
    };
    Ok(Some(Closure {
        records,
        best_offset_minutes,
        rms_at_best_w_m2,
        usual_offset_minutes: usual,
        rms_at_usual_w_m2,
        sun,
    }))
}

/// Returns at most about `most` records, evenly chosen.
fn thinned(records: &[Measured], most: usize) -> Vec<Measured> {
    records.iter().step_by(records.len().div_ceil(most).max(1)).copied().collect()
}

/// Record with sun.
#[derive(Clone, Copy)]
struct Measured {
    day: u16,
    stamp_hour: f64,
    direct_normal_w_m2: f64,
    direct_horizontal_w_m2: f64,
}

impl Measured {
    fn of(row: &Row, rows: &Rows) -> Option<Self> {
        let (global, diffuse) = (row.global_w_m2?, row.diffuse_w_m2?);
        let direct_normal_w_m2 = row.direct_normal_w_m2.filter(|direct| *direct > LEAST_DIRECT_W_M2)?;
        let day = day_of_year(rows.year_of_sun, row.date);
        let stamp_hour = row.middle_hour - usual_offset_minutes(rows.format, rows.records_per_hour) / 60.0;
        Some(Self { day, stamp_hour, direct_normal_w_m2, direct_horizontal_w_m2: global - diffuse })
    }

    /// Returns the squared error in W2/m4 with the sun at minutes after the stamp; none with a low sun.
    fn squared_error(&self, minutes: f64, sun: &SunOverSite) -> Result<Option<f64>, SunPositionError> {
        let sine = sun.at(self.day, self.stamp_hour + minutes / 60.0)?.z;
        let error = self.direct_horizontal_w_m2 - self.direct_normal_w_m2 * sine;
        Ok((sine > SINE_OF_LOW_SUN).then_some(error * error))
    }
}

/// Returns the number of records with a sun that is high enough, and their rms error in W/m2; none without such records.
fn error(records: &[Measured], minutes: f64, sun: &SunOverSite) -> Result<Option<(usize, f64)>, SunPositionError> {
    let squared: Vec<Option<f64>> =
        records.par_iter().map(|record| record.squared_error(minutes, sun)).collect::<Result<_, _>>()?;
    // in the order of the records: the same bits on any number of threads
    let squared: Vec<f64> = squared.into_iter().flatten().collect();
    let count = squared.len();
    Ok((count > 0).then(|| (count, (squared.iter().sum::<f64>() / count as f64).sqrt())))
}

/// Returns the hours of UTC between the stamps of a file and the moments of its irradiances, as its comments have them.
fn offset_in_comments(comments: &[String]) -> Option<f64> {
    comments.iter().find_map(|comment| {
        let comment = comment.to_ascii_lowercase();
        let (_, after) = comment.split_once(OFFSET_IN_COMMENT)?;
        let number = after.trim_start();
        let end = number.find(|c: char| !(c.is_ascii_digit() || "+-.".contains(c))).unwrap_or(number.len());
        number[..end].parse().ok().filter(|hours: &f64| hours.abs() <= 24.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_are_found_in_comments() {
        let of = |text: &str| offset_in_comments(&["made by someone".to_owned(), text.to_owned()]);
        assert_eq!(of("Irradiance Time Offset (h):-0.8239"), Some(-0.8239));
        assert_eq!(of("2005; Irradiance Time Offset (h): 0.1; more"), Some(0.1));
        assert_eq!(
            (of("Irradiance Time Offset (h):"), of("Irradiance Time Offset (h): 99"), of("")),
            (None, None, None)
        );
    }
}
