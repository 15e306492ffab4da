//! Reader of OBJ files.
//!
//! A file is read once, statement by statement ([`statements`](super::statements)), so that an error names its line, the reader can be
//! stopped at any line, and a file costs little more memory than its mesh. Only positions, faces of positions and material switches are
//! read. Existing parsers store every face with all its indices before the first can be examined, which takes ten times the memory and time
//! for a file that is made to be costly, and their errors have no lines.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;

use super::TriangleMesh;
use super::encoding::utf8;
use super::polygon::{self, Effort, Untriangulated};
use super::statements::{Statement, Statements, lines};
use super::triangle_mesh::Assembly;

/// Limits to the time and memory that one file may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ObjLimits {
    /// Length of the file in bytes.
    pub bytes: usize,
    /// Length in bytes of the longest line, or of the lines of one statement together.
    pub line_bytes: usize,
    /// Number of `v` lines, including those that no face uses.
    pub vertices: usize,
    /// Number of triangles that faces are split into.
    pub triangles: usize,
    /// Number of distinct material names.
    pub materials: usize,
    /// Length in bytes of the longest material name.
    pub name_bytes: usize,
    /// Number of corner tests while concave faces are triangulated ([`polygon::Effort`]): about a second.
    pub looks: u64,
}

impl Default for ObjLimits {
    fn default() -> Self {
        Self {
            bytes: 32 << 20,
            line_bytes: 64 << 10,
            vertices: 2_000_000,
            triangles: 2_000_000,
            materials: 1000,
            name_bytes: 256,
            looks: 50_000_000,
        }
    }
}

/// Error in a file, with the number of its line (from 1).
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {detail}")]
pub struct ObjError {
    /// Number of the line, from 1: the first one of a statement, the last one for errors of the whole file.
    pub line: usize,
    /// Description of the error, worded for the author of the file.
    pub detail: String,
}

/// Number of lines between two checks of the cancel flag.
const LINES_BETWEEN_LOOKS: usize = 1024;

/// Reads an OBJ file in UTF-8 or UTF-16, with or without a byte order mark; names may be in any encoding.
///
/// Polygons are triangulated; triangles without area, and repetitions of a triangle, are dropped; equal positions are merged. Material
/// names come from `usemtl`; faces before the first one, and after one without a name, have the name "". Material libraries, groups,
/// normals, texture coordinates, lines and points are ignored. Never touches another file.
pub fn parse_obj(bytes: &[u8], limits: ObjLimits) -> Result<TriangleMesh, ObjError> {
    parse_obj_until(bytes, limits, &AtomicBool::new(false))
}

/// Reads an OBJ file as [`parse_obj`] does, and fails if `cancel` becomes true: the error then names the line that was reached.
pub fn parse_obj_until(bytes: &[u8], limits: ObjLimits, cancel: &AtomicBool) -> Result<TriangleMesh, ObjError> {
    if bytes.len() > limits.bytes {
        let line = utf8(&bytes[..limits.bytes]).map_or(1, |text| lines(&text).count());
        return Err(ObjError {
            line,
            detail: format!("a file may have at most {} bytes, not {}", limits.bytes, bytes.len()),
        });
    }
    let text = utf8(bytes).map_err(|reason| ObjError { line: 1, detail: format!("the file {reason}") })?;
    let mut reader = ObjReader::new(limits, cancel);
    let mut statements = Statements::of(&text, limits.line_bytes);
    let mut next_look = 1;
    for statement in statements.by_ref() {
        let line = statement.line;
        let stop = line >= next_look && {
            next_look = line + LINES_BETWEEN_LOOKS;
            cancel.load(Ordering::Relaxed)
        };
        let read = if stop { Err(STOPPED.to_owned()) } else { reader.statement(&statement) };
        read.map_err(|detail| ObjError { line, detail })?;
    }
    reader.finish().map_err(|detail| ObjError { line: statements.lines_read(), detail })
}

const STOPPED: &str = "reading stopped at this line: it took too long, or the request was cancelled";

/// Reads a file statement by statement into an [`Assembly`].
struct ObjReader<'a> {
    limits: ObjLimits,
    effort: Effort<'a>,
    /// Corners of the current face, and the numbers of their vertices.
    corners: Vec<DVec3>,
    numbers: Vec<usize>,
    triangles: usize,
    /// Material names so far, with their numbers in the mesh; `None` until a face uses the material.
    names: HashMap<String, Option<u32>>,
    /// Name in the last `usemtl`.
    name: String,
    /// Number of the material `name` in the mesh, once a face uses it.
    material: Option<u32>,
    faces: bool,
    assembly: Assembly,
}

