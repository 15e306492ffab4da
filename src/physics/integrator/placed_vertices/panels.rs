//! The rectangles of a room that reflect: its faces and those of its boxes.

use glam::DVec3;

use crate::scene::Face;
use crate::traceable::{SurfaceId, TraceableScene};

/// Cells along either edge of a face of the room, and of a box.
const CELLS_OF_ROOM: usize = 16;
pub const CELLS_OF_BOX: usize = 4;

/// Share of the room's diagonal within which things touch.
const NEAR: f64 = 1e-6;

/// A rectangle that reflects.
#[derive(Clone, Copy, Debug)]
pub struct Panel {
    pub corner: DVec3,
    pub u: DVec3,
    pub v: DVec3,
    /// Unit normal toward the room.
    pub normal: DVec3,
    /// Luminous reflectance.
    pub reflectance: f64,
    /// Cells along either edge.
    pub cells: usize,
    /// The box whose face it is.
    pub of_box: Option<usize>,
}

impl Panel {
    pub fn area_m2(&self) -> f64 {
        self.u.cross(self.v).length()
    }

    /// True if certainly neither objects nor luminaires touch it, and it is in the room.
    pub fn is_bare(&self, scene: &TraceableScene) -> bool {
        let corners = [DVec3::ZERO, self.u, self.v, self.u + self.v].map(|edge| self.corner + edge);
        let low = corners.into_iter().fold(DVec3::INFINITY, DVec3::min);
        let high = corners.into_iter().fold(DVec3::NEG_INFINITY, DVec3::max);
        let near = NEAR * scene.size.length();
        // a box may stand against a wall, or reach behind it; its sides may begin at the floor
        let stands = self.normal.z == 0.0;
        let is_within = || {
            let is_above = low.z > near || stands;
            is_above && low.truncate().min_element() > near && (scene.size - high).min_element() > near
        };
        (self.of_box.is_none() || is_within()) && scene.leaves_bare([low, high], near, self.of_box)
    }

    /// True if a point of it can send light down to a sensor at this height.
    pub fn can_reach(&self, height: f64) -> bool {
        let highest = [DVec3::ZERO, self.u, self.v, self.u + self.v];
        let highest = highest.iter().map(|edge| (self.corner + *edge).z).fold(f64::NEG_INFINITY, f64::max);
        self.reflectance > 0.0 && highest > height
    }
}

/// The surfaces of [`panels`], in their order.
pub fn surfaces(scene: &TraceableScene) -> impl Iterator<Item = SurfaceId> {
    let of_boxes = (0..scene.boxes.len()).flat_map(|index| (0..6).map(move |face| (index, face)));
    let of_boxes = of_boxes.map(|(index, face)| scene.numbering.box_face(index, face));
    Face::ALL.into_iter().map(SurfaceId::of_face).chain(of_boxes)
}

/// The faces of the room and of its boxes, openings included: they reflect, too, and may send light back.
pub fn panels(scene: &TraceableScene) -> Vec<Panel> {
    let luminous = |surface: SurfaceId| luminous(scene, surface);
    let of_face = |face: &Face| {
        let axis = *face as usize / 2;
        let far = *face as usize % 2 == 1;
        let edge = |axis: usize| DVec3::AXES[axis % 3] * scene.size[axis % 3];
        let normal = DVec3::AXES[axis] * if far { -1.0 } else { 1.0 };
        let corner = if far { edge(axis) } else { DVec3::ZERO };
        let reflectance = luminous(SurfaceId::of_face(*face));
        let cells = CELLS_OF_ROOM;
        Panel { corner, u: edge(axis + 1), v: edge(axis + 2), normal, reflectance, cells, of_box: None }
    };
    let of_box = |index: usize| {
        let object = &scene.boxes[index];
        let (low, high) = object.span();
        let outline = object.outline();
        let centre = (0.5 * (outline[0] + outline[2])).extend(0.5 * (low + high));
        (0..6).map(move |face| {
            let [corner, u, v] = object.face(face);
            let across = u.cross(v).normalize_or(DVec3::Z);
            let normal = if across.dot(corner - centre) < 0.0 { -across } else { across };
            let reflectance = luminous(scene.numbering.box_face(index, face));
            Panel { corner, u, v, normal, reflectance, cells: CELLS_OF_BOX, of_box: Some(index) }
        })
    };
    Face::ALL.iter().map(of_face).chain((0..scene.boxes.len()).flat_map(of_box)).collect()
}

/// Luminous reflectance of a surface.
pub fn luminous(scene: &TraceableScene, surface: SurfaceId) -> f64 {
    scene.optics(surface).map_or(0.0, |optics| optics.diffuse::<3>().luminance().clamp(0.0, 1.0))
}
