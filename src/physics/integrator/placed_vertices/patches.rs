//! The faces of a room and of its boxes in patches.

use glam::DVec3;

use super::panels::Panel;

/// Patches along either edge of a face of the room, and of a box: 2 where there are few boxes, 1 where there are very many.
const OF_ROOM: usize = 8;
const OF_BOX: f64 = 2.0;
/// Boxes up to which there are so many.
const FEW_BOXES: f64 = 32.0;

/// The patches of all faces, numbered through.
#[derive(Debug)]
pub struct Patches {
    /// In the order of their surfaces.
    pub faces: Vec<Patched>,
    /// Number of all patches.
    pub count: usize,
}

/// A face in patches.
#[derive(Debug)]
pub struct Patched {
    /// Unit normal toward the room.
    pub normal: DVec3,
    corner: DVec3,
    u: DVec3,
    v: DVec3,
    /// By which coordinates count patches along either edge, and what is added.
    along_u: (DVec3, f64),
    along_v: (DVec3, f64),
    /// Number of the last patch along either edge.
    last: f64,
    /// Numbers of its first patch, and of patches along an edge.
    first: u32,
    cells: u32,
}

impl Patches {
    /// `panels`: the faces of the room and of its boxes.
    pub fn new(panels: &[Panel]) -> Self {
        let faces_of_boxes = panels.iter().filter(|panel| panel.of_box.is_some()).count() as f64;
        let of_box = (OF_BOX / (faces_of_boxes / 6.0 / FEW_BOXES).max(1.0).sqrt()).ceil() as usize;
        let mut count = 0;
        let patched = |panel: &Panel| {
            let cells = if panel.of_box.is_some() { of_box } else { OF_ROOM };
            let first = count as u32;
            count += cells * cells;
            let (along, cells) = (cells as u32, cells as f64);
            let per = |edge: DVec3| {
                let per = edge * (cells / edge.length_squared());
                (per, -panel.corner.dot(per))
            };
            Patched {
                normal: panel.normal,
                corner: panel.corner,
                u: panel.u / cells,
                v: panel.v / cells,
                along_u: per(panel.u),
                along_v: per(panel.v),
                last: cells - 1.0,
                first,
                cells: along,
            }
        };
        let faces = panels.iter().map(patched).collect();
        Self { faces, count }
    }
}

impl Patched {
    /// The number of the patch at a point of the face.
    #[inline(always)]
    pub fn at(&self, position: DVec3) -> usize {
        let along = |(per, from): (DVec3, f64)| (position.dot(per) + from).max(0.0).min(self.last) as u32;
        (self.first + along(self.along_u) * self.cells + along(self.along_v)) as usize
    }

    /// Its patches in the order of their numbers: the corner and two edges of each.
    pub fn patches(&self) -> impl Iterator<Item = [DVec3; 3]> {
        let cells = self.cells as usize;
        (0..cells * cells).map(move |cell| {
            [self.corner + self.u * (cell / cells) as f64 + self.v * (cell % cells) as f64, self.u, self.v]
        })
    }
}
