//! Meshes, whose names say all about them.

use std::f64::consts::PI;
use std::sync::Arc;

use skyduct::document::FileSource;
use skyduct::geometry::TriangleMesh;
use skyduct::geometry::obj::{ObjLimits, parse_obj};

/// Units of meshes with their metres.
pub const UNITS: [(&str, f64); 5] = [("m", 1.0), ("cm", 0.01), ("mm", 0.001), ("in", 0.0254), ("ft", 0.3048)];

/// What a mesh's id says: its shape, its size in metres, its unit and where its own origin lies, in metres.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshName {
    pub shape: String,
    pub size: [f64; 3],
    pub unit: String,
    pub offset: [f64; 3],
}

impl MeshName {
    pub fn text(&self) -> String {
        let Self { shape, size, unit, offset } = self;
        let numbers = size.iter().chain(offset).map(f64::to_string).collect::<Vec<_>>();
        format!("{shape} {unit} {}", numbers.join(" "))
    }

    pub fn read(text: &str) -> Option<Self> {
        let words: Vec<&str> = text.split(' ').collect();
        let [shape, unit, numbers @ ..] = &words[..] else { return None };
        let numbers: Vec<f64> = numbers.iter().map(|word| word.parse()).collect::<Result<_, _>>().ok()?;
        let [a, b, c, x, y, z] = numbers[..] else { return None };
        Some(Self { shape: (*shape).to_owned(), size: [a, b, c], unit: (*unit).to_owned(), offset: [x, y, z] })
    }

    /// The OBJ file, in the mesh's own unit.
    fn obj(&self) -> Option<String> {
        let [w, d, h] = self.size;
        let (x, y) = (0.5 * w, 0.5 * d);
        let (corners, faces) = match self.shape.as_str() {
            "tetrahedron" => {
                let corners = vec![[-x, -y, 0.0], [x, -y, 0.0], [-x, y, 0.0], [0.2 * x, 0.1 * y, h]];
                (corners, "usemtl all\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n".to_owned())
            }
            // two slanting quadrilaterals that share an edge
            "sheet" => {
                let corners =
                    vec![[-x, -y, 0.0], [0.0, -y, h], [0.0, y, h], [-x, y, 0.0], [x, -y, 0.5 * h], [x, y, 0.5 * h]];
                (corners, "usemtl all\nf 1 2 3 4\nf 2 5 6 3\n".to_owned())
            }
            // four walls without ends
            "pipe" => (prism(4, x.min(y), h), format!("usemtl all\n{}", sides(4))),
            shape => {
                let open = shape.strip_prefix("open-tube");
                let count: usize = open.or(shape.strip_prefix("tube"))?.parse().ok()?;
                let polygon = |from: usize| (from..from + count).map(|k| format!(" {k}")).collect::<String>();
                let mut faces = format!("usemtl closure\nf{}\nusemtl pipe\n{}", polygon(1), sides(count));
                if open.is_none() {
                    faces += &format!("usemtl cover\nf{}\n", polygon(count + 1));
                }
                (prism(count, w, h), faces)
            }
        };
        let metres = UNITS.iter().find(|(name, _)| *name == self.unit)?.1;
        let vertices = corners.iter().map(|corner: &[f64; 3]| {
            let [a, b, c] = [0, 1, 2].map(|axis| (corner[axis] + self.offset[axis]) / metres);
            format!("v {a} {b} {c}\n")
        });
        Some(vertices.collect::<String>() + &faces)
    }
}

/// Corners of two regular polygons, the second `height` above the first.
fn prism(count: usize, radius: f64, height: f64) -> Vec<[f64; 3]> {
    let corner = |k: usize, z: f64| {
        let (sin, cos) = (2.0 * PI * k as f64 / count as f64).sin_cos();
        [radius * cos, radius * sin, z]
    };
    (0..count).map(|k| corner(k, 0.0)).chain((0..count).map(|k| corner(k, height))).collect()
}

fn sides(count: usize) -> String {
    (0..count)
        .map(|k| format!("f {} {} {} {}\n", k + 1, (k + 1) % count + 1, (k + 1) % count + count + 1, k + count + 1))
        .collect()
}

/// The meshes that documents of this generator name.
pub struct Meshes;

impl FileSource for Meshes {
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String> {
        let text = MeshName::read(id).and_then(|name| name.obj()).ok_or(format!("no mesh has the id {id:?}"))?;
        parse_obj(text.as_bytes(), ObjLimits::default()).map(Arc::new).map_err(|error| error.to_string())
    }
}
