//! Landing: descend, flare, touchdown; or blind.
//!
//! | stage | while | speed | thrust |
//! |---|---|---|---|
//! | descend | above [`LandingConfig::flare_height`] | `descent` | unlimited |
//! | flare | lower, or without a height | slower with the height, to `touchdown` | unlimited |
//! | touchdown | below `ceiling_height`, or no longer sinking | the same | under a ceiling that falls |
//! | blind | without a climb rate, or falling while the height says that it stands | `touchdown` | shares of hover thrust |
//!
//! Near the ground the thrust ceiling is ramped down, so the vehicle settles instead of floating on its own ground effect.
//! A touch that is felt ends the ramp. The ramp is also the test for touchdown: a vehicle whose specific force does not follow its thrust stands. One that rises
//! again goes back to the stage of its height. A blind one stays blind.
//!
//! No stage has a limit of its own: the machine knows from which height the landing began, and stops the motors of one that
//! takes too long.
//!
//! [`LandingConfig::flare_height`]: super::LandingConfig::flare_height

use super::blind::BlindDescent;
use super::seen::{Asked, Multicopter, Seen};
use super::weight::{ALL_FORCE, LITTLE_THRUST, Support};
use crate::lasting::lasting;
use crate::stage::{Limit, Mode, Stage, Step};
use core::convert::Infallible;
use stampfly_types::messages::GroundContact;
use stampfly_types::{Duration, GRAVITY, Instant};

/// A vehicle that falls for this long while its ramp goes down is in the air, whatever its height says: from 6 cm it would
/// be on the ground by then.
const FREE_FALL: Duration = Duration::from_millis(250);
/// So is one that sinks faster than it descends by this, m/s, for this long, at no more than this share of its thrust: from 8 cm
/// it would be on the ground before so much of its thrust is gone. The weight test alone is late, because drag carries a part. Of one
/// that is fast already it carries as much as the ground would, and the test says that it stands: that is not asked of one whose
/// height is below the floor.
const FAST: f32 = 0.1;
const FAST_FALL: Duration = Duration::from_millis(60);
const RAMPED: f32 = 0.9;

/// The ground carries a vehicle that keeps its specific force without its thrust for this long.
const CARRIED: Duration = Duration::from_secs(1);

/// Why no stage of a landing has a limit.
const MACHINE: &str = "the machine stops the motors after ModeConfig::landing_spare, or landing_blind";

/// A landing: since when what has been so.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Landing {
    /// It does not sink although it is asked to.
    stalled: Option<Instant>,
    /// It stands, says the weight test.
    still: Option<Instant>,
    /// It falls.
    falling: Option<Instant>,
    /// It sinks fast under a ceiling.
    fast: Option<Instant>,
    /// Something else than its thrust carries it.
    carried: Option<Instant>,
    /// It has fallen for so long that neither height nor climb rate is to be believed. The next cycle is blind.
    falls: bool,
}

impl Mode for Landing {
    type Vehicle = Multicopter;
    type Stage = LandingStage;
    type End = Infallible;
    const FIRST: LandingStage = LandingStage::Descend;

    fn enter(_: Instant, _: &Seen<'_>) -> Self {
        Self { stalled: None, still: None, falling: None, fast: None, carried: None, falls: false }
    }
}

crate::stages! {
    /// The stages of a landing.
    pub enum LandingStage for Landing {
        Descend: Descend,
        Flare: Flare,
        Touchdown: Touchdown,
        Blind: Blind,
    }
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    pub enum LandingMemory;
}

impl Landing {
    /// The stage that fits. The same answer, asked again in the same cycle.
    // Three stages ask this; inlined, three copies of it lie in flash.
    #[inline(never)]
    fn stage(&mut self, now: Instant, seen: &Seen<'_>) -> LandingStage {
        let config = seen.config;
        let Some(sink_rate) = seen.sink_rate().filter(|_| !self.falls) else {
            return LandingStage::Blind;
        };
        let sinks = sink_rate > config.still_speed;
        let stalled = lasting(&mut self.stalled, now, !sinks) > config.stall_time;
        match seen.height() {
            height if stalled || height.is_some_and(|height| height < config.ceiling_height) => LandingStage::Touchdown,
            Some(height) if height >= config.flare_height => LandingStage::Descend,
            _ => LandingStage::Flare,
        }
    }

    /// A cycle of a stage that knows its climb rate.
    // As above.
    #[inline(never)]
    fn step(&mut self, now: Instant, seen: &Seen<'_>, mut asked: Asked) -> Step<Self> {
        let sinks = seen.sink_rate().is_some_and(|rate| rate > seen.config.descent + FAST);
        let stands = seen.weight.steady == Support::Stands && seen.height().is_none_or(|height| height >= 0.0);
        let fast = sinks && asked.land_detected.thrust_ceiling < RAMPED && !stands;
        self.falls = lasting(&mut self.falling, now, seen.weight.quick == Support::Falls) >= FREE_FALL
            || lasting(&mut self.fast, now, fast) >= FAST_FALL;
        asked.is_testing &= !self.falls;
        let still = lasting(&mut self.still, now, seen.weight.steady == Support::Stands);
        let landed = !self.falls && still >= seen.config.touchdown_time;
        self.finish(now, seen, asked, landed)
    }

