//! A furnished room under two tubes of all kinds: a box, a glossy wall, a luminaire that hangs in it.

use glam::{DVec2, DVec3};
use skyduct::geometry::TriangleMesh;
use skyduct::optics::{Collector, Diffuser, DiffuserZone, Specular, Surface};
use skyduct::scene::EstimateKind::{CellAverage, Point};
use skyduct::scene::{BoxObject, Channels, Face, Grid, MeshObject, Scene, Segment, StraightOrBent, Tube, TubeShape};

use super::super::row::{Mirrors, Row};
use crate::scenes::{
    SIDE, bent, clear, cube, daylight, domed, furnished, lambertian, mixed, peaked, specular, straight, with_sun,
};

const SUN: f64 = 60_000.0;

pub fn sunny(mut scene: Scene) -> Scene {
    with_sun(&mut scene, SUN, 50.0);
    scene
}

pub fn with_face(mut scene: Scene, face: Face, surface: Surface) -> Scene {
    scene.room.enclosure.paint(face as usize, Some(surface));
    scene
}

pub fn mirror_wall(scene: Scene) -> Scene {
    with_face(scene, Face::North, specular(0.2, 0.7, 0.0))
}

fn scattering() -> [Tube; 2] {
    [bent(lambertian(0.5, 0.4)), straight(1.0, 0.95, peaked())]
}

fn matt() -> [Tube; 2] {
    [bent(lambertian(0.5, 0.4)), straight(1.0, 0.95, lambertian(0.6, 0.2))]
}

fn both_clear() -> [Tube; 2] {
    [bent(clear()), straight(0.5, 0.9, Diffuser::Open)]
}

pub fn scattering_points() -> Row {
    Row::new(furnished(scattering(), Point))
}

pub fn scattering_sun_cells() -> Row {
    Row::new(sunny(furnished(scattering(), CellAverage)))
}

pub fn peaked_sun_points() -> Row {
    Row::new(sunny(furnished([bent(peaked()), bent(lambertian(0.3, 0.6))], Point)))
}

pub fn matt_points() -> Row {
    Row::new(furnished(matt(), Point))
}

pub fn matt_sun_cells() -> Row {
    Row::new(sunny(furnished(matt(), CellAverage)))
}

/// A dome that refracts sends light back down.
pub fn domed_sun_points() -> Row {
    Row::new(sunny(furnished([domed(lambertian(0.3, 0.6)), bent(lambertian(0.3, 0.6))], Point)))
}

/// What points see of the sun's disc through the closure is found backward.
pub fn clear_sun_points() -> Row {
    Row::new(sunny(furnished([bent(peaked()), straight(0.7, 0.95, clear())], Point)))
        .stored(&["light_tracing", "photon_mapping"])
        .work(2.0)
}

pub fn clear_sun_cells() -> Row {
    Row::new(sunny(furnished([bent(peaked()), straight(0.7, 0.95, clear())], CellAverage)))
        .stored(&["light_tracing", "photon_mapping"])
}

pub fn mixed_sun_cells() -> Row {
    let tubes = [bent(lambertian(0.3, 0.6)), straight(0.7, 0.95, mixed(DiffuserZone::Clear))];
    Row::new(sunny(furnished(tubes, CellAverage))).stored(&["light_tracing", "photon_mapping"])
}

pub fn bent_clear_points() -> Row {
    Row::new(furnished(both_clear(), Point)).stored(&["path_tracing", "bidirectional_path_tracing"])
}

pub fn bent_clear_cells() -> Row {
    Row::new(furnished(both_clear(), CellAverage))
}

pub fn bent_mixed_points() -> Row {
    Row::new(furnished([bent(mixed(DiffuserZone::Lambertian)), straight(0.5, 0.9, clear())], Point))
        .stored(&["path_tracing", "bidirectional_path_tracing"])
}

pub fn bent_mixed_cells() -> Row {
    Row::new(furnished([bent(mixed(DiffuserZone::Lambertian)), straight(0.5, 0.9, clear())], CellAverage))
}

pub fn mirror_cells() -> Row {
    let tubes = [bent(clear()), straight(0.5, 0.9, lambertian(0.5, 0.4))];
    Row::new(mirror_wall(furnished(tubes, CellAverage))).mirrors(Mirrors::Paths(4.0))
}

