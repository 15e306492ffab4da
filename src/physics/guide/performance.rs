//! Transmission of any guide with its collector, by ray tracing or in closed form.
//!
//! Every result comes from independent randomised Sobol replicates, so that it has a standard error, or from a closed form. Results of RGB
//! coefficients are weighted to luminance Y.

use glam::DVec3;

use super::sky_moments::SkyMoments;
use super::throughput::{Aim, replicated};
pub use super::throughput::{Effort, REPLICATES, Throughput, Transmission};
use super::transmittance::{beam_transmission, nearly_uniform_sky_transmission, uniform_sky_transmission};
use super::{Guide, StraightGuide};
use crate::optics::{Mirror, Spectrum};
use crate::sampling::Key;
use crate::sky::sampler::SkySampler;
use crate::sky::{CieType, Sky, SkyDistribution};

/// Computes the throughput of parallel light of 1 lx (normal to itself) from the unit vector `toward`: in closed form, with a standard
/// error of 0, through a straight guide under a thin collector whose mirror reflects alike at all angles; else by [`traced_beam`], whose
/// arguments it takes.
///
/// ```
/// use skyduct_physics::guide::performance::beam;
/// use skyduct_physics::guide::{Guide, StraightGuide};
/// use skyduct_physics::optics::Mirror;
/// use skyduct_physics::sampling::Key;
/// use skyduct_physics::sky::direction;
///
/// // 0.98 per reflection, four diameters long, at 60 degrees from the axis (docs/physics/tubes.md)
/// let (reflectance, collector_transmittance) = (Mirror::Constant([0.98; 3]), [0.9; 3]);
/// let pipe = Guide::Straight(StraightGuide { radius: 0.1, length: 0.8, reflectance, collector_transmittance });
/// let through = beam(&pipe, direction(30f64.to_radians(), 2.0), Key::new(0), 16).transmission();
/// assert!((through.value - 0.9 * 0.83912).abs() < 5e-6 && through.standard_error == 0.0);
/// ```
pub fn beam(guide: &Guide, toward: DVec3, key: Key, effort: impl Into<Effort>) -> Throughput {
    closed_beam(guide, toward).unwrap_or_else(|| traced_beam(guide, toward, key, effort))
}

/// Returns the aspect ratio, and the reflectance and transmittance of the channels, of a guide that has closed forms: a straight one under
/// a thin collector whose mirror reflects alike at all angles; else `None`.
pub(super) fn closed(guide: &Guide) -> Option<(f64, [f64; 3], [f64; 3])> {
    match guide {
        Guide::Straight(StraightGuide {
            radius,
            length,
            reflectance: Mirror::Constant(mirror),
            collector_transmittance,
        }) => Some((length / (2.0 * radius), *mirror, *collector_transmittance)),
        _ => None,
    }
}

/// True if a guide has closed forms.
pub fn has_closed_form(guide: &Guide) -> bool {
    closed(guide).is_some()
}

/// Computes [`beam`] in closed form, which does not depend on the azimuth; `None` if there is none.
pub(super) fn closed_beam(guide: &Guide, toward: DVec3) -> Option<Throughput> {
    let (aspect, reflectance, collector_transmittance) = closed(guide)?;
    let tangent = toward.truncate().length() / toward.z;
    let entering = guide.projected_area_m2(-toward);
    if entering <= 0.0 {
        return Some(Throughput::nothing());
    }
    let passed = by_channel(reflectance, |reflectance| beam_transmission(aspect, tangent, reflectance));
    let fraction = Spectrum::<3>(passed) * Spectrum::from_rgb(collector_transmittance);
    Some(Throughput::exact(entering, entering * fraction.luminance()))
}

/// Traces the throughput of parallel light of 1 lx (normal to itself) from the unit vector `toward` with rays.
pub fn traced_beam(guide: &Guide, toward: DVec3, key: Key, effort: impl Into<Effort>) -> Throughput {
    let [found] = replicated(guide, key, effort.into(), |[u, v, ..]| Aim { point: [u, v], toward, weights: [1.0] });
    found
}

/// Evaluates a function for each channel, once for equal values.
fn by_channel([red, green, blue]: [f64; 3], of: impl Fn(f64) -> f64) -> [f64; 3] {
    let of_red = of(red);
    let other = |value: f64| if value == red { of_red } else { of(value) };
    [of_red, other(green), other(blue)]
}

