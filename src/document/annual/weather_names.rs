//! Names of the weather files of a year: one, or a list.

use std::fmt;

use serde::de::{SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{ArrayBuilder, ObjectBuilder, OneOfBuilder, Schema, Type};
use utoipa::{PartialSchema, ToSchema};

use crate::document::errors::Checks;
use crate::document::limits::{FILE_ID, WEATHER_FILES};

/// Names of weather files, written as a text if it is one alone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WeatherNames(Vec<String>);

impl WeatherNames {
    /// Lists the names, each with the pointer of its field.
    pub fn with_pointers(&self) -> impl Iterator<Item = (&str, String)> {
        let several = self.0.len() > 1;
        self.0.iter().enumerate().map(move |(number, name)| {
            let pointer = if several { format!("/annual/weather/{number}") } else { "/annual/weather".to_owned() };
            (name.as_str(), pointer)
        })
    }

    pub(super) fn check(&self, checks: &mut Checks) {
        if self.0.is_empty() {
            checks.refuse("/annual/weather", "must name at least one file");
        }
        if !checks.at_most("/annual/weather", self.0.len(), &WEATHER_FILES, " files") {
            return;
        }
        for (name, pointer) in self.with_pointers() {
            if !FILE_ID.contains(&name.chars().count()) {
                checks.refuse(pointer, format!("must have {}..{} characters", FILE_ID.start(), FILE_ID.end()));
            }
        }
    }
}

impl Serialize for WeatherNames {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0.as_slice() {
            [name] => name.serialize(serializer),
            names => names.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for WeatherNames {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Names)
    }
}

struct Names;

impl<'de> Visitor<'de> for Names {
    type Value = WeatherNames;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("the name of a weather file, or a list of names")
    }

    fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<WeatherNames, E> {
        Ok(WeatherNames(vec![name.to_owned()]))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<WeatherNames, A::Error> {
        let mut names = Vec::new();
        while let Some(name) = seq.next_element()? {
            names.push(name);
        }
        Ok(WeatherNames(names))
    }
}

impl PartialSchema for WeatherNames {
    fn schema() -> RefOr<Schema> {
        let name = || {
            let text = ObjectBuilder::new().schema_type(Type::String);
            text.min_length(Some(*FILE_ID.start())).max_length(Some(*FILE_ID.end()))
        };
        let list = ArrayBuilder::new().items(name());
        let list = list.min_items(Some(*WEATHER_FILES.start())).max_items(Some(*WEATHER_FILES.end()));
        OneOfBuilder::new().item(name()).item(list).description(Some("A weather file, or several.")).into()
    }
}

impl ToSchema for WeatherNames {}
