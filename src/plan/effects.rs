//! Effects that a scene may call for, each on or off with its reason.

use std::collections::BTreeMap;

use crate::guide::Section;
use crate::optics::Surface;
use crate::scene::{Channels, Scene, TubeShape};

/// An effect of light that can be simulated or left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum EffectKind {
    /// Diffuse light of the sky.
    Sky,
    /// The sun's beam.
    Sun,
    /// Electric light.
    Luminaires,
    /// Light reflected between the room's surfaces.
    Interreflection,
    /// Shadows and reflections of objects in the room.
    Objects,
    /// Light that passes the diffuser without being scattered.
    SpecularClosure,
    /// Light that goes up through the diffuser into the guide and comes back.
    GuideReturn,
    /// Three colour channels instead of one.
    Colour,
    /// Glossy and mirror reflection at room surfaces.
    Glossy,
}

impl EffectKind {
    /// All effects, in the order of plans and results.
    pub const ALL: [Self; 9] = [
        Self::Sky,
        Self::Sun,
        Self::Luminaires,
        Self::Interreflection,
        Self::Objects,
        Self::SpecularClosure,
        Self::GuideReturn,
        Self::Colour,
        Self::Glossy,
    ];

    /// The name in documents and results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sky => "sky",
            Self::Sun => "sun",
            Self::Luminaires => "luminaires",
            Self::Interreflection => "interreflection",
            Self::Objects => "objects",
            Self::SpecularClosure => "specular_closure",
            Self::GuideReturn => "guide_return",
            Self::Colour => "colour",
            Self::Glossy => "glossy",
        }
    }

    /// The effect of a name in documents; `None` for any other word.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// True if a document may switch the effect off; closures and colours are what the scene is made of.
    pub fn can_be_left_out(self) -> bool {
        !matches!(self, Self::SpecularClosure | Self::Colour)
    }
}

/// Wish of a document about an effect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EffectRequest {
    /// Simulate the effect where the scene calls for it, like `Auto`.
    On,
    /// Leave the effect out, where that is allowed; the plan then bounds no error.
    Off,
    /// Simulate the effect where the scene calls for it.
    #[default]
    Auto,
}

/// One effect of the plan, on or off, with its reason.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectPlan {
    /// The effect that is meant.
    pub kind: EffectKind,
    /// True if the effect is simulated.
    pub on: bool,
    /// One sentence for the reader of a plan.
    pub reason: String,
    /// When off: the largest share of any illuminance that is left out, 0 where the effect is exactly zero by physics;
    /// `None` when on, or when switched off by request at an unknown cost.
    pub bound: Option<f64>,
}

/// All effects, in the order of [`EffectKind::ALL`].
#[derive(Clone, Debug, Default)]
pub struct Effects {
    /// One entry per effect; empty before effects were decided.
    pub list: Vec<EffectPlan>,
}

/// Requests by effect; effects that are absent are `Auto`.
pub type EffectRequests = BTreeMap<EffectKind, EffectRequest>;

impl Effects {
    /// Decides every effect from what the scene calls for and what the document wishes.
    pub fn of(scene: &Scene, requests: &EffectRequests) -> Self {
        let list = EffectKind::ALL
            .into_iter()
            .map(|kind| {
                let request = requests.get(&kind).copied().unwrap_or_default();
                match (called_for(scene, kind), request) {
                    (Err(reason), _) => EffectPlan { kind, on: false, reason: reason.into(), bound: Some(0.0) },
                    (Ok(_), EffectRequest::Off) if kind.can_be_left_out() => {
                        EffectPlan { kind, on: false, reason: switched_off(kind).into(), bound: None }
                    }
                    (Ok(reason), _) => EffectPlan { kind, on: true, reason, bound: None },
                }
            })
            .collect();
        Self { list }
    }

    /// True if the effect is simulated.
    pub fn is_on(&self, kind: EffectKind) -> bool {
        self.list.iter().any(|effect| effect.kind == kind && effect.on)
    }
}

/// The reason of an effect that the document leaves out.
fn switched_off(kind: EffectKind) -> &'static str {
    match kind {
        EffectKind::Glossy => "switched off in the document: surfaces absorb the light of their `specular` share",
        _ => "switched off in the document",
    }
}

