//! Transmission of straight tubes, computed within one request and without a job.

use std::f64::consts::FRAC_PI_4;

use axum::Json;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use crate::guide::transmittance::{beam_transmission, sky_exitance, zastrow_wittwer_transmission};
use crate::http::App;
use crate::http::limits::{off_thread, permit};
use crate::http::problem::{Problem, Query};
use crate::http::query_faults::QueryFaults;
use crate::sky::{CieType, Sky, SkyDistribution, direction};

/// Longest tube, in diameters.
const LONGEST: f64 = 100.0;

/// Largest number of altitudes in one request.
const MOST_ALTITUDES: usize = 1000;

/// Straight tube with an open top, and the light on it. Every field is text, so that a bad value is reported by name.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct TransmissionQuery {
    /// Length over diameter, 0..100; `length_m` and `diameter_m` may be given instead.
    #[param(value_type = Option<f64>, minimum = 0, maximum = 100, example = 4)]
    aspect_ratio: Option<String>,
    /// Length in metres.
    #[param(value_type = Option<f64>, minimum = 0)]
    length_m: Option<String>,
    /// Diameter in metres.
    #[param(value_type = Option<f64>, exclusive_minimum = 0)]
    diameter_m: Option<String>,
    /// Specular reflectance of the wall per bounce, 0..1; required.
    #[param(value_type = f64, required = true, minimum = 0, maximum = 1, example = 0.98)]
    reflectance: Option<String>,
    /// Altitudes of a beam above the horizon in degrees, 0..90; one, or several with commas between them.
    #[param(example = "30,60")]
    altitude_deg: Option<String>,
    /// Sky type (`sky.cie_type` of a document), 1..16, whose diffuse light enters the tube; requires `sun_altitude_deg`.
    #[param(value_type = Option<u8>, minimum = 1, maximum = 16)]
    cie_type: Option<String>,
    /// Altitude of the sun for the sky `cie_type` in degrees, above 0 and up to 90.
    #[param(value_type = Option<f64>, exclusive_minimum = 0, maximum = 90)]
    sun_altitude_deg: Option<String>,
}

/// Transmission of a straight mirror tube without collector and diffuser.
#[derive(Debug, Serialize, ToSchema)]
pub struct TubeTransmission {
    pub aspect_ratio: f64,
    pub reflectance: f64,
    /// Transmission of the light of a uniform sky.
    pub uniform_sky_transmission: f64,
    /// Transmissions of beams, one for each altitude.
    pub beams: Vec<BeamTransmission>,
    /// Transmission of the light of the requested sky; null unless a sky was requested.
    pub sky: Option<SkyTransmission>,
}

/// Transmission of parallel light that fills the tube's upper end.
#[derive(Debug, Serialize, ToSchema)]
pub struct BeamTransmission {
    pub altitude_deg: f64,
    /// Transmission after Swift and Smith (1995), summed exactly: absolute error below 1e-12.
    pub transmission: f64,
    /// Approximation R^N with the mean number of reflections N, after Zastrow and Wittwer: never above the exact transmission.
    pub zastrow_wittwer_transmission: f64,
    /// Mean number of reflections, (4 / pi) (length / diameter) tan(angle from the axis); null for a beam from the horizon.
    pub mean_reflections: Option<f64>,
}

/// Transmission of the diffuse light of a CIE sky: flux out of the tube over flux into it.
#[derive(Debug, Serialize, ToSchema)]
pub struct SkyTransmission {
    pub cie_type: u8,
    pub sun_altitude_deg: f64,
    pub transmission: f64,
}

/// Computes the transmission of a straight tube for beams and skies, in closed form.
#[utoipa::path(get, path = "/v1/tubes/transmission", operation_id = "get_tube_transmission", tag = "tubes",
    params(TransmissionQuery),
    responses(
        (status = 200, description = "The transmission", body = TubeTransmission),
        (status = 422, description = "An unknown parameter or an invalid value; see `errors`")))]
pub async fn transmission(app: App, Query(query): Query<TransmissionQuery>) -> Result<Json<TubeTransmission>, Problem> {
    let tube = Request::read(&query)?;
    // some ten milliseconds
    off_thread(permit(&app.permits.transmissions).await?, move |_| Json(tube.answer())).await
}

/// A query with every value in its bounds.
struct Request {
    aspect_ratio: f64,
    reflectance: f64,
    altitudes_deg: Vec<f64>,
    sky: Option<(CieType, f64)>,
}

