//! Variants of tagged objects as components of their own.

use std::collections::BTreeMap;

use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{AdditionalProperties, AllOf, Discriminator, Object, OneOf, Ref, Schema, Type};

/// The schemas of a description by name.
pub type Schemas = BTreeMap<String, RefOr<Schema>>;

/// Makes each variant of `parent` a component named by the value of its `tag` and `suffix`, and says what tells them apart.
pub fn name_variants(schemas: &mut Schemas, parent: &str, tag: &str, suffix: &str, closed: bool) {
    let Some(RefOr::T(Schema::OneOf(mut one_of))) = schemas.remove(parent) else { return };
    let mut discriminator = Discriminator::new(tag);
    let items = std::mem::take(&mut one_of.items);
    let merged: Vec<String> = items.iter().flat_map(structs_of).collect();
    let mut named = Vec::new();
    for item in items {
        let Some((value, object)) = tagged_object(schemas, item, tag, closed) else { continue };
        let name = camel_case(&value) + suffix;
        let reference = Ref::from_schema_name(&name);
        discriminator.mapping.insert(value, reference.ref_location.clone());
        one_of.items.push(reference.into());
        named.push((name, object));
    }
    // the variants have all their fields, and the tag
    schemas.retain(|name, schema| !merged.contains(name) || !matches!(schema, RefOr::T(Schema::Object(_))));
    schemas.extend(named);
    one_of.discriminator = Some(discriminator);
    schemas.insert(parent.to_owned(), Schema::OneOf(one_of).into());
}

/// Names of the components of which a variant is made.
fn structs_of(item: &RefOr<Schema>) -> Vec<String> {
    let RefOr::T(Schema::AllOf(AllOf { items, .. })) = item else { return Vec::new() };
    let name = |item: &RefOr<Schema>| match item {
        RefOr::Ref(reference) => reference.ref_location.rsplit('/').next().map(str::to_owned),
        RefOr::T(_) => None,
    };
    items.iter().filter_map(name).collect()
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
pub fn diffuser_parts(schemas: &mut Schemas) {
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
    // a variant of the parts itself, and variants are objects
    one_of.schema_type = Type::Object.into();
    schemas.insert("DiffuserPart".to_owned(), Schema::OneOf(one_of).into());
}

/// Turns `a_name` into `AName`.
pub fn camel_case(snake_case: &str) -> String {
    let capitalised = |word: &str| {
        let mut letters = word.chars();
        letters.next().map_or(String::new(), |first| first.to_ascii_uppercase().to_string() + letters.as_str())
    };
    snake_case.split('_').map(capitalised).collect()
}