/// The surfaces of the room and its objects.
fn surfaces(scene: &Scene) -> impl Iterator<Item = &Surface> {
    let of_boxes = scene.room.boxes.iter().map(|object| &object.surface);
    let of_meshes = scene.room.meshes.iter().flat_map(|object| &object.surfaces);
    scene.room.surfaces.iter().flatten().chain(of_boxes).chain(of_meshes)
}

/// Reason why an effect is needed, or (as an error) why it is exactly zero.
fn called_for(scene: &Scene, kind: EffectKind) -> Result<String, &'static str> {
    let below_horizon = "the sun is at or below the horizon";
    let no_tube = "no tube leads daylight into the room";
    let daylight = scene.daylight.as_ref().filter(|_| !scene.tubes.is_empty());
    match kind {
        EffectKind::Sky => match daylight.map(|daylight| &daylight.sky) {
            None => Err(no_tube),
            Some(None) => Err(below_horizon),
            Some(Some(sky)) if sky.zenith_luminance_cd_m2 == 0.0 => Err("the sky's luminance is zero"),
            Some(Some(sky)) => Ok(sky.distribution.sky_type().to_string()),
        },
        EffectKind::Sun => match daylight.map(|daylight| (&daylight.sun, &daylight.sky)) {
            None => Err(no_tube),
            Some((Some(sun), _)) => Ok(format!("a beam of {:.0} lx normal illuminance", sun.normal_illuminance_lux)),
            Some((None, None)) => Err(below_horizon),
            Some((None, Some(_))) => Err("no direct beam: the sky type has none, or it was given as 0"),
        },
        EffectKind::Luminaires => {
            let lit = scene.room.luminaires.iter().filter(|luminaire| luminaire.luminance.iter().any(|l| *l > 0.0));
            match (scene.room.luminaires.len(), lit.count()) {
                (0, _) => Err("the room has no luminaires"),
                (_, 0) => Err("the luminance of every luminaire is zero"),
                (_, count) => Ok(format!("{count} in the room")),
            }
        }
        EffectKind::Interreflection => {
            let brightest = surfaces(scene).flat_map(Surface::albedo).fold(0.0, f64::max);
            if brightest > 0.0 {
                Ok(format!("surfaces reflect up to {:.0} %", 100.0 * brightest))
            } else {
                Err("every surface is black")
            }
        }
        EffectKind::Objects => match scene.room.boxes.len() + scene.room.meshes.len() {
            0 => Err("the room is empty, and a box is convex: nothing stands between two of its points"),
            count => Ok(format!("{count} in the room")),
        },
        EffectKind::SpecularClosure | EffectKind::GuideReturn if scene.tubes.is_empty() => Err("the room has no tubes"),
        EffectKind::SpecularClosure => {
            let clear = scene.tubes.iter().filter(|tube| tube.diffuser.specular_zone(tube.opening_radius).is_some());
            match clear.count() {
                0 => Err("every diffuser scatters all light that it passes"),
                count => Ok(format!("{count} of {} closures pass light unscattered", scene.tubes.len())),
            }
        }
        EffectKind::GuideReturn => {
            let returns = scene.tubes.iter().any(|tube| match &tube.shape {
                TubeShape::Cylinders(cylinders) => {
                    cylinders.segments.iter().any(|segment| segment.tilt != 0.0) || cylinders.collector.reflects()
                }
                TubeShape::Mesh(mesh) => matches!(mesh.section, Section::Facets { .. }),
            });
            if returns {
                Ok("bent and meshed guides and dielectric domes send part of the light that enters from below back down".into())
            } else {
                Err("straight guides lead all light that enters from below out at the top")
            }
        }
        EffectKind::Colour => match scene.channels {
            Channels::Photopic => Err("every coefficient is one number: one photopic channel"),
            Channels::Rgb => Ok("a coefficient is given as red, green, blue".into()),
        },
        EffectKind::Glossy => {
            let specular = || surfaces(scene).filter_map(|surface| surface.specular);
            let brightest = specular().flat_map(|specular| specular.reflectance).fold(0.0, f64::max);
            let smoothest = specular().map(|specular| specular.roughness).fold(f64::INFINITY, f64::min);
            if brightest <= 0.0 {
                Err("every room surface is diffuse")
            } else if smoothest == 0.0 {
                Ok(format!("mirrors among the surfaces; specular reflectances up to {:.0} %", 100.0 * brightest))
            } else {
                let of = format!("specular reflectances up to {:.0} %", 100.0 * brightest);
                Ok(format!("glossy surfaces of roughness {smoothest} and more; {of}"))
            }
        }
    }
}
