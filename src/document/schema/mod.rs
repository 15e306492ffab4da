//! What the derived schemas of the document lack: named shapes of numbers, named variants, rules between fields.
//!
//! A generator of clients reads named components and one property that tells variants apart; it passes over `not`. So
//! variants become components of their own, and rules between fields, which the checks of a document hold to as well, are
//! written as `not`: what must not be.

use std::collections::BTreeMap;

use serde_json::{Value, json};
use utoipa::openapi::RefOr;
use utoipa::openapi::extensions::Extensions;
use utoipa::openapi::schema::{
    AdditionalProperties, AllOf, ArrayBuilder, Discriminator, KnownFormat, Object, ObjectBuilder, OneOf, OneOfBuilder,
    Ref, Schema, SchemaFormat, Type,
};
use utoipa::{PartialSchema, ToSchema};

use crate::document::job::EffectSwitch;
use crate::document::method;
use crate::document::optics::coefficient::Coefficient;
use crate::document::optics::measured::MOST_EXITS;
use crate::document::validate::{
    FARTHEST_M, LONGEST_EDGE_M, MOST_CELLS, MOST_LIGHT, MOST_PIXELS_OF_AN_EDGE, SHORTEST_EDGE_M,
};
use crate::optics::glossy::LEAST_ROUGHNESS;
use crate::plan::effects::EffectKind;

/// The schemas of a description by name.
pub type Schemas = BTreeMap<String, RefOr<Schema>>;

/// Unit-like types that stand for a schema in `#[schema(value_type = ...)]`.
macro_rules! named {
    ($($name:ident: $schema:expr;)*) => {$(
        pub struct $name;

        impl PartialSchema for $name {
            fn schema() -> RefOr<Schema> {
                RefOr::from($schema)
            }
        }

        impl ToSchema for $name {}
    )*};
}

named! {
    Vector: array(3, number(-FARTHEST_M, FARTHEST_M)).description(Some("x, y and z."));
    PlanePoint: array(2, number(0.0, LONGEST_EDGE_M)).description(Some("x and y in metres."));
    RoomSize: array(3, number(SHORTEST_EDGE_M, LONGEST_EDGE_M)).description(Some("Extent along x, y and z in metres."));
    BoxSize: array(3, above_zero(LONGEST_EDGE_M)).description(Some("Extent along x, y and z in metres."));
    CellCounts: array(2, integer(1, MOST_CELLS)).description(Some("Number of cells along x and y."));
    PixelCounts: array(2, integer(1, MOST_PIXELS_OF_AN_EDGE)).description(Some("Width and height in pixels."));
    TableAngle: number(0.0, 90.0).description(Some("In degrees from the normal."));
    ScatteringRow: ArrayBuilder::new()
        .items(number(0.0, 1e9))
        .min_items(Some(2))
        .max_items(Some(MOST_EXITS))
        .description(Some("A value for each angle of exit, in 1/sr."));
    Albedo: one_or_rgb(below_one)
        .description(Some("A reflectance below 1: one photopic number, or linear Rec.709 `[r, g, b]`."));
    Luminance: one_or_rgb(|| number(0.0, MOST_LIGHT))
        .description(Some("In cd/m2: one photopic number, or linear Rec.709 `[r, g, b]`."));
    EffectSwitches: effect_switches();
}

fn double() -> Option<SchemaFormat> {
    Some(SchemaFormat::KnownFormat(KnownFormat::Double))
}

fn number(lowest: f64, highest: f64) -> ObjectBuilder {
    ObjectBuilder::new().schema_type(Type::Number).format(double()).minimum(Some(lowest)).maximum(Some(highest))
}

fn above_zero(highest: f64) -> ObjectBuilder {
    ObjectBuilder::new().schema_type(Type::Number).format(double()).exclusive_minimum(Some(0.0)).maximum(Some(highest))
}

