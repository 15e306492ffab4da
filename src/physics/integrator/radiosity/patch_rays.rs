//! Rays of one patch: where they start and end, and the connections that find its direct light by openings.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::area::Area;
use super::bright_patches::{BrightPatches, Target};
use super::gradients::of_opening;
use crate::integrator::diffuser_source::cells::{OpeningReceiver, per_lumen};
use crate::optics::Spectrum;
use crate::sampling::{PathRandom, warp};
use crate::traceable::{Mirrors, SurfaceId, SurfacePoint, TraceableScene, TraceableTube};

/// Number of rays from each patch, one in each stratum of directions, and of the parts of a patch.
pub const RAYS: usize = STRATA * STRATA;
pub const STRATA: usize = 4;

/// Number of rays from each patch that are aimed at bright patches, if there are any.
const AIMED: usize = 4;

/// Mark of a ray that ends in no patch: it brings no light.
const NONE: u32 = u32::MAX;

/// Estimates the variance of the sum of values, one from each part of a patch, by differences to which an even slope over the patch adds
/// nothing.
pub fn variance_of_sum(values: &[f64; RAYS]) -> f64 {
    let at = |row: usize, column: usize| values[row * STRATA + column];
    let corners = |number: usize| (number / (STRATA / 2) * 2, number % (STRATA / 2) * 2);
    let of_four = |(row, column)| at(row, column) + at(row + 1, column + 1) - at(row, column + 1) - at(row + 1, column);
    (0..RAYS / 4).map(|number| of_four(corners(number)).powi(2)).sum()
}

/// Part of the light of an opening that lights a patch.
#[derive(Clone, Copy, Debug, Default)]
pub struct OpeningLight {
    /// Number of the tube.
    pub(super) tube: u32,
    /// Illuminance in lx per lumen that leaves the opening evenly.
    pub(super) per_lumen: f64,
    /// Change of this per metre by which the centroid of the light is away from the centre, along x and y of the opening's levelled frame.
    pub(super) per_metre: DVec2,
}

impl OpeningLight {
    /// Returns the illuminance in lx where openings send light of these fluxes in lm and centroids in m.
    pub fn lux<const C: usize>(&self, light: &[(Spectrum<C>, DVec2)]) -> Spectrum<C> {
        let of =
            |(flux, centroid): &(Spectrum<C>, DVec2)| *flux * (self.per_lumen + self.per_metre.dot(*centroid)).max(0.0);
        light.get(self.tube as usize).map_or(Spectrum::ZERO, of)
    }
}

/// Rays of one patch, and its direct light by openings.
pub struct PatchRays {
    /// Ends of its rays.
    pub met: [Option<RayEnd>; RAYS],
    /// Light by openings: equally many parts for each patch.
    pub of_openings: Vec<OpeningLight>,
    /// Points of the patch from which they start, one in each part.
    pub points: [SurfacePoint; RAYS],
}

impl PatchRays {
    /// Traces the rays and connections from these points of a patch, connections by way of mirrors, too.
    pub fn of(
        (scene, mirrors): (&TraceableScene, &Mirrors),
        points: [SurfacePoint; RAYS],
        random: &mut PathRandom,
    ) -> Self {
        // each direction starts in any part with the same probability
        let shift = random_part(random);
        let met = std::array::from_fn(|number| ray(scene, &points[(number * 7 + shift) % RAYS], number, random));
        let start = random.uniform();
        let mut of_openings: Vec<_> = (0..RAYS)
            .map(|number| {
                let point = &points[number];
                // uniform choices among the openings, in an order that is unrelated to that of the spots
                let choice = (start + (number * 7 % RAYS) as f64 / RAYS as f64).fract();
                let Some((tube, probability)) = scene.openings.choose(point.position, point.normal, choice) else {
                    return OpeningLight::default();
                };
                let of_tube = &scene.tubes[tube];
                let to = of_tube.point(random.uniform2());
                let lux = of_opening(of_tube, point.position, point.normal) / of_tube.opening.area_m2();
                let is_seen = lux > 0.0
                    && of_tube.frame.depth(point.position) > 0.0
                    && scene.visible(to, None, point.position, point.surface);
                if !is_seen {
                    return OpeningLight::default();
                }
                let times = 1.0 / (probability * RAYS as f64);
                OpeningLight { tube: tube as u32, per_lumen: lux * times, per_metre: per_metre(of_tube, point) * times }
            })
            .collect();
        if !mirrors.is_empty() {
            of_openings.extend(points.iter().map(|point| by_mirrors((scene, mirrors), point, random)));
        }
        Self { met, of_openings, points }
    }

