//! Triangles with colours as a binary glTF 2.0 file (ISO/IEC 12113:2022).

use glam::DVec3;
use serde_json::{Value, json};

/// Codes of glTF: the type of 32-bit floats and integers, and the kinds of buffer views.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// Triangles with a colour at each vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ColouredMesh {
    /// Name, shown by viewers.
    pub name: String,
    /// Corners in metres, z up.
    pub positions: Vec<DVec3>,
    /// Colours of the corners in sRGB.
    pub colours: Vec<[u8; 3]>,
    /// Corners of the triangles, counter-clockwise from the side that is seen.
    pub triangles: Vec<[u32; 3]>,
    /// Shading of the surface.
    pub look: Look,
}

/// Shading of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Look {
    /// Colours as they are, on the front of the triangles alone.
    #[default]
    Plain,
    /// Colours shaded by the viewer's light, on both sides.
    Shaded,
    /// Colours shaded by the viewer's light, on the front of the triangles alone.
    ShadedFront,
}

impl ColouredMesh {
    /// Creates a mesh without triangles.
    pub fn named(name: impl Into<String>, look: Look) -> Self {
        Self { name: name.into(), look, ..Self::default() }
    }

    /// Adds a convex polygon of one colour.
    pub fn add_polygon(&mut self, corners: impl IntoIterator<Item = DVec3>, colour: [u8; 3]) {
        let first = self.positions.len() as u32;
        self.positions.extend(corners);
        self.colours.resize(self.positions.len(), colour);
        let end = self.positions.len() as u32;
        self.triangles.extend((first + 2..end).map(|last| [first, last - 1, last]));
    }
}

/// Writes meshes as a file; those without triangles are left out. `extras` go with the scene.
pub fn glb(meshes: &[ColouredMesh], extras: &Value) -> Vec<u8> {
    let mut bytes: Vec<u8> = Vec::new();
    let (mut views, mut accessors, mut written) = (Vec::new(), Vec::new(), Vec::new());
    for mesh in meshes.iter().filter(|mesh| !mesh.triangles.is_empty()) {
        // y is up in glTF
        let positions: Vec<[f32; 3]> =
            mesh.positions.iter().map(|at| [at.x, at.z, -at.y].map(|length| length as f32)).collect();
        let ends = |better: fn(f32, f32) -> f32| {
            positions.iter().copied().reduce(|a, b| std::array::from_fn(|axis| better(a[axis], b[axis])))
        };
        let ends = json!({ "min": ends(f32::min), "max": ends(f32::max) });
        let mut colours =
            mesh.colours.iter().flat_map(|colour| colour.map(|value| linear(value).to_le_bytes())).flatten();
        let first = accessors.len();
        let corners = positions.iter().flatten().flat_map(|value| value.to_le_bytes());
        let of_triangles = mesh.triangles.iter().flatten().flat_map(|corner| corner.to_le_bytes());
        let mut add = |content: &mut dyn Iterator<Item = u8>, target: u32, accessor: Value| {
            let start = bytes.len();
            bytes.extend(content);
            let view = json!({ "buffer": 0, "byteOffset": start, "byteLength": bytes.len() - start, "target": target });
            let mut accessor = accessor;
            accessor["bufferView"] = views.len().into();
            views.push(view);
            accessors.push(accessor);
        };
        let count = positions.len();
        let mut place = json!({ "componentType": FLOAT, "count": count, "type": "VEC3" });
        let colour = place.clone();
        (place["min"], place["max"]) = (ends["min"].clone(), ends["max"].clone());
        add(&mut corners.collect::<Vec<u8>>().into_iter(), ARRAY_BUFFER, place);
        add(&mut colours, ARRAY_BUFFER, colour);
        let indices = json!({ "componentType": UNSIGNED_INT, "count": 3 * mesh.triangles.len(), "type": "SCALAR" });
        add(&mut of_triangles.collect::<Vec<u8>>().into_iter(), ELEMENT_ARRAY_BUFFER, indices);
        let attributes = json!({ "POSITION": first, "COLOR_0": first + 1 });
        let primitive = json!({ "attributes": attributes, "indices": first + 2, "material": mesh.look as u32 });
        written.push(json!({ "name": mesh.name, "primitives": [primitive] }));
    }
    let nodes: Vec<Value> =
        (0..written.len()).map(|mesh| json!({ "mesh": mesh, "name": written[mesh]["name"] })).collect();
    let shaded = json!({ "metallicFactor": 0.0, "roughnessFactor": 1.0 });
    let mut root = json!({
        "asset": { "version": "2.0", "generator": format!("skyduct {}", crate::VERSION) },
        "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{ "extras": extras }],
        "materials": [{ "name": "plain", "extensions": { "KHR_materials_unlit": {} } },
                      { "name": "shaded", "doubleSided": true, "pbrMetallicRoughness": shaded },
                      { "name": "shaded front", "pbrMetallicRoughness": shaded }],
    });
    // empty lists are not allowed
    if !written.is_empty() {
        root["scenes"][0]["nodes"] = (0..nodes.len()).collect();
        root["nodes"] = nodes.into();
        root["meshes"] = written.into();
        root["accessors"] = accessors.into();
        root["bufferViews"] = views.into();
        root["buffers"] = json!([{ "byteLength": bytes.len() }]);
    }
    let mut text = root.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let chunks = [(&text, b"JSON"), (&bytes, b"BIN\0")];
    let chunks: Vec<_> = chunks.into_iter().filter(|(content, _)| !content.is_empty()).collect();
    let length = 12 + chunks.iter().map(|(content, _)| 8 + content.len()).sum::<usize>();
    let mut file = b"glTF".to_vec();
    file.extend([2, length as u32].map(u32::to_le_bytes).concat());
    for (content, name) in chunks {
        file.extend((content.len() as u32).to_le_bytes());
        file.extend(name);
        file.extend(content);
    }
    file
}

