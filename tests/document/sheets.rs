//! Meshes that have polygons at the same places: each place becomes one sheet, whatever the order, the winding and the diagonals.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::sync::Arc;

use crate::given::{base, mesh_tube, refused, with};
use crate::schema::parse;
use glam::DVec3;
use serde_json::{Value, json};
use skyduct::document::{DocumentErrors, FieldErrorCode, FileSource, to_scene};
use skyduct::geometry::coincident::overlaps;
use skyduct::geometry::obj::{ObjLimits, parse_obj};
use skyduct::geometry::{Dropped, TriangleMesh};
use skyduct::guide::mesh::Part;
use skyduct::optics::Mirror;
use skyduct::scene::{MeshObject, Scene, TubeShape};

/// OBJ files, known by their numbers.
struct Files<'a>(&'a [&'a str]);

impl FileSource for Files<'_> {
    fn load(&self, number: &str) -> Result<Arc<TriangleMesh>, String> {
        Ok(Arc::new(file(self.0[number.parse::<usize>().unwrap()])))
    }
}

fn file(text: &str) -> TriangleMesh {
    parse_obj(text.as_bytes(), ObjLimits::default()).unwrap()
}

fn scene(document: &Value, files: &[&str]) -> Result<Scene, DocumentErrors> {
    to_scene(&parse(document).unwrap(), &Files(files)).map(|(scene, ..)| scene)
}

/// Corners of the triangles of a mesh.
fn corners(mesh: &TriangleMesh) -> Vec<[DVec3; 3]> {
    mesh.triangles.iter().map(|triangle| triangle.map(|corner| mesh.positions[corner as usize])).collect()
}

/// A room of mesh objects, of the materials white (0.8), dark (0.05) and wood (0.4) as far as each has them.
fn room(objects: &[&str]) -> Value {
    let object = |(number, text): (usize, &&str)| {
        let names = [("white", 0.8), ("dark", 0.05), ("wood", 0.4)];
        let has = |name: &str| text.lines().any(|line| line == format!("usemtl {name}"));
        let used = names.iter().filter(|(name, _)| has(name));
        let surfaces: serde_json::Map<String, Value> =
            used.map(|(name, reflectance)| ((*name).to_owned(), json!({ "reflectance": reflectance }))).collect();
        json!({ "kind": "mesh", "mesh": number.to_string(), "unit": "m", "position_m": [0, 0, 0], "surfaces": surfaces })
    };
    let objects: Vec<Value> = objects.iter().enumerate().map(object).collect();
    with(base(), "/room/objects", json!(objects))
}

fn objects(texts: &[&str]) -> Result<Vec<MeshObject>, DocumentErrors> {
    scene(&room(texts), texts).map(|scene| scene.room.meshes)
}

/// The corners 1, 2, 3, 4 of a unit square at a height, counter-clockwise seen from above, and 5, 6 in the middles of 1 4 and 2 3.
fn square(z: f64) -> String {
    [(0.5, 0.5), (1.5, 0.5), (1.5, 1.5), (0.5, 1.5), (0.5, 1.0), (1.5, 1.0)]
        .map(|(x, y)| format!("v {x} {y} {z}\n"))
        .concat()
}

/// A mesh of some polygons of such a square 1 m high.
fn plate(polygons: &[(&str, &str)]) -> String {
    polygons.iter().fold(square(1.0), |text, (material, corners)| text + &format!("usemtl {material}\nf {corners}\n"))
}

