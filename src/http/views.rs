//! Pictures of a job's views: as OpenEXR, tone-mapped, and in false colours.

use axum::http::HeaderMap;
use axum::response::Response;
use serde::Deserialize;
use utoipa::openapi::schema::{Object, ObjectBuilder, Type};
use utoipa::{IntoParams, ToSchema};
use uuid::Uuid;

use crate::engine::convergence::PREVIEW_PASSES;
use crate::figure::FigureFormat;
use crate::figure::axes::Spacing;
use crate::figure::scale::Palette;
use crate::http::content::{self, Binary};
use crate::http::formats::{self, Format, scale};
use crate::http::problem::{Path, Problem, Query};
use crate::http::query_faults::check_positive;
use crate::http::results::{no_such_output, read, result_file};
use crate::http::{App, Service};
use crate::output::png::{self, ToneMapping};
use crate::present::outputs::{Output, progress_image};
use crate::present::view_figure::{ViewWishes, captioned_figure, false_colour_figure};

/// Representations of a view.
const FORMATS: [Format; 4] = [Format::Png, Format::Exr, Format::Svg, Format::Pdf];

#[derive(Clone, Copy, Default, PartialEq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum PictureStyle {
    /// Tone-mapped picture alone, as an eye sees it.
    #[default]
    Tone,
    /// Tone-mapped picture, as an eye sees it, with job, place, time, sky, method and the exposure printed around it.
    Captioned,
    /// Luminance in false colours with a scale.
    FalseColour,
}

#[derive(Clone, Copy, PartialEq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ScaleSpacing {
    Linear,
    /// Logarithmic, over three decades.
    Log,
}

#[derive(Clone, Copy, PartialEq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum PaletteName {
    Viridis,
    Turbo,
    Inferno,
    Grey,
}

#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct PictureQuery {
    /// Style of a PNG, SVG or PDF; `tone` when absent, which PNG alone can have.
    #[param(inline)]
    style: Option<PictureStyle>,
    /// Number of the pass after which a progress image was kept; for the style `tone` only.
    #[param(schema_with = kept_passes)]
    pass: Option<u64>,
    /// Luminance in cd/m2 that is shown as middle grey, so that several pictures are exposed alike; for the styles `tone` and
    /// `captioned`. When absent, the picture's own average.
    #[param(exclusive_minimum = 0)]
    exposure: Option<f64>,
    /// Luminance in cd/m2 at the end of the scale of false colours. When absent, the one that 99 % of the pixels that see no source
    /// do not exceed.
    #[param(exclusive_minimum = 0)]
    max: Option<f64>,
    /// Spacing of luminances along the scale of false colours; linear when absent.
    #[param(inline)]
    scale: Option<ScaleSpacing>,
    /// Colours of the scale of false colours; turbo when absent.
    #[param(inline)]
    palette: Option<PaletteName>,
    /// Pixels of a PNG per unit of its figure, for the styles `captioned` and `false_colour`; 1 when absent.
    #[param(minimum = 1, maximum = 2)]
    density: Option<u8>,
}

fn kept_passes() -> Object {
    ObjectBuilder::new().schema_type(Type::Integer).enum_values(Some(PREVIEW_PASSES)).build()
}

impl PictureQuery {
    /// Refuses parameters that do not go together with the format or the style, and numbers out of their bounds.
    fn check(&self, format: Format) -> Result<(), Problem> {
        let style = self.style.unwrap_or_default();
        if style == PictureStyle::Tone && matches!(format, Format::Svg | Format::Pdf) {
            return Err(Problem::invalid_parameter("style", "must be captioned or false_colour for .svg and .pdf"));
        }
        let (is_picture, is_tone) = (format != Format::Exr, style == PictureStyle::Tone);
        let is_false = style == PictureStyle::FalseColour;
        let exposed = is_picture && !is_false && self.pass.is_none();
        let of_exposure = "is allowed only with the styles tone and captioned, and without pass";
        let of_pass = "is allowed only with .png and the style tone";
        let of_false = "is allowed only with the style false_colour";
        let of_density = "is allowed only with the styles captioned and false_colour";
        let rules = [
            ("style", self.style.is_some(), is_picture, "is allowed only with .png, .svg and .pdf"),
            ("pass", self.pass.is_some(), format == Format::Png && is_tone, of_pass),
            ("exposure", self.exposure.is_some(), exposed, of_exposure),
            ("max", self.max.is_some(), is_false, of_false),
            ("scale", self.scale.is_some(), is_false, of_false),
            ("palette", self.palette.is_some(), is_false, of_false),
            ("density", self.density.is_some(), !is_tone, of_density),
        ];
        if let Some((name, _, _, detail)) = rules.into_iter().find(|(_, given, fits, _)| *given && !*fits) {
            return Err(Problem::invalid_parameter(name, detail));
        }
        check_positive("exposure", self.exposure)?;
        check_positive("max", self.max)?;
        if let Some(pass) = self.pass.filter(|pass| !PREVIEW_PASSES.contains(pass)) {
            let detail = format!("must be one of {PREVIEW_PASSES:?}, the passes with progress images, but is {pass}");
            return Err(Problem::invalid_parameter("pass", detail));
        }
        Ok(())
    }

