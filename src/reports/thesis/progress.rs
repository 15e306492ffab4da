//! Error by the number of passes (the thesis' section 6.3, figures 6.7 and 6.8).

use super::case::{Case, Tried, try_all};
use super::distance::logarithmic_slope;
use super::settings::{Progress, Settings};
use super::views::{
    PPM_OWN, PPM_THESIS, Recording, SPPM_OWN, SPPM_THESIS, Sight, contenders, record, tone_mapped_like,
};
use super::{printed, scenes};
use crate::page::{Figure, ReportError, Section, Table};
use skyduct::estimate::FilmEstimate;
use skyduct::figure::Heading;
use skyduct::figure::curves::{Series, logarithmic};
use skyduct::figure::montage::montage;
use skyduct::figure::svg::svg;
use skyduct::optics::spectrum::REC709_LUMINANCE;
use skyduct::output::png;

/// Passes and paths per pixel of the reference in the full report.
const REFERENCE_PASSES: u64 = 1024;
const REFERENCE_PATHS: u64 = 4;

/// Pass from which on slopes are fitted.
const FITTED_FROM: u64 = 4;

/// Files of the pictures by the names of [`contenders`].
const PICTURES: [(&str, &str); 4] = [
    (PPM_THESIS, "progress_ppm_thesis.png"),
    (SPPM_THESIS, "progress_sppm_thesis.png"),
    (PPM_OWN, "progress_ppm_own.png"),
    (SPPM_OWN, "progress_sppm_own.png"),
];

struct Rendered {
    name: String,
    recording: Recording,
    /// Relative root mean square error by the number of passes.
    errors: Vec<(u64, f64)>,
}

pub fn sections(settings: &Settings, progress: Progress) -> Result<Vec<Section>, ReportError> {
    let document = scenes::passes(scenes::pipe_box(settings)?, settings.passes);
    let sight = Sight::of(&document)?;
    let mut reference = scenes::passes(document.clone(), settings.share(REFERENCE_PASSES));
    reference["seed"] = 1.into();
    let path_tracing = |paths: u64| serde_json::json!({ "kind": "path_tracing", "samples_per_pixel": paths });
    let mut cases = vec![
        Case::new("the reference", reference, path_tracing(REFERENCE_PATHS)),
        Case::new("path tracing, 1 path", document.clone(), path_tracing(1)),
    ];
    cases.extend(contenders(&document, settings));
    let at: Vec<u64> = printed::PICTURED_PASSES.into_iter().filter(|passes| *passes <= settings.passes).collect();
    let Tried { results: mut all, left_out } = try_all(cases, |case, prepared| {
        progress(&format!("progress in the box with the pipe: {}", case.name));
        Ok((case.name, record(prepared, &at, &[])?))
    })?;
    let (_, reference) = all.remove(0);
    let pixels: Vec<usize> =
        (0..sight.size_px[0] * sight.size_px[1]).filter(|pixel| sight.on_one_surface(*pixel)).collect();
    let rendered: Vec<Rendered> = all
        .into_iter()
        .map(|(name, recording)| {
            let error = |(passes, mean): &(u64, Vec<f64>)| (*passes, relative_error(mean, &reference.film, &pixels));
            let errors = recording.earlier.iter().map(error).collect();
            Rendered { name, recording, errors }
        })
        .collect();
    Ok(vec![Section {
        title: "3. Progress with the passes".to_owned(),
        text: format!(
            "The box of figures 6.7 and 6.8: 80 inches, the walls of a Cornell box, lit by the pipe alone and open toward \
             the eye. Pictures after {} passes, all exposed alike. The errors are root mean squares over the {} pixels that \
             see one surface with their neighbours, relative to the mean luminance there, against path tracing with {} \
             paths per pixel whose own variance is subtracted.{left_out}",
            at.iter().map(u64::to_string).collect::<Vec<_>>().join(", "),
            pixels.len(),
            settings.share(REFERENCE_PASSES) * REFERENCE_PATHS,
        ),
        tables: vec![table(&rendered)],
        figures: figures(&rendered, &reference.film)?,
        conclusion: "Theory: with a radius that shrinks by alpha the noise of gathered light falls as N^(-alpha/2) and its \
                     bias as N^(alpha-1) (Knaus and Zwicker 2011): the root mean square as N^(-0.40) at alpha = 0.8 while \
                     noise leads, and as N^(-1/3), MSE ~ N^(-2/3), at alpha = 2/3. Light without a kernel, which is all of \
                     path tracing and here the direct light of photon mapping too, falls as N^(-1/2). A series with both in \
                     its pictures lies between; a flatter one has met the error of PPM's fixed points, whose mean is not \
                     that of their pixel, however many passes there are."
            .to_owned(),
        ..Section::default()
    }])
}

