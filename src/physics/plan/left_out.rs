//! Light that is lost when an effect is left out of a scene: fractions of the scene's light, estimated and bounded from above.
//!
//! No rendering is needed: the numbers follow from reflectances, areas and fluxes (docs/physics/left_out.md has the derivations).

use std::f64::consts::PI;

use glam::DVec2;

use super::called_for::returns;
use super::effect_kind::EffectKind;
use crate::geometry::disc::disc_irradiance;
use crate::guide::mesh::Part;
use crate::guide::performance;
use crate::guide::{Guide, Section};
use crate::optics::{Collector, Diffuser, DiffuserZone, Mirror, Spectrum, Surface};
use crate::sampling::Key;
use crate::scene::{Channels, Daylight, EnclosureFace, Luminaire, MeshTube, Scene, Tube, TubeShape};
use crate::traceable::TraceableTube;

/// Fraction of a scene's light that is missing when one effect that the scene calls for is left out.
///
/// For sky, sun and luminaires it is a fraction of the flux that enters the room. For all other effects it is a fraction of the flux that
/// falls on the faces of the room, open ones too, and on its objects, all together: at single points it can be larger or smaller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeftOut {
    /// Estimate of the fraction; `None` if only the bound is known.
    pub about: Option<f64>,
    /// Upper bound of the fraction; `None` if no bound below 1 is known. It is 1 if nothing else gives light.
    pub at_most: Option<f64>,
}

impl LeftOut {
    /// Estimates the light that a year loses without its skies or without its suns by their horizontal light outdoors; `None` for other
    /// effects, which do not depend on the time.
    pub fn of_year([of_skies, of_suns]: [f64; 2], kind: EffectKind) -> Option<Self> {
        let (own, rest) = match kind {
            EffectKind::Sky => (of_skies, of_suns),
            EffectKind::Sun => (of_suns, of_skies),
            _ => return None,
        };
        let about = if own > 0.0 { own / (own + rest) } else { 0.0 };
        Some(Self { about: Some(about), at_most: (own == 0.0 || rest == 0.0).then_some(about) })
    }

    /// Returns the upper bound, or else the estimate, or 1 if neither is known.
    pub fn largest(&self) -> f64 {
        self.at_most.or(self.about).unwrap_or(1.0)
    }

    /// Describes the fraction in words, with the light that it refers to.
    pub fn words(&self, kind: EffectKind) -> String {
        let percent = |fraction: f64| match 100.0 * fraction {
            fraction if fraction >= 9.5 => format!("{fraction:.0} %"),
            fraction if fraction >= 0.01 => format!("{fraction:.2} %"),
            fraction => format!("{fraction:.0e} %"),
        };
        let fraction = match (self.about, self.at_most) {
            (_, Some(1.0)) => "all".to_owned(),
            (Some(about), Some(most)) => format!("about {}, at most {},", percent(about), percent(most)),
            (Some(about), None) => format!("about {}", percent(about)),
            (None, Some(most)) => format!("at most {}", percent(most)),
            (None, None) => "an unknown share".to_owned(),
        };
        match kind {
            EffectKind::Sky | EffectKind::Sun | EffectKind::Luminaires => {
                format!("{fraction} of the light that comes into the room is left out")
            }
            EffectKind::Objects => format!("{fraction} of the light in the room meets the objects"),
            _ => format!("{fraction} of the light that falls on the room's surfaces is left out"),
        }
    }
}