    fn wishes(&self) -> ViewWishes {
        let palette = match self.palette {
            None | Some(PaletteName::Turbo) => Palette::Turbo,
            Some(PaletteName::Viridis) => Palette::Viridis,
            Some(PaletteName::Inferno) => Palette::Inferno,
            Some(PaletteName::Grey) => Palette::Grey,
        };
        let spacing = if self.scale == Some(ScaleSpacing::Log) { Spacing::Logarithmic } else { Spacing::Linear };
        ViewWishes { scale_end_cd_m2: self.max, spacing, palette }
    }
}

/// Returns a picture of a view.
#[utoipa::path(get, path = "/v1/jobs/{id}/views/{file}", operation_id = "get_view", tag = "results",
    params(("id" = Uuid, Path), ("file" = String, Path, description = "The view's name; a suffix `.exr`, `.png`, \
                                                                       `.svg` or `.pdf` selects the format"), PictureQuery),
    responses(
        (status = 200, description = "OpenEXR with float layers, PNG, or a figure", content((inline(Binary) = "image/x-exr"), (inline(Binary) = "image/png"),
            (String = "image/svg+xml"), (inline(Binary) = "application/pdf"))),
        (status = 206, description = "The requested range of bytes"),
        (status = 304, description = "Not modified: the ETag in If-None-Match is still current"),
        (status = 416, description = "The range is not in the file"),
        (status = 422, description = "A parameter is not valid, or not allowed together with another one"),
        (status = 404, description = "No such job or view, or the first pass has not finished yet")))]
pub async fn view(
    app: App,
    Path((id, file)): Path<(Uuid, String)>,
    Query(query): Query<PictureQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let by_suffix = formats::by_suffix(&file, &FORMATS);
    let (name, format) = by_suffix.unwrap_or_else(|| (&file, formats::accepted(&headers, &FORMATS)));
    query.check(format)?;
    let style = query.style.unwrap_or_default();
    let answer = match (format, style, query.pass) {
        (Format::Png, _, Some(pass)) => {
            let kept = app.store.artifact(id, &progress_image(name, pass)).await?;
            let kept = kept
                .ok_or_else(|| Problem::not_found("there is no progress image of this view after this pass (yet)"))?;
            content::stored(&headers, &app.artifacts, &kept).await?
        }
        (Format::Exr, ..) | (Format::Png, PictureStyle::Tone, None) if query.exposure.is_none() => {
            result_file(&app, id, &headers, Output::View(name.to_owned(), format)).await?
        }
        _ => drawn(&app, id, &headers, (name, format), &query).await?,
    };
    let answer = formats::named(answer, &format!("{name}.{}", format.suffix()));
    Ok(if by_suffix.is_some() { answer } else { formats::vary_by_accept(answer) })
}

/// Draws a picture from the values of a view.
async fn drawn(
    app: &Service,
    id: Uuid,
    headers: &HeaderMap,
    (name, format): (&str, Format),
    query: &PictureQuery,
) -> Result<Response, Problem> {
    let (name, wishes, exposure, style) =
        (name.to_owned(), query.wishes(), query.exposure, query.style.unwrap_or_default());
    let density = scale(query.density)?;
    let figure = format.of_figure(density).unwrap_or(FigureFormat::Png(density));
    let made = read(app, id, vec![Output::View(name.clone(), Format::Exr)], move |results, _| {
        let (subject, is_false) = (results.subject(), style == PictureStyle::FalseColour);
        let view = if is_false { results.view_with_sources(&name)? } else { results.view(&name)? };
        let view = view.ok_or_else(no_such_output)?.smoothed();
        if is_false {
            return Ok(figure.write(&false_colour_figure(subject, &name, &view.seen(), wishes)?)?);
        }
        let tone = match exposure {
            Some(adaptation) => ToneMapping::adapted_to(adaptation),
            None => ToneMapping::of(view.image())?,
        };
        Ok(match style {
            PictureStyle::Captioned => figure.write(&captioned_figure(subject, &name, view.image(), tone)?)?,
            _ => png::encode(&tone.apply(view.image())?)?,
        })
    });
    content::made(headers, made.await?, figure.media_type())
}