/// Computes the root mean square over `pixels` of the luminance's error, minus the variance of the reference, over their mean;
/// 0 where that variance exceeds it.
fn relative_error(mean: &[f64], reference: &FilmEstimate, pixels: &[usize]) -> f64 {
    let luminance = |pixel: usize| {
        let channels = mean[3 * pixel..3 * pixel + 3].iter().zip(REC709_LUMINANCE);
        channels.map(|(value, weight)| value * weight).sum::<f64>()
    };
    let n = reference.passes;
    let (mut squares, mut sum) = (0.0, 0.0);
    for pixel in pixels {
        let truth = reference.luminance_cd_m2(*pixel);
        squares += (luminance(*pixel) - truth).powi(2) - reference.m2[*pixel] / (n - 1.0) / n;
        sum += truth;
    }
    let number = pixels.len() as f64;
    (squares / number).max(0.0).sqrt() / (sum / number)
}

fn fitted(errors: &[(u64, f64)]) -> Vec<(f64, f64)> {
    let counted = errors.iter().filter(|(passes, error)| *passes >= FITTED_FROM && *error > 0.0);
    counted.map(|(passes, error)| (*passes as f64, *error)).collect()
}

fn table(rendered: &[Rendered]) -> Table {
    let passes: Vec<u64> = rendered.first().map_or(Vec::new(), |first| first.errors.iter().map(|e| e.0).collect());
    let mut head = vec!["method".to_owned()];
    head.extend(passes.iter().map(u64::to_string));
    head.extend([format!("slope from {FITTED_FROM} on"), "theory".to_owned()]);
    let row = |rendered: &Rendered| {
        let mut row = vec![rendered.name.clone()];
        row.extend(rendered.errors.iter().map(|(_, error)| format!("{:.2} %", 100.0 * error)));
        let slope = logarithmic_slope(&fitted(&rendered.errors));
        row.push(if slope.is_finite() { format!("{slope:.2}") } else { String::new() });
        let theory = match rendered.name.as_str() {
            PPM_THESIS | SPPM_THESIS => "-0.40 to -0.50",
            PPM_OWN | SPPM_OWN => "-0.33 to -0.50",
            _ => "-0.50",
        };
        row.push(theory.to_owned());
        row
    };
    Table {
        caption: "Relative root mean square error by the number of passes".to_owned(),
        head,
        rows: rendered.iter().map(row).collect(),
    }
}

fn figures(rendered: &[Rendered], reference: &FilmEstimate) -> Result<Vec<Figure>, ReportError> {
    let mut figures = Vec::new();
    for rendered in rendered {
        let Some((_, file)) = PICTURES.into_iter().find(|(name, _)| *name == rendered.name) else { continue };
        let mut pictures = Vec::new();
        for (passes, mean) in &rendered.recording.earlier {
            let plural = if *passes == 1 { "" } else { "es" };
            pictures.push((format!("{passes} pass{plural}"), tone_mapped_like(reference, mean)?));
        }
        let last = rendered.recording.earlier.iter().map(|(passes, _)| passes.to_string()).collect::<Vec<_>>();
        figures.push(Figure {
            file,
            caption: format!("{} after {} passes (figures 6.7 and 6.8).", rendered.name, last.join(", ")),
            bytes: png::encode(&montage(&pictures, 3)?)?,
        });
    }
    let series = rendered.iter().map(|rendered| {
        let marks: Vec<(f64, f64)> = rendered.errors.iter().map(|(passes, error)| (*passes as f64, *error)).collect();
        let points = fitted(&rendered.errors);
        let slope = logarithmic_slope(&points);
        let named = if slope.is_finite() { format!(", slope {slope:.2}") } else { String::new() };
        Series { name: format!("{}{named}", rendered.name), line: fit(&points, slope), marks, ..Series::default() }
    });
    figures.push(Figure {
        file: "progress.svg",
        caption: "Relative root mean square error against the number of passes, with the fitted slopes.".to_owned(),
        bytes: svg(&logarithmic(
            &Heading::of("Error against passes"),
            &series.collect::<Vec<_>>(),
            "passes",
            "relative root mean square error",
        ))?
        .into_bytes(),
    });
    Ok(figures)
}

/// Returns the ends of the line with this slope through the middle of the points, in double logarithms.
fn fit(points: &[(f64, f64)], slope: f64) -> Vec<(f64, f64)> {
    let number = points.len() as f64;
    let middle = |of: fn(&(f64, f64)) -> f64| points.iter().map(|point| libm::log(of(point))).sum::<f64>() / number;
    let (x, y) = (middle(|point| point.0), middle(|point| point.1));
    let ends = points.first().into_iter().chain(points.last());
    ends.map(|(end, _)| (*end, libm::exp(y + slope * (libm::log(*end) - x)))).collect()
}
