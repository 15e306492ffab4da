//! Grids of illuminance as CSV text.

use std::fmt::Write;

/// Places of the sensors of a grid, in the order of their values.
#[derive(Clone, Copy)]
pub enum Sensors<'a> {
    /// Level sensors: number `j * x_m.len() + i` is at (`x_m[i]`, `y_m[j]`, `z_m`).
    Level {
        /// x of the columns in metres.
        x_m: &'a [f64],
        /// y of the rows in metres.
        y_m: &'a [f64],
        /// Height in metres.
        z_m: f64,
    },
    /// x, y and z in metres, and the unit vector that the sensor faces.
    Points(&'a [[f64; 6]]),
}

/// Fraction of a metre, of a unit normal and of a square metre to which places, directions and areas are rounded: it leaves no digits of rounding errors.
const PLACES_PER_METRE: f64 = 1e9;

/// Returns a table with semicolons between its columns and commas in its numbers, as spreadsheets read it where a comma is the decimal sign.
/// The names of its columns have neither points nor commas.
pub fn with_decimal_commas(table: &str) -> String {
    table.replace(',', ";").replace('.', ",")
}

/// Returns a grid as CSV, one line per sensor: its place in metres, the unit vector that it faces, the area of its cell that lies in the room,
/// and its values in the shortest digits that read back exactly.
///
/// Areas are empty without `areas_m2` (sensors at any points have no cells). A standard error that is not finite (fewer than two passes) is
/// left empty, and so is an illuminance that is not finite (sensor inside a solid, or outside the room).
pub fn grid(sensors: Sensors<'_>, areas_m2: &[f64], illuminance_lux: &[f64], standard_error_lux: &[f64]) -> String {
    let places: Vec<[f64; 6]> = match sensors {
        Sensors::Level { x_m, y_m, z_m } => {
            y_m.iter().flat_map(|y| x_m.iter().map(move |x| [*x, *y, z_m, 0.0, 0.0, 1.0])).collect()
        }
        Sensors::Points(points) => points.to_vec(),
    };
    let mut text = "x_m,y_m,z_m,normal_x,normal_y,normal_z,area_m2,illuminance_lux,standard_error_lux\n".to_owned();
    let rounded = |value: f64| (value * PLACES_PER_METRE).round() / PLACES_PER_METRE + 0.0;
    let values = illuminance_lux.iter().zip(standard_error_lux);
    for (number, (place, (illuminance, error))) in places.iter().zip(values).enumerate() {
        for column in place {
            // writing to a string cannot fail
            let _ = write!(text, "{},", rounded(*column));
        }
        let area = areas_m2.get(number).map_or(String::new(), |area| rounded(*area).to_string());
        let [illuminance, error] =
            [illuminance, error].map(|value| if value.is_finite() { value.to_string() } else { String::new() });
        let _ = writeln!(text, "{area},{illuminance},{error}");
    }
    text
}

#[cfg(test)]
mod tests {
    #[test]
    fn reads_back_exactly() {
        let values = [1.0 / 3.0, 2e-9, 5e9, 0.1 + 0.2];
        let errors = [0.5, f64::INFINITY, 0.0, 1e-3];
        let one = super::Sensors::Level { x_m: &[0.5], y_m: &[0.25], z_m: 0.85 };
        let none = super::grid(one, &[], &[f64::NAN], &[f64::INFINITY]);
        assert_eq!(none.lines().nth(1), Some("0.5,0.25,0.85,0,0,1,,,"));
        let turned = super::with_decimal_commas(&none);
        assert_eq!(
            turned,
            "x_m;y_m;z_m;normal_x;normal_y;normal_z;area_m2;illuminance_lux;standard_error_lux\n0,5;0,25;0,85;0;0;1;;;\n"
        );
        let rounded = super::Sensors::Level { x_m: &[1.319_999_999_999_999_8], y_m: &[0.1 + 0.2], z_m: 0.85 };
        assert_eq!(
            super::grid(rounded, &[0.1 + 0.2], &[7.0], &[0.1]).lines().nth(1),
            Some("1.32,0.3,0.85,0,0,1,0.3,7,0.1")
        );
        let points = super::grid(super::Sensors::Points(&[[1.0, 2.0, 3.0, 0.0, 1.0, 0.0]]), &[], &[7.0], &[0.1]);
        assert_eq!(points.lines().nth(1), Some("1,2,3,0,1,0,,7,0.1"));
        let level = super::Sensors::Level { x_m: &[0.5, 1.5], y_m: &[0.25, 0.75], z_m: 0.85 };
        let text = super::grid(level, &[], &values, &errors);
        let lines: Vec<Vec<&str>> = text.lines().skip(1).map(|line| line.split(',').collect()).collect();
        assert_eq!(lines.len(), 4);
        assert_eq!(lines[1][..3], ["1.5", "0.25", "0.85"]);
        assert_eq!(lines[1][8], "");
        for (line, value) in lines.iter().zip(values) {
            assert_eq!(line[7].parse::<f64>(), Ok(value));
        }
    }
}