/// Computes the throughput of the light of a sky: in closed form, with a standard error of 0, where [`beam`] has one and no horizon hides a
/// part of the sky; else by [`traced_sky`], whose arguments it takes.
pub fn sky(guide: &Guide, sky: &Sky, key: Key, effort: impl Into<Effort>) -> Throughput {
    let closed = closed(guide).filter(|_| sky.horizon().is_none());
    let Some((aspect, reflectance, collector_transmittance)) = closed else {
        return traced_sky(guide, sky, key, effort);
    };
    let moments = SkyMoments::new(sky);
    let area = guide.projected_area_m2(-DVec3::Z);
    let passed = by_channel(reflectance, |reflectance| moments.through_straight(aspect, reflectance));
    let arriving = Spectrum::<3>(passed) * Spectrum::from_rgb(collector_transmittance);
    Throughput::exact(area * moments.horizontal_illuminance_lux(), area * arriving.luminance())
}

/// Traces the throughput of the light of a sky by importance sampling of directions; zero if no light can enter.
pub fn traced_sky(guide: &Guide, sky: &Sky, key: Key, effort: impl Into<Effort>) -> Throughput {
    let Some(sampler) = SkySampler::new(sky, |toward| guide.projected_area_m2(-toward)) else {
        return Throughput::nothing();
    };
    let sampler = sampler.with_cone(guide.narrow_cone());
    let [found] = replicated(guide, key, effort.into(), |[a, b, u, v]| {
        let (toward, density) = sampler.sample([a, b]);
        Aim { point: [u, v], toward, weights: [sky.luminance(toward) / density] }
    });
    found
}

/// Computes the transmission of collector and guide under a uniform sky: in closed form, with a standard error of 0, through a straight
/// guide under a thin collector whose mirror reflects alike at all angles; else by [`traced_sky`].
///
/// Through a black pipe 100 diameters long, light from the sky reaches the lower end only directly, by the form factor 1 / (4 100^2) to
/// first order, which no ray out of ten thousand finds:
///
/// ```
/// use skyduct_physics::guide::performance::uniform_sky;
/// use skyduct_physics::guide::{Guide, StraightGuide};
/// use skyduct_physics::optics::Mirror;
/// use skyduct_physics::sampling::Key;
///
/// let (reflectance, collector_transmittance) = (Mirror::Constant([0.0; 3]), [1.0; 3]);
/// let pipe = Guide::Straight(StraightGuide { radius: 0.1, length: 20.0, reflectance, collector_transmittance });
/// assert!((uniform_sky(&pipe, Key::new(0), 16).value / 2.499_875e-5 - 1.0).abs() < 1e-6);
/// ```
pub fn uniform_sky(guide: &Guide, key: Key, effort: impl Into<Effort>) -> Transmission {
    let Some((aspect, reflectance, collector_transmittance)) = closed(guide) else {
        let distribution = SkyDistribution::new(CieType::UNIFORM, DVec3::Z);
        let uniform = Sky::new(distribution, 1.0);
        return traced_sky(guide, &uniform, key, effort).transmission();
    };
    let of = |reflectance: f64| uniform_sky_transmission(aspect, reflectance);
    let passed = Spectrum::<3>(by_channel(reflectance, of)) * Spectrum::from_rgb(collector_transmittance);
    Transmission { value: passed.luminance(), standard_error: 0.0 }
}

