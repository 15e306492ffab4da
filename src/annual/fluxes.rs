//! Lumens that tubes send into a room, moment by moment.
//!
//! A Lambertian closure makes the year separable: the illuminance of a point is the sum over tubes of its response and these lumens.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use skyduct_physics::guide::Guide;
use skyduct_physics::guide::delivery::{Delivered, Delivery, EvenClosure};
use skyduct_physics::guide::performance::has_closed_form;
use skyduct_physics::guide::sky_rings::SkyRings;
use skyduct_physics::optics::Spectrum;
use skyduct_physics::optics::scatter::SheetSide;
use skyduct_physics::sampling::Key;
use skyduct_physics::sky::{CieType, SkyDistribution};
use skyduct_physics::traceable::{TraceableScene, TraceableTube};

use crate::light::LitMoment;

/// Light of a tube at a moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TubeLight {
    /// Light of the sky into the room in lm.
    pub sky_lm: f64,
    /// Light of the sun into the room in lm.
    pub sun_lm: f64,
    /// Centroid of the light of the sun on the closure, in m from its centre.
    pub sun_centroid_m: DVec2,
}

impl TubeLight {
    /// Returns the light of sky and sun in lm.
    pub fn lumens(&self) -> f64 {
        self.sky_lm + self.sun_lm
    }
}

/// Light of a tube over the year.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TubeYear {
    /// Light at each moment, in the order of the moments.
    pub moments: Vec<TubeLight>,
    /// Standard error of the year's light over the light, of traced rays; they are the same at all moments, and so is the sign of the error.
    pub relative_error: f64,
    /// Light under the CIE standard overcast sky over its horizontal illuminance, in m2.
    pub overcast_m2: f64,
}

/// Closure that lets light through with its direction, so that its light has no lumens alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("tube {tube} has a closure that is not Lambertian, so that its light has no lumens alone")]
pub struct NotLambertian {
    /// Number of the tube.
    pub tube: usize,
}

/// Counts the different guides of a scene through which rays are traced for each moment.
pub fn traced_guides(scene: &TraceableScene) -> usize {
    let traced: Vec<&Guide> =
        scene.tubes.iter().map(|tube| &tube.guide).filter(|guide| !has_closed_form(guide)).collect();
    (0..traced.len()).filter(|number| !traced[..*number].iter().any(|before| before.is_like(traced[*number]))).count()
}

/// Computes the light of every tube of a scene at every moment; equal seeds give equal bits.
pub fn tube_years(scene: &TraceableScene, lit: &[LitMoment], seed: u64) -> Result<Vec<TubeYear>, NotLambertian> {
    let closures = scene.tubes.iter().enumerate().map(|(tube, of)| even_closure(of).ok_or(NotLambertian { tube }));
    let closures: Vec<EvenClosure> = closures.collect::<Result<_, _>>()?;
    let rings: Vec<SkyRings> = lit.par_iter().map(|moment| SkyRings::new(&moment.distribution)).collect();
    let mut years: Vec<TubeYear> = Vec::with_capacity(scene.tubes.len());
    for (number, (tube, closure)) in scene.tubes.iter().zip(&closures).enumerate() {
        let alike = |other: usize| {
            let before = &scene.tubes[other];
            before.guide.is_like(&tube.guide) && closures[other] == *closure
        };
        let year = match (0..number).find(|other| alike(*other)) {
            Some(other) => years[other].clone(),
            None => {
                let key = Key::new(seed).child(number as u64);
                let delivery = Delivery::new(&tube.guide, *closure, scene.guide_return, key);
                tube_year(&delivery, lit, &rings)
            }
        };
        years.push(year);
    }
    Ok(years)
}

fn tube_year(delivery: &Delivery, lit: &[LitMoment], rings: &[SkyRings]) -> TubeYear {
    let of_moment = |(moment, rings): (&LitMoment, &SkyRings)| {
        let of_sky = delivery.of_sky(&moment.distribution, rings);
        let beam = moment.direct_normal_lux > 0.0;
        let of_sun = if beam { delivery.of_beam(moment.sun) } else { Delivered::default() };
        let [diffuse, direct] = [moment.diffuse_horizontal_lux, moment.direct_normal_lux];
        let light = TubeLight {
            sky_lm: of_sky.area_m2 * diffuse,
            sun_lm: of_sun.area_m2 * direct,
            sun_centroid_m: of_sun.centroid_m,
        };
        let error = of_sky.standard_error_m2 * diffuse + of_sun.standard_error_m2 * direct;
        (light, moment.share * error)
    };
    let (moments, errors): (Vec<TubeLight>, Vec<f64>) = lit.par_iter().zip(rings).map(of_moment).unzip();
    let error: f64 = errors.iter().sum();
    let whole: f64 = moments.iter().zip(lit).map(|(light, moment)| moment.share * light.lumens()).sum();
    let relative_error = if whole > 0.0 { error / whole } else { 0.0 };
    let overcast = SkyDistribution::new(CieType::STANDARD_OVERCAST, DVec3::Z);
    TubeYear { moments, relative_error, overcast_m2: delivery.of_sky(&overcast, &SkyRings::new(&overcast)).area_m2 }
}

/// Returns the optics of a closure that is Lambertian all over; `None` for others.
fn even_closure(tube: &TraceableTube) -> Option<EvenClosure> {
    let closure = tube.closure_at(tube.origin);
    // what a transition passes downward, and of light that the closure scatters up the part that comes back to it through the transition
    let (down, back) = match tube.opening.disc() {
        Some(_) => (1.0, 1.0),
        None => {
            let passed = tube.transition_transmittance;
            (passed, passed * passed * tube.pipe_area_m2() / tube.opening.area_m2())
        }
    };
    let fraction = |side, factor: f64| {
        closure.lambertian(side).map(|Spectrum(fraction): Spectrum<3>| fraction.map(|fraction| factor * fraction))
    };
    let whole = tube.diffuser.measured().is_none() && tube.specular_zone().is_none();
    Some(EvenClosure {
        radius: tube.pipe_radius,
        transmittance: fraction(SheetSide::Other, down).filter(|_| whole)?,
        reflectance: fraction(SheetSide::Same, back)?,
        spreads: tube.opening.disc().is_none(),
    })
}
