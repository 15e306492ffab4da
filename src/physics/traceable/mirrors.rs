//! Plane mirrors of a room, and the chains of reflections in them by which light may arrive: a source seen by a chain is an image.
//!
//! A chain lists the mirrors that a path meets, from the lit place toward the source. From that place, the source is seen where its image
//! lies, and the image of the place lies as far from the source: the path is unfolded into a straight line.

use std::sync::Arc;

use glam::DVec3;
use smallvec::{SmallVec, smallvec};

use super::box_object::TraceableBox;
use super::enclosure::TraceableEnclosure;
use super::surface_id::{Numbering, Side, SurfaceId};
use crate::optics::{Spectrum, SurfaceOptics};

/// Smallest reflectance of a chain that is kept; at most `MOST_CHAINS` are, shorter ones first, of one length the brightest.
const LEAST_REFLECTANCE: f64 = 0.002;
const MOST_CHAINS: usize = 64;

/// Smallest reflectance of a chain whose omission is worth a warning.
const BRIGHT: f64 = 0.1;

/// Plane mirrors of a room, and the chains of them that are kept.
#[derive(Clone, Debug, Default)]
pub struct Mirrors {
    planes: Vec<MirrorPlane>,
    chains: Vec<Chain>,
    /// True if mirrors reflect light by chains that are not kept, too.
    shows_more: bool,
    /// True if chains that are not kept may be bright: those of mesh facets, or those beyond `MOST_CHAINS`.
    leaves_out: bool,
}

/// A plane mirror.
#[derive(Clone, Debug)]
struct MirrorPlane {
    surface: SurfaceId,
    /// A point of the mirror, in m; `normal` is the unit normal of the side that reflects.
    point: DVec3,
    normal: DVec3,
    corners: Vec<DVec3>,
    /// Reflectance, linear Rec.709.
    reflectance: [f64; 3],
}

/// Mirrors that a path meets one after the other.
#[derive(Clone, Debug)]
struct Chain {
    /// Numbers of the mirrors, the one nearest to the lit place along the path first.
    planes: SmallVec<[usize; 4]>,
    /// Number of the chain without the last mirror; `None` for a chain of one mirror.
    before: Option<usize>,
    /// Product of the reflectances, linear Rec.709.
    reflectance: [f64; 3],
}

impl Chain {
    fn brightest(&self) -> f64 {
        brightest(self.reflectance)
    }
}

impl MirrorPlane {
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

    /// True if a part of each mirror lies before the other.
    fn faces(&self, other: &Self) -> bool {
        let before = |plane: &Self, other: &Self| other.corners.iter().any(|corner| plane.height(*corner) > 0.0);
        before(self, other) && before(other, self)
    }
}

impl Mirrors {
    /// Finds the plane mirrors of a room and its boxes, and their chains; `surfaces` are the optics by surface number, of which those count
    /// as mirrors that are accepted.
    pub fn new(
        enclosure: &TraceableEnclosure,
        boxes: &[TraceableBox],
        numbering: Numbering,
        surfaces: &[Option<Arc<SurfaceOptics>>],
        accepts: impl Fn(&SurfaceOptics) -> bool,
    ) -> Self {
        let mirror = |surface: SurfaceId| surfaces[surface.index()].as_deref().filter(|optics| accepts(optics));
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
        let planes: Vec<MirrorPlane> = faces.chain(of_boxes).collect();
        let sides = [Side::Front, Side::Back];
        let meshes = (0..numbering.facets)
            .any(|facet| sides.iter().any(|side| mirror(numbering.facet_side(facet, *side)).is_some()));
        let mut mirrors = Self { planes, chains: Vec::new(), shows_more: meshes, leaves_out: meshes };
        mirrors.find_chains();
        mirrors
    }

    /// Adds all chains of enough reflectance, shorter ones first.
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

    /// Returns the chains that extend a chain by one mirror.
    fn longer(&self, number: usize) -> Vec<Chain> {
        let chain = &self.chains[number];
        let Some(last) = chain.planes.last().map(|last| &self.planes[*last]) else { return Vec::new() };
        let next = self.planes.iter().enumerate().filter(|(_, plane)| plane.faces(last));
        let longer = |(next, plane): (usize, &MirrorPlane)| {
            let mut planes = chain.planes.clone();
            planes.push(next);
            let reflectance = std::array::from_fn(|channel| chain.reflectance[channel] * plane.reflectance[channel]);
            Chain { planes, before: Some(number), reflectance }
        };
        next.map(longer).collect()
    }

