//! Fluxes of a tube under many skies, without a job.

use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use crate::document::result::{PatchesResult, SourceFlux, TubeFluxAt, TubeFluxResult};
use crate::document::tube_flux::ValidTubeFlux;
use crate::document::{DocumentErrors, FieldError, FieldErrorCode, FileSource, to_scene};
use crate::integrator::diffuser_source::flux::{NoFlux, patched_flux, patches};
use crate::plan::{Effects, compile};
use crate::sampling::Key;
use crate::scene::{Daylight, OpeningShape};
use crate::sky::{Sky, Sun};
use crate::statistics::Moments;
use crate::traceable::TubeError;

/// Numbers of sky and sun among the keys of a request's seed.
const OF_SKY: u64 = 0;
const OF_SUN: u64 = 1;

/// Reason why there are no fluxes.
#[derive(Debug, thiserror::Error)]
pub enum TubeFluxError {
    /// The request is not valid, or its client no longer waits for the answer.
    #[error(transparent)]
    Request(#[from] DocumentErrors),
    /// The request could be done in the time that a request has, but not in what is left of it.
    #[error("there is not enough time left for this request")]
    NoTimeNow,
    /// A flux became infinite or no number: a fault of the program.
    #[error("pass {pass}, photon {photon}: a flux is not finite")]
    NotFinite {
        /// Number of the pass, from 0.
        pass: u64,
        /// Number of the photon in it, from 0.
        photon: u64,
    },
}

impl From<FieldError> for TubeFluxError {
    fn from(error: FieldError) -> Self {
        Self::Request(error.into())
    }
}

impl From<NoFlux> for TubeFluxError {
    fn from(reason: NoFlux) -> Self {
        match reason {
            NoFlux::Cancelled => FieldError::new("", "cancelled: the client no longer waits for these fluxes").into(),
            NoFlux::NotFinite { pass, photon } => Self::NotFinite { pass, photon },
        }
    }
}

/// Time limit of a request.
#[derive(Clone, Copy, Debug)]
pub struct TimeThereIs {
    /// End of the time that is left.
    pub until: Instant,
    /// Time that a request has if no other one is served before it.
    pub at_best: Duration,
}

/// Number of pairs after which the rest is judged by the time that they took, and number of standard errors by which that estimate is
/// lowered to allow for doubt.
const JUDGED_AFTER: usize = 8;
const DOUBT: f64 = 3.0;

/// Fraction of the time after which fewer pairs are judged by, without an allowance for doubt.
const LATE: f64 = 0.25;

/// Computes the requested fluxes. Sky and sun use the same random numbers at all times, so that curves are smooth.
///
/// With `time`, a request that cannot be done in it is refused as soon as that is certain, with the time that it would take.
pub fn tube_flux(
    request: &ValidTubeFlux,
    meshes: &dyn FileSource,
    time: Option<TimeThereIs>,
    cancel: &AtomicBool,
) -> Result<TubeFluxResult, TubeFluxError> {
    let Some(first) = request.pairs.first() else { return Err(FieldError::missing("/skies").into()) };
    let begun = Instant::now();
    let first_scene = to_scene(&first.job, meshes)?;
    let effects = Effects::of(&first_scene.0, &first.job.effect_requests());
    let in_parts = |error: TubeError| FieldError::new("/tube/parts", error.error.to_string());
    let mut traceable = compile(&first_scene.0, &effects).map_err(in_parts)?;
    let opening = traceable.tubes.first().map_or(OpeningShape::Disc { radius: 0.0 }, |tube| tube.opening);
    let (centres, area_m2) = patches(&opening);
    let (mut fluxes, mut lights) = (Vec::with_capacity(request.pairs.len()), Vec::new());
    let mut first_scene = Some(first_scene);
    for (number, pair) in request.pairs.iter().enumerate() {
        // the first has the tube, whose mesh is loaded once
        let (scene, warnings, provenance) = first_scene.take().map_or_else(|| to_scene(&pair.job, meshes), Ok)?;
        let before = |daylight: &Daylight| scene.tubes.first().map(|tube| daylight.before(tube));
        let (sky, sun) = scene.daylight.as_ref().and_then(before).unwrap_or_default();
        let outside = scene.daylight.as_ref().map_or((0.0, 0.0), Daylight::horizontal_illuminance_lux);
        if sky.is_some() || sun.is_some() {
            lights.push((number, sky, sun));
        }
        fluxes.push(TubeFluxAt {
            sky: pair.sky,
            time: pair.time,
            sun_altitude_deg: provenance.sun.and_then(|sun| sun.altitude_deg),
            sun_azimuth_deg: provenance.sun.and_then(|sun| sun.azimuth_deg),
            sky_horizontal_illuminance_lux: outside.0,
            sun_horizontal_illuminance_lux: outside.1,
            of_sky: None,
            of_sun: None,
            warnings,
        });
    }
    let mut flux = |sky: Option<Sky>, sun: Option<Sun>, source: u64| {
        if sky.is_none() && sun.is_none() {
            return Ok::<_, TubeFluxError>(None);
        }
        traceable.set_daylight(sky, sun);
        let key = Key::new(request.seed).child(source);
        let flux = patched_flux(&traceable, key, request.relative_error, cancel)?;
        Ok(Some(SourceFlux::from(&flux)))
    };
    let lit = lights.len();
    let mut seconds = Moments::default();
    for at in spread(lit) {
        let pair_begun = Instant::now();
        let (number, sky, sun) = &lights[at];
        fluxes[*number].of_sky = flux(sky.clone(), None, OF_SKY)?;
        fluxes[*number].of_sun = flux(None, *sun, OF_SUN)?;
        seconds.push(pair_begun.elapsed().as_secs_f64());
        if let Some(time) = time {
            check_time(&time, begun, Instant::now(), &seconds, lit)?;
        }
    }
    let centres_m = centres.into_iter().map(|centre| centre.to_array()).collect();
    Ok(TubeFluxResult { patches: PatchesResult { centres_m, area_m2 }, fluxes })
}

/// Returns all numbers below `count`, in an order in which successive ones are far apart: by steps of about the golden section.
fn spread(count: usize) -> impl Iterator<Item = usize> {
    let divisor = |mut a: usize, mut b: usize| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let golden = (0.618 * count as f64) as usize;
    let step = (golden..).find(|step| divisor(*step, count.max(1)) == 1).unwrap_or(1);
    (0..count).map(move |number| number * step % count)
}

/// Refuses a request that cannot be done in its time, as judged at `now` by the `seconds` that some of the `lit` pairs with light have
/// taken: they stand for the others.
fn check_time(
    time: &TimeThereIs,
    begun: Instant,
    now: Instant,
    seconds: &Moments,
    lit: usize,
) -> Result<(), TubeFluxError> {
    let done = seconds.count as usize;
    let left = (lit - done) as f64;
    let until = time.until.saturating_duration_since(now).as_secs_f64();
    let elapsed = (now - begun).as_secs_f64();
    let doubt = match done {
        JUDGED_AFTER.. => DOUBT * seconds.standard_error(),
        _ if elapsed > LATE * (elapsed + until) => 0.0,
        _ => return Ok(()),
    };
    if left * (seconds.mean - doubt) <= until {
        return Ok(());
    }
    let (whole, at_best) = (elapsed + left * seconds.mean, time.at_best.as_secs_f64());
    if whole <= at_best {
        return Err(TubeFluxError::NoTimeNow);
    }
    let fits = (lit as f64 * at_best / whole) as usize;
    let detail = format!(
        "the fluxes would take about {:.0} s, but a request may take {at_best:.0} s: request {} of these {lit} skies \
         and times with light at once, or a larger relative_error",
        whole.ceil(),
        fits.clamp(1, lit),
    );
    Err(FieldError::new("/times", detail).coded(FieldErrorCode::TooMany).into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_are_computed_and_neighbours_are_far_apart() {
        for count in 0..200 {
            let mut numbers: Vec<usize> = spread(count).collect();
            let far = numbers.windows(2).all(|pair| count < 8 || pair[0].abs_diff(pair[1]) > count / 8);
            numbers.sort_unstable();
            assert!(numbers.into_iter().eq(0..count) && far, "{count}");
        }
    }

    #[test]
    fn a_request_that_does_not_fit_is_refused_with_how_much_does() {
        let begun = Instant::now();
        // so many pairs of 1000 have taken a tenth of a second each, or with some spread, of the seconds that there are
        let check = |done: usize, spread: f64, has: u64, at_best: u64| {
            let mut seconds = Moments::default();
            (0..done).for_each(|number| seconds.push(if number % 2 == 0 { 0.1 - spread } else { 0.1 + spread }));
            let after = |seconds| begun + Duration::from_secs(seconds);
            let time = TimeThereIs { until: after(has), at_best: Duration::from_secs(at_best) };
            check_time(&time, begun, begun + Duration::from_secs_f64(0.1 * done as f64), &seconds, 1000)
        };
        // few pairs that have taken long
        assert!(matches!(check(2, 0.0, 0, 50), Err(TubeFluxError::Request(_))));
        // too early to tell, as it should be, in doubt, and not
        assert!(check(7, 0.0, 50, 50).is_ok());
        assert!(check(8, 0.0, 101, 101).is_ok());
        assert!(check(100, 0.09, 80, 80).is_ok());
        let Err(TubeFluxError::Request(DocumentErrors(errors))) = check(8, 0.0, 50, 50) else {
            panic!("it takes 100 s")
        };
        assert!(errors[0].detail.contains("100 s") && errors[0].detail.contains("500 of"), "{}", errors[0].detail);
        assert!(matches!(check(900, 0.09, 80, 80), Err(TubeFluxError::Request(_))));
        // others were served before
        assert!(matches!(check(100, 0.0, 50, 200), Err(TubeFluxError::NoTimeNow)));
    }
}
