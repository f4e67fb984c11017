//! Steps of a mission that are no places: another mode, a throttle that the pilot pulls and catches,
//! a flip.

use super::{Aim, PERIOD, Pilot};
use crate::simulation::ground_station::turning_over;
use stampfly_types::messages::{FlightMode, FlightPhase, FlipDirection, GuidedCommand};
use stampfly_types::{Duration, Vec3};

/// The mode switch counts in less than this; then the throttle goes to where a manual mode begins.
const SWITCHED: Duration = Duration::from_millis(140);
/// A mode that has not begun after this long does not begin.
const BEGINS: Duration = Duration::from_secs(2);
/// Distance of the throttle stick past the hover at which a manual mode begins.
const PAST: f32 = 0.03;
/// Time with centred sticks before the request to turn over: the vehicle turns over from rest.
const RESTS: Duration = Duration::from_millis(700);
/// Requests, when the vehicle does not turn over.
const TRIES: u32 = 4;
/// Longest time that a turn over takes.
const TURNS: Duration = Duration::from_secs(6);

impl Pilot<'_> {
    /// Turns the mode switch, and waits until the display shows the mode. A manual mode that is
    /// chosen in one that holds height begins when the throttle stick passes the hover.
    pub(super) async fn turn_to(&mut self, mode: FlightMode, place: Vec3) {
        let began = self.radio.clock().now();
        let passes = mode.is_manual() && !self.flown().is_manual();
        self.input.mode = mode;
        while self.flown() != mode && self.radio.telemetry().armed {
            let time = self.radio.clock().now().since(began);
            if time > BEGINS {
                return;
            }
            let past = (passes && time > SWITCHED).then_some(self.hover() + PAST);
            self.frame_with(Aim::Be(place), past).await;
        }
    }

    /// Pulls the throttle to its lowest, and catches a vehicle that falls from it: with full
    /// throttle, for as long as takes away what it has gained. Where no throttle is no thrust a
    /// weight is missing; full throttle is 1/hover of one.
    pub(super) async fn chop(&mut self, seconds: f32) {
        self.hold(-1.0, seconds).await;
        if self.flown().is_manual() {
            let hover = self.hover();
            self.hold(1.0, seconds * hover / (1.0 - hover).max(0.1)).await;
        }
    }

    /// Holds the throttle stick at a place, and the others centred.
    async fn hold(&mut self, throttle: f32, seconds: f32) {
        let until = self.radio.clock().now() + Duration::from_seconds(seconds);
        while self.radio.clock().now() + PERIOD <= until {
            self.frame_with(Aim::LetGo, Some(throttle)).await;
        }
    }

    /// The throttle stick at which it hovers in a manual mode.
    fn hover(&self) -> f32 {
        super::stick(self.meaning.hover + self.trim)
    }

    /// Lets a program ask the vehicle to turn over, in a mode that holds height. In the others only
    /// a pilot's own sticks do.
    pub(super) async fn turn_over(&mut self, direction: FlipDirection) {
        for _ in 0..TRIES {
            if self.flown().is_manual() || !self.radio.telemetry().armed {
                return;
            }
            self.keep(Aim::LetGo, RESTS).await;
            self.asked = true;
            self.radio.command(GuidedCommand { kind: turning_over(direction), ..GuidedCommand::default() });
            self.keep(Aim::LetGo, SWITCHED).await;
            let until = self.radio.clock().now() + TURNS;
            let mut turns = false;
            while self.radio.telemetry().phase == FlightPhase::Flip && self.radio.clock().now() < until {
                turns = true;
                self.frame(Aim::LetGo).await;
            }
            if turns {
                return;
            }
        }
    }
}
