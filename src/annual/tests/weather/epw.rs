//! Rules of EPW files, each with a file that needs it, and faults, each with its line and field.

use skyduct_annual::weather::{RepairKind, read};

use crate::{Epw, refused};

/// Records of the week whose hour has a high sun and beam: 3 June, 13 h.
const NOON: usize = 2 * 24 + 12;

/// Line of a record of the week.
fn line(record: usize) -> usize {
    record + 9
}

#[test]
fn a_location_with_accents_quotes_and_quarters_of_hours_is_read() {
    let location = "LOCATION,\"Z\u{fc}rich, Flug\u{1b}hafen\",-,XXX,some,000000,-27.7,-95.333,5.75,1337.0";
    let text = Epw::week().with_header(1, location).text();
    let latin_1: Vec<u8> = text.chars().map(|c| c as u8).collect();
    let with_mark = ["\u{feff}", &text].concat().into_bytes();
    for bytes in [latin_1, text.into_bytes(), with_mark] {
        let site = read(&bytes).unwrap().site;
        assert_eq!(site.name, "Z\u{fc}rich, Flughafen");
        assert_eq!([site.latitude_deg, site.longitude_deg, site.utc_offset_hours], [-27.7, -95.333, 5.75]);
    }
}

#[test]
fn line_ends_blank_last_lines_and_additional_or_missing_last_fields_mean_nothing() {
    let epw = Epw::week();
    let plain = epw.read().unwrap();
    let text = epw.text();
    let with_commas: String = text.lines().map(|line| format!("{line},\n")).collect();
    let mut short = epw.clone();
    short.records.iter_mut().for_each(|record| record.truncate(16));
    let spaced = text.replace(",0,*", ", 60 ,*");
    for other in [text.replace('\n', "\r\n"), text.clone() + "\n \r\n\u{1a}", with_commas, short.text(), spaced] {
        assert!(read(other.as_bytes()).unwrap() == plain);
    }
}

#[test]
fn headers_are_checked_by_field() {
    let location =
        |fields: &str| Epw::week().with_header(1, &format!("LOCATION,City,-,XXX,some,000000,{fields}")).read();
    refused(location("91,12.5,1,20"), 1, 7);
    refused(location("55,181,1,20"), 1, 8);
    refused(location("55,12.5,14.5,20"), 1, 9);
    refused(location("55,12.5,NaN,20"), 1, 9);
    refused(location("55,12.5,1,"), 1, 10);
    refused(location("55,12.5,1"), 1, 10);
    let periods = |fields: &str| Epw::week().with_header(8, &format!("DATA PERIODS,{fields}")).read();
    refused(periods("2,1,Data,Sunday, 6/ 1, 6/ 7"), 8, 2);
    refused(periods("1,7,Data,Sunday, 6/ 1, 6/ 7"), 8, 3);
    refused(periods("1,0,Data,Sunday, 6/ 1, 6/ 7"), 8, 3);
    refused(periods("1,1.5,Data,Sunday, 6/ 1, 6/ 7"), 8, 3);
    // they end after the days of the header, or those cannot be read
    refused(periods("1,1,Data,Sunday, 6/ 1, 6/ 6"), line(7 * 24 - 1), 0);
    refused(periods("1,1,Data,Sunday,soon,later"), line(7 * 24 - 1), 0);
    refused(Epw::week().with_header(1, "DESIGN CONDITIONS,0").read(), 1, 0);
    refused(Epw::week().with_header(8, "COMMENTS 3").read(), 9, 0);
    refused(read(b""), 1, 0);
    refused(read(b"LOCATION"), 1, 7);
    refused(read(b"nothing"), 1, 0);
    let mut empty = Epw::week();
    empty.records.clear();
    refused(empty.read(), 8, 0);
}

#[test]
fn summer_time_and_weekdays_are_those_of_the_header() {
    let of = |text: &str| Epw::year().with_header(5, text);
    let [simple, by_weekday] = [
        "HOLIDAYS/DAYLIGHT SAVINGS,No, 3/26,10/29,0",
        "HOLIDAYS/DAYLIGHT SAVING,No,Last Sunday in March,Last Sunday in October,0",
    ]
    .map(|text| of(text).read().unwrap());
    assert_eq!(simple.daylight_saving, Some([(3, 26), (10, 29)]));
    assert_eq!(by_weekday.daylight_saving, simple.daylight_saving);
    refused(of("HOLIDAYS/DAYLIGHT SAVINGS,No,3/26,never,0").read(), 5, 4);
    // in the calendar of 2017 the first of June is a Thursday
    let unnamed = Epw::week().with_header(8, "DATA PERIODS,1,1,Data,, 6/ 1, 6/ 7").read().unwrap();
    assert_eq!((unnamed.first_weekday, Epw::week().read().unwrap().first_weekday), (3, 3));
}

