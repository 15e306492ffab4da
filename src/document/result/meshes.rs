//! Triangles of the meshes of a job as they stand in the room, for pictures.

use std::collections::BTreeMap;

use glam::DVec3;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::geometry::OpeningFrame;
use crate::geometry::merging::Merging;
use crate::geometry::turn::unit_vector;
use crate::guide::mesh::Part;
use crate::scene::{MeshObject, MeshTube, Scene, Tube, TubeShape};

/// Largest number of triangles of all meshes together.
pub const MOST_DRAWN: usize = 30_000;

/// Factor by which cells grow until few enough triangles are left.
const COARSER: f64 = 1.5;

/// Smallest cell, as a fraction of the room's scale.
const LEAST_CELL: f64 = 1e-6;

/// Triangles of the meshes of objects and tubes as they stand in the room, at most 30 000 together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MeshesResult {
    /// Number of triangles that the meshes have, each copy counted.
    pub triangles: usize,
    /// Edge in metres of the cells in each of which all corners were merged into one, because there are too many triangles to draw; null
    /// where none is left out.
    pub cell_m: Option<f64>,
    /// Meshes, those of objects first, each in the order of the document.
    pub meshes: Vec<MeshResult>,
}

/// Triangles of an object with all its copies, or of a tube.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MeshResult {
    /// JSON pointer of the object or the tube in the document: `/room/objects/2`, `/tubes/0`.
    pub pointer: String,
    /// Triangles by the surfaces of their two sides.
    pub parts: Vec<MeshPartResult>,
}

/// Triangles that look the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MeshPartResult {
    /// Role of the triangles in their object or tube.
    pub role: MeshRole,
    /// Reflectance of the side from which the corners run counter-clockwise, diffuse and specular together: red, green and blue, linear
    /// Rec.709, 0..1. Of tubes it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reflectance: Option<[f64; 3]>,
    /// Reflectance of the other side, where it differs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub back_reflectance: Option<[f64; 3]>,
    /// Corners in metres in the room's frame.
    pub corners_m: Vec<[f32; 3]>,
    /// Numbers of the corners of each triangle, from 0.
    pub triangles: Vec<[u32; 3]>,
}

/// Role of triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MeshRole {
    /// An object in the room.
    Object,
    /// The cover of a tube's upper end.
    Collector,
    /// The wall of a tube.
    Pipe,
    /// The closure in a tube's opening.
    Diffuser,
}

/// Triangles of a mesh by their role and the numbers of the surfaces of front and back.
type Parts = BTreeMap<(MeshRole, [u32; 2]), Merging>;

impl MeshesResult {
    /// Returns the meshes of a scene; `objects` has the numbers of its mesh objects in the document.
    pub fn new(scene: &Scene, objects: &[usize]) -> Self {
        // partitions follow the objects of the document
        let of_objects: Vec<(&MeshObject, usize)> = scene.room.meshes.iter().zip(objects.iter().copied()).collect();
        let of_tubes: Vec<(usize, OpeningFrame, &MeshTube)> =
            scene.tubes.iter().enumerate().filter_map(of_mesh(scene)).collect();
        let (mut triangles, mut area_m2) = (0, 0.0);
        let mut count = |[a, b, c]: [DVec3; 3]| {
            triangles += 1;
            area_m2 += 0.5 * (b - a).cross(c - a).length();
        };
        of_objects.iter().flat_map(|(object, _)| object.triangles()).for_each(|(corners, _)| count(corners));
        of_tubes.iter().flat_map(|(_, frame, tube)| placed(*frame, tube)).for_each(|(corners, _)| count(corners));
        let merged = |cell_m: f64| -> Vec<Parts> {
            let objects = of_objects.iter().map(|(object, _)| {
                let named = object.triangles().map(|(corners, sides)| (corners, (MeshRole::Object, sides)));
                parts(named, cell_m)
            });
            let tubes = of_tubes.iter().map(|(_, frame, tube)| parts(placed(*frame, tube), cell_m));
            objects.chain(tubes).collect()
        };
        let left =
            |merged: &[Parts]| merged.iter().flat_map(BTreeMap::values).map(|part| part.triangles.len()).sum::<usize>();
        let start_m = (area_m2 / MOST_DRAWN as f64).sqrt().max(LEAST_CELL * scene.room.enclosure.scale_m());
        let mut cell_m = if triangles > MOST_DRAWN { start_m } else { 0.0 };
        let mut all = merged(cell_m);
        while left(&all) > MOST_DRAWN {
            cell_m *= COARSER;
            all = merged(cell_m);
        }
        let names = of_objects.iter().map(|(object, number)| (format!("/room/objects/{number}"), Some(*object)));
        let names = names.chain(of_tubes.iter().map(|(number, ..)| (format!("/tubes/{number}"), None)));
        let mesh = |((pointer, object), parts): ((String, Option<&MeshObject>), Parts)| MeshResult {
            pointer,
            parts: parts.into_iter().map(|(of, merging)| MeshPartResult::new(of, object, merging)).collect(),
        };
        Self { triangles, cell_m: (cell_m > 0.0).then_some(cell_m), meshes: names.zip(all).map(mesh).collect() }
    }
}

impl MeshPartResult {
    fn new((role, [front, back]): (MeshRole, [u32; 2]), object: Option<&MeshObject>, merging: Merging) -> Self {
        let of = |side: u32| object.map(|object| object.surfaces[side as usize].albedo());
        Self {
            role,
            reflectance: of(front),
            back_reflectance: of(back).filter(|_| front != back),
            corners_m: merging.corners.iter().map(|corner| corner.to_array().map(|length| length as f32)).collect(),
            triangles: merging.triangles,
        }
    }
}

/// Sorts triangles by what they are, and merges the corners of each kind in cells of `cell_m` in m.
fn parts(triangles: impl Iterator<Item = ([DVec3; 3], (MeshRole, [u32; 2]))>, cell_m: f64) -> Parts {
    let mut parts = Parts::new();
    for (corners, kind) in triangles {
        parts.entry(kind).or_insert_with(|| Merging::new(cell_m)).add(corners);
    }
    parts
}

/// Finds the tubes that are meshes, with their numbers and the frames of their openings.
fn of_mesh(scene: &Scene) -> impl Fn((usize, &Tube)) -> Option<(usize, OpeningFrame, &MeshTube)> {
    |(number, tube)| match &tube.shape {
        TubeShape::Mesh(mesh) => Some((number, tube.frame(&scene.room.enclosure), mesh)),
        TubeShape::Cylinders(_) => None,
    }
}

/// Lists the triangles of a tube in the room's frame.
fn placed(frame: OpeningFrame, tube: &MeshTube) -> impl Iterator<Item = ([DVec3; 3], (MeshRole, [u32; 2]))> {
    let turn = unit_vector(-tube.rotation);
    let at = move |corner: u32| {
        let position = tube.mesh.positions[corner as usize];
        frame.origin + frame.direction_in_room(turn.rotate(position.truncate()).extend(position.z))
    };
    let role = |material: u32| match tube.parts[material as usize] {
        Part::Collector { .. } => MeshRole::Collector,
        Part::Pipe { .. } => MeshRole::Pipe,
        Part::Diffuser => MeshRole::Diffuser,
    };
    let triangles = tube.mesh.triangles.iter().zip(&tube.mesh.triangle_materials);
    triangles.map(move |(corners, material)| (corners.map(at), (role(*material), [0, 0])))
}
