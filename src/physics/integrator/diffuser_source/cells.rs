//! Light of one Lambertian diffuser: rings in closed form, sectors as points, and one photon that represents the rest. The light of a square
//! is even, and has a closed form as a whole.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use glam::{DVec2, DVec3};

use super::patches::{CELLS, RINGS, SECTORS, cell, middle};
use crate::geometry::OpeningFrame;
use crate::geometry::disc::far_disc_illuminance;
use crate::geometry::lambert::quadrilateral_irradiance;
use crate::optics::Spectrum;
use crate::traceable::TraceableTube;

/// Distance from a disc, in its radii, below which paths follow the light instead of being connected to photons.
const NEAR: f64 = 1.0;

/// Largest number of photons of a tube among which a vertex chooses.
const MOST_CHOICES: usize = 1 << 16;

/// Light that leaves one diffuser.
#[derive(Debug)]
pub struct TubeLight<const C: usize> {
    /// Centre of the opening, and its plane.
    pub frame: OpeningFrame,
    /// Radius in m of the disc around the opening.
    pub radius: f64,
    /// Corners of a square opening in the room, clockwise seen from it, and its exitance in lm/m2; `None` for a disc.
    even: Option<([DVec3; 4], Spectrum<C>)>,
    /// Photons that leave, sorted by cells.
    pub photons: Vec<Emitted<C>>,
    /// Differences of the exitance of each ring (lm/m2) to that of the next one outward.
    steps: [Spectrum<C>; RINGS],
    /// Points that represent the differences of the cells, which are the sectors of rings, in the levelled frame of the opening.
    middles: [DVec2; CELLS],
    /// Differences of the flux of each cell to the mean of its ring, in lm, by channels.
    differences: [[f64; CELLS]; C],
    /// Photons with their cells, each repeated in proportion to its flux; each represents the whole flux, and their mean is unbiased.
    pub choices: Vec<(Emitted<C>, usize)>,
    vectors: pulp::Arch,
}

/// Light that leaves a diffuser at a point, as from a Lambertian surface.
#[derive(Clone, Copy, Debug)]
pub struct Emitted<const C: usize> {
    /// Position in the plane of the opening, in its levelled frame in m.
    pub position: DVec2,
    /// Flux in lm.
    pub flux: Spectrum<C>,
}

impl<const C: usize> Emitted<C> {
    /// Makes the light of `flux` lm that leaves an opening at a point of the room.
    pub fn new(position: DVec3, flux: Spectrum<C>, opening: &OpeningFrame) -> Self {
        Self { position: opening.levelled(position).truncate(), flux }
    }

    /// Returns the position in the room in m.
    #[inline]
    pub fn in_room(&self, opening: &OpeningFrame) -> DVec3 {
        opening.in_room(self.position.extend(opening.origin.z))
    }
}

impl<const C: usize> TubeLight<C> {
    /// Sorts the photons that leave a tube's diffuser into cells; `start` in 0..1 is where the choice among them begins.
    pub fn new(tube: &TraceableTube, photons: Vec<Emitted<C>>, start: f64) -> Self {
        let (origin, radius) = (tube.frame.origin, tube.opening.outer_radius());
        // neighbours in space are neighbours in the list, so that uniform numbers choose them uniformly
        let mut cells: [Vec<Emitted<C>>; CELLS] = std::array::from_fn(|_| Vec::new());
        for photon in photons {
            let away = photon.position - origin.truncate();
            cells[cell(&tube.opening, away)].push(photon);
        }
        let mut differences = [Spectrum::ZERO; CELLS];
        for (flux, cell) in differences.iter_mut().zip(&cells) {
            cell.iter().for_each(|photon| *flux += photon.flux);
        }
        let even = tube.corners().map(|corners| {
            let mut flux = Spectrum::ZERO;
            differences.iter().for_each(|of_cell| flux += *of_cell);
            (corners, flux * (1.0 / tube.opening.area_m2()))
        });
        let mut exitances = [Spectrum::ZERO; RINGS + 1];
        for (exitance, ring) in exitances.iter_mut().zip(differences.chunks_exact_mut(SECTORS)) {
            let mut flux = Spectrum::ZERO;
            ring.iter().for_each(|of_cell| flux += *of_cell);
            ring.iter_mut().for_each(|of_cell| *of_cell += flux * (-1.0 / SECTORS as f64));
            *exitance = flux * (RINGS as f64 / (PI * radius * radius));
        }
        Self {
            frame: tube.frame,
            radius,
            even,
            photons: cells.concat(),
            steps: std::array::from_fn(|ring| exitances[ring] + exitances[ring + 1] * -1.0),
            middles: std::array::from_fn(|cell| origin.truncate() + middle(&tube.opening, cell)),
            differences: std::array::from_fn(|channel| differences.map(|of_cell| of_cell.0[channel])),
            choices: choose(&cells, start),
            vectors: pulp::Arch::new(),
        }
    }

