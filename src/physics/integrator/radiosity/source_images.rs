//! Images of openings and luminaires in plane surfaces with a lobe, at which rays are aimed: such highlights are small and bright.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::area::Area;
use super::patches::{plane_normal, rectangles};
use crate::optics::Spectrum;
use crate::traceable::{SurfaceId, TraceableScene, TraceableTube};

/// Width by which a lobe blurs an image, in its alpha times the distance from the surface: rays turn by twice the inclination of a
/// microfacet, and 80 % of these are less inclined than by 2 alpha.
const BLUR: f64 = 4.0;

/// Largest number of images that are kept: those that send the most light.
const MOST_IMAGES: usize = 64;

/// Image of a source in a plane surface with a lobe.
#[derive(Clone, Copy, Debug)]
pub struct SourceImage {
    /// Surface in which the image is seen.
    pub surface: SurfaceId,
    /// Parallelogram behind the surface that holds the image as the lobe blurs it.
    pub area: Area,
    /// Mean luminance of this area in cd/m2, as it is seen in the surface.
    pub luminance: f64,
    /// Luminance times area, in cd, of the part of the light that meets the surface.
    pub flux: f64,
}

/// Rectangle around a source, with its light.
struct LitArea {
    area: Area,
    /// Unit normal to the side that emits.
    normal: DVec3,
    /// Luminance times area in cd.
    flux: f64,
}

/// Finds the brightest images in the surfaces of a room and its boxes, where openings send light of these fluxes in lm and centroids.
pub fn source_images<const C: usize>(scene: &TraceableScene, light: &[(Spectrum<C>, DVec2)]) -> Vec<SourceImage> {
    let of_tube = |(tube, (flux, _)): (&TraceableTube, &(Spectrum<C>, DVec2))| opening(tube, flux.luminance());
    let luminaires = scene.luminaires.iter().map(|of| LitArea {
        area: Area { corner: of.point([0.0, 0.0]), edges: of.edges() },
        normal: of.normal,
        flux: Spectrum::<C>::from_rgb(of.luminance).luminance() * of.area_m2,
    });
    let sources: Vec<LitArea> = scene.tubes.iter().zip(light).map(of_tube).chain(luminaires).collect();
    let mut images: Vec<SourceImage> = Vec::new();
    for (surface, corner, edges) in rectangles(scene) {
        let Some((optics, alpha)) = scene.optics(surface).and_then(|optics| Some((optics, optics.lobe()?.alpha())))
        else {
            continue;
        };
        let plane = Plane { corner, edges, normal: plane_normal(scene, surface) };
        let reflectance = optics.specular::<C>().luminance();
        let image = |source: &LitArea| plane.image(surface, source, (reflectance, alpha));
        images.extend(sources.iter().filter_map(image).filter(|image| image.flux > 0.0));
    }
    images.sort_by(|one, other| other.flux.total_cmp(&one.flux));
    images.truncate(MOST_IMAGES);
    images
}

/// Returns the square around an opening that sends this flux in lm as from a Lambertian surface.
fn opening(tube: &TraceableTube, flux: f64) -> LitArea {
    let frame = &tube.frame;
    let edges = [DVec3::X, DVec3::Y].map(|axis| {
        let axis = frame.direction_in_room(axis);
        axis * (2.0 * tube.opening.extent_in(frame, axis))
    });
    let corner = frame.origin - 0.5 * (edges[0] + edges[1]);
    LitArea { area: Area { corner, edges }, normal: frame.normal(), flux: flux / PI }
}

/// Rectangle around a plane surface.
struct Plane {
    corner: DVec3,
    edges: [DVec3; 2],
    normal: DVec3,
}

