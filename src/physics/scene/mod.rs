//! The scene: the content of a job document, validated, in SI units, f64 and the room frame.
//!
//! Room frame: x = east, y = north and z = up of a room with rotation 0; the floor of a box spans (0, 0, 0)..(size.x, size.y, 0).
//! A rotated room keeps its frame; the sun and sky are turned instead.

pub mod camera;
pub mod enclosure;
pub mod luminaire;
pub mod mesh_object;
pub mod opening;
pub mod prism;
pub mod room;
pub mod sensors;
pub mod surface_patches;
pub mod tube;

use std::f64::consts::PI;
use std::sync::Arc;

use crate::sky::zenith::ZenithFormula;
use crate::sky::{Horizon, Surroundings};
use crate::sky::{Moments, Sky, Sun};

pub use camera::View;
pub use enclosure::{BoxShape, Enclosure, EnclosureError, EnclosureFace, Face, FaceKind};
pub use luminaire::Luminaire;
pub use mesh_object::{Instances, MeshObject};
pub use opening::OpeningShape;
pub use room::{BoxObject, Room};
pub use sensors::{EstimateKind, Grid, Responses, Sensor};
pub use tube::{MeshTube, OpeningPlane, Segment, StraightOrBent, Transition, Tube, TubeShape};

/// Everything that a job simulates.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Sky and sun; `None` with electric light alone.
    pub daylight: Option<Daylight>,
    /// Moments at which the grids are computed, too, each with its own sky and sun; `None` where none are requested.
    pub moments: Option<Arc<Moments>>,
    /// The room, with everything that stands or hangs in it.
    pub room: Room,
    /// Tubes above the room, in the document's order; results name them by their index.
    pub tubes: Vec<Tube>,
    /// Illuminance grids, in the document's order.
    pub grids: Vec<Grid>,
    /// Luminance images, in the document's order.
    pub views: Vec<View>,
    /// Number of channels: three where a coefficient of the document is given per channel, else one.
    pub channels: Channels,
}

/// Number of channels in which light is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channels {
    /// One photopic channel: every coefficient of the scene is one number.
    Photopic,
    /// Linear Rec.709 red, green and blue.
    Rgb,
}

impl Channels {
    /// Returns the number of channels, 1 or 3.
    pub fn count(self) -> usize {
        match self {
            Self::Photopic => 1,
            Self::Rgb => 3,
        }
    }
}

/// Sky and sun above the scene, in the room frame; both absent when the sun is at or below the horizon.
#[derive(Clone, Debug)]
pub struct Daylight {
    /// The open sky; `None` where it gives no light.
    pub sky: Option<Sky>,
    /// The sun; `None` where there is no beam, as under overcast skies.
    pub sun: Option<Sun>,
    /// Formula by which the absolute level of the sky was found.
    pub formula: ZenithFormula,
}

impl Daylight {
    /// Returns the unobstructed horizontal illuminance in lux from the sky and from the sun.
    pub fn horizontal_illuminance_lux(&self) -> (f64, f64) {
        (
            self.sky.as_ref().map_or(0.0, Sky::horizontal_illuminance_lux),
            self.sun.as_ref().map_or(0.0, Sun::horizontal_illuminance_lux),
        )
    }

    /// Returns surroundings under this daylight.
    ///
    /// Below the horizon the luminance is `luminance_ratio` times that of a uniform sky of the same horizontal illuminance. The ground is
    /// Lambertian, of `ground_reflectance`, under the unobstructed horizontal illuminance.
    pub fn surroundings(
        &self,
        horizon: Option<Horizon>,
        [luminance_ratio, ground_reflectance]: [f64; 2],
        parallax: f64,
    ) -> Surroundings {
        let (of_sky, of_sun) = self.horizontal_illuminance_lux();
        Surroundings {
            horizon,
            luminance_ratio,
            ground_reflectance,
            luminance_cd_m2: luminance_ratio * of_sky / PI,
            ground_luminance_cd_m2: ground_reflectance * (of_sky + of_sun) / PI,
            parallax,
        }
    }

    /// Returns sky and sun as the upper end of a tube sees them. The whole disc of the sun is dimmed to the fraction of it that is above
    /// the horizon; no sun is left where that is 0.
    pub fn before(&self, tube: &Tube) -> (Option<Sky>, Option<Sun>) {
        let Some(surroundings) = &tube.surroundings else { return (self.sky.clone(), self.sun) };
        let sky = self.sky.as_ref().map(|sky| Sky { surroundings: Some(surroundings.clone()), ..sky.clone() });
        (sky, self.sun.and_then(|sun| surroundings.dimmed(sun)))
    }
}
