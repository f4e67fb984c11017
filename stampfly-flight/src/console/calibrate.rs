//! Calibrations at a console: how they are asked for, and what whoever holds the vehicle reads meanwhile.
//!
//! A vehicle that publishes [`CalibrationRequest`](stampfly_types::messages::CalibrationRequest) and
//! [`CalibrationReport`] has [`COMMAND`] in its own list, reads it with [`parse`], and answers with [`answer`].
//! [`News`] tells a terminal what has changed, so that nobody has to ask with both hands full.

use super::error::CommandError;
use core::fmt;
use stampfly_types::messages::{CalibrationHint, CalibrationKind, CalibrationReport, CalibrationStage};

/// What can be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Calibrate {
    /// Begin one; [`CalibrationKind::None`] ends the one that is under way.
    Begin(CalibrationKind),
    /// Say how far it is.
    Status,
    /// Take what was found as parameters, and keep them.
    Accept,
}

/// The commands for `help`.
pub const COMMAND: (&str, &str) =
    ("calibrate KIND", "level, six, mag or temperature; then status, accept (take it and save it) or cancel");

const USAGE: &str = "calibrate level | six | mag | temperature | status | accept | cancel";

/// Reads what stands behind `calibrate`.
///
/// ```
/// use stampfly_flight::console::calibrate::{Calibrate, parse};
/// use stampfly_types::messages::CalibrationKind;
/// assert_eq!(parse(&["six"]), Ok(Calibrate::Begin(CalibrationKind::SixPositions)));
/// assert!(parse(&["seven"]).unwrap_err().to_string().starts_with("usage: calibrate level"));
/// ```
///
/// # Errors
/// When it is written differently.
pub fn parse(words: &[&str]) -> Result<Calibrate, CommandError> {
    match words {
        ["level"] => Ok(Calibrate::Begin(CalibrationKind::Level)),
        ["six"] => Ok(Calibrate::Begin(CalibrationKind::SixPositions)),
        ["mag"] => Ok(Calibrate::Begin(CalibrationKind::Magnetometer)),
        ["temperature"] => Ok(Calibrate::Begin(CalibrationKind::Temperature)),
        ["cancel"] => Ok(Calibrate::Begin(CalibrationKind::None)),
        ["status"] => Ok(Calibrate::Status),
        ["accept"] => Ok(Calibrate::Accept),
        _ => Err(CommandError::Usage(USAGE)),
    }
}

/// What somebody has to do who has asked for this.
#[must_use]
pub const fn instructions(kind: CalibrationKind) -> &'static str {
    match kind {
        CalibrationKind::None => "cancelled",
        CalibrationKind::Level => "stand it on a table that a spirit level calls level, and leave it alone",
        CalibrationKind::SixPositions => {
            "lay it on each of its six sides, in any order, two seconds each, and on one of them again"
        }
        CalibrationKind::Magnetometer => {
            "away from iron, turn it slowly through every attitude: nose all around, and every side down"
        }
        CalibrationKind::Temperature => "let it lie still, cold at first, while it warms up by eight degrees",
    }
}

/// Answers what was asked: with what was found so far, and, for [`Calibrate::Accept`], with what takes it as parameters and says whether
/// it did. Is there something left to do for the board: to publish the request, or to save?
///
/// # Errors
/// When `reply` does not take it.
pub fn answer(
    asked: Calibrate,
    is_disarmed: bool,
    found: &CalibrationReport,
    accept: impl FnOnce(&CalibrationReport) -> bool,
    reply: &mut dyn fmt::Write,
) -> Result<bool, fmt::Error> {
    match asked {
        Calibrate::Begin(kind) if is_disarmed => write!(reply, "{}\r\n", instructions(kind)).map(|()| true),
        // The console says why not.
        Calibrate::Begin(_) => Ok(true),
        Calibrate::Status => report(reply, found).map(|()| false),
        Calibrate::Accept if is_disarmed && accept(found) => {
            reply.write_str("taken; it corrects from the next start on\r\n").map(|()| true)
        }
        Calibrate::Accept => reply.write_str("nothing found, or armed\r\n").map(|()| false),
    }
}

