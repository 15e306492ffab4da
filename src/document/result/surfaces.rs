//! Light on the surfaces of a room as JSON.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::number::{coverage_factor_of_sensors, error, value};
use crate::estimate::GridEstimate;
use crate::optics::Spectrum;
use crate::scene::Enclosure;
use crate::scene::surface_patches::SurfacePatch;

/// Light on the faces of the room, in patches, if the document asks for `surfaces`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SurfacesResult {
    /// Number of standard errors that are half an interval of 95 %; null before the second pass.
    pub coverage_factor: Option<f64>,
    /// Faces of the room, in the order of their numbers; objects, partitions and tubes are not among them.
    pub faces: Vec<FaceResult>,
}

/// Light on a face.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FaceResult {
    /// Name of the face: `floor`, `ceiling`, `wall_north`, or as the document names it.
    pub name: String,
    /// Unit vector into the room.
    pub normal: [f64; 3],
    /// Area in m2.
    pub area_m2: f64,
    /// Diffuse reflectance, photopic, 0..1; 0 where the face is open.
    pub reflectance: f64,
    /// Mean illuminance in lux by area; null where no patch has a value.
    pub mean_lux: Option<f64>,
    /// Patches of the face, about squares.
    pub patches: Vec<PatchResult>,
}

/// Light on a patch of a face, computed at its centre.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PatchResult {
    /// Centre in metres: that of its largest polygon.
    pub centre_m: [f64; 3],
    /// Area in m2.
    pub area_m2: f64,
    /// Convex polygons that make up the patch: corners in metres, counter-clockwise seen from inside the room.
    pub polygons_m: Vec<Vec<[f64; 3]>>,
    /// Illuminance in lux; null where an object stands on the face.
    pub illuminance_lux: Option<f64>,
    /// Standard error of the illuminance in lux; null before the second pass.
    pub standard_error_lux: Option<f64>,
    /// Luminance in cd/m2 of the light that the face scatters evenly (illuminance times reflectance over pi); what it mirrors is not in it.
    pub luminance_cd_m2: Option<f64>,
    /// Standard error of the luminance in cd/m2.
    pub luminance_standard_error_cd_m2: Option<f64>,
}

impl SurfacesResult {
    /// Returns the light on the patches of a room from the estimate of a grid that has one sensor before each patch.
    pub fn new(enclosure: &Enclosure, patches: &[SurfacePatch], estimate: &GridEstimate) -> Self {
        let numbered: Vec<(usize, &SurfacePatch)> = patches.iter().enumerate().collect();
        let of_face = |run: &[(usize, &SurfacePatch)]| {
            let face = &enclosure.faces()[run[0].1.face];
            let reflectance = face.surface.map_or(0.0, |surface| Spectrum::<1>::from_rgb(surface.reflectance).0[0]);
            let lit = || run.iter().filter_map(|(number, patch)| Some((patch.area_m2, value(estimate, *number)?)));
            let area: f64 = lit().map(|(area, _)| area).sum();
            let flux: f64 = lit().map(|(area, lux)| area * lux).sum();
            FaceResult {
                name: face.name.clone(),
                normal: face.polygon.normal().to_array(),
                area_m2: face.polygon.area_m2(),
                reflectance,
                mean_lux: (area > 0.0).then(|| flux / area),
                patches: run
                    .iter()
                    .map(|(number, patch)| PatchResult::new(patch, reflectance, estimate, *number))
                    .collect(),
            }
        };
        Self {
            coverage_factor: coverage_factor_of_sensors(estimate),
            faces: numbered.chunk_by(|a, b| a.1.face == b.1.face).map(of_face).collect(),
        }
    }
}

impl PatchResult {
    fn new(patch: &SurfacePatch, reflectance: f64, estimate: &GridEstimate, sensor: usize) -> Self {
        let (lux, standard_error) = (value(estimate, sensor), error(estimate, sensor));
        let luminance = |lux: f64| lux * reflectance / PI;
        Self {
            centre_m: patch.centre.to_array(),
            area_m2: patch.area_m2,
            polygons_m: patch
                .pieces
                .iter()
                .map(|piece| piece.iter().map(|corner| corner.to_array()).collect())
                .collect(),
            illuminance_lux: lux,
            standard_error_lux: standard_error,
            luminance_cd_m2: lux.map(luminance),
            luminance_standard_error_cd_m2: standard_error.map(luminance),
        }
    }
}
