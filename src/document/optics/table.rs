//! Check of tables by an angle.

use std::ops::RangeInclusive;

use crate::document::errors::Checks;

/// Checks that the angles of a table ascend from 0 to 90 degrees and that their number is within `bounds`. Adds one fault at
/// most; true if there is none.
pub(crate) fn check_angles(
    pointer: &str,
    angles_deg: &[f64],
    bounds: &RangeInclusive<usize>,
    checks: &mut Checks,
) -> bool {
    let rows = angles_deg.len();
    if !bounds.contains(&rows) {
        let (least, most) = (bounds.start(), bounds.end());
        checks.refuse(pointer, format!("must have {least}..{most} angles, but has {rows}"));
        return false;
    }
    if let Some(index) = (1..rows).find(|index| angles_deg[*index - 1] >= angles_deg[*index]) {
        checks.refuse(format!("{pointer}/{index}"), "must be larger than the angle before it");
        return false;
    }
    for (index, end) in [(0, 0.0), (rows - 1, 90.0)] {
        if angles_deg[index] != end {
            let detail =
                format!("must be {end}, because the angles run from 0 to 90 degrees, but is {}", angles_deg[index]);
            checks.refuse(format!("{pointer}/{index}"), detail);
            return false;
        }
    }
    true
}
