//! Other programs on the same scenes (Radiance, Mitsuba, LuxCore and Embree), run by a folder of scripts where they are
//! installed.
//!
//! The folder has a Python script for each program, which takes a scene and a number of processor seconds, and writes its runs to
//! `results/*.json`; `gen_scenes.py`, which writes the scenes; and `embree_rays.cpp`. The scripts run in a copy of it.

use std::io::Read as _;
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, bail};

use crate::bench::peers::{Beside, EmbreeRate, Record};
use crate::bench::{Progress, Settings};
use skyduct::cli::temporary_folder::TemporaryFolder;

#[derive(Debug, clap::Args)]
pub struct PeersArgs {
    /// Folder of scripts that run other programs on the same scenes; the installed ones run before the benchmark
    #[arg(long, value_name = "FOLDER")]
    peers: Option<PathBuf>,
    /// Python interpreter that has the packages of these programs
    #[arg(long, value_name = "PROGRAM", default_value = "python3", requires = "peers")]
    python: PathBuf,
    /// Processor seconds of each run of these programs
    #[arg(long, value_name = "S", default_value_t = 10, requires = "peers", value_parser = clap::value_parser!(u64).range(1..))]
    peer_seconds: u64,
}

/// Script that runs a program.
struct Script {
    program: &'static str,
    /// Python package that the script needs.
    package: &'static str,
    /// File name and arguments of the script; `{seconds}` stands for processor seconds.
    words: &'static [&'static str],
}

const SCRIPTS: [Script; 11] = [
    // runs of 2 s make a sweep of one to two minutes
    radiance(&["run_radiance.py", "S1", "2"]),
    radiance(&["run_radiance.py", "S3", "2"]),
    mitsuba(&["run_mitsuba.py", "S1", "llvm_ad_rgb", "ptracer", "{seconds}", "1"]),
    mitsuba(&["run_mitsuba.py", "S1", "llvm_ad_rgb", "path", "{seconds}", "1"]),
    mitsuba(&["run_mitsuba.py", "S2", "llvm_ad_rgb", "ptracer", "{seconds}", "1"]),
    mitsuba(&["run_mitsuba.py", "S3", "llvm_ad_rgb", "ptracer", "{seconds}", "1"]),
    // the reference of the image first
    mitsuba(&["run_s4.py", "llvm_ad_rgb", "ref", "30"]),
    mitsuba(&["run_s4.py", "llvm_ad_rgb", "path", "{seconds}"]),
    mitsuba(&["run_s4.py", "llvm_ad_rgb", "ptracer", "{seconds}"]),
    luxcore(&["run_luxcore.py", "S1", "PATHCPU", "{seconds}", "1"]),
    luxcore(&["run_luxcore.py", "S2", "BIDIRCPU", "{seconds}", "1"]),
];

/// Wall-clock time after which a script is killed; its results until then count.
const LONGEST: Duration = Duration::from_secs(240);

const fn radiance(words: &'static [&'static str]) -> Script {
    Script { program: "Radiance", package: "pyradiance", words }
}

const fn mitsuba(words: &'static [&'static str]) -> Script {
    Script { program: "Mitsuba", package: "mitsuba", words }
}

const fn luxcore(words: &'static [&'static str]) -> Script {
    Script { program: "LuxCore", package: "pyluxcore", words }
}

impl PeersArgs {
    /// True if other programs are to run.
    pub fn any(&self) -> bool {
        self.peers.is_some()
    }
}

/// Runs the programs that are installed; `None` without a folder of scripts.
pub fn measure(args: &PeersArgs, settings: &Settings, progress: Progress) -> anyhow::Result<Option<Beside>> {
    let Some(folder) = &args.peers else { return Ok(None) };
    let copy = TemporaryFolder::new("peers")?;
    let peers = copy.path().join("peers");
    copy_files(folder, &peers).with_context(|| format!("{} cannot be copied", folder.display()))?;
    // the folder in which the scripts look for the references
    let references = settings.reference.join("scenes");
    copy_files(&references, &copy.path().join("reference/scenes"))
        .with_context(|| format!("{} cannot be copied", references.display()))?;
    let all = SCRIPTS.len() + 2;
    progress.step(0, all, "other programs: their scenes");
    python(args, &peers, &["gen_scenes.py".to_owned()]).context("the scenes of other programs cannot be written")?;
    let mut absent = Vec::new();
    for (number, Script { program, package, words }) in SCRIPTS.iter().enumerate() {
        progress.step(number + 1, all, &format!("other programs: {program}, {}", words.join(" ")));
        let words: Vec<_> =
            words.iter().map(|word| word.replace("{seconds}", &args.peer_seconds.to_string())).collect();
        let installed = python(args, &peers, &["-c".to_owned(), format!("import {package}")]).is_ok();
        let failed = if installed { python(args, &peers, &words).err() } else { None };
        let why = match failed {
            Some(error) => format!("`{}` ({error:#})", words.join(" ")),
            None if installed => continue,
            None => format!("{program} (not installed)"),
        };
        if !absent.contains(&why) {
            absent.push(why);
        }
    }
    progress.step(SCRIPTS.len() + 1, all, "other programs: Embree");
    let embree = embree(&peers).map_err(|error| absent.push(format!("Embree ({error:#})"))).ok();
    Ok(Some(Beside::new(records(&peers.join("results")), embree, absent)))
}

