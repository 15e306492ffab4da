//! Three-dimensional model of a job: its faces in the colours of their illuminance, its objects, partitions and tubes.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use serde_json::json;

use super::glb::{ColouredMesh, Look, glb};
use super::subject::Subject;
use crate::document::JobDocument;
use crate::document::errors::Checks;
use crate::document::result::{MeshPartResult, MeshRole, MeshesResult, SurfacesResult};
use crate::document::room::object::ObjectDocument;
use crate::document::room::surface::SurfaceDocument;
use crate::document::tube::opening::PlacedOpening;
use crate::document::tube::{ParametricTube, TubeDocument};
use crate::figure::scale::{ColourScale, Palette};
use crate::output::png::srgb_byte;

/// Number of sides of a pipe.
const SIDES: usize = 24;

/// Colours of a patch without a value, of pipes, of covers, and of diffusers.
const NO_VALUE: [u8; 3] = [232; 3];
const COVER: [u8; 3] = [205, 225, 240];
const PIPE: [u8; 3] = [190, 200, 210];
const DIFFUSER: [u8; 3] = [255, 244, 214];

/// Returns the model of a job as a binary glTF file. Patches have the colours that plans have, from 0 to the greatest illuminance of the
/// faces; objects and partitions have those of their surfaces.
pub fn scene_glb(subject: &Subject, surfaces: &SurfacesResult) -> Vec<u8> {
    let all = surfaces.faces.iter().flat_map(|face| &face.patches).filter_map(|patch| patch.illuminance_lux);
    let scale = ColourScale::from_zero(all.fold(0.0, f64::max), Palette::Viridis);
    let faces = surfaces.faces.iter().map(|face| {
        let mut mesh = ColouredMesh::named(face.name.as_str(), Look::Plain);
        for patch in &face.patches {
            let colour = patch.illuminance_lux.map_or(NO_VALUE, |lux| scale.colour(lux));
            for polygon in &patch.polygons_m {
                mesh.add_polygon(polygon.iter().copied().map(DVec3::from), colour);
            }
        }
        mesh
    });
    let mut meshes: Vec<ColouredMesh> = faces.collect();
    if let Some(document) = &subject.document {
        meshes.extend(furniture(document));
        meshes.extend(tubes(document));
    }
    meshes.extend(subject.meshes.as_ref().map(of_files).unwrap_or_default());
    let mut extras = json!({ "job": subject.name(), "quantity": "illuminance", "unit": "lux", "palette": "viridis",
                             "from": scale.from, "to": scale.to });
    if let Some(MeshesResult { triangles, cell_m: Some(cell_m), .. }) = &subject.meshes {
        extras["thinned_meshes"] = json!({ "triangles": triangles, "cell_m": cell_m });
    }
    glb(&meshes, &extras)
}

/// Returns the boxes and the partitions of a room.
fn furniture(document: &JobDocument) -> Vec<ColouredMesh> {
    let boxes = document.room.objects.iter().enumerate().filter_map(|(number, object)| match object {
        ObjectDocument::Box(object) => {
            let bottom = object.position_m[2];
            let mut body = ColouredMesh::named(format!("object {}", number + 1), Look::Shaded);
            add_upright(
                &mut body,
                &object.footprint(),
                [bottom, bottom + object.size_m[2]],
                of_surface(&object.surface),
            );
            Some(body)
        }
        ObjectDocument::Mesh(_) => None,
    });
    let partitions = document.room.partitions.iter().enumerate().map(|(number, sheet)| {
        let ends = [DVec2::from(sheet.from_m), DVec2::from(sheet.to_m)];
        let mut mesh = ColouredMesh::named(format!("partition {}", number + 1), Look::Shaded);
        add_upright(&mut mesh, &ends, [0.0, sheet.height_m], of_surface(&sheet.surface));
        mesh
    });
    boxes.chain(partitions).collect()
}

