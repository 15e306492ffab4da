//! Lumens that tubes send into a room, moment by moment.
//!
//! Lambertian closures make the year separable: the illuminance of a point is the sum over tubes of its response and these lumens.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use skyduct_physics::guide::delivery::{Delivered, Delivery, EvenClosure, TubeClosure};
use skyduct_physics::guide::performance::has_closed_form;
use skyduct_physics::guide::sky_rings::SkyRings;
use skyduct_physics::integrator::diffuser_source::closure_source::is_lambertian;
use skyduct_physics::optics::Spectrum;
use skyduct_physics::optics::scatter::{Scatter as _, SheetSide};
use skyduct_physics::sampling::Key;
use skyduct_physics::sky::{CieType, SkyDistribution};
use skyduct_physics::traceable::{TraceableScene, TraceableTube};

use crate::light::LitMoment;

/// Light of a tube at a moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TubeLight {
    /// Light of the sky into the room in lm, with that of the surroundings.
    pub sky_lm: f64,
    /// Light of the sun into the room in lm.
    pub sun_lm: f64,
    /// Centroid of the light of the sky on the closure, in m from its centre.
    pub sky_centroid_m: DVec2,
    /// Centroid of the light of the sun.
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
    /// True if the closure is Lambertian, so that its light gives it one luminance.
    pub is_lambertian: bool,
}

/// Largest number of tubes with closed forms before a horizon whose moments take the time of one tube through which rays are traced.
const HIDDEN_PER_TRACED: usize = 8;

/// Counts the tubes of a scene that differ and through which rays are traced for each moment; eight others before horizons count as one.
pub fn traced_tubes(scene: &TraceableScene) -> usize {
    let [mut traced, mut hidden] = [const { Vec::<&TraceableTube>::new() }; 2];
    for tube in &scene.tubes {
        let horizon = tube.surroundings.as_ref().and_then(|surroundings| surroundings.horizon.as_ref());
        let is_closed = has_closed_form(&tube.guide) && matches!(closure(tube), TubeClosure::Even(_));
        let kind = match (is_closed, horizon) {
            (true, None) => continue,
            (true, Some(_)) => &mut hidden,
            (false, _) => &mut traced,
        };
        if !kind.iter().any(|before| are_alike(before, tube)) {
            kind.push(tube);
        }
    }
    traced.len() + hidden.len().div_ceil(HIDDEN_PER_TRACED)
}

/// True if two tubes pass light alike, before the same surroundings.
fn are_alike(one: &TraceableTube, other: &TraceableTube) -> bool {
    one.guide.is_like(&other.guide) && one.surroundings == other.surroundings && closure(one) == closure(other)
}

/// Computes the light of every tube of a scene at every moment; equal seeds give equal bits.
pub fn tube_years(scene: &TraceableScene, lit: &[LitMoment], seed: u64) -> Vec<TubeYear> {
    let rings: Vec<SkyRings> = lit.par_iter().map(|moment| SkyRings::new(&moment.distribution)).collect();
    let mut years: Vec<TubeYear> = Vec::with_capacity(scene.tubes.len());
    for (number, tube) in scene.tubes.iter().enumerate() {
        let alike = |other: usize| are_alike(&scene.tubes[other], tube);
        let year = match (0..number).find(|other| alike(*other)) {
            Some(other) => years[other].clone(),
            None => {
                let key = Key::new(seed).child(number as u64);
                let surroundings = tube.surroundings.as_deref();
                let delivery = Delivery::new(
                    (&tube.guide, tube.frame.turn()),
                    surroundings,
                    closure(tube),
                    scene.guide_return,
                    key,
                );
                TubeYear { is_lambertian: is_lambertian(tube), ..tube_year(&delivery, lit, &rings) }
            }
        };
        years.push(year);
    }
    years
}

fn tube_year(delivery: &Delivery, lit: &[LitMoment], rings: &[SkyRings]) -> TubeYear {
    let ground = delivery.of_ground();
    let of_moment = |(moment, rings): (&LitMoment, &SkyRings)| {
        let of_sky = delivery.of_sky(&moment.distribution, rings);
        let beam = moment.direct_normal_lux > 0.0;
        let of_sun = if beam { delivery.of_beam(moment.sun) } else { Delivered::default() };
        let [diffuse, direct] = [moment.diffuse_horizontal_lux, moment.direct_normal_lux];
        let global = diffuse + moment.direct_horizontal_lux();
        let sky_lm = of_sky.area_m2 * diffuse + ground.area_m2 * global;
        let light = TubeLight {
            sky_lm,
            sun_lm: of_sun.area_m2 * direct,
            // the ground lights the closure as if from all around
            sky_centroid_m: if sky_lm > 0.0 {
                of_sky.centroid_m * (of_sky.area_m2 * diffuse / sky_lm)
            } else {
                DVec2::ZERO
            },
            sun_centroid_m: of_sun.centroid_m,
        };
        let of_diffuse = of_sky.standard_error_m2 * diffuse + ground.standard_error_m2 * global;
        let error = of_diffuse + of_sun.standard_error_m2 * direct;
        (light, moment.share * error)
    };
    let (moments, errors): (Vec<TubeLight>, Vec<f64>) = lit.par_iter().zip(rings).map(of_moment).unzip();
    let error: f64 = errors.iter().sum();
    let whole: f64 = moments.iter().zip(lit).map(|(light, moment)| moment.share * light.lumens()).sum();
    let relative_error = if whole > 0.0 { error / whole } else { 0.0 };
    let overcast = SkyDistribution::new(CieType::STANDARD_OVERCAST, DVec3::Z);
    let of_overcast = delivery.of_sky(&overcast, &SkyRings::new(&overcast));
    let overcast_m2 = of_overcast.area_m2 + ground.area_m2;
    TubeYear { moments, relative_error, overcast_m2, is_lambertian: false }
}

/// Returns the closure of a tube.
fn closure(tube: &TraceableTube) -> TubeClosure<'_> {
    let closure = tube.closure_at(tube.frame.origin);
    // what a transition passes downward, and of light that the closure scatters up the part that comes back to it through the transition
    let (down, back) = match tube.opening.disc() {
        Some(_) => (1.0, 1.0),
        None => {
            let passed = tube.transition_transmittance;
            (passed, passed * passed * tube.pipe_area_m2() / tube.opening.area_m2())
        }
    };
    // the same everywhere and from everywhere
    let is_even = is_lambertian(tube) || !tube.scatters();
    if !is_even {
        return TubeClosure::Other(&tube.diffuser, tube.pipe_radius);
    }
    let fraction = |side, factor: f64| {
        let Spectrum(fraction): Spectrum<3> = closure.albedo(tube.frame.outward(), side);
        fraction.map(|fraction| factor * fraction)
    };
    TubeClosure::Even(EvenClosure {
        radius: tube.pipe_radius,
        transmittance: fraction(SheetSide::Other, down),
        reflectance: fraction(SheetSide::Same, back),
        spreads: tube.opening.disc().is_none(),
    })
}
