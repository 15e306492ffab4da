//! Files that chance has changed are read or refused with one of their lines, and never make a panic.

use skyduct_annual::moment::{Convention, moments};
use skyduct_annual::weather::read;

use crate::Epw;

const CASES: u64 = 600;

/// SplitMix64 (Steele, Lea and Flood 2014).
struct Chance(u64);

impl Chance {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % bound.max(1) as u64) as usize
    }
}

/// Values that fields may get.
const VALUES: [&str; 12] = ["", "0", "-1", "24", "9999", "1e308", "-1e308", "NaN", "inf", "\"", "2/30", "\u{fc}"];

fn changed(bytes: &[u8], chance: &mut Chance) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..=chance.below(3) {
        let at = chance.below(bytes.len());
        match chance.below(6) {
            0 => bytes[at] = chance.below(256) as u8,
            1 => bytes.truncate(at),
            2 => drop(bytes.drain(at..(at + chance.below(200)).min(bytes.len()))),
            3 => {
                let part = bytes[at..(at + chance.below(200)).min(bytes.len())].to_vec();
                bytes.splice(at..at, part);
            }
            4 => bytes.insert(at, b"\n\r,\" \xff"[chance.below(6)]),
            _ => {
                // a field of the header as often as one of the records
                let at = if chance.below(2) == 0 { at.min(chance.below(500)) } else { at };
                let rest =
                    bytes[at..].iter().position(|byte| b", \n".contains(byte)).map_or(bytes.len(), |end| at + end);
                let end = bytes[rest..]
                    .iter()
                    .skip(1)
                    .position(|byte| b", \n".contains(byte))
                    .map_or(bytes.len(), |end| rest + 1 + end);
                bytes.splice((rest + 1).min(end)..end, VALUES[chance.below(VALUES.len())].bytes());
            }
        }
    }
    bytes
}

#[test]
fn no_change_makes_a_panic() {
    let mut days = Epw::week().with_header(8, "DATA PERIODS,1,1,Data,Thursday, 6/ 1, 6/ 2");
    days.records.truncate(48);
    let epw = days.text();
    let rows = |record: &Vec<String>| {
        let hour: f64 = record[3].parse().unwrap();
        format!("{} {} {} {} {}\n", record[1], record[2], hour - 0.5, record[14], record[15])
    };
    let wea = "place X\nlatitude 55\nlongitude -12\ntime_zone -15\nsite_elevation 20\nweather_data_file_units 2\n"
        .to_owned()
        + &days.records.iter().map(rows).collect::<String>();
    let mut chance = Chance(1);
    let (mut taken, mut refused) = (0, 0);
    for original in [epw, wea] {
        for _ in 0..CASES {
            let bytes = changed(original.as_bytes(), &mut chance);
            match read(&bytes) {
                Ok(weather) => {
                    taken += 1;
                    assert!(moments(&weather, Convention { suns_per_hour: 3, ..Convention::of(&weather) }).is_ok());
                    for record in &weather.records {
                        let light = [record.direct_normal_w_m2, record.diffuse_horizontal_w_m2];
                        assert!(light.iter().all(|light| (0.0..1e6).contains(light)), "{record:?}");
                        assert!((0.0..24.0).contains(&record.middle_hour) && record.dew_point_c.is_finite());
                    }
                }
                Err(error) => {
                    refused += 1;
                    let lines = 1 + bytes.iter().filter(|byte| **byte == b'\n').count();
                    assert!((1..=lines.max(1)).contains(&error.line) && !error.detail.is_empty(), "{error} of {lines}");
                }
            }
        }
    }
    assert!(taken > 100 && refused > 100, "{taken} {refused}");
}
