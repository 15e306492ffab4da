//! Effects of light that a plan decides on.

/// Effect of light that can be simulated or left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum EffectKind {
    /// Diffuse light of the sky.
    Sky,
    /// Direct beam of the sun.
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
    /// Horizon that hides a part of the sky and the sun.
    Horizon,
}

impl EffectKind {
    /// All effects, in the order of plans and results.
    pub const ALL: [Self; 10] = [
        Self::Sky,
        Self::Sun,
        Self::Luminaires,
        Self::Interreflection,
        Self::Objects,
        Self::SpecularClosure,
        Self::GuideReturn,
        Self::Colour,
        Self::Glossy,
        Self::Horizon,
    ];

    /// Returns the name in documents and results.
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
            Self::Horizon => "horizon",
        }
    }

    /// Returns the effect with a name in documents; `None` for any other word.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// True if a document may switch the effect off; clear closures, colours and the horizon are part of the scene and
    /// cannot be.
    pub fn can_be_left_out(self) -> bool {
        !matches!(self, Self::SpecularClosure | Self::Colour | Self::Horizon)
    }

    /// True if a document may switch the effect on where the scene does not call for it: rays are then traced for it without result. This
    /// is not possible for sources of light that a scene does not have, for clear closures, for colours and for the horizon.
    pub fn can_be_followed_in_vain(self) -> bool {
        matches!(self, Self::Interreflection | Self::Objects | Self::GuideReturn | Self::Glossy)
    }
}
