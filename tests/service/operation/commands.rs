//! `render` and `submit`: the same files, the same table, and what `submit` says while the service is away.

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use crate::common::small_job;
use serde_json::json;

/// Killed when dropped, so that a failed test leaves nothing behind.
struct Server {
    child: Child,
    url: String,
}

impl Server {
    fn start(data: &Path, listen: &str) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_skyduct"));
        command.args(["serve", "--listen", listen, "--data"]).arg(data);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let url = line.trim().strip_prefix("listening on ").expect("the address").to_owned();
        Self { child, url }
    }

    fn kill(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// All files below `folder`, by their names relative to `root`, sorted.
fn files(root: &Path, folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut found: Vec<_> = entries
        .flat_map(|path| if path.is_dir() { files(root, &path) } else { vec![path.strip_prefix(root).unwrap().into()] })
        .collect();
    found.sort();
    found
}

/// Runs a command that succeeds; answers its standard output.
fn run(command: &mut Command) -> String {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Its files, and on the terminal table, verdict and refusals; errors of the document name the field.
#[test]
fn a_study_writes_its_files() {
    let folder = tempfile::tempdir().unwrap();
    let (job, out) = (folder.path().join("job.json"), folder.path().join("out"));
    std::fs::write(&job, small_job().to_string()).unwrap();
    let study = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_skyduct"));
        command.arg("study").arg(&job).arg("--out").arg(&out).args(arguments);
        command
    };
    let few = ["--errors", "0.2", "--seeds", "1"];
    let said = run(study(&few).args(["--methods", "auto,path_tracing,jenkins"]));
    assert!(said.starts_with("processor seconds to reach  20 %") && said.contains("The cheapest method is"), "{said}");
    assert_eq!(
        files(&out, &out),
        ["study.csv", "study.json", "study.pdf", "study.png", "study.svg"].map(PathBuf::from)
    );
    let refused = study(&few).args(["--methods", "auto", "--reference", "nobody"]).output().unwrap();
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("/method"));
}

/// Each run is told before it begins, and a study that is interrupted keeps the table of those that are done.
#[test]
fn an_interrupted_study_keeps_its_table() {
    let folder = tempfile::tempdir().unwrap();
    let (job, out) = (folder.path().join("job.json"), folder.path().join("out"));
    std::fs::write(&job, small_job().to_string()).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_skyduct"));
    command.arg("study").arg(&job).arg("--out").arg(&out);
    // the first two runs end at once, the third and fourth would go on for a minute
    let few =
        ["--errors", "0.5,1e-9", "--seeds", "1", "--methods", "light_tracing,path_tracing", "--reference", "jenkins"];
    let mut child = command.args(few).stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
    let told: Vec<String> = lines.by_ref().take(4).collect();
    assert!(told[0].starts_with("0 of 5 runs: reference by jenkins, "), "{told:?}");
    assert_eq!(told[1], "1 of 5 runs: light_tracing to 50 %");
    assert!(
        told[3].starts_with("3 of 5 runs, about ") && told[3].ends_with(" left: light_tracing to 0.00000010 %"),
        "{told:?}"
    );
    let table = std::fs::read_to_string(out.join("study.csv")).unwrap();
    assert_eq!(table.lines().count(), 3, "{table}");
    assert!(Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap().success());
    let rest: Vec<String> = lines.collect();
    assert!(!child.wait().unwrap().success());
    assert_eq!(
        rest,
        [format!("error: cancelled after 3 of 5 runs; the results so far are in {}", out.join("study.csv").display())]
    );
    assert_eq!(std::fs::read_to_string(out.join("study.csv")).unwrap(), table);
}