#[test]
fn records_are_checked_by_field() {
    for (field, value) in [
        (1, "x"),
        (2, "13"),
        (2, "0"),
        (3, "32"),
        (4, "0"),
        (4, "25"),
        (4, "13.5"),
        (5, "61"),
        (8, ""),
        (14, "inf"),
        (15, "1e400"),
        (15, "NaN"),
        (15, "1451"),
        (16, "1101"),
        (16, ""),
        (18, "x"),
        (19, ""),
    ] {
        refused(Epw::week().with(NOON, field, value).read(), line(NOON), field);
    }
    let mut short = Epw::week();
    short.records[NOON].truncate(15);
    refused(short.read(), line(NOON), 0);
}

/// A million commas behind a record or in a header change nothing.
#[test]
fn lines_of_commas_are_read_up_to_what_they_need() {
    let commas = ",".repeat(1 << 20);
    let text = Epw::week().text();
    let long = text.replacen("\n2017,6,1,2,", &format!("{commas}\n2017,6,1,2,"), 1);
    assert!(read(long.as_bytes()).is_ok());
    assert!(Epw::week().with_header(6, &format!("COMMENTS 1{commas}")).read().unwrap().file.comments.is_empty());
    refused(Epw::week().with_header(1, &format!("LOCATION{commas}")).read(), 1, 7);
}

#[test]
fn gaps_and_repeats_are_refused_where_they_are() {
    let week = Epw::week();
    let changed = |change: &dyn Fn(&mut Vec<Vec<String>>)| {
        let mut epw = week.clone();
        change(&mut epw.records);
        epw.read()
    };
    refused(changed(&|records| drop(records.remove(NOON))), line(NOON), 0);
    refused(changed(&|records| records.insert(NOON, records[NOON].clone())), line(NOON + 1), 0);
    refused(changed(&|records| records.swap(NOON, NOON + 1)), line(NOON), 0);
    refused(changed(&|records| drop(records.drain(24..48))), line(24), 0);
    refused(changed(&|records| drop(records.remove(0))), line(0), 0);
    refused(changed(&|records| drop(records.pop())), line(7 * 24 - 2), 0);
    let twice = Epw { records: [Epw::year().records, Epw::year().records].concat(), ..Epw::year() };
    refused(twice.read(), line(8760), 0);
}

/// A year may begin on any day, have a leap day, and have months of several years.
#[test]
fn years_of_all_kinds_are_taken() {
    let mut leap = Epw::year();
    let end_of_february = (31 + 28) * 24;
    let day: Vec<_> = leap.records[end_of_february - 24..end_of_february].to_vec();
    leap.records.splice(
        end_of_february..end_of_february,
        day.into_iter().map(|mut record| {
            record[2] = "29".to_owned();
            record
        }),
    );
    let read_leap = leap.read().unwrap();
    assert_eq!((read_leap.records.len(), read_leap.year_of_sun), (8784, 2016));
    leap.records.iter_mut().for_each(|record| record[0] = "2020".to_owned());
    assert_eq!(leap.read().unwrap().year_of_sun, 2020);

    let mut typical = Epw::year().with(0, 1, "1999");
    typical.records.rotate_left(181 * 24);
    let typical = typical.read().unwrap();
    assert_eq!((typical.year_of_sun, typical.records[0].month, typical.records.len()), (2017, 7, 8760));
}

/// Records of a quarter of an hour stand for its middle; their stamps may count minutes to 45 or to 60.
#[test]
fn parts_of_hours_are_counted_in_their_order() {
    let week = Epw::week();
    for minutes in [["15", "30", "45", "60"], ["0", "15", "30", "45"]] {
        let mut epw = week.clone().with_header(8, "DATA PERIODS,1,4,Data,Thursday, 6/ 1, 6/ 7");
        epw.records = week
            .records
            .iter()
            .flat_map(|record| {
                minutes.map(|minute| {
                    let mut record = record.clone();
                    record[4] = minute.to_owned();
                    record
                })
            })
            .collect();
        let weather = epw.read().unwrap();
        assert_eq!(
            (weather.records.len(), weather.records_per_hour, weather.sun_offset_minutes),
            (4 * 7 * 24, 4, -7.5)
        );
        assert_eq!([0, 1, 4, 95].map(|k| weather.records[k].middle_hour), [0.125, 0.375, 1.125, 23.875]);
        epw.records.remove(6);
        refused(epw.read(), line(7), 0);
    }
}

