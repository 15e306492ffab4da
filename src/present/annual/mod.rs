//! Years of daylight of a job: the responses of its grids times the lumens of its tubes by the hour.

mod figures;
mod files;
mod honeybee;
mod hours;
mod lumens;
mod report;

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec2;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

use crate::annual::eyes::Eye;
use crate::annual::light::Sources;
use crate::annual::metrics::dimming::Dimming;
use crate::annual::metrics::{CONFIDENT, Value};
use crate::annual::moment::Convention;
use crate::annual::pattern;
use crate::annual::response::{RecordLight, Response, Responses, TubeRecord};
use crate::annual::sensors::{GridLight, Sensors, SensorsAtMoments};
use crate::annual::summary::{GridInput, Hour, Options, PointYear, Year, YearInput, year};
use crate::annual::weather::Weather;
use crate::document::annual::{AnnualDocument, DimmingDocument};
use crate::document::result::annual::YearResult;
use crate::document::result::{ExternalIlluminance, GridResult, TubeResponse};
use crate::engine::annual::WeatherYear;
use crate::engine::prepare::RenderJob;
use crate::integrator::diffuser_source::closure_source::is_lambertian;
use crate::integrator::moments::{columns, columns_of_all};
use crate::output::npy::Array;
use crate::plan::YearMethod;
use crate::plan::memory::mesh_bytes;
use crate::present::target::{TargetPart, WantedTarget};
use crate::scene::{EstimateKind, FaceKind, Grid};
use crate::traceable::{TraceableScene, TraceableTube};

pub use hours::HoursError;
pub use lumens::FileLumens;

/// Years of a job.
pub struct JobYear {
    /// Part of the document that they follow.
    document: AnnualDocument,
    /// Electric light that dims.
    dimming: Option<Dimming>,
    /// Room and tubes, of which other hours are computed, and the seed of the rays through these.
    scene: Arc<TraceableScene>,
    seed: u64,
    /// Memory of the meshes of the scene in bytes.
    scene_bytes: usize,
    /// Azimuth of the room's +y axis in radians, clockwise from north.
    rotation: f64,
    /// Sources of daylight that are simulated.
    sources: Sources,
    /// Grids, in the order of the document.
    grids: Vec<GridOfYear>,
    /// Year of the first weather file, of which there are tables and figures.
    first: FileYear,
    /// Years of the other weather files.
    others: Vec<YearResult>,
}

/// Year of a weather file.
struct FileYear {
    /// Name of the file in the document.
    name: String,
    /// Weather of the period.
    weather: Arc<Weather>,
    /// Moments from the stamp of a record to those that it stands for.
    convention: Convention,
    /// Light of the tubes by records.
    light: Arc<RecordLight>,
    /// Occupied records: one entry for each record.
    occupied: Vec<bool>,
    /// Light outside, tubes, metrics of the grids, and hours.
    year: Year,
}

/// Sensors of a grid, with their light.
struct GridOfYear {
    grid: Grid,
    /// Result under the overcast sky, without its responses.
    result: GridResult,
    /// Light of the sensors: of each weather file where their moments were computed, else one for all.
    lights: Vec<GridLight>,
    /// Eyes among the sensors; empty where there are none.
    eyes: Vec<Option<Eye>>,
    /// Other daylight in lux, sensors x records.
    other: Option<Arc<Array>>,
    /// Area in m2 that each sensor stands for; 0 for sensors without a value.
    weights: Vec<f64>,
}

