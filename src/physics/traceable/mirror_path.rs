//! Paths that light takes by plane mirrors.

use glam::DVec3;

use super::mirrors::Mirrors;
use super::rays::Place;
use super::scene::TraceableScene;
use super::surface_id::SurfaceId;
use crate::optics::Spectrum;

/// A path from a place to a source by a chain of mirrors.
#[derive(Clone, Copy, Debug)]
pub struct MirrorPath<const C: usize> {
    /// Unit vector along the first segment, from the place.
    pub toward: DVec3,
    /// Vector from the image of the place to the source, in m: its length is that of the whole path, its direction that of the last
    /// segment.
    pub unfolded: DVec3,
    /// Product of the reflectances of the mirrors.
    pub reflectance: Spectrum<C>,
    /// Number of straight segments.
    pub rays: u64,
}

impl TraceableScene {
    /// Finds the path from a place to a source by a chain of mirrors; `None` where the mirrors do not show the source, or something
    /// stands between. The surfaces that place and source lie on do not occlude.
    pub fn mirror_path<const C: usize>(
        &self,
        (mirrors, chain): (&Mirrors, usize),
        (place, from): (DVec3, Option<SurfaceId>),
        (source, to): (DVec3, Option<SurfaceId>),
    ) -> Option<MirrorPath<C>> {
        let toward = (mirrors.shown(chain, source)? - place).try_normalize()?;
        let (mut origin, mut direction, mut surface, mut rays) = (place, toward, from, 1);
        for (mirror, turned) in mirrors.turns(chain, toward) {
            let hit = self.intersect(origin, direction, surface);
            if hit.place != Place::Surface(mirror) {
                return None;
            }
            (origin, direction, surface, rays) = (hit.position, turned?, Some(mirror), rays + 1);
        }
        // a source that lies behind the last mirror is not shown by it
        if (source - origin).dot(direction) <= 0.0 || !self.visible(source, to, origin, surface) {
            return None;
        }
        let (image, _) = mirrors.image(chain, (place, DVec3::ZERO));
        Some(MirrorPath { toward, unfolded: source - image, reflectance: mirrors.reflectance(chain), rays })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::{Specular, Surface};
    use crate::scene::{BoxObject, Face};
    use crate::traceable::test_rooms::{compiled, empty};

    const SIZE: DVec3 = DVec3::new(2.0, 3.0, 2.5);

    /// An empty room of 2 x 3 x 2.5 m whose faces of these numbers are mirrors of these reflectances.
    fn room(mirrors: &[(Face, f64)], boxes: Vec<BoxObject>) -> TraceableScene {
        let mut scene = empty(SIZE, Some(Surface::diffuse([0.2; 3])));
        scene.room.boxes = boxes;
        for (face, reflectance) in mirrors {
            let specular = Some(Specular { reflectance: [*reflectance; 3], roughness: 0.0 });
            scene.room.enclosure.paint(*face as usize, Some(Surface { specular, ..Surface::diffuse([0.1; 3]) }));
        }
        compiled(&scene)
    }

    /// By hand: one mirror has one chain; two of reflectance 0.5 that face each other have two chains of each length up to eight mirrors,
    /// and chains that are left out reflect no more than 1/512; three of 0.9 have more chains than the 64 that are kept.
    #[test]
    fn chains_end_where_they_are_faint() {
        let chains = |mirrors: &[(Face, f64)]| room(mirrors, Vec::new()).mirrors;
        assert!(chains(&[]).is_empty() && !chains(&[]).shows_more());
        let one = chains(&[(Face::North, 0.5)]);
        assert_eq!((one.count(), one.shows_more()), (1, false));
        let opposite = chains(&[(Face::North, 0.5), (Face::South, 0.5)]);
        assert_eq!((opposite.count(), opposite.shows_more(), opposite.leaves_out()), (2 * 8, true, false));
        let bright = chains(&[(Face::North, 0.9), (Face::South, 0.9), (Face::East, 0.9)]);
        assert_eq!((bright.count(), bright.leaves_out()), (64, true));
    }

    /// By hand: from (1, 1, 1) a source at (1.5, 1, 2) is seen in the mirror at y = 3 along (0.5, 4, 1), unless a box stands there; by
    /// both mirrors it appears 2 + 3 + 1 m away along y; and a path that is reflected again continues along the longer chain.
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
            let path = scene.mirror_path::<1>((&scene.mirrors, chain), (place, None), (source, None)).unwrap();
            let expected = DVec3::new(0.5, across, 1.0);
            assert!((path.toward - expected.normalize()).length() < 1e-12, "{path:?}");
            assert!((path.unfolded.length() - expected.length()).abs() < 1e-12, "{path:?}");
            // it ends north of the mirror at y = 0 and comes back from there, or south of that at y = 3
            assert_eq!(path.unfolded.y.signum(), if chain == both { 1.0 } else { -1.0 });
            assert!((path.reflectance.0[0] - reflectance).abs() < 1e-12);
        }
        let (size, base) = (DVec3::new(2.0, 0.1, 2.5), DVec3::new(1.0, 2.0, 0.0));
        let surface = Surface::diffuse([0.5; 3]);
        let hidden = room(&mirrors, vec![BoxObject { size, base, rotation: 0.0, surface }]);
        assert!(hidden.mirror_path::<1>((&hidden.mirrors, by_north), (place, None), (source, None)).is_none());
        let behind = DVec3::new(1.0, 3.0 + 1e-6, 1.0);
        assert!(scene.mirrors.before(behind).all(|(chain, _)| chain != by_north));
    }

    /// The probabilities of all chains before a place add up to 1, and chains are chosen at these frequencies.
    #[test]
    fn chains_are_chosen_by_what_they_reflect() {
        let mirrors = room(&[(Face::North, 0.5), (Face::South, 0.8)], Vec::new()).mirrors;
        let count = 10_000;
        let mut seen = vec![0.0; mirrors.count()];
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