/// What a bent tube with a clear closure sends back, and what a wall and a box that are mirrors show of it.
pub fn mirrors_points() -> Row {
    let tubes = [bent(clear()), straight(0.5, 0.9, mixed(DiffuserZone::Lambertian))];
    let mut scene = mirror_wall(furnished(tubes, Point));
    scene.room.boxes[0].surface = specular(0.1, 0.8, 0.0);
    Row::new(scene).stored(&["path_tracing", "bidirectional_path_tracing"]).mirrors(Mirrors::LeftOut)
}

/// Mirrors that face each other, one that scatters as well, a box that is one, and a luminaire that hangs between.
fn between_mirrors(estimate: skyduct::scene::EstimateKind) -> Row {
    let mut scene = with_face(mirror_wall(furnished(matt(), estimate)), Face::South, specular(0.0, 0.6, 0.0));
    scene.room.boxes[0].surface = specular(0.1, 0.5, 0.0);
    Row::new(scene).mirrors(Mirrors::LeftOut)
}

pub fn between_mirrors_points() -> Row {
    between_mirrors(Point).stored(&["path_tracing", "bidirectional_path_tracing"])
}

pub fn between_mirrors_cells() -> Row {
    between_mirrors(CellAverage).stored(&["light_tracing", "bidirectional_path_tracing"])
}

/// The sun through clear closures, and by way of a mirror.
pub fn mirror_clear_sun_cells() -> Row {
    let tubes = [bent(clear()), straight(0.5, 0.9, Diffuser::Open)];
    Row::new(sunny(mirror_wall(furnished(tubes, CellAverage)))).stored(&["light_tracing", "photon_mapping"])
}

/// The lobe of a wall is so narrow that light by way of it counts as unscattered.
pub fn narrow_lobe_cells() -> Row {
    let scene = furnished([bent(lambertian(0.5, 0.4)), domed(lambertian(0.6, 0.2))], CellAverage);
    Row::new(with_face(scene, Face::North, specular(0.2, 0.7, 0.1)))
}

/// What points see of the sun through a bent tube with a clear closure is found by density estimates alone.
pub fn bent_clear_sun_points() -> Row {
    let mut scene = cube(0.3, 0.5, 0.7, vec![bent(clear())], daylight(12, 5000.0, 40.0, 120.0), Point);
    scene.grids = vec![Grid::new("grid".into(), 0.3, [5, 5], 0.1, [SIDE, SIDE], Point)];
    Row::new(sunny(scene)).stored(&["photon_mapping", "sppm"])
}

/// Colours everywhere, an open face, a clear closure under a dome.
fn coloured(estimate: skyduct::scene::EstimateKind) -> Scene {
    let mut scene = furnished([domed(clear()), straight(1.0, 0.95, lambertian(0.5, 0.4))], estimate);
    scene.channels = Channels::Rgb;
    scene.room.enclosure.paint(Face::South as usize, None);
    scene.room.enclosure.paint(Face::West as usize, Some(Surface::diffuse([0.7, 0.2, 0.1])));
    let tinted = Specular { reflectance: [0.2, 0.5, 0.7], roughness: 0.4 };
    scene
        .room
        .enclosure
        .paint(Face::East as usize, Some(Surface { reflectance: [0.2, 0.3, 0.1], specular: Some(tinted) }));
    scene
}

pub fn coloured_points() -> Row {
    Row::new(coloured(Point)).stored(&["path_tracing", "bidirectional_path_tracing"])
}

pub fn coloured_cells() -> Row {
    Row::new(coloured(CellAverage))
}

/// Colours of pane, pipe, closure and wall, in the sun.
pub fn coloured_tube_points() -> Row {
    let tube = Tube {
        shape: TubeShape::Cylinders(StraightOrBent {
            reflectance: [0.9, 0.95, 0.8].into(),
            segments: vec![Segment { length_m: 0.8, tilt: 0.0, azimuth: 0.0 }],
            collector: Collector::Flat { transmittance: [0.9, 0.8, 0.7] },
            cut: None,
        }),
        ..straight(1.0, 0.9, Diffuser::Lambertian { transmittance: [0.3, 0.5, 0.6], reflectance: [0.2, 0.1, 0.3] })
    };
    let mut scene = cube(0.3, 0.5, 0.7, vec![tube], daylight(12, 5000.0, 40.0, 120.0), Point);
    scene.grids = vec![Grid::new("grid".into(), 0.3, [5, 5], 0.1, [SIDE, SIDE], Point)];
    scene.channels = Channels::Rgb;
    Row::new(sunny(with_face(scene, Face::North, Surface::diffuse([0.8, 0.5, 0.3]))))
}

