//! Time zones of locations, and the offsets of their clocks from UTC.
//!
//! Borders of zones are those of timezone-boundary-builder, made from OpenStreetMap and simplified by some hundred metres; the
//! sea beyond territorial waters has nautical time zones. Rules of the clocks are those of the IANA. Both tables are part of the
//! program, so that results do not depend on the machine.

use std::sync::LazyLock;

use jiff::Timestamp;
use jiff::civil::DateTime;
use jiff::tz::{AmbiguousOffset, Offset, TimeZone, TimeZoneDatabase};
use tzf_rs::EmbeddedFinder;

/// Borders of the zones: 4 MB of the program, used without copying.
static BORDERS: LazyLock<EmbeddedFinder> = LazyLock::new(EmbeddedFinder::new);

/// Rules of the clocks.
static RULES: LazyLock<TimeZoneDatabase> = LazyLock::new(TimeZoneDatabase::bundled);

/// Possible meanings of a local time, in RFC 3339 with the zone's offset.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Times {
    /// The local time occurs once.
    Once(String),
    /// The local time occurs twice, because clocks are set back over it.
    Twice {
        /// Time before the clocks are set back.
        first: String,
        /// Time after the clocks are set back.
        second: String,
    },
    /// The local time does not occur, because clocks are set forward over it.
    Never {
        /// Time shown in place of the one that does not occur, later by as much as the clocks are set forward.
        instead: String,
    },
}

/// Returns the name of the zone at a latitude (-90..90 degrees, north positive) and longitude (-180..180 degrees, east positive).
/// Returns one of the zones if the border is disputed.
pub fn zone_at(latitude_deg: f64, longitude_deg: f64) -> &'static str {
    BORDERS.get_tz_name(longitude_deg, latitude_deg)
}

/// A time zone of the IANA.
#[derive(Clone, Debug)]
pub struct Zone(TimeZone);

impl Zone {
    /// Returns the zone with this name, in upper or lower case; `None` if there is none.
    pub fn named(name: &str) -> Option<Self> {
        RULES.get(name).ok().filter(|zone| !zone.is_unknown()).map(Self)
    }

    /// Returns the name as the IANA spells it.
    pub fn name(&self) -> &str {
        self.0.iana_name().unwrap_or("UTC")
    }

    /// Returns the possible meanings of a local time; `None` at the limits of representable times.
    pub fn times(&self, local: DateTime) -> Option<Times> {
        let time = |offset: Offset| {
            let instant = offset.to_timestamp(local).ok()?;
            Some(written(instant, self.0.to_offset(instant)))
        };
        Some(match self.0.to_ambiguous_timestamp(local).offset() {
            AmbiguousOffset::Unambiguous { offset } => Times::Once(time(offset)?),
            AmbiguousOffset::Fold { before, after } => Times::Twice { first: time(before)?, second: time(after)? },
            AmbiguousOffset::Gap { before, .. } => Times::Never { instead: time(before)? },
        })
    }
}

/// Formats an instant in RFC 3339. Before zones existed, offsets had seconds, which RFC 3339 cannot express: the offset is
/// rounded to minutes, and the instant is kept.
fn written(instant: Timestamp, offset: Offset) -> String {
    let minutes = (f64::from(offset.seconds()) / 60.0).round() as i32;
    instant.display_with_offset(Offset::from_seconds(60 * minutes).unwrap_or(offset)).to_string()
}

#[cfg(test)]
mod tests {
    use super::super::time::local;
    use super::*;

    fn once(latitude: f64, longitude: f64, time: &str) -> String {
        match Zone::named(zone_at(latitude, longitude)).unwrap().times(local(time).unwrap()).unwrap() {
            Times::Once(time) => time[19..].to_owned(),
            other => panic!("{other:?}"),
        }
    }

