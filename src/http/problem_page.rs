//! Pages that explain the kinds of problems.

use axum::Json;
use axum::http::{HeaderMap, header};
use axum::response::{Html, IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;

use crate::http::formats::{self, Format};
use crate::http::problem::{Path, Problem};
use crate::http::problem_kind::ProblemKind;
use crate::http::prose::prose;

/// Explanation of a kind of problem.
#[derive(Serialize, ToSchema)]
pub struct ProblemPage {
    #[serde(rename = "type")]
    #[schema(format = "uri-reference", example = "/problems/invalid-document")]
    pub code: &'static str,
    pub title: &'static str,
    /// The usual status of an answer with this problem.
    pub status: u16,
    /// Meaning of the kind, and what to do.
    pub meaning: &'static str,
    /// Example of a `detail`.
    pub example: &'static str,
}

/// Explains a kind of problem: the page that `type` of a problem document leads to.
#[utoipa::path(get, path = "/problems/{name}", operation_id = "get_problem", tag = "operation",
    params(("name" = String, Path, description = "The last part of a problem's `type`", example = "invalid-document")),
    responses(
        (status = 200, description = "The explanation", content((String = "text/html"), (ProblemPage = "application/json"))),
        (status = 404, description = "No such kind of problem")))]
pub async fn problem_page(Path(name): Path<String>, headers: HeaderMap) -> Result<Response, Problem> {
    let kind = ProblemKind::ALL.iter().find(|kind| kind.name() == name);
    let kind = kind.ok_or_else(|| Problem::not_found("there is no such kind of problem"))?;
    let page = ProblemPage {
        code: kind.code(),
        title: kind.title(),
        status: kind.status().as_u16(),
        meaning: kind.meaning(),
        example: kind.example(),
    };
    let answer = match formats::accepted(&headers, &[Format::Html, Format::Json]) {
        Format::Json => Json(page).into_response(),
        _ => Html(page.html()).into_response(),
    };
    Ok(([(header::VARY, "accept")], answer).into_response())
}

impl ProblemPage {
    fn html(&self) -> String {
        let Self { code, title, status, meaning, example } = self;
        let meaning = prose(meaning);
        let example = example.replace('&', "&amp;").replace('<', "&lt;");
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<title>{title}</title>\n<h1>{title}</h1>\n\
             <p>{meaning}</p>\n<p>Status {status}, <code>\"type\": \"{code}\"</code>. For example:</p>\n\
             <pre>{{\n  \"type\": \"{code}\",\n  \"title\": \"{title}\",\n  \"status\": {status},\n  \"detail\": \"{example}\"\n}}</pre>\n\
             <p><a href=\"/docs/\">The interface of this service</a></p>\n</html>\n"
        )
    }
}