/// Sensors in the corners of the floor, under the ceiling's, on the box, and closer together than any gather radius.
pub fn corners_and_crowded_sensors() -> Row {
    let mut scene = furnished(scattering(), Point);
    let grid = |height_m: f64, low: DVec2, high: DVec2| {
        let mut grid = Grid::new("grid".into(), height_m, [3, 3], 0.0, [SIDE, SIDE], Point);
        let places = |low: f64, high: f64| (0..3).map(|k| low + (high - low) * f64::from(k) / 2.0).collect();
        (grid.x_m, grid.y_m) = (places(low.x, high.x), places(low.y, high.y));
        grid
    };
    let corner = DVec2::splat(SIDE - 0.01);
    scene.grids = vec![
        grid(0.01, DVec2::splat(0.01), corner),
        grid(SIDE - 0.05, DVec2::splat(0.01), corner),
        grid(0.3, DVec2::splat(1.0), DVec2::splat(1.02)),
        grid(0.9, DVec2::new(1.15, 0.5), DVec2::new(1.25, 0.7)),
    ];
    Row::new(scene).stored(&["path_tracing", "bidirectional_path_tracing"]).work(2.0).passes(24)
}

/// Twenty tubes, in rows of five.
pub fn twenty_tubes_points() -> Row {
    let tubes = (0..20).map(|k| {
        let place = DVec2::new(f64::from(k % 5) + 0.5, f64::from(k / 5) + 0.5) / DVec2::new(5.0, 4.0);
        Tube { centre: place * SIDE, opening_radius: 0.1, ..straight(1.0, 0.95, lambertian(0.6, 0.3)) }
    });
    let mut scene = cube(0.3, 0.5, 0.7, tubes.collect(), daylight(12, 5000.0, 40.0, 120.0), Point);
    scene.grids = vec![Grid::new("grid".into(), 0.3, [4, 4], 0.1, [SIDE, SIDE], Point)];
    Row::new(scene)
}

/// Boxes on and beside each other, one below a tube, in colours, and sensors up to the walls and to the boxes.
pub fn beside_boxes_and_walls_points() -> Row {
    let mut scene = furnished([bent(lambertian(0.5, 0.4)), straight(1.0, 0.95, lambertian(0.6, 0.2))], Point);
    scene.channels = Channels::Rgb;
    scene.room.luminaires.clear();
    scene.room.enclosure.paint(Face::East as usize, Some(Surface::diffuse([0.7, 0.3, 0.1])));
    let below = &scene.room.boxes[0];
    let box_at = |base: DVec3, size: DVec3, rotation: f64| BoxObject {
        size,
        base,
        rotation,
        surface: Surface::diffuse([0.2, 0.8, 0.5]),
    };
    let above = box_at(below.base + DVec3::Z * below.size.z, DVec3::new(0.2, 0.2, 0.4), 1.0);
    scene.room.boxes.extend([above, box_at(DVec3::new(0.55, 1.5, 0.2), DVec3::new(0.5, 0.3, 0.2), 0.0)]);
    scene.grids = vec![
        Grid::new("over the floor".into(), 0.02, [7, 7], 0.012, [SIDE, SIDE], Point),
        Grid::new("on the box".into(), 0.9, [5, 3], 0.015, [SIDE, SIDE], Point),
    ];
    Row::new(scene).stored(&["path_tracing", "bidirectional_path_tracing"])
}

/// A board that leans: its own horizon cuts off part of the diffuser.
pub fn leaning_board_sun_points() -> Row {
    let leaning = board([[0.3, 0.4, 0.2], [1.5, 0.4, 1.9], [1.5, 1.6, 1.9], [0.3, 1.6, 0.2]], 0.8);
    let tube = Tube { centre: DVec2::new(1.3, 1.0), ..straight(0.5, 0.95, lambertian(0.6, 0.2)) };
    let mut scene = cube(0.3, 0.5, 0.7, vec![tube], daylight(12, 5000.0, 40.0, 120.0), Point);
    scene.room.meshes.push(leaning);
    with_sun(&mut scene, 30_000.0, 50.0);
    scene.grids = vec![Grid::new("grid".into(), 0.1, [5, 5], 0.1, [SIDE, SIDE], Point)];
    Row::new(scene)
}