impl Request {
    fn read(query: &TransmissionQuery) -> Result<Self, Problem> {
        let mut errors = QueryFaults::default();
        let aspect_ratio = match (&query.aspect_ratio, &query.length_m, &query.diameter_m) {
            (Some(text), None, None) => errors.number("aspect_ratio", text, 0.0, LONGEST),
            (None, Some(length), Some(diameter)) => {
                let length = errors.number("length_m", length, 0.0, f64::MAX);
                let diameter = errors.number("diameter_m", diameter, f64::MIN_POSITIVE, f64::MAX);
                let ratio = length.zip(diameter).map(|(length, diameter)| length / diameter);
                if ratio.is_some_and(|ratio| ratio > LONGEST) {
                    errors.refuse::<()>("length_m", format!("must be at most {LONGEST} diameters"));
                }
                ratio
            }
            _ => errors.refuse("aspect_ratio", "give either aspect_ratio, or length_m and diameter_m"),
        };
        let reflectance = match &query.reflectance {
            Some(text) => errors.number("reflectance", text, 0.0, 1.0),
            None => errors.refuse("reflectance", "required"),
        };
        let texts: Vec<&str> = query.altitude_deg.iter().flat_map(|text| text.split(',')).collect();
        if texts.len() > MOST_ALTITUDES {
            errors.refuse::<()>("altitude_deg", format!("must have at most {MOST_ALTITUDES} values"));
        }
        let altitudes_deg =
            texts.iter().filter_map(|text| errors.number("altitude_deg", text, 0.0, 90.0)).collect::<Vec<_>>();
        let sky = match (&query.cie_type, &query.sun_altitude_deg) {
            (None, None) => None,
            (Some(number), Some(altitude)) => {
                let cie_type = number.trim().parse().ok().and_then(CieType::new);
                let cie_type = cie_type.or_else(|| errors.refuse("cie_type", "must be a whole number within 1..16"));
                cie_type.zip(errors.number("sun_altitude_deg", altitude, f64::MIN_POSITIVE, 90.0))
            }
            (Some(_), None) => errors.refuse("sun_altitude_deg", "required with cie_type"),
            (None, Some(_)) => errors.refuse("cie_type", "required with sun_altitude_deg"),
        };
        match (aspect_ratio, reflectance, errors.found) {
            (Some(aspect_ratio), Some(reflectance), errors) if errors.is_empty() => {
                Ok(Self { aspect_ratio, reflectance, altitudes_deg, sky })
            }
            (.., errors) => Err(Problem::invalid_parameters(errors)),
        }
    }

    fn answer(&self) -> TubeTransmission {
        let Self { aspect_ratio, reflectance, .. } = *self;
        let of_sky = |cie_type: CieType, altitude_deg: f64| {
            let distribution = SkyDistribution::new(cie_type, direction(altitude_deg.to_radians(), 0.0));
            let sky = Sky::new(distribution, 1.0);
            if aspect_ratio == 0.0 {
                1.0
            } else {
                sky_exitance(&sky, aspect_ratio, reflectance) / sky.horizontal_illuminance_lux()
            }
        };
        let beam = |altitude_deg: &f64| {
            let altitude = altitude_deg.to_radians();
            let tangent = if *altitude_deg == 90.0 { 0.0 } else { libm::cos(altitude) / libm::sin(altitude) };
            let reflections = aspect_ratio * tangent / FRAC_PI_4;
            BeamTransmission {
                altitude_deg: *altitude_deg,
                transmission: beam_transmission(aspect_ratio, tangent, reflectance),
                zastrow_wittwer_transmission: if reflectance == 1.0 {
                    1.0
                } else {
                    zastrow_wittwer_transmission(aspect_ratio, tangent, reflectance)
                },
                mean_reflections: reflections.is_finite().then_some(reflections),
            }
        };
        let uniform = CieType::new(5).map_or(0.0, |uniform| of_sky(uniform, 45.0));
        TubeTransmission {
            aspect_ratio,
            reflectance,
            uniform_sky_transmission: uniform,
            beams: self.altitudes_deg.iter().map(beam).collect(),
            sky: self.sky.map(|(cie_type, sun_altitude_deg)| SkyTransmission {
                cie_type: cie_type.number(),
                sun_altitude_deg,
                transmission: of_sky(cie_type, sun_altitude_deg),
            }),
        }
    }
}
