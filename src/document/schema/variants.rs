//! Conversion of the variants of tagged objects to components of their own.

use std::collections::BTreeMap;

use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{AdditionalProperties, AllOf, Discriminator, Object, OneOf, Ref, Schema, Type};

/// Schemas of a description by the names of their components.
pub type Schemas = BTreeMap<String, RefOr<Schema>>;

/// Makes each variant of `parent` a component, named by the value of its `tag` followed by `suffix`, and declares the tag as the
/// discriminator. With `closed`, the variants allow no other fields.
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
    // the variants contain all fields of these components, and the tag
    schemas.retain(|name, schema| !merged.contains(name) || !matches!(schema, RefOr::T(Schema::Object(_))));
    schemas.extend(named);
    one_of.discriminator = Some(discriminator);
    schemas.insert(parent.to_owned(), Schema::OneOf(one_of).into());
}

/// Returns the names of the components that a variant consists of.
fn structs_of(item: &RefOr<Schema>) -> Vec<String> {
    let RefOr::T(Schema::AllOf(AllOf { items, .. })) = item else { return Vec::new() };
    let name = |item: &RefOr<Schema>| match item {
        RefOr::Ref(reference) => reference.ref_location.rsplit('/').next().map(str::to_owned),
        RefOr::T(_) => None,
    };
    items.iter().filter_map(name).collect()
}

/// Returns a variant as one object, with the value of its tag.
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
    // the tag is the first thing that a reader looks for
    object.required.sort_by_key(|name| name != tag);
    let Some(RefOr::T(Schema::Object(values))) = object.properties.get(tag) else { return None };
    let value = values.enum_values.as_ref()?.first()?.as_str()?.to_owned();
    Some((value, Schema::Object(object).into()))
}

/// Merges the objects of an `allOf` into one; `None` if one of them is not an object.
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
            // a mesh part that is a diffuser: `diffuser_parts` adds these
            Schema::OneOf(_) => continue,
            _ => return None,
        };
        all.description = all.description.or(object.description);
        all.required.extend(object.required);
        all.properties.extend(object.properties);
    }
    Some(Schema::Object(all))
}

/// Replaces the mesh part that is a diffuser by one component for each kind of diffuser, with the part's role.
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
    // it is a variant of the parts itself, and variants are objects
    one_of.schema_type = Type::Object.into();
    schemas.insert("DiffuserPart".to_owned(), Schema::OneOf(one_of).into());
}

/// Converts `a_name` to `AName`.
pub fn camel_case(snake_case: &str) -> String {
    let capitalised = |word: &str| {
        let mut letters = word.chars();
        letters.next().map_or(String::new(), |first| first.to_ascii_uppercase().to_string() + letters.as_str())
    };
    snake_case.split('_').map(capitalised).collect()
}
