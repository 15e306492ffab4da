//! Conversion of a document to a scene, with warnings and the provenance of its results.

use super::effects::EffectSwitch;
use super::errors::{Checks, DocumentErrors, FieldErrorCode, Warning, WarningCode};
use super::file_source::FileSource;
use super::job::{JobDocument, ValidJob};
use super::limits::OBSTRUCTIONS_TIMES_TUBES;
use super::optics::Coefficient;
use super::outputs::SURFACES;
use super::provenance::{GuideProvenance, Provenance};
use super::room::convert::room;
use super::room::mesh_object::mesh_objects;
use super::room::object::ObjectDocument;
use super::sky::SkyDocument;
use super::sky::daylight::{Circumstances, Explained, daylight};
use super::surroundings::SurroundingsDocument;
use super::tube::TubeDocument;
use super::tube::convert::tube;
use crate::geometry::Dropped;
use crate::plan::EffectKind;
use crate::scene::surface_patches::{grid_of_patches, surface_patches};
use crate::scene::{Channels, Daylight, Enclosure, Grid, Responses, Room, Scene, Tube, TubeShape, View};

/// Converts a checked document to its scene, with warnings and the provenance of its results.
///
/// Errors concern meshes, which are not loaded before.
pub fn to_scene(
    document: &ValidJob,
    meshes: &dyn FileSource,
) -> Result<(Scene, Vec<Warning>, Provenance), DocumentErrors> {
    let mut checks = Checks::default();
    let mut warnings = Vec::new();
    let explained = explained_daylight(document, &mut checks, &mut warnings);
    let Some(enclosure) = document.room.enclosure(&mut checks) else { return Err(DocumentErrors(checks.errors)) };
    let (mut tubes, guides): (Vec<Tube>, Vec<GuideProvenance>) = document
        .tubes
        .iter()
        .enumerate()
        .filter_map(|(index, document)| tube(&format!("/tubes/{index}"), document, &enclosure, meshes, &mut checks))
        .unzip();
    let objects = mesh_objects(&document.room, &document.tubes, &enclosure, meshes, &mut checks);
    let views = views(document, &mut checks);
    if checks.errors.is_empty()
        && let Some(Explained { daylight, .. }) = &explained
    {
        surround(document, daylight, &enclosure, &mut tubes, &mut checks);
    }
    if !checks.errors.is_empty() {
        return Err(DocumentErrors(checks.errors));
    }
    let off = document.effects.get(EffectKind::Interreflection.name()) == Some(&EffectSwitch::Off);
    let mut provenance = Provenance { zenith: None, sun: None, refraction: None, interreflection: !off, guides };
    let daylight = explained.map(|Explained { daylight, zenith, sun, refraction }| {
        (provenance.zenith, provenance.sun, provenance.refraction) = (Some(zenith), Some(sun), Some(refraction));
        daylight
    });
    let responses_of_year = |grid: Grid| match document.annual {
        Some(_) => Grid { responses: Responses::ToTubes, ..grid },
        None => grid,
    };
    let grids = document.grids.iter().map(|grid| responses_of_year(grid.grid(&enclosure)));
    let patches = document.surfaces.then(|| surface_patches(&enclosure));
    let of_surfaces = patches.map(|patches| grid_of_patches(SURFACES.to_owned(), &enclosure, &patches));
    let scene = Scene {
        daylight,
        moments: None,
        grids: grids.chain(of_surfaces).collect(),
        room: Room { meshes: objects, ..room(&document.room, enclosure) },
        tubes,
        views,
        channels: channels(document),
    };
    warnings.extend(dropped_triangles(document, &scene));
    let of_model = document.notes_on_model().iter().cloned();
    warnings.extend(of_model.map(|detail| Warning { code: WarningCode::ModelChanged, detail }));
    let repairs = document.room.repairs().into_iter().filter(|repair| !document.notes_on_model().contains(repair));
    warnings.extend(repairs.map(|detail| Warning { code: WarningCode::RepairedRoom, detail }));
    Ok((scene, warnings, provenance))
}

