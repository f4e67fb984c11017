//! `MAV_CMD_PREFLIGHT_CALIBRATION`: the calibrations of the command line, asked for by a ground station.
//!
//! | asked for | what happens |
//! |---|---|
//! | parameter 5 is 1, accelerometer | six positions |
//! | parameter 5 is 2, board level | level |
//! | parameter 2 is 1, magnetometer | magnetometer |
//! | parameter 1 or 5 is 3, temperature of gyro or accelerometer | temperature, of both at once |
//! | everything is 0 | what is under way is cancelled |
//! | parameter 1 is 1, gyro | unsupported: its zero is measured after every power-on and estimated from then on, so there is nothing to keep |
//! | parameter 5 is 4, accelerometer in one position | unsupported: one position does not tell bias and level apart |
//! | anything else | unsupported; more than one sensor, denied |
//!
//! A calibration takes from seconds to minutes. So it is acknowledged as `IN_PROGRESS`, with how far it is, at least once a second, and in the end as `ACCEPTED`,
//! `CANCELLED` or `FAILED`. Stations have no word for "take it", so what was found is taken and kept at once, for who has asked for it; the command line asks first.
//!
//! The texts that begin with `[cal]` are those of PX4. MAVSDK waits for them from every autopilot, and learns from nothing else that it is done. QGroundControl reads them
//! for PX4 alone: for a generic autopilot it has no page for sensors, so there they are texts for people, and the command comes from its console or another station.

use super::client::{Client, Put};
use super::commands;
use crate::access::{Request, VehicleAccess};
use crate::refusal::Refusal;
use core::fmt::Write;
use heapless::String;
use stampfly_flight::console::calibrate::{self, News};
use stampfly_link::mavlink::dialects::common::{MavCmd, MavResult, MavSeverity};
use stampfly_types::messages::{CalibrationKind, CalibrationReport, CalibrationStage};
use stampfly_types::{Duration, Instant};

/// Between two acknowledgements that it is in progress: a station waits for three seconds and more.
const AGAIN: Duration = Duration::from_millis(500);
/// A vehicle that has not begun by then does not.
const BEGINS: Duration = Duration::from_secs(2);
/// A sentence of a report, with what stands before it.
const SENTENCE: usize = 310;
/// What is not known of a progress.
const UNKNOWN: u8 = u8::MAX;

/// What a command asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wanted {
    Calibration(CalibrationKind),
    /// There is no such calibration, with a sentence for people.
    Unsupported(&'static str),
    /// More than one sensor.
    Several,
}

/// Which calibration parameters 1 to 7 mean.
fn wanted(parameters: &[f32; 7]) -> Wanted {
    let [gyro, mag, pressure, radio, accel, motors, airspeed] = *parameters;
    let temperature = |value: f32| value == 3.0 || value == 0.0;
    let others = [mag, pressure, radio, motors, airspeed];
    if parameters.iter().all(|value| *value == 0.0) {
        return Wanted::Calibration(CalibrationKind::None);
    }
    // The one case in which more than one may be set.
    if temperature(gyro) && temperature(accel) && others.iter().all(|value| *value == 0.0) {
        return Wanted::Calibration(CalibrationKind::Temperature);
    }
    if parameters.iter().filter(|value| **value != 0.0).count() > 1 {
        return Wanted::Several;
    }
    if accel == 1.0 {
        Wanted::Calibration(CalibrationKind::SixPositions)
    } else if accel == 2.0 {
        Wanted::Calibration(CalibrationKind::Level)
    } else if mag == 1.0 {
        Wanted::Calibration(CalibrationKind::Magnetometer)
    } else if gyro == 1.0 {
        Wanted::Unsupported("the gyro is measured after every power-on: restart, and leave it alone")
    } else if accel == 4.0 {
        Wanted::Unsupported("one position is not enough: calibrate six positions, or the level")
    } else {
        Wanted::Unsupported("this vehicle has no such calibration")
    }
}

/// As PX4 calls it, and so every station.
const fn name(kind: CalibrationKind) -> &'static str {
    match kind {
        CalibrationKind::None => "none",
        CalibrationKind::Level => "level",
        CalibrationKind::SixPositions => "accel",
        CalibrationKind::Magnetometer => "mag",
        CalibrationKind::Temperature => "temperature",
    }
}

