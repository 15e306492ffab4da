//! The whole job document: reading, and the checks that concern several of its parts.

use std::ops::Deref;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::ToSchema;

use super::annual::AnnualDocument;
use super::effects::{self, EffectSwitches, Effects, check_effects};
use super::errors::{Checks, DocumentErrors};
use super::file_source::FileSource;
use super::hbjson;
use super::limits::JOB_NAME;
use super::method::MethodDocument;
use super::outputs::{GridDocument, ViewDocument, check_outputs};
use super::read::{json, shape};
use super::room::RoomDocument;
use super::room::check::check_room;
use super::room::openings::{boxes_cover_no_opening, luminaires_cover_no_opening};
use super::sky::check::{check_location, check_sky, check_time};
use super::sky::{LocationDocument, SkyDocument};
use super::stop::StopDocument;
use super::surroundings::SurroundingsDocument;
use super::tube::TubeDocument;
use super::tube::check::check_tubes;
use super::tube::crossing::check_crossings;
use super::tube::opening::check_openings;
use crate::estimate::StopRule;
use crate::plan::effects::EffectRequests;

/// A job: the scene, the outputs, the method, and the accuracy and limits at which it ends.
///
/// SI units, written into the names. Right-handed room frame: x = east, y = north, z = up. Azimuth clockwise from north, altitude
/// above the horizon. Unknown fields are refused.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct JobDocument {
    /// Free text, at most 1000 characters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Location on Earth; together with `time` it gives the sun's position, in place of `sky.sun_position`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub location: Option<LocationDocument>,
    /// Time in RFC 3339 with an offset, years -500..2999; given together with `location`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = "2011-09-15T15:00:00+02:00", format = DateTime)]
    pub time: Option<String>,
    /// Year of daylight by a weather file, in place of `sky` and `time`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub annual: Option<AnnualDocument>,
    /// Sky and sun; required unless `tubes` is empty or `annual` is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sky: Option<SkyDocument>,
    /// Horizon and ground around the building; by default there is no horizon, and the ground is black.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surroundings: Option<SurroundingsDocument>,
    /// The room, its surfaces, objects and luminaires.
    pub room: RoomDocument,
    /// Tubular daylight devices, at most 1024.
    #[serde(default)]
    pub tubes: Vec<TubeDocument>,
    /// Illuminance grids, at most 64; `grids`, `views` and `surfaces` together must name at least one output.
    #[serde(default)]
    pub grids: Vec<GridDocument>,
    /// Camera views, at most 64.
    #[serde(default)]
    pub views: Vec<ViewDocument>,
    /// Computes also the light on about 1000 patches of the faces of the room (`surfaces.json`), and gives a model of the room in the colours
    /// of their illuminance (`scene.glb`). For `stop`, the patches are one more grid.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub surfaces: bool,
    /// Method of the computation: `auto`, the name of a method, or an object with a `kind` and the method's settings.
    #[serde(default)]
    pub method: MethodDocument,
    /// Accuracy and limits at which the job ends.
    #[serde(default)]
    pub stop: StopDocument,
    /// Switches of the plan's effects by name; absent ones are `auto`. With `glossy` off, surfaces absorb the light that their
    /// `specular` part would reflect.
    #[serde(default)]
    #[schema(value_type = EffectSwitches)]
    pub effects: Effects,
    /// Computes the grids by a second, independent method, too, and reports whether the two agree.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub cross_check: bool,
    /// Seed of the random numbers; equal documents with equal seeds give bitwise equal results.
    #[serde(default)]
    #[schema(maximum = 18_446_744_073_709_551_615u64)]
    pub seed: u64,
}

/// A job document that was read and checked; made only by [`JobDocument::parse`] and [`JobDocument::from_value`].
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(transparent)]
pub struct ValidJob {
    document: JobDocument,
    /// A sentence for everything that was changed or left out of the model that gives the room.
    #[serde(skip)]
    notes_on_model: Vec<String>,
}

impl ValidJob {
    /// Lists what was changed or left out of the model that gives the room, if one does.
    pub fn notes_on_model(&self) -> &[String] {
        &self.notes_on_model
    }
}

