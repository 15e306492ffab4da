//! Plane mirrors of a room, and the chains of them by which light may come: what is seen by a chain is an image.
//!
//! A chain names the mirrors that a way meets, from the place that is lit toward the source. A source at its end is seen from that place
//! where its image lies, and the image of the place lies as far from the source: the way is unfolded to a straight line.

use glam::DVec3;
use smallvec::{SmallVec, smallvec};

use super::scene::TraceableScene;
use super::surface_id::SurfaceId;
use super::{Place, Side};
use crate::optics::{Spectrum, SurfaceOptics};

/// Chains that reflect less in all are left out, and at most so many are kept, the brightest.
const LEAST_REFLECTANCE: f64 = 0.02;
const MOST_CHAINS: usize = 64;

/// Reflectance of a chain from which on leaving it out is worth a warning.
const BRIGHT: f64 = 0.1;

/// The plane mirrors of a room, and chains of them.
#[derive(Clone, Debug, Default)]
pub struct Mirrors {
    planes: Vec<Plane>,
    chains: Vec<Chain>,
    /// True if mirrors show light by other chains too.
    shows_more: bool,
    /// True if what is left out may be bright: by facets of meshes, or by chains beyond the most.
    leaves_out: bool,
}

/// A plane mirror.
#[derive(Clone, Debug)]
struct Plane {
    surface: SurfaceId,
    /// A point of it, in m, and the unit normal of the side that reflects.
    point: DVec3,
    normal: DVec3,
    corners: Vec<DVec3>,
    /// Linear Rec.709.
    reflectance: [f64; 3],
}

/// Mirrors that a way meets one after the other.
#[derive(Clone, Debug)]
struct Chain {
    /// Numbers of the mirrors, that next to the lit place first.
    planes: SmallVec<[usize; 4]>,
    /// The chain without the last of them.
    before: Option<usize>,
    /// Linear Rec.709.
    reflectance: [f64; 3],
}

impl Chain {
    fn brightest(&self) -> f64 {
        brightest(self.reflectance)
    }
}

/// A way from a place to a source by way of mirrors.
#[derive(Clone, Copy, Debug)]
pub struct WayByMirrors<const C: usize> {
    /// Unit vector from the place.
    pub toward: DVec3,
    /// Way from the image of the place to the source, in m: its length is that of the whole way, its direction that in which it ends.
    pub unfolded: DVec3,
    /// What the mirrors reflect.
    pub reflectance: Spectrum<C>,
    /// Number of its straight parts.
    pub rays: u64,
}

impl Plane {
    #[inline]
    fn height(&self, point: DVec3) -> f64 {
        (point - self.point).dot(self.normal)
    }

    #[inline]
    fn image(&self, point: DVec3) -> DVec3 {
        point - self.normal * (2.0 * self.height(point))
    }

    #[inline]
    fn turn(&self, direction: DVec3) -> DVec3 {
        direction - self.normal * (2.0 * direction.dot(self.normal))
    }

    /// True if a part of each lies before the other.
    fn faces(&self, other: &Self) -> bool {
        let before = |plane: &Self, other: &Self| other.corners.iter().any(|corner| plane.height(*corner) > 0.0);
        before(self, other) && before(other, self)
    }
}

impl Mirrors {
    /// Finds the plane mirrors of a scene and their chains.
    pub fn new(scene: &TraceableScene) -> Self {
        let mirror = |surface: SurfaceId| scene.optics(surface).filter(|optics| optics.is_mirror());
        let faces = scene.enclosure.polygons.iter().enumerate().filter_map(|(face, polygon)| {
            let surface = SurfaceId::numbered(face);
            let corners: Vec<DVec3> = polygon.corners().collect();
            Some(plane(surface, mirror(surface)?, *corners.first()?, scene.enclosure.normal(face), corners))
        });
        let of_boxes = (0..scene.boxes.len()).flat_map(|number| (0..6).map(move |face| (number, face)));
        let of_boxes = of_boxes.filter_map(|(number, face)| {
            let surface = scene.numbering.box_face(number, face);
            let optics = mirror(surface)?;
            let [corner, u, v] = scene.boxes[number].face(face);
            let corners = vec![corner, corner + u, corner + u + v, corner + v];
            Some(plane(surface, optics, corner, scene.boxes[number].normal(face), corners))
        });
        let planes: Vec<Plane> = faces.chain(of_boxes).collect();
        let sides = [Side::Front, Side::Back];
        let meshes = (0..scene.numbering.facets)
            .any(|facet| sides.iter().any(|side| mirror(scene.numbering.facet_side(facet, *side)).is_some()));
        let mut mirrors = Self { planes, chains: Vec::new(), shows_more: meshes, leaves_out: meshes };
        mirrors.find_chains();
        mirrors
    }