/// Returns the colour of a surface.
fn of_surface(surface: &SurfaceDocument) -> [u8; 3] {
    surface.surface().map_or(NO_VALUE, |surface| colour_of(surface.albedo()))
}

/// Returns the colour of a reflectance.
fn colour_of(reflectance: [f64; 3]) -> [u8; 3] {
    reflectance.map(srgb_byte)
}

/// Returns the meshes of objects and tubes. Sheets with two colours consist of their fronts and their backs.
fn of_files(meshes: &MeshesResult) -> Vec<ColouredMesh> {
    let parts = meshes.meshes.iter().flat_map(|mesh| mesh.parts.iter().map(|part| (name_of(&mesh.pointer), part)));
    let sides = |(name, part): (String, &MeshPartResult)| {
        let colour = match (part.role, part.reflectance) {
            (MeshRole::Object, reflectance) => reflectance.map_or(NO_VALUE, colour_of),
            (MeshRole::Collector, _) => COVER,
            (MeshRole::Pipe, _) => PIPE,
            (MeshRole::Diffuser, _) => DIFFUSER,
        };
        let mesh = |look: Look, colour: [u8; 3], triangles: Vec<[u32; 3]>| ColouredMesh {
            name: name.clone(),
            positions: part.corners_m.iter().map(|corner| corner.map(f64::from).into()).collect(),
            colours: vec![colour; part.corners_m.len()],
            triangles,
            look,
        };
        match part.back_reflectance {
            None => vec![mesh(Look::Shaded, colour, part.triangles.clone())],
            Some(back) => {
                let turned = part.triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
                let fronts = mesh(Look::ShadedFront, colour, part.triangles.clone());
                vec![fronts, mesh(Look::ShadedFront, colour_of(back), turned)]
            }
        }
    };
    parts.flat_map(sides).collect()
}

/// Returns the name of an object or a tube, counted from 1, from its pointer in the document.
fn name_of(pointer: &str) -> String {
    let number = pointer.rsplit('/').next().and_then(|number| number.parse::<usize>().ok()).unwrap_or(0) + 1;
    let kind = if pointer.starts_with("/tubes/") { "tube" } else { "object" };
    format!("{kind} {number}")
}

/// Adds the body above a convex outline in plan, or the sheet above a line.
fn add_upright(mesh: &mut ColouredMesh, plan: &[DVec2], [bottom, top]: [f64; 2], colour: [u8; 3]) {
    for (from, to) in plan.iter().zip(plan.iter().cycle().skip(1)) {
        mesh.add_polygon([from.extend(bottom), to.extend(bottom), to.extend(top), from.extend(top)], colour);
    }
    mesh.add_polygon(plan.iter().map(|corner| corner.extend(top)), colour);
    mesh.add_polygon(plan.iter().rev().map(|corner| corner.extend(bottom)), colour);
}

/// Returns pipes and diffusers of the tubes; of meshed tubes the opening alone, whose mesh comes from its file.
fn tubes(document: &JobDocument) -> Vec<ColouredMesh> {
    let Some(room) = document.room.enclosure(&mut Checks::default()) else { return Vec::new() };
    let of_tube = |(number, tube): (usize, &TubeDocument)| {
        let opening = PlacedOpening::of(tube, &room)?;
        let mut mesh = ColouredMesh::named(format!("tube {}", number + 1), Look::Shaded);
        let (mouth, outward) = (opening.frame.origin, opening.frame.outward());
        // the mouth hangs a hair before its face, so that it is seen
        let before = mouth - outward * (1e-4 * room.scale_m());
        let in_room = |corner: DVec2| before + opening.frame.direction_in_room(corner.extend(0.0));
        match opening.shape.corners() {
            Some(corners) => mesh.add_polygon(corners.map(in_room), DIFFUSER),
            None => mesh.add_polygon(ring((before, outward), outward, opening.shape.outer_radius()), DIFFUSER),
        }
        if let TubeDocument::Parametric(tube) = tube {
            pipe(&mut mesh, tube, (mouth, outward));
        }
        Some(mesh)
    };
    document.tubes.iter().enumerate().filter_map(of_tube).collect()
}