fn copy_files(from: &Path, to: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(to)?;
    for entry in std::fs::read_dir(from)? {
        let entry = entry?;
        if entry.file_type()?.is_file() {
            let bytes = std::fs::read(entry.path())?;
            std::fs::write(to.join(entry.file_name()), bytes)?;
        }
    }
    Ok(())
}

fn python(args: &PeersArgs, folder: &Path, words: &[String]) -> anyhow::Result<()> {
    output(Command::new(&args.python).args(words).current_dir(folder)).map(drop)
}

/// Runs a command and returns its standard output; an error if it takes too long, or fails (with the last line of its standard
/// error).
fn output(command: &mut Command) -> anyhow::Result<String> {
    // a process group of its own, so that its children end with it
    command.process_group(0).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().context("it cannot be started")?;
    let reading = [child.stdout.take().map(boxed), child.stderr.take().map(boxed)].map(|pipe| {
        std::thread::spawn(move || {
            let mut bytes = Vec::new();
            // output that cannot be read counts as empty
            pipe.map(|mut pipe| pipe.read_to_end(&mut bytes));
            String::from_utf8_lossy(&bytes).into_owned()
        })
    });
    let status = wait(&mut child)?;
    let [printed, complaints] = reading.map(|thread| thread.join().unwrap_or_default());
    match status {
        None => bail!("ended after {} s", LONGEST.as_secs()),
        Some(status) if status.success() => Ok(printed),
        Some(status) => match complaints.lines().rfind(|line| !line.trim().is_empty()) {
            Some(line) => bail!("{status}: {}", line.trim()),
            None => bail!("{status}"),
        },
    }
}

fn boxed(pipe: impl std::io::Read + Send + 'static) -> Box<dyn std::io::Read + Send> {
    Box::new(pipe)
}

/// Waits for a process and returns its exit status; `None` if it was killed after [`LONGEST`].
fn wait(child: &mut Child) -> anyhow::Result<Option<ExitStatus>> {
    let start = Instant::now();
    while start.elapsed() < LONGEST {
        if let Some(status) = child.try_wait().context("it cannot be waited for")? {
            return Ok(Some(status));
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    if let Some(group) = rustix::process::Pid::from_raw(child.id() as i32) {
        rustix::process::kill_process_group(group, rustix::process::Signal::KILL).context("it cannot be ended")?;
    }
    child.wait().context("it cannot be waited for")?;
    Ok(None)
}

/// Builds the program that traces rays with Embree, and runs it.
fn embree(folder: &Path) -> anyhow::Result<EmbreeRate> {
    let words = ["-O3", "-march=native", "embree_rays.cpp", "-lembree3", "-lpthread", "-o", "embree_rays"];
    output(Command::new("g++").args(words).current_dir(folder)).context("it cannot be built")?;
    let printed = output(Command::new("./embree_rays").args(["scenes", "2", "1", "robust"]).current_dir(folder))?;
    let rate = |of: &str| {
        let line = printed.lines().find(|line| line.contains(of) && line.contains("specular chains"));
        let words: Vec<&str> = line?.split_whitespace().collect();
        let unit = words.iter().position(|word| *word == "Mrays/CPU-s")?;
        words[unit.checked_sub(1)?].parse::<f64>().ok()
    };
    let rates = rate("rtcIntersect1 ").zip(rate("rtcIntersect1M "));
    let (one_by_one, in_streams) = rates.context("it printed no rates of specular chains")?;
    Ok(EmbreeRate { one_by_one, in_streams })
}

/// Reads all runs that scripts have written; files that are not lists of runs are skipped, and a missing folder has none.
fn records(folder: &Path) -> Vec<Record> {
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.sort();
    let json = files.into_iter().filter(|file| file.extension().is_some_and(|extension| extension == "json"));
    let lists = json.filter_map(|file| serde_json::from_slice::<Vec<Record>>(&std::fs::read(file).ok()?).ok());
    lists.flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_runs_are_read_and_nothing_else() {
        let folder = TemporaryFolder::new("peers-test").unwrap();
        let results = folder.path().join("results");
        assert!(records(&results).is_empty());
        std::fs::create_dir(&results).unwrap();
        let run = r#"{"peer": "tracer 1", "scene": "S1", "method": "path", "cpu": 2.0, "rel_rms": 0.1, "knobs": "-x"}"#;
        std::fs::write(results.join("b.json"), format!("[{run}, {run}]")).unwrap();
        std::fs::write(results.join("a.json"), run).unwrap();
        std::fs::write(results.join("c.txt"), format!("[{run}]")).unwrap();
        let found = records(&results);
        assert_eq!(found.len(), 2);
        assert_eq!((found[0].cpu, found[0].passes), (2.0, 1));
    }

    #[test]
    fn what_fails_says_why() {
        let shell = |script: &str| output(Command::new("sh").args(["-c", script]));
        assert_eq!(shell("echo printed; echo complaint >&2").unwrap(), "printed\n");
        let error = shell("echo first >&2; echo last >&2; exit 3").unwrap_err().to_string();
        assert!(error.ends_with("3: last"), "{error}");
        assert!(output(&mut Command::new("skyduct-is-no-such-program")).is_err());
    }
}
