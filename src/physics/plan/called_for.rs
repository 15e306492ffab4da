//! Reasons why a scene calls for an effect, or why the effect is exactly zero in it: one sentence each, made from the scene.

use std::sync::Arc;

use super::effect_kind::EffectKind;
use crate::guide::Section;
use crate::optics::{Diffuser, Surface};
use crate::scene::{Channels, Daylight, Scene, Tube, TubeShape};
use crate::sky::{Horizon, Surroundings};

/// Scene without the parts that a document leaves out.
#[derive(Clone, Copy, Debug)]
pub struct Remaining<'a> {
    /// Scene with everything in it.
    pub scene: &'a Scene,
    /// True if the scene's boxes and meshes stay.
    pub objects: bool,
    /// True if specular reflection stays.
    pub glossy: bool,
    /// Time for which the scene is computed.
    pub span: Span,
}

/// Time for which a scene is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Span {
    /// A moment: sky and sun are those of the scene.
    #[default]
    Moment,
    /// A year: each of its moments has a sky and a sun of its own, and the scene has the sky of daylight factors.
    Year,
}

impl<'a> Remaining<'a> {
    /// Returns the surfaces of the room and of the objects that stay.
    fn surfaces(&self) -> impl Iterator<Item = &'a Surface> {
        let room = &self.scene.room;
        let (boxes, meshes) = if self.objects { (&room.boxes[..], &room.meshes[..]) } else { (&[][..], &[][..]) };
        let of_boxes = boxes.iter().map(|object| &object.surface);
        let of_meshes = meshes.iter().flat_map(|object| &object.surfaces);
        room.enclosure.surfaces().chain(of_boxes).chain(of_meshes)
    }

    fn interreflection(&self) -> Result<String, String> {
        let albedo = |surface: &Surface| if self.glossy { surface.albedo() } else { surface.reflectance };
        let brightest = self.surfaces().flat_map(albedo).fold(0.0, f64::max);
        let all = if self.objects && self.glossy { "" } else { "apart from what is left out, " };
        match brightest > 0.0 {
            true => Ok(format!("{all}surfaces reflect up to {:.0} %", 100.0 * brightest)),
            false => Err(format!("{all}every surface is black")),
        }
    }

    fn glossy(&self) -> Result<String, String> {
        let specular = || self.surfaces().filter_map(|surface| surface.specular);
        let brightest = specular().flat_map(|specular| specular.reflectance).fold(0.0, f64::max);
        let smoothest = specular().map(|specular| specular.roughness).fold(f64::INFINITY, f64::min);
        let of = format!("specular reflectances up to {:.0} %", 100.0 * brightest);
        if brightest <= 0.0 {
            Err(match self.objects {
                true => "every surface is diffuse".to_owned(),
                false => "every face of the room is diffuse, and its objects are left out".to_owned(),
            })
        } else if smoothest == 0.0 {
            Ok(format!("mirrors among the surfaces; {of}"))
        } else {
            Ok(format!("glossy surfaces of roughness {smoothest} and more; {of}"))
        }
    }

    /// Returns the reason why an effect is needed, or (as an error) why it is exactly zero.
    pub fn calls_for(&self, kind: EffectKind) -> Result<String, String> {
        let scene = self.scene;
        match kind {
            EffectKind::Sky => sky(scene, self.span),
            EffectKind::Sun => sun(scene, self.span),
            EffectKind::Luminaires => luminaires(scene),
            EffectKind::Interreflection => self.interreflection(),
            EffectKind::Objects => objects(scene),
            EffectKind::SpecularClosure => specular_closure(scene),
            EffectKind::GuideReturn => guide_return(scene),
            EffectKind::Colour => match scene.channels {
                Channels::Photopic => Err("every coefficient is one number: one photopic channel".to_owned()),
                Channels::Rgb => Ok("a coefficient is given as red, green, blue".to_owned()),
            },
            EffectKind::Glossy => self.glossy(),
            EffectKind::Horizon => horizon(scene),
        }
    }
}

