//! Sky and sun of the moments of a year.

use std::borrow::Cow;

use glam::DVec3;
use skyduct_physics::geometry::turn::unit_vector;
use skyduct_physics::sky::{Irradiances, PerezSky, SkyDistribution};

use crate::moment::Moment;
use crate::weather::Record;

/// Origin of the illuminances of a year.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Illuminances {
    /// Irradiances of the file times the luminous efficacies of Perez et al. (1990).
    #[default]
    Perez,
    /// Illuminances of the file where it has them.
    File,
}

/// Sky and sun of a moment with light.
#[derive(Clone, Debug)]
pub struct LitMoment {
    /// Number of the record.
    pub record: usize,
    /// Part of the record's time, as in [`Moment::share`].
    pub share: f64,
    /// Unit vector toward the sun in the room's frame.
    pub sun: DVec3,
    /// Unit vector toward the sun, x east, y north.
    pub compass_sun: DVec3,
    /// Clearness of the sky, 1..=12.
    pub clearness: f64,
    /// Brightness of the sky, 0.01..=0.6.
    pub brightness: f64,
    /// Diffuse horizontal illuminance in lux.
    pub diffuse_horizontal_lux: f64,
    /// Direct normal illuminance in lux.
    pub direct_normal_lux: f64,
    /// Luminance of the sky relative to its zenith, in the room's frame.
    pub distribution: SkyDistribution,
}

impl LitMoment {
    /// Returns the horizontal illuminance of the sun in lux.
    pub fn direct_horizontal_lux(&self) -> f64 {
        self.direct_normal_lux * self.sun.z.max(0.0)
    }
}

/// Sources of daylight whose light a year counts; outdoors there are always both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sources {
    /// True for the light of the skies, and of all that they make bright around a tube.
    pub skies: bool,
    /// True for the light of the suns, also from the ground.
    pub suns: bool,
}

impl Sources {
    /// Returns the moments with the light of these sources alone.
    pub fn of(self, lit: &[LitMoment]) -> Cow<'_, [LitMoment]> {
        if self.skies && self.suns {
            return Cow::Borrowed(lit);
        }
        let counted = |is_counted: bool, lux: f64| if is_counted { lux } else { 0.0 };
        let of_moment = |moment: &LitMoment| LitMoment {
            diffuse_horizontal_lux: counted(self.skies, moment.diffuse_horizontal_lux),
            direct_normal_lux: counted(self.suns, moment.direct_normal_lux),
            ..moment.clone()
        };
        lit.iter().map(of_moment).collect()
    }
}

/// Computes skies and suns of the moments that have light; `rotation` is the azimuth of the room's +y axis in radians, clockwise from north.
pub fn lit(records: &[Record], moments: &[Moment], illuminances: Illuminances, rotation: f64) -> Vec<LitMoment> {
    // azimuths run clockwise, angles of vectors the other way
    let turn = unit_vector(rotation);
    let of = |moment: &Moment| {
        let record = records.get(moment.record)?;
        let irradiances = Irradiances {
            direct_normal_w_m2: record.direct_normal_w_m2,
            diffuse_horizontal_w_m2: record.diffuse_horizontal_w_m2,
            dew_point_c: record.dew_point_c,
        };
        if moment.sun.z <= 0.0 || irradiances.direct_normal_w_m2 + irradiances.diffuse_horizontal_w_m2 <= 0.0 {
            return None;
        }
        let sun = turn.rotate(moment.sun.truncate()).extend(moment.sun.z);
        let sky = PerezSky::new(irradiances, sun, Some(moment.day_of_year));
        let [direct_normal_lux, diffuse_horizontal_lux] = match (illuminances, record.illuminances_lux) {
            (Illuminances::File, Some(of_file)) => of_file,
            _ => [sky.direct_normal_illuminance_lux(), sky.diffuse_horizontal_illuminance_lux()],
        };
        Some(LitMoment {
            record: moment.record,
            share: moment.share,
            sun,
            compass_sun: moment.sun,
            clearness: sky.clearness,
            brightness: sky.brightness,
            diffuse_horizontal_lux,
            direct_normal_lux,
            distribution: SkyDistribution::new(sky.sky_type(), sun),
        })
    };
    moments.iter().filter_map(of).collect()
}

/// Computes the mean diffuse horizontal illuminance in lux of each of `records` records of the year, and the largest sine of the
/// sun's altitude; 0 in the dark.
pub fn by_record(lit: &[LitMoment], records: usize) -> (Vec<f64>, Vec<f64>) {
    let (mut diffuse_lux, mut sines) = (vec![0.0; records], vec![0.0; records]);
    for moment in lit {
        if let (Some(diffuse), Some(sine)) = (diffuse_lux.get_mut(moment.record), sines.get_mut(moment.record)) {
            *diffuse += moment.share * moment.diffuse_horizontal_lux;
            *sine = moment.sun.z.max(*sine);
        }
    }
    (diffuse_lux, sines)
}
