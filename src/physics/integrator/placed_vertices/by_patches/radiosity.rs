//! Light that goes to and fro between the patches of a room (radiosity by rays): where rays from each patch end, what light straight
//! from the openings comes from there, and the illuminances that follow.

use glam::DVec3;

use super::patches::Patches;
use crate::integrator::lamp::cells::per_lumen;
use crate::optics::Spectrum;
use crate::sampling::{Key, PathRandom, Replicate, warp};
use crate::scene::Face;
use crate::traceable::{Fan, FanHits, Segments, Spread, SurfaceId, TOGETHER, TraceableScene};

/// Distance from a patch, in shares of its size, at which rays begin.
const HAIR: f64 = 1e-6;

/// Openings for which every ray's end is looked at; of more, each has its turn.
const OPENINGS_AT_ONCE: usize = 4;

/// Illuminances are computed again until what is changed is less than this share of all, and at most so many times, which is more
/// than enough but where surfaces absorb less than some percent.
const CHANGED: f64 = 1e-5;
const SWEEPS: usize = 200;

/// What rays from all patches find, and rays from the openings, which follow the patches in number.
#[derive(Debug)]
pub struct Exchange<const C: usize> {
    /// Rays of a patch.
    rays: usize,
    /// The patch or opening in which each ends.
    met: Vec<u32>,
    /// Of each opening.
    pub straight: Vec<Straight<C>>,
}

/// What light straight from an opening does.
#[derive(Clone, Debug)]
pub struct Straight<const C: usize> {
    /// Illuminances of the patches in lx per lumen where it has been reflected once.
    reflected: Vec<Spectrum<C>>,
    /// Ends of rays in each patch from which it was looked whether a point of the opening is seen, and those that saw it.
    pub looks: Vec<u32>,
    pub seen: Vec<u32>,
}

/// A look from where a ray ends at a point of an opening.
#[derive(Clone, Copy, Debug)]
struct Look<const C: usize> {
    /// The patch from which the ray comes.
    from: usize,
    /// The patch where it ends.
    at: usize,
    /// What is reflected to the former if the point is seen.
    light: Spectrum<C>,
}

/// Looks that wait until there are enough of them to be looked at together.
struct Lines<const C: usize> {
    waiting: Vec<Look<C>>,
    lines: Segments,
    /// Height in m from which on no box hides the ceiling.
    above_boxes: f64,
}

impl<const C: usize> Lines<C> {
    fn new(scene: &TraceableScene) -> Self {
        let above_boxes = scene.boxes.iter().map(|object| object.span().1).fold(0.0, f64::max);
        Self { waiting: Vec::with_capacity(TOGETHER), lines: Segments::default(), above_boxes }
    }

    /// Adds the look from an end to a point.
    fn add(&mut self, scene: &TraceableScene, end: &End, to: DVec3, look: Look<C>, straight: &mut Straight<C>) {
        if end.position.z >= self.above_boxes {
            straight.sees(&look);
            return;
        }
        self.lines.set(self.waiting.len(), end.position, to - end.position, scene.numbering.box_of(end.surface));
        self.waiting.push(look);
        if self.waiting.len() == TOGETHER {
            self.end(scene, straight);
        }
    }

    /// Looks at those that still wait.
    fn end(&mut self, scene: &TraceableScene, straight: &mut Straight<C>) {
        let clear = scene.clear_of_boxes(&self.lines);
        let seen = self.waiting.drain(..).zip(clear).filter(|(_, clear)| *clear > 0.0);
        seen.for_each(|(look, _)| straight.sees(&look));
    }
}

impl<const C: usize> Straight<C> {
    fn sees(&mut self, look: &Look<C>) {
        self.seen[look.at] += 1;
        self.reflected[look.from] += look.light;
    }
}

/// For every fan of a patch' rays, the openings at which it is looked from where its rays end, each with the share that one
/// of these rays has.
struct Turns(Vec<Vec<(usize, f64)>>);

impl Turns {
    fn new(openings: usize, fans: usize) -> Self {
        let turns = (openings / OPENINGS_AT_ONCE).clamp(1, fans);
        let share = |opening: usize| 1.0 / ((opening % turns..fans).step_by(turns).count() * TOGETHER) as f64;
        let of_fan =
            |fan: usize| (fan % turns..openings).step_by(turns).map(|opening| (opening, share(opening))).collect();
        Self((0..fans).map(of_fan).collect())
    }
}

/// Where the rays of a patch, or an opening, begin.
struct Start {
    number: usize,
    surface: SurfaceId,
    normal: DVec3,
    corner: DVec3,
    /// Two edges; `None` for the disc of an opening around the corner.
    edges: Option<[DVec3; 2]>,
    radius: f64,
}

impl Start {
    /// Even numbers give even points.
    fn point(&self, at: [f64; 2]) -> DVec3 {
        match self.edges {
            Some([u, v]) => self.corner + u * at[0] + v * at[1],
            None => self.corner + (warp::disc(at) * self.radius).extend(0.0),
        }
    }
}

