//! Jobs in the form of JSON answers.

use std::collections::BTreeMap;

use jiff::Timestamp;
use serde::Serialize;
use serde_json::{Map, Value};
use utoipa::ToSchema;
use uuid::Uuid;

use crate::document::result::{JobResults, PlanResult};
use crate::document::{JobDocument, Warning};
use crate::engine::progress::{Progress, StoppedBy};
use crate::figure::FigureFormat;
use crate::predict::predictions::Predictions;
use crate::present::outputs::{Annual, Format, Output, annual_outputs};
use crate::present::report::OVERVIEW;
use crate::present::site_figure::SiteFigure;
use crate::queue::store::*;

/// Job with its document, its plan, its progress and its results.
#[derive(Serialize, ToSchema)]
pub struct JobResource {
    #[serde(flatten)]
    pub summary: JobSummary,
    /// The document as understood, all defaults filled in.
    #[schema(value_type = JobDocument)]
    pub document: Value,
    /// Plan: what is simulated and what is not, with reasons.
    #[schema(value_type = PlanResult)]
    pub plan: Value,
    pub warnings: Vec<Warning>,
    /// Predictions of the time that each method would take, made before the job was queued; with `predict` only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub predictions: Option<Predictions>,
    /// Reason why the job failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub problem: Option<JobProblem>,
    /// Results: provenance and outdoor illuminance from the beginning, all others once the job has finished with at least one pass.
    #[serde(flatten)]
    #[schema(value_type = JobResults)]
    pub results: Map<String, Value>,
}

/// A job in a list.
#[derive(Serialize, ToSchema)]
pub struct JobSummary {
    pub id: Uuid,
    pub name: Option<String>,
    pub status: JobStatus,
    /// True if the job was asked to stop; it does so within a pass.
    pub cancel_requested: bool,
    #[schema(value_type = String, format = DateTime)]
    pub created_at: Option<Timestamp>,
    #[schema(value_type = Option<String>, format = DateTime)]
    pub started_at: Option<Timestamp>,
    #[schema(value_type = Option<String>, format = DateTime)]
    pub finished_at: Option<Timestamp>,
    pub progress: Progress,
    /// Reason why a finished job ended.
    pub stopped_by: Option<StoppedBy>,
    pub links: Links,
}

/// Paths of the resources that belong to a job.
#[derive(Serialize, ToSchema)]
pub struct Links {
    #[serde(rename = "self")]
    pub this: String,
    /// Path of the web page of the job.
    pub page: String,
    /// Path of the report on the job: a web page that prints well.
    pub report: String,
    /// Path of the report on the job as PDF.
    pub report_pdf: String,
    pub events: String,
    pub convergence: String,
    pub convergence_csv: String,
    pub convergence_svg: String,
    pub convergence_png: String,
    pub convergence_pdf: String,
    pub cancel: String,
    /// Paths of the grids by name (JSON, or the format of `Accept` or `?format=`). Not in lists.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grids: Option<BTreeMap<String, String>>,
    /// Paths of the grids' files by name. Not in lists.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grid_files: Option<BTreeMap<String, GridLinks>>,
    /// Paths of the views by name. Not in lists.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub views: Option<BTreeMap<String, ViewLinks>>,
    /// Paths of the reports on the tubes, in the order of the document. Not in lists.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tubes: Option<Vec<TubeLinks>>,
    /// Paths of other figures by name: sky, sections, overview, and the fluxes of tubes in lm once they are computed. Not in lists.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub figures: Option<BTreeMap<String, FigureLinks>>,
    /// Paths of the results of a year, its summary first; absent for jobs without `annual`. Not in lists.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub annual: Option<Vec<String>>,
    /// Path of the light on the faces of the room, where the document asks for `surfaces`. Not in lists.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surfaces: Option<String>,
    /// Path of the model of the room, where the document asks for `surfaces`. Not in lists.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scene: Option<String>,
    /// Path of the triangles of the meshes of objects and tubes, where the document has some. Not in lists.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub meshes: Option<String>,
}

#[derive(Serialize, ToSchema)]
pub struct GridLinks {
    pub json: String,
    pub csv: String,
    /// Path of a map over the plan of the room, in pixels.
    pub png: String,
    /// Path of a map over the plan of the room, as vector graphics.
    pub svg: String,
    /// Path of a map over the plan of the room, for print.
    pub pdf: String,
}

/// Paths of a figure in its three representations.
#[derive(Serialize, ToSchema)]
pub struct FigureLinks {
    pub svg: String,
    pub png: String,
    pub pdf: String,
}

#[derive(Serialize, ToSchema)]
pub struct TubeLinks {
    pub json: String,
    pub svg: String,
    pub png: String,
    pub pdf: String,
}

#[derive(Serialize, ToSchema)]
pub struct ViewLinks {
    pub exr: String,
    pub png: String,
    pub false_colour_png: String,
    pub false_colour_svg: String,
    pub false_colour_pdf: String,
}

