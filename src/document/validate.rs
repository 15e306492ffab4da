//! Every bound of the job document.

use std::collections::BTreeSet;

use glam::DVec3;

use super::errors::{Checks, escape};
use super::hints;
use super::job::JobDocument;
use super::method::{LEAST_FIXED_POINTS, MOST_PHOTONS_THAT_ARE_KEPT, MethodKind, MethodSettings, RadiusKind};
use super::optics::coefficient::Coefficient;
use super::outputs::{EstimateDocument, GridDocument, ViewDocument};
use super::room::luminaire::check_luminaires;
use super::room::{ObjectDocument, RoomDocument, SurfaceDocument};
use super::sky::daylight::{instant, year_range};
use super::tube::check::check_tubes;
use crate::integrator::ppm;
use crate::optics::glossy::LEAST_ROUGHNESS;
use crate::plan::effects::EffectKind;
use crate::scene::View;

/// Brighter than anything: the disc of the sun has 2e9 cd/m2, and no illuminance on Earth comes near.
pub const MOST_LIGHT: f64 = 1e9;

/// Farther than any camera or object.
pub const FARTHEST_M: f64 = 1e6;

/// Along one axis of a grid.
pub const MOST_CELLS: u32 = 1000;
/// Along one edge of a picture.
pub const MOST_PIXELS_OF_AN_EDGE: u32 = 8192;
const MOST_GRID_CELLS: u64 = 100_000;
const MOST_PIXELS: u64 = 16_777_216;
/// Points of which a method keeps statistics from pass to pass: 16 bytes each, in a few copies.
const MOST_POINTS: u64 = 4_194_304;
/// Points of pixels and cells that are the same in every pass: their spread takes 6 bytes each, in a few copies.
const MOST_FIXED_POINTS: u64 = 67_108_864;
const MOST_OUTPUTS: usize = 64;
const MOST_OBJECTS: usize = 1000;

/// Edges of a room in metres.
pub const SHORTEST_EDGE_M: f64 = 0.01;
pub const LONGEST_EDGE_M: f64 = 10_000.0;

/// Slack for corners that are meant to touch a wall, in metres.
pub const TOUCHING_M: f64 = 1e-9;

/// Adds everything that is wrong with the values of `document` to `checks`.
pub fn validate(document: &JobDocument, checks: &mut Checks) {
    if document.name.as_ref().is_some_and(|name| name.chars().count() > 1000) {
        checks.refuse("/name", "must have at most 1000 characters");
    }
    check_place(document, checks);
    check_sky(document, checks);
    check_room(document, checks);
    check_luminaires(document, checks);
    check_tubes(document, checks);
    check_outputs(document, checks);
    check_method(document, checks);
    let stop = &document.stop;
    checks.above("/stop/relative_error", stop.relative_error, 0.0, 1.0);
    checks.above("/stop/view_relative_error", stop.view_relative_error, 0.0, 1.0);
    if !(stop.confidence >= 0.5 && stop.confidence < 1.0) {
        checks.refuse("/stop/confidence", format!("must be >= 0.5 and < 1, but is {}", stop.confidence));
    }
    checks.within("/stop/max_passes", stop.max_passes, 1, 1_000_000_000);
    checks.above("/stop/max_seconds", stop.max_seconds, 0.0, 1e9);
    for name in document.effects.keys().filter(|name| EffectKind::from_name(name).is_none()) {
        let known = EffectKind::ALL.map(EffectKind::name);
        let hint = hints::did_you_mean(name, known).map_or(String::new(), |name| format!("; did you mean `{name}`?"));
        let detail = format!("no effect has this name; there are {}{hint}", known.join(", "));
        checks.refuse(format!("/effects/{}", escape(name)), detail);
    }
}

fn check_place(document: &JobDocument, checks: &mut Checks) {
    if let Some(location) = &document.location {
        checks.within("/location/latitude_deg", location.latitude_deg, -90.0, 90.0);
        checks.within("/location/longitude_deg", location.longitude_deg, -180.0, 180.0);
        checks.within("/location/elevation_m", location.elevation_m, -500.0, 9000.0);
    }
    match document.time.as_deref().map(instant) {
        Some(Err(detail)) => checks.refuse("/time", detail),
        Some(Ok(instant)) => {
            let (first, last) = year_range();
            checks.within("/time", instant.year, first, last);
        }
        None => {}
    }
}

