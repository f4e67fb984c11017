//! Taxiing: stop, turn off, park; and back to the strip when somebody wants it to fly again.
//!
//! ZeroPilot leaves this mode open. It is also the first one: an aircraft that is switched on is parked.

use super::seen::{Aircraft, Order, Seen};
use crate::messages::Demand;
use stampfly_control::fixed_wing::runway::{self, Runway};
use stampfly_mode::stage::{Duration, Instant, Limit, Mode, Stage, Step};
use stampfly_types::math;

/// Rolling slower than this it stands, m/s.
const STANDS: f32 = 0.7;

/// On the ground.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Taxiing;

/// How taxiing ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TaxiingEnd {
    /// It is where it takes off, and may.
    Ready,
}

impl Mode for Taxiing {
    type Vehicle = Aircraft;
    type Stage = TaxiingStage;
    type End = TaxiingEnd;
    const FIRST: TaxiingStage = TaxiingStage::Stop;

    fn enter(_: Instant, _: &Seen<'_>) -> Self {
        Self
    }
}

stampfly_mode::stages! {
    /// The stages.
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    pub enum TaxiingStage for Taxiing {
        /// Brakes.
        Stop: Stop,
        /// Off the strip.
        TurnOff: TurnOff,
        /// It stands.
        Park: Park,
        /// Back to the strip.
        Return: Return,
        /// Along the strip.
        LineUp: LineUp,
    }
    /// The current one, with what it remembers.
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    pub enum TaxiingMemory;
}

fn drive(demand: Demand, seen: &Seen<'_>) -> Step<Taxiing> {
    Step::Stay(demand.rolling(seen.config.ground.speed, seen.ground_speed))
}

/// To a point, straight.
fn to(point: [f32; 2], here: [f32; 2]) -> Demand {
    Demand::nose(math::atan2(point[1] - here[1], point[0] - here[0]))
}

fn is_near(one: [f32; 2], other: [f32; 2], seen: &Seen<'_>) -> bool {
    let ([north, east], reached) = ([one[0] - other[0], one[1] - other[1]], seen.config.ground.reached);
    north * north + east * east < reached * reached
}

/// Brakes, straight ahead.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Stop {
    course: f32,
}

impl Stage<Taxiing> for Stop {
    fn enter(_: &mut Taxiing, _: Instant, seen: &Seen<'_>) -> Self {
        Self { course: seen.heading }
    }

    fn limit(&self, _: &Taxiing) -> Limit<Taxiing> {
        Limit::Stage(Duration::from_secs(20), TaxiingStage::Park)
    }

    fn execute(&mut self, _: &mut Taxiing, _: Instant, seen: &Seen<'_>) -> Step<Taxiing> {
        if seen.ground_speed < STANDS {
            // What has not flown yet stands where it was put.
            let off = seen.runway.is_some() && seen.order != Order::Stand;
            return Step::Stage(if off { TaxiingStage::TurnOff } else { TaxiingStage::Park });
        }
        Step::Stay(Demand::nose(self.course).standing())
    }
}

/// Off the strip, to the right.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TurnOff {
    goal: Option<[f32; 2]>,
}

impl Stage<Taxiing> for TurnOff {
    fn enter(_: &mut Taxiing, _: Instant, seen: &Seen<'_>) -> Self {
        let ahead = |here, strip: Runway| {
            let [_, aside] = runway::along(strip.local, here, seen.heading);
            let beside = seen.config.ground.beside;
            let forward = runway::ahead(here, seen.heading, beside);
            runway::ahead(forward, seen.heading + math::FRAC_PI_2, beside - aside)
        };
        Self { goal: seen.position.zip(seen.runway).map(|(here, strip)| ahead(here, strip)) }
    }

    fn limit(&self, _: &Taxiing) -> Limit<Taxiing> {
        Limit::Stage(Duration::from_secs(60), TaxiingStage::Park)
    }

    fn execute(&mut self, _: &mut Taxiing, _: Instant, seen: &Seen<'_>) -> Step<Taxiing> {
        match (self.goal, seen.position) {
            (Some(goal), Some(here)) if !is_near(goal, here, seen) => drive(to(goal, here), seen),
            _ => Step::Stage(TaxiingStage::Park),
        }
    }
}

/// It stands until somebody wants it to fly.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Park {
    course: f32,
}

impl Stage<Taxiing> for Park {
    fn enter(_: &mut Taxiing, _: Instant, seen: &Seen<'_>) -> Self {
        Self { course: seen.heading }
    }

    fn limit(&self, _: &Taxiing) -> Limit<Taxiing> {
        Limit::Unlimited("an aircraft that stands may stand")
    }

    fn execute(&mut self, _: &mut Taxiing, _: Instant, seen: &Seen<'_>) -> Step<Taxiing> {
        if seen.order != Order::Fly {
            return Step::Stay(Demand::nose(self.course).standing());
        }
        // Where it was put it takes off; from elsewhere it returns.
        match seen.runway.zip(seen.position) {
            Some((strip, here)) if !is_near(strip.local, here, seen) => Step::Stage(TaxiingStage::Return),
            _ => Step::End(TaxiingEnd::Ready),
        }
    }
}

/// To a point before the one where it takes off.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Return;

impl Stage<Taxiing> for Return {
    fn enter(_: &mut Taxiing, _: Instant, _: &Seen<'_>) -> Self {
        Self
    }

    fn limit(&self, _: &Taxiing) -> Limit<Taxiing> {
        // 600 m at taxiing speed: something holds it.
        Limit::Stage(Duration::from_secs(200), TaxiingStage::Stop)
    }

    fn execute(&mut self, _: &mut Taxiing, _: Instant, seen: &Seen<'_>) -> Step<Taxiing> {
        let (Order::Fly, Some(strip), Some(here)) = (seen.order, seen.runway, seen.position) else {
            return Step::Stage(TaxiingStage::Stop);
        };
        let goal = runway::ahead(strip.local, strip.heading, -seen.config.ground.before);
        if is_near(goal, here, seen) { Step::Stage(TaxiingStage::LineUp) } else { drive(to(goal, here), seen) }
    }
}

/// Along the strip to where it takes off.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LineUp;

impl Stage<Taxiing> for LineUp {
    fn enter(_: &mut Taxiing, _: Instant, _: &Seen<'_>) -> Self {
        Self
    }

    fn limit(&self, _: &Taxiing) -> Limit<Taxiing> {
        Limit::Stage(Duration::from_secs(60), TaxiingStage::Return)
    }

    fn execute(&mut self, _: &mut Taxiing, _: Instant, seen: &Seen<'_>) -> Step<Taxiing> {
        let (Order::Fly, Some(strip), Some(here)) = (seen.order, seen.runway, seen.position) else {
            return Step::Stage(TaxiingStage::Stop);
        };
        let [ahead, _] = runway::along(strip.local, here, strip.heading);
        if ahead > -seen.config.ground.reached {
            return Step::End(TaxiingEnd::Ready);
        }
        drive(seen.along(strip.local, strip.heading), seen)
    }
}
