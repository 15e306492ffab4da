//! Pixels that contain the outline of a luminaire or a diffuser, seen directly or by way of mirrors: the light of these sources is found
//! there by additional rays.
//!
//! A luminaire is a hundred times as bright as its surroundings, so that with one ray a pass the pixels at its edge stay noisy long after
//! all others have converged, and a corner that no ray has found does not show in the error. Rays that look only for the light of sources
//! cost little, for they gather no photons: such a pixel takes some dozens of them, and its ordinary ray leaves that light out. The choice
//! of pixels affects noise and time only: the expectation is the same.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::maps::{Gathered, Mapper, Maps};
use crate::integrator::backward::room_entry::enter_room;
use crate::optics::{Spectrum, SurfaceOptics};
use crate::sampling::{Key, Replicate};
use crate::scene::View;
use crate::traceable::luminaire::TraceableLuminaire;
use crate::traceable::{Place, SurfaceId, TraceableScene, TraceableTube};

/// Number of rays per pass and outlined pixel that look for direct light from sources. They are points of a Sobol sequence, which estimate
/// the fraction of a pixel cut off parallel to its edges to within one over their number.
const RAYS: u64 = 64;

/// Number of steps along the side of a pixel; the source is looked up at their ends.
const STEPS: usize = 2;

/// Largest number of mirrors by way of which light still counts as direct here.
pub const MIRRORS: u32 = 8;

/// View, with the pixels in which outlines are seen.
#[derive(Debug)]
pub struct OutlinedView {
    pub view: View,
    /// True for each pixel in which an outline is seen.
    outlined: Vec<bool>,
}

/// Range of columns and rows of pixels: the first, and one past the last.
type Window = [[usize; 2]; 2];

impl OutlinedView {
    /// Finds the outlined pixels of some views.
    pub fn all(scene: &TraceableScene, views: &[View]) -> Vec<Self> {
        views.iter().map(|view| Self { view: view.clone(), outlined: outlined(scene, view) }).collect()
    }

    /// True if direct light from sources has rays of its own in a pixel.
    #[inline]
    pub fn is_outlined(&self, pixel: usize) -> bool {
        self.outlined[pixel]
    }

    /// Returns, for each pixel, the number of rays in a pass that look for direct light from sources: `others` where the pixel is not
    /// outlined.
    pub fn rays(&self, others: f64) -> Vec<f64> {
        self.outlined.iter().map(|outlined| if *outlined { RAYS as f64 } else { others }).collect()
    }

    /// Estimates the luminance in cd/m2 that a pixel gets directly from diffusers and luminaires.
    pub fn straight<const C: usize>(
        &self,
        mapper: &Mapper<C>,
        maps: &Maps<C>,
        [column, row]: [usize; 2],
        key: Key,
    ) -> Gathered<C> {
        let mut sum = Gathered::NOTHING;
        let fraction = 1.0 / RAYS as f64;
        for ray in 0..RAYS {
            let (replicate, number) = Replicate::of(key, ray);
            // the first two: they have a point in each part of any cut of the pixel along its edges
            let [x, y, ..] = replicate.point(number, 0);
            let direction = self.view.ray_direction(column as f64 + x, row as f64 + y);
            let seen = seen_straight(mapper, maps, self.view.eye, direction);
            sum.irradiance += seen.irradiance * fraction;
            sum.bias += seen.bias * fraction;
        }
        sum
    }
}

/// Returns the luminance in cd/m2 along an eye ray that comes directly from a diffuser or luminaire.
fn seen_straight<const C: usize>(mapper: &Mapper<C>, maps: &Maps<C>, eye: DVec3, direction: DVec3) -> Gathered<C> {
    let scene = &*mapper.scene;
    let Some(SeenSource { source, direction, weight, .. }) = source::<C>(scene, eye, direction) else {
        return Gathered::NOTHING;
    };
    match source {
        OutlineSource::Luminaire(number) => {
            Gathered { irradiance: scene.luminaires[number].seen(direction) * weight, ..Gathered::NOTHING }
        }
        OutlineSource::Diffuser(tube, position) => {
            let of_tube = mapper.luminance(maps, tube, scene.tubes[tube].closure_at(position), position, direction);
            Gathered {
                irradiance: of_tube.irradiance * weight,
                bias: of_tube.bias * weight.luminance(),
                ..Gathered::NOTHING
            }
        }
    }
}

/// Source that an eye sees along a ray, and the path to it.
struct SeenSource<const C: usize> {
    source: OutlineSource,
    /// The ray's direction where it meets the source.
    direction: DVec3,
    /// The last mirror on the path.
    mirror: Option<SurfaceId>,
    /// Product of the reflectances of all mirrors on the path.
    weight: Spectrum<C>,
}

/// Source that an outline belongs to.
enum OutlineSource {
    Luminaire(usize),
    /// Diffuser of a tube, with the point of its opening.
    Diffuser(usize, DVec3),
}

