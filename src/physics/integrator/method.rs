//! What the rest of the program has to know of a method, and what it gives back.
//!
//! Every method's own settings implement [`Described`]; `registry` has the one list of methods. The plan asks what a
//! method knows, what it refuses and what it costs; a job lets it be built. Nobody else asks which method it is.

use std::fmt;
use std::sync::Arc;

use glam::DVec3;

use super::Integrator;
use super::trial::TrialPasses;
use crate::analytic::Solver;
use crate::scene::{EstimateKind, Grid, Scene, View};
use crate::traceable::TraceableScene;

/// A method with its settings, as the plan and a job see it; implemented by the `Settings` of every method.
pub trait Described: Send + Sync {
    /// Name of the method in documents and results.
    fn name(&self) -> &'static str;

    /// What its results contain.
    fn knows(&self) -> Knows {
        Knows::ALL
    }

    /// True if it can tell what sensors get per lumen of each patch of the openings.
    fn tells_responses(&self) -> bool {
        false
    }

    /// How its passes depend on each other.
    fn passes(&self) -> Passes {
        Passes::Independent
    }

    /// Sentence of the plan about the method, where its name and its settings do not say all.
    fn remark(&self) -> Option<&'static str> {
        None
    }

    /// Why it cannot compute a task, if it cannot. Outputs that it does not know need not be looked at.
    fn refuses(&self, _task: &Task) -> Option<Refusal> {
        None
    }

    /// What a reader of its results of a task must know.
    fn warns(&self, _task: &Task) -> Option<Caveat> {
        None
    }

    /// Bytes that a pass works with beside its outputs, from above.
    fn working_bytes(&self, _load: &Load) -> f64 {
        0.0
    }

    /// What it keeps of each sensor of a grid.
    fn kept_of_sensor(&self, _grid: &Grid) -> Kept {
        Kept::MEANS
    }

    /// What it keeps of each pixel of a view.
    fn kept_of_pixel(&self) -> Kept {
        Kept::MEANS
    }

    /// The method with passes that are small enough for a trial of a task that it does not refuse: of grids, or of views. It tells of
    /// the passes for a relative standard error `target`.
    fn trial(&self, task: &Task, target: f64) -> Trial;

    /// The method on a task that it does not refuse.
    ///
    /// `target` is the relative standard error asked for: passes end by it, a solver stops refining at it.
    fn build(&self, task: &Task, seed: u64, target: f64) -> Computation;
}

/// A method for a trial.
pub struct Trial {
    /// The method with small passes.
    pub method: Box<dyn Described>,
    /// Most sensors, or pixels, at which a trial looks: more of them would take too long.
    pub most_places: usize,
    /// What its passes tell of those of the method itself.
    pub passes: TrialPasses,
}

impl Trial {
    /// The method as it is, on `most_places` sensors or pixels at most.
    pub fn whole(method: impl Described + 'static, most_places: usize) -> Self {
        Self { method: Box::new(method), most_places, passes: TrialPasses::WHOLE }
    }

    /// The same with these passes.
    pub fn with(self, passes: TrialPasses) -> Self {
        Self { passes, ..self }
    }
}

/// What is asked of a method.
#[derive(Clone, Copy, Debug)]
pub struct Task<'a> {
    /// The scene as its document describes it.
    pub scene: &'a Scene,
    /// The same scene as rays need it, with the effects that are on.
    pub traceable: &'a Arc<TraceableScene>,
    /// Grids of the scene that the method has to compute.
    pub grids: &'a [Grid],
    /// Views of the scene that the method has to compute.
    pub views: &'a [View],
}

impl<'a> Task<'a> {
    /// All outputs of a scene.
    pub fn whole(scene: &'a Scene, traceable: &'a Arc<TraceableScene>) -> Self {
        Self { scene, traceable, grids: &scene.grids, views: &scene.views }
    }

