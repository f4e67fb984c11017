//! The safety supervisor: heartbeats and the emergency stop in, the state of the vehicle out.
//!
//! | condition | state |
//! |---|---|
//! | one component stalled, or the diagnosis found a fault | Degraded |
//! | two or more components stalled | EStop |
//! | emergency stop from outside | EStop, in the same step |
//!
//! The state is latched: it rises by itself and falls only by a reset, which leads to the state that the conditions of
//! that moment give. A reset acts when it changes from false to true, so holding it does not defeat the latch.
//!
//! A heartbeat is a counter that changes: every component publishes in each period, and the generation of its topic
//! counts. Between two checks the supervisor sees nothing, so it declares a component stalled at the last check before
//! the limit: the reaction comes *within* the timeout of the last heartbeat, not up to a period after it.
//!
//! ```
//! use stampfly_rover::{messages::SystemState, Parameters};
//! use stampfly_rover::safety::{SafetyInput, SafetySupervisor};
//! use stampfly_types::Instant;
//! let (mut supervisor, parameters) = (SafetySupervisor::default(), Parameters::default().safety);
//! let stop = SafetyInput { estop: true, ..SafetyInput::default() };
//! let status = supervisor.step(Instant::from_millis(100), &stop, &parameters);
//! assert_eq!(status.system_state, SystemState::EStop);
//! let released = supervisor.step(Instant::from_millis(200), &SafetyInput::default(), &parameters);
//! assert_eq!(released.system_state, SystemState::EStop, "latched");
//! ```

use crate::messages::{Components, SafetyStatus, SystemState};
use crate::parameters::SafetyParameters;
use stampfly_types::{Duration, Instant};

/// Longest time between two steps of the supervisor.
pub const PERIOD: Duration = Duration::from_millis(100);

/// Number of supervised components.
const COUNT: usize = Components::EACH.len();

/// What the supervisor looks at.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SafetyInput {
    /// Heartbeat counters, in the order of [`Components::EACH`]. Any change is a heartbeat.
    pub heartbeats: [u32; COUNT],
    /// Has the diagnosis found a fault in the last period?
    pub faulty: bool,
    /// Emergency stop from outside.
    pub estop: bool,
    /// Reset of the latch.
    pub reset: bool,
    /// In a replay: the recorded emergency stop and state. They add to the supervisor's own and are not latched,
    /// because the record has its latch in it.
    pub replayed: (bool, SystemState),
}

/// Supervises the heartbeats and latches the state.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SafetySupervisor {
    /// Last counter and when it was first seen.
    seen: [Option<(u32, Instant)>; COUNT],
    latched: SystemState,
    reset_held: bool,
}

impl SafetySupervisor {
    /// One check, at most [`PERIOD`] after the one before. Components have their timeout to start in.
    pub fn step(&mut self, now: Instant, input: &SafetyInput, parameters: &SafetyParameters) -> SafetyStatus {
        let mut stalled = Components::NONE;
        let expected = input.heartbeats.into_iter().zip(parameters.timeouts()).zip(Components::EACH);
        for (seen, ((count, timeout), component)) in self.seen.iter_mut().zip(expected) {
            let (_, since) = *match seen {
                Some(last) if last.0 == count => last,
                _ => seen.insert((count, now)),
            };
            stalled = stalled.set(*component, now.since(since) + PERIOD >= timeout);
        }
        let present = match stalled.bits().count_ones() {
            _ if input.estop => SystemState::EStop,
            0 if !input.faulty => SystemState::Normal,
            0 | 1 => SystemState::Degraded,
            _ => SystemState::EStop,
        };
        let reset = input.reset && !self.reset_held;
        self.reset_held = input.reset;
        self.latched = if reset { present } else { self.latched.max(present) };
        let (replayed_estop, replayed_state) = input.replayed;
        SafetyStatus { estop: input.estop || replayed_estop, system_state: self.latched.max(replayed_state), stalled }
    }
}

impl SafetyParameters {
    /// Heartbeat timeouts, in the order of [`Components::EACH`].
    fn timeouts(&self) -> [Duration; COUNT] {
        let (engine, brake, steering) = (self.engine_timeout, self.brake_timeout, self.steering_timeout);
        let (dynamics, com, time_base) = (self.dynamics_timeout, self.com_timeout, self.time_base_timeout);
        [engine, brake, steering, dynamics, com, time_base].map(Duration::from_seconds)
    }
}

impl SafetyStatus {
    /// Must a component stop? `age`: of this status, `None` before the first. Every component asks this by itself, so
    /// a supervisor that has died stops the vehicle too: this is the watchdog.
    #[must_use]
    pub fn must_stop(&self, age: Option<Duration>, parameters: &SafetyParameters) -> bool {
        let silent = age.is_none_or(|age| age > Duration::from_seconds(parameters.watchdog));
        self.estop || self.system_state == SystemState::EStop || silent
    }
}
