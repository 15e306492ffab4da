//! Doc comments open with a verb or a noun, as those of other libraries do: "Computes ..", "Distance in m ..". One that opens with
//! "What", "How" or "Of" speaks in riddles to whoever reads it alone.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::source_files::source_files;

/// First words that no doc comment should have.
const RIDDLES: [&str; 11] =
    ["What", "How", "The same", "Where", "Of", "Why", "As", "Whether", "Which", "That", "Those"];

/// Rooms that still have such doc comments, and how many at most: only ever lowered.
const STILL: &[(&str, usize)] = &[
    ("cli", 10),
    ("db", 12),
    ("document", 59),
    ("figure", 42),
    ("http", 73),
    ("job", 137),
    ("output", 1),
    ("physics/analytic", 4),
    ("physics/estimate", 14),
    ("physics/geometry", 18),
    ("physics/guide", 22),
    ("physics/integrator", 129),
    ("physics/optics", 12),
    ("physics/plan", 11),
    ("physics/sampling", 7),
    ("physics/scene", 5),
    ("physics/sky", 7),
    ("physics/statistics", 2),
    ("physics/traceable", 26),
    ("reports", 46),
    ("study", 49),
];

/// The room of a file: a folder of `src`, of the physics crate the folder below.
fn room(file: &Path) -> String {
    let mut parts = file.iter().map(|part| part.to_string_lossy().into_owned());
    let first = parts.next().unwrap_or_default();
    match parts.next() {
        Some(second) if first == "physics" => format!("{first}/{second}"),
        _ => first,
    }
}

/// First lines of the doc comments of a text that open with a riddle.
fn riddles(text: &str) -> Vec<&str> {
    let mut found = Vec::new();
    let mut is_inside = false;
    for line in text.lines().map(str::trim_start) {
        let comment = line.strip_prefix("///").or_else(|| line.strip_prefix("//!"));
        if let Some(comment) = comment.filter(|_| !is_inside) {
            let comment = comment.trim();
            let opens = |word: &&str| comment.strip_prefix(*word).is_some_and(|rest| rest.starts_with([' ', ',', ':']));
            found.extend(RIDDLES.iter().any(opens).then_some(comment));
        }
        is_inside = comment.is_some();
    }
    found
}

#[test]
fn riddles_are_seen() {
    let text =
        "/// What a lamp sends.\n/// How is told below.\nfn a() {}\n\n    /// Whatever.\n    fn b() {}\n//! Of all.\n";
    assert_eq!(riddles(text), ["What a lamp sends.", "Of all."]);
}

#[test]
fn doc_comments_open_with_a_verb_or_a_noun() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut counts: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut files = Vec::new();
    source_files(&root, &mut files);
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        let relative = file.strip_prefix(&root).unwrap();
        let found = riddles(&text).into_iter().map(|line| format!("{}: {line}", relative.display()));
        counts.entry(room(relative)).or_default().extend(found);
    }
    let allowed: BTreeMap<&str, usize> = STILL.iter().copied().collect();
    for (room, found) in counts {
        let most = allowed.get(room.as_str()).copied().unwrap_or(0);
        assert!(found.len() <= most, "{room} has {} of {most}:\n{}", found.len(), found.join("\n"));
    }
}
