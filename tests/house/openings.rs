//! Doc comments open with a verb or a noun, as those of other libraries do: "Computes ..", "Distance in m ..". One that opens with
//! "What", "How" or "Of" speaks in riddles to whoever reads it alone.

use std::fs;
use std::path::Path;

use crate::source_files::source_files;

/// First words that no doc comment should have.
const RIDDLES: [&str; 11] =
    ["What", "How", "The same", "Where", "Of", "Why", "As", "Whether", "Which", "That", "Those"];

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
    let mut files = Vec::new();
    source_files(&root, &mut files);
    let mut found = Vec::new();
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        let relative = file.strip_prefix(&root).unwrap();
        found.extend(riddles(&text).into_iter().map(|line| format!("{}: {line}", relative.display())));
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}
