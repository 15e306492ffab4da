//! Figures of a job's site: its sky with the sun's path of the day, sections through room, roof and tubes, and the fluxes along a tube.

use glam::{DVec2, DVec3};
use serde::Deserialize;
use serde_json::Value;

use super::section_figure::section;
use super::subject::Subject;
use super::tube_figure::efficiency;
use crate::document::result::{FluxResult, TubeResult};
use crate::document::room::RoomDocument;
use crate::document::room::faces::FaceKindDocument;
use crate::document::room::plan::CeilingDocument;
use crate::document::sky::time::instant;
use crate::document::{JobDocument, Provenance};
use crate::figure::Drawing;
use crate::figure::lumens::{Stage, lumens};
use crate::figure::section::Section;
use crate::figure::sky_dome::{SunAt, sky_dome};
use crate::figure::ticks::significant;
use crate::scene::Daylight;
use crate::sky::looked_up::LookedUp;
use crate::sky::zenith::ZenithFormula;
use crate::sky::{Sky, SkyDistribution, direction, sun};

/// Rise of a ceiling over its length below which it counts as level.
const LEAST_RISE: f64 = 1e-3;

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
        SiteFigure::SectionX => Some(section_along(subject, document, results, (DVec2::X, "x")).draw()),
        SiteFigure::SectionY => Some(section_along(subject, document, results, (DVec2::Y, "y")).draw()),
        SiteFigure::Lumens(tube) => {
            let flux = TubeResult::deserialize(results["tubes"].get(tube)?).ok()?;
            lumens_figure(subject, tube, &flux)
        }
    }
}

