//! Numbers of others with their sources: another program's runs, formulae fitted to measurements, makers' figures, and the
//! sizes of tubes that were measured. None of them is a measurement of a tube whose inputs are all stated.

/// Kind of a number of others, or of one of ours beside it; stands in every row.
#[derive(Clone, Copy)]
pub enum Kind {
    /// A measurement.
    Measured,
    /// A formula that its authors fitted to measurements.
    Fit,
    /// A maker's or a handbook's figure without its conditions.
    Maker,
    /// Another program.
    Program,
    /// This program's number for a measured tube whose values nobody here has read.
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

/// EnergyPlus 25.2.0, own runs: `DaylightingDevice:Tubular` under a flat roof, split-flux daylighting, weather with 20 W/m2
/// diffuse and no beam, for which its sky is the traditional overcast one. Room 4 x 4 x 3 m, tube 0.3556 m wide and 1.4 m
/// long in its middle, mirror 0.95, dome and diffuser T = 0.998. Reflectance of all surfaces, daylight factor in percent of
/// the floor below the diffuser.
pub const ENERGYPLUS_ROOMS: [(f64, f64); 4] = [(0.0, 0.25858), (0.2, 0.28141), (0.5, 0.34984), (0.8, 0.62234)];

/// The same runs' output "Diffuse Visible Transmittance" of the whole tube, by which the daylight factors are divided.
pub const ENERGYPLUS_DIFFUSE_TRANSMITTANCE: f64 = 0.73760;

/// A straight tube: aspect ratio (length over diameter) and reflectance.
pub type Tube = (f64, f64);

/// Aspect ratios of tubes 1 and 2 of EnergyPlus' example `DaylightingDeviceTubular.idf`: 1.4 and 2.2 m by 0.3556 m.
const EXAMPLE_1: f64 = 1.4 / 0.3556;
const EXAMPLE_2: f64 = 2.2 / 0.3556;

/// EnergyPlus 25.2.0, own runs, output "Tubular Daylighting Device Beam Visible Transmittance": the altitude of the sun in
/// degrees, two tubes with the same dome and diffuser, and the ratio of their beam transmittances.
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

/// Loss per bend in percent: what is published, and by whom.
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

/// Loss per metre in percent; the same handbook, which states neither diameter, mirror nor sky.
pub const LENGTH_LOSS: f64 = 3.0;

/// Flux in lm of a lamp of 60 W: from an assumed 700 to Appropedia's 890.
const LAMP_60_W: (f64, f64) = (700.0, 890.0);

/// Flux in lm of a lamp of 100 W, assumed.
const LAMP_100_W: f64 = 1350.0;

/// Sky of a maker's figure and the altitude of the sun in degrees, assumed where it is not stated.
#[derive(Clone, Copy)]
pub enum Light {
    /// Type 12 and its sun.
    Clear(f64),
    /// Type 1, the darker, and type 3, the brighter bound.
    Overcast(f64),
}

/// A maker's figure of the flux into a room, and the tube in bounds: its length in m, mirror and transmittance of the diffuser
/// that pass least and most, because none of them is stated.
pub struct MakersFlux {
    pub product: &'static str,
    pub diameter_m: f64,
    pub light: Light,
    pub least: [f64; 3],
    pub most: [f64; 3],
    /// Published flux in lm.
    pub flux_lm: (f64, f64),
    /// True where the figure says "more than".
    pub or_more: bool,
    pub source: &'static str,
}

/// Transmittance of all makers' domes, assumed.
pub const DOME_TRANSMITTANCE: f64 = 0.92;

const SILSOE: &str = "Silsoe Research Institute for Glidevale, news of 2006, in lamps of 60 W";
const HANDBOOK: &str = "the handbook, in lamps of 100 W";
const SUNILLUMINATION: &str = "sunillumination.com, mean at 100.7 klx of sunlight";

const SMALL: ([f64; 3], [f64; 3]) = ([2.0, 0.95, 0.5], [1.0, 0.98, 0.9]);
const LONG: ([f64; 3], [f64; 3]) = ([3.0, 0.95, 0.5], [1.0, 0.98, 0.9]);
const BRIGHT: ([f64; 3], [f64; 3]) = ([3.0, 0.98, 0.6], [1.2, 0.997, 0.9]);

/// All makers' figures.
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

/// Refractive index of acrylic and the least transmittance for light of a 3 mm sheet at normal incidence (International Journal
/// of Polymer Science, article 610132 of the year 2013, table 2: above 0.92).
pub const ACRYLIC: (f64, f64) = (1.49, 0.92);

/// A measured tube whose values nobody here has read: its sizes in m and the source.
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