impl JobSummary {
    pub fn new(head: &JobHead) -> Self {
        let this = format!("/v1/jobs/{}", head.id);
        Self {
            id: head.id,
            name: head.name.clone(),
            status: head.status,
            cancel_requested: head.cancel_requested,
            created_at: timestamp(head.created_at),
            started_at: head.started_at.and_then(timestamp),
            finished_at: head.finished_at.and_then(timestamp),
            progress: head.progress,
            stopped_by: head.stopped_by,
            links: Links {
                page: format!("/jobs/{}", head.id),
                report: format!("/jobs/{}/report", head.id),
                report_pdf: format!("{this}/report.pdf"),
                events: format!("{this}/events"),
                convergence: format!("{this}/convergence"),
                convergence_csv: format!("{this}/convergence.csv"),
                convergence_svg: format!("{this}/convergence.svg"),
                convergence_png: format!("{this}/convergence.png"),
                convergence_pdf: format!("{this}/convergence.pdf"),
                cancel: format!("{this}/cancel"),
                this,
                grids: None,
                grid_files: None,
                views: None,
                tubes: None,
                figures: None,
                annual: None,
                surfaces: None,
                scene: None,
                meshes: None,
            },
        }
    }
}

impl JobResource {
    pub fn new(job: Job) -> Self {
        let mut summary = JobSummary::new(&job.head);
        let this = &summary.links.this;
        let grids = names(&job.document, "grids").map(|name| (name.to_owned(), format!("{this}/grids/{name}")));
        let grid_files = names(&job.document, "grids").map(|name| {
            let [json, csv, png, svg, pdf] =
                ["json", "csv", "png", "svg", "pdf"].map(|suffix| format!("{this}/grids/{name}.{suffix}"));
            (name.to_owned(), GridLinks { json, csv, png, svg, pdf })
        });
        let views = names(&job.document, "views").map(|name| {
            let [svg, png, pdf] =
                FigureFormat::ALL.map(|format| format!("{this}/views/{name}.{}?style=false_colour", format.suffix()));
            let links = ViewLinks {
                exr: format!("{this}/views/{name}.exr"),
                png: format!("{this}/views/{name}.png"),
                false_colour_png: png,
                false_colour_svg: svg,
                false_colour_pdf: pdf,
            };
            (name.to_owned(), links)
        });
        let (grids, grid_files, views) = (grids.collect(), grid_files.collect(), views.collect());
        let count = job.document["tubes"].as_array().map_or(0, Vec::len);
        let tubes = (0..count).map(|tube| {
            let [svg, png, pdf] = FigureFormat::ALL.map(|format| format!("{this}/tubes/{tube}.{}", format.suffix()));
            TubeLinks { json: format!("{this}/tubes/{tube}.json"), svg, png, pdf }
        });
        let tubes = tubes.collect();
        let known = job.summary.as_ref().unwrap_or(&Value::Null);
        let of_site = SiteFigure::of_job(&job.document, known).into_iter().map(SiteFigure::name);
        let figures = of_site.chain([OVERVIEW.to_owned()]).map(|name| {
            let [svg, png, pdf] = FigureFormat::ALL.map(|format| format!("{this}/figures/{name}.{}", format.suffix()));
            (name, FigureLinks { svg, png, pdf })
        });
        let has_surfaces = job.document["surfaces"] == true;
        let of_surfaces = |format| has_surfaces.then(|| format!("{this}/{}", Output::Surfaces(format).file()));
        let [surfaces, scene] = [Format::Json, Format::Glb].map(of_surfaces);
        let has_mesh = |of: &Value| of.as_array().into_iter().flatten().any(|one| one["mesh"].is_string());
        let has_meshes = has_mesh(&job.document["tubes"]) || has_mesh(&job.document["room"]["objects"]);
        summary.links.meshes = has_meshes.then(|| format!("{this}/{}", Output::Meshes.file()));
        summary.links.figures = Some(figures.collect());
        if job.document["annual"].is_object() {
            let dimming = job.document["annual"]["dimming"].is_object();
            let files = annual_outputs(names(&job.document, "grids"), dimming).into_iter();
            summary.links.annual = Some(
                files
                    .map(|output| match output {
                        Output::Annual(Annual::Summary, _) => format!("{this}/annual"),
                        other => format!("{this}/{}", other.file()),
                    })
                    .collect(),
            );
        }
        (summary.links.surfaces, summary.links.scene) = (surfaces, scene);
        summary.links.grids = Some(grids);
        summary.links.grid_files = Some(grid_files);
        summary.links.views = Some(views);
        summary.links.tubes = Some(tubes);
        let results = match job.summary {
            Some(Value::Object(results)) => results,
            _ => Map::new(),
        };
        Self {
            summary,
            document: job.document,
            plan: job.plan,
            warnings: job.warnings,
            predictions: job.predictions,
            problem: job.problem,
            results,
        }
    }
}

/// Returns the names of the grids or the views of a document.
pub(in crate::http) fn names<'a>(document: &'a Value, outputs: &str) -> impl Iterator<Item = &'a str> {
    document[outputs].as_array().into_iter().flatten().filter_map(|output| output["name"].as_str())
}

fn timestamp(milliseconds: i64) -> Option<Timestamp> {
    Timestamp::from_millisecond(milliseconds).ok()
}