/// Estimates the light that a scene loses without an effect that it calls for; `tubes` are those of the scene, built.
pub fn left_out(scene: &Scene, tubes: &[TraceableTube], kind: EffectKind) -> LeftOut {
    let surfaces = Surfaces::of(scene);
    match kind {
        EffectKind::Sky | EffectKind::Sun | EffectKind::Luminaires => source(scene, tubes, kind),
        EffectKind::Interreflection => LeftOut {
            about: Some(surfaces.mean.fraction(surfaces.mean.albedo)),
            at_most: surfaces.brightest.bound(surfaces.brightest.albedo),
        },
        EffectKind::Glossy => LeftOut {
            about: Some(surfaces.mean.fraction(surfaces.mean.specular)),
            at_most: surfaces.brightest.bound(surfaces.brightest.specular),
        },
        // in even light every area gets an equal flux per m2
        EffectKind::Objects => {
            LeftOut { about: Some(surfaces.of_objects / (surfaces.of_objects + surfaces.of_faces)), at_most: None }
        }
        EffectKind::GuideReturn => {
            LeftOut { about: None, at_most: surfaces.brightest.bound(first_returns(scene, &surfaces)) }
        }
        // these cannot be left out
        EffectKind::SpecularClosure | EffectKind::Colour | EffectKind::Horizon => {
            LeftOut { about: None, at_most: None }
        }
    }
}

/// Reflectances of surfaces.
#[derive(Clone, Copy, Debug, Default)]
struct Reflects {
    /// Diffuse and specular reflectance together.
    albedo: f64,
    /// Specular reflectance alone.
    specular: f64,
}

impl Reflects {
    /// Returns the fraction of all light that is left out. `first` is the light that is left out before its first reflection, relative to
    /// the light that stays; all reflections after it are left out, too.
    fn fraction(&self, first: f64) -> f64 {
        // X / (I + X) with X = I first / (1 - albedo); in a room that loses nothing it is 1
        if first > 0.0 { first / (first + 1.0 - self.albedo) } else { 0.0 }
    }

    /// Returns [`Self::fraction`] if it is below 1.
    fn bound(&self, first: f64) -> Option<f64> {
        Some(self.fraction(first)).filter(|fraction| *fraction < 1.0)
    }
}

/// Surfaces of a room and of its objects together.
struct Surfaces {
    /// Largest reflectances of any surface and channel.
    brightest: Reflects,
    /// Mean luminance reflectances, weighted by area.
    mean: Reflects,
    /// Area of the room's faces in m2.
    of_faces: f64,
    /// Area of the room's objects in m2.
    of_objects: f64,
}

impl Surfaces {
    fn of(scene: &Scene) -> Self {
        let room = &scene.room;
        let faces = room.enclosure.faces().iter().map(|face| (face.polygon.area_m2(), face.surface));
        let boxes = room.boxes.iter().map(|object| {
            let [x, y, z] = object.size.to_array();
            let lower = if object.base.z > 0.0 { x * y } else { 0.0 };
            (2.0 * (x + y) * z + x * y + lower, Some(object.surface))
        });
        let meshes = room.meshes.iter().flat_map(|object| {
            object.triangles().flat_map(|([a, b, c], sides)| {
                // half of the area for either side
                let area = 0.25 * (b - a).cross(c - a).length();
                sides.map(|side| (area, object.surfaces.get(side as usize).copied()))
            })
        });
        let mut all =
            Self { brightest: Reflects::default(), mean: Reflects::default(), of_faces: 0.0, of_objects: 0.0 };
        let objects: Vec<(f64, Option<Surface>)> = boxes.chain(meshes).collect();
        all.of_faces = faces.clone().map(|(area, _)| area).sum();
        all.of_objects = objects.iter().map(|(area, _)| area).sum();
        for (area, surface) in faces.chain(objects) {
            let Some(surface) = surface else { continue };
            let specular = surface.specular.map_or([0.0; 3], |specular| specular.reflectance);
            let fraction = area / (all.of_faces + all.of_objects);
            all.mean.albedo += fraction * luminance(surface.albedo());
            all.mean.specular += fraction * luminance(specular);
            all.brightest.albedo = surface.albedo().into_iter().fold(all.brightest.albedo, f64::max);
            all.brightest.specular = specular.into_iter().fold(all.brightest.specular, f64::max);
        }
        all
    }
}

fn luminance(rgb: [f64; 3]) -> f64 {
    Spectrum::<3>(rgb).luminance()
}