    /// Adds all chains that reflect enough, shorter ones first.
    fn find_chains(&mut self) {
        let alone = |number: usize| Chain {
            planes: smallvec![number],
            before: None,
            reflectance: self.planes[number].reflectance,
        };
        let mut longest: Vec<Chain> = (0..self.planes.len()).map(alone).collect();
        while !longest.is_empty() {
            let (mut bright, faint): (Vec<Chain>, Vec<Chain>) =
                longest.into_iter().partition(|chain| chain.brightest() >= LEAST_REFLECTANCE);
            bright.sort_by(|one, other| other.brightest().total_cmp(&one.brightest()));
            let room = MOST_CHAINS - self.chains.len();
            self.leaves_out |= bright.get(room).is_some_and(|chain| chain.brightest() >= BRIGHT);
            self.shows_more |= bright.len() > room || faint.iter().any(|chain| chain.brightest() > 0.0);
            bright.truncate(room);
            let first = self.chains.len();
            self.chains.extend(bright);
            longest = (first..self.chains.len()).flat_map(|number| self.longer(number)).collect();
        }
    }

    /// The chains of one mirror more.
    fn longer(&self, number: usize) -> Vec<Chain> {
        let chain = &self.chains[number];
        let Some(last) = chain.planes.last().map(|last| &self.planes[*last]) else { return Vec::new() };
        let next = self.planes.iter().enumerate().filter(|(_, plane)| plane.faces(last));
        let longer = |(next, plane): (usize, &Plane)| {
            let mut planes = chain.planes.clone();
            planes.push(next);
            let reflectance = std::array::from_fn(|channel| chain.reflectance[channel] * plane.reflectance[channel]);
            Chain { planes, before: Some(number), reflectance }
        };
        next.map(longer).collect()
    }

    /// True if no mirror shows anything by a chain that is kept.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.chains.is_empty()
    }

    /// True if mirrors show light by chains that are not kept, however faint.
    pub fn shows_more(&self) -> bool {
        self.shows_more
    }

    /// True if mirrors may show bright light by chains that are not kept.
    pub fn leaves_out(&self) -> bool {
        self.leaves_out
    }

    /// The chain that a way along `chain`, or along none, goes on to at a surface; `None` where that is not kept.
    pub fn next(&self, chain: Option<usize>, surface: SurfaceId) -> Option<usize> {
        let last = |chain: &Chain| chain.planes.last().is_some_and(|last| self.planes[*last].surface == surface);
        self.chains.iter().position(|other| other.before == chain && last(other))
    }

    /// The chains of which the first mirror shows something at a place, with what they reflect.
    pub fn before(&self, position: DVec3) -> impl Iterator<Item = (usize, f64)> {
        let shows = move |chain: &Chain| self.planes[chain.planes[0]].height(position) > 0.0;
        self.chains
            .iter()
            .enumerate()
            .filter(move |(_, chain)| shows(chain))
            .map(|(number, chain)| (number, chain.brightest()))
    }

    /// One of the chains before a place by a number in 0..1, and the probability by which it was chosen.
    pub fn choose(&self, position: DVec3, number: f64) -> Option<(usize, f64)> {
        let all: f64 = self.before(position).map(|(_, weight)| weight).sum();
        let (mut before, mut last) = (0.0, None);
        for (chain, weight) in self.before(position) {
            before += weight;
            last = Some((chain, weight / all));
            if before > number * all {
                break;
            }
        }
        last
    }

    /// Probability by which a chain is chosen at a place.
    pub fn probability(&self, chain: usize, position: DVec3) -> f64 {
        self.chains[chain].brightest() / self.before(position).map(|(_, weight)| weight).sum::<f64>()
    }

    /// The image of a place and of its normal at the end of a chain.
    pub fn image(&self, chain: usize, (position, normal): (DVec3, DVec3)) -> (DVec3, DVec3) {
        let turn = |(position, normal): (DVec3, DVec3), number: &usize| {
            let plane = &self.planes[*number];
            (plane.image(position), plane.turn(normal))
        };
        self.chains[chain].planes.iter().fold((position, normal), turn)
    }
}

