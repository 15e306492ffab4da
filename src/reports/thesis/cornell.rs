//! Cornell box: photon mapping against path tracing (the thesis' section 6.1).

use super::case::{Case, Tried, try_all};
use super::distance::{Spread, difference, euclidean, lengths};
use super::settings::{Progress, Settings};
use super::views::{Recording, Sight, contenders, first_radius_m, record, tone_mapped_like};
use super::{printed, scenes};
use crate::page::{Check, Figure, ReportError, Section, Table};
use skyduct::estimate::FilmEstimate;
use skyduct::estimate::film::BLOCK_PX;
use skyduct::figure::false_colour::FalseColours;
use skyduct::figure::montage::montage;
use skyduct::output::png;
use skyduct::statistics::Moments;

/// Shortest edge of the box in metres.
const EDGE_M: f64 = 2.0;

/// Passes of photon mapping, and paths per pixel of the reference, in the full report.
const PASSES: u64 = 256;
const REFERENCE_PASSES: u64 = 256;
const REFERENCE_PATHS: u64 = 16;

/// Fraction of pixels beyond either end of a colour scale.
const TRIM: f64 = 0.002;

const CHANNELS: [&str; 3] = ["red", "green", "blue"];

/// Largest root mean square of z that noise and estimated bias explain.
const LARGEST_RMS_Z: f64 = 1.25;

/// Result of one method.
struct Rendered {
    name: String,
    first_radius_m: f64,
    /// Fraction of the first disc that lies on its surface, per pixel.
    shares: Vec<f64>,
    recording: Recording,
}

impl Rendered {
    fn clipped(&self, pixel: usize) -> bool {
        is_clipped(self.shares[pixel])
    }
}

fn is_clipped(share: f64) -> bool {
    share < 1.0 - 1e-9
}

pub fn sections(settings: &Settings, progress: Progress) -> Result<Vec<Section>, ReportError> {
    let document = scenes::passes(scenes::cornell_box(settings)?, settings.share(PASSES));
    let sight = Sight::of(&document)?;
    let pixels = sight.size_px[0] * sight.size_px[1];
    let reference_passes = settings.share(REFERENCE_PASSES);
    let mut reference = scenes::passes(document.clone(), reference_passes);
    reference["seed"] = 1.into();
    let method = serde_json::json!({ "kind": "path_tracing", "samples_per_pixel": REFERENCE_PATHS });
    let mut cases = vec![Case::new("path tracing", reference, method)];
    cases.extend(contenders(&document, settings));
    let zones_at = |radius: f64| {
        let shares = sight.disc_shares(radius);
        let zone = |at_edges: bool| {
            let counts = |pixel: &usize| sight.off_sources(*pixel) && is_clipped(shares[*pixel]) == at_edges;
            (0..pixels).filter(counts).collect::<Vec<_>>()
        };
        [zone(true), zone(false)]
    };
    let radii = [printed::INITIAL_RADIUS_M, first_radius_m(&serde_json::Value::Null, EDGE_M)];
    let zones: Vec<Vec<usize>> = radii.into_iter().flat_map(zones_at).collect();
    let Tried { results: mut all, left_out } = try_all(cases, |case, prepared| {
        progress(&format!("the Cornell box: {}", case.name));
        let recording = record(prepared, &[], &zones)?;
        let first_radius_m = first_radius_m(&case.document["method"], EDGE_M);
        let shares = sight.disc_shares(first_radius_m);
        Ok(Rendered { name: case.name, first_radius_m, shares, recording })
    })?;
    let reference = all.remove(0);
    let passes = settings.share(PASSES);
    let paths = reference_passes * REFERENCE_PATHS;
    let (boundaries, checks) = boundary_table(&sight, &all, &reference, &zones);
    Ok(vec![Section {
        title: "1. The Cornell box: photon mapping against path tracing".to_owned(),
        text: format!(
            "The thesis rendered a Cornell box for two hours by each method and took the Euclidean distance of the three \
             radiance values of each pixel (section 6.1, figures 6.1 to 6.3), in the units of its renderer, with the largest \
             errors at the boundaries of surfaces: the estimate divides by the area of the whole disc, part of which lies \
             off the surface. Below, `examples/cornell_box.json` with {size} x {size} pixels: {passes} passes of PPM and SPPM \
             against path tracing with {paths} paths per pixel. Distances are in cd/m2, the unit of the lamp's luminance \
             (18.387, 13.9873, 6.75357), and relative to the mean length of the reference's RGB vectors. The lamp is \
             rendered here by all methods; \"without the lamp\" leaves out the pixels that see it and their neighbours, as \
             the thesis removed it.{left_out}",
            size = settings.size_px,
        ),
        checks,
        tables: vec![
            distance_table(&sight, &all, &reference, passes),
            channel_table(&sight, &all, &reference),
            boundaries,
        ],
        figures: figures(&sight, &all, &reference)?,
        conclusion: conclusion(&sight, &all, &reference),
    }])
}

