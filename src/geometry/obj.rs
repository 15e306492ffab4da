//! OBJ files (the only user of tobj).
//!
//! A file is read twice: the first pass ([`clean`]) checks every line, so that an error can name it, and writes down
//! only what counts here: positions, faces of positions and material switches. The parser sees nothing else, so that
//! neither groups nor colours nor material libraries of a file from elsewhere can lead it astray.

use std::collections::{HashMap, HashSet};

use glam::DVec3;

use super::polygon;

/// Triangles with material names; coordinates in metres after [`TriangleMesh::scaled`], in file units before.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleMesh {
    pub positions: Vec<DVec3>,
    /// Corner indices into `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// Index into `materials`, one per triangle.
    pub triangle_materials: Vec<u32>,
    /// Material names in order of first use; faces without one have the name "".
    pub materials: Vec<String>,
}

impl TriangleMesh {
    /// The mesh with every coordinate multiplied by `factor`, e.g. metres per file unit.
    pub fn scaled(&self, factor: f64) -> Self {
        let positions = self.positions.iter().map(|position| *position * factor).collect();
        Self { positions, ..self.clone() }
    }

    /// Lowest and highest corner of the bounding box of all triangles; `None` without triangles.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let mut corners = self.triangles.iter().flatten().filter_map(|index| self.positions.get(*index as usize));
        let first = *corners.next()?;
        Some(corners.fold((first, first), |(low, high), corner| (low.min(*corner), high.max(*corner))))
    }
}

/// What a file may ask of the reader's time and memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ObjLimits {
    pub bytes: usize,
    pub line_bytes: usize,
    pub triangles: usize,
    /// Objects, groups and material switches together.
    pub objects: usize,
}

impl Default for ObjLimits {
    fn default() -> Self {
        Self { bytes: 32 << 20, line_bytes: 64 << 10, triangles: 2_000_000, objects: 10_000 }
    }
}

/// What is wrong with a file, and in which line (from 1).
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {detail}")]
pub struct ObjError {
    pub line: usize,
    pub detail: String,
}

/// Reads an OBJ file.
///
/// Polygons are triangulated; triangles without area, and repetitions of a triangle, are dropped; equal positions are
/// one. Material names come from `usemtl`; material libraries, normals, texture coordinates, lines and points are
/// ignored. Never touches another file.
pub fn parse_obj(bytes: &[u8], limits: ObjLimits) -> Result<TriangleMesh, ObjError> {
    let clean = clean(bytes, limits)?;
    let last_line = clean.lines;
    let failed = |detail: String| ObjError { line: last_line, detail };
    let options = tobj::LoadOptions { triangulate: false, single_index: true, ..tobj::LoadOptions::default() };
    let library = |_: &std::path::Path| {
        let named = |index: usize| tobj::Material { name: index.to_string(), ..tobj::Material::default() };
        let materials: Vec<_> = (0..clean.materials.len()).map(named).collect();
        let by_name = materials.iter().enumerate().map(|(index, material)| (material.name.clone(), index)).collect();
        Ok((materials, by_name))
    };
    let (models, _) =
        tobj::load_obj_buf(&mut clean.text.as_bytes(), &options, library).map_err(|error| failed(error.to_string()))?;

    let mut assembly = Assembly::default();
    let mut face_lines = clean.face_lines.iter();
    for model in &models {
        let mesh = &model.mesh;
        let name = mesh.material_id.and_then(|id| clean.materials.get(id)).map_or("", String::as_str);
        let material = assembly.material(name);
        let positions: Vec<DVec3> = mesh.positions.chunks_exact(3).map(DVec3::from_slice).collect();
        let mut indices = mesh.indices.as_slice();
        while !indices.is_empty() {
            // without arities, all faces are triangles
            let line = face_lines.next();
            let arity = match line {
                Some(face) => face.corners,
                None => indices.len(),
            };
            let (face, rest) = indices.split_at(arity.min(indices.len()));
            indices = rest;
            let corners: Option<Vec<DVec3>> =
                face.iter().map(|index| positions.get(*index as usize).copied()).collect();
            let line = line.map_or(last_line, |face| face.line);
            let corners = corners.ok_or_else(|| ObjError { line, detail: "a face without a position".to_owned() })?;
            let triangles = polygon::triangulate(&corners).ok_or_else(|| ObjError {
                line,
                detail: format!("a concave face has at most {} corners", polygon::MOST_CONCAVE_CORNERS),
            })?;
            triangles.into_iter().for_each(|triangle| assembly.push(triangle.map(|k| corners[k]), material));
        }
    }
    if assembly.mesh.triangles.is_empty() {
        return Err(failed("no face in this file has an area".to_owned()));
    }
    Ok(assembly.mesh)
}

