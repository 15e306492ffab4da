//! What comments and pages refer to can be opened: files and headings of this repository exist, and no text outside of it is
//! cited but by the names of its authors (docs/physics/README.md has the bibliography).

use std::fs;
use std::path::{Path, PathBuf};

/// Folders whose files a comment or a page may name.
const FOLDERS: &[&str] = &["docs/", "src/", "tests/", "examples/", "config/", "migrations/"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn files(folder: &Path, extension: &str, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, extension, found);
        } else if path.extension().is_some_and(|other| other == extension) {
            found.push(path);
        }
    }
}

/// The comments of the sources, with their files.
fn comments() -> Vec<(PathBuf, String)> {
    let mut sources = Vec::new();
    for folder in ["src", "tests"] {
        files(&root().join(folder), "rs", &mut sources);
    }
    let comment = |line: &str| {
        let line = line.trim_start();
        line.starts_with("//").then(|| line.trim_start_matches(['/', '!']).trim().to_owned())
    };
    let of_file = |path: PathBuf| {
        let text = fs::read_to_string(&path).unwrap();
        (path, text.lines().filter_map(comment).collect::<Vec<_>>().join(" "))
    };
    sources.into_iter().map(of_file).collect()
}

/// The pages of the repository, with their texts.
fn pages() -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    files(&root().join("docs"), "md", &mut found);
    let top = fs::read_dir(root()).unwrap().map(|entry| entry.unwrap().path());
    found.extend(top.filter(|path| path.extension().is_some_and(|extension| extension == "md")));
    found.into_iter().map(|path| (path.clone(), fs::read_to_string(path).unwrap())).collect()
}

/// References to papers that only their author has: a title in capitals with a number, or with a quotation, a numbered remark.
fn citations(text: &str) -> Vec<String> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let bare = |word: &str| word.trim_matches(|c: char| !(c.is_alphanumeric() || c == '#')).to_owned();
    let capitals = |word: &str, least: usize| word.len() >= least && word.chars().all(|c| c.is_ascii_uppercase());
    let number = |word: &str| word.starts_with(|c: char| c.is_ascii_digit());
    let mut found = Vec::new();
    for (k, word) in words.iter().enumerate() {
        let next = words.get(k + 1).copied().unwrap_or_default();
        let (this, after) = (bare(word), bare(next));
        let section = number(next) && (after.contains('.') || after.len() <= 2);
        let title = capitals(&this, 5) && !word.ends_with(['.', ';', ',']) && (section || after == "section");
        let quoted = capitals(&this, 3) && word.ends_with(':') && next.starts_with('"');
        let remark = this.len() == 3
            && this.starts_with(|c: char| c.is_ascii_uppercase())
            && number(&this[1..])
            && number(&this[2..]);
        let numbered = (this == "issue" || this == "finding") && number(&after);
        let hash = this.len() > 1 && this.starts_with('#') && this[1..].chars().all(|c| c.is_ascii_digit());
        if title || quoted || remark || numbered || hash {
            found.push(format!("{word} {next}"));
        }
    }
    found
}

/// Authors and years that a text cites, e.g. `Zwicker` and `2011`: a name, or a name and `et al.`, before a year.
fn papers(text: &str) -> Vec<(&str, &str)> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let letters = |word: &str| word.starts_with(|c: char| c.is_uppercase()) && word.chars().all(char::is_alphabetic);
    let mut found = Vec::new();
    for (k, word) in words.iter().enumerate().skip(1) {
        let year = word.trim_matches(|c: char| !c.is_ascii_digit());
        let recent = year.len() == 4 && ["17", "18", "19", "20"].iter().any(|century| year.starts_with(century));
        let before = if words[k - 1] == "al." && k >= 3 { words[k - 3] } else { words[k - 1] };
        let name = before.trim_matches(|c: char| "(,;\"".contains(c));
        if recent && !word.contains(['-', '/', '%', '=']) && letters(name) {
            found.push((name, year));
        }
    }
    found
}

/// The anchors of a page's headings, as GitHub makes them.
fn anchors(text: &str) -> Vec<String> {
    let headings = text.lines().filter(|line| line.starts_with('#')).map(|line| line.trim_start_matches('#').trim());
    let anchor = |heading: &str| {
        let kept =
            heading.to_lowercase().chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c)).collect::<String>();
        kept.replace(' ', "-")
    };
    headings.map(anchor).collect()
}

