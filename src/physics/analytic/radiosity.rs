//! Light reflected between the six diffuse faces of an empty box room.
//!
//! Faces are divided into rectangular patches; the exitance is constant on a patch, the illuminance is taken at its centre
//! with exact form factors from there to every patch. Every row of form factors adds up to one, so no light is lost.
//!
//! Exact checks and the sources: docs/physics/rooms.md#diffuse-interreflection.

use std::sync::atomic::AtomicBool;

use glam::DVec3;
use rayon::prelude::*;

use super::is_raised;
use super::patches::{Element, Mesh, Parts, Patch};

/// Number of sweeps after which the solution is given up; as the energy balance is restored after every sweep, ten to forty suffice.
const MOST_SWEEPS: usize = 1000;

/// Largest change in a sweep, relative to the largest exitance, at which the solution has converged.
const CONVERGED: f64 = 1e-12;

/// Distance, in diagonals of a patch, within which the patch is divided for an element.
const NEAR: f64 = 2.5;

/// Number of rounds of scaling after which the factors are reciprocal to rounding.
const BALANCINGS: usize = 30;

/// Form factors and reflectances of the patches.
#[derive(Clone, Debug)]
pub struct Radiosity {
    mesh: Mesh,
    reflectance: Vec<f64>,
    /// Form factors; row i: from the centre of patch i to every patch.
    factors: Vec<f64>,
}

/// Reasons why the interreflection of a room was not found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unsolved {
    /// A closed room absorbs nothing, or next to nothing.
    #[error("the room absorbs no light, so interreflection has no finite solution: lower the reflectances")]
    NoLimit,
    /// The computation was cancelled.
    #[error("the computation was cancelled")]
    Cancelled,
}

impl Radiosity {
    /// Computes the form factors of `mesh`; `reflectance`: of each of its patches, 0..=1; 0 where a face is open.
    pub fn new(mesh: Mesh, reflectance: Vec<f64>, cancel: &AtomicBool) -> Result<Self, Unsolved> {
        let row = |patch: &Patch| {
            let element = Element::on(patch, patch.centre());
            let row = || mesh.patches.iter().map(|other| other.factor_from(element)).collect::<Vec<_>>();
            unless(cancel).map(|()| row())
        };
        let rows: Vec<Vec<f64>> = mesh.patches.par_iter().map(row).collect::<Result<_, _>>()?;
        let mut radiosity = Self { factors: rows.concat(), mesh, reflectance };
        radiosity.balance(cancel)?;
        Ok(radiosity)
    }

    /// Makes the factors reciprocal, A_i F_ij = A_j F_ji, with rows that add up to one: no light is made or lost.
    ///
    /// From a point the factor differs from the mean over the patch; its symmetric part is nearer to the mean. Scaling
    /// rows and columns alike (Sinkhorn and Knopp 1967) restores the sums.
    fn balance(&mut self, cancel: &AtomicBool) -> Result<(), Unsolved> {
        let areas: Vec<f64> = self.mesh.patches.iter().map(Patch::area).collect();
        let count = areas.len();
        for i in 0..count {
            for j in 0..i {
                let (forth, back) = (i * count + j, j * count + i);
                let mean = 0.5 * (areas[i] * self.factors[forth] + areas[j] * self.factors[back]);
                (self.factors[forth], self.factors[back]) = (mean, mean);
            }
            self.factors[i * count + i] *= areas[i];
        }
        let mut scale = vec![1.0; count];
        for _ in 0..BALANCINGS {
            unless(cancel)?;
            let sums = self.seen(&scale);
            for i in 0..count {
                scale[i] = (scale[i] * areas[i] / sums[i]).sqrt();
            }
        }
        for (i, row) in self.factors.chunks_exact_mut(count).enumerate() {
            let sum: f64 = row.iter().zip(&scale).map(|(factor, scale)| factor * scale).sum();
            row.iter_mut().zip(&scale).for_each(|(factor, scale)| *factor *= scale / sum);
            debug_assert!((sum * scale[i] / areas[i] - 1.0).abs() < 1e-6);
        }
        Ok(())
    }

