//! Formulas as they are printed, beside the forms that the program uses: what each gives where the first goes wrong.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec2, DVec3};
use skyduct::geometry::bvh::TriangleBvh;
use skyduct::geometry::cylinder::traverse;
use skyduct::geometry::disc::disc_irradiance;
use skyduct::geometry::lambert::quadrilateral_irradiance;
use skyduct::guide::transmittance::beam_transmission;
use skyduct::integrator::photon::chunks::MOST_CHUNK;
use skyduct::integrator::photon_map::progressive::PointStatistics;
use skyduct::optics::fresnel::fresnel;
use skyduct::sky::zenith::{ZenithFormula, zenith_luminance_cd_m2};
use skyduct::sky::{CieType, SkyDistribution, Sun, direction};
use skyduct::statistics::Moments;

/// One formula at one input.
pub struct Form {
    /// What is computed, and where the used form stands.
    pub what: &'static str,
    pub input: &'static str,
    /// The naive form, in words.
    pub naive_form: &'static str,
    pub used_form: &'static str,
    /// The true value: exact, or to more digits than f64 has, from sums and integrals in 40 digits.
    pub truth: f64,
    pub naive: f64,
    pub used: f64,
}

impl Form {
    /// Error of a value, relative to the true one, or absolute where that is 0.
    pub fn error(&self, value: f64) -> f64 {
        let scale = if self.truth == 0.0 { 1.0 } else { self.truth.abs() };
        (value - self.truth).abs() / scale
    }
}

/// Exponent of the smallest power of ten that is not below an error; errors below 1e-16 count as that.
pub fn exponent(error: f64) -> i32 {
    (-16..=0).find(|exponent| error <= 10f64.powi(*exponent)).unwrap_or(1)
}

fn cie(number: u8) -> CieType {
    CieType::new(number).unwrap()
}

/// Every form of the page, in its order.
pub fn all() -> Vec<Form> {
    vec![
        gradation(),
        night(),
        zenith(),
        corona(),
        solid_angle(),
        disc(),
        rectangle(),
        rule_of_points(),
        stepping(),
        pane(),
        total_reflection(),
        single_sum(),
        short_sum(),
        short_count(),
        whole_photons(),
        squares(),
        short_triangles(),
    ]
}

fn gradation() -> Form {
    let sky = SkyDistribution::new(cie(1), DVec3::Z);
    let gradation = |cos_zenith: f32| 1.0 + 4.0 * (-0.7 / cos_zenith).exp();
    Form {
        what: "gradation of the sky at the horizon over that at the zenith (`src/physics/sky/cie.rs`)",
        input: "type 1, Z = 90 degrees",
        naive_form: "1 + a exp(b / cos Z) in f32, where cos Z is -4e-8",
        used_form: "cos Z from the direction, f64; 1 where it is not positive",
        truth: 1.0 / (1.0 + 4.0 * (-0.7f64).exp()),
        naive: f64::from(gradation(std::f32::consts::FRAC_PI_2.cos()) / gradation(1.0)),
        used: sky.relative_luminance(DVec3::X),
    }
}

fn night() -> Form {
    let altitude = -5f64.to_radians();
    let sky = SkyDistribution::new(cie(12), direction(altitude, 0.0));
    let (sin, cos) = altitude.sin_cos();
    Form {
        what: "zenith luminance in kcd/m2 (`src/physics/sky/zenith.rs`)",
        input: "type 12, sun at -5 degrees",
        naive_form: "A sin g + 0.7 (Tv + 1) sin^C g / cos^D g + 0.04 Tv",
        used_form: "0 for a sun that is not above the horizon",
        truth: 0.0,
        naive: 3.3 * sin + 0.7 * 3.5 * sin.powf(4.43) / cos.powf(0.74) + 0.1,
        used: zenith_luminance_cd_m2(&sky, ZenithFormula::Turbidity { luminous_turbidity: 2.5 }, altitude) / 1000.0,
    }
}