    /// The grids of this task alone.
    pub fn without_views(self) -> Self {
        Self { views: &[], ..self }
    }

    /// The views of this task alone.
    pub fn without_grids(self) -> Self {
        Self { grids: &[], ..self }
    }

    /// True if a grid asks for the illuminance at points, not for averages over cells.
    pub fn has_points(&self) -> bool {
        self.grids.iter().any(|grid| grid.estimate == EstimateKind::Point)
    }

    /// True if sensors do not look up, or do not lie in one level plane.
    pub fn has_placed_sensors(&self) -> bool {
        self.grids.iter().any(|grid| grid.placed.is_some())
    }
}

/// A method on a scene, ready to compute.
pub enum Computation {
    /// Independent passes, or passes in order, that an estimate adds up.
    Passes(Box<dyn Integrator>),
    /// Everything in one computation.
    Solution(Box<dyn Solver>),
}

impl Computation {
    /// A method that is computed pass by pass.
    pub fn passes(integrator: impl Integrator + 'static) -> Self {
        Self::Passes(Box::new(integrator))
    }

    /// A method that is solved at once.
    pub fn solution(solver: impl Solver + 'static) -> Self {
        Self::Solution(Box::new(solver))
    }
}

/// What the results of a method contain beside the illuminance of grids, which every method computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Knows {
    /// The luminance of views.
    pub views: bool,
    /// The balance of energy: light is followed from its sources to its end.
    pub energy: bool,
    /// The fluxes of tubes.
    pub tube_fluxes: bool,
    /// Sensors that do not look up, or do not lie in one level plane.
    pub any_sensors: bool,
}

/// How the passes of a method depend on each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Passes {
    /// Each is a replicate by itself.
    Independent,
    /// Each goes on from what those before it left.
    InOrder,
    /// There are none: everything is solved at once.
    None,
}

impl Knows {
    /// Everything that a result can have, at level sensors that look up.
    pub const ALL: Self = Self { views: true, energy: true, tube_fluxes: true, any_sensors: false };
}

/// Why a method cannot compute what is asked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{detail}")]
pub struct Refusal {
    /// Kind of the reason, for programs.
    pub code: RefusalCode,
    /// Reason for people; a sentence without a full stop.
    pub detail: String,
    /// What the document could ask for instead, beside another method.
    pub instead: Option<&'static str>,
}

impl Refusal {
    /// A refusal without a hint what to ask for instead.
    pub fn new(code: RefusalCode, detail: impl Into<String>) -> Self {
        Self { code, detail: detail.into(), instead: None }
    }

    /// The same refusal with something else that the document could ask for.
    pub fn or(self, instead: &'static str) -> Self {
        Self { instead: Some(instead), ..self }
    }
}