/// A mesh in the making.
struct Assembly {
    mesh: TriangleMesh,
    index_of: HashMap<[u64; 3], u32>,
    seen: HashSet<[u32; 3]>,
}

impl Default for Assembly {
    fn default() -> Self {
        let mesh = TriangleMesh {
            positions: Vec::new(),
            triangles: Vec::new(),
            triangle_materials: Vec::new(),
            materials: Vec::new(),
        };
        Self { mesh, index_of: HashMap::new(), seen: HashSet::new() }
    }
}

impl Assembly {
    fn material(&mut self, name: &str) -> u32 {
        let materials = &mut self.mesh.materials;
        let index = materials.iter().position(|known| known == name).unwrap_or_else(|| {
            materials.push(name.to_owned());
            materials.len() - 1
        });
        index as u32
    }

    fn position(&mut self, position: DVec3) -> u32 {
        // -0 and 0 are one place
        let key = position.to_array().map(|coordinate| (coordinate + 0.0).to_bits());
        let positions = &mut self.mesh.positions;
        *self.index_of.entry(key).or_insert_with(|| {
            positions.push(position);
            (positions.len() - 1) as u32
        })
    }

    /// The first of several equal triangles wins, whatever their winding and materials.
    fn push(&mut self, corners: [DVec3; 3], material: u32) {
        let [a, b, c] = corners;
        let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
        // below the rounding of the cross product of corners on one line
        let doubled_area = (b - a).cross(c - a).length();
        if doubled_area.is_nan() || doubled_area <= 1e-14 * longest {
            return;
        }
        let triangle = corners.map(|corner| self.position(corner));
        let mut key = triangle;
        key.sort_unstable();
        if self.seen.insert(key) {
            self.mesh.triangles.push(triangle);
            self.mesh.triangle_materials.push(material);
        }
    }
}

/// A file reduced to what counts.
struct Clean {
    /// `v`, `usemtl` (by index) and `f` (by absolute position).
    text: String,
    materials: Vec<String>,
    face_lines: Vec<FaceLine>,
    /// Number of lines of the file.
    lines: usize,
}

struct FaceLine {
    line: usize,
    corners: usize,
}

/// Checks every line of a file and keeps what counts.
fn clean(bytes: &[u8], limits: ObjLimits) -> Result<Clean, ObjError> {
    if bytes.len() > limits.bytes {
        let line = 1 + bytes[..limits.bytes].iter().filter(|byte| **byte == b'\n').count();
        return Err(ObjError {
            line,
            detail: format!("a file has at most {} bytes, not {}", limits.bytes, bytes.len()),
        });
    }
    let mut clean =
        Clean { text: "mtllib materials\n".to_owned(), materials: Vec::new(), face_lines: Vec::new(), lines: 0 };
    let mut scan = Scan { limits, vertices: 0, triangles: 0, objects: 0, material_of: HashMap::new() };
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    for (index, line) in bytes.split(|byte| *byte == b'\n').enumerate() {
        clean.lines = index + 1;
        scan.line(line, &mut clean).map_err(|detail| ObjError { line: index + 1, detail })?;
    }
    if clean.face_lines.is_empty() {
        return Err(ObjError { line: clean.lines, detail: "the file ends without any face".to_owned() });
    }
    Ok(clean)
}

struct Scan {
    limits: ObjLimits,
    vertices: usize,
    triangles: usize,
    objects: usize,
    material_of: HashMap<String, usize>,
}

