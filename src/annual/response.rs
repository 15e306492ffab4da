//! Responses of sensors to tubes: illuminance per lumen, and its change as the centroid of the light moves over a closure.

use glam::DVec2;

use crate::fluxes::{TubeLight, TubeYear};
use crate::light::LitMoment;
use crate::pattern::PATTERN;

/// Illuminances of one sensor, or of the mean of several, in the lit records of a year.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LitRow {
    /// Illuminance in lux in each lit record.
    pub lux: Vec<f64>,
    /// Standard errors in lux that are independent from record to record; empty where there are none.
    pub noise_lux: Vec<f64>,
    /// Relative standard error of the sum over the records.
    pub relative_error: f64,
    /// Relative standard error that is the same in all records: that of the sum where there is no independent one.
    pub common_error: f64,
}

impl LitRow {
    /// Parts the errors into one that is the same in all records and independent ones: `noise_lux` are at first the whole errors of the records,
    /// and `relative_error` is that of their sum.
    ///
    /// With a common error e and independent errors s the sum has the variance (e sum E)^2 + sum s^2, and a record e^2 E^2 + s^2.
    pub(crate) fn part_errors(&mut self) {
        let sum: f64 = self.lux.iter().sum();
        let [squares, noises] =
            [&self.lux, &self.noise_lux].map(|of| of.iter().map(|value| value * value).sum::<f64>());
        let rest = sum * sum - squares;
        let common = (self.relative_error * sum).powi(2) - noises;
        let common = if rest > 0.0 { (common / rest).max(0.0) } else { self.relative_error * self.relative_error };
        for (noise, lux) in self.noise_lux.iter_mut().zip(&self.lux) {
            *noise = (*noise * *noise - common * lux * lux).max(0.0).sqrt();
        }
        self.common_error = common.sqrt();
    }
}

/// Response of a sensor to a tube.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Response {
    /// Illuminance in lx per lumen that leaves the closure evenly.
    pub lux_per_lumen: f64,
    /// Change of `lux_per_lumen` per metre by which the centroid of the light is away from the closure's centre, along x and y.
    pub gradient: DVec2,
    /// Root mean square over the closure of the part of the response in lx per lumen that the gradient does not tell.
    pub left_out: f64,
    /// Standard error of `lux_per_lumen`.
    pub standard_error: f64,
}

/// Responses of the sensors of a grid to all tubes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Responses {
    /// Responses tube by tube, of all sensors.
    pub tubes: Vec<Vec<Response>>,
    /// Standard error of each sensor's sum over the tubes, over the sum of their standard errors: 1 where the errors of tubes are the same,
    /// less where they are independent.
    pub correlations: Vec<f64>,
    /// Standard error of each sensor's response to one lumen from every tube.
    errors_of_all: Vec<f64>,
    /// Standard error of the mean of these responses over the area; `None` where it is not known.
    error_of_mean: Option<f64>,
}

impl Responses {
    /// Makes the responses of sensors to all tubes; `errors_of_all` are the standard errors of each sensor's response to one lumen from every
    /// tube, and `error_of_mean` that of its mean over the area. They tell how much the errors of tubes and of sensors go together: fully where
    /// there are none.
    pub fn new(tubes: Vec<Vec<Response>>, errors_of_all: Vec<f64>, error_of_mean: Option<f64>) -> Self {
        let correlation = |(sensor, of_all): (usize, &f64)| {
            let apart: f64 = tubes.iter().map(|tube| tube[sensor].standard_error).sum();
            if apart > 0.0 { (of_all / apart).min(1.0) } else { 1.0 }
        };
        let correlations = errors_of_all.iter().enumerate().map(correlation).collect();
        Self { correlations, tubes, errors_of_all, error_of_mean }
    }

    /// Returns the number of sensors.
    pub fn sensors(&self) -> usize {
        self.tubes.first().map_or(0, Vec::len)
    }

    /// Returns the responses of the mean of sensors, whose weights are their areas; where the error of the mean is not known, those of all
    /// sensors are taken as the same. Zero for weights that add up to nothing.
    pub fn mean(&self, weights: &[f64]) -> Self {
        let whole = weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let of_tube = |responses: &Vec<Response>| {
            let mut mean = Response::default();
            for (response, weight) in responses.iter().zip(weights).filter(|(_, weight)| **weight > 0.0) {
                mean.lux_per_lumen += response.lux_per_lumen * (weight / whole);
                mean.gradient += response.gradient * (weight / whole);
                mean.left_out += response.left_out * (weight / whole);
                mean.standard_error += response.standard_error * (weight / whole);
            }
            vec![mean]
        };
        let weighted = |values: &[f64]| values.iter().zip(weights).map(|(value, weight)| value * weight / whole).sum();
        let alike: f64 = weighted(&self.errors_of_all);
        let part = |error: f64| if alike > 0.0 { (error / alike).min(1.0) } else { 1.0 };
        let correlation = self.error_of_mean.map_or(1.0, part) * weighted(&self.correlations);
        let correlations = if self.correlations.is_empty() { Vec::new() } else { vec![correlation] };
        Self { tubes: self.tubes.iter().map(of_tube).collect(), correlations, ..Self::default() }
    }

