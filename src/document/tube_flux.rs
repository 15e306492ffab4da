//! Request for the fluxes through a tube without a room, under a list of skies at a list of times.

use glam::DVec3;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use utoipa::ToSchema;

use super::errors::{Checks, DocumentErrors, FieldError, FieldErrorCode};
use super::limits::{PANE_TILT_DEG, RELATIVE_FLUX_ERROR, SKIES, SKIES_TIMES_TIMES, TIMES, TURN_DEG};
use super::read::shape;
use super::sky::{LocationDocument, SkyDocument};
use super::surroundings::SurroundingsDocument;
use super::tube::{OpeningNormal, TubeDocument};
use super::{JobDocument, ValidJob};
use crate::geometry::OpeningFrame;
use crate::sky::direction;

/// Largest number of errors that are reported.
const MOST_ERRORS: usize = 100;

/// Request for the flux that a tube delivers under each of several skies at each of several times.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct TubeFluxDocument {
    /// The tube, as in a job. `centre_m` may be absent, because its place in the ceiling has no effect.
    pub tube: TubeDocument,
    /// Direction of the face that the tube comes through: needed for a tube with `"normal": "face"`, and for no other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub face: Option<FaceDirectionDocument>,
    /// Ground and horizon, as in a job, but without `obstructions`: these have places in a room.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surroundings: Option<SurroundingsDocument>,
    /// Location on Earth, as in a job; given together with `times`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub location: Option<LocationDocument>,
    /// Skies as in a job, 1 to 100; the sun's position comes from `location` and `times`, or else from each sky's `sun_position`.
    pub skies: Vec<SkyDocument>,
    /// Times as in a job (RFC 3339 with an offset), at most 1000. Every sky is computed at every time, at most 5000 pairs. Absent
    /// or empty: every sky is computed once, with its own `sun_position`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub times: Vec<String>,
    /// Relative error of the flux into the room to be reached, at 95 % confidence, for the light of the sky and of the sun each.
    #[serde(default = "one_percent")]
    #[schema(default = 0.01)]
    pub relative_error: f64,
    /// Seed of the random numbers; equal documents with equal seeds give bitwise equal results.
    #[serde(default)]
    #[schema(maximum = 18_446_744_073_709_551_615u64)]
    pub seed: u64,
}

/// Direction in which the outer side of a roof or a wall looks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct FaceDirectionDocument {
    /// Tilt of the face from the horizontal in degrees, 0..90: the pitch of a roof, or 90 for a wall.
    pub tilt_deg: f64,
    /// Azimuth in degrees that the outer side of a tilted face looks toward, clockwise from north; default: 0.
    #[serde(default)]
    #[schema(default = 0.0)]
    pub azimuth_deg: f64,
}

impl FaceDirectionDocument {
    /// Returns the unit normal out of the room.
    fn outward(self) -> DVec3 {
        direction((90.0 - self.tilt_deg).to_radians(), self.azimuth_deg.to_radians())
    }
}

fn one_percent() -> f64 {
    0.01
}

/// A request that was read and checked, with a job for each pair of a sky and a time.
#[derive(Debug)]
pub struct ValidTubeFlux {
    /// Requested relative error at 95 % confidence.
    pub relative_error: f64,
    /// Seed of the random numbers.
    pub seed: u64,
    /// All pairs, in the order of skies and then of times. The job of the first has the requested tube; those of the others have
    /// a placeholder, and only their sky and sun are used.
    pub pairs: Vec<Pair>,
}

/// A sky at a time, as a job.
#[derive(Debug)]
pub struct Pair {
    /// Number of the sky in the request, from 0.
    pub sky: usize,
    /// Number of the time in the request, from 0; `None` if the sky gives the sun's position.
    pub time: Option<usize>,
    /// Job with an empty room below the sky at the time.
    pub job: ValidJob,
}

impl TubeFluxDocument {
    /// Checks a request that was read as JSON. Errors report every fault, with pointers into the request.
    pub fn from_value(mut value: Value) -> Result<ValidTubeFlux, DocumentErrors> {
        if let Some(tube) = value.get_mut("tube").and_then(Value::as_object_mut) {
            tube.entry("centre_m").or_insert(json!([0.0, 0.0]));
        }
        let mut checks = Checks::default();
        let Some((request, _)) = shape::read::<Self>(value.clone(), &mut checks) else {
            return Err(DocumentErrors(checks.errors));
        };
        request.check(&mut checks);
        if !checks.errors.is_empty() {
            return Err(DocumentErrors(checks.errors));
        }
        let pairs = request.pairs(&value)?;
        Ok(ValidTubeFlux { relative_error: request.relative_error, seed: request.seed, pairs })
    }