fn check_sky(document: &JobDocument, checks: &mut Checks) {
    let Some(sky) = &document.sky else {
        if !document.tubes.is_empty() {
            checks.refuse("/sky", "required unless `tubes` is empty");
        }
        return;
    };
    match (sky.cie_type, sky.preset) {
        (Some(cie_type), None) => {
            checks.within("/sky/cie_type", cie_type, 1, 16);
        }
        (None, Some(_)) => {}
        (None, None) => checks.refuse("/sky/cie_type", "required, unless `preset` is given"),
        (Some(_), Some(_)) => {
            checks.refuse("/sky/preset", "given beside `cie_type`: exactly one of them names the sky")
        }
    }
    match (&sky.sun_position, &document.location, &document.time) {
        (Some(position), location, time) => {
            if location.is_some() || time.is_some() {
                let detail = "given beside `location` or `time`: exactly one of `sky.sun_position` and (`location` and `time`) says where the sun is";
                checks.refuse("/sky/sun_position", detail);
            }
            checks.within("/sky/sun_position/altitude_deg", position.altitude_deg, -90.0, 90.0);
            checks.within("/sky/sun_position/azimuth_deg", position.azimuth_deg, -360.0, 360.0);
        }
        (None, Some(_), Some(_)) => {}
        (None, None, None) => {
            checks.refuse("/sky/sun_position", "required unless `location` and `time` are given");
        }
        (None, None, Some(_)) => checks.refuse("/location", "required with `time`, unless `sky.sun_position` is given"),
        (None, Some(_), None) => checks.refuse("/time", "required with `location`, unless `sky.sun_position` is given"),
    }
    let levels = [
        ("/sky/zenith_luminance_cd_m2", sky.zenith_luminance_cd_m2),
        ("/sky/diffuse_horizontal_illuminance_lux", sky.diffuse_horizontal_illuminance_lux),
        ("/sky/dv_ev", sky.dv_ev),
        ("/sky/luminous_turbidity", sky.luminous_turbidity),
    ];
    for (pointer, _) in levels.iter().filter(|(_, level)| level.is_some()).skip(1) {
        let detail = "at most one of `zenith_luminance_cd_m2`, `diffuse_horizontal_illuminance_lux`, `dv_ev` and `luminous_turbidity` sets the level";
        checks.refuse(*pointer, detail);
    }
    for (pointer, level) in levels.iter().take(2) {
        if let Some(level) = level {
            checks.within(pointer, *level, 0.0, MOST_LIGHT);
        }
    }
    if let Some(turbidity) = sky.luminous_turbidity {
        checks.above("/sky/luminous_turbidity", turbidity, 0.0, 12.0);
        if let Some(cie_type) = sky.cie_type.filter(|cie_type| !(7..=15).contains(cie_type)) {
            let detail = format!("only of the CIE types 7..15, but the type is {cie_type}");
            checks.refuse("/sky/luminous_turbidity", detail);
        }
    }
    if let Some(ratio) = sky.dv_ev {
        checks.above("/sky/dv_ev", ratio, 0.0, 1.0);
    }
    for (pointer, level) in levels.iter().skip(2) {
        if level.is_some() && sky.preset.is_some() {
            checks.refuse(*pointer, "only of CIE types: a preset has its own level");
        }
    }
    if let Some(beam) = sky.direct_normal_illuminance_lux {
        checks.within("/sky/direct_normal_illuminance_lux", beam, 0.0, MOST_LIGHT);
    }
}

/// The room's size; `None` when it is refused: then nothing can be said of what has to fit into it.
pub fn valid_size(room: &RoomDocument) -> Option<[f64; 3]> {
    let valid = |size: &f64| (SHORTEST_EDGE_M..=LONGEST_EDGE_M).contains(size);
    room.size_m.iter().all(valid).then_some(room.size_m)
}

