//! Files of a room import one way, too.
//!
//! What counts: every path in a file that leads to another file of its room, in `use` or inline, outside comments and the
//! file's own tests. A path through a re-export (`pub use`) leads to the file where the thing stands. In a `mod.rs` neither
//! `mod` nor `pub use` counts; all else does, so a file that takes something from the `mod.rs` above it is in a circle
//! exactly if that `mod.rs` makes use of the file. Calls of methods are not seen, only names.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use crate::architecture::{code_only, path_in_house};
use crate::source_files::source_files;

/// Rooms where no file takes anything from a `mod.rs` above it.
const NO_CLIMBING: &[&str] = &["integrator", "traceable"];

/// Most re-exports that a path is followed through.
const MOST_HOPS: usize = 8;

/// Segments of the path of a module or of a thing in it, from its room on.
type Segments = Vec<String>;

/// One name that a `use` statement brings in.
#[derive(Debug)]
struct Import {
    path: Segments,
    name: String,
    public: bool,
}

#[derive(Debug)]
struct Module {
    /// Path of the file in the house.
    file: String,
    /// Modules that it declares.
    children: BTreeSet<String>,
    imports: Vec<Import>,
    /// Paths in its code beside the `use` statements.
    inline: Vec<Segments>,
}

/// All modules by their paths.
type House = BTreeMap<Segments, Module>;

