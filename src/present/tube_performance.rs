//! Performance of a tube by itself, apart from the passes of a job: the part of its report that does not depend on them.

use std::fmt::{self, Write as _};
use std::sync::Arc;

use crate::document::result::tube_report::{
    BeamReport, SkyReport, StraightReport, ThroughputResult, TransmissionResult,
};
use crate::guide::Guide;
use crate::guide::beams::Beams;
use crate::guide::equivalent_length::equivalent_length_m;
use crate::guide::patches;
use crate::guide::performance::{self, Effort};
use crate::guide::skies::skies;
use crate::present::cache::Cache;
use crate::sampling::{Key, Stream};
use crate::scene::{MeshTube, Segment, StraightOrBent, Tube, TubeShape};
use crate::traceable::{TraceableScene, TraceableTube, cylinder_guide};

/// Largest number of rays of each replicate for a beam of the curve, and of each of 8 replicates under a sky, in patches or not, or in the
/// sun.
const MOST_BEAM_RAYS: u64 = 128;
const MOST_SKY_RAYS: u64 = 2048;

/// Fewest rays of each replicate under a sky and in the sun, and under a sky in patches: enough that the light which they leave
/// undetermined is no more than the allowed error, where that is largest.
const LEAST_SKY_RAYS: u64 = 13;
const LEAST_PATCH_RAYS: u64 = 7;

/// Number of rays of each replicate through the straight tubes that a bent one is compared with, at the largest error.
const STRAIGHT_RAYS: f64 = 64.0;

/// Fewest rays of each replicate for the beams of one altitude of the curve, from all azimuths beside the first.
const LEAST_BEAM_RAYS: u64 = 1;

/// Standard error of a report's transmissions under skies and in the sun as a multiple of that of the job, and its upper limit: so that a
/// report takes no more than a tenth of its job's time, through bends and meshes, too.
pub const ERROR_OF_REPORTS: f64 = 1.5;
pub const LARGEST_ERROR: f64 = 0.015;

/// Standard error of the points of the curve, as a multiple of that of the other figures: each is one of many.
const ERROR_OF_CURVE: f64 = 4.0;

/// Standard error of a sky in patches, as a multiple of that of the other figures: it is reported beside the sky itself to show the error
/// of patches.
const ERROR_OF_PATCHES: f64 = 2.0;

/// Smallest step between the altitudes of the curve, in degrees.
const ALTITUDE_STEP_DEG: u32 = 5;

/// Number of azimuths over which the curve is averaged.
const AZIMUTHS: u32 = 8;

/// Number of performances that the process keeps: of the tubes and skies that were requested last.
const KEPT: usize = 256;

/// Figures of a tube that do not depend on the passes of a job.
#[derive(Debug)]
pub struct TubePerformance {
    pub beam: BeamReport,
    pub uniform_sky: TransmissionResult,
    pub sky: Option<SkyReport>,
    pub sun: Option<ThroughputResult>,
    pub equivalent_straight: Option<StraightReport>,
}

/// Performances by the hash of what they depend on, for all jobs of this process.
static PERFORMANCES: Cache<blake3::Hash, Arc<TubePerformance>> = Cache::new(KEPT, |_| 1);

impl TubePerformance {
    /// Returns the performance of a tube of a scene, with standard errors of about this size: a kept one, or one computed anew.
    pub fn of(traceable: &TraceableScene, tube: usize, description: &Tube, standard_error: f64) -> Arc<Self> {
        let (shape, tube) = (&description.shape, &traceable.tubes[tube]);
        let content = content(shape, tube, standard_error);
        PERFORMANCES.get(content, || Arc::new(performance(tube, shape, standard_error)))
    }
}

/// Hashes everything that a performance depends on: the plane of the opening, the tube's shape and optics above its diffuser, sky and sun,
/// and the allowed error.
fn content(shape: &TubeShape, tube: &TraceableTube, error: f64) -> blake3::Hash {
    struct Hashing(blake3::Hasher);
    impl fmt::Write for Hashing {
        fn write_str(&mut self, text: &str) -> fmt::Result {
            self.0.update(text.as_bytes());
            Ok(())
        }
    }
    let mut hashing = Hashing(blake3::Hasher::new());
    // derived, so that no field is forgotten, and numbers are written in digits that read back exactly
    let shape: &dyn fmt::Debug = match shape {
        TubeShape::Cylinders(tube) => tube,
        TubeShape::Mesh(MeshTube { mesh, parts, rotation, section }) => {
            mesh.numbers_as_bytes(&mut |bytes| {
                hashing.0.update(bytes);
            });
            &(&mesh.materials, parts, rotation, section)
        }
    };
    let written = write!(
        hashing,
        "{shape:?} {:?} {:?} {:?} {:?} {error:?}",
        tube.frame.turn(),
        tube.pipe_radius,
        tube.sky,
        tube.sun
    );
    debug_assert!(written.is_ok(), "hashing cannot fail");
    hashing.0.finalize()
}

