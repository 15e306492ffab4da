//! Grids of illuminance as CSV text.

use std::fmt::Write;

/// Returns a grid as CSV, one line per sensor: `x_m,y_m,z_m,illuminance_lux,standard_error_lux`, in the shortest digits that read back
/// exactly.
///
/// Sensor `j * x_m.len() + i` is at (`x_m[i]`, `y_m[j]`, `z_m`); a standard error that is not finite (fewer than two passes) is left empty,
/// and so is an illuminance that is not finite (sensor inside a solid).
pub fn grid(x_m: &[f64], y_m: &[f64], z_m: f64, illuminance_lux: &[f64], standard_error_lux: &[f64]) -> String {
    let mut text = "x_m,y_m,z_m,illuminance_lux,standard_error_lux\n".to_owned();
    let places = y_m.iter().flat_map(|y| x_m.iter().map(move |x| (x, y)));
    for (((x, y), illuminance), error) in places.zip(illuminance_lux).zip(standard_error_lux) {
        let [illuminance, error] =
            [illuminance, error].map(|value| if value.is_finite() { value.to_string() } else { String::new() });
        // writing to a string cannot fail
        let _ = writeln!(text, "{x},{y},{z_m},{illuminance},{error}");
    }
    text
}

#[cfg(test)]
mod tests {
    #[test]
    fn reads_back_exactly() {
        let values = [1.0 / 3.0, 2e-9, 5e9, 0.1 + 0.2];
        let errors = [0.5, f64::INFINITY, 0.0, 1e-3];
        let none = super::grid(&[0.5], &[0.25], 0.85, &[f64::NAN], &[f64::INFINITY]);
        assert_eq!(none.lines().nth(1), Some("0.5,0.25,0.85,,"));
        let text = super::grid(&[0.5, 1.5], &[0.25, 0.75], 0.85, &values, &errors);
        let lines: Vec<Vec<&str>> = text.lines().skip(1).map(|line| line.split(',').collect()).collect();
        assert_eq!(lines.len(), 4);
        assert_eq!(lines[1][..3], ["1.5", "0.25", "0.85"]);
        assert_eq!(lines[1][4], "");
        for (line, value) in lines.iter().zip(values) {
            assert_eq!(line[3].parse::<f64>(), Ok(value));
        }
    }
}