    fn check(&self, checks: &mut Checks) {
        let mut count = |field: &str, count: usize, range: &std::ops::RangeInclusive<usize>| {
            if !range.contains(&count) {
                let detail = format!("must have {} to {} entries, but has {count}", range.start(), range.end());
                let code = if count > *range.end() { FieldErrorCode::TooMany } else { FieldErrorCode::Invalid };
                checks.refuse_as(code, field, detail);
            }
        };
        count("/skies", self.skies.len(), &SKIES);
        count("/times", self.times.len(), &TIMES);
        self.check_face(checks);
        if self.surroundings.as_ref().is_some_and(|around| !around.obstructions.is_empty()) {
            let detail = "must be left out: obstructions have places in a room, which there is not; a `horizon` can \
                          stand for them";
            checks.refuse("/surroundings/obstructions", detail);
        }
        let pairs = self.skies.len().saturating_mul(self.times.len());
        if pairs > SKIES_TIMES_TIMES {
            let detail =
                format!("the number of skies times the number of times must be <= {SKIES_TIMES_TIMES}, but is {pairs}");
            checks.refuse_as(FieldErrorCode::TooMany, "/times", detail);
        }
        if !RELATIVE_FLUX_ERROR.contains(self.relative_error) {
            let detail = format!("must be {RELATIVE_FLUX_ERROR}, but is {}", self.relative_error);
            checks.refuse_as(FieldErrorCode::OutOfRange, "/relative_error", detail);
        }
    }

    /// Checks that the direction of the face is given where the opening lies in it, and only there.
    fn check_face(&self, checks: &mut Checks) {
        match (self.tube.normal(), self.face) {
            (OpeningNormal::Plumb, None) => {}
            (OpeningNormal::Plumb, Some(_)) => {
                let detail = "must be left out: only a tube with `\"normal\": \"face\"` lies in the plane of a face";
                checks.refuse("/face", detail);
            }
            (OpeningNormal::Face, None) => {
                let detail = "required for a tube with `\"normal\": \"face\"`, as there is no room that has the face: give \
                              its `tilt_deg` from the horizontal, 90 for a wall, and the `azimuth_deg` that it looks toward";
                checks.refuse_as(FieldErrorCode::Missing, "/face", detail);
            }
            (OpeningNormal::Face, Some(face)) => {
                checks.number("/face/tilt_deg", face.tilt_deg, PANE_TILT_DEG);
                checks.number("/face/azimuth_deg", face.azimuth_deg, TURN_DEG);
            }
        }
    }

    fn pairs(&self, value: &Value) -> Result<Vec<Pair>, DocumentErrors> {
        let times: Vec<Option<usize>> = match self.times.len() {
            0 => vec![None],
            count => (0..count).map(Some).collect(),
        };
        let (mut pairs, mut errors): (_, Vec<FieldError>) = (Vec::new(), Vec::new());
        for sky in 0..self.skies.len() {
            for time in &times {
                let is_first = pairs.is_empty() && errors.is_empty();
                let tube = if is_first { PlacedTube::of(self, value) } else { PlacedTube::stand_in(self, value) };
                match JobDocument::from_value(job(value, tube, sky, *time)) {
                    Ok(job) => pairs.push(Pair { sky, time: *time, job }),
                    Err(DocumentErrors(found)) => {
                        let found = found.into_iter().map(|error| in_request(error, sky, *time));
                        for error in found.filter(|error| !error.pointer.starts_with("/room")) {
                            if !errors.contains(&error) {
                                errors.push(error);
                            }
                        }
                    }
                }
                if errors.len() >= MOST_ERRORS {
                    return Err(DocumentErrors(errors));
                }
            }
        }
        if errors.is_empty() { Ok(pairs) } else { Err(DocumentErrors(errors)) }
    }
}

/// A tube in an empty room that it fits into, as parts of a job's document.
struct PlacedTube {
    room: Value,
    tube: Value,
    /// Point inside the room, which a sensor can have.
    inside: DVec3,
}

