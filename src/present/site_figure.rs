//! Figures of a job's site: its sky with the sun's path of the day, sections through room, roof and tubes, and the fluxes along a tube.

use glam::{DVec2, DVec3};
use serde::Deserialize;
use serde_json::Value;

use super::light_paths::{SideView, light_paths};
use super::subject::Subject;
use crate::document::errors::Checks;
use crate::document::outputs::GridDocument;
use crate::document::result::{FluxResult, TubeResult};
use crate::document::room::object::ObjectDocument;
use crate::document::sky::time::instant;
use crate::document::tube::collector::CollectorDocument;
use crate::document::tube::opening::PlacedOpening;
use crate::document::tube::{ParametricTube, TubeDocument};
use crate::document::{JobDocument, Provenance};
use crate::figure::lumens::{Stage, lumens};
use crate::figure::section::{Cover, Section, SideTube};
use crate::figure::sky_dome::{SunAt, sky_dome};
use crate::figure::ticks::significant;
use crate::figure::{Drawing, Heading};
use crate::geometry::turn;
use crate::scene::Enclosure;
use crate::sky::looked_up::LookedUp;
use crate::sky::{Sky, SkyDistribution, direction, sun};

/// Step between the points of the sun's path, in minutes.
const PATH_MINUTES: u32 = 10;

/// Step between the labels beside the sun's path, in hours.
const LABELLED_HOURS: u32 = 3;

/// Figure of a job beside those of its grids and views.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SiteFigure {
    /// Sky as a dome.
    Sky,
    /// Section along x, seen from the south.
    SectionX,
    /// Section along y, seen from the east.
    SectionY,
    /// Fluxes and losses of a tube from its collector into the room, by the tube's number.
    Lumens(usize),
}

impl SiteFigure {
    /// Returns the name in paths and files.
    pub fn name(self) -> String {
        match self {
            Self::Sky => "sky".to_owned(),
            Self::SectionX => "section_x".to_owned(),
            Self::SectionY => "section_y".to_owned(),
            Self::Lumens(tube) => format!("lumens_{tube}"),
        }
    }

    /// Finds the figure with this name.
    pub fn of_name(name: &str) -> Option<Self> {
        let lumens = name.strip_prefix("lumens_").and_then(|tube| tube.parse().ok()).map(Self::Lumens);
        // a number may be written in several ways, a name not
        [Self::Sky, Self::SectionX, Self::SectionY].into_iter().chain(lumens).find(|figure| figure.name() == name)
    }

    /// Lists the figures that a job has, from its document with defaults filled in and its results so far.
    pub fn of_job(document: &Value, results: &Value) -> Vec<Self> {
        let sky = document["sky"].is_object().then_some(Self::Sky);
        let tubes = results["tubes"].as_array().into_iter().flatten().enumerate();
        let places = ["at_collector", "at_diffuser", "into_room"];
        let told = tubes.filter(|(_, tube)| places.iter().all(|place| tube[place].is_object()));
        let lumens = told.map(|(tube, _)| Self::Lumens(tube));
        sky.into_iter().chain([Self::SectionX, Self::SectionY]).chain(lumens).collect()
    }
}

/// Draws the figure of a job from its results as the service returns them; `None` where the data that it shows are missing.
pub fn site_figure(figure: SiteFigure, subject: &Subject, results: &Value) -> Option<Drawing> {
    let document: &JobDocument = subject.document.as_ref()?;
    match figure {
        SiteFigure::Sky => sky_figure(subject, document, &provenance(results)?),
        SiteFigure::SectionX => Some(section(subject, document, results, DVec2::X, "x").draw()),
        SiteFigure::SectionY => Some(section(subject, document, results, DVec2::Y, "y").draw()),
        SiteFigure::Lumens(tube) => {
            let flux = TubeResult::deserialize(results["tubes"].get(tube)?).ok()?;
            lumens_figure(subject, tube, &flux)
        }
    }
}

fn provenance(results: &Value) -> Option<Provenance> {
    Provenance::deserialize(&results["provenance"]).ok()
}

