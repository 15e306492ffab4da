//! Conversion of a document's room to that of a scene.

use glam::DVec3;

use super::RoomDocument;
use super::object::ObjectDocument;
use crate::scene::{BoxObject, Enclosure, Luminaire, Room};

/// Returns the room of a scene in its faces, without meshes.
pub fn room(room: &RoomDocument, enclosure: Enclosure) -> Room {
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
    Room { enclosure, boxes: boxes.collect(), meshes: Vec::new(), luminaires: luminaires.collect() }
}
