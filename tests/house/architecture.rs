//! The walls between the rooms of `src`, of which `src/physics` has many and `src/annual` is one: imports run one way (see `docs/architecture.md`).

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::source_files::source_files;

/// Rooms by how far right they stand: a room may import its own level and what is left of it.
const LEVELS: &[&[&str]] = &[
    &["sampling", "statistics"],
    &["sky", "optics", "geometry"],
    &["guide"],
    &["scene"],
    &["traceable"],
    &["analytic"],
    &["plan", "integrator"],
    &["estimate"],
    &["annual"],
    &["output"],
    &["figure"],
    &["document"],
    &["engine"],
    &["predict"],
    &["present"],
    &["queue"],
    &["study"],
    &["db", "http", "cli"],
    &["reports", "main"],
];

/// Rooms of one level that must not see each other.
const APART: &[(&str, &str)] = &[("http", "db"), ("db", "http"), ("http", "cli"), ("db", "cli")];

/// Physics: everything left of `document`.
const PHYSICS_LEVELS: usize = 11;

/// Names that physics does not know: HTTP, SQL, serde, tokio, files, clocks.
const NOT_IN_PHYSICS: &[&str] = &[
    "serde",
    "serde_json",
    "utoipa",
    "tokio",
    "axum",
    "hyper",
    "tower",
    "sqlx",
    "reqwest",
    "object_store",
    "jiff",
    "std::fs",
    "std::net",
    "std::env",
];

/// A duration is a number; what asks for the time is a clock.
const CLOCKS: &[&str] = &["Instant::now", "SystemTime::now"];

const TOKIO_ROOMS: &[&str] = &["http", "db", "cli", "queue", "main", "reports"];

/// Crates with one user each: a file or a folder.
const SINGLE_USERS: &[(&str, &str)] = &[
    ("obvhs", "geometry/wide_tree.rs"),
    ("exr", "output/exr.rs"),
    ("tiny_skia", "figure/paint.rs"),
    ("tzf_rs", "document/sky/time_zone.rs"),
    ("sqlx", "db/sqlite/"),
    ("object_store", "queue/local_files.rs"),
];

fn level(room: &str) -> Option<usize> {
    LEVELS.iter().position(|rooms| rooms.contains(&room))
}

/// Rust code without comments, and with empty strings.
pub fn code_only(text: &str) -> String {
    let mut code = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let skipped = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if first == 'r' && !code.ends_with(|c: char| c.is_alphanumeric() || c == '_') {
            raw_string(rest).unwrap_or(0)
        } else if first == '"' {
            string(rest)
        } else if rest.starts_with("'\"'") || rest.starts_with("'\\\"'") {
            // a quotation mark as a character begins no string
            rest[1..].find('\'').map_or(1, |end| end + 2)
        } else {
            0
        };
        if skipped == 0 {
            code.push(first);
            rest = &rest[first.len_utf8()..];
        } else {
            code.push(' ');
            rest = &rest[skipped..];
        }
    }
    code
}

/// Length of the raw string that `text` begins with.
fn raw_string(text: &str) -> Option<usize> {
    let hashes = text[1..].bytes().take_while(|byte| *byte == b'#').count();
    let open = 1 + hashes;
    text[open..].starts_with('"').then(|| {
        let close = format!("\"{}", "#".repeat(hashes));
        text[open + 1..].find(&close).map_or(text.len(), |end| open + 1 + end + close.len())
    })
}

/// Length of the string that `text` begins with.
fn string(text: &str) -> usize {
    let mut escaped = false;
    for (index, byte) in text.bytes().enumerate().skip(1) {
        match byte {
            _ if escaped => escaped = false,
            b'\\' => escaped = true,
            b'"' => return index + 1,
            _ => {}
        }
    }
    text.len()
}

/// The heads of all paths below `prefix` in `code`: the name, or the names in braces, after each `prefix`.
fn heads(code: &str, prefix: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (at, _) in code.match_indices(prefix) {
        if code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':') {
            continue;
        }
        let rest = code[at + prefix.len()..].trim_start();
        let names = match rest.strip_prefix('{') {
            Some(group) => top_level_names(group),
            None => vec![name_at(rest)],
        };
        found.extend(names.into_iter().filter(|name| !name.is_empty()));
    }
    found
}

fn name_at(text: &str) -> String {
    text.trim_start().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
}

/// First names of the comma-separated paths up to the brace that closes the group.
fn top_level_names(group: &str) -> Vec<String> {
    let mut depth = 0;
    let mut names = vec![name_at(group)];
    for (index, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => names.push(name_at(&group[index + 1..])),
            _ => {}
        }
    }
    names
}