impl JobYear {
    /// Computes the years of a job from the results of its grids, each with the values at all moments where these were computed, and from
    /// the light of its tubes by each weather file; `None` for a job without one.
    pub fn of(job: &RenderJob, lumens: &[Arc<FileLumens>], results: Vec<(GridResult, Vec<Value>)>) -> Option<Self> {
        let annual = job.annual.as_ref()?;
        // of discs of the area of the openings
        let radius = |tube: &TraceableTube| (tube.opening.area_m2() / PI).sqrt();
        let radii: Vec<f64> = job.traceable.tubes.iter().map(radius).collect();
        let columns = columns_of_all(annual.files.iter().map(|file| file.lit.len()));
        let is_whole = |(grid, (_, values)): (&Grid, &(GridResult, Vec<Value>))| values.len() == grid.len() * columns;
        // kept values belong to other moments if what is known of the weather has changed
        if annual.at_moments && !job.scene.grids.iter().zip(&results).all(is_whole) {
            return None;
        }
        let grids = job.scene.grids.iter().zip(&annual.others).zip(results);
        let grids: Vec<GridOfYear> = grids
            .map(|((grid, other), (result, moments))| {
                let responses = || responses_of((grid, &result), &job.traceable, &radii);
                let at_moments = || at_moments(grid, &result, &annual.files, &moments).into_iter();
                let lights = match annual.method() {
                    YearMethod::Responses => vec![GridLight::ByResponses(responses())],
                    YearMethod::Moments => at_moments().map(GridLight::AtMoments).collect(),
                    YearMethod::Both => at_moments().map(|of| GridLight::Added(responses(), of)).collect(),
                };
                GridOfYear::new(grid, result, (lights, other.clone()), &job.traceable)
            })
            .collect();
        let enclosure = &job.scene.room.enclosure;
        let floors = enclosure.faces().iter().filter(|face| face.kind == FaceKind::Floor);
        let zone_area_m2 = floors.map(|face| face.polygon.area_m2()).sum();
        let [low, high] = enclosure.bounds();
        let options = options(&annual.document);
        let of_file = |(number, (file, lumens)): (usize, (&WeatherYear, &Arc<FileLumens>))| {
            let input = |of| GridInput {
                sensors: GridOfYear::sensors(of, number, file.weather.records.len()),
                weights: &of.weights,
                zone_area_m2,
                middle: of.grid.nearest(low.midpoint(high).truncate(), |sensor| of.weights[sensor] > 0.0),
                is_level: of.grid.is_level(),
            };
            let inputs: Vec<GridInput> = grids.iter().map(input).collect();
            FileYear::new(file, lumens, (&inputs, &radii), &options)
        };
        let mut years = annual.files.iter().zip(lumens).enumerate().map(of_file);
        let first = years.next()?;
        let names: Vec<&str> = grids.iter().map(|of| of.grid.name.as_str()).collect();
        let others = years.map(|year| year.result(&names, &annual.document)).collect();
        Some(Self {
            scene: job.traceable.clone(),
            seed: job.seed,
            scene_bytes: mesh_bytes(&job.scene, &job.traceable) as usize,
            document: annual.document.clone(),
            rotation: annual.rotation,
            sources: annual.sources,
            dimming: options.dimming,
            grids,
            first,
            others,
        })
    }

    /// Estimates the memory of the years in bytes.
    pub fn bytes(&self) -> usize {
        let FileYear { weather, light, year, .. } = &self.first;
        let (tubes, lit) = (year.tubes.len(), light.records.len());
        let of_record = size_of::<Hour>() + tubes * (size_of::<[f64; 2]>() + size_of::<TubeRecord>());
        let of_sensor = size_of::<PointYear>() + SENSOR_BYTES + tubes * (size_of::<Response>() + size_of::<f64>());
        let sensors: usize = self.grids.iter().map(|of| of.weights.len()).sum();
        let of_grids = self.grids.len() * (lit * size_of::<f64>() + GRID_BYTES) * (1 + self.others.len());
        let at_moments: usize = self.grids.iter().flat_map(|of| &of.lights).map(GridLight::bytes).sum();
        let others = self.grids.iter().filter_map(|of| of.other.as_ref());
        let of_others: usize = others.map(|other| size_of_val(other.values.as_slice())).sum();
        let of_records = size_of_val(weather.records.as_slice()) + lit * of_record;
        let eyes =
            self.grids.iter().flat_map(|of| &of.eyes).map(|eye| eye.as_ref().map_or(size_of::<Eye>(), Eye::bytes));
        self.scene_bytes + of_others + of_records + sensors * of_sensor + of_grids + at_moments + eyes.sum::<usize>()
    }
}

