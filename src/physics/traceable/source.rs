//! Sources of light.

/// A kind of source of a scene's light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The sky without the sun's disc.
    Sky,
    /// The sun's disc.
    Sun,
    /// The luminaires of the room.
    Luminaires,
}

impl Source {
    /// All kinds of sources.
    pub const ALL: [Self; 3] = [Self::Sky, Self::Sun, Self::Luminaires];

    /// True if the light enters the room through tubes.
    pub fn is_daylight(self) -> bool {
        self != Self::Luminaires
    }
}