    /// Traces some rays at the bright patches, and returns the patches in which these and the others end, with the weights of their
    /// luminances: those of bright ones by the balance heuristic (Veach and Guibas 1995). `number_of` finds the patch of a point.
    pub fn ends(
        &self,
        (scene, bright): (&TraceableScene, &BrightPatches),
        number_of: impl Fn(SurfacePoint) -> Option<u32>,
        random: &mut PathRandom,
    ) -> Vec<(u32, f64)> {
        let weight = |patch: u32, end: &RayEnd| {
            let aimed = bright.density(patch) * AIMED as f64;
            let others = end.per_area.map(|per_area| per_area * RAYS as f64);
            end.weight * others.filter(|_| aimed > 0.0).map_or(1.0, |others| others / (others + aimed))
        };
        let ended = |end: Option<RayEnd>| {
            let patch = end.and_then(|end| Some((number_of(end.point)?, end)));
            patch.map_or((NONE, 0.0), |(patch, end)| (patch, weight(patch, &end)))
        };
        let mut ends: Vec<(u32, f64)> = self.met.iter().copied().map(ended).collect();
        let shift = random_part(random);
        for number in 0..if bright.is_empty() { 0 } else { AIMED } {
            let [u, v] = random.uniform2();
            let (target, to) = bright.at([(number as f64 + u) / AIMED as f64, v]);
            let end = aimed_ray(scene, &self.points[(number * (RAYS / AIMED + 1) + shift) % RAYS], to);
            ends.push(ended(end.filter(|end| number_of(end.point).map(Target::Patch) == Some(target))));
        }
        ends
    }
}

/// Chooses one of the parts of a patch.
fn random_part(random: &mut PathRandom) -> usize {
    (random.uniform() * RAYS as f64) as usize
}

/// Estimates the light of a spot by one random opening and chain of mirrors.
fn by_mirrors(
    (scene, mirrors): (&TraceableScene, &Mirrors),
    point: &SurfacePoint,
    random: &mut PathRandom,
) -> OpeningLight {
    let mut found = || {
        let (chain, of_chain) = mirrors.choose(point.position, random.uniform())?;
        let (image, normal) = mirrors.image(chain, (point.position, point.normal));
        let (tube, of_tube) = scene.openings.choose(image, normal, random.uniform())?;
        let of_opening = &scene.tubes[tube];
        let source = of_opening.point(random.uniform2());
        let path = scene.mirror_path::<3>((mirrors, chain), (point.position, point.surface), (source, None))?;
        let [unfolded, normal] = [path.unfolded, normal].map(|v| of_opening.frame.levelled_direction(v));
        let lux = per_lumen(unfolded, normal).max(0.0) * path.reflectance.luminance();
        let per_lumen = lux / (of_chain * of_tube * RAYS as f64);
        let per_metre = of_opening
            .opening
            .disc()
            .map_or(DVec2::ZERO, |radius| of_opening.away(source) * (4.0 * per_lumen / (radius * radius)));
        Some(OpeningLight { tube: tube as u32, per_lumen, per_metre })
    };
    found().unwrap_or_default()
}

/// Computes the change of the illuminance in lx/lm of a spot per metre by which the centroid of light is away from the centre of an opening that
/// is a disc: density that is linear in the place has the centroid of two points at half the radius.
fn per_metre(tube: &TraceableTube, point: &SurfacePoint) -> DVec2 {
    let Some(radius) = tube.opening.disc() else { return DVec2::ZERO };
    let receiver = OpeningReceiver::new(point.position, point.normal, &tube.frame);
    let at = |away: DVec2| receiver.point(tube.frame.origin.truncate() + away).max(0.0);
    let along = |axis: DVec2| (at(axis * (0.5 * radius)) - at(axis * (-0.5 * radius))) / radius;
    DVec2::new(along(DVec2::X), along(DVec2::Y))
}

