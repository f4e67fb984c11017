//! The command line: a person with a cable asks, the vehicle answers.
//!
//! | part | what it does |
//! |---|---|
//! | [`LineEditor`] | bytes as they are typed → a line |
//! | [`Command::parse`] | a line → what is asked |
//! | [`answer`] | what is asked → a reply, and what the board is to do |
//! | [`Newest`] | the newest sample of every topic, for `sensor` and `topic` |
//! | [`MotorTest`] | one motor for two seconds, on a disarmed vehicle |
//!
//! Nothing here touches hardware: [`answer`] is a function of the line and of what the board knows, and says in a
//! [`Request`] what only the board can do. Not for programs: they have the radio link and the log.

mod answer;
mod command;
mod line_editor;
mod motor_test;
mod newest;

pub use answer::{Context, Request, SensorLine, answer};
pub use command::{Command, CommandError};
pub use line_editor::LineEditor;
pub use motor_test::{MotorTest, MotorTestRefused};
pub use newest::Newest;
