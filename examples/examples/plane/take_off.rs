//! Take-off: roll, climb.

use super::{Aeroplane, Course, Demand, Path, Seen, Thrust};
use stampfly_mode::stage::{Duration, Instant, Limit, Mode, Stage, Step};

/// It rotates at this airspeed, m/s.
const ROTATION: f32 = 7.0;
/// And climbs at this one, m/s, at this angle, rad.
const CLIMB: (f32, f32) = (15.0, 0.3);
/// Take-off is over at this height above the runway, m.
const HEIGHT: f32 = 40.0;

/// From standstill to cruising height.
#[derive(Clone, Debug, PartialEq)]
pub struct TakeOff;

/// How a take-off ends.
pub enum TakeOffEnd {
    /// At its height.
    Climbed,
    /// It never became fast enough.
    TooSlow,
    /// It flies, and does not climb.
    TooLow,
}

impl Mode for TakeOff {
    type Vehicle = Aeroplane;
    type Stage = TakeOffStage;
    type End = TakeOffEnd;
    const FIRST: TakeOffStage = TakeOffStage::Roll;

    fn enter(_: Instant, _: &Seen<'_>) -> Self {
        Self
    }
}

stampfly_mode::stages! {
    /// The stages of a take-off.
    pub enum TakeOffStage for TakeOff { Roll: Roll, Climb: Climb }
    pub enum TakeOffMemory;
}

/// Along the runway, at full throttle.
#[derive(Clone, Debug, PartialEq)]
pub struct Roll;

impl Stage<TakeOff> for Roll {
    fn enter(_: &mut TakeOff, _: Instant, _: &Seen<'_>) -> Self {
        Self
    }

    fn limit(&self, _: &TakeOff) -> Limit<TakeOff> {
        Limit::End(Duration::from_secs(15), TakeOffEnd::TooSlow)
    }

    fn execute(&mut self, _: &mut TakeOff, _: Instant, seen: &Seen<'_>) -> Step<TakeOff> {
        if seen.airspeed > ROTATION {
            return Step::Stage(TakeOffStage::Climb);
        }
        let course = Course::Heading(seen.runway.heading);
        Step::Stay(Demand { course, path: Path::Angle(0.0), thrust: Thrust::Throttle(1.0), brake: false })
    }
}

/// Off the ground and straight ahead.
#[derive(Clone, Debug, PartialEq)]
pub struct Climb;

impl Stage<TakeOff> for Climb {
    fn enter(_: &mut TakeOff, _: Instant, _: &Seen<'_>) -> Self {
        Self
    }

    fn limit(&self, _: &TakeOff) -> Limit<TakeOff> {
        Limit::End(Duration::from_secs(60), TakeOffEnd::TooLow)
    }

    fn execute(&mut self, _: &mut TakeOff, _: Instant, seen: &Seen<'_>) -> Step<TakeOff> {
        if seen.altitude > seen.runway.threshold.altitude + HEIGHT {
            return Step::End(TakeOffEnd::Climbed);
        }
        let (speed, angle) = CLIMB;
        let course = Course::Track(seen.runway.heading);
        Step::Stay(Demand { course, path: Path::Angle(angle), thrust: Thrust::Airspeed(speed), brake: false })
    }
}