fn distance_table(sight: &Sight, all: &[Rendered], reference: &Rendered, passes: u64) -> Table {
    let mut rows = Vec::new();
    for thesis in &printed::CORNELL_BOX {
        let numbers = [
            thesis.iterations.to_string(),
            format!("{:.1e}", thesis.distance_lowest),
            thesis.distance_highest.to_string(),
            thesis.distance_mean_with_lamp.to_string(),
            thesis.distance_mean.to_string(),
            String::new(),
        ];
        rows.push(
            [format!("the thesis, {} (its own path tracer)", thesis.method)].into_iter().chain(numbers).collect(),
        );
    }
    let truth = &reference.recording.film.mean;
    let mean_length = Spread::of(&lengths(truth), |pixel| sight.inside(pixel)).mean;
    for rendered in all {
        let distances = euclidean(&rendered.recording.film.mean, truth);
        let with_lamp = Spread::of(&distances, |pixel| sight.inside(pixel));
        let without = Spread::of(&distances, |pixel| sight.off_sources(pixel));
        let numbers = [
            passes.to_string(),
            format!("{:.1e}", without.lowest),
            format!("{:.4}", without.highest),
            format!("{:.5}", with_lamp.mean),
            format!("{:.5}", without.mean),
            format!("{:.2} %", 100.0 * without.mean / mean_length),
        ];
        rows.push([rendered.name.clone()].into_iter().chain(numbers).collect());
    }
    Table {
        caption: format!(
            "Euclidean distance of RGB to path tracing; mean length of the reference's RGB {mean_length:.4} cd/m2"
        ),
        head: [
            "method",
            "passes",
            "lowest, without the lamp",
            "highest, without the lamp",
            "mean with the lamp",
            "mean without the lamp",
            "relative",
        ]
        .map(str::to_owned)
        .into(),
        rows,
    }
}

fn channel_table(sight: &Sight, all: &[Rendered], reference: &Rendered) -> Table {
    let mut rows = Vec::new();
    for thesis in &printed::CORNELL_BOX {
        let name = format!("the thesis, {}", thesis.method);
        let mean = thesis.red_mean.to_string();
        rows.push(vec![name, CHANNELS[0].to_owned(), String::new(), String::new(), String::new(), mean]);
    }
    for rendered in all {
        for (channel, name) in CHANNELS.into_iter().enumerate() {
            let differences = difference(&rendered.recording.film.mean, &reference.recording.film.mean, channel);
            let signed = Spread::of(&differences, |pixel| sight.off_sources(pixel));
            let magnitudes: Vec<f64> = differences.iter().map(|value| value.abs()).collect();
            let mean = Spread::of(&magnitudes, |pixel| sight.off_sources(pixel)).mean;
            rows.push(vec![
                rendered.name.clone(),
                name.to_owned(),
                format!("{:.4}", signed.lowest),
                format!("{:.4}", signed.highest),
                format!("{:+.5}", signed.mean),
                format!("{mean:.5}"),
            ]);
        }
    }
    Table {
        caption:
            "Difference of each channel, method less path tracing, without the lamp (the thesis prints the mean of \
                  red, its largest, without saying whether of magnitudes)"
                .to_owned(),
        head: ["method", "channel", "lowest", "highest", "mean", "mean of magnitudes"].map(str::to_owned).into(),
        rows,
    }
}