const BELOW_HORIZON: &str = "the sun is at or below the horizon";

/// Returns the reason why a scene has no daylight at all, or `None` if it has some.
fn no_daylight(scene: &Scene) -> Option<&'static str> {
    match (&scene.daylight, scene.tubes.is_empty()) {
        (_, true) => Some("no tube leads daylight into the room"),
        (None, false) => Some("the document describes no sky"),
        (Some(_), false) => None,
    }
}

fn sky(scene: &Scene, span: Span) -> Result<String, String> {
    let nothing = no_daylight(scene);
    match (nothing, scene.daylight.as_ref().and_then(|daylight| daylight.sky.as_ref())) {
        (Some(nothing), _) => Err(nothing.to_owned()),
        (None, None) => Err(BELOW_HORIZON.to_owned()),
        (None, Some(sky)) if sky.zenith_luminance_cd_m2 == 0.0 && !scene.tubes.iter().any(sees_bright_ground) => {
            Err("the sky's luminance is zero".to_owned())
        }
        (None, Some(sky)) => {
            let sky_type = sky.distribution.sky_type();
            Ok(match span {
                Span::Moment => sky_type.to_string(),
                Span::Year => {
                    format!("the year has the sky of every moment, the grids' own values have one: {sky_type}")
                }
            })
        }
    }
}

fn sun(scene: &Scene, span: Span) -> Result<String, String> {
    if let Some(nothing) = no_daylight(scene) {
        return Err(nothing.to_owned());
    }
    if span == Span::Year {
        return Ok("the year has the sun of every moment; the sky of the grids' own values has none".to_owned());
    }
    let is_covered = |daylight: &Daylight| {
        daylight.sun.is_some() && scene.tubes.iter().all(|tube| daylight.before(tube).1.is_none())
    };
    if scene.daylight.as_ref().is_some_and(is_covered) {
        return Err("the horizon covers the sun's disc".to_owned());
    }
    match scene.daylight.as_ref().map(|daylight| (&daylight.sun, &daylight.sky)) {
        Some((Some(sun), _)) => Ok(format!("a beam of {:.0} lx normal illuminance", sun.normal_illuminance_lux)),
        Some((None, Some(_))) => {
            Err("no direct sunlight: the sky type has none, or its illuminance was given as 0".to_owned())
        }
        Some((None, None)) | None => Err(BELOW_HORIZON.to_owned()),
    }
}

fn horizon(scene: &Scene) -> Result<String, String> {
    if let Some(nothing) = no_daylight(scene) {
        return Err(nothing.to_owned());
    }
    let daylight = scene.daylight.as_ref();
    let Some((daylight, sky)) = daylight.and_then(|daylight| Some((daylight, daylight.sky.as_ref()?))) else {
        return Err(BELOW_HORIZON.to_owned());
    };
    // equal ones are shared, one after the other
    let mut around: Vec<&Arc<Surroundings>> =
        scene.tubes.iter().filter_map(|tube| tube.surroundings.as_ref()).collect();
    around.dedup_by(|a, b| Arc::ptr_eq(a, b));
    let horizons = || around.iter().filter_map(|around| around.horizon.as_ref());
    let largest = |of: &dyn Fn(&Horizon) -> f64| horizons().map(of).reduce(f64::max);
    let Some(highest) = largest(&Horizon::largest_altitude) else {
        return Err("no part of the horizon is above 0 degrees".to_owned());
    };
    let hidden = largest(&|horizon| horizon.hidden_fraction(&sky.distribution)).unwrap_or(0.0);
    let mut reason = format!(
        "a horizon up to {:.1} degrees hides {}{:.1} % of the sky's horizontal illuminance",
        highest.to_degrees(),
        if around.len() > 1 { "up to " } else { "" },
        100.0 * hidden
    );
    if let Some(sun) = &daylight.sun {
        let covered = largest(&|horizon| 1.0 - horizon.uncovered(sun)).unwrap_or(0.0);
        reason.push_str(&format!(" and {:.0} % of the sun's disc", 100.0 * covered));
    }
    let parallax = around.iter().map(|around| around.parallax).fold(0.0, f64::max);
    if parallax > 0.0 {
        reason.push_str(&format!(
            "; it is that of the centre of each upper end, across which the outlines of obstructions shift by up to {:.1} degrees",
            parallax.to_degrees()
        ));
    }
    Ok(reason)
}

