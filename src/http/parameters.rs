//! Check of query parameters: those that an operation does not have are refused by name.

use std::collections::BTreeMap;
use std::sync::Arc;

use axum::extract::{MatchedPath, Query, Request, State};
use axum::http::Method;
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use utoipa::openapi::path::{Operation, Parameter, ParameterIn};
use utoipa::openapi::{OpenApi, RefOr};

use crate::document::{FieldError, FieldErrorCode};
use crate::http::problem::Problem;

/// Prefix of the paths whose parameters are checked; health checks and pages ignore theirs.
pub const CHECKED: &str = "/v1/";

/// Names of the query parameters of all described operations, by path and method.
pub struct QueryParameters(BTreeMap<(String, &'static str), Vec<String>>);

impl QueryParameters {
    pub fn of(description: &OpenApi) -> Self {
        let checked = description.paths.paths.iter().filter(|(path, _)| path.starts_with(CHECKED));
        let operations = checked.flat_map(|(path, item)| {
            let methods = [("GET", &item.get), ("POST", &item.post), ("DELETE", &item.delete)];
            methods
                .into_iter()
                .filter_map(move |(method, operation)| Some(((path.clone(), method), in_query(operation.as_ref()?))))
        });
        Self(operations.collect())
    }

    /// Returns the faults of a request's query; none if the operation is not described.
    fn faults(&self, path: &str, request: &Request) -> Vec<FieldError> {
        let method = if request.method() == Method::HEAD { "GET" } else { request.method().as_str() };
        let operation = self.0.iter().find(|((of, with), _)| of == path && *with == method);
        let Some((_, known)) = operation else { return Vec::new() };
        // a query that is no list of names and values is refused by the operation
        let Ok(Query(given)) = Query::<Vec<(String, String)>>::try_from_uri(request.uri()) else { return Vec::new() };
        let unknown = given.iter().filter(|(name, _)| !known.contains(name));
        unknown.map(|(name, _)| unknown_parameter(name, known)).collect()
    }
}

fn in_query(operation: &Operation) -> Vec<String> {
    let parameters = operation.parameters.iter().flatten();
    let name = |parameter: &RefOr<Parameter>| match parameter {
        RefOr::T(Parameter { parameter_in: ParameterIn::Query, name, .. }) => Some(name.clone()),
        _ => None,
    };
    parameters.filter_map(name).collect()
}

fn unknown_parameter(name: &str, known: &[String]) -> FieldError {
    let detail = match known {
        [] => "unknown parameter; this path takes none".to_owned(),
        known => format!("unknown parameter; this path takes {}", known.join(", ")),
    };
    FieldError::of_parameter(name, detail).coded(FieldErrorCode::UnknownField)
}

/// Refuses requests with unknown parameters, and hands on all others.
pub async fn refuse_unknown(State(known): State<Arc<QueryParameters>>, request: Request, next: Next) -> Response {
    let path = request.extensions().get::<MatchedPath>().map(MatchedPath::as_str);
    let faults = path.map_or_else(Vec::new, |path| known.faults(path, &request));
    if faults.is_empty() { next.run(request).await } else { Problem::invalid_parameters(faults).into_response() }
}
