//! One harness for everything that scatters light, and for all warps: white furnace, reciprocity, chi-squared.
//!
//! The tests of one family share a false-alarm rate of 1e-4 (Sidak): each of n comparisons has 1 - (1 - 1e-4)^(1/n).

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;
use skyduct::optics::reflection::Lobes;
use skyduct::optics::{
    Closure, Diffuser, Glossy, Kind, MeasuredDiffuser, Oriented, Scatter, Scatterer, SheetSide, Spectrum, Specular,
    Surface, SurfaceOptics, Travel,
};
use skyduct::sampling::{Key, PathRandom, PathSamples, warp};
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

const FALSE_ALARMS: f64 = 1e-4;

fn rate_of_one(comparisons: usize) -> f64 {
    1.0 - (1.0 - FALSE_ALARMS).powf(1.0 / comparisons as f64)
}

/// Everything that scatters.
struct Things {
    surfaces: Vec<(String, SurfaceOptics)>,
    lobes: Vec<(String, Glossy)>,
    diffusers: Vec<(String, Diffuser, bool)>,
}

/// Something that scatters, the unit normal of the side on which it does, and whether it is reciprocal.
struct Thing<'a> {
    name: &'a str,
    scatterer: Scatterer<'a>,
    normal: DVec3,
    reciprocal: bool,
    sides: &'static [SheetSide],
}

impl Things {
    fn new() -> Self {
        let surface = |diffuse: [f64; 3], specular: Option<([f64; 3], f64)>| {
            let specular = specular.map(|(reflectance, roughness)| Specular { reflectance, roughness });
            Lobes::default().compile(&Surface { reflectance: diffuse, specular })
        };
        let mut surfaces = vec![("lambertian".to_owned(), surface([0.7, 0.5, 0.2], None))];
        surfaces.push(("mirror".to_owned(), surface([0.0; 3], Some(([0.9; 3], 0.0)))));
        surfaces.push(("diffuse mirror".to_owned(), surface([0.3, 0.2, 0.1], Some(([0.4, 0.6, 0.1], 0.0)))));
        for roughness in [0.3, 0.6, 1.0] {
            let optics = surface([0.3, 0.2, 0.1], Some(([0.4, 0.6, 0.1], roughness)));
            surfaces.push((format!("gloss of roughness {roughness}"), optics));
        }
        let lobes = [0.35, 0.8].map(|roughness| (format!("lobe of {roughness}"), Glossy::new(roughness))).to_vec();
        // symmetric tables are reciprocal, the others are as a goniophotometer may give them
        let angles: Vec<f64> = [0.0, 20.0, 45.0, 70.0, 90.0f64].iter().map(|angle| angle.to_radians()).collect();
        let symmetric: Vec<Vec<f64>> =
            (0..5).map(|i| (0..5).map(|j| 0.2 - 0.01 * (i + j) as f64 + 0.02 * (i * j % 3) as f64).collect()).collect();
        let peak: Vec<Vec<f64>> = (0..5).map(|i| vec![0.9 - 0.15 * f64::from(i), 0.3, 0.1, 0.0, 0.05]).collect();
        let weak = vec![vec![0.03, 0.02, 0.02, 0.05, 0.1]; 5];
        let table = |btdf: &[Vec<f64>], brdf: Option<&[Vec<f64>]>| {
            Diffuser::Measured(MeasuredDiffuser::new(&angles, &angles, btdf, brdf).unwrap().into())
        };
        let half: Vec<Vec<f64>> = symmetric.iter().map(|row| row.iter().map(|value| 0.4 * value).collect()).collect();
        let diffusers = vec![
            ("open".to_owned(), Diffuser::Open, true),
            ("clear".to_owned(), Diffuser::Clear { transmittance: [0.9, 0.8, 0.7] }, true),
            (
                "even sheet".to_owned(),
                Diffuser::Lambertian { transmittance: [0.6, 0.5, 0.4], reflectance: [0.2, 0.3, 0.4] },
                true,
            ),
            ("symmetric table".to_owned(), table(&symmetric, Some(&half)), true),
            ("peaked table".to_owned(), table(&peak, Some(&weak)), false),
            ("table without reflection".to_owned(), table(&peak, None), false),
        ];
        Self { surfaces, lobes, diffusers }
    }

