//! What the vehicle did by itself that changed the flight: it stopped the motors, began to land, or
//! took another mode, and no person and no program had asked for it.
//!
//! | action | what is seen |
//! |---|---|
//! | `cut` | it was disarmed: with an alert that stops the motors, by the cut-off, for `NO_LIFT`; or in the air, with the arm switch on and nothing that asked for it |
//! | `land` | it began to land, with the arm switch on and nothing that asked for it |
//! | `mode` | POS_HOLD became ALT_HOLD, with the mode switch at rest |
//!
//! A vehicle that is not [sound](super::soundness) may need it. A landing or another mode of one
//! whose sensors have no floor in their reach is needed, too.

use super::sight::Sight;
use super::soundness::{Soundness, State};
use super::{OFF_GROUND, names};
use crate::VehicleConfig;
use crate::topics::Id;
use serde::Serialize;
use stampfly_flight::newest::message;
use stampfly_mode::decision::{CUT, LAND};
use stampfly_mode::transitions::{is_airborne, is_armed};
use stampfly_sim::fault::Injector;
use stampfly_types::messages::{
    Alerts, FlightMode, FlightPhase, FlightStatus, GuidedCommand, GuidedKind, PilotInput, SystemAlert,
};
use stampfly_types::{Duration, Instant};
use std::string::String;
use std::vec::Vec;

/// What was asked for, or switched, was so for this long before: the debouncing of a switch, and
/// two frames.
const ASKED: Duration = Duration::from_millis(200);
/// Alerts with which the vehicle lands, or flies in another mode, when none demands it at once.
const UNKNOWN: Alerts = Alerts::RANGE_IMPLAUSIBLE
    .with(Alerts::FLOW_IMPLAUSIBLE)
    .with(Alerts::TOF_LOST)
    .with(Alerts::FLOW_LOST)
    .with(Alerts::BARO_LOST)
    .with(Alerts::COMM_LOST)
    .with(Alerts::ESTIMATE_DIVERGED);
/// Of those, what is no news where no floor is in reach.
const SEES_NOTHING: Alerts = Alerts::TOF_LOST.with(Alerts::FLOW_LOST);
/// Alerts of a battery that does not carry the vehicle.
const SPENT: Alerts = Alerts::CRITICAL_BATTERY.with(Alerts::NO_LIFT);
/// The name of no alert.
const NONE: &str = "NONE";

/// Something that the vehicle did by itself.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Intervention {
    /// When, s since power-on.
    pub t_s: f64,
    /// The alerts that made it do so, with `+` between two; `CUT_OFF`; `NONE` when there was none.
    pub alert: String,
    /// `cut`, `land` or `mode`.
    pub action: &'static str,
    /// Was the vehicle sound, so that it had no need to?
    pub sound: bool,
    /// Height above the floor, m.
    pub height_m: f64,
    /// Speed, m/s.
    pub speed_mps: f64,
    /// Tilt, degrees.
    pub tilt_deg: f64,
    /// Between the true vertical and the estimated one, degrees.
    pub attitude_error_deg: f64,
    /// It was an alert that stops motors in any phase, or the cut-off.
    #[serde(skip)]
    pub by_protection: bool,
    /// It landed because its battery did not carry it any more.
    #[serde(skip)]
    pub spent: bool,
}

impl Intervention {
    /// What the vehicle did: a verb, and what it did it to.
    #[must_use]
    pub fn verb(&self) -> &'static str {
        match self.action {
            "cut" => "stops the motors",
            "land" => "begins to land",
            _ => "takes another mode",
        }
    }
}

pub(super) struct Interventions {
    injector: Injector,
    soundness: Soundness,
    alerts: Alerts,
    cut_off: bool,
    status: FlightStatus,
    pilot: PilotInput,
    /// When the pilot's mode switch was last turned.
    turned: Option<Instant>,
    /// When a program last asked for something.
    asked: Option<Instant>,
    /// A pilot is heard.
    heard: bool,
    list: Vec<Intervention>,
    /// So many of them came before the truth was last looked at.
    looked_at: usize,
}

impl Interventions {
    pub fn new(injector: &Injector, config: &VehicleConfig) -> Self {
        Self {
            injector: injector.clone(),
            soundness: Soundness::new(config),
            alerts: Alerts::NONE,
            cut_off: false,
            status: FlightStatus::default(),
            pilot: PilotInput::default(),
            turned: None,
            asked: None,
            heard: false,
            list: Vec::new(),
            looked_at: 0,
        }
    }

    /// All of them, in order.
    pub fn list(&self) -> &[Intervention] {
        &self.list
    }

    /// The first one that stopped the motors in the air for a protection's sake.
    pub fn cut_in_air(&self) -> Option<&Intervention> {
        self.list.iter().find(|one| one.action == "cut" && one.by_protection && one.height_m > OFF_GROUND.into())
    }

    /// Since when a mode that holds the height has flown a vehicle that nothing has touched, when the
    /// truth was last looked at.
    pub fn held_since(&self) -> Option<Instant> {
        self.soundness.state().held_since
    }

