//! Fluxes of a tube under many skies, without a job.

use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use crate::document::result::{PatchesResult, SourceFlux, TubeFluxAt, TubeFluxResult};
use crate::document::tube_flux::ValidTubeFlux;
use crate::document::{DocumentErrors, FieldError, FieldErrorCode, MeshSource, to_scene};
use crate::integrator::lamp::flux::{NoFlux, patched_flux, patches};
use crate::plan::{Effects, compile};
use crate::sampling::Key;
use crate::scene::Daylight;
use crate::sky::{Sky, Sun};
use crate::traceable::TubeError;

/// Numbers of the sources among the keys of a request's seed.
const OF_SKY: u64 = 0;
const OF_SUN: u64 = 1;

/// Reason why there are no fluxes.
#[derive(Debug, thiserror::Error)]
pub enum TubeFluxError {
    /// The request is not valid, or nobody waits for its answer any more.
    #[error(transparent)]
    Request(#[from] DocumentErrors),
    /// It would be done in the time that a request has, but not in what is left of it.
    #[error("there is no time for it now")]
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
            NoFlux::Cancelled => FieldError::new("", "nobody waits for these fluxes any more").into(),
            NoFlux::NotFinite { pass, photon } => Self::NotFinite { pass, photon },
        }
    }
}

/// Time that a request has.
#[derive(Clone, Copy, Debug)]
pub struct TimeThereIs {
    /// End of what is left of it.
    pub until: Instant,
    /// All of it, where nobody else is served before.
    pub at_best: Duration,
}

/// Share of the time after which is judged whether the rest fits into it, by what was done until then, and share until which that must
/// be twice too much: what is done last may be cheaper than what was done first.
const JUDGED_AFTER: f64 = 0.05;
const DOUBTED_UNTIL: f64 = 0.25;

/// The fluxes that were asked for. Sky and sun use the same random numbers at all times, so that curves are smooth.
///
/// With `time`, a request that cannot be done in it is refused early, with how long it would take.
pub fn tube_flux(
    request: &ValidTubeFlux,
    meshes: &dyn MeshSource,
    time: Option<TimeThereIs>,
    cancel: &AtomicBool,
) -> Result<TubeFluxResult, TubeFluxError> {
    let Some(first) = request.pairs.first() else { return Err(FieldError::missing("/skies").into()) };
    let begun = Instant::now();
    let first_scene = to_scene(&first.job, meshes)?;
    let effects = Effects::of(&first_scene.0, &first.job.effect_requests());
    let in_parts = |error: TubeError| FieldError::new("/tube/parts", error.error.to_string());
    let mut traceable = compile(&first_scene.0, &effects).map_err(in_parts)?;
    let (centres, area_m2) = patches(traceable.tubes.first().map_or(0.0, |tube| tube.opening_radius));
    let (mut fluxes, mut lights) = (Vec::with_capacity(request.pairs.len()), Vec::new());
    let mut first_scene = Some(first_scene);
    for (number, pair) in request.pairs.iter().enumerate() {
        // the first has the tube, whose mesh is loaded once
        let (scene, warnings, provenance) = first_scene.take().map_or_else(|| to_scene(&pair.job, meshes), Ok)?;
        let (sky, sun) = scene.daylight.as_ref().map_or((None, None), |light| (light.sky.clone(), light.sun));
        let outside = scene.daylight.as_ref().map_or((0.0, 0.0), Daylight::horizontal_illuminance_lux);
        if sky.is_some() || sun.is_some() {
            lights.push((number, sky, sun));
        }
        fluxes.push(TubeFluxAt {
            sky: pair.sky,
            time: pair.time,
            sun_altitude_deg: provenance.sun.map(|sun| sun.altitude_deg),
            sun_azimuth_deg: provenance.sun.map(|sun| sun.azimuth_deg),
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
        (traceable.sky, traceable.sun) = (sky, sun);
        let key = Key::new(request.seed).child(source);
        let flux = patched_flux(&traceable, key, request.relative_error, cancel)?;
        Ok(Some(SourceFlux::from(&flux)))
    };
    let lit = lights.len();
    let set_up = begun.elapsed();
    // what was done stands for what is left
    for (done, at) in spread(lit).enumerate() {
        if let Some(time) = time.filter(|_| done > 0) {
            let has = time.until.saturating_duration_since(begun);
            check_time(has, time.at_best, set_up, begun.elapsed(), done, lit)?;
        }
        let (number, sky, sun) = &lights[at];
        fluxes[*number].of_sky = flux(sky.clone(), None, OF_SKY)?;
        fluxes[*number].of_sun = flux(None, *sun, OF_SUN)?;
    }
    let centres_m = centres.into_iter().map(|centre| centre.to_array()).collect();
    Ok(TubeFluxResult { patches: PatchesResult { centres_m, area_m2 }, fluxes })
}

/// All numbers below `count`, far apart from each other one after the other: by steps of about the golden section.
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

/// Refuses what does not fit into the time that it `has`, by the time that `done` of `lit` pairs with light have taken.
fn check_time(
    has: Duration,
    at_best: Duration,
    set_up: Duration,
    elapsed: Duration,
    done: usize,
    lit: usize,
) -> Result<(), TubeFluxError> {
    let whole = set_up + (elapsed - set_up).mul_f64(lit as f64 / done as f64);
    let is_too_much = |has: Duration| match elapsed {
        elapsed if elapsed < has.mul_f64(JUDGED_AFTER) => false,
        elapsed if elapsed < has.mul_f64(DOUBTED_UNTIL) => whole > has.mul_f64(2.0),
        _ => whole > has,
    };
    if !is_too_much(has) {
        return Ok(());
    }
    if !is_too_much(at_best) && whole <= at_best {
        return Err(TubeFluxError::NoTimeNow);
    }
    let fits = (lit as f64 * at_best.as_secs_f64() / whole.as_secs_f64()) as usize;
    let detail = format!(
        "the fluxes would take about {:.0} s, but a request may take {:.0} s here: ask for {} of these {lit} skies and times with light at once, \
         or for a larger relative_error",
        whole.as_secs_f64().ceil(),
        at_best.as_secs_f64(),
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
    fn what_does_not_fit_is_refused_with_what_does() {
        let second = Duration::from_secs(1);
        let check = |elapsed: u32, has: u32, done: usize| {
            check_time(has * second, 100 * second, Duration::ZERO, elapsed * second, done, 1000)
        };
        // too early to tell, as it should be, perhaps, and not
        assert!(check(4, 100, 1).is_ok());
        assert!(check(10, 100, 101).is_ok());
        assert!(check(10, 100, 60).is_ok());
        let Err(TubeFluxError::Request(DocumentErrors(errors))) = check(10, 100, 20) else { panic!("it takes 500 s") };
        assert!(errors[0].detail.contains("500 s") && errors[0].detail.contains("200 of"), "{}", errors[0].detail);
        assert!(matches!(check(30, 100, 299), Err(TubeFluxError::Request(_))));
        // others were served before
        assert!(matches!(check(10, 20, 200), Err(TubeFluxError::NoTimeNow)));
    }
}