    fn all(&self) -> Vec<Thing<'_>> {
        let tilted = DVec3::new(0.3, -0.5, 0.8).normalize();
        let same: &[SheetSide] = &[SheetSide::Same];
        let mut all = vec![Thing {
            name: "sensor",
            scatterer: Scatterer::Sensor(skyduct::optics::scatterer::CosineSensor { normal: DVec3::Z }),
            normal: DVec3::Z,
            reciprocal: true,
            sides: same,
        }];
        for (name, optics) in &self.surfaces {
            let scatterer = Scatterer::Surface(Oriented { optics, normal: tilted });
            all.push(Thing { name, scatterer, normal: tilted, reciprocal: true, sides: same });
        }
        for (name, optics) in &self.lobes {
            let scatterer = Scatterer::Lobe(Oriented { optics, normal: tilted });
            all.push(Thing { name, scatterer, normal: tilted, reciprocal: true, sides: same });
        }
        for (name, diffuser, reciprocal) in &self.diffusers {
            for normal in [DVec3::Z, DVec3::NEG_Z] {
                let closure: Closure<'_> = diffuser.at(0.1);
                let scatterer = Scatterer::Closure(closure);
                let sides = &[SheetSide::Same, SheetSide::Other];
                all.push(Thing { name, scatterer, normal, reciprocal: *reciprocal, sides });
            }
        }
        all
    }
}

impl Thing<'_> {
    fn is_sensor(&self) -> bool {
        self.name == "sensor"
    }

    /// A unit vector on the side of the normal, at an angle to it.
    fn from(&self, angle: f64) -> DVec3 {
        warp::around(self.normal, DVec3::new(angle.sin() * 0.6, angle.sin() * 0.8, angle.cos()))
    }

    /// Axis of the hemisphere of a side, seen from above the normal.
    fn axis(&self, side: SheetSide) -> DVec3 {
        if side == SheetSide::Same { self.normal } else { -self.normal }
    }
}

const TRAVELS: [Travel; 2] = [Travel::WithLight, Travel::AgainstLight];
const ANGLES: [f64; 4] = [0.0, 0.5, 1.1, 1.5];

/// Weights of samples add up to the albedo: nothing is made or lost, whether the kinds are counted together or apart.
#[test]
fn white_furnaces_stay_white() {
    let things = Things::new();
    let all = things.all();
    let comparisons = all.iter().map(|thing| thing.sides.len()).sum::<usize>() * ANGLES.len() * 2 * 2 * 3;
    let limit = Normal::standard().inverse_cdf(1.0 - 0.5 * rate_of_one(comparisons));
    for (number, thing) in all.iter().enumerate() {
        for travel in TRAVELS {
            if travel == Travel::AgainstLight && !thing.reciprocal {
                continue;
            }
            for (at, angle) in ANGLES.iter().enumerate() {
                for side in thing.sides {
                    let from = thing.from(*angle);
                    let key = Key::new(5).child(number as u64).child(at as u64);
                    let count = 20_000;
                    // of the samples, and of those of surfaces that count the kinds apart
                    let mut sums = [[[0.0; 2]; 3]; 2];
                    for index in 0..count {
                        // pseudo-random, so that a standard error is known
                        let mut samples = PathSamples::with_pairs(key, index, 0);
                        let sample: Option<skyduct::optics::Scattered<3>> =
                            thing.scatterer.sample(travel, from, *side, &mut samples);
                        if let Scatterer::Surface(surface) = &thing.scatterer {
                            let mut apart = PathSamples::with_pairs(key.child(1), index, 0);
                            if let Some((_, _, weight)) = surface.sample_apart::<3>(from, &mut apart) {
                                add(&mut sums[1], weight);
                            }
                        }
                        let Some(sample) = sample else { continue };
                        assert!(sample.pdf > 0.0 && (sample.toward.length() - 1.0).abs() < 1e-9, "{}", thing.name);
                        assert!(sample.toward.dot(thing.axis(*side)) > 0.0, "{}", thing.name);
                        add(&mut sums[0], sample.weight);
                    }
                    let albedo: Spectrum<3> = thing.scatterer.albedo(from, *side);
                    let counted = if matches!(thing.scatterer, Scatterer::Surface(_)) { 2 } else { 1 };
                    for sums in &sums[..counted] {
                        for ([sum, squares], truth) in sums.iter().copied().zip(albedo.0) {
                            let n = count as f64;
                            let mean = sum / n;
                            let error = ((squares / n - mean * mean).max(0.0) / n).sqrt();
                            // tabulated lobes lose up to 2e-4
                            let known = limit * error + 2e-4 * truth + 1e-9;
                            assert!(
                                (mean - truth).abs() <= known,
                                "{} {travel:?} {angle} {side:?}: {mean} +- {error}, albedo {truth}",
                                thing.name
                            );
                        }
                    }
                }
            }
        }
    }
}