/// Builds the section along an axis, given with its name, with the light that the results have.
fn section_along(subject: &Subject, document: &JobDocument, results: &Value, along: (DVec2, &'static str)) -> Section {
    let tubes = results["tubes"].as_array().into_iter().flatten();
    let kept = |tube: &Value| {
        let [collector, diffuser, room] =
            ["at_collector", "at_diffuser", "into_room"].map(|place| tube[place]["flux_lm"].as_f64());
        let collector = collector.filter(|flux| *flux > 0.0)?;
        Some([diffuser? / collector, room? / collector])
    };
    let kept: Vec<Option<[f64; 2]>> = tubes.map(kept).collect();
    section(subject, document, (provenance(results).as_ref(), &kept), along)
}

fn provenance(results: &Value) -> Option<Provenance> {
    Provenance::deserialize(&results["provenance"]).ok()
}

/// Draws the section that shows more, the slope of a ceiling or else the longer side of the room, with the name of its axis alone above it.
pub fn telling_section(subject: &Subject, results: &Value) -> Option<(SiteFigure, Drawing)> {
    let document: &JobDocument = subject.document.as_ref()?;
    let [low, high] = document.room.bounds_m();
    let extent = high - low;
    let rise = rise(&document.room);
    let shown = if rise.max_element() > LEAST_RISE * extent.x * extent.y { rise } else { extent.truncate() };
    let is_along_y = shown.y > shown.x;
    let (figure, along, across) =
        if is_along_y { (SiteFigure::SectionY, DVec2::Y, "y") } else { (SiteFigure::SectionX, DVec2::X, "x") };
    let section = section_along(subject, document, results, (along, across));
    let heading = subject.heading(format!("Section along {across}"), Vec::new());
    Some((figure, Section { heading, ..section }.draw()))
}

/// Returns how far the ceilings rise along x and along y, whichever way, each times the area below it in square metres.
fn rise(room: &RoomDocument) -> DVec2 {
    let of_faces = room.faces.iter().flatten().filter(|face| face.kind == FaceKindDocument::Ceiling).map(|face| {
        let corners = || face.boundary_m.iter().copied().map(DVec3::from_array);
        let twice: DVec3 = corners().zip(corners().cycle().skip(1)).map(|(a, b)| a.cross(b)).sum();
        0.5 * twice.truncate().abs()
    });
    let [low, high] = room.bounds_m();
    let of_plan = room.ceiling.as_ref().and_then(CeilingDocument::rises_toward_deg).map(|azimuth| {
        let (sine, cosine) = libm::sincos(azimuth.to_radians());
        (high.x - low.x) * (high.y - low.y) * DVec2::new(sine, cosine).abs()
    });
    of_faces.sum::<DVec2>() + of_plan.unwrap_or_default()
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
    let heading = subject.heading(
        format!("Lumens of tube {}, {}", tube + 1, subject.name()),
        vec![subject.circumstances(), efficiency(flux).unwrap_or_default()],
    );
    Some(lumens(&heading, &stages))
}

fn sky_figure(subject: &Subject, document: &JobDocument, provenance: &Provenance) -> Option<Drawing> {
    let (zenith, sun) = (provenance.zenith?, provenance.sun?);
    let position = sun.position_deg().map(|position| position.map(f64::to_radians));
    let toward_sun = position.map_or(DVec3::Z, |[altitude, azimuth]| direction(altitude, azimuth));
    let sky_type = document.sky.as_ref()?.sky_type(toward_sun, document.time.as_deref())?;
    let distribution = SkyDistribution::new(sky_type, toward_sun);
    let mut sky = Sky::new(distribution, zenith.zenith_luminance_cd_m2);
    if let Some(surroundings) = &document.surroundings {
        let open = Daylight { sky: Some(sky.clone()), sun: None, formula: ZenithFormula::GivenZenithLuminance };
        // the figure is turned to north, whatever the room's rotation
        sky.surroundings = Some(surroundings.around(&open, 0.0).common);
    }
    let is_up = position.is_none_or(|[altitude, _]| altitude > 0.0);
    let [of_sky, of_sun] = [zenith.horizontal_illuminance_lux, sun.horizontal_illuminance_lux];
    let place = sun.position_deg().map_or(String::new(), |[altitude_deg, azimuth_deg]| {
        format!(" · sun at altitude {altitude_deg:.1}°, azimuth {azimuth_deg:.1}°")
    });
    let level = format!(
        "horizontal illuminance: sky {} lx, sun {} lx · zenith {} cd/m²{place}",
        significant(of_sky, 3),
        significant(of_sun, 3),
        significant(zenith.zenith_luminance_cd_m2, 3),
    );
    let heading = subject.heading(format!("Sky, {}", subject.name()), vec![subject.circumstances(), level]);
    let looked_up = is_up.then(|| LookedUp::new(&sky));
    let luminance = |direction: DVec3| looked_up.as_ref().map_or(0.0, |sky| sky.luminance(direction));
    let sun = position.map(|[altitude, azimuth]| SunAt { altitude, azimuth, label: None });
    Some(sky_dome(&heading, luminance, sun.as_ref(), &path(document)))
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

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::document::NoFiles;
    use crate::present::prepared::prepare;
    use crate::present::subject::tests::document;

    fn results() -> Value {
        let prepared = prepare(document().to_string().as_bytes(), &NoFiles).unwrap();
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

    /// A section shows the slope of a plan's ceiling, or of faces, across the longer side of the room, too.
    #[test]
    fn the_telling_section_shows_the_slope() {
        let room = |ceiling: Value| {
            let plan = json!({ "outline_m": [[0, 0], [4, 0], [4, 9], [0, 9]] });
            serde_json::from_value::<RoomDocument>(json!({ "plan": plan, "ceiling": ceiling })).unwrap()
        };
        let gable =
            |azimuth| room(json!({ "kind": "gable", "eaves_m": 2, "ridge_m": 3, "ridge_azimuth_deg": azimuth }));
        assert!(rise(&gable(0.0)).x > 1.0 && rise(&gable(0.0)).y < 1e-9);
        assert!(rise(&gable(90.0)).y > 1.0 && rise(&gable(90.0)).x < 1e-9);
        assert_eq!(rise(&room(json!({ "kind": "flat", "height_m": 3 }))), DVec2::ZERO);
        let face = |corners: [[f64; 3]; 4]| json!({ "name": "a", "kind": "ceiling", "boundary_m": corners });
        let halves = [
            face([[0.0, 0.0, 2.0], [2.0, 0.0, 3.0], [2.0, 9.0, 3.0], [0.0, 9.0, 2.0]]),
            face([[2.0, 0.0, 3.0], [4.0, 0.0, 2.0], [4.0, 9.0, 2.0], [2.0, 9.0, 3.0]]),
        ];
        let of_faces = rise(&serde_json::from_value::<RoomDocument>(json!({ "faces": halves })).unwrap());
        // a rise of 1 m in 2 m over 36 m2
        assert!((of_faces - DVec2::new(18.0, 0.0)).length() < 1e-9, "{of_faces}");
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
