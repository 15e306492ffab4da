//! Surroundings of a job document: horizon, obstructions and ground.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Deserializer, Serialize};
use utoipa::ToSchema;

use super::errors::Checks;
use super::horizon::{check_points, horizon};
use super::limits::{
    COORDINATE_M, HORIZON_AZIMUTH_DEG, OBSTRUCTION_SIZE_M, OBSTRUCTIONS, PVGIS_AZIMUTH_DEG, RATIO, TURN_DEG,
};
use super::read::tagged::{self, Reader, Tagged};
use super::room::object::footprint;
use super::schema::shapes::{HorizonPoint, ObstructionSize, Vector};
use crate::scene::Daylight;
use crate::sky::{Horizon, Obstruction, Surroundings};

/// Azimuth of south in degrees, which is 0 in the horizons of PVGIS.
const SOUTH_DEG: f64 = 180.0;

/// Horizon and obstructions around the building, which hide a part of the sky and the sun, and the ground.
///
/// Illuminances outdoors, to which daylight factors refer, stay unobstructed. Without `surroundings` the sky is open, and the ground is
/// black, unless a tube has a `horizon`: then the defaults of `surroundings` hold for all tubes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SurroundingsDocument {
    /// Horizon as `[azimuth_deg, altitude_deg]` of 1 to 361 points: azimuths within 0..360 that ascend, clockwise from north whatever the
    /// room's rotation, and altitudes within 0..90. It is linear between the points, all round. A tube can have its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Vec<HorizonPoint>>)]
    pub horizon: Option<Vec<[f64; 2]>>,
    /// Horizon as PVGIS gives it, in place of `horizon`: azimuths within -180..180 that ascend, clockwise from south.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Vec<HorizonPoint>>)]
    pub horizon_pvgis: Option<Vec<[f64; 2]>>,
    /// Luminance of what hides the sky, relative to the mean luminance of the unobstructed sky: that of a uniform sky of equal horizontal
    /// illuminance; default: 0.1.
    #[serde(default = "default_luminance_ratio")]
    #[schema(default = 0.1)]
    pub luminance_ratio: f64,
    /// Reflectance of the ground, which only tilted panes, leaning tubes, dielectric domes and meshes can see: it is Lambertian, under the
    /// unobstructed illuminance of sky and sun; default: 0.2.
    #[serde(default = "default_ground_reflectance")]
    #[schema(default = 0.2)]
    pub ground_reflectance: f64,
    /// Buildings and trees near by, at most 64, in front of the horizon: each becomes a part of the horizon of every tube, as the centre
    /// of its upper end sees it. Light comes neither through them nor from below them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub obstructions: Vec<ObstructionDocument>,
}

fn default_luminance_ratio() -> f64 {
    0.1
}

fn default_ground_reflectance() -> f64 {
    0.2
}

impl Default for SurroundingsDocument {
    fn default() -> Self {
        Self {
            horizon: None,
            horizon_pvgis: None,
            luminance_ratio: default_luminance_ratio(),
            ground_reflectance: default_ground_reflectance(),
            obstructions: Vec::new(),
        }
    }
}

/// An obstruction outdoors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ObstructionDocument {
    /// A box with vertical sides.
    Box(ObstructionBox),
}

/// Fields of a box outdoors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ObstructionBox {
    /// Extent in metres along the box's own x, y and z axes, each > 0.
    #[schema(value_type = ObstructionSize)]
    pub size_m: [f64; 3],
    /// Centre of the box's base in metres, in the room's frame.
    #[schema(value_type = Vector)]
    pub position_m: [f64; 3],
    /// Rotation in degrees, clockwise seen from above.
    #[serde(default)]
    #[schema(value_type = Option<f64>, default = 0.0)]
    pub rotation_deg: f64,
}

impl Tagged for ObstructionDocument {
    const TAG: &'static str = "kind";
    const WHAT: &'static str = "an obstruction";
    const KINDS: &'static [(&'static str, Reader<Self>)] = &[("box", |fields, of| fields.read(of).map(Self::Box))];
}

impl<'de> Deserialize<'de> for ObstructionDocument {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        tagged::deserialize(deserializer)
    }
}

impl ObstructionDocument {
    fn check(&self, pointer: &str, checks: &mut Checks) {
        let Self::Box(of_box) = self;
        checks.numbers(&format!("{pointer}/size_m"), &of_box.size_m, OBSTRUCTION_SIZE_M);
        checks.numbers(&format!("{pointer}/position_m"), &of_box.position_m, COORDINATE_M);
        checks.number(&format!("{pointer}/rotation_deg"), of_box.rotation_deg, TURN_DEG);
    }

