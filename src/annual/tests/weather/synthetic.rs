//! The synthetic year against numbers of an independent program (NumPy, its own SPA).

use std::collections::BTreeMap;

use skyduct_annual::moment::{Convention, Moment, moments};
use skyduct_annual::weather::{Format, SunOfFile, Weather, read};

use crate::{Epw, SYNTHETIC};

const HOURS: &str = include_str!("../../../../tests/reference/annual/hours_synthetic.csv");

/// Row of the reference: the sun of an hour with light.
struct Hour {
    altitude_deg: f64,
    azimuth_deg: f64,
}

/// Rows by month, day and hour of the file.
fn hours() -> BTreeMap<[u32; 3], Hour> {
    let row = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        let [month, day, hour] = [0, 1, 2].map(|k| fields[k].parse().unwrap());
        ([month, day, hour], Hour { altitude_deg: fields[3].parse().unwrap(), azimuth_deg: fields[4].parse().unwrap() })
    };
    HOURS.lines().skip(1).map(row).collect()
}

fn synthetic() -> Weather {
    read(SYNTHETIC.as_bytes()).unwrap()
}

fn altitude_and_azimuth_deg(moment: &Moment) -> [f64; 2] {
    let sun = moment.sun;
    [sun.z.asin().to_degrees(), sun.x.atan2(sun.y).to_degrees().rem_euclid(360.0)]
}

#[test]
fn its_header_and_records_are_read() {
    let weather = synthetic();
    let site = &weather.site;
    assert_eq!(site.name, "Synthetic");
    assert_eq!(
        [site.latitude_deg, site.longitude_deg, site.utc_offset_hours, site.elevation_m],
        [55.77, 12.5, 1.0, 20.0]
    );
    assert_eq!((weather.records.len(), weather.records_per_hour, weather.year_of_sun), (8760, 1, 2017));
    assert_eq!((weather.first_weekday, weather.daylight_saving, weather.file.first_line), (6, None, 9));
    assert_eq!(
        (weather.file.format, &weather.file.comments[..]),
        (Format::Epw, &["synthetic year; no measured data".to_owned()][..])
    );
    assert!(weather.file.repairs.is_empty(), "{:?}", weather.file.repairs);
    // line 18 of the file
    let record = weather.records[9];
    assert_eq!((record.month, record.day, record.middle_hour), (1, 1, 9.5));
    assert_eq!([record.direct_normal_w_m2, record.diffuse_horizontal_w_m2, record.dew_point_c], [495.0, 12.0, -5.6]);
    assert_eq!(record.illuminances_lux, None);
}

/// Every hour with light has its sun, at sunrise and sunset that of the sunlit part: to 0.01 degrees, of which the printed digits of the
/// reference are 0.0001 and other versions of SPA and of the refraction at the horizon the rest.
#[test]
fn its_suns_are_those_of_another_program() {
    let weather = synthetic();
    let found = moments(&weather, Convention::of(&weather)).unwrap();
    let hours = hours();
    assert_eq!((found.moments.len(), hours.len(), found.dropped.records), (4396, 4396, 0));
    for moment in &found.moments {
        let record = weather.records[moment.record];
        let hour = &hours[&[record.month.into(), record.day.into(), record.middle_hour.ceil() as u32]];
        let [altitude, azimuth] = altitude_and_azimuth_deg(moment);
        assert!((altitude - hour.altitude_deg).abs() < 0.01, "{record:?}: {altitude}, {}", hour.altitude_deg);
        assert!((azimuth - hour.azimuth_deg).abs() < 0.01, "{record:?}: {azimuth}, {}", hour.azimuth_deg);
        assert_eq!((moment.share, moment.represented_hour), (1.0, record.middle_hour));
    }
}

/// The other program's errors of the global irradiance: 3.63 W/m2 with the sun in the middle of the hours, which is best, and 33.8 W/m2 with
/// that of their ends (there it had some records more: those that have a sun of 5 degrees half an hour before).
#[test]
fn its_irradiances_fit_the_sun_in_the_middle_of_the_hours() {
    let closure = synthetic().file.closure.unwrap();
    assert_eq!(
        (closure.best_offset_minutes, closure.usual_offset_minutes, closure.sun),
        (-30.0, -30.0, SunOfFile::Usual)
    );
    assert!((closure.rms_at_best_w_m2 - 3.63).abs() < 0.01, "{closure:?}");
    assert_eq!(closure.rms_at_best_w_m2, closure.rms_at_usual_w_m2);
    let later = Epw::year().with_header(1, "LOCATION,Synthetic,-,XXX,skyduct synthetic,000000,55.77,12.50,1.5,20.0");
    let closure = later.read().unwrap().file.closure.unwrap();
    assert!((closure.rms_at_usual_w_m2 - 33.8).abs() < 0.3, "{closure:?}");
    assert_eq!((closure.best_offset_minutes, closure.sun), (0.0, SunOfFile::Doubtful));
}

