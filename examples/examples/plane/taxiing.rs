//! Taxiing: back to the threshold, into the runway, and wait.
//!
//! The document that the other modes come from leaves this one open. It was added without a change to any of them.

use super::geometry::{Point, Runway};
use super::{Aeroplane, Course, Demand, Path, Seen, Thrust};
use stampfly_mode::stage::{Duration, Failure, Instant, Limit, Mode, Stage, Step};

/// m/s.
const SPEED: f32 = 3.0;
/// It turns round this far before the threshold, m.
const BEFORE: f32 = 30.0;
/// A point is reached within this distance, m: a turn's radius.
const REACHED: f32 = 4.0;

/// On the ground, from wherever it stands to the threshold.
#[derive(Clone, Debug, PartialEq)]
pub struct Taxiing;

/// How taxiing ends.
pub enum TaxiingEnd {
    /// It stands at the threshold and may take off.
    Cleared,
}

impl Mode for Taxiing {
    type Vehicle = Aeroplane;
    type Stage = TaxiingStage;
    type End = TaxiingEnd;
    const FIRST: TaxiingStage = TaxiingStage::Return;

    fn enter(_: Instant, _: &Seen<'_>) -> Self {
        Self
    }
}

stampfly_mode::stages! {
    /// The stages of taxiing.
    pub enum TaxiingStage for Taxiing { Return: Return, LineUp: LineUp, Hold: Hold, Park: Park }
    pub enum TaxiingMemory;
}

fn before(runway: &Runway) -> Point {
    runway.threshold.ahead(runway.heading, -BEFORE)
}

fn drive(course: Course, seen: &Seen<'_>) -> Step<Taxiing> {
    // It comes from the runway faster than it may turn.
    let brake = seen.airspeed > 2.0 * SPEED;
    Step::Stay(Demand { course, path: Path::Angle(0.0), thrust: Thrust::Airspeed(SPEED), brake })
}

fn stand(seen: &Seen<'_>) -> Demand {
    let course = Course::Heading(seen.runway.heading);
    Demand { course, path: Path::Angle(0.0), thrust: Thrust::Throttle(0.0), brake: true }
}

/// Beside the runway to a point before the threshold.
#[derive(Clone, Debug, PartialEq)]
pub struct Return;

impl Stage<Taxiing> for Return {
    fn enter(_: &mut Taxiing, _: Instant, _: &Seen<'_>) -> Self {
        Self
    }

    fn limit(&self, _: &Taxiing) -> Limit<Taxiing> {
        // 1.8 km at taxiing speed: something holds it.
        Limit::Stage(Duration::from_secs(600), TaxiingStage::Park)
    }

    fn execute(&mut self, _: &mut Taxiing, _: Instant, seen: &Seen<'_>) -> Step<Taxiing> {
        let Some(here) = seen.position else { return Step::Fail(Failure::Stage) };
        let goal = before(seen.runway);
        if here.distance(goal) < REACHED { Step::Stage(TaxiingStage::LineUp) } else { drive(Course::To(goal), seen) }
    }
}

/// Along the runway's axis to the threshold.
#[derive(Clone, Debug, PartialEq)]
pub struct LineUp;

impl Stage<Taxiing> for LineUp {
    fn enter(_: &mut Taxiing, _: Instant, _: &Seen<'_>) -> Self {
        Self
    }

    fn limit(&self, _: &Taxiing) -> Limit<Taxiing> {
        Limit::Stage(Duration::from_secs(60), TaxiingStage::Return)
    }

    fn execute(&mut self, _: &mut Taxiing, _: Instant, seen: &Seen<'_>) -> Step<Taxiing> {
        let Some(here) = seen.position else { return Step::Fail(Failure::Stage) };
        let threshold = seen.runway.threshold;
        if here.distance(threshold) < REACHED {
            return Step::Stage(TaxiingStage::Hold);
        }
        drive(Course::Along(before(seen.runway), threshold), seen)
    }
}

/// At the threshold.
#[derive(Clone, Debug, PartialEq)]
pub struct Hold;

impl Stage<Taxiing> for Hold {
    fn enter(_: &mut Taxiing, _: Instant, _: &Seen<'_>) -> Self {
        Self
    }

    fn limit(&self, _: &Taxiing) -> Limit<Taxiing> {
        Limit::Unlimited("an aeroplane that stands may stand")
    }

    fn execute(&mut self, _: &mut Taxiing, _: Instant, seen: &Seen<'_>) -> Step<Taxiing> {
        if seen.cleared && seen.airspeed < 0.5 {
            return Step::End(TaxiingEnd::Cleared);
        }
        Step::Stay(stand(seen))
    }
}

/// Wherever it is, for good.
#[derive(Clone, Debug, PartialEq)]
pub struct Park;

impl Stage<Taxiing> for Park {
    fn enter(_: &mut Taxiing, _: Instant, _: &Seen<'_>) -> Self {
        Self
    }

    fn limit(&self, _: &Taxiing) -> Limit<Taxiing> {
        Limit::Unlimited("it could not drive; a person has to look")
    }

    fn execute(&mut self, _: &mut Taxiing, _: Instant, seen: &Seen<'_>) -> Step<Taxiing> {
        Step::Stay(stand(seen))
    }
}
