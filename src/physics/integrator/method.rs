//! Interface between a method and the rest of the program: its settings, its task, its refusals and caveats, and its memory.
//!
//! The settings of every method implement [`Described`]; `registry` has the one list of methods. The plan asks the settings what the method
//! computes, refuses and costs; a job builds the method from them. No other code matches on the kind of method.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::DVec3;

use super::Integrator;
use super::pass::LEAST_SHARE_OF_MEAN;
use super::radiosity::SharedExchanges;
use super::trial::TrialPasses;
use crate::analytic::Solver;
use crate::scene::{EstimateKind, Grid, Scene, View};
use crate::traceable::TraceableScene;

/// Method with its settings, as the plan and a job see it; implemented by the `Settings` of every method.
pub trait Described: Send + Sync {
    /// Returns the name of the method in documents and results.
    fn name(&self) -> &'static str;

    /// Returns the kinds of output that the method computes.
    fn outputs(&self) -> Outputs {
        Outputs::ALL
    }

    /// True if the method can estimate daylight coefficients: the illuminance of sensors per lumen from each patch of the openings.
    fn computes_responses(&self) -> bool {
        false
    }

    /// Returns how the method's passes depend on each other.
    fn passes(&self) -> Passes {
        Passes::Independent
    }

    /// Returns a sentence about the method for the plan, where its name and settings leave something unsaid.
    fn remark(&self) -> Option<&'static str> {
        None
    }

    /// Returns the reason why the method cannot compute a task; `None` if it can. Outputs that [`outputs`](Self::outputs) excludes need not
    /// be checked here.
    fn refuses(&self, _task: &Task) -> Option<Refusal> {
        None
    }

    /// Returns the caveat that a reader of the method's results of this task needs; `None` if there is none.
    fn warns(&self, _task: &Task) -> Option<Caveat> {
        None
    }

    /// Returns an upper bound of the bytes that a pass works with beside its outputs.
    fn working_bytes(&self, _load: &Load) -> f64 {
        0.0
    }

    /// Returns the amount of data that the method stores for each sensor of a grid.
    fn retained_per_sensor(&self, _grid: &Grid) -> Retained {
        Retained::MEANS
    }

    /// Returns the amount of data that the method stores for each pixel of a view.
    fn retained_per_pixel(&self) -> Retained {
        Retained::MEANS
    }

    /// Returns the method with passes that are small enough for a trial of a task, of grids or of views, that it does not refuse. From the
    /// trial the plan extrapolates to the passes for a relative standard error `target`.
    fn trial(&self, task: &Task, target: f64) -> Trial;

    /// Builds the method for a task that it does not refuse.
    ///
    /// `target` is the requested relative standard error: the passes end, or a solver stops refining, when it is reached.
    fn build(&self, task: &Task, seed: u64, target: f64) -> Computation;
}

/// Method as a trial runs it.
pub struct Trial {
    /// Method with small passes.
    pub method: Box<dyn Described>,
    /// Largest number of sensors or pixels that a trial computes: more of them would take too long.
    pub most_places: usize,
    /// Relation between the trial's passes and the passes of the method itself.
    pub passes: TrialPasses,
}

impl Trial {
    /// Makes a trial of the unchanged method on at most `most_places` sensors or pixels.
    pub fn whole(method: impl Described + 'static, most_places: usize) -> Self {
        Self { method: Box::new(method), most_places, passes: TrialPasses::WHOLE }
    }

    /// Returns this trial with other passes.
    pub fn with(self, passes: TrialPasses) -> Self {
        Self { passes, ..self }
    }
}

/// Outputs of a scene that a method is to compute.
#[derive(Clone, Copy, Debug)]
pub struct Task<'a> {
    /// Scene as its document describes it.
    pub scene: &'a Scene,
    /// Scene in the form in which rays are traced through it, with the effects that are switched on.
    pub traceable: &'a Arc<TraceableScene>,
    /// Grids of the scene that the method has to compute.
    pub grids: &'a [Grid],
    /// Grids that `grids` are, or are samples of: the method chooses patches and the sizes of its passes for all of their sensors.
    pub all_grids: &'a [Grid],
    /// Views of the scene that the method has to compute.
    pub views: &'a [View],
    /// Fraction of the mean of a grid below which the light of a sensor is judged as if it were this large.
    pub least_share_of_mean: f64,
    /// Exchanges of the room that the method shares with others of the same grids and views.
    pub exchanges: Option<&'a SharedExchanges>,
    /// Flag that is raised when the method is no longer wanted: what is built from then on is not used, and may be incomplete.
    pub cancel: &'a AtomicBool,
}

