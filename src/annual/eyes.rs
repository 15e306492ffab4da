//! Glare of closures at eyes over a year: the unified glare rating.
//!
//! UGR = 8 lg((0.25 / Lb) sum(L^2 omega / p^2)) [CIE 117], with the luminance L and the solid angle omega of each closure, its position index p
//! [Guth 1963], and the background luminance Lb, which is the illuminance of the eye without the direct light of the closures over pi. A
//! Lambertian closure of the area A that sends the flux F into the room has the luminance F / (pi A).

use std::f64::consts::PI;

use glam::DVec3;
use skyduct_physics::scene::Sensor;
use skyduct_physics::traceable::{TraceableScene, TraceableTube};

use crate::metrics::Value;
use crate::response::RecordLight;

/// Ratings whose share of the occupied hours is counted.
pub const RATINGS: [f64; 4] = [16.0, 19.0, 22.0, 25.0];

/// Largest sine of the angle between a line of sight and the horizontal: sensors that face up or down are no eyes.
const STEEPEST: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Number of points along each side of the square that is mapped to a closure.
const POINTS: usize = 8;

/// Least part of an eye's illuminance that is indirect: noise of the responses may leave less.
const LEAST_INDIRECT: f64 = 1e-3;

/// Eye that looks about level, with all tubes as it sees them.
#[derive(Clone, Debug, PartialEq)]
pub struct Eye {
    tubes: Vec<SeenTube>,
}

/// Tube as an eye sees it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct SeenTube {
    /// Luminance in cd/m2 of the closure per lumen.
    luminance: f64,
    /// Illuminance in lx of the eye by the closure per luminance.
    direct_sr: f64,
    /// Solid angle in sr over the square of the position index.
    glare_sr: f64,
}

/// Direct light of all closures at an eye in a record.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Seen {
    direct_lux: f64,
    /// Sum of luminance squared and solid angle over the square of the position index, in cd2 sr/m4.
    glare: f64,
}

/// Glare of an eye over a year.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GlareYear {
    /// Share of the occupied records in percent with a rating above each of [`RATINGS`].
    pub above_percent: [Value; RATINGS.len()],
    /// Largest rating of an occupied record; 0 where no closure is seen.
    pub largest: Value,
}

/// True if a sensor faces about level, along a line of sight.
pub fn is_eye(sensor: &Sensor) -> bool {
    sensor.normal.z.abs() <= STEEPEST
}

impl Eye {
    /// Returns the eye at a sensor that faces along the line of sight; `None` for sensors that face up or down.
    pub fn new(scene: &TraceableScene, sensor: &Sensor) -> Option<Self> {
        is_eye(sensor)
            .then(|| Self { tubes: scene.tubes.iter().map(|tube| SeenTube::new(scene, tube, sensor)).collect() })
    }

    /// Returns the memory of an eye in bytes.
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + size_of_val(self.tubes.as_slice())
    }

    /// Computes the rating in each lit record from the illuminances of the eye in lux; 0 where no closure is seen.
    pub fn ratings(&self, lux: &[f64], light: &RecordLight) -> Vec<f64> {
        lux.iter().zip(self.seen(light)).map(|(lux, seen)| seen.rating(*lux)).collect()
    }

    /// Sums the direct light of all closures in each lit record.
    fn seen(&self, light: &RecordLight) -> Vec<Seen> {
        let of_record = |place: usize| {
            let mut seen = Seen::default();
            for (tube, lights) in self.tubes.iter().zip(&light.tubes) {
                let luminance = tube.luminance * lights[place].lumens;
                seen.direct_lux += luminance * tube.direct_sr;
                seen.glare += luminance * luminance * tube.glare_sr;
            }
            seen
        };
        (0..light.records.len()).map(of_record).collect()
    }

    /// Computes the glare over the records of which `occupied` counts some, from the illuminances of the eye in lux in the lit ones and their
    /// relative error.
    pub fn year(&self, (lux, error): (&[f64], f64), light: &RecordLight, occupied: &[bool]) -> GlareYear {
        let count = occupied.iter().filter(|occupied| **occupied).count().max(1) as f64;
        let lit = lux.iter().zip(self.seen(light)).zip(&light.records);
        let lit = lit.filter(|(_, record)| occupied.get(**record) == Some(&true));
        let lit: Vec<(f64, Seen)> = lit.map(|((lux, seen), _)| (*lux, seen)).collect();
        let of_factor = |factor: f64| lit.iter().map(move |(lux, seen)| seen.rating(factor * lux));
        let above = |limit: f64| {
            Value::by_delta(error, |factor| {
                100.0 * of_factor(factor).filter(|rating| *rating > limit).count() as f64 / count
            })
        };
        let largest = Value::by_delta(error, |factor| of_factor(factor).fold(0.0, f64::max));
        GlareYear { above_percent: RATINGS.map(above), largest }
    }
}

