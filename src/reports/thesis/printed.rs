//! Numbers printed in the thesis (A. Schou, Investigation of light pipe simulation algorithms, DTU, IMM-B.Sc-2012-01).

/// Euclidean distance to the path-traced Cornell box, in the units of the thesis' renderer (section 6.1).
pub struct CornellBox {
    pub method: &'static str,
    pub iterations: u64,
    pub distance_lowest: f64,
    pub distance_highest: f64,
    /// Mean distance with the lamp, which the thesis' photon mapping did not show; `distance_mean` is without it.
    pub distance_mean_with_lamp: f64,
    pub distance_mean: f64,
    /// Mean difference of the red channel, the largest of the three.
    pub red_mean: f64,
}

/// Distances of section 6.1; iterations from figure 6.1.
pub const CORNELL_BOX: [CornellBox; 2] = [
    CornellBox {
        method: "PPM",
        iterations: 4242,
        distance_lowest: 3e-6,
        distance_highest: 2.3987,
        distance_mean_with_lamp: 0.3866,
        distance_mean: 0.0638,
        red_mean: 0.0501,
    },
    CornellBox {
        method: "SPPM",
        iterations: 4151,
        distance_lowest: 1.5e-5,
        distance_highest: 2.2823,
        distance_mean_with_lamp: 0.3859,
        distance_mean: 0.0629,
        red_mean: 0.0491,
    },
];

/// Illuminance of the floor under the light pipe in lx (section 6.2).
pub struct Illuminance {
    pub method: &'static str,
    /// Number of passes of 100 000 photons; `None` for HOLIGILM.
    pub iterations: Option<u64>,
    pub mean_lux: f64,
    pub highest_lux: f64,
    /// Pixel of the highest value; `None` for HOLIGILM, where it is "right under the light pipe".
    pub highest_at: Option<[u32; 2]>,
}

impl Illuminance {
    /// Returns the mean illuminance as a multiple of HOLIGILM's.
    pub fn excess(&self) -> f64 {
        self.mean_lux / HOLIGILM.mean_lux
    }
}

pub const PPM: Illuminance = Illuminance {
    method: "PPM",
    iterations: Some(200),
    mean_lux: 34.9053,
    highest_lux: 153.9830,
    highest_at: Some([254, 308]),
};

pub const SPPM: Illuminance = Illuminance {
    method: "SPPM",
    iterations: Some(209),
    mean_lux: 35.4292,
    highest_lux: 161.0490,
    highest_at: Some([139, 254]),
};

pub const HOLIGILM: Illuminance =
    Illuminance { method: "HOLIGILM", iterations: None, mean_lux: 29.7978, highest_lux: 40.2, highest_at: None };

/// Settings of both methods (section 6.3): photons per pass, alpha, initial radius of 0.3 inch in metres.
pub const PHOTONS_PER_PASS: u64 = 100_000;
pub const ALPHA: f64 = 0.8;
pub const INITIAL_RADIUS_M: f64 = 0.3 * INCH_M;

/// Photon passes of the illuminance pictures (section 6.2).
pub const ILLUMINANCE_PASSES: u64 = 200;

/// Upper bound of the colour scale of the illuminance pictures (figures 6.4 and 6.5).
pub const ILLUMINANCE_BOUND_LUX: f64 = 100.0;

/// Passes of the pictures of figures 6.7 and 6.8.
pub const PICTURED_PASSES: [u64; 6] = [1, 4, 16, 64, 256, 1024];

pub const INCH_M: f64 = 0.0254;