impl Deref for ValidJob {
    type Target = JobDocument;

    fn deref(&self) -> &JobDocument {
        &self.document
    }
}

impl JobDocument {
    /// Parses and checks JSON text (UTF-8 or UTF-16), and fills in the defaults.
    ///
    /// Errors report every fault: of the text (with line and column), of its structure, and of the values.
    pub fn parse(text: &[u8]) -> Result<ValidJob, DocumentErrors> {
        Self::from_value(json::value(text).map_err(|error| DocumentErrors(vec![error]))?)
    }

    /// Checks a document that was read by [`json::value`], and fills in the defaults.
    ///
    /// Errors report every fault of its structure and its values.
    pub fn from_value(value: Value) -> Result<ValidJob, DocumentErrors> {
        Self::with_model(value, None)
    }

    /// Checks a document as [`Self::from_value`] does, whose room may be a model that `files` have.
    pub fn from_files(value: Value, files: &dyn FileSource) -> Result<ValidJob, DocumentErrors> {
        Self::with_model(value, Some(files))
    }

    fn with_model(mut value: Value, files: Option<&dyn FileSource>) -> Result<ValidJob, DocumentErrors> {
        let mut checks = Checks::default();
        let model = hbjson::expand(&mut value, files, &mut checks);
        let document = Self::read(value, &mut checks);
        if let Some(model) = &model {
            checks.errors.iter_mut().for_each(|error| error.pointer = model.pointer(&error.pointer));
        }
        match document.filter(|_| checks.errors.is_empty()) {
            Some(document) => Ok(ValidJob { document, notes_on_model: model.map_or(Vec::new(), |model| model.notes) }),
            None => Err(DocumentErrors(checks.errors)),
        }
    }

    /// Reads a document without a model, and adds its faults; `None` if it cannot be read. Values are not checked if the room is at fault.
    fn read(value: Value, checks: &mut Checks) -> Option<Self> {
        let has_room = checks.errors.is_empty();
        let (document, made_up) = shape::read::<Self>(value, checks)?;
        if !has_room {
            return None;
        }
        let mut of_values = Checks::default();
        document.check(!made_up.has_room(), &mut of_values);
        checks.errors.extend(of_values.errors.into_iter().filter(|error| !made_up.concerns(error)));
        if checks.errors.is_empty()
            && let Some(enclosure) = document.room.enclosure(checks)
        {
            // tubes that are refused or made up cannot be compared
            check_crossings(&document.tubes, &enclosure, checks);
        }
        Some(document)
    }

    /// Returns the rule that ends the job.
    pub fn stop_rule(&self) -> StopRule {
        self.stop.rule()
    }

    /// Returns the document's requests for the effects.
    pub fn effect_requests(&self) -> EffectRequests {
        effects::requests(&self.effects)
    }

    /// Adds all faults of the values to `checks`: first those of each part, then those that concern several parts. Nothing is compared with
    /// a room that stands in for the document's own.
    fn check(&self, is_own_room: bool, checks: &mut Checks) {
        if self.name.as_ref().is_some_and(|name| name.chars().count() > *JOB_NAME.end()) {
            checks.refuse("/name", format!("must have at most {} characters", JOB_NAME.end()));
        }
        if let Some(location) = &self.location {
            check_location(location, checks);
        }
        if let Some(time) = &self.time {
            check_time(time, checks);
        }
        if let Some(sky) = &self.sky {
            check_sky(sky, checks);
        }
        if let Some(surroundings) = &self.surroundings {
            surroundings.check(checks);
        }
        let room = check_room(&self.room, is_own_room, checks);
        let judged = check_tubes(&self.tubes, checks);
        if self.grids.is_empty() && self.views.is_empty() && !self.surfaces {
            checks.refuse("/grids", "`grids`, `views` or `surfaces` must name at least one output");
        }
        check_outputs(&self.grids, &self.views, room.enclosure.as_ref(), checks);
        self.method.check(checks);
        self.stop.check(checks);
        check_effects(&self.effects, checks);

        if let Some(annual) = &self.annual {
            annual.check(checks);
            check_beside_year(self, checks);
        }
        self.check_light(checks);
        self.check_sun(checks);
        if let Some(enclosure) = room.enclosure.as_ref().filter(|_| judged) {
            let openings = check_openings(&self.tubes, &self.room, enclosure, checks);
            boxes_cover_no_opening(&self.room, &openings, checks);
            luminaires_cover_no_opening(&room.luminaires, &openings, checks);
        }
        let grids: Vec<GridDocument> = match &room.enclosure {
            Some(enclosure) => self.grids.iter().map(|grid| grid.with_counts(enclosure)).collect(),
            None => self.grids.clone(),
        };
        self.method.check_outputs(&grids, &self.views, checks);
    }