/// Flag of a task that is wanted in any case.
static NEVER: AtomicBool = AtomicBool::new(false);

impl<'a> Task<'a> {
    /// Makes the task of all outputs of a scene.
    pub fn whole(scene: &'a Scene, traceable: &'a Arc<TraceableScene>) -> Self {
        Self {
            scene,
            traceable,
            grids: &scene.grids,
            all_grids: &scene.grids,
            views: &scene.views,
            least_share_of_mean: LEAST_SHARE_OF_MEAN,
            exchanges: None,
            cancel: &NEVER,
        }
    }

    /// Returns this task without its views.
    pub fn without_views(self) -> Self {
        Self { views: &[], ..self }
    }

    /// Returns this task without its grids.
    pub fn without_grids(self) -> Self {
        Self { grids: &[], all_grids: &[], ..self }
    }

    /// True if a grid requests the illuminance at points rather than averages over cells.
    pub fn has_points(&self) -> bool {
        self.grids.iter().any(|grid| grid.estimate == EstimateKind::Point)
    }

    /// True if sensors do not look up, or do not lie in one level plane.
    pub fn has_placed_sensors(&self) -> bool {
        self.grids.iter().any(|grid| grid.placed.is_some())
    }
}

/// Method built for a scene, ready to compute.
pub enum Computation {
    /// Passes, independent or in order, which an estimate adds up.
    Passes(Box<dyn Integrator>),
    /// Solver that finds all results in one computation.
    Solution(Box<dyn Solver>),
}

impl Computation {
    /// Wraps a method that is computed pass by pass.
    pub fn passes(integrator: impl Integrator + 'static) -> Self {
        Self::Passes(Box::new(integrator))
    }

    /// Wraps a method that finds all results in one computation.
    pub fn solution(solver: impl Solver + 'static) -> Self {
        Self::Solution(Box::new(solver))
    }
}

/// Kinds of output that a method computes beside the illuminance of grids, which every method computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outputs {
    /// Luminance of views.
    pub views: bool,
    /// Energy balance: light is followed from its sources to where it ends.
    pub energy: bool,
    /// Luminous fluxes of the tubes.
    pub tube_fluxes: bool,
    /// Sensors that do not look up, or do not lie in one level plane.
    pub any_sensors: bool,
}

/// Dependence of the passes of a method on each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Passes {
    /// Passes that are independent replicates.
    Independent,
    /// Passes that each start from the state which the earlier ones left.
    InOrder,
    /// No passes: all results come from one computation.
    None,
}

impl Outputs {
    /// Every output that a result can have, at level sensors that look up.
    pub const ALL: Self = Self { views: true, energy: true, tube_fluxes: true, any_sensors: false };
}

/// Reason why a method cannot compute a task.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{detail}")]
pub struct Refusal {
    /// Kind of the reason, for programs.
    pub code: RefusalCode,
    /// Reason for people; a sentence without a full stop.
    pub detail: String,
    /// Change of the document with which this method could compute it; `None` if only another method can.
    pub instead: Option<&'static str>,
}

impl Refusal {
    /// Makes a refusal that suggests no change of the document.
    pub fn new(code: RefusalCode, detail: impl Into<String>) -> Self {
        Self { code, detail: detail.into(), instead: None }
    }

    /// Returns this refusal with a suggested change of the document.
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
            /// Every kind of refusal.
            pub const ALL: &[Self] = &[$(Self::$code),*];

            /// Returns the code as text, for machines.
            pub fn code(self) -> &'static str {
                match self {
                    $(Self::$code => $text,)*
                }
            }
        }
    };
}

