//! Report on a job that prints well, as a page and as PDF.

use axum::extract::RawQuery;
use axum::http::{HeaderMap, HeaderValue, header};
use axum::response::Response;
use serde_json::{Value, json};
use uuid::Uuid;

use crate::figure::FigureFormat;
use crate::figure::pdf::pdf as pages;
use crate::figure::sheet::{Sheet, SheetPart, Tone};
use crate::figure::svg::escaped;
use crate::http::content::{self, Binary};
use crate::http::formats::{self, Format};
use crate::http::problem::{Path, Problem, Query};
use crate::http::prose::prose;
use crate::http::results::{grid_names, kept_of_year, read};
use crate::http::target_query::{TargetQuery, check};
use crate::http::{App, Service};
use crate::output::OutputError;
use crate::present::outputs::{AUTONOMY, Output};
use crate::present::report;
use crate::present::target::WantedTarget;
use crate::queue::store::Job;

/// Content security policy of the page: its style and its figures come from this service, and nothing runs.
const CONTENT_SECURITY_POLICY: &str = "default-src 'none'; style-src 'self'; img-src 'self'; frame-ancestors 'none'; \
    base-uri 'none'; form-action 'none'";

/// Answers `/jobs/ID/report` with the report as a page.
pub async fn page(
    app: App,
    Path(id): Path<Uuid>,
    Query(query): Query<TargetQuery>,
    RawQuery(written): RawQuery,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let written = written.map_or_else(String::new, |written| format!("?{written}"));
    let html = sheet(&app, id, query.wanted()?, move |sheet| Ok(html(&sheet, id, &written))).await?;
    let mut response = content::made(&headers, html, "text/html; charset=utf-8")?;
    let policy = HeaderValue::from_static(CONTENT_SECURITY_POLICY);
    response.headers_mut().insert(header::CONTENT_SECURITY_POLICY, policy);
    Ok(response)
}

/// Returns the report on a job on two sheets of A4: the results in sentences, the map and the inputs; then fluxes, method and its reason,
/// effects, warnings, and the program that made it.
#[utoipa::path(get, path = "/v1/jobs/{id}/report.pdf", operation_id = "get_report_pdf", tag = "results", params(("id" = Uuid, Path), TargetQuery),
    responses(
        (status = 200, description = "The report", body = inline(Binary), content_type = "application/pdf"),
        (status = 304, description = "Not modified: the ETag in If-None-Match is still current"),
        (status = 422, description = "A parameter is not valid"),
        (status = 404, description = "No such job")))]
pub async fn pdf(
    app: App,
    Path(id): Path<Uuid>,
    Query(query): Query<TargetQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let written = sheet(&app, id, query.wanted()?, |sheet| pages(&sheet.draw())).await?;
    Ok(formats::named(content::made(&headers, written, FigureFormat::Pdf.media_type())?, report::REPORT))
}

/// Makes the report on a job from everything computed so far, its first grid compared with `wanted`, and runs `write` on it.
pub(super) async fn sheet<T: Send + 'static>(
    app: &Service,
    id: Uuid,
    wanted: Option<WantedTarget>,
    write: impl FnOnce(Sheet) -> Result<T, OutputError> + Send + 'static,
) -> Result<T, Problem> {
    let job = app.store.job(id).await?.ok_or_else(Problem::no_such_job)?;
    if let Some(wanted) = wanted {
        check(wanted, &job.document)?;
    }
    let first = |outputs: &str| job.document[outputs][0]["name"].as_str().map(str::to_owned);
    let grid = first("grids").map(|name| Output::Grid(name, Format::Json));
    let view = first("views").map(|name| Output::View(name, Format::Png));
    let kept = match job.document["annual"].is_object() {
        true => kept_of_year(&grid_names(app, id).await?),
        false => grid.into_iter().chain(view).collect(),
    };
    let made = read(app, id, kept, move |results, job| {
        let job = answered(job);
        let footer = format!("{} · job {id}", results.subject().origin);
        Ok(write(report::report(results, &job, wanted, footer)?)?)
    });
    made.await
}

/// Collects the fields of a job that a report needs, under their names in answers.
fn answered(job: Job) -> Value {
    let mut fields = job.summary.unwrap_or_default();
    fields["document"] = job.document;
    fields["plan"] = job.plan;
    fields["warnings"] = json!(job.warnings);
    fields["stopped_by"] = json!(job.head.stopped_by);
    fields
}

