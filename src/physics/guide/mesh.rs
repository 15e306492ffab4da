//! Tubes described by triangle meshes.

use std::collections::HashMap;
use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::inner_side;
use super::mouth::Mouth;
use super::transit::{End, Entry, Transit};
use crate::geometry::TriangleMesh;
use crate::geometry::bvh::{TriangleBvh, TriangleHit};
use crate::geometry::opening_frame::{levelled, unlevelled};
use crate::geometry::welded;
use crate::optics::{Mirror, Spectrum};
use crate::sampling::roulette::faint_survival;
use crate::sampling::{PathRandom, warp};

/// Largest number of ray segments of one path.
const MAX_RAYS: u32 = 100_000;

/// Distance from a mirror at which its reflected rays start, relative to the size of the mesh: far more than the rounding of a hit.
const CLEARANCE: f64 = 1e-10;

/// Role of a triangle of the mesh; coefficients are linear Rec.709.
#[derive(Clone, Debug, PartialEq)]
pub enum Part {
    /// A thin cover that leaves directions unchanged. Nested covers attenuate one after the other.
    Collector {
        /// Transmittance from either side, 0..=1.
        transmittance: [f64; 3],
        /// Reflectance from either side; at most 1 together with the transmittance.
        reflectance: [f64; 3],
    },
    /// A wall that is a specular mirror inside and opaque outside.
    Pipe {
        /// Reflectance of the inner side, per bounce.
        reflectance: Mirror,
    },
    /// A diffuser in the opening's plane z = 0, where every ray ends anyway: not traced.
    Diffuser,
}

/// Reason why a mesh cannot be a tube.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshGuideError {
    /// No triangles that rays could meet: the mesh has neither a pipe nor a collector.
    #[error(
        "no triangle of the mesh belongs to a pipe or a collector: give a material of the mesh one of these roles in \
         `parts`"
    )]
    Empty,
    /// No single loop of edges at the upper end that a cap could close, for a pipe without a collector.
    #[error("without a collector, the pipe's upper end must be one closed loop of edges, but none was found")]
    NoUpperEnd,
}

/// A guide whose collector and pipe are triangles above the opening.
#[derive(Clone, Debug)]
pub struct MeshGuide {
    bvh: Arc<TriangleBvh>,
    facets: Arc<[Facet]>,
    /// Parts that facets refer to by index.
    parts: Arc<[Part]>,
    opening_radius: f64,
    /// Bounding sphere of the collector; `far` is a distance from its centre within which the whole mesh lies.
    collector_centre: DVec3,
    collector_radius: f64,
    far: f64,
    /// Flat end of the pipe through which all light enters; `None` if this is not certain.
    mouth: Option<Arc<Mouth>>,
    /// Matrix that turns directions of the room into those of the mesh, whose opening is level; `None` if the room's are.
    turn: Option<DMat3>,
}

/// Optical properties of a triangle.
#[derive(Clone, Copy, Debug)]
struct Facet {
    /// Index of its part.
    part: u32,
    /// Orientation of its normal: 1 into the pipe, -1 out of it, 0 if unknown.
    inward: i8,
    is_mirror: bool,
}