/// Areas in 1e-4 m2 of level meshes by the reflectances in % of their upper and lower sides; no two triangles lie on each other.
fn sides(objects: &[MeshObject]) -> BTreeMap<[u32; 2], u32> {
    let mut areas: BTreeMap<[u32; 2], f64> = BTreeMap::new();
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for MeshObject { mesh, surfaces, .. } in objects {
        for (number, triangle) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize]);
            let area = 0.5 * (b - a).cross(c - a).z;
            let percent = |side: u32| (100.0 * surfaces[side as usize].reflectance[0]).round() as u32;
            let [front, back] = mesh.sides(number).map(percent);
            *areas.entry(if area > 0.0 { [front, back] } else { [back, front] }).or_default() += area.abs();
        }
        let first = positions.len() as u32;
        triangles.extend(mesh.triangles.iter().map(|triangle| triangle.map(|corner| corner + first)));
        positions.extend(&mesh.positions);
    }
    assert_eq!(overlaps(&positions, &triangles, 1e-6), Ok(Vec::new()));
    areas.into_iter().map(|(sides, area)| (sides, (1e4 * area).round() as u32)).collect()
}

#[track_caller]
fn assert_sides(texts: &[&str], expected: &[([u32; 2], u32)]) {
    let found = objects(texts).unwrap_or_else(|errors| panic!("{texts:?}: {errors:?}"));
    assert_eq!(sides(&found), expected.iter().copied().collect(), "{texts:?}");
}

/// A plate that is drawn twice is the plate drawn once, to the last bit where the first drawing is the same.
#[test]
fn plates_drawn_twice() {
    let numbers = |polygons: &[(&str, &str)]| corners(&objects(&[&plate(polygons)]).unwrap()[0].mesh);
    let once = numbers(&[("wood", "1 2 3 4")]);
    for again in ["1 2 3 4", "4 3 2 1", "3 2 1 4", "2 3 4 1"] {
        let twice = [("wood", "1 2 3 4"), ("wood", again)];
        assert_eq!(numbers(&twice), once, "{again}");
        let reversed = plate(&[twice[1], twice[0]]);
        assert_sides(&[&reversed], &[([40, 40], 10000)]);
        let thrice = [twice[0], twice[1], ("wood", "4 1 2 3")];
        assert_eq!(numbers(&thrice), once, "{again}");
    }
    // the second drawing in two halves, in the last digits of the file elsewhere, or as another object
    assert_eq!(numbers(&[("wood", "1 2 3 4"), ("wood", "5 6 2 1"), ("wood", "5 4 3 6")]), once);
    let moved = format!("{}{}usemtl wood\nf 1 2 3 4\nf 10 9 8 7\n", square(1.0), square(1.000001));
    assert_sides(&[&moved], &[([40, 40], 10000)]);
    let [front, back] = ["1 2 3 4", "3 2 1 4"].map(|corners| plate(&[("wood", corners)]));
    assert_sides(&[&front, &back], &[([40, 40], 10000)]);
    // a plate of which half is drawn twice
    assert_sides(&[&plate(&[("wood", "1 2 3 4"), ("wood", "1 5 6 2")])], &[([40, 40], 10000)]);
}

/// A sheet of two materials has each on the side that its polygon faces.
#[test]
fn two_materials_on_two_sides() {
    let (up, down) = (["1 2 3 4", "2 3 4 1"], ["4 3 2 1", "1 4 3 2"]);
    for (up, down) in up.iter().flat_map(|up| down.map(|down| (*up, down))) {
        let (white, dark) = (("white", up), ("dark", down));
        for polygons in [[white, dark], [dark, white]] {
            assert_sides(&[&plate(&polygons)], &[([80, 5], 10000)]);
        }
        let [white, dark] = [white, dark].map(|polygon| plate(&[polygon]));
        assert_sides(&[&white, &dark], &[([80, 5], 10000)]);
        assert_sides(&[&dark, &white], &[([80, 5], 10000)]);
    }
    // triangles of the same corners, a side in two halves of different materials, and a side that is told of in part
    let corners = [("white", "1 2 3"), ("dark", "3 2 1"), ("dark", "1 4 3"), ("white", "1 3 4")];
    assert_sides(&[&plate(&corners)], &[([80, 5], 10000)]);
    let halves = [("white", "1 2 3 4"), ("dark", "5 6 2 1"), ("wood", "4 3 6 5")];
    assert_sides(&[&plate(&halves)], &[([80, 5], 5000), ([80, 40], 5000)]);
    assert_sides(&[&plate(&halves[..2])], &[([80, 5], 5000), ([80, 80], 5000)]);
}