/// Draws the section along the longer side of the room, which shows more, with the name of its axis alone above it.
pub fn longer_section(subject: &Subject, results: &Value) -> Option<(SiteFigure, Drawing)> {
    let document: &JobDocument = subject.document.as_ref()?;
    let [low, high] = document.room.bounds_m();
    let [width, depth, _] = (high - low).to_array();
    let (figure, along, across) =
        if depth > width { (SiteFigure::SectionY, DVec2::Y, "y") } else { (SiteFigure::SectionX, DVec2::X, "x") };
    let heading = Heading::of(format!("Section along {across}"));
    Some((figure, Section { heading, ..section(subject, document, results, along, across) }.draw()))
}

fn lumens_figure(subject: &Subject, tube: usize, flux: &TubeResult) -> Option<Drawing> {
    let stage = |name: &str, flux: FluxResult, loss: &str| Stage {
        name: name.to_owned(),
        flux_lm: flux.flux_lm,
        half_interval_lm: flux.half_interval_lm(),
        loss: loss.to_owned(),
    };
    let stages = [
        stage("at the collector", flux.at_collector?, ""),
        stage("at the diffuser", flux.at_diffuser?, "lost in collector and guide"),
        stage("into the room", flux.into_room?, "lost in the diffuser"),
    ];
    let efficiency = flux.transmission_efficiency;
    let efficiency = efficiency.map(|efficiency| format!("efficiency {} %", significant(100.0 * efficiency, 3)));
    let heading = Heading {
        title: format!("Lumens of tube {tube}, {}", subject.name()),
        lines: vec![subject.circumstances(), efficiency.unwrap_or_default()],
    };
    Some(lumens(&heading, &stages))
}

fn sky_figure(subject: &Subject, document: &JobDocument, provenance: &Provenance) -> Option<Drawing> {
    let (zenith, sun) = (provenance.zenith?, provenance.sun?);
    let (altitude, azimuth) = (sun.altitude_deg.to_radians(), sun.azimuth_deg.to_radians());
    let toward_sun = direction(altitude, azimuth);
    let sky_type = document.sky.as_ref()?.sky_type(toward_sun, document.time.as_deref())?;
    let distribution = SkyDistribution::new(sky_type, toward_sun);
    let sky = Sky { distribution, zenith_luminance_cd_m2: zenith.zenith_luminance_cd_m2 };
    let is_up = altitude > 0.0;
    let [of_sky, of_sun] = [zenith.horizontal_illuminance_lux, sun.horizontal_illuminance_lux];
    let level = format!(
        "horizontal illuminance: sky {} lx, sun {} lx · zenith {} cd/m² · sun at altitude {:.1}°, azimuth {:.1}°",
        significant(of_sky, 3),
        significant(of_sun, 3),
        significant(zenith.zenith_luminance_cd_m2, 3),
        sun.altitude_deg,
        sun.azimuth_deg
    );
    let heading = Heading { title: format!("Sky, {}", subject.name()), lines: vec![subject.circumstances(), level] };
    let looked_up = is_up.then(|| LookedUp::new(&sky));
    let luminance = |direction: DVec3| looked_up.as_ref().map_or(0.0, |sky| sky.luminance(direction));
    let sun = SunAt { altitude, azimuth, label: None };
    Some(sky_dome(&heading, luminance, Some(&sun), &path(document)))
}

/// Computes the directions of the sun over the day of the document, by its own clock; none without place and time.
fn path(document: &JobDocument) -> Vec<SunAt> {
    let (Some(location), Some(time)) = (&document.location, &document.time) else { return Vec::new() };
    let Some((date, rest)) = time.split_once(['T', 't', ' ']) else { return Vec::new() };
    let offset = rest.find(['Z', 'z', '+', '-']).map_or("Z", |at| &rest[at..]);
    let at = |minutes: u32| {
        let (hour, minute) = (minutes / 60, minutes % 60);
        let instant = instant(&format!("{date}T{hour:02}:{minute:02}:00{offset}")).ok()?;
        let position =
            sun::position(instant, location.latitude_deg, location.longitude_deg, location.elevation_m).ok()?;
        let label = (minute == 0 && hour % LABELLED_HOURS == 0).then(|| hour.to_string());
        Some(SunAt { altitude: position.altitude, azimuth: position.azimuth, label })
    };
    (0..24 * 60).step_by(PATH_MINUTES as usize).filter_map(at).collect()
}