/// All names that the `use` statements on `code`'s own crate bring in.
fn imported_names(code: &str) -> BTreeSet<String> {
    let statements = code.split("use ").skip(1).filter_map(|rest| rest.split(';').next());
    let own = statements.filter(|statement| {
        ["crate::", "super::", "self::"].iter().any(|prefix| statement.trim_start().starts_with(prefix))
    });
    own.flat_map(|statement| statement.split(|c: char| !(c.is_alphanumeric() || c == '_'))).map(str::to_owned).collect()
}

/// True if `code` uses the external crate `name` (and not a module of ours that has the same name).
fn uses_crate(code: &str, name: &str) -> bool {
    let prefix = format!("{name}::");
    let path = code
        .match_indices(&prefix)
        .any(|(at, _)| !code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_') && !code[..at].ends_with(':'));
    let declared = code.contains(&format!("mod {name};"));
    code.contains(&format!("use {prefix}")) || (path && !declared && !imported_names(code).contains(name))
}

/// A file's path from the folder of the rooms on: those of physics are a crate of their own, which the other hands on, and `annual` is a
/// room that is a crate.
pub fn path_in_house(file: &Path) -> String {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let path = file.strip_prefix(&src).unwrap();
    path.strip_prefix("physics").unwrap_or(path).to_str().unwrap().replace('\\', "/")
}

/// Violations of the walls in one file; `path` is that in the house.
fn violations(path: &str, text: &str) -> Vec<String> {
    let room = path.split('/').next().unwrap_or(path).trim_end_matches(".rs");
    if ["lib", "build"].contains(&room) {
        return Vec::new();
    }
    let Some(own_level) = level(room) else {
        return vec![format!("{path}: no level for the room {room}")];
    };
    let code = code_only(text);
    let mut found = Vec::new();
    let mut imported = heads(&code, "crate::");
    for name in ["skyduct::", "skyduct_physics::"] {
        imported.extend(heads(&code, name));
    }
    // `super` leads out of a room only where it climbs to the crate
    let depth = path.trim_end_matches("/mod.rs").split('/').count();
    imported.extend(heads(&code, &"super::".repeat(depth)));
    for other in imported.iter().filter(|other| *other != room) {
        match level(other) {
            Some(level) if level > own_level => found.push(format!("{path}: {room} imports {other}, which climbs")),
            Some(_) if APART.contains(&(room, other.as_str())) => {
                found.push(format!("{path}: {room} must not see {other}"));
            }
            _ => {}
        }
    }
    if own_level < PHYSICS_LEVELS {
        // tests may read reference files
        let physics = code.split("#[cfg(test)]\nmod tests").next().unwrap_or(&code);
        let known = NOT_IN_PHYSICS.iter().filter(|name| uses_crate(physics, name));
        found.extend(known.map(|name| format!("{path}: physics knows no {name}")));
        let clocks = CLOCKS.iter().filter(|clock| physics.contains(*clock));
        found.extend(clocks.map(|clock| format!("{path}: physics knows no clock, but calls {clock}")));
    }
    if uses_crate(&code, "tokio") && !TOKIO_ROOMS.contains(&room) {
        found.push(format!("{path}: no tokio in {room}"));
    }
    for (name, user) in SINGLE_USERS {
        if !path.starts_with(user) && uses_crate(&code, name) {
            found.push(format!("{path}: {name} is for {user} alone"));
        }
    }
    found
}

#[test]
fn imports_run_one_way() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    source_files(&src, &mut files);
    assert!(files.len() > 30, "the source was not found: {} files", files.len());
    let found: Vec<String> =
        files.iter().flat_map(|file| violations(&path_in_house(file), &fs::read_to_string(file).unwrap())).collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn climbing_imports_are_seen() {
    let bad = [
        ("sky/cie.rs", "use crate::document::Warning;"),
        ("sky/mod.rs", "use crate::{geometry::obj, engine::passes::{Chunk, Rendered}};"),
        ("sky/cie.rs", "fn f() -> crate::http::State { todo!() }"),
        ("sky/cie.rs", "use super::super::estimate::Estimate;"),
        ("scene/mod.rs", "use super::plan::Plan;"),
        ("http/jobs.rs", "use crate::db::Store;"),
        ("db/jobs.rs", "use crate::{http};"),
        ("guide/mesh.rs", "let x = \"//\"; use crate::plan::Plan;"),
        ("guide/mesh.rs", "let x = '\"'; use crate::plan::Plan; let y = '\"';"),
        ("annual/fluxes.rs", "use std::fs::File;"),
        ("sky/cie.rs", "use crate::annual::moment::Moment;"),
        ("output/csv.rs", "#[derive(serde::Serialize)] struct S;"),
        ("estimate/mod.rs", "let now = std::time::Instant::now();"),
        ("integrator/mod.rs", "use serde::{Serialize};"),
        ("document/parse.rs", "tokio::spawn(f)"),
        ("guide/mesh.rs", "use obvhs::bvh2::Bvh2;"),
        ("document/mesh.rs", "obvhs::Bvh2::new(path)"),
        ("present/reader/mod.rs", "use exr::prelude::*;"),
        ("nowhere/mod.rs", ""),
    ];
    for (path, text) in bad {
        assert_eq!(violations(path, text).len(), 1, "{path}: {text}: {:?}", violations(path, text));
    }
}

#[test]
fn falling_imports_are_not() {
    let good = [
        ("sky/cie.rs", "use crate::sampling::warp; use super::zenith; use crate::sky::Sky;"),
        ("http/jobs.rs", "use crate::present::prepared::Prepared; use tokio::sync::Mutex;"),
        ("guide/mesh.rs", "// use crate::document::X;\n/* crate::http::Y */ let s = \"crate::db::Z\";"),
        ("guide/mesh.rs", "let s = r#\"use crate::db::\"Z\"; \"#; let r = 1;"),
        ("present/reader/mod.rs", "use crate::output::{csv, exr}; fn f() { exr::encode() }"),
        ("output/mod.rs", "pub mod exr; fn f() { exr::encode() }"),
        ("geometry/wide_tree.rs", "use obvhs::bvh2::Bvh2;"),
        ("cli/serve.rs", "use crate::{db, http};"),
        ("main.rs", "use skyduct::cli::Arguments;"),
        ("estimate/mod.rs", "fn f() {}\n#[cfg(test)]\nmod tests { use std::fs; }"),
    ];
    for (path, text) in good {
        assert_eq!(violations(path, text), Vec::<String>::new(), "{path}: {text}");
    }
}

/// A page that lists tests is worth something only as long as they are there.
#[test]
fn tests_that_the_page_on_reliability_names_exist() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = fs::read_to_string(root.join("docs/reliability.md")).unwrap();
    let named: Vec<(&str, &str)> =
        page.split('`').skip(1).step_by(2).filter_map(|code| code.split_once("::")).collect();
    assert!(named.len() > 30, "{named:?}");
    let mut files = Vec::new();
    // a test of a module stands beside its code
    source_files(&root.join("src"), &mut files);
    source_files(&root.join("tests"), &mut files);
    for (file, test) in named {
        let text: String = files
            .iter()
            .filter(|path| path.with_extension("").ends_with(file) || path.ends_with(format!("{file}/mod.rs")))
            .map(|path| fs::read_to_string(path).unwrap())
            .collect();
        assert!(text.contains(&format!("fn {test}(")), "docs/reliability.md names {file}::{test}, which is not there");
    }
}