/// The faces in the order of the report's bits, as they are called when they are down.
const FACES: [&str; 6] = ["nose", "tail", "right side", "left side", "feet", "back"];

/// Says how far it is: what was done, what to do, what came of it. Lines end with a carriage return and a line feed.
///
/// # Errors
/// When `reply` does not take it.
pub fn report(reply: &mut dyn fmt::Write, report: &CalibrationReport) -> fmt::Result {
    let CalibrationReport { kind, stage, .. } = *report;
    let name = match kind {
        CalibrationKind::None => return reply.write_str("nothing was calibrated since power-on\r\n"),
        CalibrationKind::Level => "level",
        CalibrationKind::SixPositions => "six positions",
        CalibrationKind::Magnetometer => "magnetometer",
        CalibrationKind::Temperature => "temperature",
    };
    write!(reply, "{name}: ")?;
    match stage {
        CalibrationStage::Idle => reply.write_str("not begun\r\n"),
        CalibrationStage::Cancelled => reply.write_str("cancelled, nothing has changed\r\n"),
        CalibrationStage::Armed => reply.write_str("ended, because it was armed; nothing has changed\r\n"),
        CalibrationStage::TimedOut => reply.write_str("ended, because nothing came of it for ten minutes\r\n"),
        CalibrationStage::Implausible => {
            reply.write_str("FAILED: no sensor is so wrong. Was it still? Then begin again\r\n")
        }
        CalibrationStage::Running => {
            write!(reply, "{:.0} %", 100.0 * report.progress)?;
            if kind == CalibrationKind::SixPositions {
                to_do(reply, report)?;
            }
            write!(reply, "; {}\r\n", hint(report))
        }
        CalibrationStage::Done => done(reply, report),
    }
}

fn to_do(reply: &mut dyn fmt::Write, report: &CalibrationReport) -> fmt::Result {
    let mut missing = FACES.iter().enumerate().filter(|(bit, _)| report.faces & (1 << bit) == 0).map(|(_, face)| face);
    match missing.next() {
        Some(first) => write!(reply, ", still to lie on its {first}")?,
        None => reply.write_str(", once more on any side, as a check")?,
    }
    missing.try_for_each(|face| write!(reply, ", {face}"))
}

/// What to do now.
const fn hint(report: &CalibrationReport) -> &'static str {
    match report.hint {
        CalibrationHint::None => "go on",
        CalibrationHint::Moving => "it moves: leave it alone",
        CalibrationHint::Measuring => "measuring: leave it alone",
        CalibrationHint::Turn => "taken: turn it to another side",
        CalibrationHint::NoFace => "it leans too much: lay it on a side",
        CalibrationHint::Contradiction => "this side was different before: lay it down again",
        CalibrationHint::Tilted => "it is tilted by more than 5 degrees: stand it level",
        CalibrationHint::Directions => "turn it on, every side and the nose all around",
        CalibrationHint::Disturbed => "the field is bent: go away from iron, and begin again",
        CalibrationHint::Warming => "leave it alone, it warms up",
        CalibrationHint::NoTemperature => "the sensor gives no temperature",
        CalibrationHint::Strength => "this is not the earth's field: go away from iron and magnets, and begin again",
    }
}