    /// Returns the number of connections by a chain, at least 1, in proportion to its reflectance; the brightest chain has
    /// `of_brightest`.
    pub fn connections(&self, chain: usize, of_brightest: f64) -> f64 {
        let brightest = self.chains.iter().map(Chain::brightest).fold(0.0, f64::max);
        (of_brightest * self.chains[chain].brightest() / brightest).round().max(1.0)
    }

    /// True if no chain is kept.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.chains.is_empty()
    }

    /// True if mirrors reflect light by chains that are not kept, however faint.
    pub fn shows_more(&self) -> bool {
        self.shows_more
    }

    /// True if mirrors may reflect bright light by chains that are not kept.
    pub fn leaves_out(&self) -> bool {
        self.leaves_out
    }

    /// Returns the chain that a path along `chain`, or along none, becomes by a reflection at a surface; `None` where that chain is not
    /// kept.
    pub fn next(&self, chain: Option<usize>, surface: SurfaceId) -> Option<usize> {
        let last = |chain: &Chain| chain.planes.last().is_some_and(|last| self.planes[*last].surface == surface);
        self.chains.iter().position(|other| other.before == chain && last(other))
    }

    /// Lists the chains whose first mirror faces a place, each with the largest channel of its reflectance.
    pub fn before(&self, position: DVec3) -> impl Iterator<Item = (usize, f64)> {
        let shows = move |chain: &Chain| self.planes[chain.planes[0]].height(position) > 0.0;
        self.chains
            .iter()
            .enumerate()
            .filter(move |(_, chain)| shows(chain))
            .map(|(number, chain)| (number, chain.brightest()))
    }

    /// Chooses a chain among those whose first mirror faces a place, by a random number in 0..1 and in proportion to reflectance; returns
    /// it with the probability of the choice.
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

    /// Returns the probability by which [`Mirrors::choose`] chooses a chain at a place.
    pub fn probability(&self, chain: usize, position: DVec3) -> f64 {
        self.chains[chain].brightest() / self.before(position).map(|(_, weight)| weight).sum::<f64>()
    }

    /// Returns the number of chains that are kept.
    pub fn count(&self) -> usize {
        self.chains.len()
    }

    /// Returns the image of a source in a chain of mirrors; `None` where it is not behind the first mirror.
    pub fn shown(&self, chain: usize, source: DVec3) -> Option<DVec3> {
        let planes = &self.chains[chain].planes;
        let shown = planes.iter().rev().fold(source, |point, number| self.planes[*number].image(point));
        (self.planes[planes[0]].height(shown) < 0.0).then_some(shown)
    }

    /// Returns the reflectance of all mirrors of a chain together.
    pub fn reflectance<const C: usize>(&self, chain: usize) -> Spectrum<C> {
        Spectrum::from_rgb(self.chains[chain].reflectance)
    }

    /// Follows a ray along a chain: returns the surface of each mirror with the direction reflected there; `None` where the ray comes
    /// from behind.
    pub fn turns(&self, chain: usize, mut direction: DVec3) -> impl Iterator<Item = (SurfaceId, Option<DVec3>)> {
        self.chains[chain].planes.iter().map(move |number| {
            let plane = &self.planes[*number];
            let comes_from_before = direction.dot(plane.normal) < 0.0;
            direction = plane.turn(direction);
            (plane.surface, comes_from_before.then_some(direction))
        })
    }

    /// Returns the images of a place and of its normal in a chain of mirrors.
    pub fn image(&self, chain: usize, (position, normal): (DVec3, DVec3)) -> (DVec3, DVec3) {
        let turn = |(position, normal): (DVec3, DVec3), number: &usize| {
            let plane = &self.planes[*number];
            (plane.image(position), plane.turn(normal))
        };
        self.chains[chain].planes.iter().fold((position, normal), turn)
    }
}

fn plane(surface: SurfaceId, optics: &SurfaceOptics, point: DVec3, normal: DVec3, corners: Vec<DVec3>) -> MirrorPlane {
    let reflectance: Spectrum<3> = optics.specular();
    MirrorPlane { surface, point, normal, corners, reflectance: reflectance.0 }
}

fn brightest(rgb: [f64; 3]) -> f64 {
    rgb.into_iter().fold(0.0, f64::max)
}
