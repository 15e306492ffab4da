//! Fluxes of a tube under many skies, without a job.

use std::sync::atomic::AtomicBool;

use crate::document::result::{PatchesResult, SourceFlux, TubeFluxAt, TubeFluxResult};
use crate::document::tube_flux::ValidTubeFlux;
use crate::document::{DocumentErrors, FieldError, MeshSource, to_scene};
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

/// The fluxes that were asked for. Sky and sun use the same random numbers at all times, so that curves are smooth.
pub fn tube_flux(
    request: &ValidTubeFlux,
    meshes: &dyn MeshSource,
    cancel: &AtomicBool,
) -> Result<TubeFluxResult, TubeFluxError> {
    let Some(first) = request.pairs.first() else { return Err(FieldError::missing("/skies").into()) };
    let first_scene = to_scene(&first.job, meshes)?;
    let effects = Effects::of(&first_scene.0, &first.job.effect_requests());
    let in_parts = |error: TubeError| FieldError::new("/tube/parts", error.error.to_string());
    let mut traceable = compile(&first_scene.0, &effects).map_err(in_parts)?;
    let (centres, area_m2) = patches(traceable.tubes.first().map_or(0.0, |tube| tube.opening_radius));
    let mut flux = |sky: Option<Sky>, sun: Option<Sun>, source: u64| {
        if sky.is_none() && sun.is_none() {
            return Ok::<_, TubeFluxError>(None);
        }
        (traceable.sky, traceable.sun) = (sky, sun);
        let key = Key::new(request.seed).child(source);
        let flux = patched_flux(&traceable, key, request.relative_error, cancel)?;
        Ok(Some(SourceFlux::from(&flux)))
    };
    let mut fluxes = Vec::with_capacity(request.pairs.len());
    let mut first_scene = Some(first_scene);
    for pair in &request.pairs {
        // the first has the tube, whose mesh is loaded once
        let (scene, warnings, provenance) = first_scene.take().map_or_else(|| to_scene(&pair.job, meshes), Ok)?;
        let (sky, sun) = scene.daylight.as_ref().map_or((None, None), |light| (light.sky.clone(), light.sun));
        let outside = scene.daylight.as_ref().map_or((0.0, 0.0), Daylight::horizontal_illuminance_lux);
        fluxes.push(TubeFluxAt {
            sky: pair.sky,
            time: pair.time,
            sun_altitude_deg: provenance.sun.map(|sun| sun.altitude_deg),
            sun_azimuth_deg: provenance.sun.map(|sun| sun.azimuth_deg),
            sky_horizontal_illuminance_lux: outside.0,
            sun_horizontal_illuminance_lux: outside.1,
            of_sky: flux(sky, None, OF_SKY)?,
            of_sun: flux(None, sun, OF_SUN)?,
            warnings,
        });
    }
    let centres_m = centres.into_iter().map(|centre| centre.to_array()).collect();
    Ok(TubeFluxResult { patches: PatchesResult { centres_m, area_m2 }, fluxes })
}