fn identifier(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

fn module_path(file: &str) -> Segments {
    let path = file.trim_end_matches(".rs");
    let path = path.strip_suffix("/mod").unwrap_or(path);
    path.split('/').map(str::to_owned).collect()
}

/// Adds the paths of a tree of `use`: `a::{b, c::d as e}` has two.
fn expand(tree: &str, before: &[String], public: bool, imports: &mut Vec<Import>) {
    let tree = tree.trim();
    if let Some((head, group)) = tree.split_once('{') {
        let mut path = before.to_vec();
        path.extend(head.split("::").map(str::trim).filter(|segment| !segment.is_empty()).map(str::to_owned));
        let group = group.trim_end().strip_suffix('}').unwrap_or(group);
        let (mut depth, mut start) = (0, 0);
        for (at, c) in group.char_indices().chain([(group.len(), ',')]) {
            match c {
                '{' => depth += 1,
                '}' => depth -= 1,
                ',' if depth == 0 => {
                    if !group[start..at].trim().is_empty() {
                        expand(&group[start..at], &path, public, imports);
                    }
                    start = at + 1;
                }
                _ => {}
            }
        }
        return;
    }
    let (path, alias) = tree.split_once(" as ").map_or((tree, None), |(path, alias)| (path, Some(alias.trim())));
    let mut segments = before.to_vec();
    segments.extend(path.split("::").map(|segment| segment.trim().to_owned()));
    if segments.last().is_some_and(|last| last == "self") && segments.len() > 1 {
        segments.pop();
    }
    let name = alias.map_or_else(|| segments.last().cloned().unwrap_or_default(), str::to_owned);
    imports.push(Import { path: segments, name, public });
}

fn read(file: &str, text: &str) -> Module {
    let code = code_only(text);
    let code = code.split("#[cfg(test)]\nmod tests").next().unwrap_or(&code);
    let mut module =
        Module { file: file.to_owned(), children: BTreeSet::new(), imports: Vec::new(), inline: Vec::new() };
    for statement in code.split_inclusive([';', '{', '}']) {
        if let Some((before, name)) = statement.strip_suffix(';').and_then(|words| words.rsplit_once("mod "))
            && !before.ends_with(identifier)
            && name.chars().all(identifier)
        {
            module.children.insert(name.to_owned());
        }
    }
    let mut rest = code.to_owned();
    let mut inline = String::new();
    while let Some(at) = find_use(&rest) {
        let end = rest[at..].find(';').map_or(rest.len(), |end| at + end);
        let public = is_public(&rest[..at]);
        expand(&rest[at + "use ".len()..end], &[], public, &mut module.imports);
        inline.push_str(&rest[..at]);
        rest.replace_range(..end, "");
    }
    inline.push_str(&rest);
    module.inline = paths(&inline);
    module
}

/// True if `pub` or `pub(…)` stands at the end of the code before a statement.
fn is_public(before: &str) -> bool {
    let before = before.trim_end();
    let inside = before.strip_suffix(')').and_then(|before| before.rsplit_once("pub(")).map(|(_, inside)| inside);
    before.ends_with("pub") || inside.is_some_and(|inside| inside.chars().all(|c| identifier(c) || " :".contains(c)))
}

/// Where the next `use` statement begins.
fn find_use(code: &str) -> Option<usize> {
    code.match_indices("use ").map(|(at, _)| at).find(|at| !code[..*at].ends_with(identifier))
}

/// Paths of two segments or more in code.
fn paths(code: &str) -> Vec<Segments> {
    let mut found = Vec::new();
    let mut rest = code;
    while let Some(start) = rest.find(identifier) {
        let before = &rest[..start];
        let continues = before.ends_with("::") || before.ends_with('.');
        rest = &rest[start..];
        let mut path = Vec::new();
        loop {
            let end = rest.find(|c| !identifier(c)).unwrap_or(rest.len());
            path.push(rest[..end].to_owned());
            rest = &rest[end..];
            match rest.strip_prefix("::") {
                Some(after) if after.starts_with(identifier) => rest = after,
                _ => break,
            }
        }
        if path.len() > 1 && !continues {
            found.push(path);
        }
    }
    found
}

/// The path from the crate's root on of a path in module `of`; `None` if it leads out of the crate.
fn absolute(house: &House, of: &[String], path: &[String], hops: usize) -> Option<Segments> {
    let module = house.get(of)?;
    let (first, after) = path.split_first()?;
    let join = |start: &[String]| Some(start.iter().chain(after).cloned().collect());
    match first.as_str() {
        // a room that is a crate
        "crate" if of[0] == "annual" => join(&of[..1]),
        "crate" => Some(after.to_vec()),
        "self" => join(of),
        "super" => {
            let levels = path.iter().take_while(|segment| *segment == "super").count();
            Some(of[..of.len().checked_sub(levels)?].iter().chain(&path[levels..]).cloned().collect())
        }
        name if module.children.contains(name) => join(&[of, std::slice::from_ref(first)].concat()),
        name if hops > 0 => {
            let import = module.imports.iter().find(|import| import.name == name && import.path[0] != name)?;
            join(&absolute(house, of, &import.path, hops - 1)?)
        }
        _ => None,
    }
}

/// The module where a thing stands; `None` for a module itself and for what is in none.
fn home(house: &House, path: &[String], hops: usize) -> Option<Segments> {
    let length = (1..=path.len()).rev().find(|length| house.contains_key(&path[..*length]))?;
    let (module, rest) = path.split_at(length);
    let (name, after) = rest.split_first()?;
    let handed_on = house[module].imports.iter().find(|import| import.public && import.name == *name);
    match handed_on.filter(|_| hops > 0) {
        Some(import) => {
            let start = absolute(house, module, &import.path, MOST_HOPS)?;
            home(house, &[start.as_slice(), after].concat(), hops - 1)
        }
        None => Some(module.to_vec()),
    }
}

/// The modules of the same room that a module makes use of.
fn made_use_of(house: &House, of: &[String]) -> BTreeSet<Segments> {
    let module = &house[of];
    let own = module.imports.iter().filter(|import| !import.public).map(|import| &import.path);
    own.chain(&module.inline)
        .filter_map(|path| home(house, &absolute(house, of, path, MOST_HOPS)?, MOST_HOPS))
        .filter(|home| home.first() == of.first() && home != of)
        .collect()
}

/// Files of each room that reach themselves, and imports from a `mod.rs` above.
fn circles_and_climbs(house: &House) -> (BTreeMap<String, BTreeSet<String>>, Vec<String>) {
    let edges: BTreeMap<&Segments, BTreeSet<Segments>> =
        house.keys().map(|module| (module, made_use_of(house, module))).collect();
    let mut circles: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let mut climbs = Vec::new();
    for (module, targets) in &edges {
        let mut reached = BTreeSet::new();
        let mut next: Vec<&Segments> = targets.iter().collect();
        while let Some(target) = next.pop() {
            if reached.insert(target) {
                next.extend(&edges[target]);
            }
        }
        if reached.contains(module) {
            circles.entry(module[0].clone()).or_default().insert(house[*module].file.clone());
        }
        for above in targets.iter().filter(|target| module.starts_with(target)) {
            climbs.push(format!("{} imports from {}", house[*module].file, house[above].file));
        }
    }
    (circles, climbs)
}

fn house_of(files: &[(&str, &str)]) -> House {
    files.iter().map(|(file, text)| (module_path(file), read(file, text))).collect()
}

#[test]
fn files_of_a_room_import_in_no_circle() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    source_files(&src, &mut files);
    let texts: Vec<(String, String)> =
        files.iter().map(|file| (path_in_house(file), fs::read_to_string(file).unwrap())).collect();
    let texts: Vec<(&str, &str)> = texts.iter().map(|(file, text)| (file.as_str(), text.as_str())).collect();
    let house = house_of(&texts);
    let imports: usize = house.keys().map(|module| made_use_of(&house, module).len()).sum();
    assert!(imports > 300, "imports were not read: {imports}");
    let (circles, climbs) = circles_and_climbs(&house);
    assert!(circles.is_empty(), "these files import in circles: {circles:#?}");
    let climbs: Vec<_> = climbs
        .into_iter()
        .filter(|climb| NO_CLIMBING.iter().any(|room| climb.starts_with(&format!("{room}/"))))
        .collect();
    assert!(climbs.is_empty(), "{}", climbs.join("\n"));
}