/// Adds a weight and its square to the sums of each channel.
fn add(sums: &mut [[f64; 2]; 3], weight: Spectrum<3>) {
    for (sum, value) in sums.iter_mut().zip(weight.0) {
        *sum = [sum[0] + value, sum[1] + value * value];
    }
}

/// BSDF of light from `from` to `toward`.
fn bsdf(thing: &Thing<'_>, travel: Travel, from: DVec3, toward: DVec3) -> f64 {
    let value: Spectrum<3> = thing.scatterer.value(travel, from, toward);
    value.luminance() / toward.dot(thing.normal).abs()
}

/// A path against the light sees what one with the light sees the other way round; what is reciprocal, either way.
#[test]
fn light_and_eye_see_the_same_bsdf() {
    let things = Things::new();
    let mut random = PathRandom::new(Key::new(8));
    for thing in things.all().iter().filter(|thing| !thing.is_sensor()) {
        for _ in 0..200 {
            let a = warp::around(thing.normal, warp::cosine_hemisphere(random.uniform2()));
            let side = thing.sides[usize::from(random.uniform() < 0.5) % thing.sides.len()];
            let b = warp::around(thing.axis(side), warp::cosine_hemisphere(random.uniform2()));
            let light = bsdf(thing, Travel::WithLight, a, b);
            let eye = bsdf(thing, Travel::AgainstLight, b, a);
            assert!((light - eye).abs() <= 1e-9 * light, "{}: {light} {eye}", thing.name);
            if thing.reciprocal {
                let back = bsdf(thing, Travel::WithLight, b, a);
                assert!((light - back).abs() <= 1e-9 * light, "{}: {light} {back}", thing.name);
            }
        }
    }
}

/// Chi-squared statistic of counts against what is expected, cells of few pooled, and its degrees of freedom.
fn chi_squared(counts: &[f64], expected: &[f64]) -> (f64, f64) {
    let (mut statistic, mut cells, mut few) = (0.0, 0, [0.0; 2]);
    for (count, expected) in counts.iter().zip(expected) {
        if *expected < 8.0 {
            few = [few[0] + count, few[1] + expected];
        } else {
            statistic += (count - expected) * (count - expected) / expected;
            cells += 1;
        }
    }
    if few[1] >= 8.0 {
        statistic += (few[0] - few[1]) * (few[0] - few[1]) / few[1];
        cells += 1;
    } else {
        assert!(few[0] < few[1] + 6.0 * few[1].sqrt() + 8.0, "{few:?}");
    }
    (statistic, f64::from(cells - 1).max(1.0))
}

