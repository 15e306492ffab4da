//! Files of a job's results: what each shows, its format, and its name.

use serde::Deserialize;

use crate::figure::FigureFormat;
use crate::figure::paint::Scale;

/// Format of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// Numbers with their names.
    Json,
    /// Table.
    Csv,
    /// Pixels.
    Png,
    /// Vector graphics, for web pages.
    Svg,
    /// Vector graphics, for print.
    Pdf,
    /// Pixels with all digits.
    #[serde(skip)]
    Exr,
    /// Web page.
    #[serde(skip)]
    Html,
    /// Array of NumPy.
    #[serde(skip)]
    Npy,
    /// Illuminances as Radiance writes them.
    #[serde(skip)]
    Ill,
    /// Binary glTF.
    #[serde(skip)]
    Glb,
    /// Plain text.
    #[serde(skip)]
    Txt,
}

impl Format {
    /// Every format.
    pub const ALL: [Self; 11] = [
        Self::Json,
        Self::Csv,
        Self::Png,
        Self::Svg,
        Self::Pdf,
        Self::Exr,
        Self::Html,
        Self::Npy,
        Self::Ill,
        Self::Glb,
        Self::Txt,
    ];

    /// Returns the extension of a file's name, without the dot.
    pub fn suffix(self) -> &'static str {
        match self {
            Self::Json => "json",
            Self::Csv => "csv",
            Self::Png => "png",
            Self::Svg => "svg",
            Self::Pdf => "pdf",
            Self::Exr => "exr",
            Self::Html => "html",
            Self::Npy => "npy",
            Self::Ill => "ill",
            Self::Glb => "glb",
            Self::Txt => "txt",
        }
    }

    /// Returns the media type without parameters.
    pub fn media_type(self) -> &'static str {
        match self {
            Self::Json => "application/json",
            Self::Csv => "text/csv",
            Self::Png => "image/png",
            Self::Svg => "image/svg+xml",
            Self::Pdf => "application/pdf",
            Self::Exr => "image/x-exr",
            Self::Html => "text/html",
            Self::Npy => "application/octet-stream",
            Self::Ill | Self::Txt => "text/plain",
            Self::Glb => "model/gltf-binary",
        }
    }

    /// Returns the format of a figure, for PNG with this scale; `None` for formats that are none of a figure.
    pub fn of_figure(self, scale: Scale) -> Option<FigureFormat> {
        match self {
            Self::Svg => Some(FigureFormat::Svg),
            Self::Png => Some(FigureFormat::Png(scale)),
            Self::Pdf => Some(FigureFormat::Pdf),
            Self::Json | Self::Csv | Self::Exr | Self::Html | Self::Npy | Self::Ill | Self::Glb | Self::Txt => None,
        }
    }
}

/// File of the results of a job. Grids and views have names, tubes numbers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Output {
    /// Grid as JSON, as a table, or as a map over the plan of the room.
    Grid(String, Format),
    /// View as EXR, or tone-mapped as PNG.
    View(String, Format),
    /// View in false colours.
    FalseColours(String, Format),
    /// Report on a tube as JSON, or its transmission against the sun's altitude.
    Tube(usize, Format),
    /// Light on the faces of the room as JSON, or as a model.
    Surfaces(Format),
    /// Triangles of the meshes of objects and tubes.
    Meshes,
    /// Part of a year.
    Annual(Annual, Format),
}

/// Part of the results of a year; grids have names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Annual {
    /// Metrics of the grids, light of the tubes, and verdicts.
    Summary,
    /// Table of the records with light.
    Hours,
    /// Light of all tubes by day and hour.
    Fluxes,
    /// Metrics of the sensors of a grid, or their illuminances in all records.
    Points(String),
    /// Illuminances of the sensors of a grid at all moments with standard errors, where they were computed.
    Moments(String),
    /// Daylight autonomy of a grid over the plan.
    Autonomy(String),
    /// Share of the hours with useful daylight of a grid over the plan.
    Useful(String),
    /// Mean illuminance of a grid by day and hour.
    ByHour(String),
    /// Fractions of the electric power in all records.
    Lighting,
    /// Part of the folder for Honeybee.
    Honeybee(Honeybee),
}

