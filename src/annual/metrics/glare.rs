//! Luminance of Lambertian closures over a year, by which they may glare.

use std::f64::consts::PI;

use crate::response::TubeRecord;

/// Luminances in cd/m2 whose hours are counted.
pub const LIMITS_CD_M2: [f64; 4] = [6000.0, 7000.0, 10_000.0, 20_000.0];

/// Luminance of a tube's closure over a year.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClosureLuminance {
    /// Occupied hours with a luminance above each of [`LIMITS_CD_M2`].
    pub hours_above: [f64; LIMITS_CD_M2.len()],
    /// Largest luminance of an occupied record in cd/m2.
    pub largest_cd_m2: f64,
}

impl ClosureLuminance {
    /// Counts occupied records of `hours` each, for a closure of `radius` m that sends these lumens in the lit records with these numbers:
    /// L = flux / (pi A).
    pub fn new(lights: &[TubeRecord], records: &[usize], occupied: &[bool], radius: f64, hours: f64) -> Self {
        let mut found = Self::default();
        let area = PI * radius * radius;
        for (light, record) in lights.iter().zip(records) {
            if occupied.get(*record) != Some(&true) {
                continue;
            }
            let luminance = light.lumens / (PI * area);
            found.largest_cd_m2 = found.largest_cd_m2.max(luminance);
            for (above, limit) in found.hours_above.iter_mut().zip(LIMITS_CD_M2) {
                *above += if luminance > limit { hours } else { 0.0 };
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bright_occupied_records_are_counted() {
        let radius = 0.2;
        let lights = [5000.0, 7000.0, 7001.0, 30_000.0].map(|luminance| TubeRecord {
            lumens: luminance * PI * PI * radius * radius * (1.0 + 1e-12),
            ..TubeRecord::default()
        });
        let occupied = [true, true, true, false, true];
        let found = ClosureLuminance::new(&lights[..3], &[0, 1, 4], &occupied, radius, 0.5);
        assert_eq!(found.hours_above, [1.0, 1.0, 0.0, 0.0]);
        let unoccupied = ClosureLuminance::new(&lights[3..], &[3], &occupied, radius, 1.0);
        assert_eq!(unoccupied, ClosureLuminance::default());
    }
}
