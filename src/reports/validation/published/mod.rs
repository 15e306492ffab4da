//! Comparisons with published and measured numbers; each row states the kind of its number.

mod energyplus;
mod levels;
mod losses;
mod makers;
mod predictions;
mod printed;

use std::path::Path;

use super::error::ValidationError;
use crate::page::Section;

/// Compares our numbers with published ones; `reference` is the folder in which meshes of jobs would be.
pub fn section(reference: &Path) -> Result<Section, ValidationError> {
    let (rooms, rooms_table) = energyplus::rooms(reference)?;
    let (beams, beams_table) = energyplus::beams();
    let [black, reflecting] = rooms;
    Ok(Section {
        text: "**No built tube has been compared**: no published measurement of a tube that states all its inputs could be \
               read. What follows are another program's results, averages of measured skies, makers' figures and rules of \
               the trade; each row says what it is: [measured], [fit to measurements], [maker], [program] or [prediction]. \
               Only the comparisons with EnergyPlus are checks that must pass; all other rows are shown, whatever they say."
            .to_owned(),
        checks: vec![
            beams.check(0.1, "percent"),
            black.check(0.2, "percent (its aperture is a square, in elements)"),
            reflecting.check(3.0, "percent (split flux: one mean value for all points of a room)"),
        ],
        tables: vec![
            beams_table,
            rooms_table,
            levels::table(),
            losses::bends(),
            losses::metres(),
            makers::fluxes(),
            makers::acrylic(),
            predictions::overcast(),
            predictions::beams(),
        ],
        conclusion: CONCLUSION.to_owned(),
        ..Section::default()
    })
}

const CONCLUSION: &str = "What these rows say:\n\
\n\
- EnergyPlus' tube code was written independently. Ratios are compared, because dome, diffuser and the error of its sum over \
reflections (0.7 to 0.9 % low at every angle) cancel in them; they do not test the absolute transmission, which stands on the \
exact series.\n\
- The default level of the overcast types 1 and 16 is that of a dense overcast sky (Dv/Ev = 0.10), about 0.62 of the mean of \
measured ones above 20 degrees. Daylight factors do not depend on it, lux do: a job that takes the default is warned, and \
`diffuse_horizontal_illuminance_lux`, `dv_ev` or the sky `ies_overcast` say otherwise. At low sun the clear default is dimmer \
than the mean, too. Single moments are half to twice the mean.\n\
- 8 % per bend is what bends of 45 degrees cost. 20 % for 30 degrees is not explained: real elbows are short cones with seams, \
and that fit is of illuminances at points through a diffuser. 3 % per metre needs a mirror of 0.986 or better.\n\
- Makers' figures for clear days lie within bounds that are a factor of two wide, but for a mean that is asked of a sun at 30 \
degrees; of the three for overcast days one does, probably because their sky was brighter than the mean. That is no validation either way.\n\
- Predictions stand here so that whoever has the papers can compare without tuning. Best suited: Swift and Smith 1995 (beams), \
Samuhatananon et al. 2011 (bends), Callow 2003 (flux), and the tubes of the last tables. The ratio over two diameters \
or lengths needs no reflectance.";
