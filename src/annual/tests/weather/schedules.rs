//! Occupied records and daylight hours.

use skyduct_annual::schedule::{Schedule, daylight_hours, occupied};
use skyduct_annual::weather::{Weather, read};

use crate::{Epw, SYNTHETIC};

/// Numbers, from 0, of the hours of a day of the file (also from 0) that are occupied.
fn hours_of(occupied: &[bool], day: usize) -> Vec<usize> {
    (0..24).filter(|hour| occupied[24 * day + hour]).collect()
}

fn synthetic() -> Weather {
    read(SYNTHETIC.as_bytes()).unwrap()
}

/// Hours 9 to 18 of the file end within 8 to 18 h: 3650 in a year. Summer time makes them 8 to 17 between its days.
#[test]
fn lm83_has_ten_hours_a_day_of_local_time() {
    let weather = synthetic();
    let standard = occupied(&weather, &Schedule::lm83(), None, -30.0);
    assert_eq!(standard.iter().filter(|occupied| **occupied).count(), 3650);
    assert_eq!(hours_of(&standard, 200), (8..18).collect::<Vec<_>>());
    let summer = occupied(&weather, &Schedule::lm83(), Some([(3, 29), (10, 25)]), -30.0);
    // 29 March is day 87 and 25 October day 297, from 0
    for (day, first) in [(86, 8), (87, 7), (296, 7), (297, 8)] {
        assert_eq!(hours_of(&summer, day), (first..first + 10).collect::<Vec<_>>(), "{day}");
    }
    let south = occupied(&weather, &Schedule::lm83(), Some([(10, 1), (4, 2)]), -30.0);
    for (day, first) in [(0, 7), (90, 7), (91, 8), (272, 8), (273, 7)] {
        assert_eq!(hours_of(&south, day), (first..first + 10).collect::<Vec<_>>(), "{day}");
    }
}

/// A record that stands for 8:11, as record 8 of PVGIS does, is occupied from 8 h on.
#[test]
fn records_are_known_by_the_time_they_stand_for() {
    let weather = Epw::week().read().unwrap();
    let late = occupied(&weather, &Schedule::lm83(), None, 10.6);
    assert_eq!(hours_of(&late, 3), (7..17).collect::<Vec<_>>());
    // the last record of a day stands for the day after: of the last one, for the first
    let mut hours = vec![false; 7 * 24];
    hours[24] = true;
    let first_of_friday = occupied(&weather, &Schedule::Hours(hours.clone()), None, 10.6);
    assert_eq!(first_of_friday.iter().position(|occupied| *occupied), Some(23));
    hours.rotate_left(24);
    let first = occupied(&weather, &Schedule::Hours(hours), None, 10.6);
    assert_eq!(
        (first.iter().position(|occupied| *occupied), first.iter().filter(|occupied| **occupied).count()),
        (Some(7 * 24 - 1), 1)
    );
}

#[test]
fn weeks_and_lists_have_their_days_and_hours() {
    let weather = Epw::week().read().unwrap();
    // Monday and Thursday; the week begins on a Thursday
    let days = [true, false, false, true, false, false, false];
    let weekly = Schedule::Weekly { days, from_hour: 22.0, to_hour: 24.0 };
    let found = occupied(&weather, &weekly, None, -30.0);
    let is_there: Vec<usize> = (0..7 * 24).filter(|k| found[*k]).collect();
    assert_eq!(is_there, [22, 23, 4 * 24 + 22, 4 * 24 + 23]);
    // in summer the last hour of Wednesday is the first of Thursday by the clock
    let night = Schedule::Weekly { days, from_hour: 0.0, to_hour: 1.0 };
    let found = occupied(&weather, &night, Some([(3, 1), (10, 1)]), -30.0);
    let is_there: Vec<usize> = (0..7 * 24).filter(|k| found[*k]).collect();
    assert_eq!(is_there, [4 * 24 - 1, 7 * 24 - 1]);
    let list = Schedule::Hours((0..100).map(|hour| hour % 3 == 0).collect());
    let found = occupied(&weather, &list, None, -30.0);
    assert!(found.iter().enumerate().all(|(k, occupied)| *occupied == (k < 100 && k % 3 == 0)));
}

/// The 4380 hours with most diffuse light, computed once more by the definition: of any two hours, the one outside is not ahead.
#[test]
fn daylight_hours_are_the_half_with_most_diffuse_light() {
    let weather = synthetic();
    let diffuse: Vec<f64> = weather.records.iter().map(|record| record.diffuse_horizontal_w_m2).collect();
    let sines: Vec<f64> = (0..8760).map(|k| ((k * 7919) % 97) as f64).collect();
    let daylight = daylight_hours(&diffuse, &sines);
    assert_eq!(daylight.iter().filter(|is_daylight| **is_daylight).count(), 4380);
    let key = |k: usize| (diffuse[k], sines[k], std::cmp::Reverse(k));
    let last = (0..8760).filter(|k| daylight[*k]).map(key).min_by(|a, b| a.partial_cmp(b).unwrap()).unwrap();
    assert!((0..8760).filter(|k| !daylight[*k]).all(|k| key(k) < last));
    assert_eq!(
        daylight_hours(&[1.0, 5.0, 5.0, 5.0, 0.0], &[0.0, 0.1, 0.2, 0.1, 0.0]),
        [false, true, true, false, false]
    );
    assert!(daylight_hours(&[], &[]).is_empty());
}
