//! Parts of a scene's surfaces on which photons can lie: [`Domain`]s of the faces of the room and its boxes, and covered regions that are
//! subtracted from the facets of its meshes.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use glam::DVec3;

use super::domain::{Domain, Flat, Region, regions};
use crate::geometry::covered::Edge;
use crate::integrator::method::{Caveat, CaveatCode};
use crate::sampling::warp;
use crate::traceable::solids::{Owner, Sheet, Solid, sections};
use crate::traceable::{Side, SurfaceId, TraceableScene};

/// Steps of work (a bound that is compared, a quarter of a triangle that is cut) after which no more facets are cut: some tenths of a
/// second. A mesh of 30 000 facets among 20 boxes takes a tenth of it, two such meshes that cross take more.
const MOST_WORK: usize = 25_000_000;

/// Steps of work to cut a triangle.
const WORK_PER_TRIANGLE: usize = 4;

/// Domains of all surfaces of a scene.
#[derive(Debug)]
pub struct Surfaces {
    /// Domains of the faces of the room and its boxes, in the order of their numbers.
    pub faces: Vec<Domain>,
    /// Covered sides of facets, by the index of the surface.
    facets: BTreeMap<usize, CoveredSide>,
    /// Reason why some covered areas were not subtracted; `None` if all were.
    pub uncut: Option<Uncut>,
}

/// Covered regions of one side of a facet.
#[derive(Debug)]
struct CoveredSide {
    sheet: Sheet,
    regions: Vec<Region>,
}

/// Reason why kernels are not clipped everywhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Uncut {
    /// A mesh that is not closed stands on a face, or passes through it: it covers nothing, and kernels reach to its other side.
    OpenMesh,
    /// There are too many facets near too large meshes: the smaller facets are not cut.
    TooManyFacets,
}

impl Uncut {
    /// Returns the caveat on the results of a method that follows from it.
    pub fn caveat(self, method: &str) -> Caveat {
        let what = match self {
            Self::OpenMesh => {
                "a mesh that is not closed stands on a face or goes through it: within one gather radius of it, \
                 photons on its other side are counted too"
            }
            Self::TooManyFacets => {
                "meshes of too many facets touch each other: on the smaller facets, areas that other facets cover are \
                 not subtracted, and too few photons are counted beside them"
            }
        };
        Caveat {
            code: CaveatCode::KernelsNotCut,
            detail: format!("{method}: {what}; methods that trace paths do not have this error"),
        }
    }
}

impl Surfaces {
    /// Computes the domains of a scene's surfaces.
    pub fn new(scene: &TraceableScene) -> Self {
        let solids = Solid::all(scene);
        let mut open = false;
        let mut faces: Vec<Domain> = (0..scene.numbering.faces).map(|face| Domain::room_face(scene, face)).collect();
        // facets are looked at for every face
        let facets = scene.meshes.as_ref().map_or(0, |meshes| meshes.facet_count());
        let many = 6 * scene.boxes.len() * facets > MOST_WORK;
        for domain in &mut faces {
            open |= domain.cut(scene, &solids, None, Flat::Covers);
        }
        for (number, object) in scene.boxes.iter().enumerate() {
            for face in 0..6 {
                let [corner, u, v] = object.face(face);
                // u x v points along the positive axis, the lower of two faces looks the other way
                let looks = if face % 2 == 0 { -1.0 } else { 1.0 };
                let mut domain = Domain::rectangle(corner, u, v, looks);
                open |= domain.cut(
                    scene,
                    &solids,
                    Some(Owner::Box(number)),
                    if many { Flat::Passes } else { Flat::Covers },
                );
                faces.push(domain);
            }
        }
        let mut surfaces = Self { faces, facets: BTreeMap::new(), uncut: open.then_some(Uncut::OpenMesh) };
        if !surfaces.cut_facets(scene, &solids) || many {
            surfaces.uncut = surfaces.uncut.or(Some(Uncut::TooManyFacets));
        }
        surfaces
    }

