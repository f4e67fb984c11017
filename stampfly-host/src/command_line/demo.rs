//! `stampfly demo`: the page that has a vehicle and its world inside.

use crate::command_line::arguments::DemoOptions;
use crate::command_line::failure::Failure;
use crate::ground::demo;
use std::process::ExitCode;

pub fn run(options: &DemoOptions) -> Result<ExitCode, Failure> {
    let DemoOptions { module, out } = options;
    let bytes = std::fs::read(module).map_err(|error| format!("{}: {error}", module.display()))?;
    if !bytes.starts_with(b"\0asm") {
        return Err(format!("{} is no WebAssembly", module.display()).into());
    }
    std::fs::write(out, demo::html(&bytes)).map_err(|error| format!("{}: {error}", out.display()))?;
    outln!("{}   (open it in a browser)", out.display());
    Ok(ExitCode::SUCCESS)
}