/// Returns an upper bound of the flux that tubes send back into the room for the first time, relative to the flux that falls on the
/// surfaces before; infinite if luminaires shine upward.
fn first_returns(scene: &Scene, surfaces: &Surfaces) -> f64 {
    // upward light of a luminaire can enter the tubes before it has met anything
    let shines_up = |luminaire: &Luminaire| {
        let normal = luminaire.edge_u.cross(luminaire.edge_v);
        luminaire.luminance != [0.0; 3] && (normal.truncate() != DVec2::ZERO || normal.z > 0.0)
    };
    if scene.room.luminaires.iter().any(shines_up) {
        return f64::INFINITY;
    }
    let tubes = scene.tubes.iter().filter(|tube| returns(tube).is_some());
    let (mut from_above, mut from_below) = (0.0, 0.0);
    for tube in tubes {
        let SheetLimits { through, back } = SheetLimits::of(&tube.diffuser);
        let up_and_down = returned(tube);
        // down again off the upper side of the sheet, and once more, and so on
        let rounds = up_and_down / (1.0 - (back * up_and_down).min(1.0 - 1e-9));
        from_above = f64::max(from_above, back * rounds);
        from_below += seen_from_surfaces(scene, tube, surfaces) * f64::min(through, through * through * rounds);
    }
    from_above + from_below * surfaces.brightest.albedo
}

/// Largest transmittance and reflectance of a sheet, 0..1.
struct SheetLimits {
    through: f64,
    back: f64,
}

impl SheetLimits {
    fn of(diffuser: &Diffuser) -> Self {
        let most = |channels: [f64; 3]| channels.into_iter().fold(0.0, f64::max);
        match diffuser {
            Diffuser::Open => Self { through: 1.0, back: 0.0 },
            Diffuser::Clear { transmittance } => Self { through: most(*transmittance), back: 0.0 },
            Diffuser::Lambertian { transmittance, reflectance } => {
                Self { through: most(*transmittance), back: most(*reflectance) }
            }
            Diffuser::Mixed { lambertian_transmittance, lambertian_reflectance, clear_transmittance, .. } => Self {
                through: f64::max(most(*lambertian_transmittance), most(*clear_transmittance)),
                back: most(*lambertian_reflectance),
            },
            Diffuser::Measured(table) => {
                let degrees = (0..=90).map(|degree| table.albedos(libm::cos(f64::from(degree).to_radians())));
                let [through, back] =
                    degrees.fold([0.0f64; 2], |most, albedos| std::array::from_fn(|k| most[k].max(albedos[k])));
                // between the degrees, too: tables are interpolated
                Self { through: (1.01 * through).min(1.0), back: (1.01 * back).min(1.0) }
            }
        }
    }
}

/// Returns the largest fraction of light from below that a tube sends back down: light that turns round in a pipe is reflected by its
/// mirror at least once.
fn returned(tube: &Tube) -> f64 {
    match &tube.shape {
        TubeShape::Cylinders(cylinders) if matches!(cylinders.collector, Collector::DielectricDome { .. }) => 1.0,
        TubeShape::Cylinders(cylinders) => cylinders.reflectance.brightest(),
        TubeShape::Mesh(mesh) if matches!(mesh.section, Section::Cylinder(_)) => 0.0,
        TubeShape::Mesh(MeshTube { section: Section::Bend(bend), .. }) => bend.reflectance.brightest(),
        TubeShape::Mesh(mesh) => {
            let of_part = |part: &Part| match part {
                Part::Collector { reflectance, .. } => reflectance.iter().copied().fold(0.0, f64::max),
                Part::Pipe { reflectance } => reflectance.brightest(),
                Part::Diffuser => 0.0,
            };
            mesh.parts.iter().map(of_part).fold(0.0, f64::max)
        }
    }
}