/// Memory in bytes of the thresholds and of the place of a sensor, and of the verdicts of a grid.
const SENSOR_BYTES: usize = 1024;
const GRID_BYTES: usize = 16 << 10;

impl FileYear {
    fn new(
        file: &WeatherYear,
        lumens: &Arc<FileLumens>,
        (grids, radii): (&[GridInput], &[f64]),
        options: &Options,
    ) -> Self {
        let WeatherYear { name, weather, occupied, daylight, convention, lit } = file;
        let FileLumens { tubes, light } = &**lumens;
        let input = YearInput {
            records: &weather.records,
            records_per_hour: weather.records_per_hour,
            lit,
            tubes,
            radii,
            occupied,
            daylight,
        };
        Self {
            name: name.clone(),
            weather: weather.clone(),
            convention: *convention,
            light: light.clone(),
            occupied: occupied.clone(),
            year: year(&input, light, grids, options),
        }
    }
}

impl GridOfYear {
    /// Returns the target of the document, which is for the mean of the area.
    fn own_target(&self) -> Option<WantedTarget> {
        self.grid.target_lux.map(|lux| WantedTarget { lux, part: TargetPart::Mean })
    }

    fn new(
        grid: &Grid,
        result: GridResult,
        (lights, other): (Vec<GridLight>, Option<Arc<Array>>),
        scene: &TraceableScene,
    ) -> Self {
        let result = GridResult { tube_responses: None, ..result };
        let has_value: Vec<bool> = result.illuminance_lux.iter().flatten().map(Option::is_some).collect();
        let area = |(sensor, has_value): (usize, &bool)| match (has_value, &grid.placed) {
            (false, _) => 0.0,
            (true, Some(_)) => 1.0,
            (true, None) => grid.cell_area_m2() * grid.area.as_ref().map_or(1.0, |area| area[sensor]),
        };
        let weights: Vec<f64> = has_value.iter().enumerate().map(area).collect();
        // level grids face up
        let sensors = 0..if grid.placed.is_some() { weights.len() } else { 0 };
        let eye = |sensor: usize| Eye::new(scene, &grid.sensor(sensor)).filter(|_| has_value[sensor]);
        let eyes = sensors.into_par_iter().map(eye).collect();
        Self { grid: grid.clone(), result, lights, eyes, other, weights }
    }

    /// Returns the sensors in the year of a weather file, given by its number; the file has `records` records.
    fn sensors(&self, file: usize, records: usize) -> Sensors<'_> {
        // there is other daylight with one weather file alone
        let other_lux = self.other.as_ref().map_or(&[][..], |other| other.values.as_slice());
        let light = self.lights.get(file).unwrap_or(&self.lights[0]);
        Sensors { light, other_lux, eyes: &self.eyes, records }
    }
}

/// Converts the values of a grid at all moments of each weather file, with raised errors; its daylight factors are those of its result.
fn at_moments(grid: &Grid, result: &GridResult, files: &[WeatherYear], values: &[Value]) -> Vec<SensorsAtMoments> {
    let ExternalIlluminance { sky, sun } = result.external_horizontal_illuminance_lux;
    let raise = raise(result);
    let raised = |value: &Value| Value { standard_error: raise * value.standard_error, ..*value };
    let per_lux = if sky + sun > 0.0 { 100.0 / (sky + sun) } else { 0.0 };
    let of_grid = result.illuminance_lux.iter().flatten().zip(result.standard_error_lux.iter().flatten());
    let factor = |(lux, error): (&Option<f64>, &Option<f64>)| {
        let lux = lux.unwrap_or_default();
        // nothing is known of the error of one pass
        Value { value: per_lux * lux, standard_error: per_lux * error.map_or(lux, |error| raise * error) }
    };
    let factors: Vec<Value> = of_grid.map(factor).collect();
    let all = columns_of_all(files.iter().map(|file| file.lit.len()));
    let mut first = 0;
    let of_file = |file: &WeatherYear| {
        let own = first..first + columns(file.lit.len());
        first = own.end;
        let values: Vec<Value> = values.chunks_exact(all).flat_map(|row| &row[own.clone()]).map(raised).collect();
        let are_cells = grid.estimate == EstimateKind::CellAverage;
        SensorsAtMoments::new(&file.lit, &values, are_cells, factors.clone())
    };
    files.iter().map(of_file).collect()
}

