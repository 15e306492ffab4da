//! The faces of a room and of its boxes in patches.

use glam::DVec3;

use crate::integrator::placed_vertices::panels::Panel;

/// Patches along either edge of a face of the room.
const OF_ROOM: usize = 16;
/// Boxes up to which their patches are no larger than those of the room, about; of more boxes they are larger, so that there are not more
/// of them, and where there are so many boxes, each face is one.
const FEW_BOXES: f64 = 32.0;
const MANY_BOXES: f64 = 128.0;

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
    last: [f64; 2],
    /// Number of its first patch, and of patches along either edge.
    first: u32,
    cells: [u32; 2],
}

impl Patches {
    /// `panels`: the faces of the room and of its boxes.
    pub fn new(panels: &[Panel]) -> Self {
        let of_boxes = panels.iter().filter(|panel| panel.of_box.is_some());
        let boxes = of_boxes.count() as f64 / 6.0;
        let of_room = panels.iter().filter(|panel| panel.of_box.is_none());
        let (edges, rooms_faces) = of_room
            .fold((0.0, 0.0), |(edges, faces), panel| (edges + panel.u.length() + panel.v.length(), faces + 2.0));
        let edge = edges / (rooms_faces * OF_ROOM as f64) * (boxes / FEW_BOXES).max(1.0).sqrt();
        let along = |panel: &Panel, side: DVec3| match panel.of_box {
            None => OF_ROOM,
            Some(_) if boxes > MANY_BOXES => 1,
            Some(_) => (side.length() / edge).round().clamp(1.0, OF_ROOM as f64) as usize,
        };
        let mut count = 0;
        let patched = |panel: &Panel| {
            let cells = [along(panel, panel.u), along(panel, panel.v)];
            let first = count as u32;
            count += cells[0] * cells[1];
            let per = |edge: DVec3, cells: usize| {
                let per = edge * (cells as f64 / edge.length_squared());
                (per, -panel.corner.dot(per))
            };
            Patched {
                normal: panel.normal,
                corner: panel.corner,
                u: panel.u / cells[0] as f64,
                v: panel.v / cells[1] as f64,
                along_u: per(panel.u, cells[0]),
                along_v: per(panel.v, cells[1]),
                last: cells.map(|cells| cells as f64 - 1.0),
                first,
                cells: cells.map(|cells| cells as u32),
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
        let along = |(per, from): (DVec3, f64), last: f64| (position.dot(per) + from).max(0.0).min(last) as u32;
        let (row, column) = (along(self.along_u, self.last[0]), along(self.along_v, self.last[1]));
        (self.first + row * self.cells[1] + column) as usize
    }

    /// True if all of it faces away from a disc of `radius` around `centre` in the ceiling.
    pub fn faces_away(&self, centre: DVec3, radius: f64) -> bool {
        self.normal.dot(centre - self.corner) + radius * self.normal.truncate().length() <= 0.0
    }

    /// Number of its patches.
    pub fn count(&self) -> usize {
        (self.cells[0] * self.cells[1]) as usize
    }

    /// Its patches in the order of their numbers: the corner and two edges of each.
    pub fn patches(&self) -> impl Iterator<Item = [DVec3; 3]> {
        let columns = self.cells[1] as usize;
        (0..self.count()).map(move |cell| {
            [self.corner + self.u * (cell / columns) as f64 + self.v * (cell % columns) as f64, self.u, self.v]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::placed_vertices::panels::Panel;

    /// Each point lies in the patch that it is found in.
    #[test]
    fn patches_hold_their_points() {
        let panel = |corner: DVec3, u: DVec3, v: DVec3, of_box: Option<usize>| {
            let normal = u.cross(v).normalize();
            Panel { corner, u, v, normal, reflectance: 0.5, cells: 4, of_box }
        };
        let panels = [
            panel(DVec3::ZERO, DVec3::X * 3.0, DVec3::Y * 2.0, None),
            panel(DVec3::new(1.0, 0.5, 0.0), DVec3::new(0.3, 0.4, 0.0), DVec3::Z, Some(0)),
        ];
        let patches = Patches::new(&panels);
        // edges of the room's face are 2.5 m on average
        assert_eq!(patches.count, OF_ROOM * OF_ROOM + 3 * 6);
        let corners = patches.faces.iter().flat_map(|face| face.patches().map(move |of| (face, of)));
        for (number, (face, [corner, u, v])) in corners.enumerate() {
            for (s, t) in [(0.01, 0.01), (0.5, 0.5), (0.99, 0.01)] {
                assert_eq!(face.at(corner + u * s + v * t), number);
            }
        }
    }
}
