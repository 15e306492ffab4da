//! Kinds of refusals of methods, as documents and responses name them.

use std::borrow::Cow;

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use utoipa::openapi::schema::{ObjectBuilder, Schema, Type};
use utoipa::openapi::{RefOr, schema};
use utoipa::{PartialSchema, ToSchema};

use crate::integrator::method::RefusalCode;

/// Kind of a method's refusal, serialised as its code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RefusalName(pub RefusalCode);

impl Serialize for RefusalName {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.0.code())
    }
}

impl<'de> Deserialize<'de> for RefusalName {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = Cow::<str>::deserialize(deserializer)?;
        let known = RefusalCode::ALL.iter().find(|code| code.code() == text);
        known.map(|code| Self(*code)).ok_or_else(|| D::Error::custom(format!("unknown refusal code {text}")))
    }
}

impl PartialSchema for RefusalName {
    fn schema() -> RefOr<schema::Schema> {
        let codes = RefusalCode::ALL.iter().map(|code| code.code());
        Schema::Object(
            ObjectBuilder::new()
                .schema_type(Type::String)
                .description(Some("Kind of reason for which a method refuses a document."))
                .enum_values(Some(codes))
                .build(),
        )
        .into()
    }
}

impl ToSchema for RefusalName {
    fn name() -> Cow<'static, str> {
        "RefusalCode".into()
    }
}
