//! The program, as a process that ends with its test.

use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// An empty folder of the test's own.
pub fn folder(of: &str, name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(of).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("the target folder can be written");
    folder
}

/// Runs the program to its end in a folder. Returns what it prints.
pub fn stampfly(folder: &Path, arguments: &[&str]) -> String {
    stampfly_ends(folder, arguments, 0)
}

/// The same, with this exit code.
fn stampfly_ends(folder: &Path, arguments: &[&str], code: i32) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_stampfly")).current_dir(folder).args(arguments).output();
    let output = output.expect("it runs");
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {output:?}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// A campaign of faults, whose flights are judged, and the last one is flown again from its row.
/// Exactly `failed` of them end worse than their faults allow: the known ones.
pub fn campaign_of_faults(folder: &Path, vehicle: &str, (flights, failed): (u64, u64)) {
    let (count, last) = (flights.to_string(), (flights - 1).to_string());
    let campaign = ["campaign", "--vehicle", vehicle, "--faults", "--flights", &count, "--json"];
    let said = stampfly_ends(folder, &campaign, i32::from(failed > 0));
    let said: serde_json::Value = serde_json::from_str(&said).expect("JSON");
    let number = |name: &str| said[name].as_u64().expect("a number");
    assert_eq!([number("flights"), number("failed")], [flights, failed], "{said}");
    assert!(10 * (number("passed") + failed) >= 9 * flights, "in the others the fault changed nothing: {said}");
    let file = folder.join("campaign/shard-0-of-1.parquet");
    let again = stampfly(folder, &["fly", "--from", &file.display().to_string(), "--row", &last, "--json"]);
    let again: serde_json::Value = serde_json::from_str(&again).expect("JSON");
    assert_eq!(again["same"], true, "{again}");
    let line = again["line"].as_str().expect("a line");
    assert!(line.contains(&format!("--vehicle {vehicle}")), "{line}");
}

/// Sends a signal to a program.
#[cfg(unix)]
pub fn signal(program: &Child, name: &str) {
    let sent = Command::new("kill").args([name, &program.id().to_string()]).status();
    assert!(sent.expect("kill").success());
}

/// Ctrl-C, so that a test need not wait until the program's time is over. Without such signals, as on
/// Windows, it waits.
pub fn interrupt(program: &Child) {
    #[cfg(unix)]
    signal(program, "-INT");
    #[cfg(not(unix))]
    let _ = program;
}

/// It runs.
pub struct Program(pub Child);

impl Program {
    pub fn start(folder: &Path, arguments: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_stampfly"));
        let command = command.current_dir(folder).args(arguments).stdin(Stdio::null()).stdout(Stdio::piped());
        Self(command.spawn().expect("the program starts"))
    }

    /// `serve` with one port, and where that is.
    pub fn serve(folder: &Path, port: &str, more: &[&str]) -> (Self, String) {
        let mut program = Self::start(folder, &[&["serve", "--port", "others=off", "--port", port], more].concat());
        let (name, _) = port.split_once('=').expect("a port");
        let place = program.said(name, "listening on ");
        (program, place)
    }

    /// Where this port is.
    pub fn place(&mut self, port: &str) -> String {
        self.said(port, "listening on ")
    }

    /// What it says behind this word, to the next white space.
    pub fn said(&mut self, line: &str, word: &str) -> String {
        // A byte at a time: what is read ahead is lost for whoever asks next.
        let lines = BufReader::with_capacity(1, self.0.stdout.as_mut().expect("a pipe")).lines().map_while(Result::ok);
        for said in lines {
            if let Some((_, rest)) = said.split_once(word).filter(|_| said.starts_with(line)) {
                return rest.split_whitespace().next().unwrap_or_default().to_owned();
            }
        }
        panic!("it says nothing of {line}");
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        _ = self.0.kill();
        _ = self.0.wait();
    }
}
