//! `ground`: a real browser opens the ground station's page and flies with it.
//!
//! Debian's Chromium, without a window, is led by Playwright's Python package (`xtask/ground/page.py`). It arms, takes off, clicks
//! on the ground, lands, changes a parameter, injects a fault, kills, downloads the log and moves through it. Nothing may be
//! written to the browser's console, and no request may leave this machine. `-- --pictures FOLDER` keeps what it saw. Then the same of `stampfly connect`, whose
//! vehicle is at the other end of a pseudo-terminal (`xtask/ground/connect.py`), and is unplugged. Then the page loses its server, and its vehicle, for a while
//! (`xtask/ground/link.py`). At last a page of another site tries to fly both vehicles, through
//! every port (`xtask/ground/foreign.py`).

use super::program::built;
use crate::arguments::Arguments;
use crate::machine::{BROWSER, provide};
use crate::repository::{Failure, Repository, python_tool, run as run_program};

pub const PLAYWRIGHT: &str = "playwright==1.65.2";
const SCRIPT: &str = "xtask/ground/page.py";
const FOREIGN: &str = "xtask/ground/foreign.py";
const CONNECTED: &str = "xtask/ground/connect.py";
const LINK: &str = "xtask/ground/link.py";
/// Any free port for the page; nobody else is to be found here.
const PORTS: [&str; 2] = ["http=0", "others=off"];

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    provide(repository, &[&BROWSER])?;
    let program = built(repository)?;
    let mut script = python_tool(repository, PLAYWRIGHT, "python3")?;
    script.arg("-B").arg(repository.root.join(SCRIPT)).args(&arguments.rest);
    script.arg(&program).args(["serve", "--count", "2"]);
    for port in PORTS {
        script.args(["--port", port]);
    }
    run_program(script.arg("--out").arg(repository.target("ground")))?;
    for path in [CONNECTED, LINK, FOREIGN] {
        let mut script = python_tool(repository, PLAYWRIGHT, "python3")?;
        script.arg("-B").arg(repository.root.join(path)).arg(&program);
        run_program(script.arg(repository.target("ground")))?;
    }
    Ok(())
}