/// But for times: those of passes, and the job's own.
#[test]
fn render_and_submit_write_the_same_files_and_print_the_same_table() {
    let folder = tempfile::tempdir().unwrap();
    let (rendered, submitted) = (folder.path().join("rendered"), folder.path().join("submitted"));
    let job = folder.path().join("job.json");
    let mut document = small_job();
    // a factor of daylight, too
    document["sky"]["cie_type"] = json!(16);
    std::fs::write(&job, document.to_string()).unwrap();
    let skyduct = || Command::new(env!("CARGO_BIN_EXE_skyduct"));
    let all = ["--figures", "svg,png,pdf"];
    let table = run(skyduct().arg("render").arg(&job).arg("--out").arg(&rendered).args(all));
    let server = Server::start(&folder.path().join("data"), "127.0.0.1:0");
    let submit = || {
        let mut command = skyduct();
        command.arg("submit").arg(&job).args(["--server", &server.url]);
        command
    };
    let by_submit = run(submit().arg("--out").arg(&submitted).args(all));
    assert_eq!(table, by_submit);
    for piece in ["grid", "workplane", "median", "daylight factor", "tube", " +- "] {
        assert!(table.contains(piece), "{table}");
    }
    let names = files(&rendered, &rendered);
    assert_eq!(names, files(&submitted, &submitted));
    let figures = ["convergence", "false_colours/room", "figures/lumens_0", "figures/section_x", "figures/section_y"];
    let figures = figures.into_iter().chain(["figures/overview", "figures/sky", "grids/workplane", "tubes/0"]);
    let figures: Vec<String> = figures.map(str::to_owned).collect();
    let in_formats = |suffixes: &[&str]| -> Vec<String> {
        figures.iter().flat_map(|name| suffixes.iter().map(move |suffix| format!("{name}.{suffix}"))).collect()
    };
    let others = [
        "convergence.csv",
        "convergence.json",
        "grids/workplane.csv",
        "grids/workplane.json",
        "result.json",
        "tubes/0.json",
        "views/room.exr",
        "views/room.png",
    ];
    let expected = |suffixes: &[&str]| {
        let mut names: Vec<PathBuf> =
            in_formats(suffixes).into_iter().chain(others.map(str::to_owned)).map(PathBuf::from).collect();
        names.extend(suffixes.contains(&"pdf").then(|| PathBuf::from("report.pdf")));
        names.sort();
        names
    };
    assert_eq!(names, expected(&["pdf", "png", "svg"]));
    // figures cost more than the numbers of a small job: outlines alone unless more is asked for
    for (arguments, suffixes) in
        [(&[][..], &["svg"][..]), (&["--figures", "none"], &[]), (&["--figures", "png"], &["png"])]
    {
        let (by_render, by_submit) = (folder.path().join("few_rendered"), folder.path().join("few_submitted"));
        run(skyduct().arg("render").arg(&job).arg("--out").arg(&by_render).args(arguments));
        run(submit().arg("--out").arg(&by_submit).args(arguments));
        for out in [&by_render, &by_submit] {
            assert_eq!(files(out, out), expected(suffixes), "{arguments:?}");
            std::fs::remove_dir_all(out).unwrap();
        }
    }
    let unknown = submit().arg("--out").arg(&submitted).args(["--figures", "gif"]).output().unwrap();
    assert_eq!(unknown.status.code(), Some(2));
    let read = |folder: &Path, name: &Path| std::fs::read(folder.join(name)).unwrap();
    for name in names.iter().filter(|name| name.parent() != Some(Path::new(""))) {
        assert!(read(&rendered, name) == read(&submitted, name), "{}", name.display());
    }
    let [ours, theirs] = [&rendered, &submitted].map(|folder| {
        let result = read(folder, Path::new("result.json"));
        serde_json::from_slice::<serde_json::Value>(&result).unwrap()
    });
    for field in
        ["document", "status", "stopped_by", "plan", "warnings", "accuracy", "grids", "views", "tubes", "energy"]
    {
        assert!(ours[field] == theirs[field], "{field}: {} {}", ours[field], theirs[field]);
    }
    let lines = |folder: &Path| String::from_utf8(read(folder, Path::new("convergence.csv"))).unwrap();
    let without_seconds = |text: String| {
        let cells = |line: &str| {
            line.split(',')
                .enumerate()
                // on the wall, and of the processors
                .filter(|(column, _)| ![1, 7].contains(column))
                .map(|(_, cell)| cell.to_owned())
                .collect::<Vec<_>>()
        };
        text.lines().map(cells).collect::<Vec<_>>()
    };
    assert_eq!(without_seconds(lines(&rendered)), without_seconds(lines(&submitted)));
}