/// Refuses channels outside 0..1.
pub fn check_ratio(pointer: &str, coefficient: Coefficient, checks: &mut Checks) -> bool {
    let channels = coefficient.channels().into_iter();
    channels.fold(true, |ok, (channel, value)| checks.within(&format!("{pointer}{channel}"), value, 0.0, 1.0) && ok)
}

/// Refuses transmittance + reflectance > 1 in a channel; the slack is the rounding of decimal fractions.
pub fn check_sum(pointer: &str, transmittance: Coefficient, reflectance: Coefficient, checks: &mut Checks) {
    let sums = transmittance.rgb().into_iter().zip(reflectance.rgb()).map(|(t, r)| t + r);
    let largest = sums.fold(0.0, f64::max);
    if largest > 1.0 + 4.0 * f64::EPSILON {
        checks.refuse(pointer, format!("transmittance + reflectance must be <= 1, but is {largest}"));
    }
}

/// A closed surface, or an open face where that is allowed.
fn check_surface(pointer: &str, surface: &SurfaceDocument, may_be_open: bool, checks: &mut Checks) {
    if surface.open && !may_be_open {
        checks.refuse(format!("{pointer}/open"), "only a face of the room can be open");
    }
    match surface.reflectance {
        Some(_) if surface.open => {
            checks.refuse(format!("{pointer}/reflectance"), "an open surface is missing and reflects nothing");
        }
        None if !surface.open => {
            checks.refuse(format!("{pointer}/reflectance"), "required, but missing, unless the surface is `open`");
        }
        None => {}
        Some(reflectance) => {
            let pointer = format!("{pointer}/reflectance");
            if check_ratio(&pointer, reflectance, checks) {
                for (channel, value) in reflectance.channels() {
                    if value >= 1.0 {
                        checks.refuse(format!("{pointer}{channel}"), format!("albedo must be < 1, but is {value}"));
                    }
                }
            }
        }
    }
    check_specular(pointer, surface, checks);
}

fn check_specular(pointer: &str, surface: &SurfaceDocument, checks: &mut Checks) {
    if let Some(specular) = surface.specular {
        let pointer = format!("{pointer}/specular");
        let some = specular.rgb().into_iter().any(|value| value > 0.0);
        if surface.open && some {
            checks.refuse(&pointer, "an open surface is missing and reflects nothing");
        } else if check_ratio(&pointer, specular, checks) && some {
            let diffuse = surface.reflectance.unwrap_or_default().rgb();
            let albedo = specular.rgb().into_iter().zip(diffuse).map(|(s, d)| s + d).fold(0.0, f64::max);
            // an albedo of the reflectance alone has been refused before
            if albedo >= 1.0 && diffuse.into_iter().all(|value| value < 1.0) {
                checks.refuse(&pointer, format!("reflectance + specular must be < 1, but is {albedo}"));
            }
        }
    }
    if let Some(roughness) = surface.roughness {
        let pointer = format!("{pointer}/roughness");
        if checks.within(&pointer, roughness, 0.0, 1.0) && roughness > 0.0 && roughness < LEAST_ROUGHNESS {
            let detail = format!("must be 0 (a mirror) or within {LEAST_ROUGHNESS}..1, but is {roughness}");
            checks.refuse(pointer, detail);
        }
    }
}

fn check_room(document: &JobDocument, checks: &mut Checks) {
    let room = &document.room;
    for (axis, size) in room.size_m.iter().enumerate() {
        checks.within(&format!("/room/size_m/{axis}"), *size, SHORTEST_EDGE_M, LONGEST_EDGE_M);
    }
    checks.within("/room/rotation_deg", room.rotation_deg, -360.0, 360.0);
    let surfaces = &room.surfaces;
    let faces = [
        ("floor", Some(&surfaces.floor)),
        ("walls", Some(&surfaces.walls)),
        ("wall_north", surfaces.wall_north.as_ref()),
        ("wall_east", surfaces.wall_east.as_ref()),
        ("wall_south", surfaces.wall_south.as_ref()),
        ("wall_west", surfaces.wall_west.as_ref()),
        ("ceiling", Some(&surfaces.ceiling)),
    ];
    for (name, surface) in faces {
        if let Some(surface) = surface {
            check_surface(&format!("/room/surfaces/{name}"), surface, true, checks);
        }
    }
    if room.objects.len() > MOST_OBJECTS {
        checks.refuse("/room/objects", format!("at most {MOST_OBJECTS} objects, but there are {}", room.objects.len()));
        return;
    }
    for (index, object) in room.objects.iter().enumerate() {
        check_object(&format!("/room/objects/{index}"), object, valid_size(room), checks);
    }
}