    /// Iterates over the photons that leave: positions in m, and fluxes in lm.
    pub fn photons(&self) -> impl Iterator<Item = (DVec3, Spectrum<C>)> {
        self.photons.iter().map(|photon| (photon.in_room(&self.frame), photon.flux))
    }

    /// Returns the flux of all light that leaves, in lm.
    pub fn flux(&self) -> Spectrum<C> {
        let mut flux = Spectrum::ZERO;
        self.photons.iter().for_each(|photon| flux += photon.flux);
        flux
    }

    /// True if no point within `reach` of `position`, at its height, is near the disc.
    pub fn is_far(&self, position: DVec3, reach: f64) -> bool {
        is_far(&self.frame, self.radius, position, reach)
    }

    /// Returns the illuminance in lx of a surface that sees the whole opening, if its light is even; `None` for a disc.
    #[inline]
    pub fn of_square(&self, position: DVec3, normal: DVec3) -> Option<Spectrum<C>> {
        let (corners, exitance) = self.even.as_ref()?;
        Some(*exitance * (quadrilateral_irradiance(corners, position, normal).max(0.0) / PI))
    }

    /// Returns a photon chosen by a number in 0..1, with the flux of all; `None` without light.
    pub fn choice(&self, number: f64) -> Option<&(Emitted<C>, usize)> {
        self.choices.get((number * self.choices.len() as f64) as usize)
    }

    /// Returns the illuminance in lx of the surface that a path meets as the `met`-th: [`Self::irradiance`] of the first one, and of later
    /// ones by the chosen photon alone: this is some percent off, in a tenth of the time, where paths themselves are far noisier.
    #[inline]
    pub fn seen_by(&self, met: u32, position: DVec3, normal: DVec3, number: f64) -> Spectrum<C> {
        if met <= 1 { self.irradiance(position, normal, number) } else { self.by_one(position, normal, number) }
    }

    #[inline]
    fn by_one(&self, position: DVec3, normal: DVec3, number: f64) -> Spectrum<C> {
        let Some((photon, _)) = self.choice(number) else { return Spectrum::ZERO };
        photon.flux * self.per_lumen(photon, position, normal)
    }

    /// Returns the illuminance of a surface per lumen that leaves the opening where a photon does; below 0 where the surface faces away.
    #[inline]
    pub fn per_lumen(&self, photon: &Emitted<C>, position: DVec3, normal: DVec3) -> f64 {
        let frame = &self.frame;
        let to_light = photon.position.extend(frame.origin.z) - frame.levelled(position);
        per_lumen(to_light, frame.levelled_direction(normal))
    }

    /// Returns the illuminance in lx of a surface that sees the whole opening; `number` in 0..1 chooses the photon that represents the light
    /// left out by rings and cells.
    pub fn irradiance(&self, position: DVec3, normal: DVec3, number: f64) -> Spectrum<C> {
        if let Some(lux) = self.of_square(position, normal) {
            return lux;
        }
        let Some((photon, cell)) = self.choice(number) else { return Spectrum::ZERO };
        let receiver = DiscReceiver::new(position, normal, &self.frame);
        let (discs, points, mut sum) = self.vectors.dispatch(DiscParts { light: self, receiver: &receiver });
        for (step, disc) in self.steps.iter().zip(&discs) {
            sum += *step * *disc;
        }
        // part of this photon's light that rings and cells already count
        let ring = cell / SECTORS;
        let inner = if ring > 0 { discs[ring - 1] } else { 0.0 };
        let of_ring: f64 = points[ring * SECTORS..(ring + 1) * SECTORS].iter().sum();
        let counted = (discs[ring] - inner) * RINGS as f64 / (PI * self.radius * self.radius) + points[*cell]
            - of_ring / SECTORS as f64;
        sum + photon.flux * (receiver.point(photon.position) - counted)
    }
}