    /// Subtracts solids from facets, the largest first; false if that took more than [`MOST_WORK`].
    fn cut_facets(&mut self, scene: &TraceableScene, solids: &[Solid]) -> bool {
        let Some(meshes) = &scene.meshes else { return true };
        if solids.len() < 2 {
            return true;
        }
        let mut order: Vec<usize> = (0..meshes.facet_count()).collect();
        order.sort_by(|a, b| meshes.area_m2(*b).total_cmp(&meshes.area_m2(*a)).then(a.cmp(b)));
        let mut work = 0;
        for facet in order {
            let own = Owner::Piece(meshes.piece(facet));
            work += solids.len();
            if work > MOST_WORK {
                return false;
            }
            let corners = || meshes.edges(facet).flatten();
            let normal = meshes.normal(facet);
            let origin = meshes.point_of(facet);
            // corners of a facet may lie off its plane, and so may what stands on it
            let uneven = corners().map(|p| normal.dot(p - origin).abs()).fold(0.0, f64::max);
            let (u, v) = (warp::around(normal, DVec3::X), warp::around(normal, DVec3::Y));
            let low = corners().fold(DVec3::INFINITY, |low, p| low.min(p));
            let high = corners().fold(DVec3::NEG_INFINITY, |high, p| high.max(p));
            let hair = scene.coinciding() + uneven;
            for (side, seen) in [(Side::Front, normal), (Side::Back, -normal)] {
                let sheet = Sheet { origin, u, v, seen, low, high, hair };
                let near: Vec<&Solid> =
                    solids.iter().filter(|solid| solid.of != own && solid.may_cut(&sheet)).collect();
                if near.is_empty() {
                    continue;
                }
                work += WORK_PER_TRIANGLE * near.iter().map(|solid| solid.work()).sum::<usize>();
                if work > MOST_WORK {
                    return false;
                }
                let outline: Vec<Edge> = meshes.edges(facet).map(|edge| edge.map(|p| sheet.flat(p))).collect();
                let regions = regions(&outline, sections(near.into_iter(), &sheet).covers, scene);
                if !regions.is_empty() {
                    self.facets.insert(scene.numbering.facet_side(facet, side).index(), CoveredSide { sheet, regions });
                }
            }
        }
        true
    }

    /// Returns the area in m2 of a surface that light can reach within `radius` m of a point on it.
    #[inline]
    pub fn area(&self, scene: &TraceableScene, surface: SurfaceId, centre: DVec3, radius: f64) -> f64 {
        match scene.meshes.as_ref().and_then(|meshes| Some((meshes, scene.numbering.facet_of(surface)?))) {
            Some((meshes, facet)) => {
                let area = meshes.area_within(facet, centre, radius);
                match self.facets.get(&surface.index()) {
                    Some(CoveredSide { sheet, regions }) => {
                        let p = sheet.flat(centre);
                        (area - regions.iter().map(|region| region.area(p, radius)).sum::<f64>()).max(0.0)
                    }
                    None => area,
                }
            }
            None => self.faces[surface.index()].area(centre, radius),
        }
    }

    /// Returns the area in m2 within `radius` m on a surface that nothing covers: the disc, or the facet if that is smaller.
    pub fn full(&self, scene: &TraceableScene, surface: SurfaceId, radius: f64) -> f64 {
        let disc = PI * radius * radius;
        let facet = scene.meshes.as_ref().and_then(|meshes| Some((meshes, scene.numbering.facet_of(surface)?)));
        facet.map_or(disc, |(meshes, facet)| meshes.area_m2(facet).min(disc))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::TriangleMesh;
    use crate::optics::Surface;
    use crate::scene::{BoxObject, MeshObject};
    use crate::traceable::test_rooms::{compiled, empty};

    const GREY: Surface = Surface { reflectance: [0.5; 3], specular: None };

    fn cuboid(base: [f64; 3], size: [f64; 3]) -> BoxObject {
        BoxObject { size: size.into(), base: base.into(), rotation: 0.0, surface: GREY }
    }

    /// Returns a cuboid like [`cuboid`], as a closed mesh of 12 triangles: the lower face is the first two. The last face is slightly
    /// brighter, because a cuboid of one surface would be traced as a box.
    fn mesh(base: [f64; 3], size: [f64; 3]) -> MeshObject {
        let corner = |k: usize| {
            let fraction = DVec3::new((k & 1) as f64 - 0.5, (k >> 1 & 1) as f64 - 0.5, (k >> 2) as f64);
            DVec3::from(base) + fraction * DVec3::from(size)
        };
        let faces = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
        let mesh = TriangleMesh {
            positions: (0..8).map(corner).collect(),
            triangles: faces.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
            triangle_materials: [vec![0; 10], vec![1; 2]].concat(),
            materials: vec![String::new(); 2],
            ..TriangleMesh::default()
        };
        let brighter = Surface { reflectance: GREY.reflectance.map(|fraction| fraction + 1e-9), ..GREY };
        MeshObject::new(mesh, vec![GREY, brighter])
    }

    /// Builds a cube of 4 m with some objects.
    fn room(boxes: Vec<BoxObject>, meshes: Vec<MeshObject>) -> TraceableScene {
        let mut scene = empty(DVec3::splat(4.0), Some(GREY));
        (scene.room.boxes, scene.room.meshes) = (boxes, meshes);
        compiled(&scene)
    }

    /// Returns the reachable area within a radius of the point hit by a ray, over the area of the disc.
    fn fraction(scene: &TraceableScene, from: DVec3, toward: DVec3, radius: f64) -> f64 {
        let hit = scene.intersect(from, toward, None);
        let crate::traceable::Place::Surface(surface) = hit.place else { panic!("{:?}", hit.place) };
        let surfaces = Surfaces::new(scene);
        assert_eq!(surfaces.uncut, None);
        surfaces.area(scene, surface, hit.position, radius) / (PI * radius * radius)
    }

    fn close(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-6, "{found}, {expected}");
    }

