//! Scenes that must look like another scene, which is rendered by one method.

use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use skyduct::geometry::TriangleMesh;
use skyduct::optics::{Diffuser, MeasuredDiffuser, Surface};
use skyduct::scene::EstimateKind::{self, CellAverage, Point};
use skyduct::scene::{Face, Grid, MeshObject, Scene, Segment, Tube, TubeShape, View};

use super::super::row::{Mirrors, Row};
use super::documents::mesh_and_box;
use crate::scenes::{cube, daylight, electric_room, lambertian, mirrored, mirrored_panel, panel, straight};

const LIGHT: &[&str] = &["light_tracing"];

/// A mirror shows the other half of a symmetric room twice as long.
fn doubled(diffuser: Diffuser, estimate: EstimateKind) -> Row {
    let [mirror, image] = [false, true].map(|image| mirrored(diffuser.clone(), image, estimate));
    // what a mirror shows of a clear closure, and of all that points see, is left to photons
    let paths = matches!(diffuser, Diffuser::Lambertian { .. }) && estimate == CellAverage;
    let mirrors = if paths { Mirrors::Paths(16.0) } else { Mirrors::LeftOut };
    Row::new(mirror).same(image, LIGHT).mirrors(mirrors)
}

pub fn mirrored_lambertian_points() -> Row {
    doubled(lambertian(0.6, 0.3), Point)
}

pub fn mirrored_lambertian_cells() -> Row {
    doubled(lambertian(0.6, 0.3), CellAverage)
}

pub fn mirrored_clear_points() -> Row {
    doubled(crate::scenes::clear(), Point)
}

pub fn mirrored_clear_cells() -> Row {
    doubled(crate::scenes::clear(), CellAverage)
}

pub fn mirrored_panel_cells() -> Row {
    Row::new(mirrored_panel(false, CellAverage))
        .same(mirrored_panel(true, CellAverage), LIGHT)
        .mirrors(Mirrors::Paths(2.0))
}

/// An eye that looks into the mirror sees what it would see in the room of twice the length.
fn looked_into(scene: fn(bool) -> Scene, paths: f64) -> Row {
    let [mirror, image] = [false, true].map(|image| {
        let mut scene = scene(image);
        scene.grids = Vec::new();
        let (eye, target) = (DVec3::new(0.3, 0.4, 1.1), DVec3::new(2.0, 1.2, 1.2));
        scene.views = vec![View::new("view".into(), eye, target, DVec3::Z, 1.0, [24, 16]).unwrap()];
        scene
    });
    Row::new(mirror).same(image, &["path_tracing"]).mirrors(Mirrors::Paths(paths))
}

pub fn view_of_a_mirrored_tube() -> Row {
    looked_into(|image| mirrored(lambertian(0.6, 0.3), image, Point), 16.0)
}

pub fn view_of_a_mirrored_panel() -> Row {
    looked_into(|image| mirrored_panel(image, Point), 2.0)
}

/// The same block as 12 triangles and as a box.
fn mesh_block(height_m: f64, estimate: &str) -> Row {
    let [of_mesh, of_box] = mesh_and_box(height_m, estimate).map(|scene| Scene { views: Vec::new(), ..scene });
    Row::new(of_mesh).same(of_box, &["path_tracing"])
}

/// Some sensors lie below the block, in the dark.
pub fn mesh_block_on_the_floor() -> Row {
    mesh_block(0.0, "point")
}

pub fn view_of_a_mesh_block() -> Row {
    let [of_mesh, of_box] = mesh_and_box(0.0, "point").map(|scene| Scene { grids: Vec::new(), ..scene });
    Row::new(of_mesh).same(of_box, &["path_tracing"])
}

pub fn mesh_block_at_its_top() -> Row {
    mesh_block(0.5, "point")
}

pub fn mesh_block_at_its_top_cells() -> Row {
    mesh_block(0.5, "cell_average")
}

pub fn mesh_block_cut_by_cells() -> Row {
    mesh_block(0.2, "cell_average")
}

/// A rug over the whole floor is the floor.
pub fn rug_points() -> Row {
    let size = DVec3::new(3.0, 2.5, 2.2);
    let room = |floor: f64| {
        let mut scene =
            electric_room(size, 0.5, vec![panel(DVec3::new(1.5, 1.15, 2.1), 0.6, 0.5, 3000.0)], [4, 4], Point);
        scene.room.enclosure.paint(Face::Floor as usize, Some(Surface::diffuse([floor; 3])));
        scene.grids[0].height_m = 0.7;
        scene
    };
    let mut covered = room(0.1);
    let corners = [(0.0, 0.0), (size.x, 0.0), (size.x, size.y), (0.0, size.y)];
    let mesh = TriangleMesh {
        positions: corners.map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 3, 2]],
        triangle_materials: vec![0, 0],
        materials: vec!["rug".into()],
        ..TriangleMesh::default()
    };
    covered.room.meshes.push(MeshObject::new(mesh, vec![Surface::diffuse([0.8; 3])]));
    Row::new(covered).same(room(0.8), LIGHT)
}

/// BTDF and BRDF of Lambert's law as a table.
fn table(transmittance: f64, reflectance: f64) -> Diffuser {
    let ends = [0.0, FRAC_PI_2];
    let of = |share: f64| vec![vec![share / PI; 2]; 2];
    let brdf = of(reflectance);
    Diffuser::Measured(Arc::new(MeasuredDiffuser::new(&ends, &ends, &of(transmittance), Some(&brdf)).unwrap()))
}

/// A table of Lambert's law is a Lambertian diffuser, in a straight tube or below a bend, whose light from below comes back.
fn table_row(bend: f64, estimate: EstimateKind) -> Row {
    let scene = |diffuser: Diffuser| {
        let mut tube = straight(0.5, 0.95, diffuser);
        if bend > 0.0
            && let TubeShape::Cylinders(cylinders) = &mut tube.shape
        {
            cylinders.segments.push(Segment { length_m: 0.4, tilt: bend, azimuth: 0.3 });
        }
        let tube = Tube { centre: DVec2::new(0.8, 1.1), ..tube };
        let mut scene = cube(0.4, 0.5, 0.7, vec![tube], daylight(12, 5000.0, 50.0, 225.0), estimate);
        scene.grids = vec![Grid::new("grid".into(), 0.3, [5, 5], 0.0, [crate::scenes::SIDE; 2], estimate)];
        scene
    };
    Row::new(scene(table(0.5, 0.3))).same(scene(lambertian(0.5, 0.3)), LIGHT)
}

pub fn lambertian_table_points() -> Row {
    table_row(0.0, Point)
}

pub fn lambertian_table_below_a_bend_cells() -> Row {
    table_row(1.0, CellAverage)
}
