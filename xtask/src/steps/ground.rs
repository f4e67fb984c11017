//! `ground`: a real browser opens the ground station's page and flies with it.
//!
//! Debian's Chromium, without a window, is led by Playwright's Python package (`xtask/ground/page.py`). It arms, takes off, clicks
//! on the ground, lands, changes a parameter, injects a fault, kills, downloads the log and moves through it. Nothing may be
//! written to the browser's console, and no request may leave this machine. `-- --pictures FOLDER` keeps what it saw.

use crate::arguments::Arguments;
use crate::machine::{BROWSER, provide};
use crate::repository::{Failure, Repository, python_tool, run as run_program};

pub const PLAYWRIGHT: &str = "playwright==1.65.2";
const SCRIPT: &str = "xtask/ground/page.py";
/// Any free port for the page; nobody else is to be found here.
const PORTS: [&str; 8] = [
    "http=0",
    "mavlink-udp=off",
    "mavlink-tcp=off",
    "tello=off",
    "tello-state=off",
    "telemetry=off",
    "stream=off",
    "console=off",
];

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    provide(repository, &[&BROWSER])?;
    run_program(repository.cargo().args(["build", "--quiet", "--release", "--bin", "stampfly"]))?;
    let mut script = python_tool(repository, PLAYWRIGHT, "python3")?;
    script.arg("-B").arg(repository.root.join(SCRIPT)).args(&arguments.rest);
    script.arg(repository.target("release/stampfly")).args(["serve", "--count", "2"]);
    for port in PORTS {
        script.args(["--port", port]);
    }
    run_program(script.arg("--out").arg(repository.target("ground")))
}