impl MeshGuide {
    /// Creates a guide from a `mesh` in metres in the tube's frame; `parts` has one entry per material; `opening_radius` is in metres.
    ///
    /// Without a collector the upper end of the pipe is closed by a clear cap, the fan of its boundary edges.
    pub fn new(mesh: &TriangleMesh, parts: &[Part], opening_radius: f64) -> Result<Self, MeshGuideError> {
        let is_traced = |material: &u32| parts[*material as usize] != Part::Diffuser;
        let traced = mesh.triangles.iter().zip(&mesh.triangle_materials).filter(|(_, material)| is_traced(material));
        let (mut triangles, mut triangle_parts): (Vec<[u32; 3]>, Vec<u32>) = traced.unzip();
        if triangles.is_empty() {
            return Err(MeshGuideError::Empty);
        }
        let mut positions = mesh.positions.clone();
        let mut parts = parts.to_vec();
        let is_cover = |parts: &[Part], part: u32| matches!(parts[part as usize], Part::Collector { .. });
        if !triangle_parts.iter().any(|part| is_cover(&parts, *part)) {
            let corners = triangles.iter().map(|corners| corners.map(|corner| positions[corner as usize]));
            let cap = upper_cap(&corners.collect::<Vec<_>>()).ok_or(MeshGuideError::NoUpperEnd)?;
            triangle_parts.extend(std::iter::repeat_n(parts.len() as u32, cap.len()));
            parts.push(Part::Collector { transmittance: [1.0; 3], reflectance: [0.0; 3] });
            for corners in cap {
                triangles.push([0, 1, 2].map(|corner| positions.len() as u32 + corner));
                positions.extend(corners);
            }
        }
        let at = |corners: &[u32; 3]| corners.map(|corner| positions[corner as usize]);
        let collector: Vec<DVec3> = triangles
            .iter()
            .zip(&triangle_parts)
            .filter(|(_, part)| is_cover(&parts, **part))
            .flat_map(|(corners, _)| at(corners))
            .collect();
        let low = collector.iter().fold(DVec3::INFINITY, |low, p| low.min(*p));
        let high = collector.iter().fold(DVec3::NEG_INFINITY, |high, p| high.max(*p));
        let collector_centre = 0.5 * (low + high);
        let distance = |p: &DVec3| (*p - collector_centre).length();
        let collector_radius = collector.iter().map(distance).fold(0.0, f64::max);
        let far = 1.01 * triangles.iter().flat_map(at).map(|p| distance(&p)).fold(0.0, f64::max);
        let is_mirror = |triangle: usize| matches!(parts[triangle_parts[triangle] as usize], Part::Pipe { .. });
        let places = welded::places(&mesh.positions);
        let mirrors = (0..triangles.len()).filter(|triangle| is_mirror(*triangle));
        let sides = welded::sides(
            mirrors.map(|triangle| (triangle as u32, triangles[triangle].map(|corner| places[corner as usize]))),
        );
        let reflects = |part: &u32| matches!(parts[*part as usize], Part::Collector { reflectance, .. } if reflectance != [0.0; 3]);
        let mouth = (!triangle_parts.iter().any(reflects)).then(|| {
            let mut at = vec![DVec3::ZERO; places.len()];
            places.iter().zip(&mesh.positions).for_each(|(place, position)| at[*place as usize] = *position);
            Mouth::of(&sides, &at, far)
        });
        let bvh = TriangleBvh::of_mesh(positions, triangles);
        let inward = inner_side::inward(&sides, is_mirror, &bvh);
        let facet =
            |(triangle, inward)| Facet { part: triangle_parts[triangle], inward, is_mirror: is_mirror(triangle) };
        Ok(Self {
            facets: inward.into_iter().enumerate().map(facet).collect(),
            bvh: Arc::new(bvh),
            parts: parts.into(),
            opening_radius,
            collector_centre,
            collector_radius,
            far,
            mouth: mouth.flatten().map(Arc::new),
            turn: None,
        })
    }

    /// Sets the matrix that turns directions of the room into those of the mesh ([`OpeningFrame::turn`]); `None` for a level opening.
    ///
    /// [`OpeningFrame::turn`]: crate::geometry::OpeningFrame::turn
    pub fn turned(self, turn: Option<DMat3>) -> Self {
        Self { turn, ..self }
    }

    /// Returns the number of triangles that rays are tested against, including the cap of an open upper end.
    pub fn triangle_count(&self) -> usize {
        self.facets.len()
    }

    pub(super) fn entry(&self, point: [f64; 2], direction: DVec3) -> Option<Entry> {
        let entry = self.level_entry(point, self.in_mesh(direction))?;
        Some(Entry { position: unlevelled(self.turn.as_ref(), entry.position), ..entry })
    }

    fn level_entry(&self, point: [f64; 2], direction: DVec3) -> Option<Entry> {
        if let Some(mouth) = &self.mouth {
            let cosine = mouth.cosine(direction);
            return (cosine > 0.0).then(|| {
                let aim = mouth.point(point);
                // from outside the whole mesh, so that it meets what is before the mouth
                let before = self.far + (aim - self.collector_centre).length();
                Entry { position: aim - direction * before, projected_area_m2: mouth.area_m2() * cosine }
            });
        }
        let offset = warp::around(direction, (warp::disc(point) * self.collector_radius).extend(0.0));
        Some(Entry {
            position: self.collector_centre + offset - direction * self.far,
            projected_area_m2: PI * self.collector_radius * self.collector_radius,
        })
    }

