//! Landing: transition, slope, flare, decrab, touchdown.
//!
//! | stage | does | until |
//! |---|---|---|
//! | transition | flies to the beginning of the slope and turns in | its track is within 30° of the runway |
//! | slope | comes down on a line of 5° | 10 m above the runway |
//! | flare | throttle off, nose up | 5 m |
//! | decrab | turns the nose from the wind into the runway | 2 m |
//! | touchdown | waits for the wheels, then brakes | it stands |
//!
//! One that takes too long in the air goes round.

use super::cruising::SPEED;
use super::geometry::{SLOPE, Slope};
use super::{Aeroplane, Course, Demand, Path, Seen, Thrust};
use stampfly_mode::stage::{Duration, Failure, Instant, Limit, Mode, Stage, Step};
use stampfly_types::math;

/// Stalls below this airspeed, m/s.
const STALL: f32 = 5.0;
/// On the slope, m/s.
const APPROACH: f32 = 1.3 * STALL;
/// Heights above the stopping point at which the stages begin, m.
const FLARE: f32 = 10.0;
const DECRAB: f32 = 5.0;
const TOUCHDOWN: f32 = 2.0;
/// The slope begins within this angle of the runway, rad: 30°, as the original's comment says. Its code says 80°.
const GATE: f32 = core::f32::consts::FRAC_PI_6;
/// The transition turns in within this distance of the slope's beginning, m.
const TURN_IN: f32 = 60.0;

/// From cruising height to standstill.
#[derive(Clone, Debug, PartialEq)]
pub struct Landing {
    slope: Slope,
}

/// How a landing ends.
pub enum LandingEnd {
    /// On the runway, standing.
    Landed,
    /// In the air.
    Missed,
}

impl Mode for Landing {
    type Vehicle = Aeroplane;
    type Stage = LandingStage;
    type End = LandingEnd;
    const FIRST: LandingStage = LandingStage::Transition;

    fn enter(_: Instant, seen: &Seen<'_>) -> Self {
        Self { slope: Slope::to(seen.runway, seen.altitude) }
    }
}

stampfly_mode::stages! {
    /// The stages of a landing.
    pub enum LandingStage for Landing {
        Transition: Transition,
        Slope: OnSlope,
        Flare: Flare,
        Decrab: Decrab,
        Touchdown: Touchdown,
    }
    pub enum LandingMemory;
}

/// Height above the stopping point, m.
fn height(seen: &Seen<'_>) -> f32 {
    seen.altitude - seen.runway.stopping.altitude
}

/// Is this track near enough to the runway's heading to come down?
fn is_aligned(track: f32, runway: f32) -> bool {
    math::wrap_angle(track - runway).abs() <= GATE
}

/// To the beginning of the slope.
#[derive(Clone, Debug, PartialEq)]
pub struct Transition {
    turns_in: bool,
}

impl Stage<Landing> for Transition {
    fn enter(_: &mut Landing, _: Instant, _: &Seen<'_>) -> Self {
        Self { turns_in: false }
    }

    fn limit(&self, _: &Landing) -> Limit<Landing> {
        Limit::End(Duration::from_secs(300), LandingEnd::Missed)
    }

    fn execute(&mut self, landing: &mut Landing, _: Instant, seen: &Seen<'_>) -> Step<Landing> {
        let Some(here) = seen.position else { return Step::Fail(Failure::Stage) };
        let Slope { from, aiming } = landing.slope;
        self.turns_in |= here.distance(from) < TURN_IN;
        if self.turns_in && is_aligned(seen.track, seen.runway.heading) {
            return Step::Stage(LandingStage::Slope);
        }
        let course = if self.turns_in { Course::Along(from, aiming) } else { Course::To(from) };
        let path = Path::Altitude(from.altitude, 0.0);
        Step::Stay(Demand { course, path, thrust: Thrust::Airspeed(SPEED), brake: false })
    }
}