    /// Returns the patches by which factors and exitances are numbered.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Computes the exitance of every patch in lm/m2, for direct illuminances averaged over the patches, in lux.
    ///
    /// Gauss-Seidel sweeps; after each, the energy balance is restored by adding a multiple of the reflectances, which removes the slow
    /// convergence in rooms that absorb little.
    ///
    /// In a closed room of one reflectance rho under even direct light E every exitance is rho E / (1 - rho):
    ///
    /// ```
    /// use skyduct_physics::analytic::patches::Mesh;
    /// use skyduct_physics::analytic::radiosity::Radiosity;
    /// use std::sync::atomic::AtomicBool;
    ///
    /// let goes_on = AtomicBool::new(false);
    /// let mesh = Mesh::new(glam::DVec3::new(2.0, 3.0, 2.5), [2, 2, 2]);
    /// let patches = mesh.patches.len();
    /// let room = Radiosity::new(mesh, vec![0.75; patches], &goes_on)?;
    /// let exitance = room.exitance(&vec![100.0; patches], &goes_on)?;
    /// assert!(exitance.iter().all(|value| (value - 300.0).abs() < 1e-8));
    /// # Ok::<(), skyduct_physics::analytic::radiosity::Unsolved>(())
    /// ```
    pub fn exitance(&self, direct: &[f64], cancel: &AtomicBool) -> Result<Vec<f64>, Unsolved> {
        let count = self.mesh.patches.len();
        let areas: Vec<f64> = self.mesh.patches.iter().map(Patch::area).collect();
        let residual_of = |values: &[f64], source: &[f64]| -> f64 {
            let seen = self.seen(values);
            (0..count).map(|i| areas[i] * (self.reflectance[i] * (source[i] + seen[i]) - values[i])).sum()
        };
        let balance = -residual_of(&self.reflectance, &vec![0.0; count]);
        let mut exitance: Vec<f64> = direct.iter().zip(&self.reflectance).map(|(lux, rho)| lux * rho).collect();
        if exitance.iter().all(|value| *value == 0.0) {
            return Ok(exitance);
        }
        if balance <= 1e-12 * areas.iter().sum::<f64>() {
            return Err(Unsolved::NoLimit);
        }
        for _ in 0..MOST_SWEEPS {
            let mut change = 0f64;
            for i in 0..count {
                unless(cancel)?;
                let value = self.reflectance[i] * (direct[i] + dot(self.row(i), &exitance));
                change = change.max((value - exitance[i]).abs());
                exitance[i] = value;
            }
            let fraction = residual_of(&exitance, direct) / balance;
            for (value, rho) in exitance.iter_mut().zip(&self.reflectance) {
                *value += fraction * rho;
            }
            let largest = exitance.iter().copied().fold(0.0, f64::max);
            if change.max(fraction.abs()) <= CONVERGED * largest {
                return Ok(exitance);
            }
        }
        Err(Unsolved::NoLimit)
    }

    /// Computes the interreflected illuminance of a horizontal element that looks up, in lux.
    ///
    /// Patches near the element are divided, with an exitance interpolated linearly between their neighbours.
    pub fn illuminance(&self, exitance: &[f64], position: DVec3) -> f64 {
        self.detailed_illuminance(exitance, &[], position)
    }

    /// Computes the illuminance as [`Self::illuminance`] does, with `details` added to the linear exitances in the parts of every patch;
    /// `details` may be empty.
    fn detailed_illuminance(&self, exitance: &[f64], details: &[Parts], position: DVec3) -> f64 {
        let element = Element::looking_up(position);
        let of_patch = |(index, patch): (usize, &Patch)| {
            let extent = patch.high - patch.low;
            let near = (patch.centre() - position).length_squared() < NEAR * NEAR * extent.length_squared();
            if near && patch.face != 4 {
                self.divided(exitance, details, index, element)
            } else {
                exitance[index] * patch.factor_from(element)
            }
        };
        self.mesh.patches.iter().enumerate().map(of_patch).sum()
    }

