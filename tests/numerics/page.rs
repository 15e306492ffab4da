//! docs/numerics.md against the tests that it names and the numbers that it prints.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::forms::{self, exponent};
use crate::source_files::source_files;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn page() -> String {
    fs::read_to_string(root().join("docs/numerics.md")).unwrap()
}

/// The tests that the page names, as `file::name` or `folder/file::name`.
fn named(page: &str) -> Vec<(&str, &str)> {
    page.split('`').skip(1).step_by(2).filter_map(|code| code.split_once("::")).collect()
}

#[test]
fn tests_that_the_page_names_exist() {
    let page = page();
    let named = named(&page);
    assert!(named.len() > 69, "{named:?}");
    let mut files = Vec::new();
    source_files(&root().join("src"), &mut files);
    source_files(&root().join("tests"), &mut files);
    for (file, test) in named {
        let text: String = files
            .iter()
            .filter(|path| path.with_extension("").ends_with(file) || path.ends_with(format!("{file}/mod.rs")))
            .map(|path| fs::read_to_string(path).unwrap())
            .collect();
        assert!(text.contains(&format!("fn {test}(")), "docs/numerics.md names {file}::{test}, which is not there");
    }
}

/// Every test of this binary but those of the page itself is in the table.
#[test]
fn the_page_names_every_test_here() {
    let page = page();
    let named: BTreeSet<_> = named(&page).into_iter().collect();
    for entry in fs::read_dir(root().join("tests/numerics")).unwrap() {
        let path = entry.unwrap().path();
        let module = path.file_stem().unwrap().to_str().unwrap().to_owned();
        if module == "page" {
            continue;
        }
        let text = fs::read_to_string(&path).unwrap();
        for after in text.split("#[test]").skip(1) {
            let name = after.split_once("fn ").unwrap().1.split_once('(').unwrap().0;
            assert!(named.contains(&(module.as_str(), name)), "docs/numerics.md does not name {module}::{name}");
        }
    }
}

/// The table has every case once, in order.
#[test]
fn the_page_has_every_case() {
    let page = page();
    let numbers: Vec<u32> =
        page.lines().filter_map(|line| line.strip_prefix("| ")?.split_once(" |")?.0.parse().ok()).collect();
    assert_eq!(numbers, (1..=69).collect::<Vec<_>>());
}

const BEGIN: &str = "<!-- measured by `UPDATE_NUMERICS=1 cargo test --test numerics page` -->\n";
const END: &str = "<!-- end -->";

/// Error of a naive form from which on what it gives is printed, not its error alone: digits that depend on a rounding are
/// not the same everywhere.
const VISIBLE: f64 = 1e-3;

/// The table of formulas: six digits of what is visibly wrong, and the next power of ten above smaller errors.
fn measured() -> String {
    let mut table = String::from(
        "| formula | at | naive form | gives | true | used form | error below |\n| --- | --- | --- | --- | --- | --- | --- |\n",
    );
    let number = |value: f64| match value {
        value if value.is_finite() && (value == 0.0 || (1e-4..1e9).contains(&value.abs())) => {
            let digits = (5 - value.abs().max(1e-300).log10().floor() as i32).clamp(0, 9) as usize;
            let text = format!("{value:.digits$}");
            if value == 0.0 { "0".to_owned() } else { text }
        }
        value if value.is_finite() => format!("{value:.5e}"),
        value => value.to_string(),
    };
    for form in forms::all() {
        let naive = form.error(form.naive);
        table += &format!(
            "| {} | {} | {} | {} | {} | {} | 1e{} |\n",
            form.what,
            form.input,
            form.naive_form,
            if naive < VISIBLE { format!("off by 1e{}", exponent(naive)) } else { number(form.naive) },
            number(form.truth),
            form.used_form,
            exponent(form.error(form.used)),
        );
    }
    table
}

/// What the page prints is what these forms give today; `UPDATE_NUMERICS=1` writes it anew.
#[test]
fn the_page_prints_what_is_measured() {
    let page = page();
    let (before, rest) = page.split_once(BEGIN).unwrap();
    let (printed, after) = rest.split_once(END).unwrap();
    let measured = measured();
    if std::env::var_os("UPDATE_NUMERICS").is_some() {
        fs::write(root().join("docs/numerics.md"), format!("{before}{BEGIN}{measured}{END}{after}")).unwrap();
        return;
    }
    assert!(printed == measured, "docs/numerics.md prints\n{printed}\nbut these are measured\n{measured}");
}

/// Every naive form is wrong where it is said to be: by ten times the error of the form that is used at least, which is below
/// 1e-6.
#[test]
fn naive_forms_fail_and_used_ones_do_not() {
    for form in forms::all() {
        let [naive, used] = [form.naive, form.used].map(|value| form.error(value));
        println!("{}: naive {naive:e}, used {used:e}", form.what);
        assert!(used < 1e-6, "{}: {used}", form.what);
        assert!(naive.is_nan() || naive > 10.0 * used, "{}: {naive:e} {used:e}", form.what);
    }
}
