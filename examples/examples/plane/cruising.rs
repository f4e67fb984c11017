//! Cruising: one stage, from way-point to way-point, and to and fro between the last two until it is called down.

use super::{Aeroplane, Course, Demand, Path, Seen, Thrust};
use stampfly_mode::stage::{Failure, Instant, Limit, Mode, Stage, Step};

/// Airspeed, m/s.
pub const SPEED: f32 = 15.0;
/// A way-point is reached within this distance, m: more than a turn takes.
const REACHED: f32 = 60.0;

/// Along the route.
#[derive(Clone, Debug, PartialEq)]
pub struct Cruising;

/// How a cruise ends.
pub enum CruisingEnd {
    /// The ground station wants it down.
    Called,
}

impl Mode for Cruising {
    type Vehicle = Aeroplane;
    type Stage = CruisingStage;
    type End = CruisingEnd;
    const FIRST: CruisingStage = CruisingStage::Cruise;

    fn enter(_: Instant, _: &Seen<'_>) -> Self {
        Self
    }
}

stampfly_mode::stages! {
    /// The stage of a cruise.
    pub enum CruisingStage for Cruising { Cruise: Cruise }
    pub enum CruisingMemory;
}

/// Along the route.
#[derive(Clone, Debug, PartialEq)]
pub struct Cruise {
    /// Index of the way-point ahead.
    next: usize,
}

impl Stage<Cruising> for Cruise {
    fn enter(_: &mut Cruising, _: Instant, _: &Seen<'_>) -> Self {
        Self { next: 0 }
    }

    fn limit(&self, _: &Cruising) -> Limit<Cruising> {
        Limit::Unlimited("a cruise lasts until somebody wants it down")
    }

    fn execute(&mut self, _: &mut Cruising, _: Instant, seen: &Seen<'_>) -> Step<Cruising> {
        if seen.begin_landing {
            return Step::End(CruisingEnd::Called);
        }
        let (Some(here), Some(goal)) = (seen.position, seen.route.get(self.next)) else {
            return Step::Fail(Failure::Stage);
        };
        if here.distance(*goal) < REACHED {
            let next = self.next + 1;
            self.next = if next < seen.route.len() { next } else { seen.route.len().saturating_sub(2) };
        }
        let path = Path::Altitude(goal.altitude, 0.0);
        Step::Stay(Demand { course: Course::To(*goal), path, thrust: Thrust::Airspeed(SPEED), brake: false })
    }
}
