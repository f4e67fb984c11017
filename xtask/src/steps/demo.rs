//! `demo`: the page that has the whole simulation inside is made, and flown in a real browser without a server.
//!
//! The flight stack, its simulator and the page become one file, `target/demo/demo.html`, that anybody can open. In Debian's Chromium the
//! reference mission has to have the hash that it has on this machine, at twenty times real time or more, and another seed another hash;
//! then a vehicle is armed, flown, broken, looked back at, and flown again with another parameter (`xtask/ground/demo.py`).
//! `-- --pictures FOLDER` keeps what the browser saw.

use super::ground::PLAYWRIGHT;
use super::program::built;
use crate::arguments::Arguments;
use crate::machine::{BROWSER, provide};
use crate::repository::{Failure, Repository, add_targets, capture, json, python_tool, run as run_program};

const TARGET: &str = "wasm32-unknown-unknown";
const PACKAGE: &str = "stampfly-board/browser";
const MODULE: &str = "stampfly_browser.wasm";
const SCRIPT: &str = "xtask/ground/demo.py";

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    provide(repository, &[&BROWSER])?;
    add_targets(repository, &[TARGET])?;
    let place = repository.target("browser");
    let mut build = repository.cargo();
    build.current_dir(repository.root.join(PACKAGE)).args(["build", "--quiet", "--locked", "--release"]);
    run_program(build.args(["--target", TARGET, "--target-dir"]).arg(&place))?;
    let program = built(repository)?;
    let page = repository.target("demo/demo.html");
    std::fs::create_dir_all(repository.target("demo")).map_err(|error| error.to_string())?;
    let module = place.join(TARGET).join("release").join(MODULE);
    run_program(repository.command(&program.to_string_lossy()).arg("demo").arg(module).arg("--out").arg(&page))?;
    let mut fly = repository.command(&program.to_string_lossy());
    let (said, _) = capture(fly.args(["fly", "--seed", "1", "--json", "--out"]).arg(repository.target("demo")))?;
    let said = json(&said)?;
    let hash = said["log_hash"].as_str().ok_or("a flight says no hash")?;
    let mut script = python_tool(repository, PLAYWRIGHT, "python3")?;
    script.arg("-B").arg(repository.root.join(SCRIPT)).args(&arguments.rest);
    run_program(script.arg(&page).arg(hash))
}