impl PlacedTube {
    /// Places the tube of a request.
    fn of(request: &TubeFluxDocument, value: &Value) -> Self {
        let mut tube = value["tube"].clone();
        // a room that any valid tube fits into
        let edge = (2.0 * request.tube.opening().width_m).clamp(0.1, 200.0);
        if let Some(fields) = tube.as_object_mut() {
            // the place in a room has no effect
            fields.remove("face");
            if request.face.is_none() {
                fields.remove("drop_m");
            }
        }
        match request.face {
            Some(face) => Self::in_face(tube, edge, face.outward()),
            None => Self::in_ceiling(tube, edge),
        }
    }

    /// Places a plain tube that has the horizon of the requested one.
    fn stand_in(request: &TubeFluxDocument, value: &Value) -> Self {
        let mut tube = json!({
            "diameter_m": 0.3, "reflectance": 0.9, "segments": [{ "length_m": 1.0 }], "collector": { "kind": "open" },
            "diffuser": { "kind": "lambertian", "transmittance": 0.5 }
        });
        if request.tube.horizon().is_some() {
            tube["horizon"] = value["tube"]["horizon"].clone();
        }
        Self::in_ceiling(tube, 1.0)
    }

    /// Places a tube in the middle of the ceiling of a cube of `edge` m.
    fn in_ceiling(mut tube: Value, edge: f64) -> Self {
        tube["centre_m"] = json!([0.5 * edge, 0.5 * edge]);
        Self { room: json!({ "size_m": [edge, edge, edge] }), tube, inside: DVec3::splat(0.5 * edge) }
    }

    /// Places a tube in the middle of the face of a cube of `edge` m that looks toward `outward`.
    fn in_face(mut tube: Value, edge: f64, outward: DVec3) -> Self {
        let frame = OpeningFrame::facing_from(DVec3::ZERO, outward);
        let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| 0.5 * edge * frame.direction_in_room(axis));
        // the lowest corner comes to the floor's height
        let middle = DVec3::Z * axes.iter().map(|axis| axis.z.abs()).sum::<f64>();
        // in one order, so that faces share their corners to the bit
        let corner = |sides: [f64; 3]| {
            let [x, y, z] = [0, 1, 2].map(|axis| sides[axis] * axes[axis]);
            (middle + x + y + z).to_array()
        };
        let face = |number: usize| {
            let side = if number < 3 { 1.0 } else { -1.0 };
            // counter-clockwise seen from outside
            let corners = [[-1.0, -side], [1.0, -side], [1.0, side], [-1.0, side]].map(|[along, across]| {
                let mut sides = [side; 3];
                (sides[(number + 1) % 3], sides[(number + 2) % 3]) = (along, across);
                corner(sides)
            });
            let kind = ["wall", "wall", "ceiling", "wall", "wall", "floor"][number];
            json!({ "name": format!("face_{number}"), "kind": kind, "boundary_m": corners })
        };
        tube["face"] = json!("face_2");
        tube["centre_m"] = json!((middle + axes[2]).to_array());
        Self { room: json!({ "faces": (0..6).map(face).collect::<Vec<_>>() }), tube, inside: middle }
    }
}

/// Returns the document of a job: a tube in an empty room below one sky of the request.
fn job(request: &Value, PlacedTube { room, tube, inside }: PlacedTube, sky: usize, time: Option<usize>) -> Value {
    let mut job = Map::new();
    job.insert("room".into(), room);
    job.insert("tubes".into(), json!([tube]));
    let sensor = [inside.x, inside.y, inside.z, 0.0, 0.0, 1.0];
    job.insert("grids".into(), json!([{ "name": "inside", "points_m": [sensor] }]));
    job.insert("sky".into(), request["skies"][sky].clone());
    for field in ["location", "surroundings"] {
        if let Some(value) = request.get(field) {
            job.insert(field.into(), value.clone());
        }
    }
    if let Some(time) = time {
        job.insert("time".into(), request["times"][time].clone());
    }
    Value::Object(job)
}

/// Converts an error of a pair's job to one of the request, by its pointer.
fn in_request(error: FieldError, sky: usize, time: Option<usize>) -> FieldError {
    let pointer = match (error.pointer.as_str(), time) {
        ("/time", Some(time)) => format!("/times/{time}"),
        ("/time", None) => "/times".to_owned(),
        (pointer, _) => match (pointer.strip_prefix("/sky"), pointer.strip_prefix("/tubes/0")) {
            (Some(rest), _) => format!("/skies/{sky}{rest}"),
            (_, Some(rest)) => format!("/tube{rest}"),
            _ => pointer.to_owned(),
        },
    };
    // sentences about a job's field
    FieldError { pointer, detail: error.detail.replace("`time`", "`times`"), ..error }
}
