//! Optics of one point of a tube's lower end, as a ray meets it.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

use super::scatter::{Kind, Scatter, Scattered, SheetSide, Travel, toward_side};
use super::{MeasuredDiffuser, Spectrum};
use crate::geometry::opening_frame::{levelled, unlevelled};
use crate::sampling::{PathSamples, warp};

/// A point of a diffuser: a sheet in the plane of an opening. Directions are those of the room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closure<'a> {
    sheet: Sheet<'a>,
    /// Matrix that levels directions, as that of an [`crate::geometry::OpeningFrame`]; `None` for a level sheet.
    turn: Option<&'a DMat3>,
}

/// Kinds of sheets, in a plane z = const.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Sheet<'a> {
    /// Light passes with its direction unchanged; its weight is multiplied by the transmittance, the rest is absorbed.
    Specular {
        /// Fraction that passes, linear Rec.709, 0..=1.
        transmittance: [f64; 3],
    },
    /// A Lambertian sheet scatters light evenly to both sides, from either side.
    Lambertian {
        /// Fraction that is scattered to the far side, linear Rec.709.
        transmittance: [f64; 3],
        /// Fraction that is scattered back, linear Rec.709.
        reflectance: [f64; 3],
    },
    /// A measured table gives the scattered light.
    Measured(&'a MeasuredDiffuser),
}

impl<'a> Closure<'a> {
    /// Lambertian sheet that transmits all light, level.
    pub const EVEN: Self =
        Self { sheet: Sheet::Lambertian { transmittance: [1.0; 3], reflectance: [0.0; 3] }, turn: None };

    /// Returns the closure in the plane of an opening whose frame has this matrix.
    #[inline]
    pub fn turned(self, turn: Option<&'a DMat3>) -> Self {
        Self { turn, ..self }
    }

    /// Returns the component of a direction along the normal up the tube: above 0 for light that goes up.
    #[inline]
    pub fn up(&self, direction: DVec3) -> f64 {
        levelled(self.turn, direction).z
    }

    /// Returns the transmittance of unscattered light; `None` for a closure that scatters.
    #[inline]
    pub fn unscattered<const C: usize>(&self) -> Option<Spectrum<C>> {
        match &self.sheet {
            Sheet::Specular { transmittance } => Some(Spectrum::from_rgb(*transmittance)),
            Sheet::Lambertian { .. } | Sheet::Measured(_) => None,
        }
    }

    /// Returns the table of a measured closure; `None` for one that is Lambertian or does not scatter.
    #[inline]
    pub fn table(&self) -> Option<&'a MeasuredDiffuser> {
        match self.sheet {
            Sheet::Measured(table) => Some(table),
            Sheet::Specular { .. } | Sheet::Lambertian { .. } => None,
        }
    }

    /// Returns the fraction of light from the unit vector `from` that passes as through a Lambertian sheet, without any other transmitted
    /// light.
    #[inline]
    pub fn even_fraction<const C: usize>(&self, from: DVec3) -> Spectrum<C> {
        match &self.sheet {
            Sheet::Specular { .. } => Spectrum::ZERO,
            Sheet::Lambertian { transmittance, .. } => Spectrum::from_rgb(*transmittance),
            Sheet::Measured(table) => Spectrum([table.even_fraction(self.up(from).abs()); C]),
        }
    }

    /// Returns the transmittance or reflectance of a Lambertian closure; `None` for others.
    #[inline]
    pub fn lambertian<const C: usize>(&self, side: SheetSide) -> Option<Spectrum<C>> {
        self.sheet.lambertian(side)
    }
}

impl<'a> From<Sheet<'a>> for Closure<'a> {
    fn from(sheet: Sheet<'a>) -> Self {
        Self { sheet, turn: None }
    }
}