    pub(super) fn down<const C: usize>(
        &self,
        position: DVec3,
        direction: DVec3,
        random: &mut PathRandom,
    ) -> Transit<C> {
        self.in_room(self.level_down(self.in_mesh(position), self.in_mesh(direction), random))
    }

    fn in_mesh(&self, vector: DVec3) -> DVec3 {
        levelled(self.turn.as_ref(), vector)
    }

    fn in_room<const C: usize>(&self, transit: Transit<C>) -> Transit<C> {
        let [position, direction] =
            [transit.position, transit.direction].map(|vector| unlevelled(self.turn.as_ref(), vector));
        Transit { position, direction, ..transit }
    }

    fn level_down<const C: usize>(&self, position: DVec3, direction: DVec3, random: &mut PathRandom) -> Transit<C> {
        let rise = -position.z;
        if rise > 0.0 && direction.z > 0.0 {
            let at_opening = position + direction * (rise / direction.z);
            if at_opening.truncate().length() <= self.opening_radius {
                // from the ground, it cannot come through the room below
                return Transit {
                    end: End::Absorbed,
                    position,
                    direction,
                    collector: Spectrum::ONE,
                    mirrors: Spectrum::ONE,
                    entered: false,
                    rays: 0,
                };
            }
        }
        self.follow(position, direction, false, random)
    }

    pub(super) fn up<const C: usize>(&self, position: DVec3, direction: DVec3, random: &mut PathRandom) -> Transit<C> {
        self.in_room(self.follow(self.in_mesh(position), self.in_mesh(direction), true, random))
    }

    fn follow<const C: usize>(
        &self,
        position: DVec3,
        direction: DVec3,
        mut inside: bool,
        random: &mut PathRandom,
    ) -> Transit<C> {
        let mut transit = Transit {
            end: End::Absorbed,
            position,
            direction,
            collector: Spectrum::ONE,
            mirrors: Spectrum::ONE,
            entered: inside,
            rays: 0,
        };
        let from_below = inside;
        let mut left = None;
        // light that has crossed a collector from within is outside, unless it meets the inner side of the pipe
        let mut beyond = false;
        loop {
            transit.rays += 1;
            let hit = self.bvh.nearest(transit.position, transit.direction, left);
            if inside && transit.direction.z < 0.0 {
                let to_opening = (-transit.position.z / transit.direction.z).max(0.0);
                if hit.is_none_or(|hit| to_opening <= hit.distance) {
                    let mut below = transit.position + transit.direction * to_opening;
                    below.z = 0.0;
                    let reached = below.truncate().length() <= self.opening_radius * (1.0 + 1e-9);
                    if beyond && !reached {
                        transit.end = End::Top;
                        return transit;
                    }
                    transit.position = below;
                    transit.end = if reached { End::Opening } else { End::Lost };
                    return transit;
                }
            }
            let is_outer_side = |hit: TriangleHit| {
                let facet = &self.facets[hit.triangle as usize];
                let normal = self.bvh.normal(&hit);
                facet.is_mirror && f64::from(facet.inward) * transit.direction.dot(normal) > 0.0
            };
            if from_below && transit.rays == 1 && hit.is_none_or(is_outer_side) {
                // between the round opening and a pipe with corners there is no pipe
                return transit;
            }
            let Some(hit) = hit else {
                // otherwise the light passed by the mesh
                if beyond {
                    transit.end = End::Top;
                } else if inside {
                    transit.end = End::Lost;
                }
                return transit;
            };
            let facet = &self.facets[hit.triangle as usize];
            let normal = self.bvh.normal(&hit);
            let cosine = transit.direction.dot(normal);
            if beyond && facet.is_mirror && f64::from(facet.inward) * cosine >= 0.0 {
                transit.end = End::Top;
                return transit;
            }
            beyond &= !facet.is_mirror;
            left = Some(hit.triangle);
            transit.position += transit.direction * hit.distance;
            match &self.parts[facet.part as usize] {
                Part::Collector { transmittance, .. } if !inside => {
                    inside = true;
                    transit.entered = true;
                    transit.collector *= Spectrum::from_rgb(*transmittance);
                }
                Part::Collector { transmittance, reflectance } => {
                    let (out, back) = (Spectrum::<C>::from_rgb(*transmittance), Spectrum::<C>::from_rgb(*reflectance));
                    let fraction = if back.max() > 0.0 { back.max() / (back.max() + out.max()) } else { 0.0 };
                    if fraction == 0.0 || random.uniform() >= fraction {
                        transit.collector *= out * (1.0 / (1.0 - fraction));
                        beyond = true;
                        // past the neighbours of an edge, and past the pipe at its rim
                        transit.position += transit.direction * (CLEARANCE * self.far);
                    } else {
                        transit.collector *= back * (1.0 / fraction);
                        self.reflect(&mut transit, normal, hit.distance);
                    }
                }
                Part::Pipe { reflectance } => {
                    if !inside {
                        return transit;
                    }
                    transit.mirrors *= Spectrum::from_rgb(reflectance.reflectance(|| cosine.abs()));
                    self.reflect(&mut transit, normal, hit.distance);
                }
                Part::Diffuser => {}
            }
            // paths that leave are followed to their end: they need few more rays
            let survival = if beyond { 1.0 } else { faint_survival(transit.weight().max(), 1.0) };
            if survival < 1.0 {
                if survival == 0.0 || random.uniform() >= survival {
                    transit.mirrors = Spectrum::ZERO;
                    return transit;
                }
                transit.mirrors = transit.mirrors * (1.0 / survival);
            }
            if transit.rays >= MAX_RAYS {
                transit.end = End::Cut;
                return transit;
            }
        }
    }