/// Finds the patches that are bright by the light of openings of equal exitance, or by that of luminaires.
pub fn bright_patches(
    scene: &TraceableScene,
    patches: &[PatchRays],
    surfaces: &[SurfaceId],
    areas: &[Option<Area>],
) -> BrightPatches {
    let emitting = || scene.luminaires.iter().filter(|luminaire| luminaire.emits());
    let luminances = |(patch, surface): (&PatchRays, &SurfaceId)| {
        let reflectance = scene.optics(*surface).map_or(0.0, |optics| optics.diffuse::<3>().luminance());
        let of_tube = |of: &OpeningLight| {
            of.per_lumen * scene.tubes.get(of.tube as usize).map_or(0.0, |tube| tube.opening.area_m2())
        };
        let of_luminaires = |point: &SurfacePoint| -> f64 {
            emitting().map(|of| of.irradiance::<1>(point.position, point.normal).luminance()).sum()
        };
        let by_luminaires =
            if emitting().next().is_some() { patch.points.iter().map(of_luminaires).sum() } else { 0.0 };
        [patch.of_openings.iter().map(of_tube).sum(), by_luminaires].map(|lux: f64| reflectance * lux)
    };
    let luminances: Vec<[f64; 2]> = patches.iter().zip(surfaces).map(luminances).collect();
    let area = |area: &Option<Area>| area.map_or(0.0, |area| area.area_m2());
    let all: f64 = areas.iter().map(area).sum();
    let means = [0, 1].map(|kind| luminances.iter().zip(areas).map(|(of, on)| of[kind] * area(on)).sum::<f64>() / all);
    // each kind of light counts relative to its mean
    let relative =
        |of: &[f64; 2]| of.iter().zip(means).map(|(of, mean)| if mean > 0.0 { of / mean } else { 0.0 }).sum();
    let kinds = means.iter().filter(|mean| **mean > 0.0).count();
    BrightPatches::new(luminances.iter().map(relative).zip(areas.iter().copied()), &[], kinds as f64)
}

/// Traces a ray from a spot toward a point, and returns its end; `None` below the surface of the spot.
fn aimed_ray(scene: &TraceableScene, from: &SurfacePoint, to: DVec3) -> Option<RayEnd> {
    let direction = (to - from.position).try_normalize().filter(|toward| toward.dot(from.normal) > 0.0)?;
    let hit = scene.intersect(from.position, direction, from.surface);
    let point = SurfacePoint { position: hit.position, normal: hit.normal, surface: Some(scene.surface_at(hit.place)) };
    Some(RayEnd { point, weight: 1.0, per_area: Some(per_area(from, &point)) })
}

/// Returns the density per m2 of a surface with which rays from a spot end at a point that it sees: the cosine law.
fn per_area(from: &SurfacePoint, to: &SurfacePoint) -> f64 {
    let away = to.position - from.position;
    let squared = away.length_squared();
    (away.dot(from.normal) * -away.dot(to.normal) / (PI * squared * squared)).max(0.0)
}

/// End of a ray.
#[derive(Clone, Copy)]
pub struct RayEnd {
    pub point: SurfacePoint,
    /// Reflectance of mirrors and lobes on the path, divided by the probability of this path.
    pub weight: f64,
    /// Density per m2 of rays that are not aimed; `None` after a mirror or lobe, by which no ray is aimed.
    pub per_area: Option<f64>,
}

/// Traces a ray from a spot in a stratum of directions and returns its end. At a surface that has a lobe or mirror chance decides whether it is
/// reflected by that or ends.
pub fn ray(scene: &TraceableScene, from: &SurfacePoint, stratum: usize, random: &mut PathRandom) -> Option<RayEnd> {
    let [u, v] = random.uniform2();
    let (row, column) = (stratum / STRATA, stratum % STRATA);
    let at = [(row as f64 + u) / STRATA as f64, (column as f64 + v) / STRATA as f64];
    let mut direction = warp::around(from.normal, warp::cosine_hemisphere(at));
    let (mut position, mut surface, mut weight) = (from.position, from.surface, 1.0);
    for turn in 0..MOST_TURNS {
        let hit = scene.intersect(position, direction, surface);
        let met = scene.surface_at(hit.place);
        let point = SurfacePoint { position: hit.position, normal: hit.normal, surface: Some(met) };
        let per_area = (turn == 0).then(|| per_area(from, &point));
        let Some(optics) = scene.optics(met).filter(|optics| optics.is_specular()) else {
            return Some(RayEnd { point, weight, per_area });
        };
        let [diffuse, specular] = [optics.diffuse::<3>(), optics.specular()].map(|part| part.luminance());
        let turns = specular / (diffuse + specular).max(f64::MIN_POSITIVE);
        if random.uniform() >= turns {
            return Some(RayEnd { point, weight: weight / (1.0 - turns), per_area });
        }
        weight *= specular / turns;
        direction = optics.reflect(hit.normal, -direction, random.uniform2(), random)?;
        (position, surface) = (hit.position, Some(met));
    }
    None
}