    /// Checks that there is a source of light, and that tubes have a sky and a closed ceiling.
    fn check_light(&self, checks: &mut Checks) {
        if self.tubes.is_empty() {
            if self.room.luminaires.is_empty() {
                checks.refuse("/tubes", "at least one tube or luminaire is needed: without them there is no light");
            }
            return;
        }
        if self.sky.is_none() && self.annual.is_none() {
            checks.refuse("/sky", "required unless `tubes` is empty or `annual` is given");
        }
        if self.room.surfaces.ceiling.open {
            checks.refuse(
                "/room/surfaces/ceiling/open",
                "must be false, because the openings of `tubes` need a closed ceiling",
            );
        }
    }

    /// Checks that the sun's position is given exactly once, by the sky, or by location and time, or not at all where it is not needed.
    fn check_sun(&self, checks: &mut Checks) {
        let Some(sky) = &self.sky else { return };
        match (sky.sun_position, &self.location, &self.time) {
            (Some(_), None, None) | (None, Some(_), Some(_)) => {}
            (None, ..) if !sky.needs_sun() => {}
            (Some(_), _, _) => {
                let detail = "must be left out if `location` or `time` is given: the sun's position is either this one \
                              or follows from `location` and `time`";
                checks.refuse("/sky/sun_position", detail);
            }
            (None, None, None) => {
                checks.refuse("/sky/sun_position", "required unless `location` and `time` are given");
            }
            (None, None, Some(_)) => {
                checks.refuse("/location", "required with `time`, unless `sky.sun_position` is given");
            }
            (None, Some(_), None) => {
                checks.refuse("/time", "required with `location`, unless `sky.sun_position` is given");
            }
        }
    }
}

/// Checks what a job with a year may have besides: no sky and no time of its own, and the light of tubes alone.
fn check_beside_year(job: &JobDocument, checks: &mut Checks) {
    let by_weather = "must be left out with `annual`: the weather file gives sky and sun";
    if job.sky.is_some() {
        checks.refuse("/sky", by_weather);
    }
    if job.time.is_some() {
        checks.refuse("/time", by_weather);
    }
    if job.tubes.is_empty() {
        checks.refuse("/tubes", "at least one tube is needed with `annual`");
    }
    if job.grids.is_empty() {
        checks.refuse("/grids", "at least one grid is needed with `annual`");
    }
    for (index, grid) in job.grids.iter().enumerate() {
        for (field, is_set) in [("components", grid.components), ("responses", grid.responses)] {
            if is_set {
                checks.refuse(format!("/grids/{index}/{field}"), "must be false with `annual`");
            }
        }
    }
    for (index, other) in job.annual.iter().flat_map(|annual| &annual.other_daylight).enumerate() {
        let others = job.annual.iter().flat_map(|annual| &annual.other_daylight).take(index);
        if job.grids.iter().all(|grid| grid.name != other.grid) {
            checks.refuse(format!("/annual/other_daylight/{index}/grid"), "must be the name of one of `grids`");
        } else if others.into_iter().any(|before| before.grid == other.grid) {
            checks.refuse(format!("/annual/other_daylight/{index}/grid"), "must not have other daylight twice");
        }
    }
    if job.surfaces {
        checks.not_supported("/surfaces", "surfaces of a job with `annual`");
    }
    if !job.views.is_empty() {
        checks.not_supported("/views", "views of a job with `annual`");
    }
    if !job.room.luminaires.is_empty() {
        checks.not_supported("/room/luminaires", "luminaires in a job with `annual`");
    }
}