/// Path of the figures of daylight autonomy below that of the job, before the name of the grid.
pub const AUTONOMY: &str = "annual/autonomy.";

/// Group of apertures without schedules, in folders for Honeybee.
pub const STATIC_APERTURES: &str = "__static_apertures__";

/// File for the post-processing of Honeybee; grids have names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Honeybee {
    /// Grids and the groups of apertures that light them.
    Grids,
    /// Records of the year.
    Study,
    /// Hours of the records with light.
    SunUpHours,
    /// Illuminances of the sensors of a grid in the records with light.
    Points(String),
}

impl Honeybee {
    fn file(&self) -> String {
        match self {
            Self::Grids => "grids_info".to_owned(),
            Self::Study => "study_info".to_owned(),
            Self::SunUpHours => "sun-up-hours".to_owned(),
            Self::Points(name) => format!("{STATIC_APERTURES}/default/total/{name}"),
        }
    }
}

impl Output {
    /// Returns the name of the file, e.g. `grids/workplane.json`.
    pub fn file(&self) -> String {
        let suffix = self.format().suffix();
        match self {
            Self::Grid(name, _) => format!("grids/{name}.{suffix}"),
            Self::View(name, _) => format!("views/{name}.{suffix}"),
            // a folder of its own: a view may be called `a.false_colour`
            Self::FalseColours(name, _) => format!("false_colours/{name}.{suffix}"),
            Self::Tube(number, _) => format!("tubes/{number}.{suffix}"),
            Self::Annual(part, _) => match part {
                Annual::Summary => format!("annual.{suffix}"),
                Annual::Hours => format!("annual/hours.{suffix}"),
                Annual::Fluxes => format!("annual/fluxes.{suffix}"),
                Annual::Points(name) => format!("annual/points.{name}.{suffix}"),
                Annual::Moments(name) => format!("annual/moments.{name}.{suffix}"),
                Annual::Autonomy(name) => format!("{AUTONOMY}{name}.{suffix}"),
                Annual::Useful(name) => format!("annual/useful.{name}.{suffix}"),
                Annual::ByHour(name) => format!("annual/by_hour.{name}.{suffix}"),
                Annual::Lighting => format!("annual/lighting.{suffix}"),
                Annual::Honeybee(part) => format!("annual/honeybee/{}.{suffix}", part.file()),
            },
            Self::Surfaces(Format::Glb) => format!("scene.{suffix}"),
            Self::Surfaces(_) => format!("surfaces.{suffix}"),
            Self::Meshes => format!("meshes.{suffix}"),
        }
    }

    /// Returns the format of the file.
    pub fn format(&self) -> Format {
        match self {
            Self::Grid(_, format)
            | Self::View(_, format)
            | Self::FalseColours(_, format)
            | Self::Tube(_, format)
            | Self::Annual(_, format)
            | Self::Surfaces(format) => *format,
            Self::Meshes => Format::Json,
        }
    }

    /// Returns the format of the figure in the file; `None` where it has numbers, or the picture of a view alone.
    pub fn figure(&self) -> Option<FigureFormat> {
        if matches!(self, Self::View(..)) { None } else { self.format().of_figure(Scale::Single) }
    }
}

