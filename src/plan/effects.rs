//! Effects that a scene may call for, each on or off with its reason.

use std::collections::BTreeMap;

/// An effect of light that can be simulated or left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum EffectKind {
    /// Diffuse light of the sky.
    Sky,
    /// The sun's beam.
    Sun,
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
    pub const ALL: [Self; 8] = [
        Self::Sky,
        Self::Sun,
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
            Self::Interreflection => "interreflection",
            Self::Objects => "objects",
            Self::SpecularClosure => "specular_closure",
            Self::GuideReturn => "guide_return",
            Self::Colour => "colour",
            Self::Glossy => "glossy",
        }
    }

    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }
}

/// What the document asks of an effect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EffectRequest {
    On,
    Off,
    #[default]
    Auto,
}

/// One effect of the plan.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectPlan {
    pub kind: EffectKind,
    pub on: bool,
    pub reason: String,
    /// When off although the scene has it: the largest share of any illuminance that is left out; `None` when the
    /// effect is exactly zero by physics, or was switched off by request.
    pub bound: Option<f64>,
}

/// All effects, in the order of [`EffectKind::ALL`].
#[derive(Clone, Debug, Default)]
pub struct Effects {
    pub list: Vec<EffectPlan>,
}

impl Effects {
    pub fn is_on(&self, kind: EffectKind) -> bool {
        self.list.iter().any(|effect| effect.kind == kind && effect.on)
    }
}

/// Requests by effect; effects that are absent are `Auto`.
pub type EffectRequests = BTreeMap<EffectKind, EffectRequest>;