    /// Computes the illuminances of a sensor.
    pub fn row(&self, sensor: usize, light: &RecordLight) -> LitRow {
        let relative_error = self.relative_error(sensor, light);
        let lux = self.illuminances_lux(sensor, light);
        LitRow { lux, noise_lux: Vec::new(), relative_error, common_error: relative_error }
    }

    /// Computes the illuminance in lux of a sensor in each lit record.
    pub fn illuminances_lux(&self, sensor: usize, light: &RecordLight) -> Vec<f64> {
        let mut lit = vec![0.0; light.records.len()];
        for alike in &light.alike {
            let (mut lux_per_lumen, mut gradient) = (0.0, DVec2::ZERO);
            for responses in alike.iter().filter_map(|tube| self.tubes.get(*tube)) {
                lux_per_lumen += responses[sensor].lux_per_lumen;
                gradient += responses[sensor].gradient;
            }
            let of_each = alike.first().map_or(&[][..], |tube| light.tubes[*tube].as_slice());
            for (lux, light) in lit.iter_mut().zip(of_each) {
                *lux += lux_per_lumen * light.lumens + gradient.dot(light.moment);
            }
        }
        lit.iter_mut().for_each(|lux| *lux = lux.max(0.0));
        lit
    }

    /// Returns the illuminance in lux of a sensor by each tube alone, as the mean over all `records` of the year, dark ones included: which
    /// tube serves which desk.
    pub fn mean_by_tube_lux(&self, sensor: usize, light: &RecordLight, records: usize) -> Vec<f64> {
        let of_tube = |(responses, whole): (&Vec<Response>, &TubeRecord)| {
            let response = responses[sensor];
            (response.lux_per_lumen * whole.lumens + response.gradient.dot(whole.moment)) / records.max(1) as f64
        };
        self.tubes.iter().zip(&light.sums).map(of_tube).collect()
    }

    /// Computes the illuminance in lux of a sensor per lux outside from areas in m2 of all tubes, which are lumens per lux.
    pub fn of_areas(&self, sensor: usize, areas_m2: &[f64]) -> f64 {
        self.tubes.iter().zip(areas_m2).map(|(responses, area)| responses[sensor].lux_per_lumen * area).sum()
    }

    /// Computes the relative standard error of the illuminances of a sensor, which is the same in all records: that of the responses, and in
    /// quadrature that of traced tubes and that of the patterns of beams, as if these were the same in all of them.
    pub fn relative_error(&self, sensor: usize, light: &RecordLight) -> f64 {
        let [mut whole, mut of_responses, mut of_tubes, mut of_patterns] = [0.0; 4];
        for ((responses, sum), error) in self.tubes.iter().zip(&light.sums).zip(&light.relative_errors) {
            let response = responses[sensor];
            whole += response.lux_per_lumen * sum.lumens;
            of_responses += response.standard_error * sum.lumens;
            of_tubes += response.lux_per_lumen * sum.lumens * error;
            of_patterns = libm::hypot(of_patterns, PATTERN * response.left_out * sum.beam_lumens);
        }
        let correlation = self.correlations.get(sensor).copied().unwrap_or(1.0);
        let error = libm::hypot(libm::hypot(correlation * of_responses, of_tubes), of_patterns);
        if whole > 0.0 { error / whole } else { 0.0 }
    }
}

/// Light of a tube in a record: lumens, and their first moment in lm m about the closure's centre.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TubeRecord {
    /// Mean flux over the record's time in lm.
    pub lumens: f64,
    /// Part of it that is of the sun's beam.
    pub beam_lumens: f64,
    /// Flux times the centroid of the light.
    pub moment: DVec2,
}

/// Light of all tubes in the records that have any.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordLight {
    /// Numbers of the records with light, in order.
    pub records: Vec<usize>,
    /// Light of each tube in these records.
    pub tubes: Vec<Vec<TubeRecord>>,
    /// Relative standard errors of the light of tubes.
    pub relative_errors: Vec<f64>,
    /// Light of each tube, summed over the records.
    sums: Vec<TubeRecord>,
    /// Numbers of tubes that have the same light in all records, in groups.
    alike: Vec<Vec<usize>>,
}

