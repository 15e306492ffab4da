//! The room of a job document: its surfaces, objects and luminaires.

pub(super) mod check;
pub(super) mod convert;
pub mod luminaire;
pub mod mesh_object;
pub mod object;
pub(super) mod openings;
pub(super) mod sheets;
pub mod surface;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::document::limits::ROOM_EDGE_M;
use crate::document::optics::Coefficient;
use crate::document::schema::shapes::RoomSize;
use luminaire::LuminaireDocument;
use object::ObjectDocument;
use surface::SurfaceDocument;

/// A cuboid room; its floor spans (0, 0, 0) to (size_x, size_y, 0).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RoomDocument {
    /// Extent along x, y and z in metres, each 0.01..1000.
    #[schema(value_type = RoomSize)]
    pub size_m: [f64; 3],
    /// Azimuth of the room's +y axis in degrees, clockwise from north.
    #[serde(default)]
    pub rotation_deg: f64,
    /// Surfaces of the six faces.
    #[serde(default)]
    pub surfaces: SurfacesDocument,
    /// Objects in the room, at most 1000.
    #[serde(default)]
    pub objects: Vec<ObjectDocument>,
    /// Luminaires in the room, at most 256.
    #[serde(default)]
    pub luminaires: Vec<LuminaireDocument>,
}

/// Surfaces of the room's faces; one for a single wall takes precedence over `walls`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SurfacesDocument {
    /// Surface of the floor; default: reflectance 0.2.
    #[serde(default = "default_floor")]
    pub floor: SurfaceDocument,
    /// Surface of the walls; default: reflectance 0.5.
    #[serde(default = "default_walls")]
    pub walls: SurfaceDocument,
    /// Surface of the wall y = size_y; default: that of `walls`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wall_north: Option<SurfaceDocument>,
    /// Surface of the wall x = size_x; default: that of `walls`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wall_east: Option<SurfaceDocument>,
    /// Surface of the wall y = 0; default: that of `walls`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wall_south: Option<SurfaceDocument>,
    /// Surface of the wall x = 0; default: that of `walls`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wall_west: Option<SurfaceDocument>,
    /// Surface of the ceiling; default: reflectance 0.7.
    #[serde(default = "default_ceiling")]
    pub ceiling: SurfaceDocument,
}

fn default_floor() -> SurfaceDocument {
    SurfaceDocument::diffuse(0.2)
}

fn default_walls() -> SurfaceDocument {
    SurfaceDocument::diffuse(0.5)
}

fn default_ceiling() -> SurfaceDocument {
    SurfaceDocument::diffuse(0.7)
}

impl Default for SurfacesDocument {
    fn default() -> Self {
        Self {
            floor: default_floor(),
            walls: default_walls(),
            wall_north: None,
            wall_east: None,
            wall_south: None,
            wall_west: None,
            ceiling: default_ceiling(),
        }
    }
}

impl RoomDocument {
    /// Returns the room's size in metres; `None` if it is out of bounds, so that no other field can be checked against it.
    pub fn valid_size_m(&self) -> Option<[f64; 3]> {
        self.size_m.iter().all(|size| ROOM_EDGE_M.contains(*size)).then_some(self.size_m)
    }

    /// Returns all coefficients, which may be coloured, except those of `walls` where every wall has its own surface.
    pub fn coefficients(&self) -> impl Iterator<Item = Coefficient> {
        let faces = &self.surfaces;
        let single = [&faces.wall_north, &faces.wall_east, &faces.wall_south, &faces.wall_west];
        let walls = single.iter().any(|wall| wall.is_none()).then_some(&faces.walls);
        let of_room = [Some(&faces.floor), Some(&faces.ceiling), walls].into_iter();
        let of_room = of_room.chain(single.map(Option::as_ref)).flatten();
        let of_objects = self.objects.iter().flat_map(ObjectDocument::surfaces);
        let luminaires = self.luminaires.iter().map(|luminaire| luminaire.luminance_cd_m2);
        of_room.chain(of_objects).flat_map(SurfaceDocument::coefficients).chain(luminaires)
    }
}
