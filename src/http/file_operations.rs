//! Files with one media type each, described as operations of their own.
//!
//! A path whose suffix, `?format=` or `Accept` chooses among representations is one operation with several types in one
//! answer, which a typed client can do little with. These operations need no routes: handlers read suffixes themselves.

use utoipa::openapi::path::{Operation, Parameter, ParameterIn, Paths};
use utoipa::openapi::{HttpMethod, PathItem, RefOr, Required};

/// File that an operation answers with, in one of several media types.
struct File {
    /// Path of the operation that answers with all media types.
    of: &'static str,
    path: &'static str,
    id: &'static str,
    media_type: &'static str,
    summary: &'static str,
    /// Name and description of the last parameter of the path, where the file has one.
    named_by: Option<(&'static str, &'static str)>,
}

const GRID: (&str, &str) = ("name", "The grid's name");

const FILES: [File; 8] = [
    File {
        of: "/v1/jobs/{id}/grids/{name}",
        path: "/v1/jobs/{id}/grids/{name}.json",
        id: "get_grid_json",
        media_type: "application/json",
        summary: "A grid with its statistics.",
        named_by: Some(GRID),
    },
    File {
        of: "/v1/jobs/{id}/grids/{name}",
        path: "/v1/jobs/{id}/grids/{name}.csv",
        id: "get_grid_csv",
        media_type: "text/csv",
        summary: "A grid as a table.",
        named_by: Some(GRID),
    },
    File {
        of: "/v1/jobs/{id}/tubes/{file}",
        path: "/v1/jobs/{id}/tubes/{tube}.json",
        id: "get_tube_json",
        media_type: "application/json",
        summary: "The report on a tube.",
        named_by: Some(("tube", "The tube's number in the document, from 0")),
    },
    File {
        of: "/v1/jobs/{id}/annual/{file}",
        path: "/v1/jobs/{id}/annual/points.{name}.json",
        id: "get_annual_points",
        media_type: "application/json",
        summary: "Metrics of the sensors of a grid over a year.",
        named_by: Some(GRID),
    },
    File {
        of: "/v1/jobs/{id}/annual/{file}",
        path: "/v1/jobs/{id}/annual/hours.csv",
        id: "get_annual_hours",
        media_type: "text/csv",
        summary: "Light of the tubes and the grids by the hour, as a table.",
        named_by: None,
    },
    File {
        of: "/v1/jobs/{id}/annual/honeybee/{file}",
        path: "/v1/jobs/{id}/annual/honeybee/{name}.json",
        id: "get_annual_honeybee_json",
        media_type: "application/json",
        summary: "A description of a year for the post-processing of Honeybee.",
        named_by: Some(("name", "`grids_info` or `study_info`")),
    },
    File {
        of: "/v1/studies/{id}/files/{file}",
        path: "/v1/studies/{id}/files/study.csv",
        id: "get_study_csv",
        media_type: "text/csv",
        summary: "The results of a study so far as a table.",
        named_by: None,
    },
    File {
        of: "/v1/studies/{id}/files/{file}",
        path: "/v1/studies/{id}/files/pictures.json",
        id: "get_study_pictures",
        media_type: "application/json",
        summary: "Times and errors of a study's pictures.",
        named_by: None,
    },
];

/// Adds an operation for each file to the described paths.
pub fn add(paths: &mut Paths) {
    for file in FILES {
        let all = paths.paths.get(file.of).and_then(|path| path.get.as_ref());
        let Some(operation) = all.map(|all| file.operation(all)) else { continue };
        paths.paths.insert(file.path.to_owned(), PathItem::new(HttpMethod::Get, operation));
    }
}

impl File {
    /// Creates the operation of this file alone from the operation with all media types.
    fn operation(&self, all: &Operation) -> Operation {
        let mut operation = all.clone();
        operation.operation_id = Some(self.id.to_owned());
        (operation.summary, operation.description) = (Some(self.summary.to_owned()), None);
        let parameters = operation.parameters.iter_mut().flatten().filter_map(|parameter| self.parameter(parameter));
        operation.parameters = Some(parameters.collect());
        if let Some(RefOr::T(found)) = operation.responses.responses.get_mut("200") {
            found.description = "The file".to_owned();
            found.content.retain(|media_type, _| media_type == self.media_type);
        }
        operation
    }

    /// Converts a parameter of the operation with all media types to one of this file. Query parameters are left out: they are
    /// options of figures, or choose a media type.
    fn parameter(&self, of_all: &RefOr<Parameter>) -> Option<RefOr<Parameter>> {
        let RefOr::T(of_all) = of_all else { return None };
        if of_all.parameter_in != ParameterIn::Path {
            return None;
        }
        if of_all.name == "id" {
            return Some(of_all.clone().into());
        }
        let (name, description) = self.named_by?;
        let mut parameter = of_all.clone();
        (parameter.name, parameter.required) = (name.to_owned(), Required::True);
        parameter.description = Some(description.to_owned());
        Some(parameter.into())
    }
}