fn integer(lowest: u32, highest: u32) -> ObjectBuilder {
    ObjectBuilder::new().schema_type(Type::Integer).minimum(Some(lowest)).maximum(Some(highest))
}

fn array(length: usize, item: ObjectBuilder) -> ArrayBuilder {
    ArrayBuilder::new().items(item).min_items(Some(length)).max_items(Some(length))
}

fn one_or_rgb(channel: impl Fn() -> ObjectBuilder) -> OneOfBuilder {
    let rgb = array(3, channel()).description(Some("Linear Rec.709 red, green, blue."));
    OneOfBuilder::new().item(channel().description(Some("The same for all light."))).item(rgb)
}

fn below_one() -> ObjectBuilder {
    ObjectBuilder::new().schema_type(Type::Number).format(double()).minimum(Some(0.0)).exclusive_maximum(Some(1.0))
}

impl PartialSchema for Coefficient {
    fn schema() -> RefOr<Schema> {
        let description = "A reflectance or transmittance, 0..1: one photopic number, or linear Rec.709 `[r, g, b]` with Y = \
                           0.2126 R + 0.7152 G + 0.0722 B. A scene with numbers only is computed in one photopic channel.";
        one_or_rgb(|| number(0.0, 1.0)).description(Some(description)).into()
    }
}

impl ToSchema for Coefficient {}

fn effect_switches() -> ObjectBuilder {
    let description = "Effects of the plan by name; those that are absent are `auto`. With `glossy` off, surfaces absorb \
                       the light of their `specular` share.";
    EffectKind::ALL
        .iter()
        .fold(ObjectBuilder::new(), |object, kind| object.property(kind.name(), EffectSwitch::name_ref()))
        .additional_properties(Some(AdditionalProperties::FreeForm(false)))
        .description(Some(description))
}

impl EffectSwitch {
    fn name_ref() -> Ref {
        Ref::from_schema_name(Self::name())
    }
}

/// Completes the derived schemas of the document.
pub fn complete(schemas: &mut Schemas) {
    method::complete_schema(schemas);
    for (parent, tag, suffix, closed) in [
        ("ObjectDocument", "kind", "Object", true),
        ("CollectorDocument", "kind", "Collector", true),
        ("DiffuserDocument", "kind", "Diffuser", true),
        ("PartDocument", "role", "Part", true),
        // of results, which may gain fields
        ("BeamSource", "kind", "BeamSource", false),
        ("RefractionProvenance", "kind", "Refraction", false),
    ] {
        name_variants(schemas, parent, tag, suffix, closed);
    }
    diffuser_parts(schemas);
    // its variant has all its fields and `kind`
    schemas.remove("MeasuredDocument");
    for (object, rule) in rules() {
        if let Some(RefOr::T(Schema::Object(object))) = schemas.get_mut(object) {
            forbid(&mut object.extensions, rule);
        }
    }
    if let Some(roughness) = property(schemas, "SurfaceDocument", "roughness") {
        forbid(&mut roughness.extensions, json!({ "exclusiveMinimum": 0, "exclusiveMaximum": LEAST_ROUGHNESS }));
    }
    if let Some(parts) = property(schemas, "MeshTubeDocument", "parts") {
        parts.min_properties = Some(1);
    }
}

/// What must not be, in the words of a schema.
fn forbid(extensions: &mut Option<Extensions>, rule: Value) {
    extensions.get_or_insert_default().insert("not".to_owned(), rule);
}

/// A property of a component, written in place.
fn property<'a>(schemas: &'a mut Schemas, component: &str, name: &str) -> Option<&'a mut Object> {
    let Some(RefOr::T(Schema::Object(object))) = schemas.get_mut(component) else { return None };
    match object.properties.get_mut(name) {
        Some(RefOr::T(Schema::Object(property))) => Some(property),
        _ => None,
    }
}