impl Seen {
    /// Computes the rating from the illuminance of the eye in lux.
    fn rating(&self, lux: f64) -> f64 {
        let background = (lux - self.direct_lux).max(LEAST_INDIRECT * lux) / PI;
        match self.glare > 0.0 && background > 0.0 {
            true => (8.0 * libm::log10(0.25 * self.glare / background)).max(0.0),
            false => 0.0,
        }
    }
}

impl SeenTube {
    fn new(scene: &TraceableScene, tube: &TraceableTube, eye: &Sensor) -> Self {
        let area = tube.opening.area_m2();
        let mut seen = Self { luminance: 1.0 / (PI * area), ..Self::default() };
        for point in tube.opening.points(POINTS).map(|away| tube.at(away)) {
            let away = point - eye.position;
            let (distance, toward) = (away.length(), away.normalize_or_zero());
            let Some(index) = position_index(eye.normal, toward) else { continue };
            // the closure shines into the room
            let cosine = tube.frame.up(toward);
            if cosine <= 0.0 || !scene.visible(eye.position, None, point, None) {
                continue;
            }
            let solid_angle = area / (POINTS * POINTS) as f64 * cosine / (distance * distance);
            seen.direct_sr += solid_angle * eye.normal.dot(toward);
            seen.glare_sr += solid_angle / (index * index);
        }
        seen
    }
}

/// Computes the position index of a source in the direction of a unit vector from an eye with this line of sight; `None` behind the eye.
///
/// ln p = (35.2 - 0.31889 a - 1.22 exp(-2 a / 9)) 10^-3 b + (21 + 0.26667 a - 0.002963 a^2) 10^-5 b^2 in degrees [Guth 1963]: b is the angle between
/// the source and the line of sight, a that between the plane of the two and the vertical. It holds for sources above the line of sight, for which it
/// was measured; those below count as above.
///
/// ```
/// use glam::DVec3;
/// use skyduct_annual::eyes::position_index;
///
/// // straight ahead, and at half the distance above it
/// assert_eq!(position_index(DVec3::X, DVec3::X), Some(1.0));
/// let above = position_index(DVec3::X, DVec3::new(1.0, 0.0, 0.5).normalize()).unwrap();
/// assert!((above - 2.86).abs() < 0.01);
/// ```
pub fn position_index(line_of_sight: DVec3, toward: DVec3) -> Option<f64> {
    let cosine = line_of_sight.dot(toward);
    if cosine <= 0.0 {
        return None;
    }
    let b = libm::atan2(line_of_sight.cross(toward).length(), cosine).to_degrees();
    let across = line_of_sight.cross(DVec3::Z).normalize_or_zero();
    let up = across.cross(line_of_sight);
    let a = libm::atan2(toward.dot(across).abs(), toward.dot(up).abs()).to_degrees();
    let linear = 35.2 - 0.31889 * a - 1.22 * libm::exp(-2.0 * a / 9.0);
    let square = 21.0 + 0.26667 * a - 0.002963 * a * a;
    Some(libm::exp(1e-3 * linear * b + 1e-5 * square * b * b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::response::TubeRecord;

    /// Checks an eye with one distant closure by hand, and that light of the room lowers the rating by 8 for ten times as much.
    #[test]
    fn ratings_follow_luminance_and_background() {
        let seen = SeenTube { luminance: 2.0, direct_sr: 0.01, glare_sr: 0.02 };
        let eye = Eye { tubes: vec![seen] };
        let lumens = |lumens: f64| TubeRecord { lumens, ..TubeRecord::default() };
        let tubes = vec![vec![lumens(1000.0), lumens(1000.0), lumens(0.0), lumens(10_000.0)]];
        let light = RecordLight::of_records(vec![0, 2, 3, 5], tubes, vec![0.0]);
        // luminance 2000, direct 20 lx; indirect 100 lx and ten times as much
        let lux = [120.0, 1020.0, 50.0, 1200.0];
        let found = eye.ratings(&lux, &light);
        let expected = 8.0 * (0.25 * PI / 100.0 * 2000.0f64.powi(2) * 0.02).log10();
        assert!((found[0] - expected).abs() < 1e-12 && (found[0] - found[1] - 8.0).abs() < 1e-12, "{found:?}");
        // ten times the light everywhere raises it by 8
        assert!(found[2] == 0.0 && (found[3] - found[0] - 8.0).abs() < 1e-12, "{found:?}");
        let occupied = [true, true, true, true, true, false];
        let year = eye.year((&lux, 0.0), &light, &occupied);
        assert_eq!(year.above_percent.map(|share| share.value), [20.0, 20.0, 20.0, 0.0]);
        assert_eq!(year.largest.value, found[0]);
    }

    #[test]
    fn positions_beside_and_behind() {
        let beside = |y: f64, z: f64| position_index(DVec3::X, DVec3::new(1.0, y, z).normalize());
        assert_eq!(beside(0.4, 0.3), beside(-0.4, 0.3));
        // sources beside the line of sight disturb more than those above it
        assert!(beside(0.5, 0.0) < beside(0.0, 0.5) && beside(0.0, 0.2) < beside(0.0, 0.5));
        assert_eq!(position_index(DVec3::X, DVec3::NEG_X), None);
    }
}
