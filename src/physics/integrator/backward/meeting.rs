//! Decisions of a method about a backward path, and the path itself.

use glam::DVec3;

use super::opening::DaylightWeights;
use super::vertex::Vertex;
use crate::guide::RayCount;
use crate::integrator::radiosity::{BrightPatches, Target};
use crate::integrator::roulette::survival;
use crate::optics::Spectrum;
use crate::sampling::PathSamples;
use crate::traceable::{RoomHit, SurfaceId, TraceableScene};

/// Fraction of a path's first weight above which it continues without Russian roulette, if its method requests this.
const CERTAIN_ABOVE: f64 = 0.02;

/// Part of a walk that depends on the method: connections, and weights of the light that rays find.
pub trait Meeting<const C: usize> {
    /// False if the path continues by mirrors, lobes and clear closures only: the method counts diffusely scattered light at the vertex
    /// itself.
    const FOLLOWS_DIFFUSE: bool = true;

    /// State of a ray, from which the method computes weights.
    type Trace: Copy;
    /// State of a path that arrives at a vertex.
    type Arrival: Copy;

    /// Returns the luminance in cd/m2 that a surface reflects diffusely at a point toward a ray, by a coarse solution: the ray counts it,
    /// and continues for its residual. `None` where there is no coarse solution.
    #[inline]
    fn reflected(&self, _ray: &Ray<C, Self::Trace>, _surface: SurfaceId, _point: DVec3) -> Option<Spectrum<C>> {
        None
    }

    /// Notes that a path of this weight has counted the coarse solution at a point of a surface: `gathered` times in what the coarse solution
    /// gives, and `beyond` times in the residual.
    #[inline]
    fn counts(&self, _place: (SurfaceId, DVec3), _weight: Spectrum<C>, _gathered: f64, _beyond: f64) {}

    /// Returns the bright patches of the coarse solution, at which some rays are aimed; `None` where rays are not aimed.
    #[inline]
    fn bright_patches(&self) -> Option<&BrightPatches> {
        None
    }

    /// Returns the state of a ray that is aimed at a patch or image (`None`: at none), where `fraction` of the rays are.
    fn is_aimed(&self, trace: Self::Trace, _target: Option<Target>, _share: f64) -> Self::Trace {
        trace
    }

    /// Returns the weight of a ray where it ends, because both aimed rays and others may end there (the balance heuristic, Veach and Guibas
    /// 1995); 0 for an aimed ray that ends elsewhere.
    #[inline]
    fn aim_weight(&self, _ray: &Ray<C, Self::Trace>, _surface: SurfaceId, _hit: &RoomHit) -> f64 {
        1.0
    }

    /// Updates the state of a ray that has travelled `length` metres.
    fn flew(&self, _trace: &mut Self::Trace, _length: f64) {}

    /// Returns the state of a path that arrives at a surface at this cosine of the angle of incidence.
    fn arrives(&self, trace: &Self::Trace, cosine: f64) -> Self::Arrival;

    /// Returns the state of a path that arrives at the lower side of a closure that scatters, directly or through its tube.
    fn arrives_at_closure(&self) -> Self::Arrival;

    /// Returns the state of a path that begins at a sensor.
    fn arrives_at_sensor(&self) -> Self::Arrival;

    /// Adds the light that is connected to a vertex to the walk's sum.
    fn connect(&self, walk: &mut Walk<'_, C>, vertex: &Vertex<'_, C>, arrival: &Self::Arrival);

    /// Returns the state of a ray that leaves a vertex in a direction chosen with density `pdf` per sr.
    fn leaves(
        &self,
        scene: &TraceableScene,
        vertex: &Vertex<'_, C>,
        arrival: &Self::Arrival,
        toward: DVec3,
        pdf: f64,
    ) -> Self::Trace;

    /// Returns the state of a ray after its reflection by a mirror, `surface`.
    fn turns(&self, scene: &TraceableScene, trace: &Self::Trace, surface: SurfaceId) -> Self::Trace;

