//! Time to an accuracy of a picture: the Cornell box S4.

use serde_json::json;

use super::case::{Case, Run};
use super::measure::{Quartiles, as_time, percent, time};
use super::peers;
use super::reference::{block_error, pixel_error};
use super::scenes;
use super::settings::{Progress, Settings};
use crate::page::{Figure, ReportError, Section, Table};
use skyduct::estimate::FilmEstimate;
use skyduct::figure::Heading;
use skyduct::figure::curves::{Series, logarithmic};
use skyduct::figure::svg::svg;

/// Requested relative errors of blocks.
const ASKED: [f64; 6] = [0.1, 0.05, 0.02, 0.01, 0.005, 0.001];

/// Luminances in cd/m2 of the pixels that are compared, without the background and the lamp itself.
const COMPARED: std::ops::Range<f64> = 1e-3..5.0;

/// Passes of the reference (in the whole benchmark, in a trial), and its paths per pixel.
const REFERENCE_PASSES: [u64; 2] = [128, 8];
const REFERENCE_PATHS: u64 = 4;

/// Errors and time of a number of passes.
struct Passes {
    number: u64,
    seconds: f64,
    blocks: f64,
    pixels: f64,
}

/// Measures the picture on the current pool against `reference`.
pub fn section(settings: &Settings, reference: &FilmEstimate, progress: Progress) -> Result<Section, ReportError> {
    let case = scenes::stored(settings, "S4")?;
    let by_passes = by_passes(settings, &case, reference, progress.part(0.0, 0.5))?;
    let asked = asked(settings, &case, reference, progress.part(0.5, 1.0))?;
    Ok(Section {
        title: "Time to an accuracy: a picture".to_owned(),
        text: format!(
            "The Cornell box S4, 256 x 256 pixels in colours, by the method that `auto` takes, on one thread. The \
             error of pixels is the root mean square over those that see neither the lamp nor the background, over \
             their mean luminance (of other programs: over the channels); the error of blocks of 8 x 8 pixels is \
             relative to each block's luminance, and jobs stop by it. Both are against path tracing with {} paths for \
             each pixel, whose own variance is subtracted, so that the bias of photon mapping counts.",
            settings.either(REFERENCE_PASSES[0], REFERENCE_PASSES[1]) * REFERENCE_PATHS
        ),
        tables: vec![asked, table(&by_passes)],
        figures: vec![figure(settings, &by_passes)?],
        ..Section::default()
    })
}

/// Renders the reference by path tracing, on the current pool.
pub fn reference(settings: &Settings) -> Result<FilmEstimate, ReportError> {
    let mut case = scenes::stored(settings, "S4")?;
    case.document["method"] = json!({ "kind": "path_tracing", "samples_per_pixel": REFERENCE_PATHS });
    let passes = settings.either(REFERENCE_PASSES[0], REFERENCE_PASSES[1]);
    Ok(film(case.passes(passes, 600.0).run()?))
}

fn film(run: Run) -> FilmEstimate {
    run.estimate.views.into_iter().next().unwrap_or_default()
}

fn by_passes(
    settings: &Settings,
    case: &Case,
    reference: &FilmEstimate,
    progress: Progress,
) -> Result<Vec<Passes>, ReportError> {
    let mut all = Vec::new();
    let most = settings.either(8, 4);
    for number in 0..most {
        let passes = 1 << number;
        progress.step(number, most, &format!("the Cornell box, {passes} passes"));
        let run = case.clone().passes(passes, 600.0).run()?;
        let seconds = run.passes;
        let film = film(run);
        let pixels = pixel_error(&film, reference, COMPARED);
        all.push(Passes { number: passes, seconds, blocks: block_error(&film, reference), pixels });
        if 2.0 * seconds > settings.longest_job() {
            break;
        }
    }
    Ok(all)
}

fn asked(settings: &Settings, case: &Case, reference: &FilmEstimate, progress: Progress) -> Result<Table, ReportError> {
    let mut rows = Vec::new();
    for (number, asked) in ASKED.into_iter().enumerate() {
        progress.step(number, ASKED.len(), &format!("the Cornell box to {}", percent(asked)));
        let run = case.clone().to(asked, settings.longest_job()).run()?;
        let (met, seconds, told, passes) = (run.met, run.passes, run.told, run.estimate.passes);
        let film = film(run);
        rows.push(vec![
            percent(asked),
            if met { time(seconds) } else { format!("not within {}", time(seconds)) },
            percent(told),
            percent(block_error(&film, reference)),
            percent(pixel_error(&film, reference, COMPARED)),
            passes.to_string(),
        ]);
        if !met {
            break;
        }
    }
    Ok(Table {
        caption: "S4 to the error of its blocks".to_owned(),
        head: ["requested error", "processor time", "reported", "actual", "actual, pixels", "passes"]
            .map(str::to_owned)
            .into(),
        rows,
    })
}

fn table(all: &[Passes]) -> Table {
    let row = |passes: &Passes| {
        vec![passes.number.to_string(), time(passes.seconds), percent(passes.pixels), percent(passes.blocks)]
    };
    Table {
        caption: "S4 by its passes".to_owned(),
        head: ["passes", "processor time", "actual error of pixels", "actual error of blocks"]
            .map(str::to_owned)
            .into(),
        rows: all.iter().map(row).collect(),
    }
}

fn figure(settings: &Settings, all: &[Passes]) -> Result<Figure, ReportError> {
    let points: Vec<_> = all.iter().map(|passes| (passes.seconds, 100.0 * passes.pixels)).collect();
    let ours = Series { name: "skyduct".to_owned(), marks: points.clone(), line: points, ..Series::default() };
    let series: Vec<_> = [ours].into_iter().chain(peers::series("S4", settings.beside())).collect();
    let heading = Heading::of("S4, the Cornell box: error of pixels and processor time; dashed: other programs");
    let drawing = logarithmic(&heading, &series, "processor seconds of one core", "actual error in percent");
    let caption = "S4: actual relative error of the pixels against processor seconds of one core.".to_owned();
    Ok(Figure { file: "s4.svg", caption, bytes: svg(&drawing)?.into_bytes() })
}

/// Measures the room of the thesis with its view, to the accuracies of its document.
pub fn demo(settings: &Settings) -> Result<Table, ReportError> {
    let case = scenes::demo()?;
    let runs = case.runs(settings.either(super::measure::Repeats { most: 5, seconds: 20.0 }, settings.repeats()))?;
    let seconds = Quartiles::of(runs.iter().map(|run| run.passes));
    let passes = |of: fn(&Run) -> u64| runs.first().map_or_else(String::new, |run| of(run).to_string());
    Ok(Table {
        caption: "The thesis room with its grids to 1 % and its view of 384 x 384 pixels to 5 %, at 95 %".to_owned(),
        head: ["processor time", "passes of the grids", "passes of the view"].map(str::to_owned).into(),
        rows: vec![vec![
            as_time(&seconds),
            passes(|run| run.estimate.passes_of_grids()),
            passes(|run| run.estimate.passes_of_views()),
        ]],
    })
}