/// Several documents are one set, each with a folder of results; a fault is named with its file, and nothing is queued.
#[test]
fn submit_sends_several_documents_together() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(&folder.path().join("data"), "127.0.0.1:0");
    let out = folder.path().join("out");
    let write = |name: &str, seed: u64, width: f64| {
        let mut document = small_job();
        (document["name"], document["seed"], document["room"]["size_m"][0]) = (json!(name), json!(seed), json!(width));
        let file = folder.path().join(format!("{name}.json"));
        std::fs::write(&file, document.to_string()).unwrap();
        file
    };
    let (first, second, faulty) = (write("first", 1, 2.0), write("second", 2, 2.0), write("faulty", 3, -1.0));
    let submit = |files: &[&PathBuf]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_skyduct"));
        command.arg("submit").args(files).args(["--server", &server.url, "--figures", "none", "--out"]).arg(&out);
        command
    };
    let refused = submit(&[&first, &faulty]).output().unwrap();
    let words = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(2), "{words}");
    assert!(words.contains("/room/size_m/0") && words.contains("faulty.json") && !words.contains("/jobs/"), "{words}");
    let twice = submit(&[&first, &first]).output().unwrap();
    assert_eq!(twice.status.code(), Some(1));
    assert!(!out.exists(), "nothing was computed");
    let table = run(&mut submit(&[&first, &second]));
    assert_eq!(table.matches("workplane").count(), 2, "{table}");
    let read = |name: &str| {
        let result = std::fs::read(out.join(name).join("result.json")).unwrap();
        serde_json::from_slice::<serde_json::Value>(&result).unwrap()
    };
    for (name, seed) in [("first", 1), ("second", 2)] {
        let document = &read(name)["document"];
        assert_eq!((&document["name"], &document["seed"]), (&json!(name), &json!(seed)));
        assert!(out.join(name).join("grids/workplane.json").exists());
    }
}

#[test]
fn submit_says_when_the_connection_is_lost_and_when_it_is_back() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    let job = folder.path().join("job.json");
    let mut document = small_job();
    document["method"] = json!({ "kind": "sppm", "photons_per_pass": 20_000 });
    document["stop"]["max_passes"] = json!(120);
    std::fs::write(&job, document.to_string()).unwrap();
    let mut server = Server::start(&data, "127.0.0.1:0");
    let mut command = Command::new(env!("CARGO_BIN_EXE_skyduct"));
    command.arg("submit").arg(&job).args(["--server", &server.url, "--out"]).arg(folder.path().join("out"));
    let mut submit = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let mut told = BufReader::new(submit.stderr.take().unwrap());
    let mut lines = String::new();
    let mut until = |text: &str| {
        while !lines.contains(text) {
            assert!(told.read_line(&mut lines).unwrap() > 0, "no {text:?} in {lines}");
        }
    };
    until("pass 8 ");
    server.kill();
    until("connection lost, reconnecting\n");
    let address = server.url.trim_start_matches("http://").to_owned();
    let _server = Server::start(&data, &address);
    until("reconnected at pass ");
    told.read_to_string(&mut lines).unwrap();
    assert!(submit.wait().unwrap().success(), "{lines}");
    assert_eq!(lines.matches("connection lost").count(), 1, "{lines}");
}

/// Whoever types the name alone gets the page's address; a script that forgot the command gets an error, not a service.
#[test]
fn without_a_command_the_service_starts_on_a_terminal_only() {
    let program = env!("CARGO_BIN_EXE_skyduct");
    let piped = Command::new(program).output().unwrap();
    assert_eq!(piped.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&piped.stderr).contains("terminal"));

    let data = tempfile::tempdir().unwrap();
    let mut command = Command::new("script");
    command.args(["-qec", program, "/dev/null"]).env("SKYDUCT_LISTEN", "127.0.0.1:0").env("SKYDUCT_DATA", data.path());
    let child = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().unwrap();
    // the terminal goes with it, and the service with the terminal
    let mut server = Server { child, url: String::new() };
    let lines = BufReader::new(server.child.stdout.take().unwrap()).lines().map_while(Result::ok);
    let page = lines.filter_map(|line| line.trim().strip_prefix("page at ").map(str::to_owned)).next();
    assert!(page.is_some_and(|page| page.starts_with("http://127.0.0.1:") && page.ends_with('/')));
}

#[test]
fn the_version_is_that_of_results() {
    let version = run(Command::new(env!("CARGO_BIN_EXE_skyduct")).arg("--version"));
    assert_eq!(version, format!("skyduct {}\n", skyduct::VERSION));
}