/// A board of two triangles.
fn board(corners: [[f64; 3]; 4], reflectance: f64) -> MeshObject {
    let mesh = TriangleMesh {
        positions: corners.map(DVec3::from).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        triangle_materials: vec![0, 0],
        materials: vec!["board".into()],
        ..TriangleMesh::default()
    };
    MeshObject::new(mesh, vec![Surface::diffuse([reflectance; 3])])
}

/// A chair of boards whose low corner is there: a seat, and a back that leans.
fn chair(x: f64, y: f64) -> [MeshObject; 2] {
    let seat = [[x, y, 0.45], [x + 0.4, y, 0.45], [x + 0.4, y + 0.4, 0.45], [x, y + 0.4, 0.45]];
    let back = [[x, y + 0.4, 0.45], [x + 0.4, y + 0.4, 0.45], [x + 0.4, y + 0.52, 0.9], [x, y + 0.52, 0.9]];
    [board(seat, 0.5), board(back, 0.6)]
}

/// A room of 4 x 3 x 2.7 m with a Lambertian tube near one corner and one that is bent.
fn office(floor: f64, walls: f64, ceiling: f64) -> Scene {
    let straight = Tube { centre: DVec2::new(0.8, 0.7), ..straight(1.0, 0.95, lambertian(0.6, 0.2)) };
    let bent = Tube { centre: DVec2::new(2.9, 2.0), ..bent(lambertian(0.5, 0.4)) };
    let mut scene = cube(floor, walls, ceiling, vec![straight, bent], daylight(12, 5000.0, 40.0, 120.0), Point);
    crate::scenes::resize(&mut scene, DVec3::new(4.0, 3.0, 2.7));
    scene
}

fn desks(scene: &mut Scene) {
    let desk = |x: f64, y: f64, rotation: f64| {
        let surface = Surface::diffuse([0.5; 3]);
        let top = BoxObject { size: DVec3::new(1.4, 0.7, 0.03), base: DVec3::new(x, y, 0.69), rotation, surface };
        let drawers = BoxObject { size: DVec3::new(0.4, 0.55, 0.6), base: DVec3::new(x, y, 0.0), rotation, surface };
        [top, drawers]
    };
    scene.room.boxes.extend([desk(1.2, 0.6, 0.0), desk(3.0, 1.6, 1.2)].into_iter().flatten());
}

fn over(scene: &Scene, height_m: f64, margin_m: f64) -> Vec<Grid> {
    let size = [scene.room.enclosure.extent().x, scene.room.enclosure.extent().y];
    vec![Grid::new("grid".into(), height_m, [6, 5], margin_m, size, Point)]
}

/// Desks of boxes in a dark room, sensors below their tops.
pub fn dark_desks_points() -> Row {
    let mut scene = office(0.1, 0.2, 0.4);
    desks(&mut scene);
    scene.grids = over(&scene, 0.3, 0.5);
    Row::new(scene)
}

/// Chairs of meshes in a bright room, sensors among them.
pub fn bright_chairs_points() -> Row {
    let mut scene = office(0.6, 0.85, 0.9);
    scene.room.meshes.extend([chair(0.9, 0.5), chair(2.0, 1.3), chair(3.2, 2.1)].into_iter().flatten());
    scene.grids = over(&scene, 0.6, 0.3);
    Row::new(scene)
}

/// Desks of boxes and chairs of meshes, sensors over them and up to the walls.
pub fn desks_and_chairs_beside_walls_points() -> Row {
    let mut scene = office(0.3, 0.6, 0.8);
    desks(&mut scene);
    scene.room.meshes.extend([chair(0.6, 1.4), chair(2.1, 0.9)].into_iter().flatten());
    scene.grids = over(&scene, 0.76, 0.03);
    Row::new(scene).stored(&["path_tracing", "bidirectional_path_tracing"])
}