    /// Checks offsets in winter and summer near cities, of half hours, at sea, at the poles and at the date line.
    #[test]
    fn clocks_of_places_are_right_all_year() {
        for (place, latitude, longitude, january, july) in [
            ("beside Copenhagen", 55.69, 12.9, "+01:00", "+02:00"),
            ("Copenhagen", 55.69, 12.55, "+01:00", "+02:00"),
            ("Aarhus", 56.16, 10.2, "+01:00", "+02:00"),
            ("Leeds", 53.8, -1.55, "+00:00", "+01:00"),
            ("Reykjavik", 64.14, -21.9, "+00:00", "+00:00"),
            ("Kathmandu", 27.71, 85.32, "+05:45", "+05:45"),
            ("Delhi", 28.61, 77.21, "+05:30", "+05:30"),
            ("Adelaide", -34.93, 138.6, "+10:30", "+09:30"),
            ("Lord Howe", -31.55, 159.08, "+11:00", "+10:30"),
            ("Chatham", -43.95, -176.55, "+13:45", "+12:45"),
            ("St John's", 47.56, -52.71, "-03:30", "-02:30"),
            ("Phoenix", 33.45, -112.07, "-07:00", "-07:00"),
            ("Santiago", -33.45, -70.66, "-03:00", "-04:00"),
            ("Sydney", -33.87, 151.21, "+11:00", "+10:00"),
            ("Brisbane", -27.47, 153.03, "+10:00", "+10:00"),
            ("the Atlantic", 0.0, -30.0, "-02:00", "-02:00"),
            ("the North Sea", 56.5, 4.0, "+00:00", "+00:00"),
            ("the North Pole", 90.0, 0.0, "+00:00", "+00:00"),
            ("the South Pole", -90.0, 0.0, "+13:00", "+12:00"),
            ("the line of dates, east", 0.0, 180.0, "+12:00", "+12:00"),
            ("the line of dates, west", 0.0, -180.0, "-12:00", "-12:00"),
            ("Taveuni, beyond it", -16.8, -179.97, "+12:00", "+12:00"),
            ("Kiritimati", 1.87, -157.4, "+14:00", "+14:00"),
        ] {
            let found = [once(latitude, longitude, "2026-01-15T12:00"), once(latitude, longitude, "2026-07-15T12:00")];
            assert_eq!(found, [january, july], "{place}: {}", zone_at(latitude, longitude));
        }
    }

    /// Checks that every place on Earth has a zone with rules, whose offset fits its longitude.
    #[test]
    fn every_place_has_a_clock() {
        let noon = local("2026-01-15T12:00").unwrap();
        for (latitude, longitude) in (-180..=180).flat_map(|x| (-90..=90).map(move |y| (f64::from(y), f64::from(x)))) {
            let name = zone_at(latitude, longitude);
            let zone = Zone::named(name).unwrap_or_else(|| panic!("{latitude} {longitude}: {name:?}"));
            let offset = zone
                .0
                .to_fixed_offset()
                .unwrap_or_else(|_| zone.0.to_offset(zone.0.to_ambiguous_timestamp(noon).compatible().unwrap()));
            let hours = f64::from(offset.seconds()) / 3600.0 - longitude / 15.0;
            let apart = (hours + 12.0).rem_euclid(24.0) - 12.0;
            assert!(apart.abs() < 4.0 || latitude.abs() > 60.0, "{latitude} {longitude}: {name} {apart}");
        }
    }

    #[test]
    fn times_that_clocks_leap_over_or_show_twice_are_told() {
        let zone = Zone::named("europe/copenhagen").unwrap();
        assert_eq!(zone.name(), "Europe/Copenhagen");
        let times = |time| zone.times(local(time).unwrap()).unwrap();
        assert_eq!(times("2026-03-29T02:30"), Times::Never { instead: "2026-03-29T03:30:00+02:00".to_owned() });
        assert_eq!(times("2026-03-29T03:00"), Times::Once("2026-03-29T03:00:00+02:00".to_owned()));
        assert_eq!(
            times("2026-10-25T02:30:10"),
            Times::Twice {
                first: "2026-10-25T02:30:10+02:00".to_owned(),
                second: "2026-10-25T02:30:10+01:00".to_owned()
            }
        );
        // half an hour on Lord Howe; a day that Samoa left out
        let of = |name: &str, time: &str| Zone::named(name).unwrap().times(local(time).unwrap()).unwrap();
        let instead = |time: &str| Times::Never { instead: time.to_owned() };
        assert_eq!(of("Australia/Lord_Howe", "2026-10-04T02:15"), instead("2026-10-04T02:45:00+11:00"));
        assert_eq!(of("Pacific/Apia", "2011-12-30T12:00"), instead("2011-12-31T12:00:00+14:00"));
        // an offset with seconds, -04:56:02: the instant is kept
        assert_eq!(of("America/New_York", "1880-01-01T12:00"), Times::Once("1880-01-01T12:00:02-04:56".to_owned()));
        assert!(["", "Europe", "Europe/Aarhus", "Etc/Unknown", "+02:00"].map(Zone::named).iter().all(Option::is_none));
        assert_eq!(Zone::named("UTC").unwrap().name(), "UTC");
    }
}