impl Scan {
    fn line(&mut self, line: &[u8], clean: &mut Clean) -> Result<(), String> {
        if line.len() > self.limits.line_bytes {
            return Err(format!("a line has at most {} bytes, not {}", self.limits.line_bytes, line.len()));
        }
        // names may be in any encoding; everything else is ASCII
        let line = String::from_utf8_lossy(line);
        let line = line.trim();
        let (keyword, rest) = line.split_once(|c: char| c.is_whitespace()).unwrap_or((line, ""));
        if matches!(keyword, "v" | "f") {
            let rest = rest.split('#').next().unwrap_or_default();
            if rest.trim_end().ends_with('\\') {
                return Err("a line that continues in the next one is not supported yet".to_owned());
            }
            return if keyword == "v" { self.vertex(rest, clean) } else { self.face(rest, clean) };
        }
        if matches!(keyword, "o" | "g" | "usemtl") {
            self.objects += 1;
            if self.objects > self.limits.objects {
                return Err(format!("more than {} objects, groups and material switches", self.limits.objects));
            }
        }
        if keyword == "usemtl" {
            let name = rest.trim();
            if name.is_empty() {
                return Err("`usemtl` without a name".to_owned());
            }
            let index = *self.material_of.entry(name.to_owned()).or_insert_with(|| {
                clean.materials.push(name.to_owned());
                clean.materials.len() - 1
            });
            clean.text.push_str(&format!("usemtl {index}\n"));
        }
        Ok(())
    }