/// Computes the value of [`uniform_sky`], whose arguments it takes, with a relative error of 1e-5 where there is a closed form: for
/// searches, which need many evaluations.
pub fn nearly_uniform_sky(guide: &Guide, key: Key, effort: impl Into<Effort>) -> f64 {
    let Some((aspect, reflectance, collector_transmittance)) = closed(guide) else {
        return uniform_sky(guide, key, effort).value;
    };
    let of = |reflectance: f64| nearly_uniform_sky_transmission(aspect, reflectance);
    (Spectrum::<3>(by_channel(reflectance, of)) * Spectrum::from_rgb(collector_transmittance)).luminance()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::guide::test_pipes::{RADIUS, cie_sky, straight};
    use crate::guide::transmittance::sky_exitance;
    use crate::sky::direction;

    /// Compares traced beams with the exact series, within 4 standard errors.
    #[test]
    fn beams_agree_with_the_exact_series() {
        for (altitude_deg, reflectance) in [(15.0f64, 0.98), (35.0, 0.95), (60.0, 0.98), (85.0, 0.9)] {
            let altitude = altitude_deg.to_radians();
            let through = traced_beam(&straight(1.0, reflectance), direction(altitude, 0.4), Key::new(3), 512);
            let traced = through.transmission();
            let exact = beam_transmission(1.0 / (2.0 * RADIUS), 1.0 / altitude.tan(), reflectance);
            assert!((traced.value - exact).abs() < 4.0 * traced.standard_error, "{altitude_deg}: {traced:?} {exact}");
            assert!(traced.standard_error < 2e-3);
            let area = PI * RADIUS * RADIUS * altitude.sin();
            assert!((through.entering().mean / area - 1.0).abs() < 1e-12);
        }
    }

    /// Compares the direct integral with the quadrature of the exact series.
    #[test]
    fn skies_agree_with_quadrature() {
        let guide = straight(1.0, 0.98);
        for number in [1, 5, 12] {
            let sky_light = cie_sky(number);
            let through = traced_sky(&guide, &sky_light, Key::new(5), 4096);
            let exact = sky_exitance(&sky_light, 1.0 / (2.0 * RADIUS), 0.98);
            let arriving = through.arriving();
            let per_area = arriving.mean / (PI * RADIUS * RADIUS);
            let error = arriving.standard_error() / (PI * RADIUS * RADIUS);
            assert!((per_area - exact).abs() < 4.0 * error, "type {number}: {per_area} +- {error}, {exact}");
        }
    }

    /// Checks very long pipes under a uniform sky, where nearly all light is lost: only rays near the axis count, for which cos(theta) is
    /// 1, so that T = (3/4) / a^2 integral 2 x g(x) dx with the aspect ratio a and g(x) = R^N (1 - (1-R)(x-N)), N = floor(x), up to a
    /// relative error of 1 / a^2 (the integral of Swift and Smith, exchanged with that over the sky).
    #[test]
    fn uniform_skies_through_long_and_dull_pipes() {
        for (aspect, reflectance) in [(100.0, 0.0), (1000.0, 0.0), (10_000.0, 0.5), (10_000.0, 0.9)] {
            let loss: f64 = 1.0 - reflectance;
            let powers = |n: i32| f64::powi(reflectance, n);
            let moment: f64 =
                (0..2000).map(|n| powers(n) * (2.0 * f64::from(n) * (1.0 - 0.5 * loss) + 1.0 - 2.0 / 3.0 * loss)).sum();
            let expected = 0.75 * moment / (aspect * aspect);
            let Transmission { value, standard_error } =
                uniform_sky(&straight(2.0 * RADIUS * aspect, reflectance), Key::new(1), 2048);
            // 1 / a^2, times twice the mean square of x: at most 1 without reflections, and 6 / ln(R)^2 by many
            let tolerance = 1e-6 + 2.0 * (1.0 + 6.0 / reflectance.ln().powi(2)) / (aspect * aspect);
            assert!((value / expected - 1.0).abs() < tolerance, "{aspect} {reflectance}: {value} {expected}");
            assert_eq!(standard_error, 0.0);
        }
    }

    /// Compares the closed form for coloured mirrors and collectors with traced rays, within 4 standard errors.
    #[test]
    fn uniform_skies_in_colours_agree_with_traced_rays() {
        let reflectance = Mirror::Constant([0.98, 0.95, 0.9]);
        let pipe = Guide::Straight(StraightGuide {
            radius: RADIUS,
            length: 1.0,
            reflectance,
            collector_transmittance: [0.9, 0.8, 0.7],
        });
        let traced = traced_sky(&pipe, &cie_sky(5), Key::new(7), 4096).transmission();
        let exact = uniform_sky(&pipe, Key::new(7), 4096).value;
        assert!((traced.value - exact).abs() < 4.0 * traced.standard_error, "{traced:?} {exact}");
        assert!(traced.standard_error < 2e-3);
    }

    /// Compares closed forms of skies through coloured pipes with rays, flux by flux, within 4 standard errors.
    #[test]
    fn skies_in_closed_form_agree_with_rays() {
        let reflectance = Mirror::Constant([0.98, 0.95, 0.9]);
        let collector_transmittance = [0.9, 0.8, 0.7];
        let pipe = Guide::Straight(StraightGuide { radius: RADIUS, length: 1.0, reflectance, collector_transmittance });
        for number in [1, 5, 9, 12, 15, 16] {
            let light = cie_sky(number);
            let (exact, traced) = (sky(&pipe, &light, Key::new(0), 1), traced_sky(&pipe, &light, Key::new(7), 4096));
            for (exact, traced) in [(exact.entering(), traced.entering()), (exact.arriving(), traced.arriving())] {
                let tolerance = 4.0 * traced.standard_error() + 1e-5 * exact.mean;
                assert!((exact.mean - traced.mean).abs() < tolerance, "type {number}: {exact:?} {traced:?}");
            }
            assert_eq!(exact.transmission().standard_error, 0.0);
        }
    }
}