/// Clocks that are 40 minutes ahead make of the middle of an hour 10 minutes after its end, as files of PVGIS have it.
#[test]
fn an_offset_that_comments_tell_is_taken_if_the_irradiances_agree() {
    let epw =
        Epw::year().with_header(1, "LOCATION,Synthetic,-,XXX,skyduct synthetic,000000,55.77,12.50,1.6666666667,20.0");
    let doubtful = epw.read().unwrap();
    let closure = doubtful.file.closure.unwrap();
    assert_eq!(
        (closure.best_offset_minutes, closure.sun, doubtful.sun_offset_minutes),
        (10.0, SunOfFile::Doubtful, -30.0)
    );
    let told = epw.clone().with_header(7, "COMMENTS 2,\"some, Irradiance Time Offset (h):-1.5\"").read().unwrap();
    assert!((told.sun_offset_minutes - 10.0).abs() < 1e-6, "{}", told.sun_offset_minutes);
    assert!(matches!(told.file.closure.unwrap().sun, SunOfFile::OfComment(_)));
    let wrong = epw.with_header(7, "COMMENTS 2,Irradiance Time Offset (h):-1.1").read().unwrap();
    assert_eq!((wrong.file.closure.unwrap().sun, wrong.sun_offset_minutes), (SunOfFile::Doubtful, -30.0));

    // the suns are those of the clocks before, and schedules know the records by the later times
    let before = synthetic();
    let before = moments(&before, Convention::of(&before)).unwrap().moments;
    let after = moments(&told, Convention::of(&told)).unwrap().moments;
    assert_eq!(before.len(), after.len());
    for (before, after) in before.iter().zip(&after) {
        assert_eq!(before.record, after.record);
        assert!((before.sun - after.sun).length() < 1e-6, "{before:?} {after:?}");
        assert!((before.represented_hour + 2.0 / 3.0 - after.represented_hour).abs() < 1e-6);
    }
}

/// With several suns, the sunlit parts of an hour share its light, and a sun in the middle is the mean of those around it.
#[test]
fn several_suns_share_an_hour() {
    let weather = Epw::week().read().unwrap();
    let one = moments(&weather, Convention::of(&weather)).unwrap().moments;
    for suns_per_hour in [2, 5, 12] {
        let several = moments(&weather, Convention { suns_per_hour, ..Convention::of(&weather) }).unwrap().moments;
        for single in &one {
            let of_record: Vec<_> = several.iter().filter(|moment| moment.record == single.record).collect();
            let share: f64 = of_record.iter().map(|moment| moment.share).sum();
            assert!((share - 1.0).abs() < 1e-12 && of_record.len() <= suns_per_hour as usize);
            let mean: glam::DVec3 = of_record.iter().map(|moment| moment.share * moment.sun).sum();
            // an arc of half an hour to each side has its mean 0.3 % below its middle; sunrise is known to 2.5 minutes, 0.6 degrees
            assert!((mean - single.sun).length() < 0.012, "{suns_per_hour}: {mean} {}", single.sun);
        }
        assert_eq!(
            several.iter().map(|moment| moment.record).collect::<std::collections::BTreeSet<_>>().len(),
            one.len()
        );
    }
}

/// Light of the middle of the night has no sun.
#[test]
fn light_without_sun_is_dropped_and_counted() {
    let weather = Epw::week().with(24, 16, "10").with(25, 16, "20").read().unwrap();
    let all: f64 =
        weather.records.iter().map(|record| record.direct_normal_w_m2 + record.diffuse_horizontal_w_m2).sum();
    let found = moments(&weather, Convention::of(&weather)).unwrap();
    assert_eq!((found.dropped.records, found.dropped.first_record), (2, Some(24)));
    assert!((found.dropped.share_of_light - 30.0 / all).abs() < 1e-15);
    assert!(found.moments.iter().all(|moment| moment.record != 24 && moment.sun.z > 0.0));
}

/// The sun of the midnight that a polar day has is up all the time, and a polar night has no moments.
#[test]
fn poles_have_a_day_and_a_night_in_a_year() {
    let mut epw = Epw::week().with_header(1, "LOCATION,Pole,-,XXX,none,000000,90.0,0.0,0.0,0.0");
    epw.records.iter_mut().for_each(|record| record[15] = "100".to_owned());
    let day = epw.read().unwrap();
    assert_eq!(moments(&day, Convention::of(&day)).unwrap().moments.len(), 7 * 24);
    let south = epw.with_header(1, "LOCATION,Pole,-,XXX,none,000000,-90.0,0.0,0.0,0.0").read().unwrap();
    let night = moments(&south, Convention::of(&south)).unwrap();
    assert_eq!((night.moments.len(), night.dropped.records), (0, 7 * 24));
}