fn zenith() -> Form {
    let sky = SkyDistribution::new(cie(12), DVec3::Z);
    Form {
        what: "zenith luminance in kcd/m2 (`src/physics/sky/zenith.rs`)",
        input: "type 12, sun at 90 degrees",
        naive_form: "the same",
        used_form: "above 75 degrees D sin g / sin 75 / I, with D at 75 degrees",
        // tests/reference/sky_zenith_above_75.csv, eight digits
        truth: reference_zenith(),
        naive: 3.3 + 0.7 * 3.5 / FRAC_PI_2.cos().powf(0.74) + 0.1,
        used: zenith_luminance_cd_m2(&sky, ZenithFormula::Turbidity { luminous_turbidity: 2.5 }, FRAC_PI_2) / 1000.0,
    }
}

fn reference_zenith() -> f64 {
    use crate::reference::{number, rows};
    let rows = rows("sky_zenith_above_75.csv");
    rows.iter().find(|row| row[0] == "12" && number(&row[1]) == 90.0).map(|row| number(&row[4])).unwrap()
}

fn corona() -> Form {
    // both at one height, so that the gradation is the same
    let sun = direction(0.6, 0.0);
    let chi = 1e-8f64;
    let azimuth = 2.0 * ((0.5 * chi).sin() / 0.6f64.cos()).asin();
    let view = direction(0.6, azimuth);
    let sky = SkyDistribution::new(cie(15), sun);
    let f = |chi: f64| 1.0 + 24.0 * ((-2.8 * chi).exp() - (-2.8 * FRAC_PI_2).exp()) + 0.15 * chi.cos().powi(2);
    Form {
        what: "loss of luminance 1e-8 rad beside the sun, 1 - f(chi) / f(0) (`src/physics/sky/cie.rs`)",
        input: "type 15, sun at 0.6 rad",
        naive_form: "chi as the arc cosine of the product of the vectors",
        used_form: "chi by atan2 of the cross product's length and the product",
        truth: 2.703_700_703_355_712_9e-8,
        naive: 1.0 - f(sun.dot(view).min(1.0).acos()) / f(0.0),
        used: 1.0 - sky.relative_luminance(view) / sky.relative_luminance(sun),
    }
}

fn solid_angle() -> Form {
    let half_angle = (959.63f32 / 3600.0).to_radians();
    Form {
        what: "solid angle of the sun's disc in sr (`src/physics/sky/sun.rs`)",
        input: "half-angle 959.63 arc seconds",
        naive_form: "2 pi (1 - cos) in f32",
        used_form: "4 pi sin^2 of a quarter of the disc's width, f64",
        truth: 6.799_961_531_994_676e-5,
        naive: f64::from(2.0 * std::f32::consts::PI * (1.0 - half_angle.cos())),
        used: Sun::solid_angle_sr(),
    }
}

fn disc() -> Form {
    let (r, h) = (0.0005f32, 100f32);
    let p = h * h - r * r;
    Form {
        what: "form factor of a disc on its axis (`src/physics/geometry/disc.rs`)",
        input: "r = 0.5 mm, 100 m below",
        naive_form: "(1 - P / W) / 2 in f32",
        used_form: "2 r^2 H^2 / (W (W + P))",
        truth: 2.499_999_999_937_5e-11,
        naive: f64::from(0.5 * (1.0 - p / (p * p + 4.0 * r * r * h * h).sqrt())),
        used: disc_irradiance(0.0005, 100.0, 0.0).vertical,
    }
}

fn rectangle() -> Form {
    let corners =
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| DVec3::new(x * 1e-4, y * 1e-4, 10.0));
    let mut sum = 0.0;
    for k in 0..4 {
        let (from, to) = (corners[k].normalize(), corners[(k + 1) % 4].normalize());
        let cross = from.cross(to);
        sum += from.dot(to).min(1.0).acos() * cross.z / cross.length();
    }
    Form {
        what: "irradiance of a rectangle of 1 cd/m2 (`src/physics/geometry/lambert.rs`)",
        input: "0.2 mm x 0.2 mm, 10 m above",
        naive_form: "edges' angles by arc cosines of unit vectors",
        used_form: "atan2, and cross products with the edge itself",
        truth: 3.999_999_999_466_666_7e-10,
        naive: 0.5 * sum,
        used: quadrilateral_irradiance(&corners, DVec3::ZERO, DVec3::Z),
    }
}

