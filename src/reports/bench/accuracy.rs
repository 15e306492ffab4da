//! Time to an accuracy on the grids of S1, S2 and S3.

use super::case::{Run, all_met, passes, set_up};
use super::measure::{Quartiles, as_time, percent, time};
use super::peers;
use super::reference::Reference;
use super::scenes;
use super::settings::{Progress, Settings};
use crate::page::{Figure, ReportError, Section, Table};
use skyduct::figure::Heading;
use skyduct::figure::curves::{Series, logarithmic};
use skyduct::figure::svg::svg;

/// Requested relative standard errors.
const ASKED: [f64; 6] = [0.1, 0.05, 0.02, 0.01, 0.005, 0.001];

/// Scenes with their references and their names in figures.
const SCENES: [(&str, &str, &str); 4] = [
    ("S1", "S1.exact.point", "skyduct"),
    ("S2", "S2.exact.point", "skyduct"),
    ("S3", "S3.mesh.point", "skyduct, closed form of the bends"),
    ("S3_mesh", "S3.mesh.point", "skyduct, mesh of 30 000 triangles"),
];

/// Runs of a scene to one accuracy.
struct Cell {
    asked: f64,
    runs: Vec<Run>,
    /// Relative error against the reference.
    error: f64,
}

pub fn section(settings: &Settings, progress: Progress) -> Result<Section, ReportError> {
    let mut tables = Vec::new();
    let mut lines: Vec<(&str, Vec<Series>)> = vec![("S1", Vec::new()), ("S2", Vec::new()), ("S3", Vec::new())];
    for (number, (scene, reference, name)) in SCENES.into_iter().enumerate() {
        let cells = cells(settings, scene, reference, progress.part(0.25 * number as f64, 0.25 * (number + 1) as f64))?;
        if let Some((_, series)) = lines.iter_mut().find(|(prefix, _)| scene.starts_with(prefix)) {
            series.push(line(name, &cells));
        }
        tables.push(table(scene, &cells));
    }
    let figures = lines.into_iter().map(|(scene, ours)| figure(settings, scene, ours)).collect::<Result<_, _>>()?;
    Ok(Section {
        title: "Time to an accuracy".to_owned(),
        text: "Processor seconds of one thread until the 9 x 9 points on the floor have the requested relative \
               standard error (root mean square over the points) at 95 % by Student's t: medians of runs with seeds \
               of their own, quartiles in brackets. Such a job first checks its error after eight passes, so that errors \
               of some percent cost no more than one of 1 %. \"Reported\" is the median of the errors that the jobs \
               report, \"actual\" the root mean square over all runs against independent references \
               (`tests/reference/README.md`), with the references' own error (0.02 to 0.03 %) subtracted. The errors \
               of a run's points are correlated as far as they come from the flux through the tube: the fewer runs, \
               the rougher the actual error. The set-up lasts from the document to the first pass and is not part of \
               the seconds. S1 is the thesis' room under a clear sky with a straight tube and a Lambertian diffuser; \
               S2 has the sun and a clear sheet instead; S3 has two bends and a dome, in closed form and as a mesh \
               whose hits are decided in f64. Dashed in the figures: the other programs of the section above."
            .to_owned(),
        tables,
        figures,
        ..Section::default()
    })
}

fn cells(settings: &Settings, scene: &str, reference: &str, progress: Progress) -> Result<Vec<Cell>, ReportError> {
    let case = scenes::stored(settings, scene)?;
    let file = settings.reference.join("scenes").join(format!("{reference}.reference.json"));
    let reference = Reference::read(&file)?;
    // a first run, which reads and builds everything, takes longer
    case.clone().to(0.1, settings.longest_job()).run()?;
    let cells = ASKED.into_iter().enumerate().map(|(number, asked)| {
        progress.step(number, ASKED.len(), &format!("{scene} to {}", percent(asked)));
        let runs = case.clone().to(asked, settings.longest_job()).runs(settings.repeats_to_accuracy())?;
        Ok(Cell { asked, error: reference.error(&runs), runs })
    });
    cells.collect()
}

fn table(scene: &str, cells: &[Cell]) -> Table {
    let median = |runs: &[Run], of: fn(&Run) -> f64| Quartiles::of(runs.iter().map(of)).median;
    let row = |Cell { asked, runs, error }: &Cell| {
        let seconds =
            if all_met(runs) { as_time(&passes(runs)) } else { format!("not within {}", time(passes(runs).upper)) };
        vec![
            percent(*asked),
            seconds,
            percent(median(runs, |run| run.told)),
            percent(*error),
            format!("{}", median(runs, |run| run.estimate.passes as f64)),
            runs.len().to_string(),
            time(set_up(runs).median),
        ]
    };
    Table {
        caption: scene.to_owned(),
        head: ["requested error", "processor time", "reported", "actual", "passes", "runs", "set-up"]
            .map(str::to_owned)
            .into(),
        rows: cells.iter().map(row).collect(),
    }
}

fn line(name: &str, cells: &[Cell]) -> Series {
    let points: Vec<_> = cells.iter().map(|cell| (passes(&cell.runs).median, 100.0 * cell.error)).collect();
    Series { name: name.to_owned(), marks: points.clone(), line: points, ..Series::default() }
}

fn figure(settings: &Settings, scene: &str, mut series: Vec<Series>) -> Result<Figure, ReportError> {
    series.extend(peers::series(scene, settings.beside()));
    let file = match scene {
        "S1" => "s1.svg",
        "S2" => "s2.svg",
        _ => "s3.svg",
    };
    let heading = Heading::of(format!("{scene}: actual error and processor time; dashed: other programs"));
    let drawing = logarithmic(&heading, &series, "processor seconds of one core", "actual error in percent");
    let caption =
        format!("{scene}: actual relative error of the floor's points against processor seconds of one core.");
    Ok(Figure { file, caption, bytes: svg(&drawing)?.into_bytes() })
}