/// Converts a value of sRGB to a linear one, 0..1 (IEC 61966-2-1).
fn linear(value: u8) -> f32 {
    let value = f64::from(value) / 255.0;
    let linear = if value <= 0.04045 { value / 12.92 } else { libm::pow((value + 0.055) / 1.055, 2.4) };
    linear as f32
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Reads a file: its JSON, and its binary chunk. Checks the lengths, and that every accessor lies within its view and every view
    /// within the buffer, and every index within the vertices.
    pub fn read(file: &[u8]) -> (Value, Vec<u8>) {
        let number = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&file[..4], number(4), number(8)), (&b"glTF"[..], 2, file.len()));
        let length = number(12);
        assert!(&file[16..20] == b"JSON" && length.is_multiple_of(4));
        let root: Value = serde_json::from_slice(&file[20..20 + length]).unwrap();
        let bytes = file.get(28 + length..).unwrap_or_default().to_vec();
        let items = |name: &str| root[name].as_array().cloned().unwrap_or_default();
        let whole = |value: &Value| value.as_u64().unwrap() as usize;
        for view in items("bufferViews") {
            assert!(whole(&view["byteOffset"]) + whole(&view["byteLength"]) <= bytes.len());
        }
        let content = |accessor: &Value| {
            let view = &root["bufferViews"][whole(&accessor["bufferView"])];
            let width = if accessor["type"] == "VEC3" { 12 } else { 4 };
            assert_eq!(whole(&accessor["count"]) * width, whole(&view["byteLength"]), "{accessor}");
            bytes[whole(&view["byteOffset"])..][..whole(&view["byteLength"])].to_vec()
        };
        for mesh in items("meshes") {
            let primitive = &mesh["primitives"][0];
            let accessor = |number: &Value| &root["accessors"][whole(number)];
            let position = accessor(&primitive["attributes"]["POSITION"]);
            assert_eq!(position["count"], accessor(&primitive["attributes"]["COLOR_0"])["count"]);
            let corners = content(position);
            let floats = corners.chunks(4).map(|four| f32::from_le_bytes(four.try_into().unwrap()));
            for (index, value) in floats.enumerate() {
                let [low, high] = ["min", "max"].map(|end| position[end][index % 3].as_f64().unwrap() as f32);
                assert!((low..=high).contains(&value));
            }
            let indices = content(accessor(&primitive["indices"]));
            let corners = indices.chunks(4).map(|four| u32::from_le_bytes(four.try_into().unwrap()) as usize);
            assert!(corners.into_iter().all(|corner| corner < whole(&position["count"])));
            assert!(whole(&primitive["material"]) < items("materials").len());
        }
        (root, bytes)
    }

    #[test]
    fn a_square_is_two_triangles() {
        let mut square = ColouredMesh::named("square", Look::Plain);
        let corners = [(0.0, 0.0), (2.0, 0.0), (2.0, 3.0), (0.0, 3.0)].map(|(x, y)| DVec3::new(x, y, 1.0));
        square.add_polygon(corners, [255, 0, 0]);
        let (root, bytes) =
            read(&glb(&[square, ColouredMesh::named("nothing", Look::Shaded)], &json!({ "unit": "lux" })));
        assert_eq!((root["meshes"].as_array().map(Vec::len), &root["meshes"][0]["name"]), (Some(1), &json!("square")));
        assert_eq!(root["accessors"][0]["min"], json!([0.0, 1.0, -3.0]));
        assert_eq!(root["accessors"][2]["count"], 6);
        assert_eq!(bytes.len(), 4 * 12 + 4 * 12 + 6 * 4);
        let (empty, _) = read(&glb(&[], &json!(null)));
        assert!(empty["meshes"].is_null());
    }
}
