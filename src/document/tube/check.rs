//! The bounds of tubes.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::document::errors::{Checks, escape};
use crate::document::hints;
use crate::document::job::JobDocument;
use crate::document::tube::{
    CollectorDocument, DiffuserDocument, MeshTubeDocument, ParametricTube, PartDocument, TubeDocument,
};
use crate::document::validate::{TOUCHING_M, check_ratio, check_sum, valid_size};
use crate::sky::direction;

const MOST_TUBES: usize = 64;
const MOST_SEGMENTS: usize = 16;

/// Beyond this the mitre's ellipse grows without bound; 180 degrees would fold the guide onto itself.
const STEEPEST_BEND_DEG: f64 = 175.0;

pub fn check_tubes(document: &JobDocument, checks: &mut Checks) {
    let JobDocument { tubes, room, .. } = document;
    if tubes.is_empty() && room.luminaires.is_empty() {
        checks.refuse("/tubes", "at least one tube or luminaire is needed: without them there is no light");
    }
    if tubes.len() > MOST_TUBES {
        checks.refuse("/tubes", format!("at most {MOST_TUBES} tubes, but there are {}", tubes.len()));
        return;
    }
    if !tubes.is_empty() && room.surfaces.ceiling.open {
        checks.refuse("/room/surfaces/ceiling/open", "a tube's opening needs a closed ceiling");
    }
    let mut openings: Vec<(usize, DVec2, f64)> = Vec::new();
    for (index, tube) in tubes.iter().enumerate() {
        let pointer = format!("/tubes/{index}");
        let (centre_m, diameter, diameter_name) = match tube {
            TubeDocument::Parametric(tube) => (tube.centre_m, tube.diameter_m, "diameter_m"),
            TubeDocument::Mesh(tube) => (tube.centre_m, tube.opening_diameter_m, "opening_diameter_m"),
        };
        let diameter_ok = checks.above(&format!("{pointer}/{diameter_name}"), diameter, 0.0, 10_000.0);
        match tube {
            TubeDocument::Parametric(tube) => check_parametric(&pointer, tube, diameter_ok, checks),
            TubeDocument::Mesh(tube) => check_mesh_tube(&pointer, tube, checks),
        }
        let Some(room_size_m) = valid_size(room).filter(|_| diameter_ok) else {
            continue;
        };
        let widest = room_size_m[0].min(room_size_m[1]);
        if diameter > widest + TOUCHING_M {
            let pointer = format!("{pointer}/{diameter_name}");
            let hint = hints::of_number(&pointer, diameter, |meant| meant <= widest);
            checks.refuse(pointer, format!("must be <= {widest}, the ceiling's shorter edge, but is {diameter}{hint}"));
            continue;
        }
        let radius = 0.5 * diameter;
        let mut inside = true;
        for axis in 0..2 {
            let (at, size) = (centre_m[axis], room_size_m[axis]);
            if !(at - radius >= -TOUCHING_M && at + radius <= size + TOUCHING_M) {
                let pointer = format!("{pointer}/centre_m/{axis}");
                let hint = hints::of_number(&pointer, at, |meant| meant >= radius && meant + radius <= size);
                let detail = format!(
                    "the opening must lie wholly inside the ceiling (0..{size} m), but reaches from {} m to {} m{hint}",
                    at - radius,
                    at + radius
                );
                checks.refuse(pointer, detail);
                inside = false;
            }
        }
        let centre = DVec2::from(centre_m);
        let overlaps = |(_, other, other_radius): &&(usize, DVec2, f64)| {
            other.distance(centre) < radius + other_radius - TOUCHING_M
        };
        if inside && let Some((other, ..)) = openings.iter().find(overlaps) {
            checks.refuse(format!("{pointer}/centre_m"), format!("the opening overlaps that of /tubes/{other}"));
        }
        openings.push((index, centre, radius));
    }
}

