//! Reflection and refraction at smooth faces of dielectrics.

use glam::DVec3;

/// Computes the reflectance of a smooth face for light polarised across (s) and along (p) the plane of incidence.
///
/// `cosine` of the angle of incidence in 0..=1; `index_ratio` > 0: refractive index beyond the face over that on the
/// light's side. Fresnel's equations (Born and Wolf 1999, section 1.5.2, (21a) squared); 1 beyond the critical angle and
/// at grazing incidence, exactly 0 at every angle where the index does not change.
///
/// Glass of index 1.5 reflects ((1.5 - 1) / (1.5 + 1))^2 = 4 % at normal incidence:
///
/// ```
/// let [s, p] = skyduct_physics::optics::fresnel::fresnel(1.0, 1.5);
/// assert!((s - 0.04).abs() < 1e-15 && (p - 0.04).abs() < 1e-15);
/// ```
#[inline]
pub fn fresnel(cosine: f64, index_ratio: f64) -> [f64; 2] {
    if index_ratio == 1.0 {
        return [0.0; 2];
    }
    let sine_squared = (1.0 - cosine) * (1.0 + cosine) / (index_ratio * index_ratio);
    if sine_squared >= 1.0 {
        return [1.0; 2];
    }
    let beyond = (1.0 - sine_squared).sqrt();
    let s = (cosine - index_ratio * beyond) / (cosine + index_ratio * beyond);
    let p = (index_ratio * cosine - beyond) / (index_ratio * cosine + beyond);
    [s * s, p * p]
}

/// Computes the transmittance of a plane-parallel pane in air for unpolarised light, all reflections between its faces included.
///
/// Per polarisation (1 - r)^2 a / (1 - r^2 a^2) with the face's reflectance r and a = exp(-`optical_depth` / cos t), t the
/// angle inside (incoherent sum; without absorption (1 - r) / (1 + r)). `optical_depth` = absorption coefficient times
/// thickness, >= 0; `index` >= 1.
///
/// Without absorption a pane transmits 2 n / (n^2 + 1) at normal incidence:
///
/// ```
/// let pane = skyduct_physics::optics::fresnel::slab_transmittance(1.0, 1.5, 0.0);
/// assert!((pane - 3.0 / 3.25).abs() < 1e-15);
/// ```
pub fn slab_transmittance(cosine: f64, index: f64, optical_depth: f64) -> f64 {
    let inside = (1.0 - (1.0 - cosine) * (1.0 + cosine) / (index * index)).max(0.0).sqrt();
    let passes = if optical_depth == 0.0 { 1.0 } else { libm::exp(-optical_depth / inside) };
    let one = |r: f64| {
        if r >= 1.0 { 0.0 } else { (1.0 - r) * (1.0 - r) * passes / ((1.0 - r * passes) * (1.0 + r * passes)) }
    };
    let [s, p] = fresnel(cosine, index);
    0.5 * (one(s) + one(p))
}