/// A material with a surface of its own for backs has each on its side, whichever way its polygons are wound; where the back of one lies
/// on the front of another they must agree.
#[test]
fn one_material_with_two_surfaces() {
    let two_sided = |text: &str, back: f64| {
        let mut document = room(&[text]);
        document["room"]["objects"][0]["back_surfaces"] = json!({ "white": { "reflectance": back } });
        scene(&document, &[text]).map(|scene| sides(&scene.room.meshes))
    };
    let halves = plate(&[("white", "1 2 6 5"), ("white", "4 3 6 5")]);
    assert_eq!(two_sided(&halves, 0.05).unwrap(), BTreeMap::from([([80, 5], 5000), ([5, 80], 5000)]));
    assert_eq!(two_sided(&halves, 0.8).unwrap(), BTreeMap::from([([80, 80], 10000)]));
    // the lower side is drawn again
    let again = plate(&[("white", "1 2 3 4"), ("dark", "2 1 4 3")]);
    assert_eq!(two_sided(&again, 0.05).unwrap(), BTreeMap::from([([80, 5], 10000)]));
    let errors = two_sided(&again, 0.3).unwrap_err().0;
    assert!(
        errors[0].pointer == "/room/objects/0/mesh" && errors[0].detail.contains("face the same side"),
        "{errors:?}"
    );
    // and a half of it
    let half = plate(&[("white", "1 2 3 4"), ("dark", "2 1 5 6")]);
    assert_eq!(two_sided(&half, 0.05).unwrap(), BTreeMap::from([([80, 5], 10000)]));
}

/// Two materials of one side are refused with their names and the place, in a mesh as between two.
#[test]
fn two_materials_on_one_side_are_refused() {
    let both = plate(&[("white", "1 2 3 4"), ("dark", "2 3 4 1")]);
    let [white, dark] = [("white", "1 2 3 4"), ("dark", "2 3 4 1")].map(|polygon| plate(&[polygon]));
    let half = plate(&[("dark", "1 2 6 5")]);
    for (texts, at) in [
        (vec![&*both], "/room/objects/0/mesh"),
        (vec![&white, &dark], "/room/objects/1/mesh"),
        (vec![&white, &half], "/room/objects/1/mesh"),
    ] {
        let errors = objects(&texts).unwrap_err().0;
        assert_eq!(errors.len(), 1, "{errors:?}");
        let detail = &errors[0].detail;
        assert!(errors[0].pointer == at && detail.contains("\"white\"") && detail.contains("\"dark\""), "{errors:?}");
    }
    // with one surface nobody can tell them apart
    let mut document = room(&[&both]);
    document["room"]["objects"][0]["surfaces"]["dark"] = json!({ "reflectance": 0.8 });
    assert_eq!(sides(&scene(&document, &[&both]).unwrap().room.meshes), BTreeMap::from([([80, 80], 10000)]));
}

/// A block on four corners, its faces outward.
fn block(corner: [f64; 3], size: [f64; 3], first: usize) -> String {
    let at = |k: usize, axis: usize| corner[axis] + size[axis] * (k >> axis & 1) as f64;
    let corners = (0..8).map(|k| format!("v {} {} {}\n", at(k, 0), at(k, 1), at(k, 2)));
    let faces = [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]];
    let faces = faces.map(|face| format!("f {}\n", face.map(|k| (k + first).to_string()).join(" ")));
    corners.chain(faces).collect()
}