    fn obstruction(&self) -> Obstruction {
        let Self::Box(of_box) = self;
        let [across, position] = [of_box.size_m, of_box.position_m].map(|of| DVec3::from(of).truncate());
        let corners = footprint(across, position, of_box.rotation_deg);
        Obstruction { corners, top_m: of_box.position_m[2] + of_box.size_m[2] }
    }
}

impl SurroundingsDocument {
    /// Adds faults for numbers out of their bounds, for two horizons, and for azimuths that do not ascend.
    pub(super) fn check(&self, checks: &mut Checks) {
        checks.number("/surroundings/luminance_ratio", self.luminance_ratio, RATIO);
        checks.number("/surroundings/ground_reflectance", self.ground_reflectance, RATIO);
        if self.horizon.is_some() && self.horizon_pvgis.is_some() {
            let detail = "must be left out if `horizon` is given: only one of them may give the horizon";
            checks.refuse("/surroundings/horizon_pvgis", detail);
        }
        for (name, points, azimuths) in
            [("horizon", &self.horizon, HORIZON_AZIMUTH_DEG), ("horizon_pvgis", &self.horizon_pvgis, PVGIS_AZIMUTH_DEG)]
        {
            if let Some(points) = points {
                check_points(&format!("/surroundings/{name}"), points, azimuths, checks);
            }
        }
        if checks.at_most("/surroundings/obstructions", self.obstructions.len(), &OBSTRUCTIONS, " obstructions") {
            for (index, obstruction) in self.obstructions.iter().enumerate() {
                obstruction.check(&format!("/surroundings/obstructions/{index}"), checks);
            }
        }
    }

    /// Returns the horizon without obstructions in the frame of a room whose +y axis has the azimuth `rotation_deg`; `None` if no part of
    /// it is above 0.
    fn common(&self, rotation_deg: f64) -> Option<Horizon> {
        match (&self.horizon, &self.horizon_pvgis) {
            (Some(points), _) => horizon(points, 0.0, rotation_deg),
            (None, Some(points)) => horizon(points, SOUTH_DEG, rotation_deg),
            (None, None) => None,
        }
    }

    /// Prepares the surroundings of tubes under a daylight, in the frame of a room whose +y axis has the azimuth `rotation_deg`.
    pub(crate) fn around<'a>(&'a self, daylight: &'a Daylight, rotation_deg: f64) -> Around<'a> {
        let obstructions = self.obstructions.iter().map(ObstructionDocument::obstruction).collect();
        let common = Arc::new(self.under(daylight, self.common(rotation_deg), 0.0));
        Around { document: self, daylight, rotation_deg, obstructions, common }
    }

    fn under(&self, daylight: &Daylight, horizon: Option<Horizon>, parallax: f64) -> Surroundings {
        daylight.surroundings(horizon, [self.luminance_ratio, self.ground_reflectance], parallax)
    }
}

/// Surroundings of a document under its daylight, which become those of each tube.
pub(crate) struct Around<'a> {
    document: &'a SurroundingsDocument,
    daylight: &'a Daylight,
    rotation_deg: f64,
    obstructions: Vec<Obstruction>,
    /// Surroundings of all tubes without a horizon of their own, before obstructions.
    pub common: Arc<Surroundings>,
}

impl Around<'_> {
    /// Returns the surroundings of the tube `number` with its own horizon, if it has one, whose upper end has a centre and a radius in m;
    /// `None` after an error.
    pub fn of(
        &self,
        number: usize,
        own: Option<&[[f64; 2]]>,
        (centre, radius): (DVec3, f64),
        checks: &mut Checks,
    ) -> Option<Arc<Surroundings>> {
        let of_own = own.map(|points| horizon(points, 0.0, self.rotation_deg));
        let above = || self.obstructions.iter().enumerate().filter(|(_, obstruction)| obstruction.top_m > centre.z);
        if of_own.is_none() && above().next().is_none() {
            return Some(self.common.clone());
        }
        let mut parallax = 0.0f64;
        for (index, obstruction) in above() {
            let distance = obstruction.distance_m(centre.truncate());
            if distance < radius {
                let detail = format!(
                    "must be at least {radius} m away from the centre of the upper end of /tubes/{number}, but is {distance} m away"
                );
                checks.refuse(format!("/surroundings/obstructions/{index}"), detail);
                return None;
            }
            parallax = parallax.max((2.0 * radius / distance).min(FRAC_PI_2));
        }
        let behind = of_own.as_ref().unwrap_or(&self.common.horizon).as_ref();
        let horizon = Horizon::with_obstructions(behind, &self.obstructions, centre);
        Some(Arc::new(self.document.under(self.daylight, horizon, parallax)))
    }
}
