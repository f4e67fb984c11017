//! The path manager: four states, one of which calls the modes. None knows which mode is current.

use super::autopilot::steer;
use super::model::{Controls, Motion};
use super::{Demand, Plane, Seen};
use stampfly_mode::stage::{Instant, Selector};

/// The path manager's states. A cycle goes through the first three; the last one is never left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Takes in what the ground station and the sensors say.
    Fusion,
    /// Executes whatever mode is current.
    ModeExecutor,
    /// Steers.
    Steering,
    /// Something has failed: throttle off, wings level.
    FatalFailure,
}

/// The path manager.
pub struct PathManager {
    pub state: State,
    pub selector: Selector<Plane>,
    demand: Option<Demand>,
}

impl PathManager {
    pub fn new() -> Self {
        Self { state: State::Fusion, selector: Selector::new(), demand: None }
    }

    /// One cycle.
    pub fn cycle(&mut self, now: Instant, seen: &Seen<'_>, motion: &Motion) -> Controls {
        loop {
            match self.state {
                // Simulated sensors need no fusion.
                State::Fusion => self.state = State::ModeExecutor,
                State::ModeExecutor => {
                    self.demand = self.selector.execute(now, seen).ok();
                    self.state = if self.selector.is_error() { State::FatalFailure } else { State::Steering };
                }
                State::Steering => {
                    self.state = State::Fusion;
                    return self.demand.map(|demand| steer(&demand, motion)).unwrap_or_default();
                }
                State::FatalFailure => return Controls::default(),
            }
        }
    }
}
