//! Names the version of a build: `SKYDUCT_VERSION`, or that of the package, with the commit where a release is built in a checkout.

use std::path::Path;
use std::process::Command;

fn main() {
    let variable = |name: &str| std::env::var(name).ok().filter(|value| !value.is_empty());
    println!("cargo::rerun-if-env-changed=SKYDUCT_VERSION");
    println!("cargo::rerun-if-changed=src/build.rs");
    let package = variable("CARGO_PKG_VERSION").unwrap_or_default();
    // other builds are not made anew for each commit
    let commit = if variable("PROFILE").as_deref() == Some("release") { commit() } else { None };
    let named = commit.map_or(package.clone(), |commit| format!("{package} ({commit})"));
    println!("cargo::rustc-env=VERSION_OF_BUILD={}", variable("SKYDUCT_VERSION").unwrap_or(named));
}

/// Commit of the checkout; `None` outside of one.
fn commit() -> Option<String> {
    for file in [".git/HEAD", ".git/index", "src", "Cargo.toml", "Cargo.lock"]
        .into_iter()
        .filter(|file| Path::new(file).exists())
    {
        println!("cargo::rerun-if-changed={file}");
    }
    let described = Command::new("git").args(["describe", "--always", "--dirty", "--abbrev=10"]).output().ok()?;
    let commit = String::from_utf8(described.stdout).ok()?;
    (described.status.success() && Path::new(".git").exists()).then(|| commit.trim().to_owned())
}
