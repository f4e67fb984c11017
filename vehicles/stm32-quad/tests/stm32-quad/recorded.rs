//! A flight with what its truth, its motors and its alerts were, for tests that ask what happened
//! when.

use stampfly_bus::{Activation, Band};
use stampfly_flight::Observer;
use stampfly_flight::newest::message;
use stampfly_sim::Truth;
use stampfly_sim::vehicle::{Options, Vehicle, Witness};
use stampfly_stm32_quad::Runnables;
use stampfly_stm32_quad::simulation::plant::PLANT;
use stampfly_stm32_quad::simulation::{Outcome, Stm32Quad};
use stampfly_stm32_quad::topics::Id;
use stampfly_types::messages::{Alerts, MotorOutput, SystemAlert};
use stampfly_types::{Duration, Instant, Vec3, frame};

/// A vehicle that leans farther does not stand, rad.
const LIES: f32 = 0.6;
/// With more sink than this, m/s, no touch is a landing.
const HARD: f32 = 2.5;
/// The frame's upper corners bend by so much under its weight, m.
const BENDS: f32 = 0.002;

/// What was seen of a flight.
#[derive(Default)]
pub struct Flown {
    pub truth: Vec<(Instant, Truth)>,
    /// When each output was given, and whether a motor was told to turn.
    pub turns: Vec<(Instant, bool)>,
    /// Changes of the alerts.
    pub alerts: Vec<(Instant, Alerts)>,
    pub outcome: Outcome,
}

impl Observer for Flown {
    fn pass_begins(&mut self, _: Band, _: Instant) {}
    fn has_read(&mut self, _: &Activation) {}
}

impl Witness<Runnables> for Flown {
    fn published(&mut self, topic: usize, at: Instant, _: u32, words: &[u32]) {
        match Id::ALL.get(topic) {
            Some(Id::actuator_motor) => {
                let output: MotorOutput = message(words).unwrap_or_default();
                let turns = output.duty.iter().any(|duty| *duty > 0.0);
                if self.turns.last().is_none_or(|(_, before)| *before != turns) {
                    self.turns.push((at, turns));
                }
            }
            Some(Id::system_alert) => {
                let SystemAlert { active, .. } = message(words).unwrap_or_default();
                if self.alerts.last().is_none_or(|(_, before)| *before != active) {
                    self.alerts.push((at, active));
                }
            }
            _ => {}
        }
    }

    fn beside(&mut self, _: usize, at: Instant, _: u32, words: &[u32]) {
        self.truth.push((at, message(words).unwrap_or_default()));
    }
}

impl Flown {
    /// Flies.
    pub fn with(options: &Options, seed: u64) -> Self {
        let setup = Stm32Quad::setup(options, seed).expect("options");
        let mut flown = Self::default();
        flown.outcome = Stm32Quad::fly(&setup, &mut flown, &mut |_, _| {}).outcome;
        flown
    }

    /// Every alert since the motors turned for the first time, but for those of battery and link.
    pub fn alerted(&self) -> Alerts {
        let begun = self.turns.iter().find(|(_, turns)| *turns).map_or(Instant::MAX, |(at, _)| *at);
        let told = Alerts::COMM_LOST | Alerts::LOW_BATTERY | Alerts::CRITICAL_BATTERY | Alerts::USB_POWER;
        let after = self.alerts.iter().filter(|(at, _)| *at >= begun);
        after.fold(Alerts::NONE, |all, (_, active)| all | *active).without(told)
    }

    /// When the truth says that it has crashed: on a part that does not carry it, at a lean on
    /// which it does not stand, or faster than its legs bear.
    pub fn crash(&self) -> Option<Instant> {
        let mut before: Option<&Truth> = None;
        let armed = self.turns.iter().find(|(_, turns)| *turns)?.0;
        self.truth
            .iter()
            .filter(|(at, _)| *at >= armed)
            .find(|(_, truth)| {
                let touched = before.is_some_and(|before| before.contact);
                let sink = before.map_or(0.0, |before| before.velocity.z);
                before = Some(truth);
                let lies = truth.contact && frame::tilt(&truth.attitude) > LIES;
                scrapes(truth) || lies || truth.contact && !touched && sink > HARD
            })
            .map(|(at, _)| *at)
    }

    /// For how long the motors were told to turn after this, the last time that they were.
    pub fn turned_after(&self, crash: Instant) -> Duration {
        let end = self.truth.last().map_or(crash, |(at, _)| *at);
        let last = self.turns.iter().enumerate().rfind(|(_, (_, turns))| *turns);
        let stopped = last.map_or(crash, |(place, _)| self.turns.get(place + 1).map_or(end, |(at, _)| *at));
        stopped.since(crash)
    }
}

/// Is an upper corner or a propeller on the floor?
fn scrapes(truth: &Truth) -> bool {
    let [corner, height] = [PLANT.corner_offset as f32, PLANT.corner_height as f32];
    let [hub, radius] = [PLANT.rotor_offset as f32, PLANT.propeller_radius as f32];
    let axis = (truth.attitude * Vec3::z()).z;
    let below = radius * stampfly_types::math::sqrt((1.0 - axis * axis).max(0.0));
    [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].into_iter().any(|(x, y)| {
        let down = |offset: f32| (truth.position + truth.attitude * Vec3::new(x * offset, y * offset, -height)).z;
        down(corner) > BENDS || down(hub) + below > BENDS
    })
}