/// Number of cells whose light is summed in parallel.
const LANES: usize = 4;

/// Vectorized computation of the light that a receiver gets from every ring's disc and from every cell's point.
struct DiscParts<'a, const C: usize> {
    light: &'a TubeLight<C>,
    receiver: &'a DiscReceiver,
}

impl<const C: usize> pulp::NullaryFnOnce for DiscParts<'_, C> {
    /// Illuminance of the discs per unit exitance, of the points per lumen, and of all points by their differences.
    type Output = ([f64; RINGS], [f64; CELLS], Spectrum<C>);

    #[inline(always)]
    fn call(self) -> Self::Output {
        let Self { light, receiver } = self;
        let (mut discs, mut points) = ([0.0; RINGS], [0.0; CELLS]);
        for (disc, radius) in discs.iter_mut().zip(&RADII) {
            *disc = receiver.disc(light.radius * *radius);
        }
        for (point, middle) in points.iter_mut().zip(&light.middles) {
            *point = receiver.point(*middle);
        }
        // as many sums as lanes, so that none waits for another
        let sum = light.differences.map(|differences| {
            let mut sums = [0.0; LANES];
            for (differences, points) in differences.chunks_exact(LANES).zip(points.chunks_exact(LANES)) {
                for ((sum, difference), point) in sums.iter_mut().zip(differences).zip(points) {
                    *sum += difference * point;
                }
            }
            (sums[0] + sums[1]) + (sums[2] + sums[3])
        });
        (discs, points, Spectrum(sum))
    }
}

/// Chooses photons by systematic resampling: every choice has the same luminous flux, and the mean of all is the whole. `start` in 0..1.
fn choose<const C: usize>(cells: &[Vec<Emitted<C>>; CELLS], start: f64) -> Vec<(Emitted<C>, usize)> {
    let all = || cells.iter().enumerate().flat_map(|(cell, photons)| photons.iter().map(move |photon| (photon, cell)));
    let total: f64 = all().map(|(photon, _)| photon.flux.luminance()).sum();
    let count = all().count().min(MOST_CHOICES);
    let fraction = total / count as f64;
    let mut choices = Vec::new();
    let mut reached = 0.0;
    for (photon, cell) in all() {
        let luminous = photon.flux.luminance();
        reached += luminous;
        while choices.len() < count && (choices.len() as f64 + start) * fraction < reached {
            let flux = photon.flux * (total / luminous);
            choices.push((Emitted { position: photon.position, flux }, cell));
        }
    }
    choices
}

/// Outer radii of the rings, in radii of the disc.
const RADII: [f64; RINGS] = [0.5, FRAC_1_SQRT_2, 0.866_025_403_784_438_6, 1.0];

/// True if no point within `reach` of `position`, at its height, is near the disc of `radius` in an opening.
pub fn is_far(opening: &OpeningFrame, radius: f64, position: DVec3, reach: f64) -> bool {
    let origin = opening.origin;
    // the points lie at other depths before an opening that is not level
    let nearer = if opening.is_level() { 0.0 } else { reach };
    let depth = opening.depth(position);
    let depth = depth.signum() * (depth.abs() - nearer).max(0.0);
    let position = opening.levelled(position);
    if depth >= NEAR * radius {
        return true;
    }
    let beside = ((position - origin).truncate().length() - radius - reach).max(0.0);
    depth * depth + beside * beside >= (NEAR * radius).powi(2)
}

/// Surface that receives light from a disc in an opening, in the opening's levelled frame.
pub struct DiscReceiver {
    position: DVec3,
    normal: DVec3,
    /// Height of the disc above the receiver in m.
    depth: f64,
    /// Horizontal distance of the disc's axis in m.
    offset: f64,
    /// Component of the normal toward the axis.
    toward_axis: f64,
}

