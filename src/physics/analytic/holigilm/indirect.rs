//! Interreflection of the room, and the places where its light ends.

use std::borrow::Cow;
use std::sync::atomic::AtomicBool;

use glam::DVec2;

use super::coefficients::{clear_transmittance, lambertian_coefficients};
use super::first_reflection::{FirstReflection, Receiver, Reflected};
use super::light::{PatchLight, TubeLight, mean};
use super::quadrature::{cell_mean, centre, gauss};
use crate::analytic::patches::{Element, Mesh, Patch};
use crate::analytic::radiosity::{Exitances, Interreflection, Unsolved};
use crate::analytic::{Balance, Installation, Tube};
use crate::geometry::disc::disc_polygon_area;
use crate::scene::{EstimateKind, Face, Grid};

/// Interreflected light at one level of accuracy.
pub struct Indirect<'a> {
    room: &'a Interreflection,
    exitances: Exitances,
    /// Exitances on the coarse mesh, by randomisation; empty when the randomisations do not differ.
    coarse: Vec<Vec<f64>>,
    closure: f64,
    /// First reflection of sunbeams, and its illuminance of the patches; `None` where no clear zone lets sunlight in.
    beams: Option<(FirstReflection, Vec<Reflected>)>,
}

impl<'a> Indirect<'a> {
    /// Solves the interreflection of the direct light on the patches, and of sunbeams from their first reflection on.
    ///
    /// `None` when cancelled.
    pub fn new(
        room: &'a Interreflection,
        direct: &PatchLight,
        beams: Option<FirstReflection>,
        cancel: &AtomicBool,
    ) -> Option<Self> {
        let beams = beams.map(|beams| {
            let on_patches = beams.on_patches(room.mesh(), cancel);
            (beams, on_patches)
        });
        let mut replicas = Cow::Borrowed(&direct.replicas);
        if let Some((_, on_patches)) = &beams {
            for (number, values) in replicas.to_mut().iter_mut().enumerate() {
                values.iter_mut().zip(on_patches).for_each(|(lux, beams)| *lux += beams.replicas[number]);
            }
        }
        let mut exitances = match room.exitances(&mean(&replicas), cancel) {
            Ok(exitances) => exitances,
            Err(Unsolved::Cancelled) => return None,
            // rooms without limit are refused before; should one slip through, the result is not finite and the job fails
            Err(Unsolved::NoLimit) => Exitances::unknown(room.mesh()),
        };
        if let Some((beams, on_patches)) = &beams {
            let means: Vec<f64> = on_patches.iter().map(Reflected::lux).collect();
            let at = |element: Element| beams.at(&Receiver::Point(element)).lux();
            room.add_details(&mut exitances, &means, at, cancel);
        }
        let varying: &[Vec<f64>] = if direct.varies { &replicas } else { &[] };
        let coarse = varying.iter().filter_map(|values| room.coarse_exitance(values, cancel).ok()).collect();
        Some(Self { room, exitances, coarse, closure: direct.closure, beams })
    }

    /// Computes the first reflection of sunbeams at a point or averaged over a cell.
    pub fn first(&self, grid: &Grid, sensor: usize) -> Option<Reflected> {
        self.beams.as_ref().map(|(beams, _)| beams.at(&Receiver::sensor(grid, centre(grid, sensor))))
    }

    /// Computes the illuminance at a point or averaged over a cell without [`Self::first`], and its error, in lux.
    pub fn at(&self, grid: &Grid, sensor: usize) -> (f64, f64) {
        let centre = centre(grid, sensor);
        let (middle, mut error) = self.room.illuminance(&self.exitances, centre);
        error += self.closure * middle;
        if grid.estimate == EstimateKind::Point {
            return (middle, error);
        }
        let coarse = |points: usize| {
            cell_mean(grid, centre, &gauss(points), |point| self.room.coarse_illuminance(&self.exitances.coarse, point))
        };
        let mean = cell_mean(grid, centre, &gauss(3), |point| self.room.illuminance(&self.exitances, point).0);
        (mean, error + (coarse(3) - coarse(2)).abs())
    }

    /// Computes the interreflected illuminance of the patches in lux.
    fn on_patches(&self) -> Vec<f64> {
        let mut lux = self.room.patch_illuminance(&self.exitances);
        if let Some((_, beams)) = &self.beams {
            lux.iter_mut().zip(beams).for_each(|(lux, beams)| *lux += beams.lux());
        }
        lux
    }

