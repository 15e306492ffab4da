//! Conversion of a document's room to that of a scene.

use glam::DVec3;

use super::RoomDocument;
use super::object::ObjectDocument;
use super::surface::SurfaceDocument;
use crate::scene::{BoxObject, Enclosure, Face, Luminaire, Room};

/// Returns the room of a scene, without its meshes.
pub fn room(room: &RoomDocument) -> Room {
    let faces = &room.surfaces;
    let wall = |single: &Option<SurfaceDocument>| single.as_ref().unwrap_or(&faces.walls).surface();
    let surfaces = Face::ALL.map(|face| match face {
        Face::West => wall(&faces.wall_west),
        Face::East => wall(&faces.wall_east),
        Face::South => wall(&faces.wall_south),
        Face::North => wall(&faces.wall_north),
        Face::Floor => faces.floor.surface(),
        Face::Ceiling => faces.ceiling.surface(),
    });
    let boxes = room.objects.iter().filter_map(|object| match object {
        ObjectDocument::Box(object) => Some(BoxObject {
            size: DVec3::from(object.size_m),
            base: DVec3::from(object.position_m),
            rotation: object.rotation_deg.to_radians(),
            surface: object.surface.surface()?,
        }),
        ObjectDocument::Mesh(_) => None,
    });
    let luminaires = room.luminaires.iter().map(|luminaire| Luminaire {
        corner: DVec3::from(luminaire.corner_m),
        edge_u: DVec3::from(luminaire.edge_u_m),
        edge_v: DVec3::from(luminaire.edge_v_m),
        luminance: luminaire.luminance_cd_m2.rgb(),
    });
    Room {
        enclosure: Enclosure::cuboid(DVec3::from(room.size_m), surfaces),
        boxes: boxes.collect(),
        meshes: Vec::new(),
        luminaires: luminaires.collect(),
    }
}
