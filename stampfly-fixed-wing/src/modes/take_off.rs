//! Take-off: roll, climb.

use super::seen::{Aircraft, Order, Seen};
use crate::messages::{Demand, Vertical};
use stampfly_control::fixed_wing::runway::{self, AHEAD};
use stampfly_mode::stage::{Duration, Instant, Limit, Mode, Stage, Step};

/// From standstill to cruising height.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TakeOff {
    /// A point far ahead, made once: m north and east of home, and the direction to it.
    ahead: Option<([f32; 2], f32)>,
}

/// How a take-off ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TakeOffEnd {
    /// At its height.
    Climbed,
    /// It never became fast enough, or the tube does not show how fast it is.
    TooSlow,
    /// Nobody wants it to fly any more.
    GivenUp,
    /// It flies, and does not climb.
    TooLow,
}

impl Mode for TakeOff {
    type Vehicle = Aircraft;
    type Stage = TakeOffStage;
    type End = TakeOffEnd;
    const FIRST: TakeOffStage = TakeOffStage::Roll;

    fn enter(_: Instant, _: &Seen<'_>) -> Self {
        Self { ahead: None }
    }
}

stampfly_mode::stages! {
    /// The stages.
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    pub enum TakeOffStage for TakeOff {
        /// Along the strip.
        Roll: Roll,
        /// Off the ground.
        Climb: Climb,
    }
    /// The current one, with what it remembers.
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    pub enum TakeOffMemory;
}

impl TakeOff {
    /// Straight ahead: along the line to the point far away, or where the nose points while nobody knows where it is.
    fn straight(&mut self, seen: &Seen<'_>) -> Demand {
        if let (None, Some(strip)) = (self.ahead, seen.runway) {
            let far = strip.place.ahead(f64::from(strip.heading).to_degrees(), AHEAD);
            self.ahead = Some((runway::local(&seen.origin, &far), strip.heading));
        }
        match self.ahead.filter(|_| seen.position.is_some()) {
            Some((far, course)) => seen.along(far, course),
            None => Demand::nose(seen.heading),
        }
    }
}

/// Along the strip, at full throttle, with the rudder.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Roll;

impl Stage<TakeOff> for Roll {
    fn enter(_: &mut TakeOff, _: Instant, _: &Seen<'_>) -> Self {
        Self
    }

    fn limit(&self, _: &TakeOff) -> Limit<TakeOff> {
        Limit::End(Duration::from_secs(15), TakeOffEnd::TooSlow)
    }

    fn execute(&mut self, mode: &mut TakeOff, _: Instant, seen: &Seen<'_>) -> Step<TakeOff> {
        if seen.airspeed > seen.config.speed.rotation {
            return Step::Stage(TakeOffStage::Climb);
        }
        if seen.ground_speed > seen.config.speed.rotation && seen.airspeed < 0.5 * seen.ground_speed {
            return Step::End(TakeOffEnd::TooSlow);
        }
        if seen.order != Order::Fly {
            return Step::End(TakeOffEnd::GivenUp);
        }
        Step::Stay(Demand { throttle: 1.0, on_ground: true, ..mode.straight(seen) })
    }
}

/// Off the ground and straight ahead. The autopilot lowers the nose before it becomes too slow.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Climb;

impl Stage<TakeOff> for Climb {
    fn enter(_: &mut TakeOff, _: Instant, _: &Seen<'_>) -> Self {
        Self
    }

    fn limit(&self, _: &TakeOff) -> Limit<TakeOff> {
        Limit::End(Duration::from_secs(60), TakeOffEnd::TooLow)
    }

    fn execute(&mut self, mode: &mut TakeOff, _: Instant, seen: &Seen<'_>) -> Step<TakeOff> {
        let p = seen.config;
        let field = seen.runway.map_or(0.0, |strip| strip.height);
        if seen.height > field + p.height.climbed {
            return Step::End(TakeOffEnd::Climbed);
        }
        // Wings near the ground stay almost level.
        let bank_max = p.path.bank_low;
        let demand = Demand { vertical: Vertical::Pitch, pitch: p.path.climb_pitch, ..mode.straight(seen) };
        Step::Stay(Demand { bank_max, ..demand.fast(p.speed.climb) })
    }
}