/// Returns the factor of standard errors, which few passes know badly, that makes 1.96 of them half an interval of 95 %.
fn raise(result: &GridResult) -> f64 {
    result.coverage_factor.map_or(1.0, |factor| factor / CONFIDENT)
}

/// Converts the responses of a grid's result, with raised errors; the last of them is that to all tubes together. Tubes whose closures are not
/// Lambertian have none.
fn responses_of((grid, result): (&Grid, &GridResult), scene: &TraceableScene, radii: &[f64]) -> Responses {
    let (results, raise) = (result.tube_responses.as_deref().unwrap_or_default(), raise(result));
    let flat = |rows: &[Vec<Option<f64>>]| -> Vec<f64> {
        rows.iter().flatten().map(|value| value.unwrap_or_default()).collect()
    };
    // nothing is known of the error of one pass
    let errors = |result: &TubeResponse| -> Vec<f64> {
        let values = flat(&result.lux_per_lumen);
        result
            .standard_error
            .iter()
            .flatten()
            .zip(values)
            .map(|(error, value)| error.map_or(value, |error| raise * error))
            .collect()
    };
    let of_tube = |((result, radius), tube): ((&TubeResponse, &f64), &TraceableTube)| -> Vec<Response> {
        if !is_lambertian(tube) {
            return vec![Response::default(); result.lux_per_lumen.iter().map(Vec::len).sum()];
        }
        let moments: Vec<Vec<f64>> = result.moments.iter().map(|rows| flat(rows)).collect();
        let gradient = |sensor: usize| match &moments[..] {
            [along_x, along_y] => DVec2::new(along_x[sensor], along_y[sensor]) * (4.0 / radius),
            _ => DVec2::ZERO,
        };
        let values = flat(&result.lux_per_lumen).into_iter().zip(errors(result));
        let response = |(sensor, (lux_per_lumen, standard_error)): (usize, (f64, f64))| Response {
            lux_per_lumen,
            gradient: gradient(sensor),
            left_out: pattern::left_out(scene, tube, &grid.sensor(sensor)),
            standard_error,
        };
        values.enumerate().collect::<Vec<_>>().into_par_iter().map(response).collect()
    };
    let tubes: Vec<Vec<Response>> = results.iter().zip(radii).zip(&scene.tubes).map(of_tube).collect();
    let all = results.get(radii.len());
    let of_mean = all.and_then(|all| Some(all.mean_standard_error? * result.statistics.coverage_factor? / CONFIDENT));
    Responses::new(tubes, all.map(errors).unwrap_or_default(), of_mean)
}

fn options(document: &AnnualDocument) -> Options {
    let dimming = |dimming: DimmingDocument| Dimming {
        setpoint_lux: dimming.setpoint_lux,
        power_w_m2: dimming.power_w_m2,
        least_power: dimming.minimum_power,
        least_light: dimming.minimum_light,
        switches_off: dimming.switch_off,
    };
    Options {
        thresholds_lux: document.thresholds_lux.clone(),
        useful_lux: document.udi_lux,
        spatial_lux: document.sda.threshold_lux,
        spatial_time_percent: document.sda.time_percent,
        dimming: document.dimming.map(dimming),
    }
}
