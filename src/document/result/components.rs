//! Components of a grid's illuminance, by source and by tube.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::number::{error, finite, rows, value};
use crate::estimate::{GridEstimate, grid_statistics};
use crate::integrator::components::Component;
use crate::traceable::Source;

/// Illuminance of a grid by source, direct and interreflected; the parts add up to the whole. Parts of sources that give no light
/// are absent.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct GridComponents {
    /// Light of the sky that has not been reflected by surfaces of the room, and that of ground and obstructions outdoors, whether sky or sun
    /// lights them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sky_direct: Option<GridPart>,
    /// Light of the sky that has been reflected by surfaces of the room, and that of ground and obstructions outdoors, whether sky or sun
    /// lights them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sky_interreflected: Option<GridPart>,
    /// Light of the sun that has not been reflected by surfaces of the room.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sun_direct: Option<GridPart>,
    /// Light of the sun that has been reflected by surfaces of the room.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sun_interreflected: Option<GridPart>,
    /// Light of luminaires that has not been reflected by surfaces of the room.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub luminaires_direct: Option<GridPart>,
    /// Light of luminaires that has been reflected by surfaces of the room.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub luminaires_interreflected: Option<GridPart>,
}

/// One component of a grid's illuminance, in rows like the whole.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct GridPart {
    /// Illuminance of each sensor in lux, row by row; null inside solids.
    pub illuminance_lux: Vec<Vec<Option<f64>>>,
    /// Standard errors of `illuminance_lux`; null inside solids, and before the second pass.
    pub standard_error_lux: Vec<Vec<Option<f64>>>,
    /// Mean over the sensors in lux.
    pub mean_lux: f64,
    /// Standard error of the mean in lux.
    pub mean_lux_standard_error: Option<f64>,
}

impl GridComponents {
    /// Returns the parts by source, and by tube the daylight that enters through each tube's collector. `parts` are those of
    /// `estimate`, which has `columns` sensors in a row.
    pub fn new(parts: &[Component], estimate: &GridEstimate, columns: usize) -> (Self, Vec<GridPart>) {
        let (mut components, mut by_tube) = (Self::default(), Vec::new());
        // in the dark the estimate has no components, and every part is exactly zero
        let dark = GridEstimate {
            free: estimate.free.clone(),
            area: estimate.area.clone(),
            ..GridEstimate::empty(estimate.sensors.len())
        };
        for (index, part) in parts.iter().enumerate() {
            let found = estimate
                .companions
                .get(index)
                .map_or_else(|| GridPart::of(&dark, columns), |part| GridPart::of(part, columns));
            let component = match part {
                Component::Direct(Source::Sky) => &mut components.sky_direct,
                Component::Interreflected(Source::Sky) => &mut components.sky_interreflected,
                Component::Direct(Source::Sun) => &mut components.sun_direct,
                Component::Interreflected(Source::Sun) => &mut components.sun_interreflected,
                Component::Direct(Source::Luminaires) => &mut components.luminaires_direct,
                Component::Interreflected(Source::Luminaires) => &mut components.luminaires_interreflected,
                Component::OfTube(_) => {
                    by_tube.push(found);
                    continue;
                }
            };
            *component = Some(found);
        }
        (components, by_tube)
    }

    /// Returns the components that are present, with their names in JSON.
    pub fn named(&self) -> impl Iterator<Item = (&'static str, &GridPart)> {
        let all = [
            ("sky_direct", &self.sky_direct),
            ("sky_interreflected", &self.sky_interreflected),
            ("sun_direct", &self.sun_direct),
            ("sun_interreflected", &self.sun_interreflected),
            ("luminaires_direct", &self.luminaires_direct),
            ("luminaires_interreflected", &self.luminaires_interreflected),
        ];
        all.into_iter().filter_map(|(name, part)| Some((name, part.as_ref()?)))
    }
}

impl GridPart {
    fn of(estimate: &GridEstimate, columns: usize) -> Self {
        let sensors = 0..estimate.sensors.len();
        let values: Vec<Option<f64>> = sensors.clone().map(|sensor| value(estimate, sensor)).collect();
        let is_dark = estimate.sensors.iter().all(|sensor| sensor.count == 0.0);
        let exact = |sensor| estimate.has_value(sensor).then_some(0.0);
        let error = |sensor| if is_dark { exact(sensor) } else { error(estimate, sensor) };
        let errors: Vec<Option<f64>> = sensors.map(error).collect();
        let mean = grid_statistics::mean(estimate);
        Self {
            illuminance_lux: rows(&values, columns),
            standard_error_lux: rows(&errors, columns),
            mean_lux: mean.value,
            mean_lux_standard_error: if is_dark { Some(0.0) } else { finite(mean.standard_error) },
        }
    }
}
