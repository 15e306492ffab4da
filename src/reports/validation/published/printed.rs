//! Published numbers with their sources: another program's runs, formulae fitted to measurements, makers' figures, and the
//! sizes of measured tubes. None of them is a measurement of a tube whose inputs are all stated.

/// Kind of a published number, or of one of ours beside it; printed in every row.
#[derive(Clone, Copy)]
pub enum Kind {
    /// Measurement.
    Measured,
    /// Formula that its authors fitted to measurements.
    Fit,
    /// Figure of a maker or a handbook, without its conditions.
    Maker,
    /// Result of another program.
    Program,
    /// This program's number for a measured tube whose published values have not been read.
    Prediction,
}

impl Kind {
    pub fn label(self) -> String {
        match self {
            Self::Measured => "[measured]",
            Self::Fit => "[fit to measurements]",
            Self::Maker => "[maker]",
            Self::Program => "[program]",
            Self::Prediction => "[prediction]",
        }
        .to_owned()
    }
}

/// Daylight factors of EnergyPlus 25.2.0, own runs: reflectance of all surfaces, daylight factor in percent of the floor below
/// the diffuser. `DaylightingDevice:Tubular` under a flat roof, split-flux daylighting, weather with 20 W/m2 diffuse and no
/// beam, for which its sky is the traditional overcast one. Room 4 x 4 x 3 m, tube 0.3556 m wide and 1.4 m long in its middle,
/// mirror 0.95, dome and diffuser T = 0.998.
pub const ENERGYPLUS_ROOMS: [(f64, f64); 4] = [(0.0, 0.25858), (0.2, 0.28141), (0.5, 0.34984), (0.8, 0.62234)];

/// Diffuse transmittance of the whole tube in the runs of [`ENERGYPLUS_ROOMS`], by which the daylight factors are divided
/// (output "Diffuse Visible Transmittance").
pub const ENERGYPLUS_DIFFUSE_TRANSMITTANCE: f64 = 0.73760;

/// Straight tube: aspect ratio (length over diameter) and reflectance.
pub type Tube = (f64, f64);

/// Aspect ratios of tubes 1 and 2 of EnergyPlus' example `DaylightingDeviceTubular.idf`: 1.4 and 2.2 m by 0.3556 m.
const EXAMPLE_1: f64 = 1.4 / 0.3556;
const EXAMPLE_2: f64 = 2.2 / 0.3556;

/// Beam transmittances of EnergyPlus 25.2.0, own runs, output "Tubular Daylighting Device Beam Visible Transmittance": the
/// altitude of the sun in degrees, two tubes with the same dome and diffuser, and the ratio of their beam transmittances.
pub const ENERGYPLUS_BEAMS: [(f64, Tube, Tube, f64); 9] = [
    (24.993, (2.4, 0.90), (2.4, 0.995), 0.53363),
    (38.679, (2.4, 0.90), (2.4, 0.995), 0.68986),
    (71.409, (2.4, 0.90), (2.4, 0.995), 0.90425),
    (24.993, (2.4, 0.98), (2.4, 0.995), 0.90653),
    (38.679, (2.4, 0.98), (2.4, 0.995), 0.94403),
    (71.409, (2.4, 0.98), (2.4, 0.995), 0.98466),
    (24.993, (EXAMPLE_2, 0.95), (EXAMPLE_1, 0.95), 0.74605),
    (38.679, (EXAMPLE_2, 0.95), (EXAMPLE_1, 0.95), 0.84011),
    (71.409, (EXAMPLE_2, 0.95), (EXAMPLE_1, 0.95), 0.95305),
];

/// Published losses per bend in percent, with their kind and source.
pub const BEND_LOSS: [(f64, Kind, &str); 2] = [
    (
        8.0,
        Kind::Maker,
        "a handbook of building materials (northernarchitecture.us, \"Light pipes\"); angle, mirror, sky not stated",
    ),
    (
        20.0,
        Kind::Fit,
        "a bend of 30 degrees: Zhang 2002, as EnergyPlus' Engineering Reference quotes it; illuminances below pipes",
    ),
];

/// Published loss per metre in percent, from the handbook of [`BEND_LOSS`], which states neither diameter, mirror nor sky.
pub const LENGTH_LOSS: f64 = 3.0;

/// Bounds of the flux in lm of a lamp of 60 W: an assumed 700, and Appropedia's 890.
const LAMP_60_W: (f64, f64) = (700.0, 890.0);

/// Assumed flux in lm of a lamp of 100 W.
const LAMP_100_W: f64 = 1350.0;

/// Sky of a maker's figure with the altitude of the sun in degrees, assumed where it is not stated.
#[derive(Clone, Copy)]
pub enum Light {
    /// Type 12 with its sun.
    Clear(f64),
    /// Type 1 as the darker, and type 3 as the brighter bound.
    Overcast(f64),
}

