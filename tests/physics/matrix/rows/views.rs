//! What eyes see in furnished rooms.

use glam::DVec3;
use skyduct::optics::{DiffuserZone, Surface};
use skyduct::scene::EstimateKind::Point;
use skyduct::scene::{Face, Scene, Tube, View};

use super::super::row::{Mirrors, Row};
use super::furnished::{mirror_wall, sunny, with_face};
use crate::scenes::{SIDE, bent, clear, furnished, lambertian, mixed, peaked, specular, straight};

const LOW: DVec3 = DVec3::new(0.3, 0.2, 0.9);
const ASIDE: DVec3 = DVec3::new(1.8, 0.2, 0.9);

fn looking(mut scene: Scene, eye: DVec3, target: DVec3) -> Row {
    scene.grids = Vec::new();
    scene.views = vec![View::new("view".into(), eye, target, DVec3::Z, 1.2, [40, 32]).unwrap()];
    // few paths matter that a mirror sends to a source
    Row::new(scene).stored(&["path_tracing", "photon_mapping"]).mirrors(Mirrors::Paths(1.0))
}

fn room(tubes: [Tube; 2]) -> Scene {
    furnished(tubes, Point)
}

fn matt() -> Tube {
    straight(1.0, 0.95, lambertian(0.5, 0.4))
}

pub fn into_the_room() -> Row {
    // fixed rays may miss what is smaller than a pixel, without an error that says so
    let mut scene = room([matt(), matt()]);
    scene.room.luminaires.clear();
    looking(scene, LOW, DVec3::new(1.9, 1.5, 1.2))
}

/// Up to a table of a diffuser in the sun.
pub fn up_in_the_sun() -> Row {
    let row = looking(sunny(room([matt(), bent(peaked())])), ASIDE, DVec3::new(0.9, 1.0, 1.9));
    // fixed rays miss patterns of the sun that are smaller than a pixel
    row.left_out(&["ppm", "ppm_per_point"])
}

pub fn up_matt_in_the_sun() -> Row {
    looking(sunny(room([matt(), bent(lambertian(0.5, 0.4))])), ASIDE, DVec3::new(0.9, 1.0, 1.9))
}

/// A sun patch, and the beam in a glossy wall.
pub fn sun_patch() -> Row {
    let tubes = [bent(lambertian(0.5, 0.4)), straight(0.5, 0.95, clear())];
    looking(sunny(room(tubes)), LOW, DVec3::new(1.9, 1.5, 1.2))
        .stored(&["bidirectional_path_tracing", "photon_mapping"])
}

pub fn up_the_pipe() -> Row {
    looking(room([matt(), straight(0.5, 0.95, clear())]), DVec3::new(1.3, 1.1, 1.2), DVec3::new(1.5, 1.3, SIDE))
}

pub fn up_a_bent_pipe() -> Row {
    looking(room([matt(), bent(clear())]), DVec3::new(1.3, 1.1, 1.2), DVec3::new(1.5, 1.3, SIDE))
}

/// A mirror shows a diffuser.
pub fn mirror() -> Row {
    let scene = room([matt(), bent(lambertian(0.5, 0.4))]);
    looking(with_face(scene, Face::North, specular(0.1, 0.7, 0.0)), LOW, DVec3::new(1.0, 2.0, 1.4))
}

pub fn mirror_box() -> Row {
    let mut scene = room([bent(lambertian(0.5, 0.4)), straight(1.0, 0.95, peaked())]);
    scene.room.boxes[0].surface = specular(0.1, 0.8, 0.0);
    looking(scene, LOW, DVec3::new(1.9, 1.5, 1.2))
}

/// The sky through clear closures, and by a mirror.
pub fn sky_in_a_mirror() -> Row {
    let scene = room([bent(clear()), straight(0.5, 0.9, mixed(DiffuserZone::Lambertian))]);
    looking(mirror_wall(scene), ASIDE, DVec3::new(0.9, 1.9, 0.8)).work(2.0)
}

/// What photons alone find: the sun through a clear closure, and by a mirror.
pub fn sun_in_a_mirror() -> Row {
    let scene = sunny(mirror_wall(room([bent(clear()), straight(1.0, 0.95, clear())])));
    looking(scene, ASIDE, DVec3::new(0.9, 1.9, 0.6)).stored(&["photon_mapping", "sppm"])
}

/// A dark floor under a white box: what small pixels see has bright edges.
pub fn edges() -> Row {
    let scene = with_face(room([matt(), straight(1.0, 0.95, peaked())]), Face::Floor, Surface::diffuse([0.02; 3]));
    looking(scene, DVec3::new(1.0, 0.4, 1.9), DVec3::new(1.1, 1.0, 0.0))
}
