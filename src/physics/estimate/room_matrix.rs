//! The matrix of a room: what its sensors get per lumen of each patch of its openings.
//!
//! It follows from the room alone, without sky, sun and what is above the openings. Times the lumens that these send through the patches it is
//! the light that comes by way of the patches, at any hour: a sum of daylight coefficients (Tregenza and Waters 1983).

use super::GridEstimate;

/// A value in lx, or lx per lumen, with its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Response {
    /// The mean of the replicates.
    pub value: f64,
    /// Its standard error.
    pub standard_error: f64,
}

/// The matrix of the sensors of a grid: the mean of the replicates of a job.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RoomMatrix {
    /// For each patch, tube by tube, the responses of all sensors in lx per lumen of white light.
    pub columns: Vec<Vec<Response>>,
}

impl RoomMatrix {
    /// The matrix of a grid with so many patches above it.
    pub fn of(grid: &GridEstimate, patches: usize) -> Self {
        let response = |part: &GridEstimate, sensor: usize| Response {
            value: part.illuminance_lux(sensor),
            standard_error: part.standard_error_lux(sensor),
        };
        let column = |part: &GridEstimate| (0..part.sensors.len()).map(|sensor| response(part, sensor)).collect();
        Self { columns: grid.beside.iter().take(patches).map(column).collect() }
    }

    /// Illuminances in lx of all sensors where so many lumens leave the patches; their errors as if those of all patches went together.
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

    /// Two patches of 10 and 100 lm at two sensors, by hand.
    #[test]
    fn lumens_times_responses() {
        let response = |value: f64| Response { value, standard_error: 0.1 * value };
        let columns = vec![vec![response(1.0), response(2.0)], vec![response(0.5), response(0.0)]];
        let lit = RoomMatrix { columns }.times(&[10.0, 100.0]);
        assert_eq!(lit.iter().map(|lit| lit.value).collect::<Vec<_>>(), [60.0, 20.0]);
        assert!((lit[0].standard_error - 6.0).abs() < 1e-12 && (lit[1].standard_error - 2.0).abs() < 1e-12);
    }
}