impl<'a> ObjReader<'a> {
    fn new(limits: ObjLimits, cancel: &'a AtomicBool) -> Self {
        Self {
            limits,
            effort: Effort { looks: limits.looks, cancel },
            corners: Vec::new(),
            numbers: Vec::new(),
            triangles: 0,
            names: HashMap::new(),
            name: String::new(),
            material: None,
            faces: false,
            assembly: Assembly::default(),
        }
    }

    fn finish(mut self) -> Result<TriangleMesh, String> {
        if !self.faces {
            return Err("the file ends without any face".to_owned());
        }
        if self.assembly.is_empty() {
            return Err("no face in this file has an area".to_owned());
        }
        // a last switch without faces names a material, too, if it has a name
        if !self.name.is_empty() {
            self.assembly.material(&self.name);
        }
        Ok(self.assembly.finish())
    }

    fn statement(&mut self, statement: &Statement) -> Result<(), String> {
        let bytes = statement.bytes;
        if bytes > self.limits.line_bytes {
            return Err(format!("a line may have at most {} bytes, not {bytes}", self.limits.line_bytes));
        }
        let (keyword, rest) = statement.keyword();
        match keyword {
            "v" => self.vertex(rest),
            "f" => self.face(rest),
            "usemtl" => self.switch_material(rest.trim()),
            _ => Ok(()),
        }
    }

    fn switch_material(&mut self, name: &str) -> Result<(), String> {
        if name.len() > self.limits.name_bytes {
            return Err(format!(
                "a material name may have at most {} bytes, not {}",
                self.limits.name_bytes,
                name.len()
            ));
        }
        if self.name == name {
            return Ok(());
        }
        self.material = match self.names.get(name) {
            Some(number) => *number,
            None if self.names.len() >= self.limits.materials => {
                return Err(format!("more than {} materials", self.limits.materials));
            }
            None => *self.names.entry(name.to_owned()).or_default(),
        };
        self.name.clear();
        self.name.push_str(name);
        Ok(())
    }

    /// Reads a statement `v x y z`, optionally with a weight or a colour.
    fn vertex(&mut self, rest: &str) -> Result<(), String> {
        if self.assembly.vertices() == self.limits.vertices {
            return Err(format!("more than {} vertices", self.limits.vertices));
        }
        let number = |text: &str| match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            Ok(_) => Err(format!("a coordinate must be finite, but is {text:?}")),
            Err(_) => Err(format!("{text:?} is not a number")),
        };
        let mut numbers = rest.split_whitespace();
        let numbers: [Option<&str>; 5] = std::array::from_fn(|_| numbers.next());
        let weight = match numbers[3..] {
            [Some(weight), None] => number(weight)?,
            _ => 1.0,
        };
        if weight == 0.0 {
            return Err("the weight of a vertex must not be zero".to_owned());
        }
        let mut position = [0.0; 3];
        for (count, coordinate) in position.iter_mut().enumerate() {
            let text = numbers[count].ok_or_else(|| format!("a vertex needs three coordinates, not {count}"))?;
            *coordinate = number(text)? / weight;
        }
        if position.iter().any(|coordinate| !coordinate.is_finite()) {
            return Err("a coordinate divided by its weight is not finite".to_owned());
        }
        self.assembly.push_vertex(DVec3::from_array(position));
        Ok(())
    }

    /// Reads a statement `f` with corners `position/texture/normal`, each counted from 1, or backward from -1.
    fn face(&mut self, rest: &str) -> Result<(), String> {
        self.corners.clear();
        self.numbers.clear();
        for corner in rest.split_whitespace() {
            let position = corner_position(corner)?;
            let vertices = self.assembly.vertices() as i64;
            let absolute = if position < 0 { vertices.saturating_add(position).saturating_add(1) } else { position };
            let index = usize::try_from(absolute).ok().and_then(|absolute| absolute.checked_sub(1));
            let vertex = index.and_then(|index| Some((index, self.assembly.vertex(index)?)));
            let (number, vertex) = vertex.ok_or_else(|| {
                format!("index {position} is out of range: there are {vertices} vertices before this line")
            })?;
            self.numbers.push(number);
            self.corners.push(vertex);
        }
        let corners = self.corners.len();
        if corners < 3 {
            return Err(format!("a face has at least 3 corners, not {corners}"));
        }
        self.triangles += corners - 2;
        if self.triangles > self.limits.triangles {
            return Err(format!("more than {} triangles", self.limits.triangles));
        }
        self.faces = true;
        let material = match self.material {
            Some(material) => material,
            None => {
                let number = self.assembly.material(&self.name);
                self.names.insert(self.name.clone(), Some(number));
                *self.material.insert(number)
            }
        };
        if let [a, b, c] = self.numbers[..] {
            self.assembly.push([a, b, c], material);
            return Ok(());
        }
        let triangles = polygon::triangulate(&self.corners, &mut self.effort).map_err(|reason| match reason {
            Untriangulated::Cancelled => STOPPED.to_owned(),
            Untriangulated::TooCostly => format!(
                "this concave face of {corners} corners and the concave faces before it take too long to triangulate: \
                 split them into triangles"
            ),
        })?;
        for triangle in triangles {
            self.assembly.push(triangle.map(|corner| self.numbers[corner]), material);
        }
        Ok(())
    }
}