fn plane(surface: SurfaceId, optics: &SurfaceOptics, point: DVec3, normal: DVec3, corners: Vec<DVec3>) -> Plane {
    let reflectance: Spectrum<3> = optics.specular();
    Plane { surface, point, normal, corners, reflectance: reflectance.0 }
}

fn brightest(rgb: [f64; 3]) -> f64 {
    rgb.into_iter().fold(0.0, f64::max)
}

impl TraceableScene {
    /// The way from a place to a source by a chain of mirrors; `None` where these do not show it, or something stands between. The
    /// surfaces that both lie on do not count.
    pub fn way_by_mirrors<const C: usize>(
        &self,
        chain: usize,
        (place, from): (DVec3, Option<SurfaceId>),
        (source, to): (DVec3, Option<SurfaceId>),
    ) -> Option<WayByMirrors<C>> {
        let mirrors = &self.mirrors;
        let Chain { planes, reflectance, .. } = &mirrors.chains[chain];
        let shown = planes.iter().rev().fold(source, |point, number| mirrors.planes[*number].image(point));
        let toward = (shown - place).try_normalize()?;
        if mirrors.planes[planes[0]].height(shown) >= 0.0 {
            return None;
        }
        let (mut origin, mut direction, mut surface) = (place, toward, from);
        for number in planes {
            let plane = &mirrors.planes[*number];
            let hit = self.intersect(origin, direction, surface);
            if hit.place != Place::Surface(plane.surface) || plane.height(origin) <= 0.0 {
                return None;
            }
            (origin, direction, surface) = (hit.position, plane.turn(direction), Some(plane.surface));
        }
        // a source that lies behind the last mirror is not shown by it
        if (source - origin).dot(direction) <= 0.0 || !self.visible(source, to, origin, surface) {
            return None;
        }
        let (image, _) = mirrors.image(chain, (place, DVec3::ZERO));
        let reflectance = Spectrum::from_rgb(*reflectance);
        Some(WayByMirrors { toward, unfolded: source - image, reflectance, rays: planes.len() as u64 + 1 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::{Specular, Surface};
    use crate::scene::{BoxObject, Channels, Enclosure, Face, Room, Scene};
    use crate::traceable::Follow;

    const SIZE: DVec3 = DVec3::new(2.0, 3.0, 2.5);

    /// An empty room of 2 x 3 x 2.5 m whose faces of these numbers are mirrors of these reflectances.
    fn room(mirrors: &[(Face, f64)], boxes: Vec<BoxObject>) -> TraceableScene {
        let mut enclosure = Enclosure::cuboid(SIZE, [Some(Surface::diffuse([0.2; 3])); 6]);
        for (face, reflectance) in mirrors {
            let specular = Some(Specular { reflectance: [*reflectance; 3], roughness: 0.0 });
            enclosure.paint(*face as usize, Some(Surface { specular, ..Surface::diffuse([0.1; 3]) }));
        }
        let scene = Scene {
            daylight: None,
            room: Room { enclosure, boxes, meshes: Vec::new(), luminaires: Vec::new() },
            tubes: Vec::new(),
            grids: Vec::new(),
            views: Vec::new(),
            channels: Channels::Rgb,
        };
        let follow = Follow { interreflection: true, guide_return: true, objects: true };
        TraceableScene::new(&scene, follow).unwrap()
    }

    /// By hand: two mirrors that do not face each other have two chains each way; two that do, of 0.5, chains of up to five mirrors, and what
    /// is left out is no brighter than 1/64.
    #[test]
    fn chains_end_where_they_are_faint() {
        let chains = |mirrors: &[(Face, f64)]| room(mirrors, Vec::new()).mirrors;
        assert!(chains(&[]).is_empty() && !chains(&[]).shows_more());
        let one = chains(&[(Face::North, 0.5)]);
        assert_eq!((one.chains.len(), one.shows_more()), (1, false));
        let opposite = chains(&[(Face::North, 0.5), (Face::South, 0.5)]);
        assert_eq!((opposite.chains.len(), opposite.shows_more(), opposite.leaves_out()), (2 * 5, true, false));
        let bright = chains(&[(Face::North, 0.9), (Face::South, 0.9), (Face::East, 0.9)]);
        assert_eq!((bright.chains.len(), bright.leaves_out()), (MOST_CHAINS, true));
    }

    /// By hand: from (1, 1, 1) a source at (1.5, 1, 2) is seen in the mirror at y = 3 along (0.5, 4, 1), as long as nothing stands there; by
    /// way of both mirrors 2 + 3 + 1 m off along y; and the chains that a way goes on to have these numbers.
    #[test]
    fn ways_are_unfolded() {
        let mirrors = [(Face::North, 0.5), (Face::South, 0.8)];
        let scene = room(&mirrors, Vec::new());
        let (place, source) = (DVec3::ONE, DVec3::new(1.5, 1.0, 2.0));
        let [north, south] = [Face::North, Face::South].map(SurfaceId::of_face);
        let by_north = scene.mirrors.next(None, north).unwrap();
        let both = scene.mirrors.next(Some(by_north), south).unwrap();
        assert_eq!(scene.mirrors.next(Some(by_north), north), None);
        for (chain, across, reflectance) in [(by_north, 4.0, 0.5), (both, 6.0, 0.4)] {
            let way = scene.way_by_mirrors::<1>(chain, (place, None), (source, None)).unwrap();
            let expected = DVec3::new(0.5, across, 1.0);
            assert!((way.toward - expected.normalize()).length() < 1e-12, "{way:?}");
            assert!((way.unfolded.length() - expected.length()).abs() < 1e-12, "{way:?}");
            // it ends north of the mirror at y = 0 and comes back from there, or south of that at y = 3
            assert_eq!(way.unfolded.y.signum(), if chain == both { 1.0 } else { -1.0 });
            assert!((way.reflectance.0[0] - reflectance).abs() < 1e-12);
        }
        let (size, base) = (DVec3::new(2.0, 0.1, 2.5), DVec3::new(1.0, 2.0, 0.0));
        let surface = Surface::diffuse([0.5; 3]);
        let hidden = room(&mirrors, vec![BoxObject { size, base, rotation: 0.0, surface }]);
        assert!(hidden.way_by_mirrors::<1>(by_north, (place, None), (source, None)).is_none());
        let behind = DVec3::new(1.0, 3.0 + 1e-6, 1.0);
        assert!(scene.mirrors.before(behind).all(|(chain, _)| chain != by_north));
    }

    /// The probabilities of all chains before a place add up to 1, and chains are chosen as often.
    #[test]
    fn chains_are_chosen_by_what_they_reflect() {
        let mirrors = room(&[(Face::North, 0.5), (Face::South, 0.8)], Vec::new()).mirrors;
        let count = 10_000;
        let mut seen = vec![0.0; mirrors.chains.len()];
        for number in 0..count {
            let (chain, probability) =
                mirrors.choose(DVec3::ONE, (f64::from(number) + 0.5) / f64::from(count)).unwrap();
            assert!((probability - mirrors.probability(chain, DVec3::ONE)).abs() < 1e-12);
            seen[chain] += 1.0 / f64::from(count);
        }
        for (chain, seen) in seen.into_iter().enumerate() {
            assert!((seen - mirrors.probability(chain, DVec3::ONE)).abs() < 2e-4);
        }
    }
}
