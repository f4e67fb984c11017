//! The command line of the program `stampfly`: one file for each of its commands.
//!
//! It is part of the library, so that the code of every vehicle's flight is compiled once, and not
//! again for the program.

/// `println!` that does not panic when the reader has gone.
macro_rules! outln {
    ($($text:tt)*) => { crate::command_line::terminal::print(&format!("{}\n", format_args!($($text)*))) };
}

/// `eprintln!` of text in which there may be something foreign.
macro_rules! errln {
    ($($text:tt)*) => { crate::command_line::terminal::print_error(&format!("{}\n", format_args!($($text)*))) };
}

mod arguments;
mod campaign;
mod connect;
mod demo;
mod doctor;
mod doors;
mod ended;
mod engine;
mod failure;
mod fault_campaign;
mod faults;
mod fly;
mod golden;
mod hil;
mod key;
mod log;
mod modes;
mod replay;
mod schedule;
mod serve;
mod stick_campaign;
pub mod terminal;
mod topics;

pub use arguments::SceneOptions;
pub use failure::Failure;

use arguments::{Arguments, Command};
use clap::Parser;
use std::process::ExitCode;

/// Parses the arguments of this process and runs the command they name. Wrong arguments end the
/// process with code 2.
pub fn run() -> ExitCode {
    let arguments = Arguments::parse();
    let result = match arguments.command.unwrap_or_default() {
        Command::Demo(options) => demo::run(&options),
        Command::Log(command) => log::run(&command),
        Command::Fly(options) => fly::run(&options),
        Command::Serve(options) => serve::run(&options),
        Command::Connect(options) => connect::run(&options),
        Command::Replay(options) => replay::run(&options),
        Command::Topics(options) => topics::run(&options),
        Command::Schedule(options) => schedule::run(&options),
        Command::Faults(options) => faults::run(&options),
        Command::Doctor(options) => doctor::run(&options),
        Command::Modes(_) => modes::run(),
        Command::Campaign(options) => campaign::run(&options),
        Command::Hil(options) => hil::run(&options),
        Command::Doors(options) => doors::run(&options),
        Command::Key(command) => key::run(&command),
        Command::Golden(options) => golden::run(&options),
    };
    result.unwrap_or_else(|failure| failure::tell(&failure))
}