/// Compares z of blocks and luminance of zones with the reference, where the first disc reaches over an edge and elsewhere.
fn boundary_table(sight: &Sight, all: &[Rendered], reference: &Rendered, zones: &[Vec<usize>]) -> (Table, Vec<Check>) {
    let mut rows = Vec::new();
    let mut checks = Vec::new();
    for rendered in all {
        let [at_edges, elsewhere] =
            [true, false].map(|at_edges| block_z(sight, rendered, &reference.recording.film, at_edges));
        // the zones of the thesis' radius come first
        let first = if rendered.first_radius_m == printed::INITIAL_RADIUS_M { 0 } else { 2 };
        let of_zone =
            |zone: usize| relative_difference(&rendered.recording.zones[zone], &reference.recording.zones[zone]);
        let shares = Spread::of(&rendered.shares, |pixel| sight.off_sources(pixel) && rendered.clipped(pixel));
        rows.push(vec![
            rendered.name.clone(),
            format!("{:.2} ({})", at_edges.rms, at_edges.count),
            format!("{:.2} ({})", elsewhere.rms, elsewhere.count),
            format!("{} ({})", of_zone(first), zones[first].len()),
            format!("{} ({})", of_zone(first + 1), zones[first + 1].len()),
            format!("{:.1} %", 100.0 * (shares.mean - 1.0)),
        ]);
        if at_edges.count == 0 {
            continue;
        }
        checks.push(Check {
            name: format!("{}: rms z of blocks at edges", rendered.name),
            compared: at_edges.count,
            worst: at_edges.rms,
            limit: LARGEST_RMS_Z,
            unit: "combined standard errors, estimated bias included",
        });
    }
    let table = Table {
        caption: format!(
            "Edges and corners against elsewhere, without the lamp. z: difference of the luminance of blocks of {BLOCK_PX} \
             x {BLOCK_PX} pixels over the combined standard error, estimated bias included; a block is at an edge when the \
             first disc of one of its pixels reaches over an edge of its surface. Then the mean luminance of the pixels \
             whose first disc does so and of the others, method less path tracing; last, what their gathered light would \
             lose there in the first pass if it were divided by the whole disc. In brackets the number of blocks and pixels"
        ),
        head: [
            "method",
            "rms z at edges",
            "rms z elsewhere",
            "luminance at edges",
            "luminance elsewhere",
            "unclipped disc would give",
        ]
        .map(str::to_owned)
        .into(),
        rows,
    };
    (table, checks)
}

/// Root mean square of z over some blocks, and their number.
struct BlockZ {
    rms: f64,
    count: usize,
}

fn block_z(sight: &Sight, rendered: &Rendered, reference: &FilmEstimate, at_edges: bool) -> BlockZ {
    let film = &rendered.recording.film;
    let [width, height] = film.size_px;
    let across = width.div_ceil(BLOCK_PX);
    let (mut squares, mut count) = (0.0, 0);
    for block in 0..film.blocks.len() {
        let (x, y) = (block % across * BLOCK_PX, block / across * BLOCK_PX);
        let pixels = || {
            (y..(y + BLOCK_PX).min(height))
                .flat_map(move |row| (x..(x + BLOCK_PX).min(width)).map(move |column| row * width + column))
        };
        if !pixels().all(|pixel| sight.off_sources(pixel)) || pixels().any(|pixel| rendered.clipped(pixel)) != at_edges
        {
            continue;
        }
        let error = libm::hypot(film.block_standard_error_cd_m2(block), reference.block_standard_error_cd_m2(block));
        squares += ((film.blocks[block].mean - reference.blocks[block].mean) / error).powi(2);
        count += 1;
    }
    BlockZ { rms: (squares / count as f64).sqrt(), count }
}

fn relative_difference(value: &Moments, reference: &Moments) -> String {
    let relative = |of: f64| 100.0 * of / reference.mean;
    let error = libm::hypot(value.standard_error(), reference.standard_error());
    format!("{:+.2} % (s.e. {:.2})", relative(value.mean - reference.mean), relative(error))
}