/// Down the line.
#[derive(Clone, Debug, PartialEq)]
pub struct OnSlope;

impl Stage<Landing> for OnSlope {
    fn enter(_: &mut Landing, _: Instant, _: &Seen<'_>) -> Self {
        Self
    }

    fn limit(&self, _: &Landing) -> Limit<Landing> {
        Limit::End(Duration::from_secs(300), LandingEnd::Missed)
    }

    fn execute(&mut self, landing: &mut Landing, _: Instant, seen: &Seen<'_>) -> Step<Landing> {
        if height(seen) <= FLARE {
            return Step::Stage(LandingStage::Flare);
        }
        let Some(here) = seen.position else { return Step::Fail(Failure::Stage) };
        let course = Course::Along(landing.slope.from, landing.slope.aiming);
        let path = Path::Altitude(landing.slope.altitude(here), -SLOPE);
        Step::Stay(Demand { course, path, thrust: Thrust::Airspeed(APPROACH), brake: false })
    }
}

/// Throttle off, along the runway.
#[derive(Clone, Debug, PartialEq)]
pub struct Flare;

impl Stage<Landing> for Flare {
    fn enter(_: &mut Landing, _: Instant, _: &Seen<'_>) -> Self {
        Self
    }

    fn limit(&self, _: &Landing) -> Limit<Landing> {
        Limit::End(Duration::from_secs(20), LandingEnd::Missed)
    }

    fn execute(&mut self, landing: &mut Landing, _: Instant, seen: &Seen<'_>) -> Step<Landing> {
        if height(seen) <= DECRAB {
            return Step::Stage(LandingStage::Decrab);
        }
        let course = Course::Along(landing.slope.from, landing.slope.aiming);
        Step::Stay(Demand { course, path: Path::Angle(-0.07), thrust: Thrust::Throttle(0.0), brake: false })
    }
}

/// The nose turns into the runway.
#[derive(Clone, Debug, PartialEq)]
pub struct Decrab;

impl Stage<Landing> for Decrab {
    fn enter(_: &mut Landing, _: Instant, _: &Seen<'_>) -> Self {
        Self
    }

    fn limit(&self, _: &Landing) -> Limit<Landing> {
        Limit::End(Duration::from_secs(20), LandingEnd::Missed)
    }

    fn execute(&mut self, _: &mut Landing, _: Instant, seen: &Seen<'_>) -> Step<Landing> {
        if height(seen) <= TOUCHDOWN {
            return Step::Stage(LandingStage::Touchdown);
        }
        let course = Course::Heading(seen.runway.heading);
        Step::Stay(Demand { course, path: Path::Angle(-0.06), thrust: Thrust::Throttle(0.0), brake: false })
    }
}

/// Down and to a stop.
#[derive(Clone, Debug, PartialEq)]
pub struct Touchdown;

impl Stage<Landing> for Touchdown {
    fn enter(_: &mut Landing, _: Instant, _: &Seen<'_>) -> Self {
        Self
    }

    fn limit(&self, _: &Landing) -> Limit<Landing> {
        Limit::Unlimited("two metres above the runway, without throttle, there is nowhere else to go")
    }

    fn execute(&mut self, _: &mut Landing, _: Instant, seen: &Seen<'_>) -> Step<Landing> {
        if seen.on_ground && seen.airspeed < 0.5 {
            return Step::End(LandingEnd::Landed);
        }
        let course = Course::Heading(seen.runway.heading);
        Step::Stay(Demand { course, path: Path::Angle(-0.04), thrust: Thrust::Throttle(0.0), brake: seen.on_ground })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gate_is_an_angle_on_a_circle() {
        for (track, runway, aligned) in
            [(0, 10, true), (350, 10, true), (10, 350, true), (100, 10, false), (190, 10, false)]
        {
            let [track, runway] = [track, runway].map(|degrees: i16| f32::from(degrees).to_radians());
            assert_eq!(is_aligned(track, runway), aligned, "{track} {runway}");
        }
    }
}