fn performance(tube: &TraceableTube, shape: &TubeShape, standard_error: f64) -> TubePerformance {
    let TraceableTube { guide, sky, sun, pipe_radius: radius, .. } = tube;
    // the same numbers for every tube: equal tubes have equal reports, and two reports do not differ by noise alone
    let key = Key::new(0);
    let effort = Effort { standard_error, least: LEAST_SKY_RAYS, most: MOST_SKY_RAYS };
    let keys = [Stream::ReportUniformSky, Stream::ReportSky].map(|stream| key.stream(stream, 0));
    let (uniform_sky, of_sky) = skies(guide, sky.as_ref(), keys, effort);
    let sky_report = sky.as_ref().zip(of_sky).map(|(sky, direct)| {
        let effort = Effort { standard_error: ERROR_OF_PATCHES * standard_error, least: LEAST_PATCH_RAYS, ..effort };
        let patches = patches::patch_sky(guide, sky, key.stream(Stream::ReportSkyPatches, 0), effort);
        SkyReport { direct: ThroughputResult::new(&direct, 1.0), patches: ThroughputResult::new(&patches, 1.0) }
    });
    let sun_report = sun.as_ref().map(|sun| {
        let through = performance::beam(guide, sun.direction, key.stream(Stream::ReportSun, 0), effort);
        ThroughputResult::new(&through, sun.normal_illuminance_lux)
    });
    let equivalent_straight = match shape {
        TubeShape::Cylinders(tube) if !tube.is_straight() => {
            let radius = *radius;
            let length_m = tube.segments.iter().map(|segment| segment.length_m).sum();
            // in closed form, or by the same rays for all
            let rays = ((STRAIGHT_RAYS * LARGEST_ERROR / standard_error) as u64).min(MOST_SKY_RAYS);
            let transmission =
                performance::uniform_sky(&cylinder_guide(&straightened(tube, length_m), radius), keys[0], rays);
            Some(StraightReport {
                length_m,
                transmission: transmission.into(),
                efficiency: uniform_sky.value / transmission.value,
                equivalent_length_m: equivalent_length_m(uniform_sky.value, (length_m, transmission.value), |length| {
                    let guide = cylinder_guide(&straightened(tube, length), radius);
                    performance::nearly_uniform_sky(&guide, keys[0], rays)
                }),
            })
            .filter(|report| report.efficiency.is_finite())
        }
        _ => None,
    };
    let toward_sun = sun.as_ref().map(|sun| sun.direction);
    let toward_sun = toward_sun.or(sky.as_ref().map(|sky| sky.distribution.sun()));
    let azimuth =
        toward_sun.map_or(std::f64::consts::PI, |sun| libm::atan2(sun.x, sun.y).rem_euclid(std::f64::consts::TAU));
    TubePerformance {
        beam: beam_report(guide, azimuth, key.stream(Stream::ReportBeams, 0), standard_error),
        uniform_sky: uniform_sky.into(),
        sky: sky_report,
        sun: sun_report,
        equivalent_straight,
    }
}

/// Returns the tube as one vertical piece.
fn straightened(tube: &StraightOrBent, length_m: f64) -> StraightOrBent {
    StraightOrBent { segments: vec![Segment { length_m, tilt: 0.0, azimuth: 0.0 }], cut: None, ..tube.clone() }
}

fn beam_report(guide: &Guide, azimuth: f64, key: Key, standard_error: f64) -> BeamReport {
    let altitudes: Vec<f64> = (1..=90 / ALTITUDE_STEP_DEG).map(|step| f64::from(step * ALTITUDE_STEP_DEG)).collect();
    let effort =
        Effort { standard_error: ERROR_OF_CURVE * standard_error, least: LEAST_BEAM_RAYS, most: MOST_BEAM_RAYS };
    let radians: Vec<f64> = altitudes.iter().map(|altitude| altitude.to_radians()).collect();
    let curve = Beams { guide, azimuth, azimuths: AZIMUTHS, key, effort }.curve(&radians);
    let beams = || curve.iter().map(|(_, beams)| beams);
    let first: Vec<_> = beams().map(|beams| beams.first.transmission()).collect();
    BeamReport {
        azimuth_deg: azimuth.to_degrees(),
        altitude_deg: curve.iter().map(|(number, _)| altitudes[*number]).collect(),
        transmission: first.iter().map(|first| first.value).collect(),
        standard_error: first.iter().map(|first| first.standard_error).collect(),
        effective_area_m2: beams().map(|beams| beams.first.arriving().mean).collect(),
        azimuth_mean_transmission: beams().map(|beams| beams.all.value).collect(),
        azimuth_mean_standard_error: beams().map(|beams| beams.all.standard_error).collect(),
    }
}