impl Plane {
    /// Returns the image of a source by a lobe of this reflectance and alpha; `None` where the source does not light the surface.
    fn image(&self, surface: SurfaceId, source: &LitArea, (reflectance, alpha): (f64, f64)) -> Option<SourceImage> {
        let Area { corner, edges } = source.area;
        let height = (corner + 0.5 * (edges[0] + edges[1]) - self.corner).dot(self.normal);
        let [u, v] = self.edges;
        let corners = [self.corner, self.corner + u, self.corner + v, self.corner + u + v];
        let is_lit = corners.iter().any(|place| (*place - corner).dot(source.normal) > 0.0);
        let longest = edges[0].length().max(edges[1].length());
        if height <= 0.0 || !is_lit || longest <= 0.0 {
            return None;
        }
        let blur = BLUR * alpha * height;
        let wider = edges.map(|edge| edge * (1.0 + 2.0 * blur / edge.length()));
        let corner = corner - 0.5 * (wider[0] + wider[1] - edges[0] - edges[1]);
        let turn = |vector: DVec3| vector - self.normal * (2.0 * vector.dot(self.normal));
        let area = Area { corner: self.corner + turn(corner - self.corner), edges: wider.map(turn) };
        let luminance = reflectance * source.flux / area.area_m2();
        // the flux of a small Lambertian source above the middle of a disc of this area
        let of_surface = u.cross(v).length();
        let part = of_surface / (of_surface + PI * height * height);
        Some(SourceImage { surface, area, luminance, flux: luminance * area.area_m2() * part })
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::optics::{Diffuser, Specular, Surface};
    use crate::scene::{Face, Luminaire};

    use crate::traceable::test_rooms::{compiled, empty, straight_tube};

    /// Checks the images of a tube and of a luminaire in a polished floor by hand: as far below it as the sources are above, wider by the
    /// blur on each side, with the reflected part of the light; a luminaire that faces up has none, and nor have diffuse walls.
    #[test]
    fn images_lie_below_a_polished_floor() {
        let mut scene = empty(DVec3::new(5.0, 4.0, 3.0), Some(Surface::diffuse([0.5; 3])));
        let polished = Specular { reflectance: [0.1; 3], roughness: 0.1 };
        let floor = Face::Floor as usize;
        scene.room.enclosure.paint(floor, Some(Surface { reflectance: [0.2; 3], specular: Some(polished) }));
        let ceiling = Face::Ceiling as usize;
        scene.tubes =
            vec![straight_tube((ceiling, DVec2::new(2.0, 1.0)), [1.0; 3], Diffuser::Clear { transmittance: [1.0; 3] })];
        let corner = DVec3::new(1.0, 1.0, 2.0);
        let down = Luminaire { corner, edge_u: DVec3::Y, edge_v: DVec3::X * 0.5, luminance: [200.0; 3] };
        let up = Luminaire { edge_u: DVec3::X, edge_v: DVec3::Y, ..down };
        scene.room.luminaires = vec![down, up];
        let images = source_images(&compiled(&scene), &[(Spectrum([700.0]), DVec2::ZERO)]);
        assert!(images.iter().all(|image| image.surface == SurfaceId::numbered(floor)));
        let [tube, luminaire] = images[..] else { panic!("{images:?}") };
        let blur = |height: f64| BLUR * 0.01 * height;
        let holds = |image: SourceImage, middle: DVec3, edges: [f64; 2], flux: f64| {
            let Area { corner, edges: found } = image.area;
            assert!((corner + 0.5 * (found[0] + found[1])).distance(middle) < 1e-12, "{image:?}");
            let lengths = found.map(DVec3::length);
            assert!(lengths.iter().zip(edges).all(|(length, by_hand)| (length - by_hand).abs() < 1e-12), "{image:?}");
            assert!((image.luminance * edges[0] * edges[1] / flux - 1.0).abs() < 1e-12, "{image:?}");
        };
        holds(tube, DVec3::new(2.0, 1.0, -3.0), [0.6 + 2.0 * blur(3.0); 2], 0.1 * 700.0 / PI);
        holds(luminaire, DVec3::new(1.25, 1.5, -2.0), [1.0, 0.5].map(|edge| edge + 2.0 * blur(2.0)), 0.1 * 100.0);
        let part = 20.0 / (20.0 + PI * 9.0);
        assert!((tube.flux / (part * 0.1 * 700.0 / PI) - 1.0).abs() < 1e-12);
    }
}