fn assert_distribution(name: &str, counts: &[f64], expected: &[f64], rate: f64) {
    let (statistic, degrees) = chi_squared(counts, expected);
    let limit = ChiSquared::new(degrees).unwrap().inverse_cdf(1.0 - rate);
    assert!(statistic < limit, "{name}: chi-squared {statistic} of {degrees} degrees, limit {limit}");
}

const POLAR: usize = 12;
const AZIMUTHS: usize = 16;
/// Points of the quadrature along each side of a cell.
const WITHIN: usize = 20;

/// Samples follow their density, which is all there is beside mirrors and what goes straight on.
#[test]
fn samples_follow_their_densities() {
    let things = Things::new();
    let all = things.all();
    let comparisons = all.iter().map(|thing| thing.sides.len()).sum::<usize>() * ANGLES.len() * 2;
    for (number, thing) in all.iter().enumerate() {
        for travel in TRAVELS {
            for (at, angle) in ANGLES.iter().enumerate() {
                for side in thing.sides {
                    let from = thing.from(*angle);
                    let axis = thing.axis(*side);
                    let count = 20_000;
                    let key = Key::new(6).child(number as u64).child(at as u64);
                    let mut counts = vec![0.0; POLAR * AZIMUTHS];
                    let (mut finite, mut delta) = (0.0, 0.0);
                    for index in 0..count {
                        let mut samples = PathSamples::with_pairs(key, index, 0);
                        let sample: Option<skyduct::optics::Scattered<1>> =
                            thing.scatterer.sample(travel, from, *side, &mut samples);
                        let Some(sample) = sample else { continue };
                        if matches!(sample.kind, Kind::Mirror | Kind::Through) {
                            delta += 1.0;
                            continue;
                        }
                        finite += 1.0;
                        counts[cell(axis, sample.toward)] += 1.0;
                    }
                    if finite == 0.0 {
                        continue;
                    }
                    let expected: Vec<f64> = (0..POLAR * AZIMUTHS)
                        .map(|cell| f64::from(count as u32) * within(thing, travel, from, axis, cell))
                        .collect();
                    let total = expected.iter().sum::<f64>() / count as f64;
                    assert!(
                        (total + delta / count as f64 - 1.0).abs() < 0.02,
                        "{} {travel:?} {angle} {side:?}: density adds up to {total}, deltas {delta}",
                        thing.name
                    );
                    let name = format!("{} {travel:?} {angle} {side:?}", thing.name);
                    assert_distribution(&name, &counts, &expected, rate_of_one(comparisons));
                }
            }
        }
    }
}

/// Cell of a direction: even in the polar angle and in azimuth.
fn cell(axis: DVec3, toward: DVec3) -> usize {
    let (x, y) = (warp::around(axis, DVec3::X), warp::around(axis, DVec3::Y));
    let (x, y, z) = (toward.dot(x), toward.dot(y), toward.dot(axis));
    let polar = (x.hypot(y).atan2(z) / FRAC_PI_2 * POLAR as f64) as usize;
    let azimuth = ((y.atan2(x) / TAU).rem_euclid(1.0) * AZIMUTHS as f64) as usize;
    polar.min(POLAR - 1) * AZIMUTHS + azimuth.min(AZIMUTHS - 1)
}

/// Integral of the density over a cell, by the midpoint rule.
fn within(thing: &Thing<'_>, travel: Travel, from: DVec3, axis: DVec3, cell: usize) -> f64 {
    let (polar, azimuth) = (cell / AZIMUTHS, cell % AZIMUTHS);
    let n = WITHIN as f64;
    let mut sum = 0.0;
    for i in 0..WITHIN {
        let theta = (polar as f64 + (i as f64 + 0.5) / n) / POLAR as f64 * FRAC_PI_2;
        for j in 0..WITHIN {
            let phi = (azimuth as f64 + (j as f64 + 0.5) / n) / AZIMUTHS as f64 * TAU;
            let (sin, cos) = theta.sin_cos();
            let toward = warp::around(axis, DVec3::new(sin * phi.cos(), sin * phi.sin(), cos));
            sum += Scatter::<1>::pdf(&thing.scatterer, travel, from, toward) * sin;
        }
    }
    sum * FRAC_PI_2 / POLAR as f64 * TAU / AZIMUTHS as f64 / (n * n)
}