    /// Computes the illuminance from a patch in `DIVIDED` x `DIVIDED` parts, whose exitance is linear plus the details.
    fn divided(&self, exitance: &[f64], details: &[Parts], index: usize, element: Element) -> f64 {
        let linear = self.mesh.linear(exitance, index);
        let mut sum = 0.0;
        for (k, linear) in linear.into_iter().enumerate() {
            let value = linear + details.get(index).map_or(0.0, |detail| detail[k]);
            sum += value * self.mesh.patches[index].part(k).factor_from(element);
        }
        sum
    }

    /// Computes the illuminance of every patch from the exitances, in lux.
    pub fn seen(&self, exitance: &[f64]) -> Vec<f64> {
        (0..self.mesh.patches.len()).into_par_iter().map(|i| dot(self.row(i), exitance)).collect()
    }

    fn row(&self, patch: usize) -> &[f64] {
        let count = self.mesh.patches.len();
        &self.factors[patch * count..(patch + 1) * count]
    }
}

/// Fails if the computation is cancelled.
fn unless(cancel: &AtomicBool) -> Result<(), Unsolved> {
    if is_raised(cancel) { Err(Unsolved::Cancelled) } else { Ok(()) }
}

/// Computes the scalar product in eight partial sums of fixed order, so that the compiler may use vectors.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a, b) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a.zip(b) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// Two solutions on meshes of halving patch size, extrapolated.
#[derive(Clone, Debug)]
pub struct Interreflection {
    fine: Radiosity,
    coarse: Radiosity,
}

/// Exitances of the fine and the coarse mesh.
#[derive(Clone, Debug)]
pub struct Exitances {
    /// Exitances in lm/m2 by patch of the fine mesh.
    pub fine: Vec<f64>,
    /// Exitances in lm/m2 by patch of the coarse mesh, whose patches are twice as long and wide.
    pub coarse: Vec<f64>,
    /// Root mean square, over the room, of the correction by extrapolation relative to the interreflected illuminance.
    pub correction: f64,
    /// Differences of the exitances within patches of both meshes from the linear interpolation; empty where they are not computed.
    details: [Vec<Parts>; 2],
}

impl Exitances {
    /// Returns the exitances of an unsolved room: every value is not a number.
    pub fn unknown(mesh: &Mesh) -> Self {
        let nothing = vec![f64::NAN; mesh.patches.len()];
        Self { fine: nothing.clone(), coarse: nothing, correction: f64::NAN, details: [Vec::new(), Vec::new()] }
    }
}

impl Interreflection {
    /// Computes the form factors of both meshes; `reflectance`: of a patch, or its mean where it varies. `None` when `cancel` was raised
    /// meanwhile.
    pub fn new(size: DVec3, reflectance: impl Fn(&Patch) -> f64, cancel: &AtomicBool) -> Option<Self> {
        let fine = Mesh::fine(size);
        let coarse = fine.coarse();
        let of = |mesh: Mesh| {
            let values = mesh.patches.iter().map(&reflectance).collect();
            Radiosity::new(mesh, values, cancel).ok()
        };
        Some(Self { fine: of(fine)?, coarse: of(coarse)? })
    }

    /// Returns the mesh over whose patches the direct illuminance is averaged.
    pub fn mesh(&self) -> &Mesh {
        self.fine.mesh()
    }

    /// Computes the exitances on both meshes for direct illuminances averaged over the patches of [`Interreflection::mesh`], in lux.
    pub fn exitances(&self, direct: &[f64], cancel: &AtomicBool) -> Result<Exitances, Unsolved> {
        let (fine, coarse) = (self.fine.exitance(direct, cancel)?, self.coarse_exitance(direct, cancel)?);
        let seen = self.mesh().merged(&self.fine.seen(&fine), self.coarse.mesh());
        let squares = self.coarse.seen(&coarse).into_iter().zip(&seen).map(|(coarse, fine)| {
            let mean = 0.5 * (coarse + fine);
            if mean > 0.0 { ((fine - coarse) / (3.0 * mean)).powi(2) } else { 0.0 }
        });
        let correction = (squares.sum::<f64>() / seen.len() as f64).sqrt();
        Ok(Exitances { fine, coarse, correction, details: [Vec::new(), Vec::new()] })
    }