#[test]
fn circles_are_seen() {
    let circular: &[&[(&str, &str)]] = &[
        &[("a/b.rs", "use super::c::C;"), ("a/c.rs", "fn f() { super::b::g() }")],
        &[("a/mod.rs", "mod b; use b::B; struct A;"), ("a/b.rs", "use super::A;")],
        &[("a/mod.rs", "pub mod b; fn f() { b::g() } struct A;"), ("a/b.rs", "use crate::a::{A};")],
        // through a re-export, by the name of a module, under another name
        &[
            ("a/mod.rs", "mod b; mod c; pub use c::C;"),
            ("a/b.rs", "use super::C;"),
            ("a/c.rs", "use crate::a::{b as d}; fn f() { d::g() }"),
        ],
        &[("annual/b.rs", "use crate::c::C;"), ("annual/c.rs", "use crate::b::B;")],
        &[
            ("a/b/mod.rs", "pub mod e;"),
            ("a/b/e.rs", "use crate::a::c::C;"),
            ("a/c.rs", "use super::b; fn f() -> b::e::E {}"),
        ],
    ];
    for files in circular {
        let (circles, _) = circles_and_climbs(&house_of(files));
        assert!(circles.values().any(|files| files.len() > 1), "{files:?}: {circles:?}");
    }
}

#[test]
fn one_way_is_no_circle() {
    let straight: &[&[(&str, &str)]] = &[
        &[("a/mod.rs", "pub mod b; mod c; pub use b::B;"), ("a/b.rs", "use super::c::C;"), ("a/c.rs", "struct C;")],
        &[
            ("a/mod.rs", "mod b; use b::B;"),
            ("a/b.rs", "// use super::A;\n#[cfg(test)]\nmod tests { use super::super::A; }"),
        ],
        &[("a/b.rs", "use crate::c::C; use std::fs; fn f() { fs::read() }"), ("c/mod.rs", "use crate::a::b::B;")],
    ];
    for files in straight {
        let (circles, climbs) = circles_and_climbs(&house_of(files));
        assert!(circles.is_empty() && climbs.is_empty(), "{files:?}: {circles:?} {climbs:?}");
    }
    let (circles, climbs) =
        circles_and_climbs(&house_of(&[("a/mod.rs", "mod b; struct A;"), ("a/b.rs", "use super::A;")]));
    assert!(circles.is_empty() && climbs == ["a/b.rs imports from a/mod.rs"], "{climbs:?}");
}