/// Returns a warning for each mesh of which triangles were left out.
fn dropped_triangles(document: &JobDocument, scene: &Scene) -> Vec<Warning> {
    let tubes = scene.tubes.iter().enumerate().filter_map(|(index, tube)| match &tube.shape {
        TubeShape::Mesh(tube) => Some((format!("/tubes/{index}/mesh"), tube.mesh.dropped)),
        _ => None,
    });
    let is_mesh = |(_, object): &(usize, &ObjectDocument)| matches!(object, ObjectDocument::Mesh(_));
    let objects = document.room.objects.iter().enumerate().filter(is_mesh).zip(&scene.room.meshes);
    let objects = objects.map(|((index, _), object)| (format!("/room/objects/{index}/mesh"), object.mesh.dropped));
    tubes
        .chain(objects)
        .filter(|(_, dropped)| *dropped != Dropped::default())
        .map(|(pointer, Dropped { without_area, repeated })| {
            let detail = format!(
                "{pointer}: {without_area} triangles of the file have no area and {repeated} repeat others; they were \
                 left out"
            );
            Warning { code: WarningCode::DroppedTriangles, detail }
        })
        .collect()
}

/// Puts surroundings around the upper ends of the tubes, one for each of the document, if it gives any.
fn surround(
    document: &JobDocument,
    daylight: &Daylight,
    enclosure: &Enclosure,
    tubes: &mut [Tube],
    checks: &mut Checks,
) {
    let own = || document.tubes.iter().map(TubeDocument::horizon);
    let by_default = own().any(|own| own.is_some()).then(SurroundingsDocument::default);
    let Some(surroundings) = document.surroundings.as_ref().or(by_default.as_ref()) else { return };
    let pairs = surroundings.obstructions.len().saturating_mul(tubes.len());
    if pairs > OBSTRUCTIONS_TIMES_TUBES {
        let detail = format!(
            "the number of obstructions times that of tubes must be <= {OBSTRUCTIONS_TIMES_TUBES}, but is {pairs}"
        );
        checks.refuse_as(FieldErrorCode::TooMany, "/surroundings/obstructions", detail);
        return;
    }
    let around = surroundings.around(daylight, document.room.rotation_deg);
    for (number, (tube, own)) in tubes.iter_mut().zip(own()).enumerate() {
        let upper_end = tube.frame(enclosure).origin + tube.upper_end(enclosure);
        tube.surroundings = around.of(number, own, (upper_end, tube.upper_radius()), checks);
    }
}

fn explained_daylight(document: &JobDocument, checks: &mut Checks, warnings: &mut Vec<Warning>) -> Option<Explained> {
    let around = Circumstances {
        location: document.location.as_ref(),
        time: document.time.as_deref(),
        rotation_deg: document.room.rotation_deg,
        luminaires: document.room.luminaires.len(),
    };
    match &document.sky {
        Some(sky) => daylight(sky, around, checks, warnings),
        None if document.annual.is_some() => {
            daylight(&SkyDocument::OF_DAYLIGHT_FACTORS, Circumstances { location: None, ..around }, checks, warnings)
        }
        None => {
            if around.location.is_some() || around.time.is_some() || document.surroundings.is_some() {
                let detail = "without `sky` there is no daylight: `location`, `time` and `surroundings` change nothing"
                    .to_owned();
                warnings.push(Warning { code: WarningCode::PlaceWithoutSky, detail });
            }
            None
        }
    }
}

fn views(document: &JobDocument, checks: &mut Checks) -> Vec<View> {
    let mut views = Vec::with_capacity(document.views.len());
    for (index, view) in document.views.iter().enumerate() {
        match view.view() {
            Some(view) => views.push(view),
            None => checks.refuse(format!("/views/{index}/up"), "must not be parallel to the viewing direction"),
        }
    }
    views
}

/// Returns three channels if any coefficient of the scene is `[r, g, b]`, and one otherwise.
fn channels(document: &JobDocument) -> Channels {
    let of_tubes = document.tubes.iter().flat_map(|tube| tube.coefficients());
    match document.room.coefficients().chain(of_tubes).any(Coefficient::is_coloured) {
        true => Channels::Rgb,
        false => Channels::Photopic,
    }
}