/// Every warp is undone by the distribution functions that it is said to have: what comes back is even on the unit square.
#[test]
fn warps_have_their_densities() {
    type Undone = fn([f64; 2]) -> [f64; 2];
    fn turn(x: f64, y: f64) -> f64 {
        (y.atan2(x) / TAU).rem_euclid(1.0)
    }
    const CONE: f64 = 0.4;
    let warps: [(&str, Undone); 5] = [
        ("disc", |point| {
            let p = warp::disc(point);
            [p.length_squared(), turn(p.x, p.y)]
        }),
        ("annulus", |point| {
            let p = warp::annulus(point, 0.6, 0.8);
            [(p.length_squared() - 0.36) / 0.28, turn(p.x, p.y)]
        }),
        ("cosine hemisphere", |point| {
            let d = warp::cosine_hemisphere(point);
            [d.z * d.z, turn(d.x, d.y)]
        }),
        ("cone", |point| {
            let d = warp::cone(point, CONE);
            [(1.0 - d.z) / (1.0 - CONE.cos()), turn(d.x, d.y)]
        }),
        ("around", |point| {
            let axis = DVec3::new(-0.2, 0.7, -0.4).normalize();
            let d = warp::around(axis, warp::cosine_hemisphere(point));
            let (x, y) = (warp::around(axis, DVec3::X), warp::around(axis, DVec3::Y));
            [d.dot(axis).powi(2), turn(d.dot(x), d.dot(y))]
        }),
    ];
    let mut random = PathRandom::new(Key::new(3));
    let (count, side) = (100_000, 16);
    for (name, undone) in &warps {
        let mut counts = vec![0.0; side * side];
        for _ in 0..count {
            let [u, v] = undone(random.uniform2()).map(|value| ((value * side as f64) as usize).min(side - 1));
            counts[u * side + v] += 1.0;
        }
        let expected = vec![f64::from(count) / (side * side) as f64; side * side];
        assert_distribution(name, &counts, &expected, rate_of_one(warps.len()));
    }
}

/// Narrow lobes, whose densities no quadrature of cells resolves, and sensors: a sample's value is its weight times its density.
#[test]
fn values_are_weights_times_densities() {
    let narrow: Vec<Glossy> = [0.02, 0.1].map(Glossy::new).to_vec();
    for lobe in &narrow {
        let scatterer = Scatterer::Lobe(Oriented { optics: lobe, normal: DVec3::Z });
        for index in 0..1000 {
            let mut samples = PathSamples::with_pairs(Key::new(4), index, 0);
            let from = warp::cosine_hemisphere(samples.pair());
            let sample = scatterer.sample(Travel::WithLight, from, SheetSide::Same, &mut samples);
            let Some(sample): Option<skyduct::optics::Scattered<1>> = sample else { continue };
            let value: Spectrum<1> = scatterer.value(Travel::WithLight, from, sample.toward);
            let truth = sample.weight.0[0] * sample.pdf;
            assert!((value.0[0] - truth).abs() <= 1e-9 * truth, "{value:?} {truth}");
        }
    }
    let value: Spectrum<1> = Scatterer::Sensor(skyduct::optics::scatterer::CosineSensor { normal: DVec3::Z }).value(
        Travel::AgainstLight,
        DVec3::Z,
        DVec3::new(0.6, 0.0, 0.8),
    );
    assert_eq!(value.0[0], 0.8);
    let albedo: Spectrum<1> = Scatterer::Sensor(skyduct::optics::scatterer::CosineSensor { normal: DVec3::Z })
        .albedo(DVec3::Z, SheetSide::Same);
    assert_eq!(albedo.0[0], PI);
}