/// Writes the report on a job as a page; `query` is that of the page, with its question mark.
fn html(sheet: &Sheet, id: Uuid, query: &str) -> String {
    let title = escaped(&sheet.title);
    let lines = sheet.lines.iter().filter(|line| !line.is_empty());
    let lines: String = lines.map(|line| format!("<p>{}</p>\n", escaped(line))).collect();
    let [footer, query] = [&sheet.footer, query].map(escaped);
    let figure = |name: &str, title: &str| {
        let suffix = if name.starts_with("views/") { "png" } else { "svg" };
        // the map of a year is that of the target
        let query = if name.starts_with(AUTONOMY) { query.as_str() } else { "" };
        format!("<img src=\"/v1/jobs/{id}/{}.{suffix}{query}\" alt=\"{}\">\n", escaped(name), escaped(title))
    };
    let figures: String = sheet.figures.iter().map(|shown| figure(&shown.name, &shown.drawing.title)).collect();
    let sentence = |(tone, sentence): &(Tone, String)| {
        let tone = match tone {
            Tone::Plain => "plain",
            Tone::Good => "good",
            Tone::Bad => "bad",
        };
        format!("<p class=\"sentence {tone}\">{}</p>\n", escaped(sentence))
    };
    let sentences: String = sheet.sentences.iter().map(sentence).collect();
    let [parts, details] = [&sheet.parts, &sheet.details].map(|parts| parts.iter().map(part).collect::<String>());
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<title>{title}, report</title>\n\
         <link rel=\"icon\" href=\"/web/icon.svg\" type=\"image/svg+xml\">\n\
         <link rel=\"stylesheet\" href=\"/web/report.css\">\n</head>\n<body>\n<main>\n<header>\n<h1>{title}</h1>\n{lines}\
         <nav><a href=\"/jobs/{id}{query}\">the job</a> <a href=\"/v1/jobs/{id}/report.pdf{query}\">PDF</a></nav>\n</header>\n\
         {sentences}<div class=\"figures wide\" tabindex=\"0\" role=\"region\" aria-label=\"Figures\">\n{figures}</div>\n{parts}<div class=\"details\">\n{details}</div>\n<footer><p>{footer}</p></footer>\n</main>\n</body>\n</html>\n"
    )
}

fn part(part: &SheetPart) -> String {
    let section = |title: &str, body: String| format!("<section>\n<h2>{}</h2>\n{body}</section>\n", escaped(title));
    match part {
        SheetPart::Table { rows, .. } if rows.is_empty() => String::new(),
        SheetPart::Facts { facts, .. } if facts.is_empty() => String::new(),
        SheetPart::Table { title, head, rows } => {
            let head: String = head.iter().map(|name| format!("<th scope=\"col\">{}</th>", escaped(name))).collect();
            let row = |row: &Vec<String>| {
                let cells = row.iter().map(|cell| format!("<td>{}</td>", escaped(cell)));
                format!("<tr>{}</tr>\n", cells.collect::<String>())
            };
            let rows: String = rows.iter().map(row).collect();
            // wider than a phone: it scrolls alone, by keys, too
            let name = escaped(title);
            section(
                title,
                format!(
                    "<div class=\"wide\" tabindex=\"0\" role=\"region\" aria-label=\"{name}\"><table>\n<thead><tr>{head}</tr></thead>\n\
                     <tbody>\n{rows}</tbody>\n</table></div>\n"
                ),
            )
        }
        SheetPart::Facts { title, facts } => {
            let fact = |(name, words): &(String, String)| {
                format!("<div><dt>{}</dt><dd>{}</dd></div>\n", escaped(name), prose(words))
            };
            section(title, format!("<dl>\n{}</dl>\n", facts.iter().map(fact).collect::<String>()))
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::figure::Drawing;
    use crate::figure::sheet::SheetFigure;

    #[test]
    fn what_a_user_wrote_is_text() {
        let sheet = Sheet {
            title: "<script>alert(1)</script>".to_owned(),
            lines: vec!["a & b".to_owned()],
            sentences: vec![(Tone::Bad, "5 < 6".to_owned())],
            figures: ["annual/autonomy.desk", "annual/by_hour.desk"]
                .map(|name| SheetFigure { name: name.to_owned(), drawing: Drawing::new(DVec2::ONE, "") })
                .to_vec(),
            parts: vec![SheetPart::Facts {
                title: "Inputs".to_owned(),
                facts: vec![("room".to_owned(), "\"><b>".to_owned()), ("sky".to_owned(), "needs `sky`".to_owned())],
            }],
            details: Vec::new(),
            footer: String::new(),
        };
        let html = html(&sheet, Uuid::nil(), "?a=1&b=\"");
        assert!(!html.contains("<script") && !html.contains("<b>"), "{html}");
        assert!(html.contains("<p class=\"sentence bad\">5 &lt; 6</p>"), "{html}");
        assert!(
            html.contains("/annual/autonomy.desk.svg?a=1&amp;b=&quot;\""),
            "the map is not that of the target: {html}"
        );
        assert!(html.contains("/annual/by_hour.desk.svg\""), "{html}");
        assert!(html.contains("report.pdf?a=1&amp;b=&quot;\">PDF"), "{html}");
        assert!(html.contains("<dd>needs <code>sky</code></dd>"), "{html}");
        assert!(html.contains("<p>a &amp; b</p>") && html.contains("<dd>&quot;&gt;&lt;b&gt;</dd>"), "{html}");
    }
}