/// Returns an upper bound of the fraction of the light leaving any point of the room's surfaces that goes to the opening of a tube.
fn seen_from_surfaces(scene: &Scene, tube: &Tube, surfaces: &Surfaces) -> f64 {
    // a mirror can send all its light there
    if surfaces.brightest.specular > 0.0 {
        return 1.0;
    }
    let (enclosure, opening) = (&scene.room.enclosure, tube.opening());
    let radius = opening.outer_radius();
    let frame = tube.frame(enclosure);
    // for any slope: the solid angle of the disc, seen from straight below, over pi
    let of_slope = |distance: f64| (2.0 * (1.0 - distance / libm::hypot(distance, radius))).min(1.0);
    let of_face = |(number, face): (usize, &EnclosureFace)| {
        let distance = face.polygon.height(frame.origin).max(0.0);
        match frame.up(face.polygon.normal()) {
            _ if number == tube.face && !tube.hangs() => 0.0,
            z if z.abs() == 1.0 && distance > 0.0 => radius * radius / (radius * radius + distance * distance),
            // a face in the plane of the opening does not see it
            z if z.abs() == 1.0 => 0.0,
            // a wall element sees at most half of a plane
            0.0 if opening.disc().is_none() && distance < radius => 0.5,
            0.0 => most_from_wall(radius, distance.max(radius)),
            _ => of_slope(distance),
        }
    };
    let of_faces = enclosure.faces().iter().enumerate().map(of_face).fold(0.0, f64::max);
    let boxes = scene.room.boxes.iter().map(|object| match frame.is_level() {
        true => frame.origin.z - (object.base.z + object.size.z),
        false => frame.depth(object.base) - object.size.length(),
    });
    let corners = scene.room.meshes.iter().flat_map(|object| object.triangles().flat_map(|(corners, _)| corners));
    let meshes = corners.map(|corner| frame.depth(corner));
    let below = boxes.chain(meshes).fold(frame.origin.z, f64::min).max(0.0);
    let of_objects = if surfaces.of_objects > 0.0 { of_slope(below) } else { 0.0 };
    of_faces.max(of_objects)
}

/// Returns the largest form factor from a point of a wall to a disc of `radius` in the ceiling, whose centre is `offset` m from the wall.
fn most_from_wall(radius: f64, offset: f64) -> f64 {
    // the form factor rises with the depth below the ceiling to one maximum, and falls: searched first by steps, then by thirds
    let at = |exponent: f64| disc_irradiance(radius, offset * libm::exp2(exponent), offset).toward_axis;
    let step = |k: i32| 0.25 * f64::from(k);
    let best = (-80..=16).max_by(|a, b| at(step(*a)).total_cmp(&at(step(*b)))).unwrap_or(0);
    let (mut low, mut high) = (step(best - 1), step(best + 1));
    for _ in 0..64 {
        let third = (high - low) / 3.0;
        match at(low + third) < at(high - third) {
            true => low += third,
            false => high -= third,
        }
    }
    // a disc whose edge touches the wall has a limit that the steps only approach
    1.00001 * at(0.5 * (low + high))
}

/// Flux in lm: an estimate between bounds.
#[derive(Clone, Copy, Debug, Default)]
struct FluxBounds {
    least: f64,
    about: f64,
    most: f64,
}

impl FluxBounds {
    fn add(&mut self, other: Self) {
        self.least += other.least;
        self.about += other.about;
        self.most += other.most;
    }
}

/// Number of rays per replicate to estimate the flux of a guide without a closed form.
const RAYS: u64 = 64;

/// Returns the fraction that one source of light has in the flux that enters the room.
fn source(scene: &Scene, tubes: &[TraceableTube], kind: EffectKind) -> LeftOut {
    let electric = scene
        .room
        .luminaires
        .iter()
        .map(|luminaire| PI * luminaire.edge_u.cross(luminaire.edge_v).length() * luminance(luminaire.luminance));
    let electric: f64 = electric.sum();
    let electric = FluxBounds { least: electric, about: electric, most: electric };
    let (mut sky, mut sun) = (FluxBounds::default(), FluxBounds::default());
    for (index, tube) in tubes.iter().enumerate() {
        sky.add(of_sky(scene, tube, index));
        sun.add(of_sun(scene, tube, index));
    }
    let (own, others) = match kind {
        EffectKind::Sky => (sky, [sun, electric]),
        EffectKind::Sun => (sun, [sky, electric]),
        _ => (electric, [sky, sun]),
    };
    let rest = |of: fn(&FluxBounds) -> f64| others.iter().map(of).sum::<f64>();
    let about = own.about / (own.about + rest(|flux| flux.about));
    let at_most = own.most / (own.most + rest(|flux| flux.least));
    let alone = rest(|flux| flux.most) == 0.0;
    LeftOut {
        about: Some(about).filter(|fraction| fraction.is_finite()),
        at_most: if alone { Some(1.0) } else { Some(at_most).filter(|fraction| *fraction < 1.0) },
    }
}