impl<const C: usize> Scatter<C> for Closure<'_> {
    #[inline]
    fn value(&self, travel: Travel, from: DVec3, toward: DVec3) -> Spectrum<C> {
        self.sheet.value(travel, levelled(self.turn, from), levelled(self.turn, toward))
    }

    #[inline]
    fn pdf(&self, travel: Travel, from: DVec3, toward: DVec3) -> f64 {
        Scatter::<C>::pdf(&self.sheet, travel, levelled(self.turn, from), levelled(self.turn, toward))
    }

    #[inline]
    fn sample(&self, travel: Travel, from: DVec3, side: SheetSide, samples: &mut PathSamples) -> Option<Scattered<C>> {
        let scattered = self.sheet.sample(travel, levelled(self.turn, from), side, samples)?;
        Some(Scattered { toward: unlevelled(self.turn, scattered.toward), ..scattered })
    }

    #[inline]
    fn albedo(&self, from: DVec3, side: SheetSide) -> Spectrum<C> {
        self.sheet.albedo(levelled(self.turn, from), side)
    }

    #[inline]
    fn likely_albedo(&self, from: DVec3, side: SheetSide) -> Spectrum<C> {
        self.sheet.likely_albedo(levelled(self.turn, from), side)
    }
}

impl Sheet<'_> {
    #[inline]
    fn lambertian<const C: usize>(&self, side: SheetSide) -> Option<Spectrum<C>> {
        match self {
            Self::Lambertian { transmittance, reflectance } => Some(Spectrum::from_rgb(match side {
                SheetSide::Same => *reflectance,
                SheetSide::Other => *transmittance,
            })),
            Self::Specular { .. } | Self::Measured(_) => None,
        }
    }
}

/// Returns the side of a sheet on which `toward` lies, seen from `from`.
fn side_of(from: DVec3, toward: DVec3) -> SheetSide {
    if from.z * toward.z < 0.0 { SheetSide::Other } else { SheetSide::Same }
}

impl<const C: usize> Scatter<C> for Sheet<'_> {
    #[inline]
    fn value(&self, travel: Travel, from: DVec3, toward: DVec3) -> Spectrum<C> {
        match self {
            Self::Measured(table) => table.value(travel, from, toward),
            _ => self
                .lambertian(side_of(from, toward))
                .map_or(Spectrum::ZERO, |fraction| fraction * (toward.z.abs() / PI)),
        }
    }

    #[inline]
    fn pdf(&self, travel: Travel, from: DVec3, toward: DVec3) -> f64 {
        match self {
            Self::Specular { .. } => 0.0,
            Self::Lambertian { .. } => toward.z.abs() / PI,
            Self::Measured(table) => Scatter::<C>::pdf(*table, travel, from, toward),
        }
    }

    #[inline]
    fn sample(&self, travel: Travel, from: DVec3, side: SheetSide, samples: &mut PathSamples) -> Option<Scattered<C>> {
        match self {
            Self::Specular { .. } if side == SheetSide::Same => None,
            Self::Specular { transmittance } => {
                let weight = Spectrum::from_rgb(*transmittance);
                Some(Scattered { toward: -from, kind: Kind::Through, pdf: 1.0, weight })
            }
            Self::Lambertian { .. } => {
                let toward = toward_side(warp::cosine_hemisphere(samples.pair()), from, side);
                let (weight, pdf) = (self.albedo(from, side), toward.z.abs() / PI);
                (pdf > 0.0).then_some(Scattered { toward, kind: Kind::Diffuse, pdf, weight })
            }
            Self::Measured(table) => Scatter::<C>::sample(*table, travel, from, side, samples),
        }
    }

    #[inline]
    fn albedo(&self, from: DVec3, side: SheetSide) -> Spectrum<C> {
        match self {
            Self::Specular { .. } if side == SheetSide::Same => Spectrum::ZERO,
            Self::Specular { transmittance } => Spectrum::from_rgb(*transmittance),
            Self::Lambertian { .. } => self.lambertian(side).unwrap_or(Spectrum::ZERO),
            Self::Measured(table) => table.albedo(from, side),
        }
    }

    #[inline]
    fn likely_albedo(&self, from: DVec3, side: SheetSide) -> Spectrum<C> {
        match self {
            Self::Measured(table) => table.likely_albedo(from, side),
            Self::Specular { .. } | Self::Lambertian { .. } => self.albedo(from, side),
        }
    }
}
