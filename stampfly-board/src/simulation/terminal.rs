//! The command line of one program: keys in, an answer out, for the vehicle in the air and for the one on the bench.

use crate::console::{Command, Console, Newest, Profile};
use crate::simulation::live::Handling;
use crate::simulation::sensing::{Healths, Sensing};
use crate::topics::{ConsoleEnds, Id};
use crate::{VehicleConfig, console};
use core::fmt::{Display, Write as _};
use stampfly_flight::console::calibrate::{self, News};
use stampfly_flight::console::{LineEditor, Request, SensorLine, answer};
use stampfly_flight::doctor::Fact;
use stampfly_types::Instant;
use stampfly_types::messages::CalibrationReport;
use std::rc::Rc;
use std::string::String;
use std::vec::Vec;

const PROMPT: &str = "> ";
/// Ends a line without carrying it out.
const CTRL_C: u8 = 3;

/// What every command line of a vehicle shares.
pub struct StationRequests<'d> {
    /// Version of the program.
    pub version: &'d str,
    pub newest: &'d Newest,
    pub sensing: Sensing,
    pub health: &'d Healths,
    pub profile: &'d Profile,
    pub facts: &'d [Fact<'d>],
    /// Whoever stands beside the vehicle, where lines can ask for something.
    pub beside: Option<Rc<Handling>>,
}

impl StationRequests<'_> {
    /// The vehicle, as a console sees it, with this configuration of the next start.
    pub fn console<R>(&self, config: &mut VehicleConfig, ask: impl FnOnce(&mut Console<'_>) -> R) -> R {
        let errors: Vec<_> = self.health.iter().map(|health| health.last_error()).collect();
        let each = self.sensing.names().zip(self.health).zip(&errors);
        let sensors: Vec<_> = each
            .map(|((name, health), error)| SensorLine {
                name,
                samples: health.samples(),
                errors: health.errors(),
                last_error: error.as_ref().map(|error| error as &dyn Display),
            })
            .collect();
        let StationRequests { version, newest, profile, facts, .. } = *self;
        ask(&mut Console { version, newest, sensors: &sensors, profile, facts, config })
    }
}

/// One command line.
#[derive(Clone, Debug)]
pub struct Terminal {
    editor: LineEditor<80>,
    /// What of a calibration it was told; nothing before the first look.
    news: Option<News>,
    /// Written to the program and not yet read.
    pub screen: String,
}

impl Terminal {
    pub fn new() -> Self {
        Self { editor: LineEditor::new(), news: None, screen: String::new() }
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
        requests: &StationRequests<'_>,
        (config, ends): (&mut VehicleConfig, &mut ConsoleEnds<'_>),
        board: impl Fn(&Request<Command>, &VehicleConfig) -> &'static str,
    ) {
        for key in keys {
            let Some(line) = self.editor.feed(*key, &mut self.screen).map(String::from) else { continue };
            if let (Some(asked), Some(beside)) = (line.trim().strip_prefix("world"), &requests.beside) {
                _ = write!(self.screen, "{}\r\n{PROMPT}", beside.obey(now, asked));
                continue;
            }
            match self.obey(now, &line, requests, config) {
                Request::Nothing => {}
                Request::Vehicle(command) => {
                    command.publish(now, ends);
                    let said = said(command);
                    if !said.is_empty() {
                        _ = write!(self.screen, "{said}\r\n");
                    }
                }
                request => _ = write!(self.screen, "{}\r\n", board(&request, config)),
            }
            self.screen.push_str(PROMPT);
        }
    }

    /// What was typed has waited for more than a second, and is forgotten with the line that it is
    /// part of.
    pub fn expire(&mut self) {
        _ = self.editor.feed(CTRL_C, &mut self.screen);
        _ = write!(self.screen, "expired: it came more than a second late, and was not done\r\n{PROMPT}");
    }

    /// Tells how far a calibration is, when there is something new to tell.
    pub fn tell(&mut self, newest: &Newest) {
        let Some((_, report)) = newest.get::<CalibrationReport>(Id::calibration_report as usize) else {
            self.news.get_or_insert_default();
            return;
        };
        let is_first = self.news.is_none();
        if self.news.get_or_insert_default().is_new(&report) && !is_first {
            self.screen.push_str("\r\n");
            _ = calibrate::report(&mut self.screen, &report);
            self.screen.push_str(PROMPT);
        }
    }

    fn obey(
        &mut self,
        now: Instant,
        line: &str,
        requests: &StationRequests<'_>,
        config: &mut VehicleConfig,
    ) -> Request<Command> {
        requests.console(config, |vehicle| answer(line, now, vehicle, &mut self.screen).unwrap_or(Request::Nothing))
    }
}

/// What is said to a command that was carried out.
pub fn said(command: Command) -> String {
    match command {
        Command::TestMotor { motor, .. } => {
            std::format!("motor {motor} turns for {} s", console::TEST_TIME.seconds())
        }
        Command::ShowKey => "a vehicle shows it at its USB port alone".into(),
        _ => String::new(),
    }
}