fn check_object(pointer: &str, object: &ObjectDocument, room: Option<[f64; 3]>, checks: &mut Checks) {
    match object {
        ObjectDocument::Mesh { position_m, rotation_deg, surfaces, .. } => {
            for (axis, position) in position_m.iter().enumerate() {
                checks.within(&format!("{pointer}/position_m/{axis}"), *position, -FARTHEST_M, FARTHEST_M);
            }
            checks.within(&format!("{pointer}/rotation_deg"), *rotation_deg, -360.0, 360.0);
            for (name, surface) in surfaces {
                check_surface(&format!("{pointer}/surfaces/{}", escape(name)), surface, false, checks);
            }
        }
        ObjectDocument::Box { size_m, position_m, rotation_deg, surface } => {
            check_surface(&format!("{pointer}/surface"), surface, false, checks);
            let mut ok = checks.within(&format!("{pointer}/rotation_deg"), *rotation_deg, -360.0, 360.0);
            for axis in 0..3 {
                ok &= checks.above(&format!("{pointer}/size_m/{axis}"), size_m[axis], 0.0, 10_000.0);
                ok &= checks.within(&format!("{pointer}/position_m/{axis}"), position_m[axis], -FARTHEST_M, FARTHEST_M);
            }
            let Some(room) = room.filter(|_| ok) else {
                return;
            };
            let (base, size) = (DVec3::from(*position_m), DVec3::from(*size_m));
            let (sin, cos) = rotation_deg.to_radians().sin_cos();
            // half-widths of the rotated footprint along the room's axes
            let reach_x = 0.5 * (size.x * cos.abs() + size.y * sin.abs());
            let reach_y = 0.5 * (size.x * sin.abs() + size.y * cos.abs());
            let spans = [
                (base.x - reach_x, base.x + reach_x, room[0]),
                (base.y - reach_y, base.y + reach_y, room[1]),
                (base.z, base.z + size.z, room[2]),
            ];
            for (axis, (from, to, room)) in spans.into_iter().enumerate() {
                if from < -TOUCHING_M || to > room + TOUCHING_M {
                    let pointer = format!("{pointer}/position_m/{axis}");
                    // moved to where it may have been meant to be
                    let fits =
                        |meant: f64| meant - position_m[axis] + to <= room && meant - position_m[axis] + from >= 0.0;
                    let hint = hints::of_number(&pointer, position_m[axis], fits);
                    let detail = format!(
                        "the box must be inside the room (0..{room} m), but reaches from {from} m to {to} m{hint}"
                    );
                    checks.refuse(pointer, detail);
                }
            }
        }
    }
}

fn check_outputs(document: &JobDocument, checks: &mut Checks) {
    let JobDocument { grids, views, room, .. } = document;
    if grids.is_empty() && views.is_empty() {
        checks.refuse("/grids", "`grids` or `views` must name at least one output");
    }
    let mut names = BTreeSet::new();
    for (index, grid) in grids.iter().enumerate().take(MOST_OUTPUTS) {
        let pointer = format!("/grids/{index}");
        check_name(&pointer, &grid.name, &mut names, checks);
        check_grid(&pointer, grid, valid_size(room), checks);
    }
    names.clear();
    for (index, view) in views.iter().enumerate().take(MOST_OUTPUTS) {
        let pointer = format!("/views/{index}");
        check_name(&pointer, &view.name, &mut names, checks);
        check_view(&pointer, view, checks);
    }
    for (name, number) in [("grids", grids.len()), ("views", views.len())] {
        if number > MOST_OUTPUTS {
            checks.refuse(format!("/{name}"), format!("at most {MOST_OUTPUTS}, but there are {number}"));
        }
    }
}