refusal_codes! {
    /// Views are requested of a method that computes grids only.
    GridsOnly = "grids_only",
    /// Sunlight through clear closures would be found only by chance, by rays that are not aimed at the sun.
    SunThroughClearClosures = "sun_through_clear_closures",
    /// Sunlight reflected by mirrors or by nearly smooth surfaces would be found only by chance, by rays that are not aimed at the sun.
    SunByMirrors = "sun_by_mirrors",
    /// Sensors at points cannot receive light that a mirror reflects.
    MirrorsAtPoints = "mirrors_at_points",
    /// Points lie so near to a surface that their estimated standard error would be wrong.
    PointsNearSurfaces = "points_near_surfaces",
    /// Light passes the closure of a tube unscattered.
    ClearClosures = "clear_closures",
    /// Light passes the closure of a bent tube unscattered.
    ClearClosuresOfBentTubes = "clear_closures_of_bent_tubes",
    /// A closure is a square, which light from a round pipe is spread over.
    SquareClosures = "square_closures",
    /// A diffuser's BSDF is a measured table.
    MeasuredDiffusers = "measured_diffusers",
    /// A grid requests averages over cells.
    CellAverages = "cell_averages",
    /// Reflectances or transmittances are colours.
    Colours = "colours",
    /// A tube is given as a mesh.
    MeshTubes = "mesh_tubes",
    /// A collector refracts light.
    RefractingCollectors = "refracting_collectors",
    /// The reflectance of a tube's mirror depends on the angle of incidence.
    MirrorsByAngle = "mirrors_by_angle",
    /// The room contains objects.
    Objects = "objects",
    /// The room contains luminaires.
    Luminaires = "luminaires",
    /// Surfaces are glossy or mirrors.
    SpecularSurfaces = "specular_surfaces",
    /// Nothing in the room absorbs light.
    LosslessRoom = "lossless_room",
    /// The room is not a box.
    RoomShape = "room_shape",
    /// Sensors do not look up, or do not lie in one level plane.
    PlacedSensors = "placed_sensors",
    /// A horizon hides a part of the sky.
    Horizon = "horizon",
    /// The upper end of a tube is tilted.
    TiltedEnds = "tilted_ends",
    /// Interreflection is switched off.
    InterreflectionOff = "interreflection_off",
    /// Passes are in order or there are none, where independent ones are needed.
    DependentPasses = "dependent_passes",
    /// Daylight coefficients are requested of a method that does not compute them.
    NoResponses = "no_responses",
    /// No other method computes the grids of this scene with reliable standard errors.
    NoSecondMethod = "no_second_method",
    /// A setting of the method that has no default is missing.
    SettingMissing = "setting_missing",
}

impl fmt::Display for RefusalCode {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str(self.code())
    }
}

/// Warning about a method's results that their reader needs.
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
    /// Light reflected by mirrors is found only by chance, by rays that are not aimed at its source.
    MirrorsByChance,
    /// Some of the light reflected by mirrors is found by rare and bright paths.
    MirrorsRarely,
    /// A formula returns more flux than enters.
    FluxExcess,
    /// Kernels are not clipped everywhere where objects stand on other objects.
    KernelsNotCut,
}

/// Quantities that decide how much memory a pass needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// Edges of the room in m.
    pub size: DVec3,
    /// Number of channels of light, 1 or 3.
    pub channels: usize,
    /// Number of grids of the job.
    pub grids: usize,
    /// Number of views of the pass.
    pub views: usize,
    /// Upper bound of the mean number of surfaces that a photon meets in the room.
    pub events: f64,
    /// True if sunlight enters the room unscattered.
    pub sunbeams: bool,
    /// Number of sensors of all grids that receive traced light beside that of Lambertian closures; 0 where all tubes end in these.
    pub directional_sensors: usize,
}

impl Load {
    /// Number of copies of stored photons and vertices that exist at the same time: in one growing list, and sorted.
    pub const COPIES: f64 = 2.5;

    /// Returns the bytes of one photon: place, direction or normal, and its flux in every channel.
    pub fn photon_bytes(&self) -> f64 {
        32.0 + 8.0 * self.channels as f64
    }
}

/// Amount of data that a method stores for a sensor or pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Retained {
    /// Number of points of a sensor or pixel whose values a pass holds.
    pub points: f64,
    /// Number of contrasts (differences between the fixed points), each with a running mean.
    pub contrasts: f64,
    /// Number of points whose gather radius is carried from pass to pass.
    pub radii: f64,
    /// Number of sums that chunks of photons hold at the same time.
    pub concurrent_sums: f64,
}

impl Retained {
    /// Running means alone.
    pub const MEANS: Self = Self { points: 1.0, contrasts: 0.0, radii: 0.0, concurrent_sums: 1.0 };
}