fn figures(sight: &Sight, all: &[Rendered], reference: &Rendered) -> Result<Vec<Figure>, ReportError> {
    let truth = &reference.recording.film;
    let mut pictures = vec![(reference.name.clone(), tone_mapped_like(truth, &truth.mean)?)];
    for rendered in all {
        pictures.push((short(&rendered.name), tone_mapped_like(truth, &rendered.recording.film.mean)?));
    }
    let inside = |values: &[f64]| {
        let counts = values.iter().enumerate().filter(|(pixel, _)| sight.off_sources(*pixel));
        counts.map(|(_, value)| *value).collect::<Vec<_>>()
    };
    let distances: Vec<Vec<f64>> =
        all.iter().map(|rendered| euclidean(&rendered.recording.film.mean, &truth.mean)).collect();
    let colours = FalseColours::magnitudes(
        &distances.iter().flat_map(|values| inside(values)).collect::<Vec<_>>(),
        TRIM,
        "cd/m2",
    );
    let mut maps = Vec::new();
    for (rendered, distances) in all.iter().zip(&distances) {
        maps.push((short(&rendered.name), colours.paint(sight.size_px, distances)?.enlarged(2)));
    }
    let mut differences = Vec::new();
    for rendered in all {
        for (channel, name) in CHANNELS.into_iter().enumerate() {
            let values = difference(&rendered.recording.film.mean, &truth.mean, channel);
            differences.push((format!("{}: {name}", rendered.name), values));
        }
    }
    let every: Vec<f64> = differences.iter().flat_map(|(_, values)| inside(values)).collect();
    let signed = FalseColours::differences(&every, TRIM, "cd/m2");
    let mut channels = Vec::new();
    for (name, values) in &differences {
        channels.push((short(name), signed.paint(sight.size_px, values)?.enlarged(2)));
    }
    let names = all.iter().map(|rendered| rendered.name.as_str()).collect::<Vec<_>>().join("; ");
    Ok(vec![
        Figure {
            file: "cornell_box.png",
            caption: format!("The Cornell box (the thesis' figure 6.1): path tracing; {names}."),
            bytes: png::encode(&montage(&pictures, 3)?)?,
        },
        Figure {
            file: "cornell_distance.png",
            caption: format!(
                "Euclidean distance of RGB to path tracing in cd/m2 (figures 6.2 and 6.3, top left): {names}."
            ),
            bytes: png::encode(&colours.with_scale(&montage(&maps, 2)?)?)?,
        },
        Figure {
            file: "cornell_channels.png",
            caption: format!(
                "Difference of red, green and blue, method less path tracing, in cd/m2 (figures 6.2 and 6.3): {names}."
            ),
            bytes: png::encode(&signed.with_scale(&montage(&channels, 3)?)?)?,
        },
    ])
}

/// Shortens a title to fit a picture.
fn short(name: &str) -> String {
    name.replace(", thesis' settings", " thesis").replace(", own settings", " own")
}

fn conclusion(sight: &Sight, all: &[Rendered], reference: &Rendered) -> String {
    let truth = &reference.recording.film.mean;
    let mean_length = Spread::of(&lengths(truth), |pixel| sight.inside(pixel)).mean;
    let parts = all.iter().map(|rendered| {
        let distances = euclidean(&rendered.recording.film.mean, truth);
        let mean = |clipped: bool| {
            let counts = |pixel| sight.off_sources(pixel) && rendered.clipped(pixel) == clipped;
            100.0 * Spread::of(&distances, counts).mean / mean_length
        };
        format!("{} {:.2} % at edges and {:.2} % elsewhere", rendered.name, mean(true), mean(false))
    });
    format!(
        "Mean distance of the pixels whose first disc reaches over an edge and of the others, relative to the mean length: {}. \
         In the thesis' figures the error stands at the edges. Here what SPPM has there is noise, as z says. PPM has lines \
         of both signs: it looks through the same few points of a pixel in every pass, which do not give the mean of a pixel \
         that two surfaces share; that error is of the image, its standard error counts it, and it is no loss of energy.",
        parts.collect::<Vec<_>>().join("; ")
    )
}