/// Returns the least, likely and largest fraction of the luminous flux from above that a tube's closure first passes into the room.
fn passes(tube: &TraceableTube) -> FluxBounds {
    let equal = |fraction: f64| {
        let fraction = fraction * tube.transition_transmittance;
        FluxBounds { least: fraction, about: fraction, most: fraction }
    };
    match &tube.diffuser {
        Diffuser::Open => equal(1.0),
        Diffuser::Clear { transmittance } | Diffuser::Lambertian { transmittance, .. } => {
            equal(luminance(*transmittance))
        }
        Diffuser::Mixed { lambertian_radius_m, inner, lambertian_transmittance, clear_transmittance, .. } => {
            let [scattered, clear] = [lambertian_transmittance, clear_transmittance].map(|rgb| luminance(*rgb));
            let within = (lambertian_radius_m / tube.pipe_radius).min(1.0).powi(2);
            let (inner, outer) = match inner {
                DiffuserZone::Lambertian => (scattered, clear),
                DiffuserZone::Clear => (clear, scattered),
            };
            let about = within * inner + (1.0 - within) * outer;
            FluxBounds { least: scattered.min(clear), about, most: scattered.max(clear) }
        }
        Diffuser::Measured(table) => {
            let [through, _] = table.albedos(libm::cos(PI / 4.0));
            FluxBounds { least: 0.0, about: through, most: 1.0 }
        }
    }
}

/// Returns the flux of the sky in lm that a tube passes into the room.
fn of_sky(scene: &Scene, tube: &TraceableTube, index: usize) -> FluxBounds {
    let before = |daylight: &Daylight| daylight.before(&scene.tubes[index]).0;
    let Some(sky) = &scene.daylight.as_ref().and_then(before) else { return FluxBounds::default() };
    let closure = passes(tube);
    let traced = performance::sky(&tube.guide, sky, Key::new(index as u64), RAYS);
    let about = closure.about * traced.arriving().mean;
    // in a straight pipe the mirror can only absorb light that has passed the level cover
    let most = match &tube.guide {
        Guide::Straight(guide) if scene.channels == Channels::Photopic && sky.horizon().is_none() => {
            let cover = guide.collector_transmittance[0];
            closure.most * cover * tube.pipe_area_m2() * sky.horizontal_illuminance_lux()
        }
        _ => f64::INFINITY,
    };
    FluxBounds { least: 0.0, about: about.min(most), most }
}

/// Returns the flux of the sun's beam in lm that a tube passes into the room.
fn of_sun(scene: &Scene, tube: &TraceableTube, index: usize) -> FluxBounds {
    let before = |daylight: &Daylight| daylight.before(&scene.tubes[index]).1;
    let Some(sun) = scene.daylight.as_ref().and_then(before) else { return FluxBounds::default() };
    let closure = passes(tube);
    let beam = performance::beam(&tube.guide, sun.direction, Key::new(index as u64), RAYS);
    let flux = sun.normal_illuminance_lux * beam.arriving().mean;
    let about = closure.about * flux;
    match &tube.guide {
        Guide::Straight(guide)
            if scene.channels == Channels::Photopic && matches!(guide.reflectance, Mirror::Constant(_)) =>
        {
            FluxBounds { least: closure.least * flux, about, most: closure.most * flux }
        }
        _ => FluxBounds { least: 0.0, about, most: f64::INFINITY },
    }
}
