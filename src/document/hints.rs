//! Hints in error messages: the name that a misspelled one resembles, and the unit in which a number would be within its range.

/// Least similarity (Jaro and Winkler, 0..1) at which a name is taken for a misspelling of another.
const LIKE: f64 = 0.82;

/// Returns the name of `known` that is most similar to `given`; `None` if none is similar enough.
pub fn did_you_mean<'a>(given: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let plain = |name: &str| name.to_ascii_lowercase().replace(['-', ' '], "_");
    let given = plain(given);
    let likeness = |name: &str| {
        let name = plain(name);
        // `lat` and `diameter` for `latitude_deg` and `diameter_m`
        let begins = given.len() >= 3 && name.starts_with(&given) || name.len() >= 3 && given.starts_with(&name);
        let like = strsim::jaro_winkler(&given, &name);
        if begins { 1.0 + like } else { like }
    };
    let likenesses = known.into_iter().map(|name| (likeness(name), name));
    let (like, name) = likenesses.max_by(|(a, _), (b, _)| a.total_cmp(b))?;
    (like >= LIKE).then_some(name)
}

/// Returns a hint to append to an error about an unknown name; `message` lists the valid names in backticks after "expected".
pub fn of_known_names(given: &str, message: &str) -> String {
    let known = message.split_once("expected").map_or("", |(_, known)| known);
    // between backticks is every other piece
    let names = known.split('`').skip(1).step_by(2);
    did_you_mean(given, names).map_or(String::new(), |name| format!("; did you mean `{name}`?"))
}

/// Returns a hint to append to an error about the length of a sensor's list of numbers, or an empty text.
pub fn of_sensor(pointer: &str, message: &str) -> String {
    let is_list = message.starts_with("invalid length") && pointer.contains("/points_m/");
    if is_list { ": x, y and z in m, and the direction in which the sensor faces".to_owned() } else { String::new() }
}

/// Names of fields whose values are ratios, which may have been given in percent.
const RATIOS: [&str; 14] = [
    "reflectance",
    "transmittance",
    "specular",
    "roughness",
    "lambertian_transmittance",
    "lambertian_reflectance",
    "clear_transmittance",
    "pipe_transmittance",
    "bend_factor",
    "relative_error",
    "view_relative_error",
    "confidence",
    "dv_ev",
    "alpha",
];

/// Least length that looks like millimetres, as a number; a thickness may have fewer.
const FEWEST_MM: f64 = 20.0;

/// Returns a hint to append to an error about an object of these sizes that may fit with a thousandth of its lengths, or an empty text.
pub fn of_lengths(sizes: impl IntoIterator<Item = f64>, thousandths_fit: bool) -> &'static str {
    let are_long = sizes.into_iter().any(|size| size >= FEWEST_MM);
    if are_long && thousandths_fit { "; its lengths look like millimetres" } else { "" }
}

/// Returns a hint to append to an error about a number at `pointer`: the value in another unit for which `fits` is true, or an
/// empty text.
pub fn of_number(pointer: &str, value: f64, fits: impl Fn(f64) -> bool) -> String {
    // for a channel or an axis, the name of the field that holds it
    let name = pointer.rsplit('/').find(|token| token.parse::<u32>().is_err()).unwrap_or("");
    let (unit, meant) = if name.ends_with("_m") && (value >= FEWEST_MM || name == "thickness_m") {
        ("millimetres", value / 1000.0)
    } else if RATIOS.contains(&name) && value > 1.0 {
        ("percent", value / 100.0)
    } else {
        return String::new();
    };
    if fits(meant) { format!("; {value} looks like {unit}: {meant}") } else { String::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_are_understood_and_other_names_are_not() {
        let of_place = ["latitude_deg", "longitude_deg", "elevation_m"];
        let of_tube = ["centre_m", "diameter_m", "reflectance", "segments", "collector", "diffuser", "mesh"];
        for (given, known, meant) in [
            ("lat", &of_place[..], Some("latitude_deg")),
            ("lon", &of_place, Some("longitude_deg")),
            ("Longitude", &of_place, Some("longitude_deg")),
            ("diameter", &of_tube, Some("diameter_m")),
            ("center_m", &of_tube, Some("centre_m")),
            ("colector", &of_tube, Some("collector")),
            ("reflectivity", &of_tube, Some("reflectance")),
            ("lenght", &["length_m", "tilt_deg"], Some("length_m")),
            ("weather", &of_tube, None),
            ("x", &of_tube, None),
            ("", &of_tube, None),
            ("anything", &[], None),
        ] {
            assert_eq!(did_you_mean(given, known.iter().copied()), meant, "{given}");
        }
        let message = "unknown field `lat`, expected one of `latitude_deg`, `longitude_deg`";
        assert_eq!(of_known_names("lat", message), "; did you mean `latitude_deg`?");
        assert_eq!(of_known_names("lat", "unknown field `lat`, there are no fields"), "");
    }

    #[test]
    fn a_box_of_a_metre_is_not_in_millimetres() {
        let fit = [[1000.0, 400.0, 720.0], [1.0, 0.4, 0.7]].map(|sizes| of_lengths(sizes, true));
        assert_eq!(fit, ["; its lengths look like millimetres", ""]);
        assert_eq!(of_lengths([1000.0], false), "");
    }

    #[test]
    fn only_lengths_and_ratios_have_other_units() {
        let up_to_one = |value: f64| value > 0.0 && value <= 1.0;
        assert_eq!(of_number("/a/diameter_m", 350.0, up_to_one), "; 350 looks like millimetres: 0.35");
        assert_eq!(of_number("/a/centre_m/0", 350.0, up_to_one), "; 350 looks like millimetres: 0.35");
        assert_eq!(of_number("/a/thickness_m", 4.0, up_to_one), "; 4 looks like millimetres: 0.004");
        assert_eq!(of_number("/a/reflectance/2", 98.0, up_to_one), "; 98 looks like percent: 0.98");
        for (pointer, value) in [
            ("/a/diameter_m", 2000.0),
            ("/a/diameter_m", -3.0),
            ("/a/margin_m", 3.0),
            ("/a/tilt_deg", 50.0),
            ("/a/reflectance", 980.0),
            ("", 2.0),
        ] {
            assert_eq!(of_number(pointer, value, up_to_one), "", "{pointer}");
        }
    }
}