    /// Looks at the truth.
    pub fn see(&mut self, sight: &Sight<'_>) {
        let faulty = (0..self.injector.faults().count()).any(|place| self.injector.is_active(place, sight.now));
        self.soundness.see(sight, faulty);
        // A touch is answered sooner than the truth is looked at.
        let touches = self.soundness.touches();
        self.list.iter_mut().skip(self.looked_at).for_each(|one| one.sound &= !touches);
        self.looked_at = self.list.len();
    }

    /// A sample was published.
    pub fn published(&mut self, id: Id, at: Instant, words: &[u32]) {
        match id {
            Id::estimate_state => message(words).into_iter().for_each(|estimate| self.soundness.estimated(estimate)),
            Id::control_output => message(words).iter().for_each(|output| self.soundness.demanded(output)),
            Id::actuator_motor => message(words).iter().for_each(|output| self.soundness.driven(output)),
            Id::system_alert => self.alerts = message(words).map_or(self.alerts, |alert: SystemAlert| alert.active),
            Id::cutoff_state => {
                let state: Option<crate::messages::CutoffState> = message(words);
                self.cut_off = state.is_some_and(|state| state.tripped);
            }
            Id::command_pilot => {
                if let Some(input) = message::<PilotInput>(words) {
                    if input.mode != self.pilot.mode {
                        self.turned = Some(at);
                    }
                    (self.pilot, self.heard) = (input, true);
                }
            }
            Id::command_guided => {
                let command: Option<GuidedCommand> = message(words);
                if command.is_some_and(|command| command.kind != GuidedKind::None) {
                    self.asked = Some(at);
                }
            }
            Id::flight_status => {
                if let Some(status) = message::<FlightStatus>(words) {
                    let before = core::mem::replace(&mut self.status, status);
                    self.changed(at, &before);
                }
            }
            _ => {}
        }
    }

    /// The vehicle's state is another, maybe.
    fn changed(&mut self, at: Instant, before: &FlightStatus) {
        let FlightStatus { phase, mode, .. } = self.status;
        let State { height, sees_floor, .. } = self.soundness.state();
        let recent = |since: Option<Instant>| since.is_some_and(|since| at.since(since) < ASKED);
        let (left, asked) = (before.phase, recent(self.asked));
        let switched_off = self.heard && (!self.pilot.arm || self.pilot.kill);
        let blind = !sees_floor && common(self.alerts, UNKNOWN).without(SEES_NOTHING).is_empty();
        if is_armed(left) && !is_armed(phase) {
            let lifts = left == FlightPhase::TakeOff && self.alerts.contains(Alerts::NO_LIFT);
            let in_air = is_airborne(left) && height > OFF_GROUND && self.heard;
            if self.alerts.intersects(CUT) {
                self.note(at, "cut", listed(common(self.alerts, CUT)), true);
            } else if self.cut_off {
                self.note(at, "cut", "CUT_OFF".into(), true);
            } else if lifts && !switched_off && !asked {
                self.note(at, "cut", listed(Alerts::NO_LIFT), true);
            } else if in_air && !switched_off && !asked {
                self.note(at, "cut", NONE.into(), true);
            }
        } else if phase == FlightPhase::Landing && left != phase && !switched_off && !asked {
            if self.alerts.intersects(LAND) {
                self.note(at, "land", listed(common(self.alerts, LAND)), true);
            } else {
                self.note(at, "land", listed(common(self.alerts, UNKNOWN)), !blind);
            }
        } else if phase == FlightPhase::Flying && left == phase {
            let weaker = before.mode.holds_place() && mode == FlightMode::AltHold;
            let wanted = !self.heard || self.pilot.mode.holds_place();
            if weaker && wanted && !recent(self.turned) {
                self.note(at, "mode", listed(common(self.alerts, UNKNOWN)), !blind);
            }
        }
    }

    fn note(&mut self, at: Instant, action: &'static str, alert: String, needless: bool) {
        let state = self.soundness.state();
        let State { sound, height, speed, .. } = state;
        // Alerts for which it would have landed or flown on in another mode with a fresh battery.
        let other = common(self.alerts, LAND | UNKNOWN).without(SPENT).without(SEES_NOTHING);
        self.list.push(Intervention {
            t_s: at.seconds_f64(),
            alert,
            action,
            sound: sound && needless,
            height_m: height.into(),
            speed_mps: speed.into(),
            tilt_deg: f64::from(state.tilt().to_degrees()),
            attitude_error_deg: f64::from(state.attitude_error().to_degrees()),
            by_protection: self.cut_off || self.alerts.intersects(CUT),
            spent: action == "land" && !state.carried && other.is_empty(),
        });
    }
}

/// The alerts that are in both sets.
fn common(one: Alerts, other: Alerts) -> Alerts {
    one.without(one.without(other))
}

/// Names of alerts, with `+` between two.
fn listed(alerts: Alerts) -> String {
    let names: Vec<_> = names().filter(|(_, bit)| alerts.bits() & bit != 0).map(|(name, _)| name).collect();
    if names.is_empty() { NONE.into() } else { names.join("+") }
}

#[cfg(test)]
mod tests;