/// Files that may name several methods: the two registries, the policy of `auto`, and reports that compare methods.
const MAY_NAME_METHODS: &[&str] = &[
    "integrator/registry.rs",
    "document/method/mod.rs",
    "plan/choose.rs",
    "reports/bench/rooms.rs",
    "reports/bench/studied.rs",
    "reports/thesis/methods.rs",
    "reports/thesis/ring.rs",
    "reports/thesis/views.rs",
    "reports/validation/published/energyplus.rs",
    "reports/validation/scenes.rs",
];

/// Module and variant of every method in the registry: `(two_stage, TwoStage)`.
fn methods(registry: &str) -> Vec<(String, String)> {
    let variants = registry.split_once("pub enum Method {").unwrap().1.split_once("\n}").unwrap().0;
    let lines = variants.lines().filter_map(|line| line.trim().strip_suffix("::Settings),")?.split_once('('));
    lines.map(|(variant, module)| (module.to_owned(), variant.to_owned())).collect()
}

/// Methods that the code of a file names: by their module, their type or variant, or their name as a whole string.
/// Comments and longer texts may name any, and so may the list of modules that a folder consists of.
fn named_methods<'a>(text: &str, methods: &'a [(String, String)]) -> Vec<&'a str> {
    let text = text.split("#[cfg(test)]\nmod tests").next().unwrap_or(text);
    let is_list = |line: &&str| line.ends_with(';') && (line.starts_with("mod ") || line.starts_with("pub mod "));
    let code: String = code_only(text).lines().filter(|line| !is_list(line)).collect::<Vec<_>>().join("\n");
    let words: BTreeSet<&str> = code.split(|c: char| !(c.is_alphanumeric() || c == '_')).collect();
    let named = methods.iter().filter(|(module, variant)| {
        words.contains(module.as_str()) || words.contains(variant.as_str()) || text.contains(&format!("\"{module}\""))
    });
    named.map(|(module, _)| module.as_str()).collect()
}