/// Names become file names: none may leave its folder, hide, or fall together with another.
fn check_name<'a>(pointer: &str, name: &'a str, names: &mut BTreeSet<&'a str>, checks: &mut Checks) {
    let pointer = format!("{pointer}/name");
    let starts_well = name.starts_with(|c: char| c.is_ascii_alphanumeric());
    let all_well = name.chars().all(|c| c.is_ascii_alphanumeric() || "._-".contains(c));
    if !starts_well || !all_well || name.len() > 64 {
        let detail = "must have 1..64 letters, digits, `.`, `_` or `-`, and begin with a letter or digit";
        checks.refuse(pointer, format!("{detail}, but is {name:?}"));
    } else if !names.insert(name) {
        checks.refuse(pointer, format!("must be unique, but {name:?} stands before"));
    }
}

fn check_grid(pointer: &str, grid: &GridDocument, room_size_m: Option<[f64; 3]>, checks: &mut Checks) {
    let mut ok = true;
    for (axis, cells) in grid.cells.iter().enumerate() {
        ok &= checks.within(&format!("{pointer}/cells/{axis}"), *cells, 1, MOST_CELLS);
    }
    let cells = u64::from(grid.cells[0]) * u64::from(grid.cells[1]);
    if ok && cells > MOST_GRID_CELLS {
        checks.refuse(format!("{pointer}/cells"), format!("at most {MOST_GRID_CELLS} cells, but there are {cells}"));
    }
    let [width, depth, ceiling] = room_size_m.unwrap_or([f64::MAX; 3]);
    if !(grid.height_m >= 0.0 && grid.height_m < ceiling) {
        let pointer = format!("{pointer}/height_m");
        let hint = hints::of_number(&pointer, grid.height_m, |meant| meant >= 0.0 && meant < ceiling);
        let detail = format!("must be >= 0 and below the ceiling ({ceiling} m), but is {}{hint}", grid.height_m);
        checks.refuse(pointer, detail);
    }
    let widest = 0.5 * width.min(depth);
    if !(grid.margin_m >= 0.0 && grid.margin_m < widest) {
        let pointer = format!("{pointer}/margin_m");
        let hint = hints::of_number(&pointer, grid.margin_m, |meant| meant >= 0.0 && meant < widest);
        let detail = format!("must be >= 0 and < {widest} m (half the room), but is {}{hint}", grid.margin_m);
        checks.refuse(pointer, detail);
    }
}

fn check_view(pointer: &str, view: &ViewDocument, checks: &mut Checks) {
    let mut ok = true;
    for (axis, size) in view.size_px.iter().enumerate() {
        ok &= checks.within(&format!("{pointer}/size_px/{axis}"), *size, 1, MOST_PIXELS_OF_AN_EDGE);
    }
    let pixels = u64::from(view.size_px[0]) * u64::from(view.size_px[1]);
    if ok && pixels > MOST_PIXELS {
        checks.refuse(format!("{pointer}/size_px"), format!("at most {MOST_PIXELS} pixels, but there are {pixels}"));
    }
    let fov = view.vertical_fov_deg;
    if !(fov > 0.0 && fov < 179.0) {
        checks.refuse(format!("{pointer}/vertical_fov_deg"), format!("must be > 0 and < 179, but is {fov}"));
        ok = false;
    }
    for (name, vector) in [("eye_m", view.eye_m), ("look_at_m", view.look_at_m), ("up", view.up)] {
        for (axis, value) in vector.iter().enumerate() {
            ok &= checks.within(&format!("{pointer}/{name}/{axis}"), *value, -FARTHEST_M, FARTHEST_M);
        }
    }
    if !ok {
        return;
    }
    let (eye, look_at, up) = (DVec3::from(view.eye_m), DVec3::from(view.look_at_m), DVec3::from(view.up));
    if (look_at - eye).try_normalize().is_none() {
        checks.refuse(format!("{pointer}/look_at_m"), "must differ from `eye_m`");
    } else if up.try_normalize().is_none() {
        checks.refuse(format!("{pointer}/up"), "must not be zero");
    } else if View::new(String::new(), eye, look_at, up, fov.to_radians(), [1, 1]).is_none() {
        checks.refuse(format!("{pointer}/up"), "must not be parallel to the viewing direction");
    }
}

