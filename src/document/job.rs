//! The whole job document.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::method::MethodDocument;
use super::outputs::{GridDocument, ViewDocument};
use super::room::RoomDocument;
use super::schema::EffectSwitches;
use super::sky::{LocationDocument, SkyDocument};
use super::tube::TubeDocument;
use crate::estimate::StopRule;
use crate::plan::effects::{EffectKind, EffectRequest, EffectRequests};

/// A job: what is simulated, what is asked of it and when it stops.
///
/// SI units, written into the names. Right-handed room frame: x = east, y = north, z = up. Azimuth clockwise from
/// north, altitude above the horizon. Fields that do not stand here are refused.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct JobDocument {
    /// Free text, at most 1000 characters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 1000)]
    pub name: Option<String>,
    /// Where on Earth; together with `time`, or else `sky.sun_position`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub location: Option<LocationDocument>,
    /// RFC 3339 with an offset, years -2000..6000.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = "2011-09-15T15:00:00+02:00", format = DateTime)]
    pub time: Option<String>,
    /// Required unless `tubes` is empty.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sky: Option<SkyDocument>,
    pub room: RoomDocument,
    /// Tubular daylight devices, at most 64.
    #[serde(default)]
    #[schema(max_items = 64)]
    pub tubes: Vec<TubeDocument>,
    /// Illuminance grids, at most 64; `grids` and `views` together name at least one output.
    #[serde(default)]
    #[schema(max_items = 64)]
    pub grids: Vec<GridDocument>,
    /// Camera views, at most 64.
    #[serde(default)]
    #[schema(max_items = 64)]
    pub views: Vec<ViewDocument>,
    #[serde(default)]
    pub method: MethodDocument,
    #[serde(default)]
    pub stop: StopDocument,
    /// Effects of the plan by name; those that are absent are `auto`. With `glossy` off, surfaces absorb the light of their
    /// `specular` share.
    #[serde(default)]
    #[schema(value_type = EffectSwitches)]
    pub effects: BTreeMap<String, EffectSwitch>,
    /// Selects the random numbers; equal documents with equal seeds give equal bits.
    #[serde(default)]
    #[schema(maximum = 18_446_744_073_709_551_615u64)]
    pub seed: u64,
}

/// When a job is accurate enough, and its limits; the first one reached ends the job.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct StopDocument {
    /// Relative error of the grids at the asked confidence, 0..1.
    #[schema(exclusive_minimum = 0, maximum = 1)]
    pub relative_error: f64,
    /// The same of the views, over blocks of 8 x 8 pixels.
    #[schema(exclusive_minimum = 0, maximum = 1)]
    pub view_relative_error: f64,
    /// Of the two-sided normal interval.
    #[schema(minimum = 0.5, exclusive_maximum = 1)]
    pub confidence: f64,
    #[schema(minimum = 1, maximum = 1_000_000_000u64)]
    pub max_passes: u64,
    /// Render time in seconds; the pass that runs when they are used up is dropped. A service may allow less (one hour by default).
    #[schema(exclusive_minimum = 0, maximum = 1_000_000_000)]
    pub max_seconds: f64,
}

impl Default for StopDocument {
    fn default() -> Self {
        Self { relative_error: 0.02, view_relative_error: 0.05, confidence: 0.95, max_passes: 4096, max_seconds: 600.0 }
    }
}

/// What is asked of an effect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum EffectSwitch {
    On,
    Off,
    #[default]
    Auto,
}

impl JobDocument {
    pub fn stop_rule(&self) -> StopRule {
        let StopDocument { relative_error, view_relative_error, confidence, max_passes, max_seconds } = self.stop;
        StopRule { relative_error, view_relative_error, confidence, max_passes, max_seconds }
    }

    /// What is asked of the effects; names that are not of an effect are left to the validation.
    pub fn effect_requests(&self) -> EffectRequests {
        let request = |switch: &EffectSwitch| match switch {
            EffectSwitch::On => EffectRequest::On,
            EffectSwitch::Off => EffectRequest::Off,
            EffectSwitch::Auto => EffectRequest::Auto,
        };
        let known =
            self.effects.iter().filter_map(|(name, switch)| Some((EffectKind::from_name(name)?, request(switch))));
        known.collect()
    }
}