    /// What the ground or a hand carries has landed, whatever the stage says.
    // As above.
    #[inline(never)]
    fn finish(&mut self, now: Instant, seen: &Seen<'_>, mut asked: Asked, landed: bool) -> Step<Self> {
        let carried = lasting(&mut self.carried, now, seen.weight.is_carried || is_held(seen)) >= CARRIED;
        asked.land_detected.landed = landed || carried;
        if asked.land_detected.landed {
            asked.land_detected.contact = GroundContact::Ground;
        }
        Step::Stay(asked)
    }
}

/// Does something hold the vehicle up, with so little thrust that it would fall? A hand that has it before the landing begins takes its
/// thrust away before, so that there is no flight to compare with. Thrust that is known badly, for a battery that lies, carries a
/// vehicle that sinks.
fn is_held(seen: &Seen<'_>) -> bool {
    let (weight, hover_thrust) = (seen.weight, seen.config.hover_thrust);
    hover_thrust.is_finite()
        && weight.thrust < LITTLE_THRUST * hover_thrust
        && weight.force > ALL_FORCE * GRAVITY
        && seen.sink_rate().is_some_and(|rate| rate.abs() < seen.config.still_speed)
}

/// At its height's speed: all of the descent above the flare height, slower below, slowest where nobody knows.
fn slowing(seen: &Seen<'_>) -> Asked {
    let (config, mut asked) = (seen.config, seen.asked());
    let flare = seen.height().map_or(0.0, |height| (height / config.flare_height).clamp(0.0, 1.0));
    asked.land_detected.descent_rate = config.touchdown + (config.descent - config.touchdown) * flare;
    asked
}

/// High above the ground.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Descend;

impl Stage<Landing> for Descend {
    fn enter(_: &mut Landing, _: Instant, _: &Seen<'_>) -> Self {
        Self
    }

    fn limit(&self, _: &Landing) -> Limit<Landing> {
        Limit::Unlimited(MACHINE)
    }

    fn execute(&mut self, landing: &mut Landing, now: Instant, seen: &Seen<'_>) -> Step<Landing> {
        match landing.stage(now, seen) {
            LandingStage::Descend => landing.step(now, seen, seen.asked()),
            other => Step::Stage(other),
        }
    }
}

/// Near the ground, or at no known height.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Flare;

impl Stage<Landing> for Flare {
    fn enter(_: &mut Landing, _: Instant, _: &Seen<'_>) -> Self {
        Self
    }

    fn limit(&self, _: &Landing) -> Limit<Landing> {
        Limit::Unlimited(MACHINE)
    }

    fn execute(&mut self, landing: &mut Landing, now: Instant, seen: &Seen<'_>) -> Step<Landing> {
        match landing.stage(now, seen) {
            LandingStage::Flare => landing.step(now, seen, slowing(seen)),
            other => Step::Stage(other),
        }
    }
}

/// At the ground, or stopped by something: the ceiling of thrust falls.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Touchdown {
    began: Instant,
    /// It was felt to touch.
    struck: bool,
}

impl Stage<Landing> for Touchdown {
    fn enter(_: &mut Landing, now: Instant, _: &Seen<'_>) -> Self {
        Self { began: now, struck: false }
    }

    fn limit(&self, _: &Landing) -> Limit<Landing> {
        Limit::Unlimited(MACHINE)
    }

    fn execute(&mut self, landing: &mut Landing, now: Instant, seen: &Seen<'_>) -> Step<Landing> {
        match landing.stage(now, seen) {
            LandingStage::Touchdown => {
                let (config, mut asked) = (seen.config, slowing(seen));
                self.struck |= seen.weight.is_struck;
                // Thrust turns over what stands on one leg: once the ground is felt, there is no waiting for the ramp.
                let ramp = (now.since(self.began).seconds() / config.ceiling_time.seconds()).min(1.0);
                let fallen = if self.struck { 1.0 } else { ramp };
                asked.land_detected.thrust_ceiling = 1.0 - (1.0 - config.ceiling_share) * fallen;
                asked.is_testing = true;
                landing.step(now, seen, asked)
            }
            other => Step::Stage(other),
        }
    }
}

/// Down on thrust alone.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Blind {
    descent: BlindDescent,
}

impl Stage<Landing> for Blind {
    fn enter(_: &mut Landing, now: Instant, seen: &Seen<'_>) -> Self {
        Self { descent: BlindDescent::new(now, seen.breaks_off) }
    }

    fn limit(&self, _: &Landing) -> Limit<Landing> {
        Limit::Unlimited(MACHINE)
    }

    fn execute(&mut self, landing: &mut Landing, now: Instant, seen: &Seen<'_>) -> Step<Landing> {
        let (ceiling, landed) = self.descent.step(now, seen.weight, seen.config.touchdown_time);
        let mut asked = seen.asked();
        asked.land_detected.thrust_ceiling = ceiling;
        asked.land_detected.descent_rate = seen.config.touchdown;
        asked.is_testing = self.descent.is_testing();
        landing.finish(now, seen, asked, landed)
    }
}
