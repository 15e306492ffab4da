//! WEA files of Radiance.

use skyduct_annual::light::{Illuminances, lit};
use skyduct_annual::moment::{Convention, moments};
use skyduct_annual::weather::{Format, Weather, WeatherError, read};

use crate::{Epw, refused};

const HEADER: &str = "place Copenhagen North\nlatitude 55.77\nlongitude -12.50\ntime_zone -15\nsite_elevation 20.0\n";

/// Lines before the first record.
const HEADER_LINES: usize = 6;

/// Returns the week in June as a WEA file, with direct light by a function of the record's number.
fn week(units: &str, direct: impl Fn(usize) -> f64) -> String {
    let records = Epw::week().records;
    let row = |(k, record): (usize, &Vec<String>)| {
        let hour: f64 = record[3].parse().unwrap();
        format!("{} {} {:.3} {} {}\n", record[1], record[2], hour - 0.5, direct(k), record[15])
    };
    let rows: String = records.iter().enumerate().map(row).collect();
    format!("{HEADER}weather_data_file_units {units}\n{rows}")
}

fn read_text(text: &str) -> Result<Weather, WeatherError> {
    read(text.as_bytes())
}

/// A week is the same weather with the same suns in both kinds of files.
#[test]
fn a_week_is_that_of_its_epw_file() {
    let epw = Epw::week().read().unwrap();
    let wea = read_text(&week("1", |k| epw.records[k].direct_normal_w_m2)).unwrap();
    assert_eq!((wea.file.format, wea.sun_offset_minutes, wea.file.first_line), (Format::Wea, 0.0, HEADER_LINES + 1));
    assert_eq!(wea.site.name, "Copenhagen North");
    assert_eq!([wea.site.longitude_deg, wea.site.utc_offset_hours], [12.5, 1.0]);
    assert_eq!((wea.first_weekday, wea.year_of_sun, wea.file.closure), (3, 2017, None));
    for (wea, epw) in wea.records.iter().zip(&epw.records) {
        assert_eq!(wea.dew_point_c, 11.0);
        assert_eq!(skyduct_annual::weather::Record { dew_point_c: epw.dew_point_c, ..*wea }, *epw);
    }
    let suns = |weather: &Weather| moments(weather, Convention::of(weather)).unwrap();
    assert_eq!(suns(&wea), suns(&epw));
}

/// Direct light on a level plane over the sine of the sun's altitude is the beam.
#[test]
fn direct_light_on_a_level_plane_becomes_a_beam() {
    let epw = Epw::week().read().unwrap();
    let mut on_plane = vec![0.0; epw.records.len()];
    for moment in moments(&epw, Convention::of(&epw)).unwrap().moments {
        on_plane[moment.record] = epw.records[moment.record].direct_normal_w_m2 * moment.sun.z;
    }
    let wea = read_text(&week("2", |k| on_plane[k])).unwrap();
    let mut high = 0;
    for moment in moments(&epw, Convention::of(&epw)).unwrap().moments.iter().filter(|moment| moment.sun.z > 0.1) {
        let [found, direct] = [&wea, &epw].map(|weather| weather.records[moment.record].direct_normal_w_m2);
        assert!((found - direct).abs() < 1e-9 * direct.max(1.0), "{found} {direct}");
        high += usize::from(direct > 0.0);
    }
    assert!(high > 50, "{high}");
    assert!(wea.file.repairs.iter().all(|repair| repair.kind == skyduct_annual::weather::RepairKind::LowDirect));
}

/// Illuminances by the efficacies of the irradiances lead back to the irradiances, and stay as they are.
#[test]
fn illuminances_lead_to_irradiances() {
    let epw = Epw::week().read().unwrap();
    let header = format!("{HEADER}weather_data_file_units 1\n");
    let rows = |of: &dyn Fn(usize) -> [f64; 2]| -> String {
        let row = |(k, record): (usize, &skyduct_annual::weather::Record)| {
            let [direct, diffuse] = of(k);
            format!("{} {} {:.3} {direct} {diffuse}\n", record.month, record.day, record.middle_hour)
        };
        epw.records.iter().enumerate().map(row).collect()
    };
    let of_record = |k: usize| [epw.records[k].direct_normal_w_m2, epw.records[k].diffuse_horizontal_w_m2];
    let in_watts = read_text(&(header.clone() + &rows(&of_record))).unwrap();
    let light = |weather: &Weather, source: Illuminances| {
        lit(&weather.records, &moments(weather, Convention::of(weather)).unwrap().moments, source, 0.0)
    };
    let given = light(&in_watts, Illuminances::Perez);
    let lux = |k: usize| {
        let of_record = given.iter().find(|moment| moment.record == k);
        of_record.map_or([0.0; 2], |moment| [moment.direct_normal_lux, moment.diffuse_horizontal_lux])
    };
    let in_lux = read_text(&(header.replace("units 1", "units 3") + &rows(&lux))).unwrap();
    assert!(in_lux.file.is_photometric && !in_watts.file.is_photometric);
    let found = light(&in_lux, Illuminances::File);
    assert!(found.len() > 80 && found.len() == given.len());
    let mut alike = 0;
    for (found, given) in found.iter().zip(&given) {
        assert_eq!(found.direct_normal_lux, given.direct_normal_lux);
        assert_eq!(found.diffuse_horizontal_lux, given.diffuse_horizontal_lux);
        let same = (found.clearness / given.clearness - 1.0).abs() < 0.01;
        alike += usize::from(same && (found.brightness / given.brightness - 1.0).abs() < 0.01);
    }
    // efficacies jump where clearness changes its class, and a sun that is partly down is not in the middle of its record
    assert!(alike * 100 > 85 * given.len(), "{alike} of {}", given.len());
}

#[test]
fn faults_have_a_line_and_a_field() {
    let good = week("1", |_| 100.0);
    assert!(read_text(&good).is_ok());
    let changed = |from: &str, to: &str| read_text(&good.replacen(from, to, 1));
    refused(changed("latitude 55.77", "latitude north"), 2, 2);
    refused(changed("longitude -12.50", "longitude -190"), 3, 2);
    refused(changed("time_zone -15\n", ""), 6, 0);
    refused(changed("site_elevation", "elevation"), 5, 0);
    refused(read_text(&week("4", |_| 100.0)), 6, 2);
    refused(read_text(&week("3", |_| 200_001.0)), HEADER_LINES + 1, 4);
    refused(changed("6 1 1.500", "6 1 2.500"), HEADER_LINES + 2, 3);
    refused(changed("6 1 3.500", "6 1 4.500"), HEADER_LINES + 4, 0);
    refused(changed("6 1 3.500", "6 1 24.0"), HEADER_LINES + 4, 3);
    refused(changed("6 1 3.500 100", "6 1 3.500 x"), HEADER_LINES + 4, 4);
    refused(changed("6 1 3.500 100", "6 1 3.500 1500"), HEADER_LINES + 4, 4);
    refused(changed("6 1 1.500", "6 1 0.300"), HEADER_LINES + 2, 3);
    let begin: String = good.lines().take(HEADER_LINES + 30).map(|line| format!("{line}\n")).collect();
    refused(read_text(&begin), HEADER_LINES + 30, 0);
    refused(read_text(&format!("{HEADER}weather_data_file_units 1\n")), 1, 0);
}