/// Fault of a link from the folder `from`; `None` when it leads somewhere.
fn broken(from: &Path, link: &str) -> Option<String> {
    let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
    let path = if file.is_empty() { from.to_owned() } else { from.join(file) };
    if !path.exists() {
        return Some(format!("{link}: no such file"));
    }
    let has_anchor = |text: String| anchors(&text).iter().any(|other| other == anchor);
    let lost = !anchor.is_empty() && !fs::read_to_string(&path).is_ok_and(has_anchor);
    lost.then(|| format!("{link}: no such heading"))
}

/// Paths of this repository that a text names, e.g. `docs/physics/tubes.md#mitred-elbows`.
fn named_paths(text: &str) -> Vec<&str> {
    let words = text.split(|c: char| c.is_whitespace() || "`()[]{},;:\"'<>|".contains(c));
    let words = words.map(|word| word.trim_end_matches(['.', '!', '?']));
    let named = |word: &&str| {
        FOLDERS.iter().any(|folder| word.starts_with(folder) && word.len() > folder.len())
            && !word.contains(['*', '$', '…'])
    };
    words.filter(named).collect()
}

/// Relative links of a page in Markdown.
fn links(text: &str) -> Vec<&str> {
    let targets = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    targets.filter(|target| !target.contains("://") && !target.starts_with("mailto:")).collect()
}

#[test]
fn comments_and_pages_cite_what_can_be_opened() {
    let texts: Vec<_> = comments().into_iter().chain(pages()).collect();
    assert!(texts.len() > 200, "the sources were not found");
    let mut found = Vec::new();
    for (path, text) in &texts {
        let path = path.strip_prefix(root()).unwrap().display();
        found.extend(citations(text).into_iter().map(|citation| format!("{path}: {citation}")));
        let broken = named_paths(text).into_iter().filter_map(|named| broken(root(), named));
        found.extend(broken.map(|broken| format!("{path}: {broken}")));
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn links_of_pages_lead_somewhere() {
    let mut found = Vec::new();
    for (path, text) in pages() {
        let folder = path.parent().unwrap();
        for link in links(&text) {
            let broken = match link.strip_prefix('#') {
                Some(anchor) if anchors(&text).iter().any(|other| other == anchor) => None,
                Some(_) => Some(format!("{link}: no such heading")),
                None => broken(folder, link),
            };
            found.extend(broken.map(|broken| format!("{}: {broken}", path.display())));
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn papers_that_comments_cite_are_in_the_bibliography() {
    let bibliography = fs::read_to_string(root().join("docs/physics/README.md")).unwrap();
    let listed: Vec<&str> = bibliography.split("\n- ").collect();
    let mut cited = 0;
    let mut found = Vec::new();
    for (path, text) in comments() {
        let of_file = papers(&text);
        cited += of_file.len();
        let missing = of_file.iter().filter(|(name, year)| {
            // in this order: its entry begins with the names
            !listed.iter().any(|entry| entry.find(name).is_some_and(|at| entry[at..].contains(year)))
        });
        found.extend(missing.map(|(name, year)| format!("{}: {name} {year}", path.display())));
    }
    assert!(cited > 30, "{cited}");
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn citations_are_seen() {
    for bad in [
        "by the rule (PAPER 3.2)",
        "see TABLES section 5",
        "as R16 says",
        "(WORK: \"when\")",
        "finding 12",
        "as in #123",
    ] {
        assert_eq!(citations(bad).len(), 1, "{bad}");
    }
    for good in
        ["Walter et al. 2007, eq. 33", "CIE 171:2006", "RFC 9457, section 3", "scene S4", "IEEE 754", "A4 paper"]
    {
        assert_eq!(citations(good), Vec::<String>::new(), "{good}");
    }
    assert_eq!(
        papers("(Knaus and Zwicker 2011; Walter et al. 2007, eq. 33)"),
        [("Zwicker", "2011"), ("Walter", "2007")]
    );
    assert_eq!(
        named_paths("see docs/style.md, or `src/physics/sky/cie.rs`."),
        ["docs/style.md", "src/physics/sky/cie.rs"]
    );
    assert!(broken(root(), "docs/architecture.md#rooms").is_none());
    assert!(broken(root(), "docs/architecture.md#cellar").is_some() && broken(root(), "docs/nowhere.md").is_some());
}
