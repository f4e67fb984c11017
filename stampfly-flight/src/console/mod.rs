//! The console: a person at a serial port asks, the vehicle answers.
//!
//! | part | what it does |
//! |---|---|
//! | [`LineEditor`] | bytes as they are typed → a line |
//! | [`Command::parse`] | a line → a command |
//! | [`answer`] | a line → a reply, and a [`Request`] for what only the board can do |
//! | [`Piece`] | a long reply, part by part |
//! | [`Vehicle`] | what a vehicle knows, and its own commands |
//!
//! Nothing here touches hardware: an answer is a function of the line and of what the vehicle knows. Not for programs:
//! they have the radio link and the log.

mod answer;
pub mod calibrate;
mod command;
mod error;
mod line_editor;
mod lines;
mod piece;
mod vehicle;

pub use answer::{Request, answer};
pub use command::{COMMANDS, Command};
pub use error::{CommandError, MAX_WORDS};
pub use line_editor::LineEditor;
pub use lines::{list, refused};
pub use piece::Piece;
pub use vehicle::{SensorLine, Vehicle};
