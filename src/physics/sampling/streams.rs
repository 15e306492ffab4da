//! Purposes of random numbers, with a name and a range of child keys for each.
//!
//! Keys form a tree: seed, pass, purpose, index, and so on to the single path. If the children of a key serve several purposes, each
//! purpose has a range of child numbers, from `first` on and as many as its `room`. The table below lists the kinds of keys under which a
//! purpose is used, and a test verifies that no two purposes share a number there. Equal numbers under different parents are different
//! keys.

use super::random::Key;

/// Kind of key whose children serve several purposes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parent {
    /// Seed of a job.
    Seed,
    /// Pass of light tracing.
    LightTracingPass,
    /// Pass of path tracing.
    PathTracingPass,
    /// Pass of the two-stage method.
    TwoStagePass,
    /// Pass of bidirectional path tracing.
    BidirectionalPass,
    /// Pass of a method that gathers photons.
    GatheringPass,
    /// Pass of many moments.
    MomentPass,
    /// Moment, or patch of the sky, in a pass of many moments.
    Moment,
    /// Grid in a pass of the two-stage method.
    TwoStageGrid,
    /// Sensor in a pass of the two-stage method; the numbers of its paths are under the same key.
    TwoStageSensor,
    /// Sensor in a pass of bidirectional path tracing; the numbers of its paths are under the same key.
    BidirectionalSensor,
    /// Sensor in a pass of photon mapping.
    GatheringSensor,
    /// Paths of one sensor, pixel or source.
    Paths,
    /// Tube, seen from a sensor.
    TubeFromBelow,
    /// Seed of HOLIGILM, which has no passes.
    HoligilmSeed,
    /// Randomisation of one tube's light in HOLIGILM.
    HoligilmReplica,
    /// Report on a tube's performance.
    TubeReport,
    /// Replicate of light through a tube: its rays fit into the first block of [`Stream::Replicate`], number 0.
    ThroughputReplicate,
}