impl OutlineSource {
    /// Returns a number of the source, from 1.
    fn number(&self, scene: &TraceableScene) -> usize {
        match self {
            Self::Luminaire(number) => 1 + scene.tubes.len() + number,
            Self::Diffuser(tube, _) => 1 + tube,
        }
    }
}

/// Finds the source that an eye sees along a ray, directly or by way of up to [`MIRRORS`] mirrors.
fn source<const C: usize>(scene: &TraceableScene, eye: DVec3, mut direction: DVec3) -> Option<SeenSource<C>> {
    let mut origin = enter_room(scene, eye, direction)?;
    let (mut mirror, mut weight, mut reflected) = (None, Spectrum::ONE, false);
    for _ in 0..=MIRRORS {
        let hit = scene.intersect(origin, direction, mirror);
        let surface = match hit.place {
            Place::Opening(tube) => {
                let clear = scene.tubes[tube].closure_at(hit.position).unscattered::<1>().is_some();
                let source = OutlineSource::Diffuser(tube, hit.position);
                return (!clear).then_some(SeenSource { source, direction, mirror, weight });
            }
            Place::Surface(surface) => surface,
        };
        if let Some(number) = scene.numbering.luminaire_of(surface) {
            let shines = scene.luminaires[number].seen::<3>(direction).max() > 0.0;
            return shines.then_some(SeenSource {
                source: OutlineSource::Luminaire(number),
                direction,
                mirror,
                weight,
            });
        }
        let optics = scene.optics(surface).filter(|optics| optics.is_mirror())?;
        if reflected && !scene.interreflection {
            return None;
        }
        reflected |= optics.is_finite();
        weight *= optics.specular();
        direction -= hit.normal * (2.0 * direction.dot(hit.normal));
        (origin, mirror) = (hit.position, Some(surface));
    }
    None
}

/// Finds the pixels that are outlined: those that do not see the same source, by way of the same mirror, at their corners, the middles of
/// their edges and their centre, and all their neighbours. The neighbours cover outlines that bulge over an edge or have a corner between
/// these points.
fn outlined(scene: &TraceableScene, view: &View) -> Vec<bool> {
    let [width, height] = view.size_px;
    let mut outlined = vec![false; width * height];
    let Some([first, end]) = window(scene, view) else { return outlined };
    let columns = STEPS * (end[0] - first[0]) + 1;
    let rows: Vec<Vec<_>> = (0..=STEPS * (end[1] - first[1]))
        .into_par_iter()
        .map(|row| {
            let y = first[1] as f64 + row as f64 / STEPS as f64;
            let seen = |column: usize| {
                let x = first[0] as f64 + column as f64 / STEPS as f64;
                let seen = source::<1>(scene, view.eye, view.ray_direction(x, y));
                seen.map(|seen| (seen.source.number(scene), seen.mirror))
            };
            (0..columns).map(seen).collect()
        })
        .collect();
    for (row, seen) in (first[1]..end[1]).zip(rows.windows(STEPS + 1).step_by(STEPS)) {
        for (column, left) in (first[0]..end[0]).zip((0..columns).step_by(STEPS)) {
            let here = || seen.iter().flat_map(|row| &row[left..=left + STEPS]);
            if here().any(|other| *other != seen[0][left]) {
                for row in row.saturating_sub(1)..(row + 2).min(height) {
                    outlined[row * width + column.saturating_sub(1)..row * width + (column + 2).min(width)].fill(true);
                }
            }
        }
    }
    outlined
}