    /// Reflects a ray at a mirror that it has hit after `distance` m.
    fn reflect<const C: usize>(&self, transit: &mut Transit<C>, normal: DVec3, distance: f64) {
        // back off a little: at an edge the reflected ray may point through the neighbour, which must lie ahead of it
        transit.position -= transit.direction * (CLEARANCE * self.far).min(0.5 * distance);
        transit.direction -= normal * (2.0 * transit.direction.dot(normal));
        // rounding would grow over hundreds of bounces
        transit.direction = transit.direction.normalize();
    }
}

/// Returns a fan that closes the highest loop of boundary edges; `None` if the boundary is not made of simple loops.
fn upper_cap(triangles: &[[DVec3; 3]]) -> Option<Vec<[DVec3; 3]>> {
    let name = |p: DVec3| (p + DVec3::ZERO).to_array().map(f64::to_bits);
    let mut uses: HashMap<_, (u32, DVec3, DVec3)> = HashMap::new();
    for triangle in triangles {
        for k in 0..3 {
            let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
            let key = (name(a).min(name(b)), name(a).max(name(b)));
            uses.entry(key).or_insert((0, a, b)).0 += 1;
        }
    }
    let mut neighbours: HashMap<_, Vec<DVec3>> = HashMap::new();
    let mut boundary: Vec<(DVec3, DVec3)> =
        uses.into_values().filter(|(count, ..)| *count == 1).map(|(_, a, b)| (a, b)).collect();
    // the map's order differs from run to run
    boundary.sort_by_key(|(a, b)| (name(*a), name(*b)));
    for (a, b) in &boundary {
        neighbours.entry(name(*a)).or_default().push(*b);
        neighbours.entry(name(*b)).or_default().push(*a);
    }
    if neighbours.values().any(|next| next.len() != 2) {
        return None;
    }
    let start = boundary.iter().map(|(a, _)| *a).max_by(|a, b| a.z.total_cmp(&b.z))?;
    let mut loop_points = vec![start];
    let mut previous = start;
    let mut current = neighbours.get(&name(start))?[0];
    while name(current) != name(start) {
        loop_points.push(current);
        let next = neighbours.get(&name(current))?;
        let onward = if name(next[0]) == name(previous) { next[1] } else { next[0] };
        previous = current;
        current = onward;
    }
    let centre = loop_points.iter().copied().sum::<DVec3>() / loop_points.len() as f64;
    let count = loop_points.len();
    Some((0..count).map(|k| [centre, loop_points[k], loop_points[(k + 1) % count]]).collect())
}
