//! A vehicle on a bench of this computer, and somebody who does as he is asked and says what he sees.
//!
//! The examination is that of a real vehicle: the same lines over the vehicle's own console. He sees what the emulated
//! light, buzzer and motors really do, and knows of no defect.

use super::chart::Chart;
use super::console::{self, Port};
use super::visit::{Act, Lost, Question, Stick, Visit};
use super::walk;
use stampfly_board::simulation::bench::{Bench, Defect, Spin, with_vehicle};
use stampfly_types::Duration as Span;
use stampfly_types::messages::PilotInput;
use std::f64::consts::FRAC_PI_2;
use std::io;
use std::time::Duration;

/// How long an answer takes to come over USB.
const LATENCY: Span = Span::from_millis(4);
/// How long a hand takes from one pose to the next, and how long the vehicle is held still before anybody says so.
const MOVES: Span = Span::from_millis(800);
const STEADY: Span = Span::from_millis(300);
/// Height of the hand above the floor, m, and how far it slides.
const LOW: f64 = 0.3;
const SLIDE: f64 = 0.4;
/// Whoever turns it lifts it by this, m: its feet would hold it back.
const CLEAR: f64 = 0.03;
/// A light that has not been lit for this long is dark: longer than any of its pauses.
const DARK: Span = Span::from_secs(2);

/// Examines an emulated vehicle with this defect, if any. The same seed is the same vehicle.
#[must_use]
pub fn examine(defect: Option<&Defect>, seed: u64) -> Chart {
    with_vehicle(defect, seed, |bench| {
        let mut visit = Emulated { bench, yaw: 0.0, place: [0.0; 3], transcript: String::new() };
        let mut chart = walk::examine(&mut visit);
        chart.transcript = visit.transcript;
        chart
    })
}

struct Emulated<'v, 'b> {
    bench: &'v mut Bench<'b>,
    /// Where its nose points, rad.
    yaw: f64,
    /// Where the hand has it, world NED, m.
    place: [f64; 3],
    transcript: String,
}

impl Emulated<'_, '_> {
    fn carry(&mut self, height: f64, roll: f64, pitch: f64, time: Span) {
        self.place[2] = -height;
        self.bench.carry(self.place, [roll, pitch, self.yaw], time);
    }

    /// Takes it to a pose and holds it there.
    fn hold(&mut self, height: f64, roll: f64, pitch: f64) {
        self.carry(height, roll, pitch, MOVES);
        self.bench.pass(MOVES + STEADY);
    }
}

/// A wire to the bench.
struct Wire<'w, 'b>(&'w mut Bench<'b>);

impl Port for Wire<'_, '_> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.send(bytes);
        Ok(())
    }

    fn receive(&mut self) -> io::Result<String> {
        self.0.pass(LATENCY);
        Ok(self.0.read())
    }
}

impl Visit for Emulated<'_, '_> {
    fn ask(&mut self, line: &str) -> Result<String, Lost> {
        let answer = console::ask(&mut Wire(self.bench), line)?;
        self.transcript += &format!("> {line}\n{}", answer.replace('\r', ""));
        Ok(answer)
    }

    fn elapsed(&self) -> Duration {
        Duration::from_micros(self.bench.now().as_micros())
    }

    fn wait(&mut self, time: Duration) {
        self.bench.pass(Span::from_micros(u64::try_from(time.as_micros()).unwrap_or(u64::MAX)));
    }

    fn please(&mut self, act: Act) {
        self.transcript += &format!("{act}\n");
        let standing = self.bench.standing();
        let moving = act.moving().map_or(MOVES, |time| Span::from_micros(time.as_micros() as u64 / 2));
        match act {
            Act::PowerOn => self.bench.pass(Span::from_secs(1)),
            Act::RightSideDown => self.hold(LOW, FRAC_PI_2, 0.0),
            Act::NoseUp => self.hold(LOW, 0.0, FRAC_PI_2),
            Act::NoseDown => self.hold(LOW, 0.0, -FRAC_PI_2),
            Act::LiftHalf => self.hold(0.5, 0.0, 0.0),
            Act::LiftHigh => self.hold(1.5, 0.0, 0.0),
            Act::HoldOver => self.hold(LOW, 0.0, 0.0),
            Act::PutDown => {
                (self.yaw, self.place) = (0.0, [0.0; 3]);
                self.hold(standing, 0.0, 0.0);
                self.bench.let_go();
                self.bench.pass(STEADY);
            }
            Act::QuarterTurn => {
                self.yaw += FRAC_PI_2;
                self.carry(standing + CLEAR, 0.0, 0.0, moving);
            }
            Act::SlideForward => {
                self.place[0] += SLIDE;
                self.carry(LOW, 0.0, 0.0, moving);
            }
            Act::SlideRight => {
                self.place[1] += SLIDE;
                self.carry(LOW, 0.0, 0.0, moving);
            }
            Act::HoldButton => self.bench.press(true),
            Act::ReleaseButton => self.bench.press(false),
            Act::SwitchOn | Act::Centre => self.bench.transmitter(Some(PilotInput::default())),
            Act::Push(stick) => {
                let mut sticks = PilotInput::default();
                let pushed = match stick {
                    Stick::Roll => &mut sticks.roll,
                    Stick::Pitch => &mut sticks.pitch,
                    Stick::Yaw => &mut sticks.yaw,
                    Stick::Throttle => &mut sticks.throttle,
                };
                *pushed = 0.9;
                self.bench.transmitter(Some(sticks));
            }
        }
        if matches!(act, Act::HoldButton | Act::ReleaseButton | Act::SwitchOn | Act::Centre | Act::Push(_)) {
            self.bench.pass(STEADY);
        }
    }

    fn question(&mut self, question: Question) -> usize {
        let answer = match question {
            Question::Light => {
                let now = self.bench.now();
                usize::from(self.bench.lit().is_some_and(|at| now.since(at) < DARK))
            }
            Question::Notes => usize::from(!self.bench.heard().is_empty()),
            Question::Motor => self.bench.turning().iter().position(Option::is_some).map_or(0, |motor| motor + 1),
            Question::Direction(motor) => {
                let spin = motor.checked_sub(1).and_then(|motor| *self.bench.turning().get(motor)?);
                usize::from(spin == Some(Spin::CounterClockwise))
            }
        };
        self.transcript += &format!("{question}\n< {}\n", question.choices()[answer]);
        answer
    }
}
