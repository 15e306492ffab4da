//! Plane mirrors of a room, and the chains of them by which light may come: what is seen by a chain is an image.
//!
//! A chain names the mirrors that a way meets, from the place that is lit toward the source. A source at its end is seen from that place
//! where its image lies, and the image of the place lies as far from the source: the way is unfolded to a straight line.

use glam::DVec3;
use smallvec::{SmallVec, smallvec};

use super::box_object::TraceableBox;
use super::enclosure::TraceableEnclosure;
use super::surface_id::{Numbering, Side, SurfaceId};
use crate::optics::{Spectrum, SurfaceOptics};

/// Chains that reflect less in all are left out, and at most so many are kept, the brightest.
const LEAST_REFLECTANCE: f64 = 0.002;
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
    /// Finds the plane mirrors of a room and its boxes and their chains; `surfaces`: optics by number.
    pub fn new(
        enclosure: &TraceableEnclosure,
        boxes: &[TraceableBox],
        numbering: Numbering,
        surfaces: &[Option<SurfaceOptics>],
    ) -> Self {
        let mirror = |surface: SurfaceId| surfaces[surface.index()].as_ref().filter(|optics| optics.is_mirror());
        let faces = enclosure.polygons.iter().enumerate().filter_map(|(face, polygon)| {
            let surface = SurfaceId::numbered(face);
            let corners: Vec<DVec3> = polygon.corners().collect();
            Some(plane(surface, mirror(surface)?, *corners.first()?, enclosure.normal(face), corners))
        });
        let of_boxes =
            boxes.iter().enumerate().flat_map(|(number, object)| (0..6).map(move |face| (number, object, face)));
        let of_boxes = of_boxes.filter_map(|(number, object, face)| {
            let surface = numbering.box_face(number, face);
            let [corner, u, v] = object.face(face);
            let corners = vec![corner, corner + u, corner + u + v, corner + v];
            Some(plane(surface, mirror(surface)?, corner, object.normal(face), corners))
        });
        let planes: Vec<Plane> = faces.chain(of_boxes).collect();
        let sides = [Side::Front, Side::Back];
        let meshes = (0..numbering.facets)
            .any(|facet| sides.iter().any(|side| mirror(numbering.facet_side(facet, *side)).is_some()));
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

    /// Connections by a chain where the brightest one has so many, at least one: in proportion to what it reflects.
    pub fn connections(&self, chain: usize, of_brightest: f64) -> f64 {
        let brightest = self.chains.iter().map(Chain::brightest).fold(0.0, f64::max);
        (of_brightest * self.chains[chain].brightest() / brightest).round().max(1.0)
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

    /// Number of chains that are kept.
    pub fn count(&self) -> usize {
        self.chains.len()
    }

    /// Image of a source at the end of a chain; `None` where it is not behind the first mirror.
    pub fn shown(&self, chain: usize, source: DVec3) -> Option<DVec3> {
        let planes = &self.chains[chain].planes;
        let shown = planes.iter().rev().fold(source, |point, number| self.planes[*number].image(point));
        (self.planes[planes[0]].height(shown) < 0.0).then_some(shown)
    }

    /// Reflectance of all mirrors of a chain together.
    pub fn reflectance<const C: usize>(&self, chain: usize) -> Spectrum<C> {
        Spectrum::from_rgb(self.chains[chain].reflectance)
    }

    /// The surfaces of the mirrors of a chain, each with a way along `direction` turned by it; `None` from one that it comes to from behind.
    pub fn turns(&self, chain: usize, mut direction: DVec3) -> impl Iterator<Item = (SurfaceId, Option<DVec3>)> {
        self.chains[chain].planes.iter().map(move |number| {
            let plane = &self.planes[*number];
            let comes_from_before = direction.dot(plane.normal) < 0.0;
            direction = plane.turn(direction);
            (plane.surface, comes_from_before.then_some(direction))
        })
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
