//! Matrix of a room: the illuminances of its sensors per lumen of each patch of its openings.
//!
//! It depends on the room only, not on sky, sun and what is above the openings. Multiplied by the lumens that pass the patches it gives the
//! light that comes through them, at any hour: a sum of daylight coefficients (Tregenza and Waters 1983).

use super::GridEstimate;

/// Illuminance in lx, or response in lx per lumen, with its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Response {
    /// Mean of the replicates.
    pub value: f64,
    /// Standard error of the mean.
    pub standard_error: f64,
}

/// Matrix of the sensors of a grid: the mean of the replicates of a job.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RoomMatrix {
    /// Responses of all sensors in lx per lumen of white light, for each patch, tube by tube.
    pub columns: Vec<Vec<Response>>,
}

impl RoomMatrix {
    /// Extracts the matrix from the estimate of a grid, for `patches` patches.
    pub fn of(grid: &GridEstimate, patches: usize) -> Self {
        let response = |part: &GridEstimate, sensor: usize| Response {
            value: part.illuminance_lux(sensor),
            standard_error: part.standard_error_lux(sensor),
        };
        let column = |part: &GridEstimate| (0..part.sensors.len()).map(|sensor| response(part, sensor)).collect();
        Self { columns: grid.companions.iter().take(patches).map(column).collect() }
    }

    /// Returns the illuminances in lx of all sensors when the patches send the given lumens; errors add up as if those of all patches were
    /// fully correlated.
    pub fn times(&self, lumens: &[f64]) -> Vec<Response> {
        let mut lit = vec![Response::default(); self.columns.first().map_or(0, Vec::len)];
        for (column, lumens) in self.columns.iter().zip(lumens) {
            for (lit, response) in lit.iter_mut().zip(column) {
                lit.value += lumens * response.value;
                lit.standard_error += lumens.abs() * response.standard_error;
            }
        }
        lit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two patches of 10 and 100 lm at two sensors, computed by hand.
    #[test]
    fn lumens_times_responses() {
        let response = |value: f64| Response { value, standard_error: 0.1 * value };
        let columns = vec![vec![response(1.0), response(2.0)], vec![response(0.5), response(0.0)]];
        let lit = RoomMatrix { columns }.times(&[10.0, 100.0]);
        assert_eq!(lit.iter().map(|lit| lit.value).collect::<Vec<_>>(), [60.0, 20.0]);
        assert!((lit[0].standard_error - 6.0).abs() < 1e-12 && (lit[1].standard_error - 2.0).abs() < 1e-12);
    }
}
