//! The service in a process of its own, which can be killed.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use reqwest::StatusCode;
use serde_json::Value;

use crate::common::client;

/// Killed when it is dropped.
pub struct Server {
    pub child: Child,
    pub url: String,
    /// One client for all requests: to make one takes longer than a small job.
    pub http: reqwest::Client,
}

impl Server {
    /// On a free port, with these environment variables beside the test's own.
    pub fn start(data: &Path, environment: &[(&str, &str)]) -> Self {
        Self::start_after("", data, environment)
    }

    /// Starts the program by a shell, after `before`, commands of that shell.
    pub fn start_after(before: &str, data: &Path, environment: &[(&str, &str)]) -> Self {
        let mut child = Command::new("sh")
            .arg("-c")
            .arg(format!("{before}\nexec \"$0\" serve --listen 127.0.0.1:0 --data \"$1\""))
            .arg(env!("CARGO_BIN_EXE_skyduct"))
            .arg(data)
            .envs(environment.iter().copied())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let url = line.trim().strip_prefix("listening on ").expect("the address").to_owned();
        Self { child, url, http: client() }
    }

    /// SIGKILL.
    pub fn kill(mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// SIGTERM, and a wait for the end; whether that was a success.
    pub fn terminate(mut self) -> bool {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args(["-TERM", &id]).status().unwrap().success());
        self.child.wait().unwrap().success()
    }

    /// Whether it has ended by itself.
    pub fn is_gone(&mut self) -> bool {
        self.child.try_wait().unwrap().is_some()
    }

    /// Resident memory in bytes.
    pub fn resident(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).unwrap();
        let line = status.lines().find(|line| line.starts_with("VmRSS:")).unwrap();
        1024 * line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap()
    }

    /// The body of an answer 200.
    pub async fn get(&self, path: &str) -> Vec<u8> {
        let response = self.http.get(format!("{}{path}", self.url)).send().await.unwrap();
        assert_eq!(response.status(), StatusCode::OK, "{path}");
        response.bytes().await.unwrap().into()
    }

    pub async fn json(&self, path: &str) -> Value {
        serde_json::from_slice(&self.get(path).await).unwrap()
    }

    /// Posts a job; answers its path.
    pub async fn submit(&self, job: &Value) -> String {
        let response = self.http.post(format!("{}/v1/jobs", self.url)).json(job).send().await.unwrap();
        let status = response.status();
        let location = response.headers().get("location").map(|path| path.to_str().unwrap().to_owned());
        assert_eq!(status, StatusCode::ACCEPTED, "{}", response.text().await.unwrap());
        location.unwrap()
    }

    /// A job, or that the process cannot be reached.
    pub async fn job(&self, path: &str) -> reqwest::Result<Value> {
        self.http.get(format!("{}{path}", self.url)).send().await?.json().await
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