    /// Cuboids of 0.4 m width in the middle of the top of one of 1 m, each of them a box or a mesh, and two that cross: beside the upper
    /// one's side half of a disc is left, beside its corner three quarters, and away from it all; of the whole top, all that it does not
    /// cover.
    #[test]
    fn what_stands_on_a_top_is_taken_away() {
        let (below, above) = (([2.0, 2.0, 0.0], [1.0, 1.0, 0.5]), ([2.0, 2.0, 0.5], [0.4, 0.4, 0.4]));
        let through = ([2.0, 2.0, 0.25], [0.4, 0.4, 0.6]);
        let scenes = [
            room(vec![cuboid(below.0, below.1), cuboid(above.0, above.1)], vec![]),
            room(vec![cuboid(below.0, below.1)], vec![mesh(above.0, above.1)]),
            room(vec![cuboid(above.0, above.1)], vec![mesh(below.0, below.1)]),
            room(vec![], vec![mesh(below.0, below.1), mesh(above.0, above.1)]),
            room(vec![], vec![mesh(below.0, below.1), mesh(through.0, through.1)]),
            room(vec![cuboid(below.0, below.1)], vec![mesh(through.0, through.1)]),
        ];
        for scene in &scenes {
            let top = |x: f64, y: f64, radius: f64| fraction(scene, DVec3::new(x, y, 0.7), DVec3::NEG_Z, radius);
            close(top(2.2 + 1e-7, 2.0, 0.1), 0.5);
            close(top(2.2 + 1e-7, 2.2 + 1e-7, 0.1), 0.75);
            close(top(2.4, 2.0, 0.05), 1.0);
            close(top(2.3, 2.0, 9.0) * PI * 81.0, 1.0 - 0.16);
        }
    }

    /// Overhanging solids cover only the part of the surface below them, and an area covered by two counts once.
    #[test]
    fn covers_are_clipped_and_joined() {
        let low = cuboid([2.0, 2.0, 0.0], [1.0, 1.0, 0.5]);
        let over = cuboid([2.5, 2.0, 0.5], [0.4, 0.4, 0.4]);
        let top = |scene: &TraceableScene| fraction(scene, DVec3::new(1.6, 2.0, 3.0), DVec3::NEG_Z, 9.0) * PI * 81.0;
        close(top(&room(vec![low, over], vec![])), 1.0 - 0.08);
        close(top(&room(vec![low, over], vec![mesh([2.5, 2.1, 0.5], [0.4, 0.4, 0.3])])), 1.0 - 0.10);
        // on the floor, too
        let floor = room(vec![low, cuboid([2.5, 2.5, 0.0], [1.0, 1.0, 0.3])], vec![]);
        close(top_of_floor(&floor), 16.0 - 1.75);
    }

    fn top_of_floor(scene: &TraceableScene) -> f64 {
        fraction(scene, DVec3::new(0.2, 0.2, 3.0), DVec3::NEG_Z, 99.0) * PI * 99.0 * 99.0
    }

    /// Cuboids side by side: half of a disc is left on the taller one's side, at the height of the lower one.
    #[test]
    fn what_stands_beside_is_taken_away() {
        let (tall, low) = (([1.5, 2.0, 0.0], [1.0, 1.0, 1.0]), ([2.5, 2.0, 0.0], [1.0, 0.6, 0.4]));
        for scene in [
            room(vec![cuboid(tall.0, tall.1), cuboid(low.0, low.1)], vec![]),
            room(vec![cuboid(tall.0, tall.1)], vec![mesh(low.0, low.1)]),
            room(vec![cuboid(low.0, low.1)], vec![mesh(tall.0, tall.1)]),
            room(vec![], vec![mesh(tall.0, tall.1), mesh(low.0, low.1)]),
        ] {
            let side = |y: f64, z: f64, radius: f64| fraction(&scene, DVec3::new(3.5, y, z), DVec3::NEG_X, radius);
            close(side(2.0, 0.4 + 1e-7, 0.1), 0.5);
            close(side(2.3 + 1e-7, 0.4 + 1e-7, 0.1), 0.75);
            close(side(2.0, 0.7, 9.0) * PI * 81.0, 1.0 - 0.24);
        }
    }

    /// A cube inside a larger one is a cavity: no light passes from one to the other, and the cavity remains part of the plane.
    #[test]
    fn cavities_stay() {
        let nested = room(vec![], vec![mesh([2.0, 2.0, 0.5], [2.0, 2.0, 2.0]), mesh([2.0, 2.0, 1.0], [1.0, 1.0, 1.0])]);
        let plane = Domain::horizontal_plane(&nested, 1.5);
        close(plane.area(DVec3::new(2.0, 2.0, 1.5), 99.0), 16.0 - 3.0);
    }

    /// A cube without one of its sides has no inside, which is reported.
    #[test]
    fn open_meshes_are_reported() {
        let mut open = mesh([2.0, 2.0, 0.0], [1.0, 1.0, 1.0]);
        open.mesh.triangles.truncate(11);
        open.mesh.triangle_materials.truncate(11);
        assert_eq!(Surfaces::new(&room(vec![], vec![open])).uncut, Some(Uncut::OpenMesh));
    }
}