    /// `v x y z`, with a weight or a colour.
    fn vertex(&mut self, rest: &str, clean: &mut Clean) -> Result<(), String> {
        let numbers: Vec<&str> = rest.split_whitespace().collect();
        if numbers.len() < 3 {
            return Err(format!("a vertex has three coordinates, not {}", numbers.len()));
        }
        let number = |text: &str| match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            Ok(_) => Err(format!("a coordinate must be finite, but is {text:?}")),
            Err(_) => Err(format!("{text:?} is not a number")),
        };
        let weight = if numbers.len() == 4 { number(numbers[3])? } else { 1.0 };
        if weight == 0.0 {
            return Err("the weight of a vertex must not be zero".to_owned());
        }
        let mut position = [0.0; 3];
        for (coordinate, text) in position.iter_mut().zip(&numbers) {
            *coordinate = number(text)? / weight;
        }
        if position.iter().any(|coordinate| !coordinate.is_finite()) {
            return Err("a coordinate divided by its weight is not finite".to_owned());
        }
        let [x, y, z] = position;
        clean.text.push_str(&format!("v {x:e} {y:e} {z:e}\n"));
        self.vertices += 1;
        Ok(())
    }

    /// `f` with corners `position/texture/normal`, each counted from 1, or backward from -1.
    fn face(&mut self, rest: &str, clean: &mut Clean) -> Result<(), String> {
        let mut corners = 0;
        clean.text.push('f');
        for corner in rest.split_whitespace() {
            let mut indices = corner.split('/').map(|index| match index {
                "" => Ok(None),
                index => index.parse::<i64>().map(Some).map_err(|_| format!("{index:?} is not an index")),
            });
            let position = indices.next().transpose()?.flatten();
            if indices.collect::<Result<Vec<_>, _>>()?.len() > 2 {
                return Err(format!("a corner has at most three indices: {corner:?}"));
            }
            let position = position.ok_or_else(|| format!("a corner without a position: {corner:?}"))?;
            let vertices = self.vertices as i64;
            let absolute = if position < 0 { vertices.saturating_add(position).saturating_add(1) } else { position };
            if position == 0 {
                return Err("index 0: vertices are counted from 1".to_owned());
            }
            if absolute < 1 || absolute > vertices {
                return Err(format!(
                    "index {position} is out of range: there are {vertices} vertices before this line"
                ));
            }
            clean.text.push_str(&format!(" {absolute}"));
            corners += 1;
        }
        if corners < 3 {
            return Err(format!("a face has at least 3 corners, not {corners}"));
        }
        clean.text.push('\n');
        self.triangles += corners - 2;
        if self.triangles > self.limits.triangles {
            return Err(format!("more than {} triangles", self.limits.triangles));
        }
        clean.face_lines.push(FaceLine { line: clean.lines, corners });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<TriangleMesh, ObjError> {
        parse_obj(text.as_bytes(), ObjLimits::default())
    }

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    #[test]
    fn materials_by_name_without_a_library() {
        let text = format!(
            "\u{feff}# a comment\nmtllib ../../etc/passwd\n{SQUARE}f 1 2 3\n  usemtl\tthe pipe #1 \no a\nf -4//1 -2/7/2 -1 # last\r\nusemtl dome\ng b\nv 0 0 1 0.5 0.5 0.5\nv 0 0 3 1.5\nf 1 2 5\nf 1 2 6\nusemtl the pipe #1\nf 2 3 5\n"
        );
        let mesh = parse(&text).unwrap();
        assert_eq!(mesh.materials, ["", "the pipe #1", "dome"]);
        assert_eq!(mesh.triangle_materials, [0, 1, 2, 2, 1]);
        assert_eq!(mesh.triangles[1].map(|k| mesh.positions[k as usize].y), [0.0, 1.0, 1.0]);
        assert_eq!(mesh.bounds().unwrap().1, DVec3::new(1.0, 1.0, 2.0));
        assert_eq!(mesh.scaled(0.0254).bounds().unwrap().1, DVec3::new(1.0, 1.0, 2.0) * 0.0254);
    }

    #[test]
    fn polygons_become_triangles_and_degenerate_ones_go() {
        let clean = parse(&format!("{SQUARE}f 1 2 3 4\n")).unwrap();
        assert_eq!(clean.triangles.len(), 2);
        let text = format!(
            "{SQUARE}v 1 0 0\nv 0.5 0 0\nf 1 1 2\nf 1 6 2\nf 1 2 3 4\nf 3 2 1\nf 4 3 1\nf 1 5 3\nl 1 2 3\np 1\n"
        );
        assert_eq!(parse(&text).unwrap(), clean);
        // a sliver of aspect 1e6 is a triangle
        assert_eq!(parse("v 0 0 0\nv 1 0 0\nv 0.5 1e-6 0\nf 1 2 3\n").unwrap().triangles.len(), 1);
        // concave: an L of area 3
        let text = "v 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 0\nf 1 2 3 4 5 6\nf 1 2 3\n";
        let mesh = parse(text).unwrap();
        let area = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|k| mesh.positions[k as usize]);
            0.5 * (b - a).cross(c - a).length()
        };
        assert!((mesh.triangles.iter().take(4).map(area).sum::<f64>() - 3.0).abs() < 1e-12);
    }

    #[test]
    fn errors_name_their_line() {
        let cases = [
            ("", 1, "without any face"),
            ("v 0 0 0\n", 2, "without any face"),
            ("v 0 0\n", 1, "three coordinates"),
            ("v 0 0 nan\n", 1, "finite"),
            ("v 0 0 0\nv 0 inf 0\n", 2, "finite"),
            ("v 0 0 1e400\n", 1, "finite"),
            ("v 0 0 zero\n", 1, "not a number"),
            ("v 1 1 1 0\n", 1, "weight"),
            ("v 1e300 1 1 1e-300\n", 1, "weight"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", 4, "out of range"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\n\nf 0 1 2\n", 5, "counted from 1"),
            ("v 0 0 0\nf -2 1 1\n", 2, "out of range"),
            ("v 0 0 0\nf 1 1 99999999999999999999\n", 2, "not an index"),
            ("v 0 0 0\nf -9223372036854775808 1 1\n", 2, "out of range"),
            ("v 0 0 0\nf 1 1\n", 2, "at least 3"),
            ("v 0 0 0\nf 1/x 1 1\n", 2, "not an index"),
            ("v 0 0 0\nf 1/1/1/1 1 1\n", 2, "at most three"),
            ("v 0 0 0\nf /1 1 1\n", 2, "without a position"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 \\\n3\n", 4, "continues"),
            ("usemtl\nf 1 2 3\n", 1, "without a name"),
            ("v 0 0 0\nf 1 1 1\n", 3, "has an area"),
        ];
        for (text, line, detail) in cases {
            let error = parse(text).unwrap_err();
            assert_eq!(error.line, line, "{text:?}: {error}");
            assert!(error.detail.contains(detail), "{text:?}: {error}");
        }
    }

    #[test]
    fn limits_hold() {
        let limits = ObjLimits { bytes: 1000, line_bytes: 100, triangles: 3, objects: 2 };
        let error = |text: String| parse_obj(text.as_bytes(), limits).unwrap_err();
        assert!(error("#\n".repeat(501)).detail.contains("1000 bytes"));
        assert_eq!(error(format!("v 0 0 0\n#{}", "x".repeat(100))).line, 2);
        assert_eq!(error(format!("{SQUARE}f 1 2 3 4\nf 1 2 3 4\n")).line, 6);
        assert_eq!(error("o a\ng b\nusemtl c\n".to_owned()).line, 3);
    }
}