#[test]
fn repairs_are_made_and_counted_with_their_first_line() {
    let whole = Epw::week().read().unwrap();
    let noon = whole.records[NOON];
    assert!(noon.direct_normal_w_m2 > 100.0, "{noon:?}: the test needs a beam");
    let repaired = |fields: &[(usize, &str)]| {
        let epw = fields.iter().fold(Epw::week(), |epw, (field, value)| epw.with(NOON, *field, value));
        let weather = epw.read().unwrap();
        let [repair] = weather.file.repairs[..] else { panic!("{:?}", weather.file.repairs) };
        assert_eq!((repair.count, repair.first_line), (1, line(NOON)));
        (weather.records[NOON], repair.kind)
    };
    let (record, kind) = repaired(&[(15, "-0.5")]);
    assert_eq!((record.direct_normal_w_m2, kind), (0.0, RepairKind::NegativeIrradiance));
    let (record, kind) = repaired(&[(8, "99.9")]);
    assert_eq!((record.dew_point_c, kind), (11.0, RepairKind::MissingDewPoint));

    // whole watts of the global irradiance make an error of 0.5 W/m2 with a sun at 55 degrees; the file's own noise is 3.63 W/m2 rms
    let (record, kind) = repaired(&[(15, "9999")]);
    assert!((record.direct_normal_w_m2 - noon.direct_normal_w_m2).abs() < 15.0, "{record:?} {noon:?}");
    assert_eq!(kind, RepairKind::MissingDirect);
    let (record, kind) = repaired(&[(16, "-5")]);
    assert!((record.diffuse_horizontal_w_m2 - noon.diffuse_horizontal_w_m2).abs() < 12.0, "{record:?} {noon:?}");
    assert_eq!(kind, RepairKind::MissingDiffuse);

    let (record, kind) = repaired(&[(14, "9999"), (15, "9999")]);
    let day_before = whole.records[NOON - 24];
    assert_eq!(record.direct_normal_w_m2, day_before.direct_normal_w_m2);
    assert_eq!((record.diffuse_horizontal_w_m2, kind), (day_before.diffuse_horizontal_w_m2, RepairKind::MissingHour));
}

#[test]
fn hours_that_are_missing_are_few_or_at_night() {
    let missing = |records: &[usize]| {
        let all = [14, 15, 16].into_iter().flat_map(|field| records.iter().map(move |record| (*record, field)));
        all.fold(Epw::week(), |epw, (record, field)| epw.with(record, field, "9999")).read()
    };
    let whole = Epw::week().read().unwrap();
    assert!(missing(&[0, 1, 24, 48]).unwrap().file.repairs.is_empty());
    // on the first day there is no day before
    assert_eq!(missing(&[12]).unwrap().records[12].direct_normal_w_m2, whole.records[36].direct_normal_w_m2);
    // the sun is up for 17 hours a day: 1 % is one hour of the week
    refused(missing(&[12, 14]), line(12), 0);
    refused(missing(&(0..7 * 24).collect::<Vec<_>>()), line(4), 0);
}

/// A beam that is only known on a level plane cannot be computed while the sun is low.
#[test]
fn low_light_on_a_level_plane_is_no_beam() {
    // 3:30 of a morning of June: the sun rises
    let record = 2 * 24 + 3;
    let weather = Epw::week().with(record, 14, "30").with(record, 15, "9999").with(record, 16, "20").read().unwrap();
    assert_eq!(weather.records[record].direct_normal_w_m2, 0.0);
    let kinds: Vec<_> = weather.file.repairs.iter().map(|repair| repair.kind).collect();
    assert_eq!(kinds, [RepairKind::MissingDirect, RepairKind::LowDirect]);
}

#[test]
fn illuminances_are_kept_unless_they_are_missing_or_none_is_there() {
    let lux = |direct: &str, diffuse: &str| {
        Epw::week().with(NOON, 18, direct).with(NOON, 19, diffuse).read().unwrap().records[NOON].illuminances_lux
    };
    assert_eq!(lux("50000", "9000"), Some([50_000.0, 9000.0]));
    assert_eq!((lux("999900", "9000"), lux("50000", "-1"), lux("0", "0")), (None, None, None));
}
