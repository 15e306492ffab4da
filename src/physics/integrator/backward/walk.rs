//! Random walk of one path backward, from a sensor or the eye, until it ends: the only loop that follows such paths.
//!
//! The walk decides how a path continues: what it meets, by which part of a surface it is reflected, how it passes an opening, and where
//! Russian roulette ends it. The method decides which light counts: its [`Meeting`] connects vertices to light, and returns the weight of
//! the light that a ray finds.

use glam::DVec3;

use super::meeting::{Meeting, Ray, Walk};
use super::opening::{Arriving, Onward, enter_tube};
use super::vertex::Vertex;
use crate::integrator::radiosity::{Aim, BrightPatches, Target};
use crate::integrator::roulette::MAX_EVENTS;
use crate::optics::{Kind, Oriented, Scatter, Scattered, SheetSide, Spectrum, SurfaceOptics, Travel};
use crate::sampling::PathSamples;
use crate::scene::Sensor;
use crate::traceable::{Place, RoomHit, SurfaceId};

/// Smallest probability with which a path continues for the residual of a coarse solution. The probability is never below the reflectance
/// of the surface: weights would grow at each reflection, and their variance without bound.
const LEAST_BEYOND: f64 = 0.25;

/// Returns the bright patches and images at which some rays from a vertex are aimed, and the fraction of rays that are; `None` where none are.
fn aimed_from<'a, const C: usize, M: Meeting<C>>(
    meeting: &'a M,
    vertex: &Vertex<'_, C>,
) -> Option<(&'a BrightPatches, f64)> {
    let bright = meeting.bright_patches().filter(|_| !vertex.is_narrow() && !vertex.scatterer.is_mirror())?;
    let reflected = || Scatter::<C>::albedo(&vertex.scatterer, vertex.eye, vertex.side()).max();
    let fraction = bright.fraction(if vertex.is_sensor() { 0.0 } else { reflected() });
    (fraction > 0.0).then_some((bright, fraction))
}