/// A calibration that a client has asked for.
#[derive(Clone, Copy, Debug)]
struct Asked<C> {
    client: C,
    /// System and component.
    asker: [u8; 2],
    kind: CalibrationKind,
    at: Instant,
    /// When it was last acknowledged.
    told: Instant,
    /// In per cent.
    progress: u8,
    has_begun: bool,
}

/// Who has asked for a calibration, and how much of it is told.
#[derive(Clone, Debug)]
pub(super) struct Calibrating<C> {
    asked: Option<Asked<C>>,
    news: News,
}

fn acknowledge<C>(client: &mut Client<C>, asker: [u8; 2], result: MavResult, progress: u8, put: Put<'_, C>) {
    let number = MavCmd::MAV_CMD_PREFLIGHT_CALIBRATION as u16;
    commands::acknowledge(client, number, asker, (result, progress), put);
}

/// Says something to people, and to programs that read what PX4 says.
// By itself: its room for a sentence is on the stack once, and nobody's who says nothing.
#[inline(never)]
fn say<C>(client: &mut Client<C>, what: core::fmt::Arguments<'_>, put: Put<'_, C>) {
    let mut sentence = String::<SENTENCE>::new();
    // What is too long is cut.
    _ = write!(sentence, "[cal] {what}");
    client.say(MavSeverity::MAV_SEVERITY_INFO, sentence.trim_end(), put);
}

#[inline(never)]
fn say_report<C>(client: &mut Client<C>, report: &CalibrationReport, put: Put<'_, C>) {
    let mut sentence = String::<SENTENCE>::new();
    _ = sentence.push_str("[cal] ");
    _ = calibrate::report(&mut sentence, report);
    client.say(MavSeverity::MAV_SEVERITY_INFO, sentence.trim_end(), put);
}

impl<C: Copy + PartialEq> Calibrating<C> {
    /// Nobody has.
    pub const fn new() -> Self {
        Self { asked: None, news: News::NOTHING }
    }

    /// Does what is asked. `None`: it was acknowledged already, and will be again.
    pub fn ask(
        &mut self,
        now: Instant,
        client: &mut Client<C>,
        asker: [u8; 2],
        parameters: &[f32; 7],
        access: &mut dyn VehicleAccess,
        put: Put<'_, C>,
    ) -> Result<(), MavResult> {
        let kind = match wanted(parameters) {
            Wanted::Calibration(kind) => kind,
            Wanted::Several => return Err(MavResult::MAV_RESULT_DENIED),
            Wanted::Unsupported(why) => {
                say(client, format_args!("calibration failed: {why}"), put);
                return Err(MavResult::MAV_RESULT_UNSUPPORTED);
            }
        };
        if kind == CalibrationKind::None {
            return match access.request(now, Request::Calibrate(kind)) {
                // Whoever has asked for it hears it from the vehicle.
                Ok(()) => Err(MavResult::MAV_RESULT_ACCEPTED),
                Err(refusal) => Err(refused(refusal)),
            };
        }
        match &mut self.asked {
            // It was asked again, because the acknowledgement was lost.
            Some(asked) if asked.client == client.id && asked.kind == kind => {
                (asked.told, asked.asker) = (now, asker);
                acknowledge(client, asker, MavResult::MAV_RESULT_IN_PROGRESS, asked.progress, put);
                return Ok(());
            }
            Some(asked) if asked.client != client.id => return Err(MavResult::MAV_RESULT_TEMPORARILY_REJECTED),
            _ => {}
        }
        if let Err(refusal) = access.request(now, Request::Calibrate(kind)) {
            say(client, format_args!("calibration failed: {refusal}"), put);
            return Err(refused(refusal));
        }
        let (id, progress) = (client.id, UNKNOWN);
        self.asked = Some(Asked { client: id, asker, kind, at: now, told: now, progress, has_begun: false });
        self.news = News::NOTHING;
        acknowledge(client, asker, MavResult::MAV_RESULT_IN_PROGRESS, UNKNOWN, put);
        say(client, format_args!("calibration started: 2 {}", name(kind)), put);
        say(client, format_args!("{}", calibrate::instructions(kind)), put);
        Ok(())
    }