/// Maker's figure of the flux into a room, with bounds of the tube, because its data are not stated: length in m, reflectance
/// of the mirror and transmittance of the diffuser that transmit least and most.
pub struct MakersFlux {
    pub product: &'static str,
    pub diameter_m: f64,
    pub light: Light,
    pub least: [f64; 3],
    pub most: [f64; 3],
    /// Bounds of the published flux in lm.
    pub flux_lm: (f64, f64),
    /// True if the published flux is a lower bound ("more than").
    pub or_more: bool,
    pub source: &'static str,
}

/// Assumed transmittance of all makers' domes.
pub const DOME_TRANSMITTANCE: f64 = 0.92;

const SILSOE: &str = "Silsoe Research Institute for Glidevale, news of 2006, in lamps of 60 W";
const HANDBOOK: &str = "the handbook, in lamps of 100 W";
const SUNILLUMINATION: &str = "sunillumination.com, mean at 100.7 klx of sunlight";

const SMALL: ([f64; 3], [f64; 3]) = ([2.0, 0.95, 0.5], [1.0, 0.98, 0.9]);
const LONG: ([f64; 3], [f64; 3]) = ([3.0, 0.95, 0.5], [1.0, 0.98, 0.9]);
const BRIGHT: ([f64; 3], [f64; 3]) = ([3.0, 0.98, 0.6], [1.2, 0.997, 0.9]);

/// Published figures of all makers.
pub const MAKERS: [MakersFlux; 9] = [
    flux("250 mm, clear summer day", 0.25, Light::Clear(60.0), SMALL, lamps(4.0), false, SILSOE),
    flux("530 mm, clear summer day", 0.53, Light::Clear(60.0), SMALL, lamps(8.0), true, SILSOE),
    flux("250 mm, overcast", 0.25, Light::Overcast(60.0), SMALL, lamps(1.0), true, SILSOE),
    flux("530 mm, overcast", 0.53, Light::Overcast(60.0), SMALL, lamps(2.0), true, SILSOE),
    flux(
        "330 mm, full summer sun",
        0.33,
        Light::Clear(60.0),
        LONG,
        (4.0 * LAMP_100_W, 4.0 * LAMP_100_W),
        false,
        HANDBOOK,
    ),
    flux("330 mm, winter overcast", 0.33, Light::Overcast(15.0), LONG, (LAMP_100_W, LAMP_100_W), false, HANDBOOK),
    flux(
        "21 inches, sun at 30 degrees",
        0.5334,
        Light::Clear(30.0),
        BRIGHT,
        (13_500.0, 13_500.0),
        false,
        SUNILLUMINATION,
    ),
    flux(
        "21 inches, sun at 45 degrees",
        0.5334,
        Light::Clear(45.0),
        BRIGHT,
        (13_500.0, 13_500.0),
        false,
        SUNILLUMINATION,
    ),
    flux(
        "21 inches, sun at 60 degrees",
        0.5334,
        Light::Clear(60.0),
        BRIGHT,
        (13_500.0, 13_500.0),
        false,
        SUNILLUMINATION,
    ),
];

const fn lamps(number: f64) -> (f64, f64) {
    (number * LAMP_60_W.0, number * LAMP_60_W.1)
}

const fn flux(
    product: &'static str,
    diameter_m: f64,
    light: Light,
    (least, most): ([f64; 3], [f64; 3]),
    flux_lm: (f64, f64),
    or_more: bool,
    source: &'static str,
) -> MakersFlux {
    MakersFlux { product, diameter_m, light, least, most, flux_lm, or_more, source }
}

/// Refractive index of acrylic, and the least transmittance for light of a 3 mm sheet at normal incidence (International
/// Journal of Polymer Science, article 610132 of the year 2013, table 2: above 0.92).
pub const ACRYLIC: (f64, f64) = (1.49, 0.92);

/// Measured tube whose published values have not been read: its sizes in m, and the source.
pub struct MeasuredTube {
    pub source: &'static str,
    pub diameters_m: &'static [f64],
    pub length_m: f64,
    pub reflectances: &'static [f64],
}

pub const OVERCAST_TUBE: MeasuredTube = MeasuredTube {
    source: "Bosova and Prokopova, artificial sky of Bratislava, open at both ends",
    diameters_m: &[0.53],
    length_m: 1.17,
    reflectances: &[0.85, 0.90, 0.92, 0.95, 0.97, 0.98, 0.99, 0.995],
};

pub const LAMP_TUBES: [MeasuredTube; 2] = [
    MeasuredTube {
        source: "Mahawan and Thongtha, Energies 14 (2021) 260, lamp",
        diameters_m: &[0.20, 0.25, 0.30],
        length_m: 0.5,
        reflectances: &[0.6, 0.7, 0.8, 0.9],
    },
    MeasuredTube {
        source: "Harrison, McCurdy and Cooke 1998",
        diameters_m: &[0.33],
        length_m: 1.83,
        reflectances: &[0.92, 0.95, 0.98],
    },
];