    /// Returns the state of a ray that comes back down through a clear closure.
    fn passes(&self, trace: &Self::Trace) -> Self::Trace;

    /// Returns the weight (MIS) of the light of luminaire `number` for a ray that finds it at `position`.
    fn luminaire_weight(
        &self,
        scene: &TraceableScene,
        number: usize,
        ray: &Ray<C, Self::Trace>,
        position: DVec3,
    ) -> f64;

    /// Returns the weights of the daylight found by a ray that meets the opening of a tube at `position`; `None` where the path ends there.
    fn meets_opening(
        &self,
        walk: &mut Walk<'_, C>,
        tube: usize,
        ray: &Ray<C, Self::Trace>,
        position: DVec3,
    ) -> Option<DaylightWeights>;
}

/// Ray through the room.
#[derive(Clone, Copy, Debug)]
pub struct Ray<const C: usize, Trace> {
    pub origin: DVec3,
    /// Unit vector.
    pub direction: DVec3,
    pub from: Option<SurfaceId>,
    pub weight: Spectrum<C>,
    /// True if light that a surface sends along the ray counts as interreflected: it lights a sensor, or is reflected once more.
    pub reflected: bool,
    pub trace: Trace,
}

/// Path that is followed backward, with its random numbers and the light that it found.
#[derive(Debug)]
pub struct Walk<'a, const C: usize> {
    pub scene: &'a TraceableScene,
    pub samples: PathSamples,
    /// Number of rays traced so far.
    pub rays: RayCount,
    /// Number of further reflections without Russian roulette, as long as the path's weight is large enough.
    pub certain: u32,
    /// Number of paths that this one represents beyond the first surface with a coarse solution, where the others end. 0 if this path ends
    /// there itself; `None` where roulette decides, as at all later surfaces.
    pub stands_for: Option<f64>,
    /// Illuminance in lux, or luminance in cd/m2.
    pub sum: Spectrum<C>,
    /// Residual: the part of the sum that a coarse solution leaves out.
    pub beyond: Spectrum<C>,
    /// Sum at the moment when the path continued for the residual; `None` before that.
    pub(super) since: Option<Spectrum<C>>,
}

impl<'a, const C: usize> Walk<'a, C> {
    /// Makes a path of these random numbers, whose first `certain` reflections are decided without Russian roulette.
    pub fn new(scene: &'a TraceableScene, samples: PathSamples, certain: u32) -> Self {
        let (rays, sum) = (RayCount::default(), Spectrum::ZERO);
        Self { scene, samples, rays, certain, stands_for: None, sum, beyond: Spectrum::ZERO, since: None }
    }

    /// True if light that is found now belongs to the residual of a coarse solution.
    pub fn is_beyond(&self) -> bool {
        self.since.is_some()
    }

    /// Decides by Russian roulette whether a path continues that arrives with one weight, would leave with another, and began with `first`;
    /// returns the probability of this, and `None` where the path ends.
    #[inline]
    pub fn survival(&mut self, outgoing: f64, arriving: f64, first: f64) -> Option<f64> {
        if outgoing <= 0.0 {
            return None;
        }
        if self.certain > 0 && outgoing >= CERTAIN_ABOVE * first {
            self.certain -= 1;
            return Some(1.0);
        }
        let survival = survival(outgoing, arriving, first);
        (self.samples.random.uniform() < survival).then_some(survival)
    }

    /// Returns the response of a vertex to light from a point that it sees, and the density per sr of the scattered ray in this direction;
    /// `None` where the point is not visible or the response is 0.
    pub fn respond(
        &mut self,
        vertex: &Vertex<'_, C>,
        source: DVec3,
        surface: Option<SurfaceId>,
    ) -> Option<(Spectrum<C>, f64)> {
        let (response, density) = vertex.response((source - vertex.position).normalize());
        if response.max() <= 0.0 {
            return None;
        }
        self.rays += 1;
        self.scene.visible(source, surface, vertex.position, vertex.surface).then_some((response, density))
    }
}
