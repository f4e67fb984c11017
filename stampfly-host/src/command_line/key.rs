//! `stampfly key`: the key of a vehicle, and what stations need of it.

use crate::command_line::arguments::KeyCommand;
use crate::command_line::failure::Failure;
use crate::serve::Key;
use std::process::ExitCode;

pub fn run(command: &KeyCommand) -> Result<ExitCode, Failure> {
    match command {
        KeyCommand::New { file } => {
            Key::create(file).map_err(|error| format!("{}: {error}", file.display()))?;
            outln!("{}: a new key; keep it where only you can read it", file.display());
        }
        KeyCommand::Mavlink { file } => outln!("{}", Key::read(file)?.phrase()),
    }
    Ok(ExitCode::SUCCESS)
}
