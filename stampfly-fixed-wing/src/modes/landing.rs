//! Landing: transition, slope, flare, decrab, touchdown.
//!
//! Where it lands, along which line and how the last metres fade is [`Approach`]'s. Each stage is entered anew in every landing, so the second one is as
//! complete as the first.

use super::seen::{Aircraft, Seen};
use crate::messages::Demand;
use stampfly_control::fixed_wing::runway::{self, Runway};
use stampfly_control::fixed_wing::{Approach, ApproachConfig, Follower, WayPoint, WayPoints};
use stampfly_mode::stage::{Duration, Instant, Limit, Mode, Stage, Step};

/// On the way to the slope it is so much faster than on it, m/s.
const FASTER: f32 = 2.0;

/// Down to the strip.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Landing(Approach);

/// How a landing ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LandingEnd {
    /// On the ground.
    Landed,
    /// It goes round.
    Missed,
}

impl Mode for Landing {
    type Vehicle = Aircraft;
    type Stage = LandingStage;
    type End = LandingEnd;
    const FIRST: LandingStage = LandingStage::Transition;

    fn enter(_: Instant, seen: &Seen<'_>) -> Self {
        // Without a strip, ahead and around home.
        let strip = seen.runway.unwrap_or_else(|| Runway::at(&seen.origin, [0.0; 2], 0.0, seen.course));
        let p = seen.config;
        let config = ApproachConfig {
            speed: p.speed.stall * p.speed.approach_share,
            height: p.height.approach,
            crossing: p.height.crossing,
            sink: p.flare.sink,
            flare: p.flare.time,
            radius: p.path.radius,
            bank_max: p.path.bank_low,
        };
        Self(Approach::new(&strip, seen.wind, &seen.origin, &config))
    }
}

stampfly_mode::stages! {
    /// The stages.
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    pub enum LandingStage for Landing {
        /// To the beginning of the slope.
        Transition: Transition,
        /// Down the slope.
        Slope: Slope,
        /// The throttle is closed.
        Flare: Flare,
        /// The nose turns to the strip.
        Decrab: Decrab,
        /// Until it rolls slowly.
        Touchdown: Touchdown,
    }
    /// The current one, with what it remembers.
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    pub enum LandingMemory;
}

impl Landing {
    /// m above the strip.
    fn above(&self, seen: &Seen<'_>) -> f32 {
        self.0.above(seen.height)
    }

    fn flare(&self, seen: &Seen<'_>) -> Demand {
        self.0.flare(seen.height, seen.ground_speed)
    }
}

/// To the beginning of the slope.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Transition {
    way: WayPoints<4>,
    follower: Follower,
}

impl Stage<Landing> for Transition {
    fn enter(Landing(approach): &mut Landing, _: Instant, seen: &Seen<'_>) -> Self {
        let mut way = WayPoints::default();
        for (id, place) in (1..).zip(approach.way(seen.position.unwrap_or_default())) {
            // There is room for four, and all of them are places.
            let _ = way.append(WayPoint { id, place, height: approach.height() });
        }
        Self { way, follower: Follower::default() }
    }

    fn limit(&self, _: &Landing) -> Limit<Landing> {
        // Twice across a square kilometre: something holds it.
        Limit::End(Duration::from_secs(300), LandingEnd::Missed)
    }

    fn execute(&mut self, Landing(approach): &mut Landing, _: Instant, seen: &Seen<'_>) -> Step<Landing> {
        let p = seen.config;
        let Some(here) = seen.position else { return Step::End(LandingEnd::Missed) };
        let followed = self.follower.follow(&self.way, here, seen.course, p.path.radius);
        let faces = runway::faces(seen.course, approach.heading());
        match followed {
            Some(followed) if !(followed.is_last && faces) => {
                let speed = p.speed.cruise.min(approach.speed() + FASTER);
                Step::Stay(Demand::track(followed.track, p.path.bank_max).at(approach.height(), 0.0).fast(speed))
            }
            None if !faces => Step::End(LandingEnd::Missed),
            _ => Step::Stage(LandingStage::Slope),
        }
    }
}

/// Down the slope.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Slope;

impl Stage<Landing> for Slope {
    fn enter(_: &mut Landing, _: Instant, _: &Seen<'_>) -> Self {
        Self
    }

    fn limit(&self, _: &Landing) -> Limit<Landing> {
        Limit::End(Duration::from_secs(120), LandingEnd::Missed)
    }

    fn execute(&mut self, mode: &mut Landing, _: Instant, seen: &Seen<'_>) -> Step<Landing> {
        let Some(here) = seen.position else { return Step::End(LandingEnd::Missed) };
        if mode.above(seen) <= seen.config.height.flare {
            let is_beside = mode.0.aside(here).abs() > seen.config.flare.missed;
            return if is_beside { Step::End(LandingEnd::Missed) } else { Step::Stage(LandingStage::Flare) };
        }
        Step::Stay(mode.0.slope(here, seen.ground_speed))
    }
}

/// The throttle closes.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Flare;

impl Stage<Landing> for Flare {
    fn enter(_: &mut Landing, _: Instant, _: &Seen<'_>) -> Self {
        Self
    }

    fn limit(&self, _: &Landing) -> Limit<Landing> {
        // It floats.
        Limit::End(Duration::from_secs(15), LandingEnd::Missed)
    }

    fn execute(&mut self, mode: &mut Landing, _: Instant, seen: &Seen<'_>) -> Step<Landing> {
        if mode.above(seen) <= seen.config.height.decrab {
            return Step::Stage(LandingStage::Decrab);
        }
        Step::Stay(mode.flare(seen))
    }
}

/// The nose turns from the wind to the strip.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Decrab;

impl Stage<Landing> for Decrab {
    fn enter(_: &mut Landing, _: Instant, _: &Seen<'_>) -> Self {
        Self
    }

    fn limit(&self, _: &Landing) -> Limit<Landing> {
        Limit::Stage(Duration::from_secs(8), LandingStage::Touchdown)
    }

    fn execute(&mut self, mode: &mut Landing, _: Instant, seen: &Seen<'_>) -> Step<Landing> {
        if mode.above(seen) <= seen.config.height.touchdown {
            return Step::Stage(LandingStage::Touchdown);
        }
        Step::Stay(Demand { aligned: true, ..mode.flare(seen) })
    }
}

/// Until it rolls slowly.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Touchdown;

impl Stage<Landing> for Touchdown {
    fn enter(_: &mut Landing, _: Instant, _: &Seen<'_>) -> Self {
        Self
    }

    fn limit(&self, _: &Landing) -> Limit<Landing> {
        Limit::End(Duration::from_secs(20), LandingEnd::Landed)
    }

    fn execute(&mut self, mode: &mut Landing, _: Instant, seen: &Seen<'_>) -> Step<Landing> {
        if seen.ground_speed < seen.config.ground.rolls {
            return Step::End(LandingEnd::Landed);
        }
        Step::Stay(Demand { aligned: true, on_ground: seen.on_ground, ..mode.flare(seen) })
    }
}