    /// Tells who has asked how far it is, and takes what was found.
    pub fn poll(&mut self, now: Instant, clients: &mut [Client<C>], access: &mut dyn VehicleAccess, put: Put<'_, C>) {
        let Self { asked: waiting, news } = self;
        let Some(asked) = waiting else { return };
        // Nobody is left to be told; the vehicle goes on, and nothing is taken.
        let Some(client) = clients.iter_mut().find(|client| client.id == asked.client) else {
            *waiting = None;
            return;
        };
        let report = access.view().calibration_report().filter(|(at, _)| *at >= asked.at).map(|(_, report)| report);
        let Some(report) = report else {
            if !asked.has_begun && now.since(asked.at) >= BEGINS {
                say(client, format_args!("calibration failed: it does not begin"), put);
                acknowledge(client, asked.asker, MavResult::MAV_RESULT_FAILED, 0, put);
                *waiting = None;
            }
            return;
        };
        asked.has_begun = true;
        let result = match report.stage {
            // Somebody else has begun another one.
            _ if report.kind != asked.kind => MavResult::MAV_RESULT_CANCELLED,
            CalibrationStage::Idle | CalibrationStage::Running => {
                let progress = (100.0 * report.progress + 0.5) as u8;
                let is_new = news.is_new(&report);
                if is_new {
                    say_report(client, &report, put);
                    say(client, format_args!("progress <{progress}>"), put);
                }
                if is_new || now.since(asked.told) >= AGAIN {
                    (asked.progress, asked.told) = (progress, now);
                    acknowledge(client, asked.asker, MavResult::MAV_RESULT_IN_PROGRESS, progress, put);
                }
                return;
            }
            CalibrationStage::Done => match access.request(now, Request::AcceptCalibration(report)) {
                Ok(()) => MavResult::MAV_RESULT_ACCEPTED,
                Err(_) => MavResult::MAV_RESULT_FAILED,
            },
            CalibrationStage::Cancelled => MavResult::MAV_RESULT_CANCELLED,
            CalibrationStage::Armed | CalibrationStage::TimedOut | CalibrationStage::Implausible => {
                MavResult::MAV_RESULT_FAILED
            }
        };
        match result {
            MavResult::MAV_RESULT_ACCEPTED => {
                say(client, format_args!("taken and kept; it corrects from the next start on"), put);
                say(client, format_args!("calibration done: {}", name(asked.kind)), put);
            }
            MavResult::MAV_RESULT_CANCELLED => say(client, format_args!("calibration cancelled"), put),
            _ => {
                say_report(client, &report, put);
                say(client, format_args!("calibration failed: {}", name(asked.kind)), put);
            }
        }
        acknowledge(client, asked.asker, result, 100, put);
        *waiting = None;
    }
}

const fn refused(refusal: Refusal) -> MavResult {
    match refusal {
        Refusal::Unsupported => MavResult::MAV_RESULT_UNSUPPORTED,
        Refusal::Full => MavResult::MAV_RESULT_TEMPORARILY_REJECTED,
        _ => MavResult::MAV_RESULT_DENIED,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_means_one_calibration_or_says_why_not() {
        let of = |set: &[(usize, f32)]| {
            let mut parameters = [0.0; 7];
            set.iter().for_each(|(number, value)| parameters[number - 1] = *value);
            wanted(&parameters)
        };
        use CalibrationKind::{Level, Magnetometer, None, SixPositions, Temperature};
        assert_eq!(of(&[]), Wanted::Calibration(None));
        assert_eq!(of(&[(5, 1.0)]), Wanted::Calibration(SixPositions));
        assert_eq!(of(&[(5, 2.0)]), Wanted::Calibration(Level));
        assert_eq!(of(&[(2, 1.0)]), Wanted::Calibration(Magnetometer));
        for temperature in [&[(1, 3.0)][..], &[(5, 3.0)], &[(1, 3.0), (5, 3.0)]] {
            assert_eq!(of(temperature), Wanted::Calibration(Temperature));
        }
        for several in [&[(1, 1.0), (2, 1.0)][..], &[(2, 1.0), (5, 2.0)], &[(1, 3.0), (5, 2.0)], &[(1, 3.0), (2, 1.0)]]
        {
            assert_eq!(of(several), Wanted::Several);
        }
        for (number, value) in
            [(1, 1.0), (1, 2.0), (2, 2.0), (3, 1.0), (4, 1.0), (5, 4.0), (5, 5.0), (6, 1.0), (7, 1.0), (2, f32::NAN)]
        {
            assert!(matches!(of(&[(number, value)]), Wanted::Unsupported(_)), "{number} {value}");
        }
    }
}