impl DiscReceiver {
    /// Makes a receiver at `position`, of unit `normal`, for an opening.
    pub fn new(position: DVec3, normal: DVec3, opening: &OpeningFrame) -> Self {
        let centre = opening.origin;
        let (position, normal) = (opening.levelled(position), opening.levelled_direction(normal));
        let to_axis = (centre - position).truncate();
        let offset = to_axis.length();
        let toward_axis = if offset > 0.0 { normal.truncate().dot(to_axis) / offset } else { 0.0 };
        Self { position, normal, depth: centre.z - position.z, offset, toward_axis }
    }

    /// Returns the illuminance per unit exitance of a disc of `radius` that is above the horizon, from beyond the sphere around it.
    #[inline(always)]
    fn disc(&self, radius: f64) -> f64 {
        far_disc_illuminance(radius, self.depth, self.offset, [self.normal.z, self.toward_axis])
    }

    /// Returns the illuminance per lumen that leaves a point of the opening's plane above the horizon, given in its levelled frame.
    #[inline(always)]
    pub fn point(&self, source: DVec2) -> f64 {
        per_lumen((source - self.position.truncate()).extend(self.depth), self.normal)
    }
}

/// Returns the illuminance of a surface of unit `normal` per lumen from a point of a level opening, `to_light` from it: cos(theta)
/// cos(theta') / (pi d^2).
#[inline(always)]
pub fn per_lumen(to_light: DVec3, normal: DVec3) -> f64 {
    let distance_squared = to_light.length_squared();
    to_light.dot(normal) * to_light.z / (PI * distance_squared * distance_squared)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::guide::{Guide, StraightGuide};
    use crate::optics::Diffuser;
    use crate::sampling::{Key, Replicate};
    use crate::scene::OpeningShape;

    const RADIUS: f64 = 0.127;

    /// Integrates over a disc in the plane z = `depth` by the midpoint rule, in `n` steps of squared radius and of angle.
    fn quadrature(receiver: &DiscReceiver, centre: DVec2, radius: f64, n: usize) -> f64 {
        let mut sum = 0.0;
        for i in 0..n {
            let r = radius * ((i as f64 + 0.5) / n as f64).sqrt();
            for k in 0..n {
                sum += receiver.point(centre + DVec2::from_angle(TAU * (k as f64 + 0.5) / n as f64) * r);
            }
        }
        sum * PI * radius * radius / (n * n) as f64
    }

    #[test]
    fn rings_have_equal_areas() {
        for (ring, radius) in RADII.iter().enumerate() {
            assert!((radius * radius * RINGS as f64 - (ring + 1) as f64).abs() < 1e-15);
        }
    }

    /// Compares rings in closed form with quadrature, for receivers that lie, stand and lean; the rule's error is O(1/n^2).
    #[test]
    fn discs_agree_with_quadrature() {
        let leaning = DVec3::new(-0.4, 0.2, 0.7).normalize();
        for (depth, offset, normal) in [
            (1.0, 0.0, DVec3::Z),
            (1.5, 1.1, DVec3::Z),
            (0.2, 0.1, DVec3::Z),
            (0.3, 0.6, DVec3::NEG_X),
            (0.05, 0.5, DVec3::NEG_X),
            (0.8, 0.5, leaning),
        ] {
            let (position, centre) = (DVec3::new(offset, 0.0, 0.0), DVec3::new(0.0, 0.0, depth));
            let receiver = DiscReceiver::new(position, normal, &OpeningFrame::level(centre));
            let expected = quadrature(&receiver, DVec2::ZERO, RADIUS, 300);
            let found = receiver.disc(RADIUS);
            assert!((found / expected - 1.0).abs() < 2e-5, "{depth} {offset} {normal}: {found} {expected}");
        }
    }

    /// Compares a disc of a millimetre seen from 141 m, and its outermost ring, with a point of the same area, to (r / d)^2 and roundings.
    #[test]
    fn a_small_disc_far_away_is_a_point() {
        let radius = 0.001;
        for normal in [DVec3::Z, DVec3::NEG_X, DVec3::new(-0.6, 0.0, 0.8)] {
            let opening = OpeningFrame::level(DVec3::new(0.0, 0.0, 100.0));
            let receiver = DiscReceiver::new(DVec3::new(100.0, 0.0, 0.0), normal, &opening);
            let per_area = receiver.point(DVec2::ZERO);
            let whole = receiver.disc(radius) / (PI * radius * radius);
            assert!((whole / per_area - 1.0).abs() < 1e-9, "{normal}: {whole} {per_area}");
            let inner = radius * RADII[RINGS - 2];
            let ring = (receiver.disc(radius) - receiver.disc(inner)) / (PI * radius * radius / RINGS as f64);
            assert!((ring / per_area - 1.0).abs() < 1e-9, "{normal}: {ring} {per_area}");
        }
    }

    /// Makes photons in a lopsided pattern: twice as dense on one side, and denser toward the middle.
    fn lopsided(count: usize, centre: DVec2) -> Vec<Emitted<3>> {
        let (replicate, _) = Replicate::of(Key::new(5), 0);
        let photon = |k: usize| {
            let [u, v, w, _] = replicate.point(k as u16, 0);
            let angle = if w < 2.0 / 3.0 { PI * v } else { -PI * v };
            let position = centre + DVec2::from_angle(angle) * RADIUS * u.powf(0.6);
            Emitted { position, flux: Spectrum([1.0, 2.0, 0.5]) * (1.0 / count as f64) }
        };
        (0..count).map(photon).collect()
    }

    /// Checks that the mean over all choices equals the light of all photons, to rounding; a single choice is within some percent of it,
    /// nearer than the photon alone.
    #[test]
    fn nothing_is_lost_in_the_mean() {
        let origin = DVec3::new(1.0, 1.2, 2.5);
        let pipe = StraightGuide {
            radius: RADIUS,
            length: 1.0,
            reflectance: [0.95; 3].into(),
            collector_transmittance: [1.0; 3],
        };
        let tube = TraceableTube {
            face: 5,
            hangs: false,
            frame: OpeningFrame::level(origin),
            opening: OpeningShape::Disc { radius: RADIUS },
            pipe_radius: RADIUS,
            transition_transmittance: 1.0,
            guide: Guide::Straight(pipe),
            cones: None,
            section: None,
            diffuser: Diffuser::Lambertian { transmittance: [0.6; 3], reflectance: [0.2; 3] },
            surroundings: None,
            sky: None,
            sun: None,
        };
        let count = 4096;
        let photons = lopsided(count, origin.truncate());
        let light = TubeLight::new(&tube, photons.clone(), 0.5);
        assert_eq!(light.choices.len(), count);
        for (position, normal) in [
            (DVec3::new(1.0, 1.2, 1.5), DVec3::Z),
            (DVec3::new(2.0, 0.5, 1.0), DVec3::Z),
            (DVec3::new(0.0, 1.0, 1.8), DVec3::X),
            (DVec3::new(1.3, 1.25, 2.3), DVec3::NEG_X),
        ] {
            let receiver = DiscReceiver::new(position, normal, &OpeningFrame::level(origin));
            let mut truth = Spectrum::ZERO;
            photons.iter().for_each(|photon| truth += photon.flux * receiver.point(photon.position));
            let (mut mean, mut spread, mut alone) = (Spectrum::ZERO, 0.0, 0.0);
            for k in 0..count {
                let number = (k as f64 + 0.5) / count as f64;
                let one = light.irradiance(position, normal, number);
                mean += one * (1.0 / count as f64);
                spread += (one.0[1] / truth.0[1] - 1.0).powi(2) / count as f64;
                let (photon, _) = light.choice(number).unwrap();
                alone += (photon.flux.0[1] * receiver.point(photon.position) / truth.0[1] - 1.0).powi(2) / count as f64;
            }
            for channel in 0..3 {
                assert!((mean.0[channel] / truth.0[channel] - 1.0).abs() < 1e-10, "{position}: {mean:?} {truth:?}");
            }
            println!("{position}: {:.4}, {:.4} alone", spread.sqrt(), alone.sqrt());
            assert!(spread < 0.2 * alone, "{position}: {spread} {alone}");
        }
    }
}
