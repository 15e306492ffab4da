//! Rays per second in a mesh: specular chains through the tube of S3.

use super::measure::{Quartiles, processor_seconds, time};
use super::peers::{EMBREE_MEGARAYS, EmbreeRate};
use super::settings::Settings;
use crate::page::{ReportError, Section, Table};
use skyduct::geometry::bvh::TriangleBvh;
use skyduct::geometry::obj::{ObjLimits, parse_obj};
use skyduct::sampling::{Key, PathRandom, warp};

/// Number of bounces after which a chain ends.
const MOST_BOUNCES: u32 = 100;

/// Radius in metres of the disc in the opening in which chains start: within the facets of the pipe.
const RADIUS_M: f64 = 0.126;

pub fn section(settings: &Settings) -> Result<Section, ReportError> {
    let file = settings.reference.join("scenes/S3_tube.obj");
    let failed = |reason: String| ReportError::Case(format!("{} cannot be read: {reason}", file.display()));
    let bytes = std::fs::read(&file).map_err(|error| failed(error.to_string()))?;
    let (mesh, reading) = processor_seconds(|| parse_obj(&bytes, ObjLimits::default()));
    let mesh = mesh.map_err(|error| failed(error.to_string()))?;
    let is_pipe: Vec<bool> =
        mesh.triangle_materials.iter().map(|material| mesh.materials[*material as usize] == "pipe").collect();
    let (tree, building) = processor_seconds(|| TriangleBvh::of_mesh(mesh.positions.clone(), mesh.triangles.clone()));
    let chains = settings.either(20_000, 2_000);
    let rates = settings.repeats().run(|seed| {
        let (rays, seconds) = processor_seconds(|| trace(&tree, &is_pipe, Key::new(seed), chains));
        Ok(1e-6 * rays as f64 / seconds)
    })?;
    let rate = Quartiles::of(rates);
    let row = |what: &str, value: String| vec![what.to_owned(), value];
    let embree = match settings.beside().and_then(|beside| beside.embree) {
        Some(EmbreeRate { one_by_one, in_streams }) => vec![
            row("Embree 3, robust, run before this benchmark, one by one", format!("{one_by_one:.2}")),
            row("the same in streams of 64", format!("{in_streams:.2}")),
        ],
        None => vec![
            row(
                "Embree 3.13, robust, measured earlier on a machine with AVX-512",
                format!("{:.1}", EMBREE_MEGARAYS[0]),
            ),
            row("the same on shared machines", format!("{:.1}", EMBREE_MEGARAYS[1])),
        ],
    };
    let ours = row("skyduct, one thread", format!("{:.2} ({:.2} to {:.2})", rate.median, rate.lower, rate.upper));
    let set_up = [row("reading the OBJ file", time(reading)), row("building the tree", time(building))];
    Ok(Section {
        title: "Rays in a mesh".to_owned(),
        text: format!(
            "Closest hits along specular chains in the mesh of S3 ({} triangles), from the tube's mouth upward until they leave \
             the pipe, with the random numbers and reflections that they take: millions of rays for each processor second. A hit is \
             decided in f64; Embree's are in f32.",
            tree.len()
        ),
        tables: vec![Table {
            caption: "Rates".to_owned(),
            head: ["", "value"].map(str::to_owned).into(),
            rows: [ours].into_iter().chain(embree).chain(set_up).collect(),
        }],
        ..Section::default()
    })
}

/// Follows chains up the pipe, and returns the number of rays.
fn trace(tree: &TriangleBvh, is_pipe: &[bool], key: Key, chains: u64) -> u64 {
    let mut random = PathRandom::new(key);
    let mut rays = 0;
    for _ in 0..chains {
        let origin = (RADIUS_M * warp::disc(random.uniform2())).extend(1e-6);
        let direction = warp::cosine_hemisphere(random.uniform2());
        rays += u64::from(tree.mirrored(origin, direction, is_pipe, MOST_BOUNCES));
    }
    rays
}
