//! Rooms for the tests of several files.

use glam::{DVec2, DVec3};

use super::{Follow, TraceableScene};
use crate::optics::{Collector, Diffuser, Surface};
use crate::scene::{Channels, Enclosure, OpeningPlane, Room, Scene, Segment, StraightOrBent, Tube, TubeShape};

/// Returns an empty and dark room of `size` m, all faces of one surface; without one they are open.
pub fn empty(size: DVec3, surface: Option<Surface>) -> Scene {
    let enclosure = Enclosure::cuboid(size, [surface; 6]);
    Scene {
        daylight: None,
        moments: None,
        room: Room { enclosure, boxes: Vec::new(), meshes: Vec::new(), luminaires: Vec::new() },
        tubes: Vec::new(),
        grids: Vec::new(),
        views: Vec::new(),
        channels: Channels::Photopic,
    }
}

/// Compiles a scene for all of its light.
pub fn compiled(scene: &Scene) -> TraceableScene {
    let follow = Follow { interreflection: true, guide_return: true, objects: true };
    TraceableScene::new(scene, follow).unwrap()
}

/// Makes a straight tube of 1 m and 60 cm diameter in a face.
pub fn straight_tube((face, centre): (usize, DVec2), reflectance: [f64; 3], diffuser: Diffuser) -> Tube {
    Tube {
        face,
        plane: OpeningPlane::Level { drop_m: 0.0 },
        centre,
        opening_radius: 0.3,
        transition: None,
        shape: TubeShape::Cylinders(StraightOrBent {
            reflectance: reflectance.into(),
            segments: vec![Segment { length_m: 1.0, tilt: 0.0, azimuth: 0.0 }],
            collector: Collector::Open,
            cut: None,
        }),
        diffuser,
        surroundings: None,
    }
}
