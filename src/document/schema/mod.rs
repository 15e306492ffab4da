//! Completion of the document's derived schemas by bounds, named variants and rules between fields.
//!
//! A generator of clients reads named components and one property that distinguishes variants; it ignores `not`. So variants
//! become components of their own ([`variants`]), and rules between fields are written as `not` ([`rules`]). Bounds come from
//! [`limits`](crate::document::limits), as those of the checks do. [`shapes`] are numbers that many fields share.

pub mod rules;
pub mod shapes;
pub mod variants;

use std::ops::{Bound, RangeInclusive};

use serde_json::{Value, json};
use utoipa::Number;
use utoipa::openapi::RefOr;
use utoipa::openapi::extensions::Extensions;
use utoipa::openapi::schema::{
    AdditionalProperties, Array, Object, ObjectBuilder, OneOfBuilder, Ref, Schema, SchemaType, Type,
};

use crate::document::limits::{FIELDS, Limit, Range};
use crate::document::method;
use crate::document::read::json::SMALLEST;
use crate::optics::glossy::LEAST_ROUGHNESS;
use variants::Schemas;

/// Completes the derived schemas of the document.
pub fn complete(schemas: &mut Schemas) {
    for (parent, tag, suffix, closed) in [
        ("ObjectDocument", "kind", "Object", true),
        ("ScheduleDocument", "kind", "Schedule", true),
        ("DaylightSavingDocument", "kind", "DaylightSaving", true),
        ("ObstructionDocument", "kind", "Obstruction", true),
        ("CeilingDocument", "kind", "Ceiling", true),
        ("CollectorDocument", "kind", "Collector", true),
        ("DiffuserDocument", "kind", "Diffuser", true),
        ("PartDocument", "role", "Part", true),
        // schemas of results stay open, because results may gain fields
        ("BeamSource", "kind", "BeamSource", false),
        ("RefractionProvenance", "kind", "Refraction", false),
    ] {
        variants::name_variants(schemas, parent, tag, suffix, closed);
    }
    method::complete_schema(schemas);
    for (component, field, limit) in FIELDS {
        bound(schemas, component, field, limit);
    }
    for (component, field, limit) in method::limits() {
        bound(schemas, &component, field, &limit);
    }
    variants::diffuser_parts(schemas);
    single_surfaces(schemas);
    model_of_room(schemas);
    for (object, rule) in rules::rules() {
        if let Some(RefOr::T(Schema::Object(object))) = schemas.get_mut(object) {
            forbid(&mut object.extensions, rule);
        }
    }
    if let Some(Schema::Object(roughness)) = property(schemas, "SurfaceDocument", "roughness") {
        // null is no number, and smaller numbers are read as zero
        let range = json!({ "type": "number", "minimum": SMALLEST, "exclusiveMaximum": LEAST_ROUGHNESS });
        forbid(&mut roughness.extensions, range);
    }
}

/// Adds the surfaces of single faces, whose names are free, to the schema of a room's surfaces.
fn single_surfaces(schemas: &mut Schemas) {
    let Some(RefOr::T(Schema::Object(surfaces))) = schemas.get_mut("SurfacesDocument") else { return };
    let surface = || RefOr::Ref(Ref::from_schema_name("SurfaceDocument"));
    for wall in ["wall_north", "wall_east", "wall_south", "wall_west"] {
        surfaces.properties.insert(wall.to_owned(), surface());
    }
    surfaces.additional_properties = Some(Box::new(AdditionalProperties::RefOr(surface())));
}

/// Adds the fields of a Honeybee model, which faces replace before a document is read, to the schema of a room.
fn model_of_room(schemas: &mut Schemas) {
    let Some(RefOr::T(Schema::Object(room))) = schemas.get_mut("RoomDocument") else { return };
    let model = ObjectBuilder::new()
        .schema_type(Type::Object)
        .description(Some("The model: plain JSON as Honeybee writes it."))
        .additional_properties(Some(AdditionalProperties::FreeForm(true)));
    let file = ObjectBuilder::new()
        .schema_type(Type::String)
        .description(Some("Id of an uploaded model, or the path of a file beside the job file."));
    let description = "Honeybee model (HBJSON) with the room, in place of `size_m`, `plan` and `faces`: its faces become `faces`. Warnings \
                       `model_changed` tell what is left out.";
    let none = ObjectBuilder::new().schema_type(Type::Null);
    let model = OneOfBuilder::new().item(model).item(file).item(none).description(Some(description));
    let text_or_none = SchemaType::from_iter([Type::String, Type::Null]);
    let identifier = ObjectBuilder::new().schema_type(text_or_none).description(Some(
        "Identifier or display name of the room in `hbjson`; may be left out if the model has one room.",
    ));
    room.properties.insert("hbjson".to_owned(), model.into());
    room.properties.insert("identifier".to_owned(), identifier.into());
}

/// Sets the bound of a field in its schema.
fn bound(schemas: &mut Schemas, component: &str, field: &str, limit: &Limit) {
    let Some(schema) = property(schemas, component, field) else { return };
    match (schema, limit) {
        (Schema::Object(object), Limit::Number(range)) => bound_number(object, *range),
        (Schema::Array(array), Limit::Items(bounds)) => {
            let (least, most) = ends(bounds);
            let Array { min_items, max_items, .. } = array;
            (*min_items, *max_items) = (least, most);
        }
        (Schema::Object(object), Limit::Length(bounds)) => (object.min_length, object.max_length) = ends(bounds),
        (Schema::Object(object), Limit::Fields(bounds)) => {
            (object.min_properties, object.max_properties) = ends(bounds);
        }
        _ => {}
    }
}

fn bound_number(object: &mut Object, range: Range) {
    match range.lowest {
        Bound::Included(lowest) => object.minimum = Some(whole(lowest)),
        Bound::Excluded(lowest) => object.exclusive_minimum = Some(whole(lowest)),
        Bound::Unbounded => {}
    }
    match range.highest {
        Bound::Included(highest) => object.maximum = Some(whole(highest)),
        Bound::Excluded(highest) => object.exclusive_maximum = Some(whole(highest)),
        Bound::Unbounded => {}
    }
}

/// Returns a bound as people write it, 1 and not 1.0; every whole bound in use is exact.
fn whole(bound: f64) -> Number {
    if bound.fract() == 0.0 { Number::Int(bound as isize) } else { Number::Float(bound) }
}

/// Returns the ends of a range that restrict anything: a lower one above 0, and an upper one below the largest integer.
fn ends(bounds: &RangeInclusive<usize>) -> (Option<usize>, Option<usize>) {
    (Some(*bounds.start()).filter(|least| *least > 0), Some(*bounds.end()).filter(|most| *most < usize::MAX))
}

/// Adds a rule that valid values must not match.
fn forbid(extensions: &mut Option<Extensions>, rule: Value) {
    extensions.get_or_insert_default().insert("not".to_owned(), rule);
}

/// Returns a property of a component whose schema is written inline.
fn property<'a>(schemas: &'a mut Schemas, component: &str, name: &str) -> Option<&'a mut Schema> {
    let Some(RefOr::T(Schema::Object(object))) = schemas.get_mut(component) else { return None };
    match object.properties.get_mut(name) {
        Some(RefOr::T(property)) => Some(property),
        _ => None,
    }
}
