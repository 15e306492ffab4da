//! The method of a job document: a name, or an object with the method's settings.
//!
//! Each method has a file with its settings, their defaults and bounds, and one line in [`METHODS`] and in [`settings_json`].

mod auto;
mod bidirectional;
mod bounds;
mod holigilm;
mod jenkins;
mod lamp_responses;
mod light_tracing;
mod path_tracing;
mod photon_mapping;
mod placed_vertices;
mod ppm;
mod radius;
mod settings;
mod sppm;
mod two_stage;

use std::fmt;
use std::sync::Arc;

use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, Error, MapAccess, Visitor};
use serde::ser::Serializer;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{
    AdditionalProperties, Discriminator, ObjectBuilder, OneOfBuilder, Ref, Schema, SchemaType, Type,
};
use utoipa::{PartialSchema, ToSchema};

use crate::document::errors::{Checks, FieldError};
use crate::document::limits::Limit;
use crate::document::outputs::{GridDocument, ViewDocument};
use crate::document::read::fault::Fault;
use crate::document::read::tagged::{Fields, Reader, read_kind, unknown_kind};
use crate::document::schema::variants::{Schemas, camel_case};
use crate::integrator::Method;
use crate::integrator::method::{Refusal, RefusalCode};
use crate::plan::MethodRequest;
use settings::{AnySettings, MethodSettings};

pub use radius::RadiusKind;

/// Registry of all methods, one line each, in the order in which they are offered.
const METHODS: &[Entry] = &[
    Entry::of::<auto::AutoMethod>(),
    Entry::of::<path_tracing::PathTracingMethod>(),
    Entry::of::<bidirectional::BidirectionalPathTracingMethod>(),
    Entry::of::<photon_mapping::PhotonMappingMethod>(),
    Entry::of::<ppm::PpmMethod>(),
    Entry::of::<sppm::SppmMethod>(),
    Entry::of::<light_tracing::LightTracingMethod>(),
    Entry::of::<two_stage::TwoStageMethod>(),
    Entry::of::<holigilm::HoligilmMethod>(),
    Entry::of::<jenkins::JenkinsMethod>(),
];

/// Registry of former methods that others have replaced: documents may still name them, but they are not offered.
const FORMER: &[Entry] =
    &[Entry::of::<placed_vertices::PlacedVerticesMethod>(), Entry::of::<lamp_responses::LampResponsesMethod>()];

/// Entry of the registry: functions for a method that is given by its name.
struct Entry {
    name: &'static str,
    read: Reader<Arc<dyn AnySettings>>,
    by_default: fn() -> Arc<dyn AnySettings>,
    schema: fn() -> RefOr<Schema>,
    limits: fn() -> Vec<(&'static str, Limit)>,
}

impl Entry {
    const fn of<S: MethodSettings>() -> Self {
        Self {
            name: S::NAME,
            read: |fields, of| Ok(Arc::new(fields.read::<S>(of)?)),
            by_default: || Arc::new(S::default()),
            schema: S::schema,
            limits: || S::default().numbers().into_iter().map(|it| (it.name, Limit::Number(it.range))).collect(),
        }
    }

    /// Returns the name of the method's component in the description of the interface.
    fn component(&self) -> String {
        camel_case(self.name) + "Method"
    }
}

fn entry(name: &str) -> Option<&'static Entry> {
    METHODS.iter().chain(FORMER).find(|entry| entry.name == name)
}

/// Method of a job: its name, or an object of `kind` and the method's settings.
#[derive(Clone)]
pub struct MethodDocument {
    settings: Arc<dyn AnySettings>,
    /// True if the document gives the name alone.
    by_name: bool,
}

impl Default for MethodDocument {
    fn default() -> Self {
        Self { settings: Arc::new(auto::AutoMethod {}), by_name: true }
    }
}

impl fmt::Debug for MethodDocument {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        self.request().fmt(formatter)
    }
}

impl PartialEq for MethodDocument {
    fn eq(&self, other: &Self) -> bool {
        self.by_name == other.by_name && self.request() == other.request()
    }
}

impl MethodDocument {
    /// Returns the method with its settings, with the defaults filled in.
    pub fn request(&self) -> MethodRequest {
        self.settings.request()
    }

    /// Returns every method that is offered, with this document's settings for its own method and default settings for the
    /// others.
    pub fn offered(&self) -> Vec<Method> {
        let own = |entry: &Entry| {
            if entry.name == self.settings.name() { self.request() } else { (entry.by_default)().request() }
        };
        let of = |entry: &Entry| match own(entry) {
            MethodRequest::Method(method) => Some(method),
            MethodRequest::Auto | MethodRequest::InPlaceOf(..) => None,
        };
        METHODS.iter().filter_map(of).collect()
    }

    /// Adds faults for settings that are out of bounds.
    pub(crate) fn check(&self, checks: &mut Checks) {
        self.settings.check(checks);
    }

    /// Adds faults for outputs that the method cannot compute, or that are too many for it.
    pub(crate) fn check_outputs(&self, grids: &[GridDocument], views: &[ViewDocument], checks: &mut Checks) {
        if !views.is_empty() && computes_grids_only(&self.request()) {
            let detail = format!("{} computes grids only: use auto for views", self.settings.name());
            checks.errors.push(FieldError::refused("/method", Refusal::new(RefusalCode::GridsOnly, detail)));
        }
        self.settings.check_outputs(grids, views, checks);
    }
}

