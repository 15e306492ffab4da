//! Patches of an opening, all of equal area: the sectors of the rings of a disc, or the parts of a square in rows and columns.

use std::f64::consts::TAU;

use glam::DVec2;

use crate::geometry::turn::unit_vector;
use crate::scene::OpeningShape;

/// Number of rings of equal area with their own exitance, each divided into sectors whose differences points represent. The photon that
/// represents the rest adds noise of some percent of a vertex' light; more rings would cost more time.
pub const RINGS: usize = 4;
/// Number of sectors of a ring.
pub const SECTORS: usize = 6;
/// Number of cells of an opening.
pub const CELLS: usize = RINGS * SECTORS;

/// Numbers of rows and columns of the cells of a square.
const ROWS: usize = 4;
const COLUMNS: usize = CELLS / ROWS;

/// Returns the cell of a point away from the centre of an opening: cells of a disc are numbered by rings from the middle out, alternately
/// around them one way and back, so that consecutive cells touch; those of a square by rows, one way and back.
pub fn cell(shape: &OpeningShape, away: DVec2) -> usize {
    match *shape {
        OpeningShape::Disc { radius } => {
            let fraction = away.length_squared() / (radius * radius);
            let ring = ((fraction * RINGS as f64) as usize).min(RINGS - 1);
            let sector = sector(away);
            ring * SECTORS + [sector, SECTORS - 1 - sector][ring % 2]
        }
        OpeningShape::Square { side, along } => {
            let place = DVec2::new(along.dot(away), along.perp_dot(away)) / side + 0.5;
            let row = ((place.y * ROWS as f64) as usize).min(ROWS - 1);
            let column = ((place.x * COLUMNS as f64) as usize).min(COLUMNS - 1);
            row * COLUMNS + [column, COLUMNS - 1 - column][row % 2]
        }
    }
}

/// Returns the sector of a point away from the centre, counted around from -x over -y, without computing an angle and without branches,
/// which would be mispredicted.
fn sector(away: DVec2) -> usize {
    const { assert!(SECTORS == 6) };
    // of the three on either side of the x axis, from -x on
    let is_middle = usize::from(away.y.abs() >= SQRT_3 * away.x.abs());
    let along = [2 * usize::from(away.x >= 0.0), 1][is_middle];
    [SECTORS - 1 - along, along][usize::from(away.y < 0.0)]
}

/// Tangent of a sixth of a turn.
const SQRT_3: f64 = 1.732_050_807_568_877_2;

/// Returns the ring of a cell of a disc, and its sector counted around.
pub fn ring_and_sector(cell: usize) -> (usize, usize) {
    let (ring, sector) = (cell / SECTORS, cell % SECTORS);
    (ring, if ring.is_multiple_of(2) { sector } else { SECTORS - 1 - sector })
}

/// Returns the point that represents a cell's difference, in m from the centre.
pub fn middle(shape: &OpeningShape, cell: usize) -> DVec2 {
    within(shape, cell, [0.5; 2])
}

/// Returns a point of a cell, in m from the centre; uniform numbers in 0..1 give uniform points.
pub fn within(shape: &OpeningShape, cell: usize, [u, v]: [f64; 2]) -> DVec2 {
    match *shape {
        OpeningShape::Disc { radius } => {
            let (ring, sector) = ring_and_sector(cell);
            let angle = ((sector as f64 + v) / SECTORS as f64 - 0.5) * TAU;
            unit_vector(angle) * ((ring as f64 + u) / RINGS as f64).sqrt() * radius
        }
        OpeningShape::Square { .. } => {
            let (row, column) = (cell / COLUMNS, cell % COLUMNS);
            let column = [column, COLUMNS - 1 - column][row % 2];
            shape.point([(column as f64 + u) / COLUMNS as f64, (row as f64 + v) / ROWS as f64])
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Key, Replicate};

    /// Checks that cells have equal areas, and contain their middles and other points of theirs.
    #[test]
    fn cells_are_even() {
        for shape in
            [OpeningShape::Disc { radius: 0.127 }, OpeningShape::Square { side: 0.6, along: DVec2::new(0.6, -0.8) }]
        {
            for number in 0..CELLS {
                assert_eq!(cell(&shape, middle(&shape, number)), number);
                assert_eq!(cell(&shape, within(&shape, number, [0.9, 0.1])), number);
            }
            let mut counts = [0; CELLS];
            let (replicate, _) = Replicate::of(Key::new(1), 0);
            for k in 0..24_000 {
                let [u, v, ..] = replicate.point(k, 0);
                counts[cell(&shape, shape.point([u, v]))] += 1;
            }
            assert!(counts.iter().all(|count| (950..1050).contains(count)), "{counts:?}");
        }
    }
}