/// Builds the section along a horizontal direction of the room, with all tubes and objects drawn into its plane.
fn section(subject: &Subject, document: &JobDocument, results: &Value, along: DVec2, across: &'static str) -> Section {
    let faces = document.room.enclosure(&mut Checks::default());
    let seen_from_the_side = |corner: DVec3| DVec2::new(along.dot(corner.truncate()), corner.z);
    let faces_of = |room: &Enclosure| -> Vec<Vec<DVec2>> {
        let rings = room.faces().iter().flat_map(|face| face.polygon.rings());
        rings.map(|ring| ring.iter().copied().map(seen_from_the_side).collect()).collect()
    };
    let room = faces.as_ref().map(faces_of).unwrap_or_default();
    let height_of = |tube: &TubeDocument| {
        let opening = faces.as_ref().and_then(|faces| PlacedOpening::of(tube, faces));
        opening.map_or(0.0, |opening| opening.height_m)
    };
    let places = || room.iter().flatten().map(|corner| corner.x);
    let span = [places().fold(f64::INFINITY, f64::min), places().fold(f64::NEG_INFINITY, f64::max)];
    let sun = provenance(results).and_then(|provenance| provenance.sun).filter(|sun| sun.on && sun.altitude_deg > 0.0);
    let toward_sun = sun.map(|sun| {
        let azimuth = (sun.azimuth_deg - document.room.rotation_deg).to_radians();
        direction(sun.altitude_deg.to_radians(), azimuth)
    });
    let lit = document.tubes.iter().filter_map(|tube| match tube {
        TubeDocument::Parametric(of_cylinders) if document.sky.is_some() => {
            let side = SideView { along, span, height: height_of(tube) };
            Some(light_paths(of_cylinders, &side, toward_sun))
        }
        TubeDocument::Parametric(_) | TubeDocument::Mesh(_) => None,
    });
    let light: Vec<_> = lit.flatten().collect();
    let tubes = document.tubes.iter().map(|tube| match tube {
        TubeDocument::Parametric(of_cylinders) => side_of(of_cylinders, along, height_of(tube)),
        TubeDocument::Mesh(_) => {
            let opening = tube.opening();
            let axis = vec![DVec2::new(along.dot(opening.centre), height_of(tube))];
            SideTube { axis, radius: 0.5 * opening.diameter_m, cover: Cover::Open }
        }
    });
    let objects = document.room.objects.iter().filter_map(|object| match object {
        ObjectDocument::Box(object) => {
            let [x, y, z] = object.position_m;
            let [a, b, c] = object.size_m;
            let turn = turn::rotation(-object.rotation_deg.to_radians());
            let half = 0.5 * (along.dot(turn * DVec2::new(a, 0.0)).abs() + along.dot(turn * DVec2::new(0.0, b)).abs());
            let middle = along.dot(DVec2::new(x, y));
            Some(
                [(-half, z), (half, z), (half, z + c), (-half, z + c)].map(|(s, z)| DVec2::new(middle + s, z)).to_vec(),
            )
        }
        ObjectDocument::Mesh(_) => None,
    });
    let partitions = document.room.partitions.iter().map(|partition| {
        let [from, to] = [partition.from_m, partition.to_m].map(|end| along.dot(DVec2::from(end)));
        let height = partition.height_m;
        [(from, 0.0), (to, 0.0), (to, height), (from, height)].map(DVec2::from).to_vec()
    });
    let level = |grid: &GridDocument| Some((grid.name.clone(), grid.height_m?));
    let of_light = match toward_sun {
        _ if light.is_empty() => "",
        Some(_) => " · lines: sunlight",
        None => " · lines: skylight from 26° beside the tube's axis",
    };
    let seen = if along == DVec2::X { "seen from −y" } else { "seen from +x" };
    let heading = Heading {
        title: format!("Section along {across}, {}", subject.name()),
        lines: vec![subject.circumstances(), format!("all tubes and objects drawn into one plane, {seen}{of_light}")],
    };
    Section {
        heading,
        across,
        tubes: tubes.collect(),
        objects: objects.chain(partitions).collect(),
        grids: document.grids.iter().filter_map(level).collect(),
        room,
        light,
        sun: toward_sun.map(|toward| DVec2::new(along.dot(toward.truncate()), toward.z)),
    }
}