macro_rules! streams {
    ($($(#[$doc:meta])+ $name:ident = $first:expr, $room:expr, below [$($parent:ident),+];)+) => {
        /// Purpose for which random numbers are drawn.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Stream {
            $($(#[$doc])+ $name,)+
        }

        impl Stream {
            /// All purposes, in the order of the table; tests compare each with every other.
            pub const ALL: &[Self] = &[$(Self::$name),+];

            /// Returns the number of the purpose's first child.
            #[inline]
            pub const fn first(self) -> u64 {
                match self {
                    $(Self::$name => $first,)+
                }
            }

            /// Returns the largest number of children that the purpose may have under one key.
            #[inline]
            pub const fn room(self) -> u64 {
                match self {
                    $(Self::$name => $room,)+
                }
            }

            /// Returns the kinds of keys under which the purpose is used.
            pub const fn parents(self) -> &'static [Parent] {
                match self {
                    $(Self::$name => &[$(Parent::$parent),+],)+
                }
            }
        }
    };
}

/// Largest number of tubes, grids, views, sensors, pixels or points under one key.
const MANY: u64 = 1 << 31;

streams! {
    /// One pass; the index is its number.
    Pass = 0, 1 << 62, below [Seed];
    /// One pass of a room's responses, which do not depend on sky and sun; the index is its number. The second half of the numbers is that of
    /// trials.
    RoomPass = 1 << 62, 1 << 62, below [Seed];
    /// One pass of many moments; the index is its number.
    MomentPass = 3 << 62, 1 << 61, below [Seed];
    /// Points that are the same in every pass.
    FixedPoints = u64::MAX, 1, below [Seed];
    /// Choice, for all passes, of the photons of an opening that a sensor is connected to if something may hide the opening; the index is
    /// the grid's, and sensors and tubes are numbered below it.
    EvenConnections = 1 << 63, MANY, below [Seed];
    /// Rays and connections of the patches of a coarse solution.
    PatchRays = 5 << 61, 1, below [Seed];
    /// A small pass from which the size of passes is chosen; the index is its number.
    SizeTrial = u64::MAX - (1 << 32), 1 << 32, below [Seed];

    /// Photons of one source; the index is the source's.
    Emission = 0, MANY, below [LightTracingPass, TwoStagePass, BidirectionalPass, GatheringPass, Moment];
    /// Light of one patch of the sky; the index is the patch's.
    OfPatch = 0, MANY, below [MomentPass];
    /// Light of the sun at one moment; the index is the moment's.
    OfMoment = 1 << 33, MANY, below [MomentPass];
    /// Choice among the photons of a diffuser; the index is the tube's.
    DiffuserChoice = 1 << 35, MANY, below [TwoStagePass];
    /// Photons that estimate where the light in the room ends, for the energy balance: their paths, their choice, those of luminaires.
    RoomBalance = 1 << 38, 3, below [TwoStagePass];
    /// Connections of photons to sensors, numbered by photons below it.
    Connections = 1 << 35, 1, below [BidirectionalPass];

    /// Paths from one grid; the index is the grid's.
    Grid = 1 << 32, MANY, below [PathTracingPass, TwoStagePass, BidirectionalPass];
    /// Paths from one view; the index is the view's.
    View = 1 << 33, MANY, below [PathTracingPass, TwoStagePass, BidirectionalPass];
    /// Rays of the sun that are connected to the eye of a view; the index is the view's.
    SunToEye = 1 << 34, MANY, below [PathTracingPass];

    /// Gathering of light for one view; the index is the view's.
    GatheringView = 1 << 32, MANY, below [GatheringPass];
    /// Gathering of light for one grid; the index is the grid's.
    GatheringGrid = 1 << 33, MANY, below [GatheringPass];
    /// Rays that look for direct light from sources in the pixels of one view; the index is the view's.
    StraightToEye = 1 << 34, MANY, below [GatheringPass];
    /// Gather rays of one receiver; the index distinguishes the receivers of a path.
    Gather = 1, MANY, below [GatheringSensor];

    /// Light that reaches a sensor through clear closures; the index is the sensor's if one key has several.
    Unscattered = 1 << 32, MANY, below [LightTracingPass, GatheringSensor, MomentPass, Moment];
    /// Light that reaches a sensor of bidirectional path tracing through clear closures.
    UnscatteredBidirectional = 1 << 34, 1, below [BidirectionalSensor];
    /// Light that reaches a sensor through clear closures where other closures are Lambertian; the index is the sensor's.
    UnscatteredTwoStage = 1 << 39, MANY, below [TwoStagePass];
    /// Random point of a cell for the closed form of luminaires; the index is the sensor's.
    CellPoint = 1 << 33, MANY, below [LightTracingPass];
    /// Sky light through a tube.
    SkyFromBelow = 0, 1, below [TubeFromBelow];
    /// Sunlight through a tube.
    SunFromBelow = 1, 1, below [TubeFromBelow];

    /// Paths of one sensor; the index is the sensor's.
    Sensor = 0, MANY, below [TwoStageGrid];
    /// Random shift of the directions of a sensor's paths where most of them end at the first surface.
    GatherDirections = 1 << 37, 1, below [Paths, TwoStageSensor];
    /// Points of a sensor and of patches of openings for direct light between them.
    StraightFromPatches = 1 << 35, 1, below [TwoStageSensor];
    /// Choice of the photons of a diffuser that a sensor is connected to; the index is the tube's.
    PartlySeen = 1 << 36, MANY, below [TwoStageSensor];
    /// Connections of a sensor to a luminaire; the index is the luminaire's.
    StraightFromLuminaires = 1 << 38, MANY, below [TwoStageSensor];
    /// Connections of a sensor by way of mirrors, numbered by chains of these below it.
    StraightByMirrors = 1 << 39, 1, below [TwoStageSensor];
    /// Offsets within cells for the photons of a diffuser; the index is the tube's.
    CellOffsets = 1 << 36, MANY, below [TwoStageGrid];

    /// Light that comes in through one tube, numbered by randomisations below it; the index is the tube's.
    TubeLight = 0, MANY, below [HoligilmSeed];
    /// Sky light that sensors see through clear zones, numbered by grids, sensors, tubes and randomisations below it.
    SkyThroughApertures = 1 << 32, 1, below [HoligilmSeed];
    /// Sky light followed down through a tube.
    SkyBeam = 0, 1, below [HoligilmReplica];
    /// Shape of the sky light's profile on a Lambertian zone.
    SkyProfile = 1, 1, below [HoligilmReplica];
    /// Sunlight followed down through a tube.
    SunBeam = 2, 1, below [HoligilmReplica];

    /// Transmission of a tube under a uniform sky.
    ReportUniformSky = 1, 1, below [TubeReport];
    /// Transmission of a tube under the job's sky.
    ReportSky = 2, 1, below [TubeReport];
    /// Transmission of a tube under the job's sky as beams of its patches, numbered by patches below it.
    ReportSkyPatches = 3, 1, below [TubeReport];
    /// Transmission of a tube under the job's sun.
    ReportSun = 4, 1, below [TubeReport];
    /// Transmission of beams, numbered by altitudes and azimuths below it.
    ReportBeams = 5, 1, below [TubeReport];
    /// Choices at covers that reflect, one after the other for all rays of a replicate.
    ThroughputChoices = 1, 1, below [ThroughputReplicate];

    /// Randomisation of the Sobol sequence for a block of paths; the index is the block's.
    Replicate = 0, MANY, below [Paths, BidirectionalSensor, TwoStageSensor];
    /// Points within their pixels at which the paths of a view begin.
    PlacesInPixels = 1 << 41, 1, below [Paths];
    /// Pseudo-random numbers of paths, numbered by paths below it.
    PseudoRandom = 1 << 40, 1, below [Paths, BidirectionalSensor, TwoStageSensor];
}

impl Key {
    /// Returns the key for a purpose under this one; `index` is less than the purpose's room.
    #[inline]
    pub fn stream(self, stream: Stream, index: u64) -> Self {
        debug_assert!(index < stream.room(), "{stream:?} has no room for {index}");
        self.child(stream.first() + index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_purposes_under_one_key_share_a_number() {
        for (index, one) in Stream::ALL.iter().enumerate() {
            let last = one.first().checked_add(one.room() - 1);
            assert!(last.is_some(), "{one:?} runs over");
            for other in &Stream::ALL[index + 1..] {
                if one.parents().iter().any(|parent| other.parents().contains(parent)) {
                    let (low, high) = if one.first() < other.first() { (one, other) } else { (other, one) };
                    assert!(high.first() - low.first() >= low.room(), "{one:?} and {other:?} share numbers");
                }
            }
        }
    }

    #[test]
    fn a_stream_is_the_child_with_its_number() {
        let key = Key::new(5);
        assert_eq!(key.stream(Stream::Grid, 3), key.child((1 << 32) + 3));
        assert_eq!(key.stream(Stream::FixedPoints, 0), key.child(u64::MAX));
        assert_eq!(key.stream(Stream::PseudoRandom, 0), key.child(1 << 40));
    }
}