impl<const C: usize> Exchange<C> {
    /// By so many rays from every patch, whole groups. `surfaces`: those of the faces, in their order; `reflectances`: of
    /// patches and openings.
    pub fn new(
        scene: &TraceableScene,
        patches: &Patches,
        surfaces: impl Iterator<Item = SurfaceId>,
        reflectances: &[Spectrum<C>],
        rays: usize,
    ) -> Self {
        let (replicate, first) = Replicate::of(Key::new(0), 0);
        let points: Vec<[f64; 4]> = (0..rays).map(|index| replicate.point(first + index as u16, 0)).collect();
        let spread = |points: &[[f64; 4]]| Spread::new(points.iter().map(|[.., a, b]| [*a, *b]));
        let spreads: Vec<Spread> = points.chunks(TOGETHER).map(spread).collect();
        let count = patches.count + scene.tubes.len();
        let none = || vec![Spectrum::ZERO; count];
        let straight = || Straight { reflected: none(), looks: vec![0; count], seen: vec![0; count] };
        let straight = scene.tubes.iter().map(|_| straight()).collect();
        let mut exchange = Self { rays, met: Vec::new(), straight };
        let turns = Turns::new(scene.tubes.len(), spreads.len());
        let mut lines: Vec<Lines<C>> = scene.tubes.iter().map(|_| Lines::new(scene)).collect();
        let mut hits = FanHits::default();
        for start in starts(scene, patches, surfaces) {
            let mut random = PathRandom::new(Key::new(start.number as u64));
            let shift = [random.uniform(), random.uniform()];
            for (fan, (spread, point)) in spreads.iter().zip(&points).enumerate() {
                let at = [0, 1].map(|axis| point[axis] + shift[axis]).map(|number| number - number.floor());
                let turn_and_shift = [random.uniform(), random.uniform()];
                let from = Some(start.surface);
                scene.meet_fan(&Fan::turned(start.point(at), from, start.normal, turn_and_shift, spread), &mut hits);
                let ends: [End; TOGETHER] = std::array::from_fn(|ray| End::of(scene, patches, &hits, ray));
                exchange.met.extend(ends.iter().map(|end| end.patch as u32));
                for (number, share) in &turns.0[fan] {
                    let (number, tube) = (*number, &scene.tubes[*number]);
                    let to = tube.origin + (warp::disc(random.uniform2()) * tube.opening_radius).extend(0.0);
                    let straight = &mut exchange.straight[number];
                    for end in &ends {
                        straight.looks[end.patch] += 1;
                        let lux = per_lumen(to - end.position, end.normal);
                        if lux > 0.0 {
                            let light = reflectances[end.patch] * (lux * share);
                            let look = Look { from: start.number, at: end.patch, light };
                            lines[number].add(scene, end, to, look, straight);
                        }
                    }
                }
            }
        }
        lines.iter_mut().zip(&mut exchange.straight).for_each(|(lines, straight)| lines.end(scene, straight));
        exchange
    }

    /// Illuminances of patches and openings by light that has been reflected, in lx per lumen of an opening
    /// (Gauss and Seidel's sweeps).
    pub fn reflected(&self, tube: usize, reflectances: &[Spectrum<C>]) -> Vec<Spectrum<C>> {
        let once = &self.straight[tube].reflected;
        let mut lux = once.clone();
        let mut sent: Vec<Spectrum<C>> = reflectances.iter().zip(&lux).map(|(by, lux)| *by * *lux).collect();
        for _ in 0..SWEEPS {
            let (mut changed, mut all) = (0.0, 0.0);
            for (patch, met) in self.met.chunks_exact(self.rays).enumerate() {
                let mut found = mean(&sent, met);
                found += once[patch];
                changed += (found.luminance() - lux[patch].luminance()).abs();
                all += found.luminance();
                lux[patch] = found;
                sent[patch] = reflectances[patch] * found;
            }
            if changed <= CHANGED * all {
                break;
            }
        }
        lux
    }
}

/// Mean of what is sent from where rays end.
#[inline]
fn mean<const C: usize>(sent: &[Spectrum<C>], met: &[u32]) -> Spectrum<C> {
    // side by side, so that none waits for another
    let mut sums = [Spectrum::<C>::ZERO; 4];
    for met in met.chunks_exact(4) {
        for (sum, patch) in sums.iter_mut().zip(met) {
            *sum += sent[*patch as usize];
        }
    }
    let [first, second, third, fourth] = sums;
    ((first + second) + (third + fourth)) * (1.0 / met.len() as f64)
}

