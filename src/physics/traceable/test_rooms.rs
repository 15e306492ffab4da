//! Rooms for the tests of several files.

use glam::DVec3;

use super::{Follow, TraceableScene};
use crate::optics::Surface;
use crate::scene::{Channels, Enclosure, Room, Scene};

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