/// Reads the first index of a corner `position/texture/normal`; the others must be indices or empty.
fn corner_position(corner: &str) -> Result<i64, String> {
    // most corners are one number
    if let Ok(position @ (..=-1 | 1..)) = corner.parse() {
        return Ok(position);
    }
    let mut position = None;
    for (place, index) in corner.split('/').enumerate() {
        let index = match index {
            "" => None,
            index => Some(index.parse::<i64>().map_err(|_| format!("{index:?} is not an index"))?),
        };
        match place {
            0 => position = index,
            1 | 2 => {}
            _ => return Err(format!("a corner has at most three indices: {corner:?}")),
        }
    }
    match position {
        None => Err(format!("a corner without a position: {corner:?}")),
        Some(0) => Err("index 0: vertices are counted from 1".to_owned()),
        Some(position) => Ok(position),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Dropped;

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
    }

    #[test]
    fn polygons_become_triangles_and_degenerate_ones_go() {
        let clean = parse(&format!("{SQUARE}f 1 2 3 4\n")).unwrap();
        assert_eq!(clean.triangles.len(), 2);
        let text = format!(
            "{SQUARE}v 1 0 0\nv 0.5 0 0\nf 1 1 2\nf 1 6 2\nf 1 2 3 4\nf 3 2 1\nf 4 3 1\nf 1 5 3\nl 1 2 3\np 1\n"
        );
        let mesh = parse(&text).unwrap();
        assert_eq!(mesh.dropped, Dropped { without_area: 2, repeated: 3 });
        assert_eq!(TriangleMesh { dropped: Dropped::default(), ..mesh }, clean);
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
            ("v 0 0 0\nv 1 0 0\nf 1 \\\n 2 \\\n\nv 0 zero 0\n", 3, "at least 3"),
            ("v 0 0 \\\n0\nv 0 0\n", 3, "three coordinates"),
            ("v 0 0 0\r\nv 0 \\\r\n0 0\r\nv 0 zero 0\r\n", 4, "not a number"),
            ("v 0 0 0\rv 0 0 0\r\rv 0 zero 0", 4, "not a number"),
            ("v 0 0 0\nf 1 \\", 2, "at least 3"),
            ("# c:\\models\\\nv 0 zero 0", 2, "not a number"),
            ("#\\\nv 0 zero 0", 2, "not a number"),
            ("\\\nv\\\n0 zero 0", 1, "not a number"),
            ("usemtl\nf 1 2 3\n", 2, "out of range"),
            ("v 0 0 0\nf 1 1 1\n", 3, "has an area"),
            ("v 0 0 0\nf 1 0/a 1\n", 2, "not an index"),
            ("v 0 0 0\nf 1// 1 1\nv x 0 0\n", 3, "not a number"),
        ];
        for (text, line, detail) in cases {
            let error = parse(text).unwrap_err();
            assert_eq!(error.line, line, "{text:?}: {error}");
            assert!(error.detail.contains(detail), "{text:?}: {error}");
        }
    }

    /// Returns the square in the notation of other programs.
    fn square(parts: [&str; 4]) -> String {
        let [comment, name, wrapped, end] = parts;
        let text = format!("{comment}\n{SQUARE}usemtl {name}\nf 1 2 {wrapped} 3 4 # last\n");
        text.replace('\n', end)
    }

    #[test]
    fn lines_of_other_programs() {
        let plain = parse(&square(["#", "a", "", "\n"])).unwrap();
        assert_eq!((plain.triangles.len(), plain.materials.as_slice()), (2, &["a".to_owned()][..]));
        for end in ["\n", "\r\n", "\r"] {
            for wrapped in ["", "\\\n", "\\\n \\ \n\\\n", "\\ # a\n"] {
                for comment in ["#", "# c:\\", "vn 0 0 \\\n f 1"] {
                    let text = square([comment, "a", wrapped, end]);
                    assert_eq!(parse(&text).as_ref(), Ok(&plain), "{text:?}");
                }
            }
        }
        // each line with an end of its own
        let mixed = square(["#", "a", "\\\n", "\n"]).replacen('\n', "\r", 2).replacen("1 0\n", "1 0\r\n", 2);
        assert_eq!(parse(&mixed).as_ref(), Ok(&plain), "{mixed:?}");
        // names may continue on the next line, too
        assert_eq!(parse(&square(["#", "a \\\n  b", "", "\n"])).unwrap().materials, ["a b"]);
    }

    #[test]
    fn encodings() {
        let text = square(["# \u{e9}\u{1f600}", "\u{e9}\u{4e2d}\u{1f600}", "\\\n", "\r\n"]);
        let plain = parse(&text).unwrap();
        assert_eq!(plain.materials, ["\u{e9}\u{4e2d}\u{1f600}"]);
        for mark in ["", "\u{feff}"] {
            let text = format!("{mark}{text}");
            let [mut little, mut big] = [Vec::new(), Vec::new()];
            for unit in text.encode_utf16() {
                little.extend(unit.to_le_bytes());
                big.extend(unit.to_be_bytes());
            }
            for bytes in [text.as_bytes(), &little, &big] {
                assert_eq!(parse_obj(bytes, ObjLimits::default()).as_ref(), Ok(&plain), "{bytes:?}");
            }
            let wide: Vec<u8> = text.chars().flat_map(|c| u32::from(c).to_le_bytes()).collect();
            let error = parse_obj(&wide, ObjLimits::default()).unwrap_err();
            assert!(error.detail.contains("UTF-32"), "{error}");
        }
        let error = parse_obj(b"\x1f\x8b\x08\0", ObjLimits::default()).unwrap_err();
        assert!(error.detail.contains("gzip"), "{error}");
    }

    /// Reads the largest number of groups that a file has bytes for, and switches back to faces without a material.
    #[test]
    fn switches_without_a_name_and_many_groups() {
        let groups: String = (0..30_000).map(|k| format!("o {k}\ng {k}\nusemtl {}\n", k % 2)).collect();
        let text = format!("{SQUARE}f 1 2 3\n{groups}f 1 2 4\nusemtl\nf 2 3 4\nusemtl  \nusemtl 0\nf 1 3 4\nusemtl\n");
        let mesh = parse(&text).unwrap();
        assert_eq!(mesh.materials, ["", "1", "0"]);
        assert_eq!(mesh.triangle_materials, [0, 1, 0, 2]);
        let named = parse(&format!("{SQUARE}usemtl a\nf 1 2 3\nusemtl\n")).unwrap();
        assert_eq!(named.materials, ["a"]);
    }

    #[test]
    fn limits_hold() {
        let limits = ObjLimits {
            bytes: 1000,
            line_bytes: 100,
            vertices: 6,
            triangles: 4,
            materials: 1,
            name_bytes: 5,
            looks: 12,
        };
        let error = |text: String| parse_obj(text.as_bytes(), limits).unwrap_err();
        assert!(error("#\n".repeat(501)).detail.contains("1000 bytes"));
        assert_eq!(error(format!("v 0 0 0\n#{}", "x".repeat(100))).line, 2);
        assert_eq!(error(format!("{SQUARE}f 1 2 3 4\nf 1 2 3 4\nf 1 2 3\n")).line, 7);
        assert_eq!(error(format!("o a\n{}", "v 0 0\\\n".repeat(20))).line, 2);
        assert_eq!(error("usemtl a\nusemtl a\nusemtl b\n".to_owned()).line, 3);
        assert_eq!(error("\nusemtl long names\n".to_owned()).line, 2);
        assert_eq!(error(SQUARE.repeat(2)).line, 7);
        let notched = "v 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 0\nf 1 2 3 4 5 6\n";
        let costly = error(notched.to_owned());
        assert_eq!(costly.line, 7, "{costly}");
    }

    #[test]
    fn a_reader_that_is_stopped_names_its_line() {
        let text = format!("{SQUARE}{}", "f 1 2 3 4\n".repeat(3000));
        let error = parse_obj_until(text.as_bytes(), ObjLimits::default(), &AtomicBool::new(true)).unwrap_err();
        assert_eq!(error, ObjError { line: 1, detail: STOPPED.to_owned() });
    }
}
