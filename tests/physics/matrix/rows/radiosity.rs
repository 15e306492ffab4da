//! Rooms from black to white under a disc, against radiosity with exact form factors.

use skyduct::scene::EstimateKind::{self, CellAverage, Point};

use super::super::row::{Row, exact};
use crate::scenes::{disc_room, radiosity};

fn room(case: &str, [floor, walls, ceiling, disc]: [f64; 4], estimate: EstimateKind) -> Row {
    let (lux, error) = radiosity(case, estimate);
    Row::new(disc_room(floor, walls, ceiling, disc, estimate)).given(exact(&lux, error), 0.0)
}

pub fn black_points() -> Row {
    room("S0", [0.0; 4], Point)
}

pub fn usual_with_black_disc_cells() -> Row {
    room("S1_", [0.2, 0.5, 0.7, 0.0], CellAverage)
}

pub fn usual_points() -> Row {
    room("S1r", [0.2, 0.5, 0.7, 0.7], Point)
}

pub fn grey_with_black_disc_points() -> Row {
    room("S2_", [0.5, 0.5, 0.5, 0.0], Point)
}

pub fn grey_cells() -> Row {
    room("S2r", [0.5; 4], CellAverage)
}

pub fn white_points() -> Row {
    room("S3r", [0.9; 4], Point)
}

pub fn white_cells() -> Row {
    room("S3r", [0.9; 4], CellAverage)
}