    /// Adds the variation within each patch of a part of the light on it, evaluated at points: sensors near the patch see this variation
    /// in place of a linear one between patches.
    ///
    /// `means`: that part of the illuminance of the patches of [`Interreflection::mesh`], in lux; `at`: that part at a point.
    pub fn add_details(
        &self,
        exitances: &mut Exitances,
        means: &[f64],
        at: impl Fn(Element) -> f64 + Sync,
        cancel: &AtomicBool,
    ) {
        let mesh = self.mesh();
        let reflected = |lux: &[f64]| -> Vec<f64> {
            lux.iter().zip(&self.fine.reflectance).map(|(lux, reflectance)| lux * reflectance).collect()
        };
        let means = reflected(means);
        let part = |index: usize, k: usize| {
            let patch = &mesh.patches[index];
            // cancelled: the details are not looked at any more
            let lux = if is_raised(cancel) { 0.0 } else { at(Element::on(patch, patch.part(k).centre())) };
            self.fine.reflectance[index] * lux
        };
        let fine: Vec<Parts> = (0..means.len())
            .into_par_iter()
            .map(|index| {
                let parts: Parts = std::array::from_fn(|k| part(index, k));
                let excess = parts.iter().sum::<f64>() / parts.len() as f64 - means[index];
                parts.map(|part| part - excess)
            })
            .collect();
        let coarse_mesh = self.coarse.mesh();
        let coarse = mesh.merged_parts(&fine, coarse_mesh);
        let less_linear = |mesh: &Mesh, parts: Vec<Parts>, means: &[f64]| {
            let of = |(index, parts): (usize, Parts)| {
                let linear = mesh.linear(means, index);
                std::array::from_fn(|k| parts[k] - linear[k])
            };
            parts.into_iter().enumerate().map(of).collect()
        };
        let coarse_means = mesh.merged(&means, coarse_mesh);
        exitances.details = [less_linear(mesh, fine, &means), less_linear(coarse_mesh, coarse, &coarse_means)];
    }

    /// Computes the exitances on the coarse mesh alone, for the spread between replicates of the direct illuminance.
    pub fn coarse_exitance(&self, direct: &[f64], cancel: &AtomicBool) -> Result<Vec<f64>, Unsolved> {
        self.coarse.exitance(&self.mesh().merged(direct, self.coarse.mesh()), cancel)
    }

    /// Computes the interreflected illuminance of a horizontal element that looks up, and the estimated error, in lux.
    ///
    /// The error of constant patches falls with the square of their size: Richardson's extrapolation of both meshes. The
    /// correction may pass through zero where the error does not, so the error is put at half of the correction here and
    /// half of its root mean square over the room together.
    pub fn illuminance(&self, exitances: &Exitances, position: DVec3) -> (f64, f64) {
        let [fine_details, coarse_details] = &exitances.details;
        let fine = self.fine.detailed_illuminance(&exitances.fine, fine_details, position);
        let coarse = self.coarse.detailed_illuminance(&exitances.coarse, coarse_details, position);
        let correction = (fine - coarse) / 3.0;
        let value = fine + correction;
        (value, 0.5 * (correction.abs() + exitances.correction * value))
    }

    /// Computes the interreflected illuminance of a horizontal element on the coarse mesh in lux, without extrapolation.
    pub fn coarse_illuminance(&self, exitance: &[f64], position: DVec3) -> f64 {
        self.coarse.illuminance(exitance, position)
    }

    /// Computes the interreflected illuminance of the patches of [`Interreflection::mesh`] in lux.
    pub fn patch_illuminance(&self, exitances: &Exitances) -> Vec<f64> {
        self.fine.seen(&exitances.fine)
    }
}