fn rule_of_points() -> Form {
    let (a, reflectance, points) = (4.0 * 30f64.to_radians().tan(), 0.95f64, 100_000u32);
    let value = |k: u32| {
        let s = f64::from(k) / f64::from(points);
        let n = (a / s).floor();
        s * s / (1.0 - s * s).sqrt() * reflectance.powf(n) * (1.0 - (1.0 - reflectance) * (a / s - n))
    };
    Form {
        what: "transmission of a tube (`src/physics/guide/transmittance.rs`)",
        input: "L/D = 4, 30 degrees from the axis, R = 0.95",
        naive_form: "100 000 even points of the integral over chords, which is infinite at its end",
        used_form: "the series of its pieces",
        truth: 0.861_997_309_980_97,
        naive: 4.0 / PI * (1..points).map(value).sum::<f64>() / f64::from(points),
        used: beam_transmission(4.0, 30f64.to_radians().tan(), 0.95),
    }
}

/// A ray that comes back to where it began.
fn stepping() -> Form {
    let radius = 0.25;
    let half_turn = 2.0 * PI / 5.0;
    let chord = 2.0 * radius * half_turn.sin();
    let from = DVec2::new(radius * half_turn.cos(), 0.0);
    let bounces = 1_000_000u32;
    let (mut p, mut d) = (from, DVec2::Y);
    for bounce in 0..=bounces {
        let half_b = p.dot(d);
        let wall = -half_b + (half_b * half_b - (p.length_squared() - radius * radius)).max(0.0).sqrt();
        if bounce == bounces {
            p += d * (0.5 * chord);
            break;
        }
        p += d * wall;
        let normal = p.normalize();
        d -= normal * 2.0 * d.dot(normal);
    }
    let direction = DVec3::new(0.0, f64::from(bounces) * chord, 1.0).normalize();
    let passage = traverse(radius, from.extend(0.0), direction, 1.0);
    let place = |p: DVec2| p.y.atan2(p.x);
    Form {
        what: "azimuth in rad of a ray after a million reflections that draw a pentagram (`src/physics/geometry/cylinder.rs`)",
        input: "r = 0.25 m, from the middle of a chord",
        naive_form: "from wall to wall, in a million steps",
        used_form: "one rotation by all turns together",
        truth: 0.0,
        naive: place(p),
        used: place(passage.position.truncate()),
    }
}

fn pane() -> Form {
    let (cos, n) = (0f64, 1f64);
    let beyond = (1.0 - (1.0 - cos * cos) / (n * n)).sqrt();
    let s = (cos - n * beyond) / (cos + n * beyond);
    Form {
        what: "reflectance of a face that is none (`src/physics/optics/fresnel.rs`)",
        input: "n = 1, 90 degrees",
        naive_form: "((cos - n cos') / (cos + n cos'))^2",
        used_form: "0 where the index does not change",
        truth: 0.0,
        naive: s * s,
        used: fresnel(cos, n)[0],
    }
}

fn total_reflection() -> Form {
    let (cos, n) = (60f64.to_radians().cos(), 1.0 / 1.49);
    let beyond = (1.0 - (1.0 - cos * cos) / (n * n)).sqrt();
    let s = (cos - n * beyond) / (cos + n * beyond);
    Form {
        what: "reflectance beyond the critical angle (`src/physics/optics/fresnel.rs`)",
        input: "from n = 1.49 into air, 60 degrees",
        naive_form: "the same, with the root of a negative number",
        used_form: "1 where the sine beyond is 1 or more",
        truth: 1.0,
        naive: s * s,
        used: fresnel(cos, n)[0],
    }
}

fn in_chunks(deposits: u64) -> f64 {
    // chunks of equally many deposits have equal sums
    let chunk = |deposits: u64| (0..deposits).fold(0.0, |sum, _| sum + 1e-6);
    let whole = chunk(MOST_CHUNK);
    let sum = (0..deposits / MOST_CHUNK).fold(0.0, |sum, _| sum + whole);
    sum + chunk(deposits % MOST_CHUNK)
}