/// Returns the side view of a tube of cylinders.
fn side_of(tube: &ParametricTube, along: DVec2, height: f64) -> SideTube {
    let mut axis = vec![DVec2::new(along.dot(DVec2::from(tube.centre_m)), height)];
    for segment in &tube.segments {
        let lean = direction((90.0 - segment.tilt_deg).to_radians(), segment.azimuth_deg.to_radians());
        let step = segment.length_m * DVec2::new(along.dot(lean.truncate()), lean.z);
        axis.extend(axis.last().map(|last| *last + step));
    }
    let cover = match tube.collector {
        CollectorDocument::Open => Cover::Open,
        CollectorDocument::Flat(_) => Cover::Flat,
        CollectorDocument::Dome(_) | CollectorDocument::DielectricDome(_) => Cover::Dome,
    };
    SideTube { axis, radius: 0.5 * tube.diameter_m, cover }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::present::prepared::prepare;
    use crate::present::subject::tests::{NoMeshes, document};

    fn results() -> Value {
        let prepared = prepare(document().to_string().as_bytes(), &NoMeshes).unwrap();
        let flux = |flux_lm: f64| json!({ "flux_lm": flux_lm, "standard_error_lm": 2.0 });
        json!({
            "provenance": prepared.provenance,
            "tubes": [{ "at_collector": flux(6000.0), "at_diffuser": flux(4800.0), "into_room": flux(2884.0),
                        "transmission_efficiency": 0.481 }]
        })
    }

    #[test]
    fn a_job_has_a_sky_with_the_path_of_its_day_sections_and_lumens() {
        let subject = Subject::new(&document(), &json!(null));
        let drawn = |figure| site_figure(figure, &subject, &results()).unwrap();
        let sky = drawn(SiteFigure::Sky);
        let texts: Vec<&str> = sky.texts().collect();
        assert!(texts.contains(&"Sky, bath") && texts.contains(&"12") && texts.contains(&"15"), "{texts:?}");
        let section = drawn(SiteFigure::SectionX);
        let texts: Vec<&str> = section.texts().collect();
        assert!(
            texts.contains(&"Section along x, bath") && texts.contains(&"floor") && texts.contains(&"sun"),
            "{texts:?}"
        );
        assert!(drawn(SiteFigure::SectionY).texts().any(|text| text == "y in metres"));
        assert!(drawn(SiteFigure::Lumens(0)).texts().any(|text| text == "lost in the diffuser: 1920 lm, 32 %"));
        assert!(site_figure(SiteFigure::Lumens(1), &subject, &results()).is_none());
    }

    #[test]
    fn figures_have_names_and_a_job_those_that_it_knows() {
        for figure in [SiteFigure::Sky, SiteFigure::SectionX, SiteFigure::SectionY, SiteFigure::Lumens(12)] {
            assert_eq!(SiteFigure::of_name(&figure.name()), Some(figure));
        }
        for name in ["", "lumens_", "lumens_-1", "lumens_01", "moon"] {
            assert_eq!(SiteFigure::of_name(name), None);
        }
        let known = SiteFigure::of_job(&json!({ "room": {} }), &json!({ "tubes": [{ "at_collector": null }] }));
        assert_eq!(known, [SiteFigure::SectionX, SiteFigure::SectionY]);
        let unknown = Subject::new(&json!(null), &json!(null));
        assert!(site_figure(SiteFigure::SectionX, &unknown, &results()).is_none());
    }
}