/// Where the rays of patches and openings begin, in the order of their numbers.
fn starts(
    scene: &TraceableScene,
    patches: &Patches,
    surfaces: impl Iterator<Item = SurfaceId>,
) -> impl Iterator<Item = Start> {
    let of_patches = patches.faces.iter().zip(surfaces).flat_map(|(face, surface)| {
        face.patches().map(move |[corner, u, v]| {
            let before = corner + face.normal * (HAIR * u.length());
            (surface, face.normal, before, Some([u, v]), 0.0)
        })
    });
    let ceiling = SurfaceId::of_face(Face::Ceiling);
    let openings = scene.tubes.iter().map(move |tube| (ceiling, DVec3::NEG_Z, tube.origin, None, tube.opening_radius));
    let start =
        |(number, (surface, normal, corner, edges, radius))| Start { number, surface, normal, corner, edges, radius };
    of_patches.chain(openings).enumerate().map(start)
}

/// Where a ray ends.
struct End {
    /// The patch, or the opening.
    patch: usize,
    surface: SurfaceId,
    position: DVec3,
    normal: DVec3,
}

impl End {
    #[inline]
    fn of(scene: &TraceableScene, patches: &Patches, hits: &FanHits, ray: usize) -> Self {
        let surface = hits.surface[ray] as usize;
        let position = DVec3::from_array([0, 1, 2].map(|axis| hits.position[axis][ray]));
        let face = &patches.faces[surface];
        let opening = if surface == Face::Ceiling as usize { scene.opening_at(position.truncate()) } else { None };
        let patch = opening.map_or_else(|| face.at(position), |tube| patches.count + tube);
        Self { patch, surface: SurfaceId::numbered(surface), position, normal: face.normal }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::integrator::placed_vertices::panels::{panels, surfaces};
    use crate::optics::{Collector, Diffuser, Surface};
    use crate::scene::{Channels, Room, Scene, Segment, StraightOrBent, Tube, TubeShape};
    use crate::statistics::Moments;
    use crate::traceable::Follow;

    /// Where all surfaces reflect the share rho, and openings too, a lumen is reflected rho / (1 - rho) times in all, whatever the room:
    /// the mean over rooms within four of its standard errors.
    #[test]
    fn reflected_light_keeps_the_balance() {
        let rho = 0.6;
        let mut found = Moments::default();
        for round in 0..16 {
            let size = DVec3::new(2.0 + 0.13 * f64::from(round), 3.1 - 0.07 * f64::from(round), 2.5);
            let tube = Tube {
                centre: DVec2::new(0.9, 1.2),
                opening_radius: 0.2,
                shape: TubeShape::Cylinders(StraightOrBent {
                    reflectance: [0.95; 3].into(),
                    segments: vec![Segment { length_m: 0.8, tilt: 0.0, azimuth: 0.0 }],
                    collector: Collector::Open,
                }),
                diffuser: Diffuser::Lambertian { transmittance: [0.3; 3], reflectance: [rho; 3] },
            };
            let surfaces_of_room = [Some(Surface::diffuse([rho; 3])); 6];
            let room = Room {
                size,
                surfaces: surfaces_of_room,
                boxes: Vec::new(),
                meshes: Vec::new(),
                luminaires: Vec::new(),
            };
            let (grids, views) = (Vec::new(), Vec::new());
            let scene = Scene { daylight: None, room, tubes: vec![tube], grids, views, channels: Channels::Photopic };
            let follow = Follow { interreflection: true, guide_return: true, objects: true };
            let scene = TraceableScene::new(&scene, follow).unwrap();
            let panels = panels(&scene);
            let patches = Patches::new(&panels);
            let reflectances = vec![Spectrum([rho]); patches.count + 1];
            let exchange = Exchange::<1>::new(&scene, &patches, surfaces(&scene), &reflectances, 32);
            let lux = exchange.reflected(0, &reflectances);
            let opening = std::f64::consts::PI * 0.2 * 0.2;
            let mut areas: Vec<f64> =
                patches.faces.iter().flat_map(|face| face.patches().map(|[_, u, v]| u.cross(v).length())).collect();
            // of the ceiling the opening is no part
            for (patch, [corner, u, v]) in patches.faces[Face::Ceiling as usize].patches().enumerate() {
                let inside = |index: usize| {
                    let at = corner + u * ((index / 40) as f64 + 0.5) / 40.0 + v * ((index % 40) as f64 + 0.5) / 40.0;
                    scene.opening_at(at.truncate()).is_some()
                };
                let first: usize = patches.faces[..Face::Ceiling as usize].iter().map(|face| face.count()).sum();
                areas[first + patch] *= 1.0 - (0..1600).filter(|index| inside(*index)).count() as f64 / 1600.0;
            }
            areas.push(opening);
            found.push(lux.iter().zip(&areas).map(|(lux, area)| lux.0[0] * area).sum::<f64>());
        }
        let error = found.standard_error();
        assert!(error < 0.01, "{found:?}");
        assert!((found.mean - rho / (1.0 - rho)).abs() <= 4.0 * error, "{found:?} {error}");
    }
}