impl<const C: usize> Walk<'_, C> {
    /// Adds one sample of the illuminance in lux of a sensor.
    pub fn illuminance<M: Meeting<C>>(&mut self, meeting: &M, sensor: Sensor) {
        let vertex = Vertex::sensor(sensor);
        let arrival = meeting.arrives_at_sensor();
        // the first numbers of a low-discrepancy sequence are the best distributed
        let ray = self.scatter(meeting, &vertex, &arrival);
        meeting.connect(self, &vertex, &arrival);
        if let Some(ray) = ray {
            self.follow(meeting, ray);
        }
    }

    /// Adds one sample of the luminance in cd/m2 that an eye sees along a ray, which enters the room at `origin`.
    pub fn luminance<M: Meeting<C>>(&mut self, meeting: &M, origin: DVec3, direction: DVec3, trace: M::Trace) {
        let ray = Ray { origin, direction, from: None, weight: Spectrum::ONE, reflected: false, trace };
        self.follow(meeting, ray);
    }

    /// Follows a ray until the path ends.
    pub fn follow<M: Meeting<C>>(&mut self, meeting: &M, ray: Ray<C, M::Trace>) {
        let was_beyond = self.since.is_some();
        self.go_on(meeting, ray);
        if !was_beyond && let Some(since) = self.since.take() {
            self.beyond += self.sum + since * -1.0;
        }
    }

    fn go_on<M: Meeting<C>>(&mut self, meeting: &M, mut ray: Ray<C, M::Trace>) {
        let (scene, mut first) = (self.scene, None);
        for _ in 0..MAX_EVENTS {
            let hit = scene.intersect(ray.origin, ray.direction, ray.from);
            self.rays += 1;
            meeting.flew(&mut ray.trace, (hit.position - ray.origin).length());
            let weight = meeting.aim_weight(&ray, scene.surface_at(hit.place), &hit);
            if weight <= 0.0 {
                return;
            }
            ray.weight = ray.weight * weight;
            let first = *first.get_or_insert(ray.weight.max());
            let next = match hit.place {
                Place::Opening(index) => self.meet_opening(meeting, index, hit.position, &ray),
                Place::Surface(surface) => {
                    if let Some(number) = scene.numbering.luminaire_of(surface) {
                        let seen: Spectrum<C> = scene.luminaires[number].seen(ray.direction);
                        if seen.max() > 0.0 {
                            let weight = meeting.luminaire_weight(scene, number, &ray, hit.position);
                            self.sum += ray.weight * seen * weight;
                        }
                        return;
                    }
                    let Some(optics) = scene.optics(surface) else { return };
                    if ray.reflected && !scene.interreflection {
                        return;
                    }
                    match meeting.reflected(&ray, surface, hit.position) {
                        Some(coarse) => {
                            let plain;
                            let rest = match optics.is_specular() {
                                true => {
                                    self.follow_specular(meeting, (surface, optics), &hit, &ray, first);
                                    plain = optics.clone().without_specular();
                                    &plain
                                }
                                false => optics,
                            };
                            if !self.goes_beyond(meeting, (surface, hit.position), (rest, coarse), &mut ray) {
                                return;
                            }
                            self.meet_surface(meeting, (surface, rest), &hit, &ray, None)
                        }
                        None => self.meet_surface(meeting, (surface, optics), &hit, &ray, Some(first)),
                    }
                }
            };
            match next {
                Some(next) => ray = next,
                None => return,
            }
        }
    }

    /// Counts the light that comes by the lobe or mirror of a surface whose diffuse light has a coarse solution.
    fn follow_specular<M: Meeting<C>>(
        &mut self,
        meeting: &M,
        (surface, optics): (SurfaceId, &SurfaceOptics),
        hit: &RoomHit,
        ray: &Ray<C, M::Trace>,
        first: f64,
    ) {
        // both rays continue the same path
        let stands_for = self.stands_for;
        let specular = optics.clone().without_diffuse();
        if let Some(next) = self.meet_surface(meeting, (surface, &specular), hit, ray, Some(first)) {
            self.follow(meeting, next);
        }
        self.stands_for = stands_for;
    }

    /// Counts `coarse`, the light of a coarse solution, where a ray meets a surface, and decides whether the ray continues for the
    /// residual; if so it gets the weight of those that end.
    fn goes_beyond<M: Meeting<C>>(
        &mut self,
        meeting: &M,
        place: (SurfaceId, DVec3),
        (optics, coarse): (&SurfaceOptics, Spectrum<C>),
        ray: &mut Ray<C, M::Trace>,
    ) -> bool {
        let weight = ray.weight;
        let stands_for = self.count_coarse(meeting, place, (coarse, weight), |samples| {
            let outgoing = weight * (optics.diffuse() + optics.specular());
            let reflectance = outgoing.max() / weight.max();
            // rays that are not aimed represent all rays
            let aimed = meeting.bright_patches().map_or(0.0, |bright| bright.fraction(reflectance));
            let probability = (reflectance / (1.0 - aimed)).clamp(LEAST_BEYOND, 1.0);
            if samples.random.uniform() < probability { 1.0 / probability } else { 0.0 }
        });
        ray.weight = weight * stands_for;
        stands_for > 0.0
    }

    /// Counts the light of a coarse solution for a path that arrives with this weight, takes it from the residual, and returns the number of
    /// paths that this one represents beyond; `by_roulette` decides where nothing is decided yet.
    fn count_coarse<M: Meeting<C>>(
        &mut self,
        meeting: &M,
        place: (SurfaceId, DVec3),
        (coarse, weight): (Spectrum<C>, Spectrum<C>),
        by_roulette: impl FnOnce(&mut PathSamples) -> f64,
    ) -> f64 {
        let [gathered, beyond] = if self.is_beyond() { [0.0, 1.0] } else { [1.0, 0.0] };
        self.sum += weight * coarse;
        self.since.get_or_insert(self.sum);
        let stands_for = self.stands_for.take().unwrap_or_else(|| by_roulette(&mut self.samples));
        self.sum += weight * stands_for * coarse * -1.0;
        meeting.counts(place, weight, gathered, beyond - stands_for);
        stands_for
    }

    /// Counts the light that is connected to a surface where a ray meets it, and returns how the path continues: by Russian roulette if the
    /// weight with which it began is given.
    fn meet_surface<M: Meeting<C>>(
        &mut self,
        meeting: &M,
        (surface, optics): (SurfaceId, &SurfaceOptics),
        hit: &RoomHit,
        ray: &Ray<C, M::Trace>,
        first: Option<f64>,
    ) -> Option<Ray<C, M::Trace>> {
        let vertex = Vertex::surface(hit, surface, optics, -ray.direction, ray.weight);
        let arrival = meeting.arrives(&ray.trace, -ray.direction.dot(hit.normal));
        if optics.is_finite() {
            meeting.connect(self, &vertex, &arrival);
        }
        let specular = ray.weight * optics.specular();
        let outgoing = if M::FOLLOWS_DIFFUSE { ray.weight * optics.diffuse() + specular } else { specular }.max();
        let survival = match first {
            Some(first) => self.survival(outgoing, ray.weight.max(), first)?,
            None => 1.0,
        };
        let (scattered, patch) = if M::FOLLOWS_DIFFUSE {
            self.choose(meeting, &vertex, SheetSide::Same)?
        } else {
            (Oriented { optics, normal: hit.normal }.sample_specular(vertex.eye, &mut self.samples)?, None)
        };
        let weight = ray.weight * scattered.weight * (1.0 / survival);
        if weight.max() <= 0.0 {
            return None;
        }
        let (origin, direction, from) = (hit.position, scattered.toward, Some(surface));
        let (reflected, trace) = if scattered.kind == Kind::Mirror {
            (ray.reflected || optics.is_finite(), meeting.turns(self.scene, &ray.trace, surface))
        } else {
            (true, self.leave(meeting, &vertex, &arrival, (scattered.toward, scattered.pdf, patch)))
        };
        Some(Ray { origin, direction, from, weight, reflected, trace })
    }

    /// Chooses the direction of a ray that leaves a vertex: by the scattering distribution, or aimed at a bright patch or image, which is
    /// returned. The returned density is that of the scattering distribution, as if all rays were drawn from it.
    fn choose<M: Meeting<C>>(
        &mut self,
        meeting: &M,
        vertex: &Vertex<'_, C>,
        side: SheetSide,
    ) -> Option<(Scattered<C>, Option<Target>)> {
        let Some((bright, fraction)) = aimed_from(meeting, vertex) else {
            let scattered = vertex.scatterer.sample(Travel::AgainstLight, vertex.eye, side, &mut self.samples)?;
            return Some((scattered, None));
        };
        let rest = 1.0 - fraction;
        match bright.aim(fraction, self.samples.pair()) {
            Aim::At(target, point) => {
                let toward = (point - vertex.position).try_normalize()?;
                let (value, pdf) = Vertex { weight: Spectrum::ONE, ..*vertex }.response(toward);
                let (weight, kind) = (value * (1.0 / (rest * pdf)), Kind::Diffuse);
                (pdf > 0.0).then_some((Scattered { toward, kind, pdf, weight }, Some(target)))
            }
            Aim::Elsewhere(point) => {
                self.samples.begin_with(point);
                let scattered = vertex.scatterer.sample(Travel::AgainstLight, vertex.eye, side, &mut self.samples)?;
                Some((Scattered { weight: scattered.weight * (1.0 / rest), ..scattered }, None))
            }
        }
    }

    /// Returns the state of a ray that leaves a vertex in this direction.
    fn leave<M: Meeting<C>>(
        &self,
        meeting: &M,
        vertex: &Vertex<'_, C>,
        arrival: &M::Arrival,
        (toward, pdf, target): (DVec3, f64, Option<Target>),
    ) -> M::Trace {
        let trace = meeting.leaves(self.scene, vertex, arrival, toward, pdf);
        match aimed_from(meeting, vertex) {
            Some((_, fraction)) => meeting.is_aimed(trace, target, fraction),
            None => trace,
        }
    }

    /// Counts the daylight that a ray finds which meets an opening from below, and returns how the ray comes back into the room.
    fn meet_opening<M: Meeting<C>>(
        &mut self,
        meeting: &M,
        index: usize,
        position: DVec3,
        ray: &Ray<C, M::Trace>,
    ) -> Option<Ray<C, M::Trace>> {
        let scene = self.scene;
        let weights = meeting.meets_opening(self, index, ray, position)?;
        let arriving = Arriving { position, direction: ray.direction, weight: ray.weight };
        let tube = &scene.tubes[index];
        let (found, onward) = enter_tube(scene, tube, arriving, weights, &mut self.samples, &mut self.rays);
        self.sum += found;
        // roulette has decided already, and closures with a coarse solution let nothing pass straight
        let place = (scene.numbering.closure(index), position);
        let coarse = meeting.reflected(ray, place.0, position);
        let stands_for = coarse.map_or(1.0, |coarse| self.count_coarse(meeting, place, (coarse, ray.weight), |_| 1.0));
        match onward {
            Onward::Ends => None,
            Onward::Passes(Arriving { position, direction, weight }) => {
                let (origin, from, trace) = (position, None, meeting.passes(&ray.trace));
                Some(Ray { origin, direction, from, weight, reflected: ray.reflected, trace })
            }
            Onward::Scatters(..) if !M::FOLLOWS_DIFFUSE || stands_for == 0.0 => None,
            Onward::Scatters(Arriving { position, direction, weight }, closure) => {
                let vertex = Vertex::closure((position, tube.frame.normal()), closure, -direction, weight * stands_for);
                let arrival = meeting.arrives_at_closure();
                meeting.connect(self, &vertex, &arrival);
                self.scatter(meeting, &vertex, &arrival)
            }
        }
    }

    /// Makes the ray that leaves a sensor or a closure into the room.
    fn scatter<M: Meeting<C>>(
        &mut self,
        meeting: &M,
        vertex: &Vertex<'_, C>,
        arrival: &M::Arrival,
    ) -> Option<Ray<C, M::Trace>> {
        let (scattered, patch) = self.choose(meeting, vertex, vertex.side())?;
        let weight = vertex.weight * scattered.weight;
        if weight.max() <= 0.0 {
            return None;
        }
        let (origin, direction, from) = (vertex.position, scattered.toward, vertex.surface);
        let trace = self.leave(meeting, vertex, arrival, (direction, scattered.pdf, patch));
        Some(Ray { origin, direction, from, weight, reflected: true, trace })
    }
}