#[test]
fn no_file_outside_the_registries_names_two_methods() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let methods = methods(&fs::read_to_string(src.join("physics/integrator/registry.rs")).unwrap());
    assert!(methods.len() > 5, "{methods:?}");
    let mut files = Vec::new();
    source_files(&src, &mut files);
    let mut found: Vec<String> = Vec::new();
    for file in files {
        if named_methods(&fs::read_to_string(&file).unwrap(), &methods).len() > 1 {
            found.push(path_in_house(&file));
        }
    }
    found.sort();
    let mut may = MAY_NAME_METHODS.to_vec();
    may.sort();
    assert_eq!(found, may, "files that name several methods, and those that may");
}

/// Kinds of closures that a file tells apart by their names.
fn closures_told_apart(text: &str) -> Vec<&'static str> {
    let code = code_only(text);
    ["Sheet::Specular", "Sheet::Lambertian", "Sheet::Measured"].into_iter().filter(|name| code.contains(name)).collect()
}

/// What scatters how is known in `optics/` alone; everybody else asks for values, densities, samples and albedos. (Lobes are
/// private there.)
#[test]
fn closures_are_told_apart_in_optics_only() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    source_files(&src, &mut files);
    let told_apart = |file: &Path| closures_told_apart(&fs::read_to_string(file).unwrap());
    let found: Vec<String> = files
        .iter()
        .filter(|file| !file.starts_with(src.join("physics/optics")) && !told_apart(file).is_empty())
        .map(|file| format!("{}: {}", file.display(), told_apart(file).join(", ")))
        .collect();
    assert!(found.is_empty(), "files that ask what a closure is:\n{}", found.join("\n"));
    let example = "match sheet { Sheet::Measured(table) => table.albedos(1.0), _ => todo!() } // Sheet::Specular";
    assert_eq!(closures_told_apart(example), ["Sheet::Measured"]);
}

/// Files of the physics that ask for a box, or name its faces: what builds one, what has a formula for it alone, and what is exact or
/// quicker there and works in every other room.
const ASK_FOR_BOXES: &[&str] = &[
    "analytic/",
    "integrator/deterministic.rs",
    "integrator/photon_map/domain.rs",
    "scene/enclosure.rs",
    "traceable/enclosure.rs",
    "traceable/occupied.rs",
    "traceable/surface_id.rs",
];

/// Rooms have faces of any number and any slope: nobody else in the physics knows of six.
#[test]
fn rooms_are_no_boxes() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/physics");
    let mut files = Vec::new();
    source_files(&src, &mut files);
    let asks = |file: &PathBuf| {
        let code = code_only(&fs::read_to_string(file).unwrap());
        let code = code.split("#[cfg(test)]\nmod tests").next().unwrap_or(&code);
        ["as_box(", "Face::", "of_face("].iter().any(|word| code.split(word).skip(1).count() > 0)
    };
    let path = |file: &PathBuf| file.strip_prefix(&src).unwrap().to_string_lossy().into_owned();
    let asking: Vec<String> = files.iter().filter(|file| asks(file)).map(path).collect();
    let others: Vec<_> = asking.iter().filter(|file| !ASK_FOR_BOXES.iter().any(|may| file.starts_with(may))).collect();
    assert!(others.is_empty(), "files that ask for a box: {others:?}");
    let idle: Vec<_> = ASK_FOR_BOXES.iter().filter(|may| !asking.iter().any(|file| file.starts_with(**may))).collect();
    assert!(idle.is_empty(), "files that ask for none: {idle:?}");
}

#[test]
fn methods_are_found_by_their_names() {
    let methods = methods("pub enum Method {\n    Sppm(sppm::Settings),\n    TwoStage(two_stage::Settings),\n}\n");
    let named = |text: &str| named_methods(text, &methods).len();
    assert_eq!(named("use super::sppm; match method { Method::TwoStage(_) => {} }"), 2);
    assert_eq!(named("if name == \"sppm\" { two_stage::refuses() }"), 2);
    assert_eq!(named("pub mod sppm;\nmod two_stage;"), 0);
    assert_eq!(named("// as in sppm\nlet text = \"use sppm or two_stage\";"), 0);
}