fn check_parametric(pointer: &str, tube: &ParametricTube, diameter_ok: bool, checks: &mut Checks) {
    tube.reflectance.check(&format!("{pointer}/reflectance"), checks);
    match tube.collector {
        CollectorDocument::Open => {}
        CollectorDocument::Flat { transmittance } | CollectorDocument::Dome { transmittance } => {
            check_ratio(&format!("{pointer}/collector/transmittance"), transmittance, checks);
        }
        CollectorDocument::DielectricDome { refractive_index, thickness_m, absorption_per_m } => {
            checks.within(&format!("{pointer}/collector/refractive_index"), refractive_index, 1.0, 4.0);
            checks.above(&format!("{pointer}/collector/thickness_m"), thickness_m, 0.0, 1.0);
            checks.within(&format!("{pointer}/collector/absorption_per_m"), absorption_per_m, 0.0, 1e6);
        }
    }
    check_diffuser(&format!("{pointer}/diffuser"), &tube.diffuser, 0.5 * tube.diameter_m, checks);
    check_segments(pointer, tube, diameter_ok, checks);
}

fn check_segments(pointer: &str, tube: &ParametricTube, diameter_ok: bool, checks: &mut Checks) {
    let segments = &tube.segments;
    if segments.is_empty() || segments.len() > MOST_SEGMENTS {
        let detail = format!("must have 1..{MOST_SEGMENTS} segments, but has {}", segments.len());
        checks.refuse(format!("{pointer}/segments"), detail);
        return;
    }
    let mut ok = diameter_ok;
    for (index, segment) in segments.iter().enumerate() {
        let pointer = format!("{pointer}/segments/{index}");
        ok &= checks.above(&format!("{pointer}/length_m"), segment.length_m, 0.0, 1000.0);
        ok &= checks.within(&format!("{pointer}/tilt_deg"), segment.tilt_deg, 0.0, 135.0);
        ok &= checks.within(&format!("{pointer}/azimuth_deg"), segment.azimuth_deg, -360.0, 360.0);
        if index == 0 && segment.tilt_deg > 0.0 {
            checks.not_supported(format!("{pointer}/tilt_deg"), "a first segment that is not vertical");
            ok = false;
        }
    }
    if !ok {
        return;
    }
    let axes: Vec<DVec3> = segments
        .iter()
        .map(|segment| direction(0.5 * PI - segment.tilt_deg.to_radians(), segment.azimuth_deg.to_radians()))
        .collect();
    let bends: Vec<f64> =
        axes.windows(2).map(|pair| pair[0].cross(pair[1]).length().atan2(pair[0].dot(pair[1]))).collect();
    for (index, bend) in bends.iter().enumerate() {
        if bend.to_degrees() >= STEEPEST_BEND_DEG {
            let detail = format!(
                "a bend of {:.6} degrees: successive segments must turn by less than {STEEPEST_BEND_DEG} degrees; \
                 a bend of 180 degrees folds the guide onto itself",
                bend.to_degrees()
            );
            checks.refuse(format!("{pointer}/segments/{}/tilt_deg", index + 1), detail);
            ok = false;
        }
    }
    if !ok {
        return;
    }
    let radius = 0.5 * tube.diameter_m;
    // the ellipse of a mitre between axes that turn by b reaches r tan(b / 2) along each of them
    let reach = |bend: Option<&f64>| bend.map_or(0.0, |bend| radius * (0.5 * bend).tan());
    let mut end = DVec3::ZERO;
    for (index, segment) in segments.iter().enumerate() {
        let pointer = format!("{pointer}/segments/{index}");
        let lower = reach(index.checked_sub(1).and_then(|below| bends.get(below)));
        let shortest = lower + reach(bends.get(index));
        if segment.length_m < shortest {
            let detail = format!(
                "must be >= {shortest} m, so that the mitres of its bends do not cross, but is {}",
                segment.length_m
            );
            checks.refuse(format!("{pointer}/length_m"), detail);
        }
        end += axes[index] * segment.length_m;
        let lowest = end.z - radius * axes[index].truncate().length();
        if index > 0 && lowest < 0.0 {
            let detail = format!("the guide must stay above the ceiling, but reaches {lowest} m");
            checks.refuse(format!("{pointer}/tilt_deg"), detail);
        }
    }
}