/// Returns a method's settings as results show them.
pub fn settings_json(method: &Method) -> Value {
    let settings: &dyn AnySettings = match method {
        Method::PathTracing(settings) => &path_tracing::PathTracingMethod::from(settings),
        Method::Bidirectional(settings) => &bidirectional::BidirectionalPathTracingMethod::from(settings),
        Method::PhotonMapping(settings) => &photon_mapping::PhotonMappingMethod::from(settings),
        Method::Ppm(settings) => &ppm::PpmMethod::from(settings),
        Method::Sppm(settings) => &sppm::SppmMethod::from(settings),
        Method::LightTracing(settings) => &light_tracing::LightTracingMethod::from(settings),
        Method::TwoStage(settings) => &two_stage::TwoStageMethod::from(settings),
        Method::Holigilm(_) => &holigilm::HoligilmMethod {},
        Method::Jenkins(settings) => &jenkins::JenkinsMethod::from(settings),
    };
    settings.json()
}

impl Serialize for MethodDocument {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let name = self.settings.name();
        if self.by_name {
            return name.serialize(serializer);
        }
        let mut object = json!({ "kind": name });
        if let (Some(object), Value::Object(settings)) = (object.as_object_mut(), self.settings.json()) {
            object.extend(settings.into_iter().filter(|(_, value)| !value.is_null()));
        }
        object.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for MethodDocument {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(MethodVisitor)
    }
}

struct MethodVisitor;

impl<'de> Visitor<'de> for MethodVisitor {
    type Value = MethodDocument;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("the name of a method or an object with its kind and settings")
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<MethodDocument, E> {
        match entry(name) {
            Some(entry) => Ok(MethodDocument { settings: (entry.by_default)(), by_name: true }),
            None => Err(E::custom(unknown_kind(name, names()))),
        }
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<MethodDocument, A::Error> {
        let fields = Fields::deserialize(MapAccessDeserializer::new(map))?;
        let read: Result<_, Fault> =
            read_kind(fields, "kind", "a method", |name| entry(name).map(|it| it.read), names());
        Ok(MethodDocument { settings: read.map_err(A::Error::custom)?, by_name: false })
    }
}

fn computes_grids_only(request: &MethodRequest) -> bool {
    match request {
        MethodRequest::Method(method) | MethodRequest::InPlaceOf(_, method) => !method.described().outputs().views,
        MethodRequest::Auto => false,
    }
}

/// Returns the names of methods that compute grids only.
pub fn grids_only() -> Vec<&'static str> {
    let methods = METHODS.iter().filter(|entry| computes_grids_only(&(entry.by_default)().request()));
    methods.map(|entry| entry.name).collect()
}

/// Returns the names of all methods, in the order in which they are offered.
pub fn names() -> impl Iterator<Item = &'static str> {
    METHODS.iter().map(|entry| entry.name)
}

/// Placeholder type for the schema of the names of all methods.
pub struct MethodKind;

impl PartialSchema for MethodKind {
    fn schema() -> RefOr<Schema> {
        let all = names().chain(FORMER.iter().map(|entry| entry.name));
        let kinds = ObjectBuilder::new().schema_type(Type::String).enum_values(Some(all));
        kinds
            .description(Some(
                "How the light is computed. `placed_vertices` and `lamp_responses` are former names of `two_stage`.",
            ))
            .into()
    }
}

impl ToSchema for MethodKind {}

impl PartialSchema for MethodDocument {
    fn schema() -> RefOr<Schema> {
        OneOfBuilder::new()
            .item(Ref::from_schema_name(MethodKind::name()))
            .item(Ref::from_schema_name(WITH_SETTINGS))
            .description(Some("A method's name, or an object of `kind` and the method's own settings."))
            .into()
    }
}

impl ToSchema for MethodDocument {}

const WITH_SETTINGS: &str = "MethodWithSettings";

/// Adds a component for each method with its settings.
pub fn complete_schema(schemas: &mut Schemas) {
    let mut discriminator = Discriminator::new("kind");
    let mut one_of = OneOfBuilder::new().description(Some("A method and its own settings."));
    for entry in METHODS.iter().chain(FORMER) {
        let RefOr::T(Schema::Object(mut object)) = (entry.schema)() else { continue };
        let kind = ObjectBuilder::new().schema_type(Type::String).enum_values(Some([entry.name]));
        object.required = vec!["kind".to_owned()];
        object.additional_properties = Some(Box::new(AdditionalProperties::FreeForm(false)));
        object.properties.values_mut().for_each(allow_null);
        object.properties.insert("kind".to_owned(), kind.into());
        let reference = Ref::from_schema_name(entry.component());
        discriminator.mapping.insert(entry.name.to_owned(), reference.ref_location.clone());
        one_of = one_of.item(reference);
        schemas.insert(entry.component(), Schema::Object(object).into());
    }
    schemas.insert(WITH_SETTINGS.to_owned(), one_of.discriminator(Some(discriminator)).into());
}

/// Allows a setting to be null, which counts as left out. A setting that the method derives from the scene gets no default.
fn allow_null(setting: &mut RefOr<Schema>) {
    let null = || ObjectBuilder::new().schema_type(Type::Null);
    match setting {
        RefOr::T(Schema::Object(setting)) => {
            setting.default.take_if(|default| default.is_null());
            if let SchemaType::Type(kind) = &setting.schema_type {
                setting.schema_type = SchemaType::from_iter([kind.clone(), Type::Null]);
            }
        }
        RefOr::T(_) => {}
        RefOr::Ref(reference) => *setting = OneOfBuilder::new().item(null()).item(reference.clone()).into(),
    }
}

/// Returns the bounds of all settings: component, setting, bound.
pub fn limits() -> Vec<(String, &'static str, Limit)> {
    let of = |entry: &Entry| {
        let component = entry.component();
        (entry.limits)().into_iter().map(move |(name, limit)| (component.clone(), name, limit))
    };
    METHODS.iter().chain(FORMER).flat_map(of).collect()
}