/// Declares the kinds of refusals with their codes.
macro_rules! refusal_codes {
    ($($(#[doc = $doc:literal])* $code:ident = $text:literal,)*) => {
        /// Kinds of reasons for which methods refuse a task.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum RefusalCode {
            $($(#[doc = $doc])* $code,)*
        }

        impl RefusalCode {
            /// Every kind that there is.
            pub const ALL: &[Self] = &[$(Self::$code),*];

            /// The code as text, for machines.
            pub fn code(self) -> &'static str {
                match self {
                    $(Self::$code => $text,)*
                }
            }
        }
    };
}

refusal_codes! {
    /// Views are asked of a method that computes grids.
    GridsOnly = "grids_only",
    /// Sunlight through clear closures would be found by chance only.
    SunThroughClearClosures = "sun_through_clear_closures",
    /// Sunlight by way of mirrors or of nearly smooth surfaces would be found by chance only.
    SunByMirrors = "sun_by_mirrors",
    /// Points cannot find light that a mirror reflects.
    MirrorsAtPoints = "mirrors_at_points",
    /// Points lie so near to a surface that their standard error would not tell the truth.
    PointsNearSurfaces = "points_near_surfaces",
    /// Light passes the closure of a tube unscattered.
    ClearClosures = "clear_closures",
    /// Light passes the closure of a tube that is not straight unscattered.
    ClearClosuresOfBentTubes = "clear_closures_of_bent_tubes",
    /// A diffuser is a measured table.
    MeasuredDiffusers = "measured_diffusers",
    /// A grid asks for averages over cells.
    CellAverages = "cell_averages",
    /// Coefficients are colours.
    Colours = "colours",
    /// A tube is given as a mesh.
    MeshTubes = "mesh_tubes",
    /// A collector bends light.
    RefractingCollectors = "refracting_collectors",
    /// The reflectance of a tube's mirror depends on the angle.
    MirrorsByAngle = "mirrors_by_angle",
    /// The room contains objects.
    Objects = "objects",
    /// The room contains luminaires.
    Luminaires = "luminaires",
    /// Surfaces are glossy or mirrors.
    SpecularSurfaces = "specular_surfaces",
    /// Nothing in the room absorbs light.
    LosslessRoom = "lossless_room",
    /// The room is no box.
    RoomShape = "room_shape",
    /// Sensors do not look up, or do not lie in one level plane.
    PlacedSensors = "placed_sensors",
    /// Interreflection is switched off.
    InterreflectionOff = "interreflection_off",
    /// Passes are in order or there are none, where independent ones are needed.
    DependentPasses = "dependent_passes",
    /// Responses are asked of a method that does not tell them.
    NoResponses = "no_responses",
    /// No other method computes the grids with errors that are honest here.
    NoSecondMethod = "no_second_method",
    /// A setting of the method that has no default is missing.
    SettingMissing = "setting_missing",
}

impl fmt::Display for RefusalCode {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str(self.code())
    }
}

/// What a reader of a method's results must know.
#[derive(Clone, Debug, PartialEq)]
pub struct Caveat {
    /// Kind of the caveat, for programs.
    pub code: CaveatCode,
    /// Sentence for people.
    pub detail: String,
}

/// Kinds of caveats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CaveatCode {
    /// Light by way of mirrors is found by chance only.
    MirrorsByChance,
    /// Some of the light by way of mirrors is found by rare and bright paths.
    MirrorsRarely,
    /// A formula returns more flux than it is given.
    FluxExcess,
    /// Kernels are not clipped everywhere where things stand on things.
    KernelsNotCut,
}

/// What a pass has to hold in memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// Edges of the room in metres.
    pub size: DVec3,
    /// Number of channels of light, 1 or 3.
    pub channels: usize,
    /// Number of grids of the job.
    pub grids: usize,
    /// Number of views of the pass.
    pub views: usize,
    /// Mean number of surfaces that a photon meets in the room, from above.
    pub events: f64,
    /// True if sunlight enters the room unscattered.
    pub sunbeams: bool,
    /// Number of sensors of all grids where light comes in beside lamps, which is traced; 0 where all tubes are lamps.
    pub sensors_beside: usize,
}

impl Load {
    /// Copies of kept photons and vertices that are alive together: in one growing list, and sorted.
    pub const COPIES: f64 = 2.5;

    /// Bytes of one photon: place, direction or normal, and its flux in every channel.
    pub fn photon_bytes(&self) -> f64 {
        32.0 + 8.0 * self.channels as f64
    }
}

/// What a method keeps of a sensor or pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kept {
    /// Number of points of a sensor or pixel whose values a pass holds.
    pub points: f64,
    /// Number of contrasts among fixed points, each with a running mean.
    pub contrasts: f64,
    /// Number of points whose gather radius goes from pass to pass.
    pub radii: f64,
    /// Number of sums that chunks of photons hold at the same time.
    pub sums_at_once: f64,
}

impl Kept {
    /// The running means alone.
    pub const MEANS: Self = Self { points: 1.0, contrasts: 0.0, radii: 0.0, sums_at_once: 1.0 };
}