impl RecordLight {
    /// Gathers the light of tubes with its relative errors in the records with light, given by their numbers.
    pub fn of_records(records: Vec<usize>, tubes: Vec<Vec<TubeRecord>>, relative_errors: Vec<f64>) -> Self {
        let sum = |lights: &Vec<TubeRecord>| {
            let add = |sum: TubeRecord, of: &TubeRecord| TubeRecord {
                lumens: sum.lumens + of.lumens,
                beam_lumens: sum.beam_lumens + of.beam_lumens,
                moment: sum.moment + of.moment,
            };
            lights.iter().fold(TubeRecord::default(), add)
        };
        let mut alike: Vec<Vec<usize>> = Vec::new();
        for (number, lights) in tubes.iter().enumerate() {
            match alike.iter_mut().find(|group| tubes[group[0]] == *lights) {
                Some(group) => group.push(number),
                None => alike.push(vec![number]),
            }
        }
        Self { sums: tubes.iter().map(sum).collect(), alike, records, tubes, relative_errors }
    }

    /// Adds up the moments of each record.
    pub fn new(lit: &[LitMoment], tubes: &[TubeYear]) -> Self {
        let mut records: Vec<usize> = lit.iter().map(|moment| moment.record).collect();
        records.dedup();
        let of_tube = |year: &TubeYear| {
            let mut of_records: Vec<TubeRecord> = Vec::with_capacity(records.len());
            let mut last = None;
            for (moment, light) in lit.iter().zip(&year.moments) {
                if last != Some(moment.record) {
                    of_records.push(TubeRecord::default());
                    last = Some(moment.record);
                }
                if let Some(of_record) = of_records.last_mut() {
                    of_record.add(light, moment.share);
                }
            }
            of_records
        };
        let relative_errors = tubes.iter().map(|year| year.relative_error).collect();
        let tubes = tubes.iter().map(of_tube).collect();
        Self::of_records(records, tubes, relative_errors)
    }
}

impl TubeRecord {
    fn add(&mut self, light: &TubeLight, share: f64) {
        self.lumens += share * light.lumens();
        self.beam_lumens += share * light.sun_lm;
        self.moment += light.sky_centroid_m * (share * light.sky_lm) + light.sun_centroid_m * (share * light.sun_lm);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks a sensor below two tubes, one of them lit by the sun off its centre, by hand; its errors are independent.
    #[test]
    fn light_and_errors_of_two_tubes() {
        let response = |lux_per_lumen: f64, gradient: DVec2, standard_error: f64| {
            vec![Response { lux_per_lumen, gradient, left_out: 0.0, standard_error }]
        };
        let tubes = vec![response(0.1, DVec2::new(0.2, -0.1), 0.003), response(0.2, DVec2::ZERO, 0.004)];
        let responses = Responses::new(tubes, vec![0.005], None);
        let lights = |lumens: f64, moment: DVec2| vec![TubeRecord { lumens, beam_lumens: 0.5 * lumens, moment }];
        let tubes = vec![lights(1000.0, DVec2::new(50.0, 0.0)), lights(1000.0, DVec2::ZERO)];
        let light = RecordLight::of_records(vec![12], tubes, vec![0.0, 0.0]);
        assert!((responses.illuminances_lux(0, &light)[0] - 310.0).abs() < 1e-9);
        assert!((responses.relative_error(0, &light) - 0.005 / 0.3).abs() < 1e-12);
        let by_tube = responses.mean_by_tube_lux(0, &light, 10);
        assert!((by_tube[0] - 11.0).abs() < 1e-12 && (by_tube[1] - 20.0).abs() < 1e-12);
        let mean = responses.mean(&[2.0]);
        assert_eq!((&mean.tubes, &mean.correlations), (&responses.tubes, &responses.correlations));
        // the mean of sensors that err apart errs less
        let two = responses.tubes.iter().map(|tube| vec![tube[0]; 2]).collect();
        let two = Responses::new(two, vec![0.005, 0.005], Some(0.003)).mean(&[1.0, 1.0]);
        assert!((two.relative_error(0, &light) - 0.003 / 0.3).abs() < 1e-12);
        // patterns of beams count with half of the light
        let mut patterned = responses.clone();
        patterned.tubes[1][0].left_out = 0.02;
        let expected = (0.005f64 / 0.3).hypot(PATTERN * 0.02 * 500.0 / 300.0);
        assert!((patterned.relative_error(0, &light) - expected).abs() < 1e-12);
        // tubes that are alike count together
        let alike = vec![lights(1000.0, DVec2::new(50.0, 0.0)), lights(1000.0, DVec2::new(50.0, 0.0))];
        let light = RecordLight::of_records(vec![12], alike, vec![0.0, 0.0]);
        assert_eq!(light.alike, [vec![0, 1]]);
        assert!((responses.illuminances_lux(0, &light)[0] - 310.0).abs() < 1e-9);
    }
}
