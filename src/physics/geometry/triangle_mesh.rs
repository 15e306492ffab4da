//! Triangle meshes and their assembly.

use std::collections::{HashMap, HashSet};

use glam::DVec3;

/// Triangles with material names; coordinates in the unit of their file until a document places them, in metres after that.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Corner positions; [`super::obj::parse_obj`] merges equal ones.
    pub positions: Vec<DVec3>,
    /// Corner indices into `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// Index into `materials`, one per triangle.
    pub triangle_materials: Vec<u32>,
    /// Index into `materials` of the back of each triangle, from which its corners go clockwise; empty where no triangle's back
    /// differs from its front.
    pub back_materials: Vec<u32>,
    /// Material names in order of first use; faces without one have the name "".
    pub materials: Vec<String>,
    /// Numbers of triangles of the file that the mesh does not have.
    pub dropped: Dropped,
}

/// Numbers of triangles dropped from a mesh, by reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// Triangles whose corners lie on one line or point.
    pub without_area: usize,
    /// Triangles that repeat another one.
    pub repeated: usize,
}

impl TriangleMesh {
    /// Passes all numbers of the mesh to `show` as bytes, in blocks, to hash its content.
    // no generic function, which would be compiled where it is called, for size
    pub fn numbers_as_bytes(&self, show: &mut dyn FnMut(&[u8])) {
        let Self { positions, triangles, triangle_materials, back_materials, materials: _, dropped: _ } = self;
        [positions.len(), triangles.len()].iter().for_each(|length| show(&(*length as u64).to_le_bytes()));
        let mut block = Vec::with_capacity(BLOCK * 24);
        for positions in positions.chunks(BLOCK) {
            block.clear();
            block.resize(positions.len() * 24, 0);
            for (to, position) in block.chunks_exact_mut(24).zip(positions) {
                let [x, y, z] = position.to_array().map(f64::to_le_bytes);
                to[..8].copy_from_slice(&x);
                to[8..16].copy_from_slice(&y);
                to[16..].copy_from_slice(&z);
            }
            show(&block);
        }
        for (triangles, materials) in triangles.chunks(BLOCK).zip(triangle_materials.chunks(BLOCK)) {
            block.clear();
            block.resize(triangles.len() * 16, 0);
            for (to, ([a, b, c], material)) in block.chunks_exact_mut(16).zip(triangles.iter().zip(materials)) {
                for (to, number) in to.chunks_exact_mut(4).zip([a, b, c, material]) {
                    to.copy_from_slice(&number.to_le_bytes());
                }
            }
            show(&block);
        }
        back_materials.iter().for_each(|material| show(&material.to_le_bytes()));
    }

    /// Returns the materials of the front and the back of a triangle.
    pub fn sides(&self, triangle: usize) -> [u32; 2] {
        let front = self.triangle_materials[triangle];
        [front, self.back_materials.get(triangle).copied().unwrap_or(front)]
    }

    /// Sets the materials of the front and the back of each triangle.
    pub fn set_sides(&mut self, sides: impl Iterator<Item = [u32; 2]>) {
        (self.triangle_materials, self.back_materials) = sides.map(|[front, back]| (front, back)).unzip();
        if self.back_materials == self.triangle_materials {
            self.back_materials.clear();
        }
    }

    /// Returns the lowest and highest corner of the bounding box of all triangles; `None` without triangles.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let mut corners = self.triangles.iter().flatten().filter_map(|index| self.positions.get(*index as usize));
        let first = *corners.next()?;
        Some(corners.fold((first, first), |(low, high), corner| (low.min(*corner), high.max(*corner))))
    }
}

/// Number of positions, or triangles, in a block of bytes.
const BLOCK: usize = 4096;

/// A mesh under construction from vertices and triangles.
#[derive(Default)]
pub(super) struct Assembly {
    mesh: TriangleMesh,
    /// Every vertex given so far, and its index among the positions of the mesh once a triangle uses it.
    vertices: Vec<(DVec3, Option<u32>)>,
    index_of: HashMap<[u64; 3], u32>,
    /// Keys of the triangles so far: material and corners in ascending order, 32 bits each.
    seen: HashSet<u128>,
}

impl Assembly {
    /// Returns the finished mesh.
    pub fn finish(self) -> TriangleMesh {
        self.mesh
    }

    /// True if no triangle with an area was added yet.
    pub fn is_empty(&self) -> bool {
        self.mesh.triangles.is_empty()
    }

    /// Returns the index of a material, which is added if it is new.
    pub fn material(&mut self, name: &str) -> u32 {
        let materials = &mut self.mesh.materials;
        let index = materials.iter().position(|known| known == name).unwrap_or_else(|| {
            materials.push(name.to_owned());
            materials.len() - 1
        });
        index as u32
    }

    /// Adds a vertex.
    pub fn push_vertex(&mut self, position: DVec3) {
        self.vertices.push((position, None));
    }

    /// Returns the number of vertices added so far.
    pub fn vertices(&self) -> usize {
        self.vertices.len()
    }

    /// Returns the position of a vertex, if it exists.
    pub fn vertex(&self, vertex: usize) -> Option<DVec3> {
        self.vertices.get(vertex).map(|(position, _)| *position)
    }

    /// Adds a triangle of existing vertices, unless it has no area or repeats one of the same material, whatever their windings.
    pub fn push(&mut self, vertices: [usize; 3], material: u32) {
        let [a, b, c] = vertices.map(|vertex| self.vertices[vertex].0);
        let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
        // below the rounding of the cross product of corners on one line
        let doubled_area = (b - a).cross(c - a).length();
        if doubled_area.is_nan() || doubled_area <= 1e-14 * longest {
            self.mesh.dropped.without_area += 1;
            return;
        }
        let triangle = vertices.map(|vertex| self.index(vertex));
        let mut key = triangle;
        key.sort_unstable();
        if self.seen.insert(key.into_iter().fold(u128::from(material), |key, corner| key << 32 | u128::from(corner))) {
            self.mesh.triangles.push(triangle);
            self.mesh.triangle_materials.push(material);
        } else {
            self.mesh.dropped.repeated += 1;
        }
    }

    /// Returns the index of a vertex among the positions of the mesh, where equal positions are merged.
    fn index(&mut self, vertex: usize) -> u32 {
        let (position, known) = self.vertices[vertex];
        if let Some(index) = known {
            return index;
        }
        // -0 and 0 are one place
        let key = position.to_array().map(|coordinate| (coordinate + 0.0).to_bits());
        let positions = &mut self.mesh.positions;
        let index = *self.index_of.entry(key).or_insert_with(|| {
            positions.push(position);
            (positions.len() - 1) as u32
        });
        self.vertices[vertex].1 = Some(index);
        index
    }
}