    /// Computes the illuminance in each randomisation without [`Self::first`], on the coarse mesh; empty when they do not differ.
    pub fn spread(&self, grid: &Grid, sensor: usize) -> impl Iterator<Item = f64> {
        let centre = centre(grid, sensor);
        self.coarse.iter().map(move |exitance| self.room.coarse_illuminance(exitance, centre))
    }
}

/// Prepares the interreflection of the room with the openings in its ceiling; `None` when cancelled.
pub fn room(installation: &Installation, lights: &[TubeLight], cancel: &AtomicBool) -> Option<Interreflection> {
    let underside = |(tube, light): (&Tube, &TubeLight)| underside(tube, light.returned);
    let openings: Vec<f64> = installation.tubes.iter().zip(lights).map(underside).collect();
    let reflectance = |patch: &Patch| {
        let face = installation.reflectance[patch.face].unwrap_or(0.0);
        let shares = installation.tubes.iter().zip(&openings).map(|(tube, opening)| (fraction(patch, tube), opening));
        shares.fold(face, |sum, (fraction, opening)| sum + fraction * (opening - face))
    };
    Interreflection::new(installation.size, reflectance, cancel)
}

/// Computes the reflectance of an opening seen from the room, its zones weighted by their areas.
fn underside(tube: &Tube, returned: f64) -> f64 {
    let clear = tube.diffuser.specular_zone(tube.radius).map_or(0.0, |(inner, outer)| outer * outer - inner * inner);
    let (transmittance, reflectance) = lambertian_coefficients(&tube.diffuser);
    // up through the sheet, back down the guide, and through it, or up again
    let lambertian = reflectance + transmittance * transmittance * returned / (1.0 - reflectance * returned);
    lambertian * (1.0 - clear / (tube.radius * tube.radius))
}

/// Computes the fraction of a patch that a tube's opening covers.
fn fraction(patch: &Patch, tube: &Tube) -> f64 {
    if patch.face != Face::Ceiling as usize {
        return 0.0;
    }
    let (low, high) = (patch.low, patch.high);
    let corners = [(low.x, low.y), (high.x, low.y), (high.x, high.y), (low.x, high.y)];
    let corners = corners.map(|(x, y)| DVec2::new(x, y));
    (disc_polygon_area(tube.origin.truncate(), tube.radius, &corners) / patch.area()).clamp(0.0, 1.0)
}

/// Adds the light that ends in the room to the energy balance; `direct`: averages over the patches.
pub fn add_room_balance(
    installation: &Installation,
    mesh: &Mesh,
    direct: &[f64],
    indirect: Option<&Indirect>,
    balance: &mut Balance,
) {
    let reflected = indirect.map(Indirect::on_patches);
    for (index, patch) in mesh.patches.iter().enumerate() {
        let flux = patch.area() * (direct[index] + reflected.as_ref().map_or(0.0, |values| values[index]));
        let mut covered = 0.0;
        for tube in &installation.tubes {
            let fraction = fraction(patch, tube);
            covered += fraction;
            let (absorbed, up) = upward(tube);
            balance.diffuser += absorbed * fraction * flux;
            balance.guide_top += up * fraction * flux;
        }
        match installation.reflectance[patch.face] {
            None => balance.open_surfaces += flux,
            Some(reflectance) => {
                let kept = if reflected.is_some() { 1.0 - reflectance } else { 1.0 };
                balance.room += kept * (1.0 - covered) * flux;
            }
        }
    }
}

/// Computes the fractions of the light on an opening from below that its closure absorbs, and that enter the guide.
fn upward(tube: &Tube) -> (f64, f64) {
    let clear = tube.diffuser.specular_zone(tube.radius).map_or(0.0, |(inner, outer)| outer * outer - inner * inner)
        / (tube.radius * tube.radius);
    let (transmittance, reflectance) = lambertian_coefficients(&tube.diffuser);
    let through = clear_transmittance(&tube.diffuser);
    let absorbed = clear * (1.0 - through) + (1.0 - clear) * (1.0 - transmittance - reflectance);
    (absorbed, clear * through + (1.0 - clear) * transmittance)
}