fn check_method(document: &JobDocument, checks: &mut Checks) {
    let method = &document.method;
    if method.kind == MethodKind::LightTracing && !document.views.is_empty() {
        checks.refuse("/method", "light_tracing computes grids only: use auto or sppm");
    }
    let MethodSettings {
        photons_per_pass,
        initial_radius_m,
        alpha,
        radius,
        samples_per_sensor,
        samples_per_pixel,
        gather_rays,
        coefficient,
        pipe_transmittance,
        bend_factor,
    } = method.settings.unwrap_or_default();
    if let Some(coefficient) = coefficient {
        checks.above("/method/coefficient", coefficient, 0.0, 10.0);
    }
    for (name, ratio) in [("pipe_transmittance", pipe_transmittance), ("bend_factor", bend_factor)] {
        if let Some(ratio) = ratio {
            checks.within(&format!("/method/{name}"), ratio, 0.0, 1.0);
        }
    }
    if let Some(photons) = photons_per_pass {
        let kept = method.kind == MethodKind::BidirectionalPathTracing;
        let most = if kept { MOST_PHOTONS_THAT_ARE_KEPT } else { 16_777_216 };
        checks.within("/method/photons_per_pass", photons, 64, most);
    }
    for (name, samples, most) in
        [("samples_per_sensor", samples_per_sensor, 65_536), ("samples_per_pixel", samples_per_pixel, 4_096)]
    {
        if let Some(samples) = samples {
            let least = if method.kind == MethodKind::Ppm { LEAST_FIXED_POINTS } else { 1 };
            checks.within(&format!("/method/{name}"), samples, least, most);
        }
    }
    if let Some(rays) = gather_rays {
        checks.within("/method/gather_rays", rays, 1, 65_536);
    }
    if let Some(radius) = initial_radius_m {
        checks.above("/method/initial_radius_m", radius, 0.0, 10_000.0);
    }
    if let Some(alpha) = alpha
        && !(alpha > 0.0 && alpha < 1.0)
    {
        checks.refuse("/method/alpha", format!("must be > 0 and < 1, but is {alpha}"));
    }
    let fixed = method.kind == MethodKind::Ppm;
    let default = ppm::Settings::default();
    let per_cell = if fixed { samples_per_sensor.unwrap_or(default.samples_per_sensor) } else { 1 };
    let per_pixel = if fixed { samples_per_pixel.unwrap_or(default.samples_per_pixel) } else { 1 };
    let of_grids = points_of_grids(document, per_cell);
    let of_views = document.views.iter().map(|view| points(view.size_px, per_pixel)).fold(0, u64::saturating_add);
    for (name, points) in [("samples_per_sensor", of_grids), ("samples_per_pixel", of_views)] {
        if fixed && points > MOST_FIXED_POINTS {
            let detail = format!("at most {MOST_FIXED_POINTS} fixed points in all, but there are {points}");
            checks.refuse(format!("/method/{name}"), detail);
        }
    }
    let points = of_grids.saturating_add(of_views);
    if radius == Some(RadiusKind::PerPoint) && points > MOST_POINTS {
        let detail = format!("per_point keeps the radii of at most {MOST_POINTS} points, but there are {points}");
        checks.refuse("/method/radius", detail);
    }
}

fn points([a, b]: [u32; 2], each: u32) -> u64 {
    (u64::from(a) * u64::from(b)).saturating_mul(u64::from(each))
}

/// Sensors, `per_cell` for a cell average.
fn points_of_grids(document: &JobDocument, per_cell: u32) -> u64 {
    let of = |grid: &GridDocument| {
        points(grid.cells, if grid.estimate == EstimateDocument::CellAverage { per_cell } else { 1 })
    };
    document.grids.iter().map(of).fold(0, u64::saturating_add)
}