/// Makes each variant of `parent` a component named by the value of its `tag` and `suffix`, and says what tells them apart.
fn name_variants(schemas: &mut Schemas, parent: &str, tag: &str, suffix: &str, closed: bool) {
    let Some(RefOr::T(Schema::OneOf(mut one_of))) = schemas.remove(parent) else { return };
    let mut discriminator = Discriminator::new(tag);
    let items = std::mem::take(&mut one_of.items);
    for item in items {
        let Some((value, object)) = tagged_object(schemas, item, tag, closed) else { continue };
        let name = camel_case(&value) + suffix;
        let reference = Ref::from_schema_name(&name);
        discriminator.mapping.insert(value, reference.ref_location.clone());
        one_of.items.push(reference.into());
        schemas.insert(name, object);
    }
    one_of.discriminator = Some(discriminator);
    schemas.insert(parent.to_owned(), Schema::OneOf(one_of).into());
}

/// A variant as one object, and the value of its tag.
fn tagged_object(schemas: &Schemas, item: RefOr<Schema>, tag: &str, closed: bool) -> Option<(String, RefOr<Schema>)> {
    let schema = match item {
        RefOr::T(Schema::AllOf(AllOf { items, description, .. })) => merged(schemas, &items, description)?,
        RefOr::T(schema) => schema,
        RefOr::Ref(_) => return None,
    };
    let Schema::Object(mut object) = schema else { return None };
    if closed {
        object.additional_properties = Some(Box::new(AdditionalProperties::FreeForm(false)));
    }
    // the tag is what a reader looks for first
    object.required.sort_by_key(|name| name != tag);
    let Some(RefOr::T(Schema::Object(values))) = object.properties.get(tag) else { return None };
    let value = values.enum_values.as_ref()?.first()?.as_str()?.to_owned();
    Some((value, Schema::Object(object).into()))
}

/// The objects of an `allOf` as one; `None` when one of them is not an object.
fn merged(schemas: &Schemas, items: &[RefOr<Schema>], description: Option<String>) -> Option<Schema> {
    let mut all = Object::default();
    all.description = description;
    for item in items {
        let schema = match item {
            RefOr::T(schema) => schema,
            RefOr::Ref(reference) => match schemas.get(reference.ref_location.rsplit('/').next()?)? {
                RefOr::T(schema) => schema,
                RefOr::Ref(_) => return None,
            },
        };
        let object = match schema {
            Schema::Object(object) => object.clone(),
            // parts of meshes: the diffusers follow as components of their own
            Schema::OneOf(_) => continue,
            _ => return None,
        };
        all.description = all.description.or(object.description);
        all.required.extend(object.required);
        all.properties.extend(object.properties);
    }
    Some(Schema::Object(all))
}

/// Replaces the part of a mesh that is a diffuser by one component for each kind of diffuser, each with its role.
fn diffuser_parts(schemas: &mut Schemas) {
    let Some(RefOr::T(Schema::Object(part))) = schemas.get("DiffuserPart").cloned() else { return };
    let Some(RefOr::T(Schema::OneOf(diffusers))) = schemas.get("DiffuserDocument").cloned() else { return };
    let mut discriminator = Discriminator::new("kind");
    let mut one_of = OneOf { description: part.description.clone(), ..OneOf::default() };
    for (kind, location) in diffusers.discriminator.into_iter().flat_map(|discriminator| discriminator.mapping) {
        let diffuser = location.rsplit('/').next().and_then(|name| schemas.get(name));
        let Some(RefOr::T(Schema::Object(diffuser))) = diffuser.cloned() else { continue };
        let mut object = diffuser;
        object.required.splice(0..0, part.required.clone());
        object.properties.extend(part.properties.clone());
        let name = camel_case(&kind) + "DiffuserPart";
        let reference = Ref::from_schema_name(&name);
        discriminator.mapping.insert(kind, reference.ref_location.clone());
        one_of.items.push(reference.into());
        schemas.insert(name, Schema::Object(object).into());
    }
    one_of.discriminator = Some(discriminator);
    schemas.insert("DiffuserPart".to_owned(), Schema::OneOf(one_of).into());
}