fn single_sum() -> Form {
    let deposits = 100_000_000;
    let mut naive = 0.0;
    (0..deposits).for_each(|_| naive += 1e-6);
    Form {
        what: "sum of deposits in lm (`src/physics/integrator/photon/chunks.rs`)",
        input: "10^8 times 1e-6 lm",
        naive_form: "one sum in f64",
        used_form: "sums of 1024, added up",
        truth: 100.0,
        naive,
        used: in_chunks(deposits),
    }
}

fn short_sum() -> Form {
    let deposits = 100_000_000;
    let mut naive = 0f32;
    // what one more deposit does not change, all others do not change either
    while naive + 1e-6 > naive {
        naive += 1e-6;
    }
    Form {
        what: "sum of deposits in lm (`src/physics/integrator/photon/chunks.rs`)",
        input: "10^8 times 1e-6 lm",
        naive_form: "one sum in f32",
        used_form: "sums of 1024 in f64, added up",
        truth: 100.0,
        naive: f64::from(naive),
        used: in_chunks(deposits),
    }
}

fn short_count() -> Form {
    let mut counted = skyduct::estimate::Estimate { photons: 1 << 24, ..Default::default() };
    counted.push(Some(&skyduct::integrator::Pass { photons: 1, ..Default::default() }), None);
    Form {
        what: "number of photons (`src/physics/estimate/mod.rs`)",
        input: "16 777 216 and one more",
        naive_form: "a count in f32",
        used_form: "a count in u64",
        truth: 16_777_217.0,
        naive: f64::from(16_777_216f32 + 1.0),
        used: counted.photons as f64,
    }
}

fn whole_photons() -> Form {
    let (passes, alpha) = (10_000u32, 0.8);
    let (mut naive_squared, mut kept) = (1.0f64, 0u32);
    let mut point = PointStatistics::new(1.0);
    for _ in 0..passes {
        let all = f64::from(kept) + alpha;
        naive_squared *= all / (f64::from(kept) + 1.0);
        kept = all as u32;
        point.update(1.0, alpha);
    }
    Form {
        what: "gather radius over the first one (`src/physics/integrator/photon_map/progressive.rs`)",
        input: "10^4 passes of one photon each, alpha = 0.8",
        naive_form: "the kept photons N + alpha M as a whole number, which stays 0",
        used_form: "N in f64",
        // sqrt(Gamma(n + 1) Gamma(1 / alpha) / Gamma(n + 1 / alpha))
        truth: 0.301_062_836_461_338_73,
        naive: naive_squared.sqrt(),
        used: point.radius_m(),
    }
}

fn squares() -> Form {
    let values = (0..1000).map(|k| 1e9 + f64::from(k % 2));
    let mut moments = Moments::default();
    let (mut sum, mut squares) = (0.0, 0.0);
    for value in values {
        moments.push(value);
        (sum, squares) = (sum + value, squares + value * value);
    }
    Form {
        what: "sum of squared deviations (`src/physics/statistics/moments.rs`)",
        input: "1000 values, 1e9 and 1e9 + 1 by turns",
        naive_form: "sum of squares less the squared sum over n",
        used_form: "Welford's update",
        truth: 250.0,
        naive: squares - sum * sum / 1000.0,
        used: moments.m2,
    }
}

fn short_triangles() -> Form {
    let far = DVec3::new(1e6, -1e6, 1e6);
    let corners = [DVec3::new(0.127, -1.0, -1.0), DVec3::new(0.127, 1.0, -1.0), DVec3::new(0.127, 0.0, 1.0)];
    let bvh = TriangleBvh::new(&[corners.map(|corner| corner + far)]);
    let hit = bvh.nearest(far, DVec3::X, None).unwrap();
    Form {
        what: "distance in m to a triangle (`src/physics/geometry/bvh.rs`)",
        input: "0.127 m, 1000 km from the origin",
        naive_form: "corners in f32",
        used_form: "f32 around the mesh's middle for the tree, f64 for the hit",
        truth: 0.127,
        naive: f64::from((1e6 + 0.127) as f32 - 1e6f32),
        used: hit.distance,
    }
}
