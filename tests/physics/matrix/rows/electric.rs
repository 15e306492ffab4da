//! Electric light.

use glam::DVec3;
use skyduct::optics::Surface;
use skyduct::scene::EstimateKind::{self, CellAverage, Point};
use skyduct::scene::{BoxObject, Luminaire, Scene};

use super::super::row::Row;
use crate::scenes::{electric_room, panel};

/// A panel that hangs in the room, one that emits upward, one on a wall, and a box between: everything casts shadows.
fn furnished(estimate: EstimateKind) -> Scene {
    let down = panel(DVec3::new(1.2, 1.4, 2.2), 0.8, 0.6, 3000.0);
    let up = Luminaire {
        corner: DVec3::new(2.4, 0.5, 1.1),
        edge_u: DVec3::new(0.6, 0.0, 0.2),
        edge_v: DVec3::new(0.0, 0.9, 0.0),
        luminance: [4000.0; 3],
    };
    let wall = Luminaire {
        corner: DVec3::new(0.0, 1.0, 0.6),
        edge_u: DVec3::Y * 0.5,
        edge_v: DVec3::Z * 0.5,
        luminance: [2000.0; 3],
    };
    let mut scene = electric_room(DVec3::new(4.0, 3.0, 2.5), 0.5, vec![down, up, wall], [6, 5], estimate);
    scene.room.boxes.push(BoxObject {
        size: DVec3::new(0.7, 0.5, 0.8),
        base: DVec3::new(1.5, 1.6, 0.0),
        rotation: 0.4,
        surface: Surface::diffuse([0.3; 3]),
    });
    scene
}

pub fn panels_points() -> Row {
    Row::new(furnished(Point))
}

pub fn panels_cells() -> Row {
    Row::new(furnished(CellAverage))
}

/// A millimetre below the panel that hangs, where points of it are rare and bright.
pub fn below_a_panel_cells() -> Row {
    let mut scene = furnished(CellAverage);
    scene.grids[0].height_m = 2.199;
    // few fixed points of a cell do not tell how much of it the panel covers
    Row::new(scene).left_out(&["ppm_per_point", "sppm_per_point"])
}