/// Lists the files of a job's results: of its grids and views, by their names, of `tubes` tubes, and of the faces of its room
/// where it has `surfaces`; [`Output::Meshes`] is not among them. The service serves these files,
/// `render` writes them and `submit` fetches them.
pub fn result_outputs<'a>(
    grids: impl IntoIterator<Item = &'a str>,
    views: impl IntoIterator<Item = &'a str>,
    tubes: usize,
    surfaces: bool,
) -> Vec<Output> {
    use Format::{Csv, Exr, Glb, Json, Pdf, Png, Svg};
    let grids = grids.into_iter();
    let grids = grids.flat_map(|name| [Json, Csv, Svg, Png, Pdf].map(|format| Output::Grid(name.to_owned(), format)));
    let views = views.into_iter().flat_map(|name| {
        let pictures = [Exr, Png].map(|format| Output::View(name.to_owned(), format));
        pictures.into_iter().chain([Svg, Png, Pdf].map(|format| Output::FalseColours(name.to_owned(), format)))
    });
    let tubes = (0..tubes).flat_map(|tube| [Json, Svg, Png, Pdf].map(|format| Output::Tube(tube, format)));
    let surfaces = [Json, Glb].map(Output::Surfaces).into_iter().filter(|_| surfaces);
    grids.chain(views).chain(tubes).chain(surfaces).collect()
}

/// Lists the files of a year with these grids, in the order of [`result_outputs`], which has those of every job; `dimming` tells whether it has
/// electric light.
pub fn annual_outputs<'a>(grids: impl IntoIterator<Item = &'a str>, dimming: bool) -> Vec<Output> {
    use Format::{Csv, Ill, Json, Npy, Pdf, Png, Svg, Txt};
    let part = |part: Annual, formats: &[Format]| -> Vec<Output> {
        formats.iter().map(|format| Output::Annual(part.clone(), *format)).collect()
    };
    let figure = [Svg, Png, Pdf];
    let of_grid = |name: &str| {
        let points = part(Annual::Points(name.to_owned()), &[Json, Csv, Npy, Ill]);
        let maps =
            [Annual::Autonomy(name.to_owned()), Annual::Useful(name.to_owned()), Annual::ByHour(name.to_owned())];
        let of_honeybee = part(Annual::Honeybee(Honeybee::Points(name.to_owned())), &[Npy]);
        points
            .into_iter()
            .chain(maps.into_iter().flat_map(|map| part(map, &figure)))
            .chain(of_honeybee)
            .collect::<Vec<_>>()
    };
    let honeybee = [(Honeybee::Grids, Json), (Honeybee::Study, Json), (Honeybee::SunUpHours, Txt)];
    let honeybee = honeybee.map(|(file, format)| Output::Annual(Annual::Honeybee(file), format));
    let lighting = if dimming { part(Annual::Lighting, &[Csv]) } else { Vec::new() };
    let whole = [part(Annual::Summary, &[Json]), part(Annual::Hours, &[Csv]), lighting, part(Annual::Fluxes, &figure)];
    whole.into_iter().flatten().chain(honeybee).chain(grids.into_iter().flat_map(of_grid)).collect()
}

/// Lists the files of a year that is computed moment by moment, beside [`annual_outputs`]: one for each grid.
pub fn moments_outputs<'a>(grids: impl IntoIterator<Item = &'a str>) -> impl Iterator<Item = Output> {
    grids.into_iter().map(|name| Output::Annual(Annual::Moments(name.to_owned()), Format::Npy))
}

/// Returns the name of the file that shows a view after some of its passes.
pub fn progress_image(view: &str, passes: u64) -> String {
    // a folder of its own: a view may be called `a.pass16`
    format!("progress/{view}.pass{passes}.png")
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn no_two_outputs_have_one_file() {
        let views = ["a", "a.false_colour", "a.pass16", "a.png", "false_colours"];
        let grids = ["a", "a.json", "a.png", "hours", "points.a"];
        let outputs = [result_outputs(grids, views, 2, true), annual_outputs(grids, true)].concat();
        let mut files: Vec<String> = outputs.iter().map(Output::file).collect();
        files.extend(views.iter().flat_map(|view| [1, 16].map(|passes| progress_image(view, passes))));
        let distinct: BTreeSet<&String> = files.iter().collect();
        assert_eq!(distinct.len(), files.len(), "{files:?}");
        // a file is no folder of another one
        for file in &files {
            assert!(!files.iter().any(|other| other.starts_with(&format!("{file}/"))), "{file}");
        }
    }
}