/// Meshes of which no two polygons lie on each other keep every bit, and so do closed bodies that touch.
#[test]
fn single_meshes_keep_their_bits() {
    let [low, high] = [block([0.5, 0.5, 0.0], [1.0, 1.0, 0.5], 0), block([0.5, 0.5, 0.5], [1.0, 1.0, 0.25], 8)];
    let small = block([0.75, 0.75, 0.5], [0.25, 0.25, 0.25], 8);
    for text in [
        plate(&[("wood", "1 2 3 4")]),
        plate(&[("white", "1 2 6 5"), ("dark", "5 6 3 4")]),
        format!("usemtl wood\n{low}"),
        format!("usemtl wood\n{low}{high}"),
        format!("usemtl wood\n{low}usemtl white\n{high}"),
        format!("usemtl wood\n{low}usemtl white\n{small}"),
    ] {
        let found = objects(&[&text]).unwrap().remove(0).mesh;
        assert_eq!(found, file(&text), "{text}");
    }
    let high = format!("usemtl white\n{}", block([0.5, 0.5, 0.5], [1.0, 1.0, 0.25], 0));
    let low = format!("usemtl wood\n{low}");
    let found = objects(&[&low, &high]).unwrap();
    assert_eq!(found[0].mesh, file(&low));
    assert_eq!(found[1].mesh, file(&high));
}

/// A closed block drawn twice, its second drawing outward or inward and by other diagonals, is the block.
#[test]
fn blocks_drawn_twice() {
    let once = block([0.5, 0.5, 0.0], [1.0, 1.0, 0.5], 0);
    let mesh = |text: &str| objects(&[text]).unwrap().remove(0).mesh;
    let single = mesh(&format!("usemtl wood\n{once}"));
    let turned = |by: usize, reversed: bool| -> String {
        let faces = once.lines().filter(|line| line.starts_with('f')).map(|line| {
            let mut corners: Vec<&str> = line.split(' ').skip(1).collect();
            corners.rotate_left(by);
            if reversed {
                corners.reverse();
            }
            format!("f {}\n", corners.join(" "))
        });
        faces.collect()
    };
    for (by, reversed) in [(0, true), (1, true), (1, false)] {
        let twice = mesh(&format!("usemtl wood\n{once}{}", turned(by, reversed)));
        assert_eq!(TriangleMesh { dropped: Dropped::default(), ..twice }, single, "{by} {reversed}");
    }
}

/// A pipe of twelve sides with a cover; `sheets`: materials of the walls' drawings, and whether each faces outward.
fn pipe(sheets: &[(&str, bool)], diagonal: usize) -> String {
    let ring = |z: f64| {
        (0..12).map(move |k| (0.1 * (TAU * f64::from(k) / 12.0).cos(), 0.1 * (TAU * f64::from(k) / 12.0).sin(), z))
    };
    let mut text: String = ring(0.0).chain(ring(1.0)).map(|(x, y, z)| format!("v {x} {y} {z}\n")).collect();
    let caps = [("cover", 13), ("diffuser", 1)].map(|(name, first)| {
        let corners: Vec<String> = (first..first + 12).map(|k| k.to_string()).collect();
        format!("usemtl {name}\nf {}\n", corners.join(" "))
    });
    text += &caps.concat();
    for (drawing, (material, outward)) in sheets.iter().enumerate() {
        text += &format!("usemtl {material}\n");
        for k in 0..12 {
            let next = (k + 1) % 12;
            let mut corners = [k, next, next + 12, k + 12];
            if !outward {
                corners.reverse();
            }
            corners.rotate_left(drawing * diagonal);
            text += &format!("f {}\n", corners.map(|k| (k + 1).to_string()).join(" "));
        }
    }
    text
}

