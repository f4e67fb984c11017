//! The command line of one program: keys in, an answer out, for the vehicle in the air and for the one on the bench.

use crate::console::{Command, Console, Newest, Profile};
use crate::simulation::sensing::{Healths, Sensing};
use crate::topics::ConsoleEnds;
use crate::{VehicleConfig, console};
use core::fmt::{Display, Write as _};
use stampfly_flight::console::{LineEditor, Request, SensorLine, answer};
use stampfly_flight::doctor::Fact;
use stampfly_types::Instant;
use std::string::String;
use std::vec::Vec;

const PROMPT: &str = "> ";

/// What every command line of a vehicle shares.
pub struct Desk<'d> {
    /// Version of the program.
    pub version: &'d str,
    pub newest: &'d Newest,
    pub sensing: Sensing,
    pub health: &'d Healths,
    pub profile: &'d Profile,
    pub facts: &'d [Fact<'d>],
}

/// One command line.
#[derive(Clone, Debug)]
pub struct Terminal {
    editor: LineEditor<80>,
    /// Written to the program and not yet read.
    pub screen: String,
}

impl Terminal {
    pub fn new() -> Self {
        Self { editor: LineEditor::new(), screen: String::new() }
    }

    /// Asks for the first line.
    pub fn greet(&mut self, version: &str) {
        _ = write!(self.screen, "{version}, type help\r\n{PROMPT}");
    }

    /// Takes keys as they are sent, and carries out what is asked. What only a board can do is `board`'s, which says what comes of it.
    pub fn send(
        &mut self,
        now: Instant,
        keys: &[u8],
        desk: &Desk<'_>,
        (config, ends): (&mut VehicleConfig, &mut ConsoleEnds<'_>),
        board: impl Fn(&Request<Command>, &VehicleConfig) -> &'static str,
    ) {
        for key in keys {
            let Some(line) = self.editor.feed(*key, &mut self.screen).map(String::from) else { continue };
            match self.obey(now, &line, desk, config) {
                Request::Nothing => {}
                Request::Vehicle(command) => {
                    command.publish(now, ends);
                    if let Command::TestMotor { motor, .. } = command {
                        _ = write!(self.screen, "motor {motor} turns for {} s\r\n", console::TEST_TIME.seconds());
                    }
                    if command == Command::ShowKey {
                        self.screen.push_str("a vehicle shows it at its USB port alone\r\n");
                    }
                }
                request => _ = write!(self.screen, "{}\r\n", board(&request, config)),
            }
            self.screen.push_str(PROMPT);
        }
    }

    fn obey(&mut self, now: Instant, line: &str, desk: &Desk<'_>, config: &mut VehicleConfig) -> Request<Command> {
        let errors: Vec<_> = desk.health.iter().map(|health| health.last_error()).collect();
        let each = desk.sensing.names().zip(desk.health).zip(&errors);
        let sensors: Vec<_> = each
            .map(|((name, health), error)| SensorLine {
                name,
                samples: health.samples(),
                errors: health.errors(),
                last_error: error.as_ref().map(|error| error as &dyn Display),
            })
            .collect();
        let Desk { version, newest, profile, facts, .. } = *desk;
        let mut vehicle = Console { version, newest, sensors: &sensors, profile, facts, config };
        answer(line, now, &mut vehicle, &mut self.screen).unwrap_or(Request::Nothing)
    }
}