/// Computes the unit direction of light beyond a face, by Snell's law, if it arrives along the unit vector `direction`.
///
/// `normal`: unit, on the side that the light comes from; `index_ratio` as in [`fresnel`].
///
/// Beyond the critical angle, where [`fresnel`] lets nothing pass, the result is no unit vector, and lies in the face.
///
/// From 30 degrees in air the sine becomes 1/3 in glass of index 1.5.
///
/// ```
/// use glam::DVec3;
///
/// let (sin, cos) = 30f64.to_radians().sin_cos();
/// let inside = skyduct_physics::optics::fresnel::refract(DVec3::new(sin, 0.0, -cos), DVec3::Z, 1.5);
/// assert!((inside.x - 1.0 / 3.0).abs() < 1e-15);
/// ```
#[inline]
pub fn refract(direction: DVec3, normal: DVec3, index_ratio: f64) -> DVec3 {
    let cosine = -direction.dot(normal);
    let sine_squared = (1.0 - cosine) * (1.0 + cosine) / (index_ratio * index_ratio);
    let beyond = (1.0 - sine_squared).max(0.0).sqrt();
    direction / index_ratio + normal * (cosine / index_ratio - beyond)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn degrees(angle: f64) -> f64 {
        angle.to_radians().cos()
    }

    /// Panes of n = 1.49 as tabulated in docs/physics/tubes.md#thin-covers-and-dielectric-domes, at grazing incidence, and a
    /// pane of the index of air, which transmits everything at any angle.
    #[test]
    fn slabs_of_the_table() {
        let table = [
            (0.0, 0.9254371),
            (30.0, 0.92310654),
            (60.0, 0.85050253),
            (75.0, 0.61993135),
            (85.0, 0.2476394),
            (89.0, 0.05082426),
        ];
        for (angle, truth) in table {
            let slab = slab_transmittance(degrees(angle), 1.49, 0.0);
            assert!((slab - truth).abs() < 6e-8, "{angle}: {slab}");
        }
        assert_eq!(slab_transmittance(0.0, 1.49, 0.0), 0.0);
        for cosine in [0.0, 1e-300, 1e-9, 0.5, 1.0] {
            assert_eq!(slab_transmittance(cosine, 1.0, 0.0), 1.0);
        }
    }

    /// Without reflection, absorption alone is left, by the law of Beer and Lambert.
    #[test]
    fn absorption_follows_the_refracted_path() {
        assert!((slab_transmittance(0.5, 1.0, 0.3) - (-0.6f64).exp()).abs() < 1e-15);
        let cosine_inside = (1.0 - 0.75 / 1.49f64.powi(2)).sqrt();
        let weak = slab_transmittance(0.5, 1.49, 1e-6);
        let loss = 1.0 - weak / slab_transmittance(0.5, 1.49, 0.0);
        // the mean path is a little longer than one crossing: by the light that goes back and forth
        assert!(loss > 1e-6 / cosine_inside && loss < 1.4e-6 / cosine_inside, "{loss}");
    }

    /// A face reflects the same fraction of light from either side, at the angles that refraction joins.
    #[test]
    fn faces_are_reciprocal() {
        for k in 0..90 {
            let angle = f64::from(k).to_radians();
            let inside = (angle.sin() / 1.49).asin();
            let (out, back) = (fresnel(angle.cos(), 1.49), fresnel(inside.cos(), 1.0 / 1.49));
            assert!((out[0] - back[0]).abs() < 1e-12 && (out[1] - back[1]).abs() < 1e-12);
        }
    }

    /// Brewster's angle has no p reflection; total reflection sets in continuously.
    #[test]
    fn special_angles() {
        assert!(fresnel(1.49f64.atan().cos(), 1.49)[1] < 1e-30);
        let critical = (1.0 / 1.49f64).asin();
        assert!((critical.to_degrees() - 42.155_184_250_810).abs() < 1e-10);
        assert_eq!(fresnel((critical + 1e-12).cos(), 1.0 / 1.49), [1.0; 2]);
        let [s, p] = fresnel((critical - 1e-12).cos(), 1.0 / 1.49);
        assert!(s < 1.0 && s > 1.0 - 1e-5 && p < 1.0 && p > 1.0 - 2e-5, "{s} {p}");
        assert_eq!(fresnel(0.0, 1.49), [1.0; 2]);
    }

    #[test]
    fn refraction_obeys_snell() {
        for k in 0..90 {
            let (sin, cos) = f64::from(k).to_radians().sin_cos();
            let out = refract(DVec3::new(sin, 0.0, -cos), DVec3::Z, 1.49);
            assert!((out.x - sin / 1.49).abs() < 1e-15 && (out.length() - 1.0).abs() < 1e-15);
            let same = DVec3::new(sin, 0.0, -cos);
            assert!((refract(same, DVec3::Z, 1.0) - same).length() < 1e-14);
        }
    }
}