/// The mesh and the walls' reflectances of a tube of such a pipe.
fn tube(text: &str, paint: bool) -> (TriangleMesh, Vec<f64>) {
    let mut given = mesh_tube();
    given["mesh"] = json!("0");
    let cover = given["parts"]["cover"].clone();
    let diffuser = given["parts"]["diffuser"].clone();
    given["parts"] = json!({ "cover": cover, "diffuser": diffuser, "film": { "role": "pipe", "reflectance": 0.98 } });
    if paint {
        given["parts"]["paint"] = json!({ "role": "pipe", "reflectance": 0.25 });
    }
    let scene = scene(&with(base(), "/tubes/0", given), &[text]).unwrap_or_else(|errors| panic!("{errors:?}"));
    let TubeShape::Mesh(tube) = &scene.tubes[0].shape else { panic!("a mesh") };
    let walls = (0..tube.mesh.triangles.len()).filter_map(|number| {
        match &tube.parts[tube.mesh.triangle_materials[number] as usize] {
            Part::Pipe { reflectance: Mirror::Constant([reflectance, ..]) } => Some(*reflectance),
            _ => None,
        }
    });
    let walls = walls.collect();
    (TriangleMesh { dropped: Dropped::default(), ..(*tube.mesh).clone() }, walls)
}

/// Pipes whose walls are drawn twice are those drawn once; of two materials that of the inner side counts.
#[test]
fn pipes_drawn_twice() {
    let once = tube(&pipe(&[("film", false)], 0), false);
    assert_eq!(once.0, file(&pipe(&[("film", false)], 0)));
    for outward in [false, true] {
        for diagonal in [0, 1, 2] {
            let twice = tube(&pipe(&[("film", false), ("film", outward)], diagonal), false);
            assert_eq!(twice, once, "{outward} {diagonal}");
        }
    }
    for diagonal in [0, 1] {
        let (film, paint) = (("film", false), ("paint", true));
        for sheets in [[film, paint], [paint, film]] {
            let (mesh, walls) = tube(&pipe(&sheets, diagonal), true);
            assert!(walls.iter().all(|wall| (wall - 0.98).abs() < 1e-9), "{sheets:?} {diagonal} {walls:?}");
            assert_eq!((mesh.triangles.len(), mesh.back_materials.len()), (once.0.triangles.len(), 0));
        }
    }
}

/// What lies in the plane of the ceiling over an opening is refused by its name, in part as in whole; what is beside or below is not.
#[test]
fn nothing_covers_an_opening() {
    let at = |x: f64, z: f64| {
        let corners = [(0.0, 0.0), (0.5, 0.0), (0.5, 1.0), (0.0, 1.0)];
        let corners = corners.map(|(dx, dy)| format!("v {} {} {z}\n", x + dx, 0.5 + dy));
        format!("{}usemtl wood\nf 1 2 3 4\n", corners.concat())
    };
    // the opening has the radius 0.127 around (1.016, 1.016) in the ceiling, 2.032 m high
    let liner = format!("usemtl wood\n{}", block([0.1; 3], [1.8, 1.8, 1.932], 0));
    for covering in [at(0.8, 2.032), at(0.4, 2.032), at(1.142, 2.032), liner] {
        let document = room(&[&at(0.0, 0.5), &covering]);
        let errors = scene(&document, &[&at(0.0, 0.5), &covering]).unwrap_err().0;
        assert!(errors.len() == 1 && errors[0].pointer == "/room/objects/1", "{covering}: {errors:?}");
        assert!(errors[0].detail.contains("/tubes/0"), "{errors:?}");
    }
    for free in [at(0.8, 2.03), at(0.388, 2.032), at(1.144, 2.032)] {
        assert!(objects(&[&free]).is_ok(), "{free}");
    }
    let column = |x: f64, height: f64, rotation: f64| {
        let column = json!({ "kind": "box", "size_m": [0.4, 0.4, height], "position_m": [x, 1.016, 0],
                             "rotation_deg": rotation, "surface": { "reflectance": 0.5 } });
        with(base(), "/room/objects", json!([column]))
    };
    for (x, rotation) in [(1.3, 0.0), (0.7, 0.0), (1.4, 45.0)] {
        refused(&column(x, 2.032, rotation), "/room/objects/0", FieldErrorCode::Invalid);
        assert!(parse(&column(x, 2.03, rotation)).is_ok());
    }
    for (x, rotation) in [(1.4, 0.0), (0.6, 0.0), (1.45, 45.0)] {
        assert!(parse(&column(x, 2.032, rotation)).is_ok(), "{x} {rotation}");
    }
}