/// `radius_m` of the opening; not positive when it was refused already.
fn check_diffuser(pointer: &str, diffuser: &DiffuserDocument, radius_m: f64, checks: &mut Checks) {
    match *diffuser {
        DiffuserDocument::Open => {}
        DiffuserDocument::Clear { transmittance } => {
            check_ratio(&format!("{pointer}/transmittance"), transmittance, checks);
        }
        DiffuserDocument::Lambertian { transmittance, reflectance } => {
            check_scattering(pointer, ["transmittance", "reflectance"], [transmittance, reflectance], checks);
        }
        DiffuserDocument::Mixed {
            lambertian_radius_m,
            inner: _,
            lambertian_transmittance,
            lambertian_reflectance,
            clear_transmittance,
        } => {
            let highest = if radius_m > 0.0 { radius_m } else { f64::MAX };
            checks.within(&format!("{pointer}/lambertian_radius_m"), lambertian_radius_m, 0.0, highest);
            let names = ["lambertian_transmittance", "lambertian_reflectance"];
            check_scattering(pointer, names, [lambertian_transmittance, lambertian_reflectance], checks);
            check_ratio(&format!("{pointer}/clear_transmittance"), clear_transmittance, checks);
        }
        DiffuserDocument::Measured(ref table) => table.check(pointer, checks),
    }
}

/// A transmittance and a reflectance that share the light.
fn check_scattering(
    pointer: &str,
    [transmittance_name, reflectance_name]: [&str; 2],
    [transmittance, reflectance]: [crate::document::Coefficient; 2],
    checks: &mut Checks,
) {
    let transmittance_pointer = format!("{pointer}/{transmittance_name}");
    let transmittance_ok = check_ratio(&transmittance_pointer, transmittance, checks);
    let reflectance_ok = check_ratio(&format!("{pointer}/{reflectance_name}"), reflectance, checks);
    if transmittance_ok && reflectance_ok {
        check_sum(&transmittance_pointer, transmittance, reflectance, checks);
    }
}

fn check_mesh_tube(pointer: &str, tube: &MeshTubeDocument, checks: &mut Checks) {
    if tube.mesh.is_empty() || tube.mesh.len() > 1024 {
        checks.refuse(format!("{pointer}/mesh"), "must have 1..1024 characters");
    }
    checks.within(&format!("{pointer}/rotation_deg"), tube.rotation_deg, -360.0, 360.0);
    if tube.parts.is_empty() {
        checks.refuse(format!("{pointer}/parts"), "must name at least one material");
    }
    let mut first_diffuser: Option<(&String, &DiffuserDocument)> = None;
    for (name, part) in &tube.parts {
        let pointer = format!("{pointer}/parts/{}", escape(name));
        match part {
            PartDocument::Collector { transmittance, reflectance } => {
                check_scattering(&pointer, ["transmittance", "reflectance"], [*transmittance, *reflectance], checks);
            }
            PartDocument::Pipe { reflectance } => {
                reflectance.check(&format!("{pointer}/reflectance"), checks);
            }
            PartDocument::Diffuser(diffuser) => {
                check_diffuser(&pointer, diffuser, 0.5 * tube.opening_diameter_m, checks);
                match first_diffuser {
                    Some((first, optics)) if optics != diffuser => {
                        checks.not_supported(
                            &pointer,
                            format_args!("diffuser optics that differ from those of {first:?}"),
                        );
                    }
                    Some(_) => {}
                    None => first_diffuser = Some((name, diffuser)),
                }
            }
        }
    }
}