/// Adds the pipe of a tube behind its mouth, given with the unit normal out of the room: segments that meet in mitres.
fn pipe(mesh: &mut ColouredMesh, tube: &ParametricTube, mouth: (DVec3, DVec3)) {
    let axes = tube.axes(mouth.1);
    let mut from = mouth;
    for (index, (segment, axis)) in tube.segments.iter().zip(&axes).enumerate() {
        let mitre = axes.get(index + 1).map_or(*axis, |next| (*axis + *next).normalize_or(*axis));
        let to = (from.0 + segment.length_m * *axis, mitre);
        let [low, high] = [from, to].map(|end| ring(end, *axis, 0.5 * tube.diameter_m));
        for side in 0..SIDES {
            let next = (side + 1) % SIDES;
            mesh.add_polygon([low[side], low[next], high[next], high[side]], PIPE);
        }
        from = to;
    }
}

/// Returns points around a cylinder of an axis and a radius, where a plane through a point of the axis with a unit normal cuts it.
fn ring((centre, normal): (DVec3, DVec3), axis: DVec3, radius: f64) -> Vec<DVec3> {
    let (across, beside) = axis.any_orthonormal_pair();
    let point = |side: usize| {
        let (sin, cos) = libm::sincos(TAU * side as f64 / SIDES as f64);
        let around = radius * (cos * across + sin * beside);
        centre + around - axis * (around.dot(normal) / axis.dot(normal))
    };
    (0..SIDES).map(point).collect()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::document::result::{FaceResult, PatchResult};
    use crate::present::glb::tests::read;
    use crate::present::subject::tests::document;

    /// A room with a table and a bent tube: the file holds together, and each thing has its name and lies where it should.
    #[test]
    fn a_model_has_faces_furniture_and_tubes() {
        let mut document = document();
        document["room"]["objects"] = json!([{ "kind": "box", "size_m": [1.0, 1.0, 0.7], "position_m": [1.5, 1.5, 0.0],
                                               "surface": { "reflectance": 0.5 } }]);
        document["tubes"][0]["segments"] =
            json!([{ "length_m": 1.0 }, { "length_m": 1.0, "tilt_deg": 45.0, "azimuth_deg": 90.0 }]);
        let patch = |lux: Option<f64>| PatchResult {
            centre_m: [0.5, 0.5, 0.0],
            area_m2: 1.0,
            polygons_m: vec![vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]],
            illuminance_lux: lux,
            standard_error_lux: None,
            luminance_cd_m2: None,
            luminance_standard_error_cd_m2: None,
        };
        let floor = FaceResult {
            name: "floor".to_owned(),
            normal: [0.0, 0.0, 1.0],
            area_m2: 24.0,
            reflectance: 0.2,
            mean_lux: Some(100.0),
            patches: vec![patch(Some(100.0)), patch(None)],
        };
        let surfaces = SurfacesResult { coverage_factor: None, faces: vec![floor] };
        let (root, _) = read(&scene_glb(&Subject::new(&document, &json!(null)), &surfaces));
        let names: Vec<&str> =
            root["meshes"].as_array().unwrap().iter().filter_map(|mesh| mesh["name"].as_str()).collect();
        assert_eq!(names, ["floor", "object 1", "tube 1"]);
        assert_eq!(root["scenes"][0]["extras"]["to"], 100.0);
        // y is up: the tube reaches from the ceiling to its upper rim
        let tube = &root["accessors"][6];
        let [low, high] = ["min", "max"].map(|end| tube[end][1].as_f64().unwrap());
        let top = 2.7 + 1.0 + 0.5f64.sqrt() + 0.15 * 0.5f64.sqrt();
        assert!((low - 2.7).abs() < 1e-2 && (high - top).abs() < 5e-3, "{low} {high} {top}");
    }
}