/// True if the surroundings of a tube have light of the ground.
fn sees_bright_ground(tube: &Tube) -> bool {
    tube.surroundings.as_ref().is_some_and(|around| around.ground_luminance_cd_m2 > 0.0)
}

fn luminaires(scene: &Scene) -> Result<String, String> {
    let lit = scene.room.luminaires.iter().filter(|luminaire| luminaire.luminance.iter().any(|l| *l > 0.0));
    match (scene.room.luminaires.len(), lit.count()) {
        (0, _) => Err("the room has no luminaires".to_owned()),
        (_, 0) => Err("the luminance of every luminaire is zero".to_owned()),
        (_, count) => Ok(format!("{count} in the room")),
    }
}

fn objects(scene: &Scene) -> Result<String, String> {
    match (scene.room.boxes.len() + scene.room.meshes.len(), scene.room.luminaires.len()) {
        (0, 0) => Err("the room is empty: nothing but its own faces stands between two of its points".to_owned()),
        (0, _) => Err("the room has no boxes and no meshes, but its luminaires still block light".to_owned()),
        (count, _) => Ok(format!("{count} in the room")),
    }
}

/// True if some light passes a closure unscattered.
fn is_clear(tube: &Tube) -> bool {
    let passes = match &tube.diffuser {
        Diffuser::Open => true,
        Diffuser::Clear { transmittance } | Diffuser::Mixed { clear_transmittance: transmittance, .. } => {
            *transmittance != [0.0; 3]
        }
        Diffuser::Lambertian { .. } | Diffuser::Measured(_) => false,
    };
    passes && tube.diffuser.specular_zone(tube.opening_radius).is_some()
}

fn specular_closure(scene: &Scene) -> Result<String, String> {
    match scene.tubes.iter().filter(|tube| is_clear(tube)).count() {
        _ if scene.tubes.is_empty() => Err("the room has no tubes".to_owned()),
        0 => Err("no closure passes light unscattered".to_owned()),
        count => Ok(format!("{count} of {} closures pass light unscattered", scene.tubes.len())),
    }
}

/// Returns the feature by which a tube can send light back down that enters it from below; `None` if it cannot.
pub(super) fn returns(tube: &Tube) -> Option<&'static str> {
    match &tube.shape {
        TubeShape::Cylinders(cylinders) if cylinders.collector.reflects() => Some("dielectric domes"),
        TubeShape::Cylinders(cylinders) => (cylinders.bends() > 0).then_some("bent guides"),
        TubeShape::Mesh(mesh) => match mesh.section {
            Section::Cylinder(_) => None,
            Section::Bend(_) => Some("bent guides"),
            Section::Facets { .. } => Some("meshed guides"),
        },
    }
}

fn guide_return(scene: &Scene) -> Result<String, String> {
    let mut returning: Vec<_> = scene.tubes.iter().filter_map(returns).collect();
    let count = returning.len();
    returning.sort_unstable();
    returning.dedup();
    match returning.is_empty() {
        _ if scene.tubes.is_empty() => Err("the room has no tubes".to_owned()),
        true => Err("every guide is straight and leads all light that enters from below out at the top".to_owned()),
        false => Ok(format!(
            "{count} of {} tubes ({}) send part of the light that enters from below back down",
            scene.tubes.len(),
            returning.join(", ")
        )),
    }
}
