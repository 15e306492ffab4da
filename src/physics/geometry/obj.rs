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
mod tests;