/// Returns the window of pixels in which any source may be seen directly, with a margin of one pixel: all pixels if there are mirrors;
/// `None` without sources.
fn window(scene: &TraceableScene, view: &View) -> Option<Window> {
    if scene.specular_surfaces().any(SurfaceOptics::is_mirror) {
        return Some([[0, 0], view.size_px]);
    }
    let of_luminaire = |luminaire: &TraceableLuminaire| luminaire.corners();
    let around_opening = |tube: &TraceableTube| {
        let r = tube.opening.extent_along(DVec2::X);
        [[-r, -r], [r, -r], [r, r], [-r, r]].map(|corner| tube.at(corner.into()))
    };
    let luminaires = scene.luminaires.iter().filter(|luminaire| luminaire.emits()).map(of_luminaire);
    let outlines = luminaires.chain(scene.tubes.iter().map(around_opening));
    let size = view.size_px;
    let windows = outlines.filter_map(|corners| {
        let points: Vec<_> = corners.iter().filter_map(|corner| view.image_point(*corner)).collect();
        if points.is_empty() {
            return None;
        }
        // a source that reaches behind the eye may be seen anywhere
        let all = points.len() == corners.len();
        let bound = |axis: usize, of: fn(f64, f64) -> f64| points.iter().map(|point| point[axis]).reduce(of);
        let low = |axis: usize| bound(axis, f64::min).filter(|_| all).map_or(0, |low| (low - 1.0).max(0.0) as usize);
        let high = |axis: usize| {
            let high = bound(axis, f64::max).filter(|_| all);
            high.map_or(size[axis], |high| (high + 2.0).max(0.0) as usize).min(size[axis])
        };
        let window = [[low(0), low(1)], [high(0), high(1)]];
        (window[0][0] < window[1][0] && window[0][1] < window[1][1]).then_some(window)
    });
    windows.reduce(|[a, b], [c, d]| [[a[0].min(c[0]), a[1].min(c[1])], [b[0].max(d[0]), b[1].max(d[1])]])
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    use super::*;
    use crate::optics::{Specular, Surface};
    use crate::scene::{BoxObject, Face, Luminaire};
    use crate::statistics::Moments;
    use crate::traceable::test_rooms::{compiled, empty};

    const GREY: Surface = Surface { reflectance: [0.5; 3], specular: None };

    /// Builds a room with a luminaire of 3 cd/m2 under a ceiling and a box that hides a corner of it, and a view up at it, or at its image
    /// in a wall of reflectance `mirror`.
    fn room(mirror: Option<f64>) -> (TraceableScene, View) {
        let (corner, edge_u, edge_v) =
            (DVec3::new(1.3, 1.2, 2.9), DVec3::new(0.9, 0.3, 0.0), DVec3::new(0.3, -0.8, 0.0));
        let lamp = Luminaire { corner, edge_u, edge_v, luminance: [3.0; 3] };
        let shelf = BoxObject {
            size: DVec3::new(0.4, 0.4, 0.1),
            base: DVec3::new(1.5, 1.1, 2.5),
            rotation: 0.2,
            surface: GREY,
        };
        let mut scene = empty(DVec3::splat(3.0), Some(GREY));
        (scene.room.boxes, scene.room.luminaires) = (vec![shelf], vec![lamp]);
        if let Some(reflectance) = mirror {
            let specular = Some(Specular { reflectance: [reflectance; 3], roughness: 0.0 });
            scene.room.enclosure.paint(Face::North as usize, Some(Surface { reflectance: [0.0; 3], specular }));
        }
        let eye = DVec3::new(0.4, 0.5, 0.3);
        let (y, angle) = mirror.map_or((1.3, 0.6), |_| (2.0 * 3.0 - 1.3, 0.35));
        let view = View::new("up".into(), eye, DVec3::new(1.8, y, 2.9), DVec3::Z, angle, [48, 32]).unwrap();
        (compiled(&scene), view)
    }

    /// Luminance of an outlined pixel is that of the luminaire times the fraction of the pixel that shows it, counted on a lattice, within
    /// 4 standard errors of 16 passes and one line of the lattice; other pixels show the luminaire wholly or not at all.
    #[test]
    fn outlined_pixels_show_their_share_of_a_lamp() {
        shows_its_share(None);
    }

    #[test]
    fn outlined_pixels_show_their_share_of_a_lamp_in_a_mirror() {
        shows_its_share(Some(0.8));
    }

    fn shows_its_share(mirror: Option<f64>) {
        let luminance = 3.0 * mirror.unwrap_or(1.0);
        let (scene, view) = room(mirror);
        let scene = Arc::new(scene);
        let outlined = &OutlinedView::all(&scene, std::slice::from_ref(&view))[0];
        let mapper = Mapper::<1>::new(scene.clone(), &[], true, 64);
        let (maps, _) = mapper.maps(Key::new(1), 0.1, &AtomicBool::new(false)).unwrap();
        let (mut edges, mut whole) = (0, 0);
        let lines = 50;
        for pixel in 0..48 * 32 {
            let place = [pixel % 48, pixel / 48];
            let at = |k: usize| (k as f64 + 0.5) / f64::from(lines);
            let points = (0..lines * lines).map(|point| [at((point % lines) as usize), at((point / lines) as usize)]);
            let shows = points.filter(|[x, y]| {
                let direction = view.ray_direction(place[0] as f64 + x, place[1] as f64 + y);
                source::<1>(&scene, view.eye, direction).is_some()
            });
            let fraction = shows.count() as f64 / f64::from(lines * lines);
            if !outlined.is_outlined(pixel) {
                assert!(fraction == 0.0 || fraction == 1.0, "{place:?}: {fraction}");
                whole += u32::from(fraction == 1.0);
                continue;
            }
            let mut seen = Moments::default();
            for pass in 0..16 {
                seen.push(outlined.straight(&mapper, &maps, place, Key::new(pass).child(pixel as u64)).irradiance.0[0]);
            }
            let tolerance = 4.0 * seen.standard_error() + 3.0 / f64::from(lines);
            assert!((seen.mean - luminance * fraction).abs() < tolerance, "{place:?}: {seen:?} {fraction}");
            edges += 1;
        }
        assert!(edges > 20 && whole > 10, "{edges} {whole}");
    }
}