/// Largest number of mirrors and lobes that reflect a ray.
const MOST_TURNS: usize = 8;

#[cfg(test)]
mod tests {
    use super::super::met_patches::MetPatch;
    use super::*;
    use crate::optics::Surface;
    use crate::sampling::Key;
    use crate::traceable::{Place, test_rooms};

    /// Checks by hand: an even slope over the parts of a patch adds nothing, and one part that differs by 3 adds 9; of independent values the
    /// mean estimate is the sum of their variances, 16 / 12 for uniform numbers.
    #[test]
    fn variances_leave_out_slopes() {
        let slope: [f64; RAYS] = std::array::from_fn(|part| (2 * (part / STRATA) + 5 * (part % STRATA)) as f64);
        assert_eq!(variance_of_sum(&slope), 0.0);
        let mut one = slope;
        one[6] += 3.0;
        assert_eq!(variance_of_sum(&one), 9.0);
        let mut random = PathRandom::new(crate::sampling::Key::new(1));
        let mean = (0..2000).map(|_| variance_of_sum(&std::array::from_fn(|_| random.uniform()))).sum::<f64>() / 2000.0;
        assert!((mean * 12.0 / 16.0 - 1.0).abs() < 0.05, "{mean}");
    }

    /// Checks that rays aimed from a patch of a floor at a small bright patch of a wall leave the mean of the light it brings as it is, within
    /// four standard errors, and lower its variance.
    #[test]
    fn aimed_rays_change_no_mean() {
        let scene = test_rooms::compiled(&test_rooms::empty(DVec3::splat(2.0), Some(Surface::diffuse([0.5; 3]))));
        let down = scene.intersect(DVec3::ONE, -DVec3::Z, None);
        let Place::Surface(surface) = down.place else { panic!("no floor") };
        let start = SurfacePoint { position: down.position, normal: down.normal, surface: Some(surface) };
        let patch = MetPatch { surface, points: vec![start] };
        let floor = Area { corner: DVec3::new(0.5, 0.5, 0.0), edges: [DVec3::X, DVec3::Y] };
        let wall = Area { corner: DVec3::new(0.0, 0.8, 0.2), edges: [DVec3::Y * 0.4, DVec3::Z * 0.3] };
        let is_bright = |at: DVec3| at.x < 1e-9 && (0.8..1.2).contains(&at.y) && (0.2..0.5).contains(&at.z);
        let number_of = |point: SurfacePoint| Some(u32::from(!is_bright(point.position)));
        let light = |bright: &BrightPatches, key: Key| -> [f64; 2] {
            const COUNT: u64 = 4000;
            let values = (0..COUNT).map(|number| -> f64 {
                let mut random = PathRandom::new(key.child(number));
                let points = patch.spread_points(&scene, Some(floor), &mut random);
                let ends = PatchRays::of((&scene, &scene.mirrors), points, &mut random).ends(
                    (&scene, bright),
                    number_of,
                    &mut random,
                );
                ends.iter().map(|(patch, weight)| if *patch == 0 { *weight } else { 0.0 }).sum()
            });
            let [sum, squares] = values.fold([0.0; 2], |[sum, squares], value| [sum + value, squares + value * value]);
            let mean = sum / COUNT as f64;
            [mean, (squares / COUNT as f64 - mean * mean) / (COUNT - 1) as f64]
        };
        let bright = BrightPatches::new([(100.0, Some(wall)), (1.0, Some(floor))].into_iter(), &[], 2.0);
        let [[aimed, variance], [by_chance, of_chance]] =
            [light(&bright, Key::new(1)), light(&BrightPatches::default(), Key::new(2))];
        assert!((aimed - by_chance).powi(2) < 16.0 * (variance + of_chance), "{aimed} {by_chance} {variance}");
        assert!(variance < 0.5 * of_chance, "{variance} {of_chance}");
    }
}