fn done(reply: &mut dyn fmt::Write, report: &CalibrationReport) -> fmt::Result {
    let CalibrationReport { before, residual, .. } = *report;
    let [a, b, c, d, e, f, g, ..] = report.values;
    match report.kind {
        CalibrationKind::None => {}
        CalibrationKind::Level => {
            let [roll, pitch, off, noise] = [d, e, before, residual].map(f32::to_degrees);
            write!(reply, "roll {roll:.2} deg, pitch {pitch:.2} deg; it was off by {off:.2}, known to {noise:.3} deg")?;
        }
        CalibrationKind::SixPositions => {
            write!(reply, "bias {a:.3} {b:.3} {c:.3} m/s^2, scale {d:.4} {e:.4} {f:.4}; ")?;
            write!(
                reply,
                "it was off by {before:.3}, and is by {residual:.4} m/s^2. The level is void: calibrate it next"
            )?;
        }
        CalibrationKind::Magnetometer => {
            write!(reply, "iron {a:.1} {b:.1} {c:.1} uT, stretch {d:.3} {e:.3} {f:.3}; ")?;
            write!(reply, "it was off by {:.1} %, and is by {:.1} % of the field", 100.0 * before, 100.0 * residual)?;
        }
        CalibrationKind::Temperature => {
            let [x, y, z] = [a, b, c].map(f32::to_degrees);
            write!(
                reply,
                "gyro {x:.4} {y:.4} {z:.4} deg/s/K, accelerometer {d:.4} {e:.4} {f:.4} m/s^2/K at {g:.0} C; "
            )?;
            let [off, left] = [before, residual].map(f32::to_degrees);
            write!(reply, "it drifted by {off:.3}, and does by {left:.3} deg/s. Six positions and level are next")?;
        }
    }
    reply.write_str(". `calibrate accept` takes and saves it\r\n")
}

/// Between two lines of progress.
const STEP: f32 = 0.2;

/// What a terminal has not been told yet.
///
/// ```
/// use stampfly_flight::console::calibrate::News;
/// use stampfly_types::messages::{CalibrationKind, CalibrationReport, CalibrationStage};
/// let mut news = News::default();
/// let mut report = CalibrationReport::default();
/// assert!(!news.is_new(&report));
/// (report.kind, report.stage) = (CalibrationKind::Level, CalibrationStage::Running);
/// assert!(news.is_new(&report) && !news.is_new(&report));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct News(CalibrationReport);

impl News {
    /// Nothing was told yet.
    pub const NOTHING: Self = Self(CalibrationReport {
        kind: CalibrationKind::None,
        stage: CalibrationStage::Idle,
        hint: CalibrationHint::None,
        progress: 0.0,
        faces: 0,
        before: 0.0,
        residual: 0.0,
        values: [0.0; 9],
    });

    /// Is this report to be told? It is told once.
    pub fn is_new(&mut self, report: &CalibrationReport) -> bool {
        let told = &self.0;
        let is_new = (told.kind, told.stage, told.hint, told.faces)
            != (report.kind, report.stage, report.hint, report.faces)
            || report.progress < told.progress
            || report.progress - told.progress >= STEP;
        if is_new {
            self.0 = *report;
        }
        is_new
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::String;

    #[test]
    fn every_stage_and_every_hint_says_what_to_do_in_a_line() {
        for kind in CalibrationKind::ALL.iter().skip(1) {
            for (stage, hint) in CalibrationStage::ALL
                .iter()
                .flat_map(|stage| CalibrationHint::ALL.iter().map(move |hint| (stage, hint)))
            {
                let of = CalibrationReport { kind: *kind, stage: *stage, hint: *hint, ..Default::default() };
                let mut text = String::new();
                report(&mut text, &of).unwrap();
                assert!(text.ends_with("\r\n") && text.matches('\n').count() == 1 && text.len() < 300, "{text}");
            }
            assert!(instructions(*kind).len() > 20);
        }
    }

    #[test]
    fn the_sides_that_are_missing_are_named() {
        let mut of = CalibrationReport {
            kind: CalibrationKind::SixPositions,
            stage: CalibrationStage::Running,
            ..Default::default()
        };
        let mut text = |faces| {
            let mut text = String::new();
            of.faces = faces;
            report(&mut text, &of).unwrap();
            text
        };
        assert!(text(0b10_1110).contains("still to lie on its nose, feet;"));
        assert!(text(0b11_1111).contains("once more on any side"));
    }
}