pub(in crate::document) fn camel_case(snake_case: &str) -> String {
    let capitalised = |word: &str| {
        let mut letters = word.chars();
        letters.next().map_or(String::new(), |first| first.to_ascii_uppercase().to_string() + letters.as_str())
    };
    snake_case.split('_').map(capitalised).collect()
}

/// What the checks of a document refuse about several fields at once, where a schema can say it: component, rule.
fn rules() -> Vec<(&'static str, Value)> {
    let sun_position = |kind: &str| json!({ "properties": { "sun_position": { "type": kind } } });
    let with_sky = |rule: Value| json!({ "required": ["sky"], "properties": { "sky": { "allOf": [{ "type": "object" }, rule] } } });
    let tubes = || json!({ "required": ["tubes"], "properties": { "tubes": { "minItems": 1 } } });
    let light_tracing = json!({ "anyOf": [
        { "const": "light_tracing" },
        { "type": "object", "required": ["kind"], "properties": { "kind": { "const": "light_tracing" } } },
    ] });
    let open_ceiling = json!({ "properties": { "surfaces": { "required": ["ceiling"], "properties": { "ceiling": {
        "required": ["open"], "properties": { "open": { "const": true } } } } } }, "required": ["surfaces"] });
    let job = [
        // at least one output
        json!({ "properties": { "grids": { "maxItems": 0 }, "views": { "maxItems": 0 } } }),
        // at least one source of light
        json!({ "properties": {
            "tubes": { "maxItems": 0 }, "room": { "properties": { "luminaires": { "maxItems": 0 } } } } }),
        // tubes need a sky
        all([tubes(), absent("sky")]),
        // tubes need a closed ceiling
        all([tubes(), json!({ "properties": { "room": open_ceiling } })]),
        // the sun stands where the sky says, or where place and time say, and not both
        all([
            with_sky(all([json!({ "required": ["sun_position"] }), sun_position("object")])),
            any([given("location"), given("time")]),
        ]),
        all([with_sky(sun_position("null")), any([absent("location"), absent("time")])]),
        // light tracing makes no pictures
        json!({ "required": ["method", "views"],
                "properties": { "method": light_tracing, "views": { "minItems": 1 } } }),
    ];
    let levels = ["zenith_luminance_cd_m2", "diffuse_horizontal_illuminance_lux", "dv_ev", "luminous_turbidity"];
    let mut sky = vec![
        all([given("cie_type"), given("preset")]),
        all([absent("cie_type"), absent("preset")]),
        all([
            given("luminous_turbidity"),
            given("cie_type"),
            json!({ "properties": { "cie_type": {
            "not": { "minimum": 7, "maximum": 15 } } } }),
        ]),
        all([given("preset"), any([given("dv_ev"), given("luminous_turbidity")])]),
    ];
    for (index, one) in levels.iter().enumerate() {
        sky.extend(levels[..index].iter().map(|other| all([given(one), given(other)])));
    }
    let open = json!({ "required": ["open"], "properties": { "open": { "const": true } } });
    let surface = [
        all([open, given("reflectance")]),
        all([json!({ "properties": { "open": { "const": false } } }), absent("reflectance")]),
    ];
    vec![("JobDocument", any(job)), ("SkyDocument", any(sky)), ("SurfaceDocument", any(surface))]
}

fn given(field: &str) -> Value {
    json!({ "required": [field], "properties": { field: { "not": { "type": "null" } } } })
}

fn absent(field: &str) -> Value {
    json!({ "properties": { field: { "type": "null" } } })
}

fn all(rules: impl IntoIterator<Item = Value>) -> Value {
    json!({ "allOf": rules.into_iter().collect::<Vec<_>>() })
}

fn any(rules: impl IntoIterator<Item = Value>) -> Value {
    json!({ "anyOf": rules.into_iter().collect::<Vec<_>>() })
}
