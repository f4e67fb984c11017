//! What the aircraft does, one mode after the other, and what the modes are told and demand.
//!
//! | mode | stages |
//! |---|---|
//! | [`take_off`] | roll, climb |
//! | [`cruising`] | cruise |
//! | [`landing`] | transition, slope, flare, decrab, touchdown |
//! | [`taxiing`] | stop, turn off, park; return, line up |
//!
//! No mode names another: [`HandOver`] below is the one table of which follows which.

pub mod cruising;
pub mod landing;
mod seen;
pub mod take_off;
pub mod taxiing;

use crate::messages::Place;
use core::convert::Infallible;
use cruising::{Cruising, CruisingEnd, CruisingMemory, CruisingStage};
use landing::{Landing, LandingEnd, LandingStage};
pub use seen::{Aircraft, CAPACITY, Order, Seen};
use stampfly_mode::stage::{Active, HandOver, Instant, Mode, Selector};
use take_off::{TakeOff, TakeOffEnd, TakeOffStage};
use taxiing::{Taxiing, TaxiingEnd, TaxiingStage};

/// All that it does.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Plane {
    /// Landings so far, and take-offs that were given up: what outlives the modes.
    pub landings: u32,
    /// See `landings`.
    pub given_up: u32,
}

impl Mode for Plane {
    type Vehicle = Aircraft;
    type Stage = PlaneMode;
    type End = Infallible;
    const FIRST: PlaneMode = PlaneMode::Taxiing;

    fn enter(_: Instant, _: &Seen<'_>) -> Self {
        Self { landings: 0, given_up: 0 }
    }
}

stampfly_mode::stages! {
    /// The modes.
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    pub enum PlaneMode for Plane {
        /// From standstill to cruising height.
        TakeOff: Active<TakeOff>,
        /// Along the way-points.
        Cruising: Active<Cruising>,
        /// Down to the strip.
        Landing: Active<Landing>,
        /// On the ground.
        Taxiing: Active<Taxiing>,
    }
    /// The current one, with what it remembers.
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    pub enum PlaneMemory;
}

impl HandOver<TakeOff> for Plane {
    fn after(&mut self, end: TakeOffEnd) -> PlaneMode {
        match end {
            TakeOffEnd::Climbed => PlaneMode::Cruising,
            TakeOffEnd::TooSlow | TakeOffEnd::GivenUp => {
                self.given_up = self.given_up.wrapping_add(1);
                PlaneMode::Taxiing
            }
            TakeOffEnd::TooLow => PlaneMode::Landing,
        }
    }
}

impl HandOver<Cruising> for Plane {
    fn after(&mut self, end: CruisingEnd) -> PlaneMode {
        match end {
            CruisingEnd::Called => PlaneMode::Landing,
            CruisingEnd::Down => PlaneMode::Taxiing,
        }
    }
}

impl HandOver<Landing> for Plane {
    fn after(&mut self, end: LandingEnd) -> PlaneMode {
        match end {
            LandingEnd::Landed => {
                self.landings = self.landings.wrapping_add(1);
                PlaneMode::Taxiing
            }
            LandingEnd::Missed => PlaneMode::TakeOff,
        }
    }
}

impl HandOver<Taxiing> for Plane {
    fn after(&mut self, end: TaxiingEnd) -> PlaneMode {
        match end {
            TaxiingEnd::Ready => PlaneMode::TakeOff,
        }
    }
}

/// What the modes have come to, for whoever runs them without knowing them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// Mode and stage.
    pub place: Place,
    /// Number of the way-point ahead; zero without one.
    pub way_point: u32,
    /// How many are ahead.
    pub remaining: u32,
    /// As [`Plane`] counts them.
    pub landings: u32,
    /// See `landings`.
    pub given_up: u32,
}

/// What the modes have come to, where they have just been told this.
#[must_use]
pub fn report(selector: &Selector<Plane>, seen: &Seen<'_>) -> Report {
    let Some(active) = selector.active() else { return Report::default() };
    let (way_point, remaining) = match active.memory() {
        PlaneMemory::Cruising(mode) => {
            let CruisingMemory::Cruise(cruise) = mode.memory();
            cruise.ahead(seen)
        }
        _ => (0, 0),
    };
    let Plane { landings, given_up } = *active.mode();
    Report { place: place(selector), way_point, remaining: remaining as u32, landings, given_up }
}

/// Mode and stage, as a message has them.
#[must_use]
pub fn place(selector: &Selector<Plane>) -> Place {
    let Some(active) = selector.active() else { return Place::Nowhere };
    match active.memory() {
        PlaneMemory::TakeOff(mode) => match mode.stage() {
            TakeOffStage::Roll => Place::TakeOffRoll,
            TakeOffStage::Climb => Place::TakeOffClimb,
        },
        PlaneMemory::Cruising(mode) => match mode.stage() {
            CruisingStage::Cruise => Place::CruisingCruise,
        },
        PlaneMemory::Landing(mode) => match mode.stage() {
            LandingStage::Transition => Place::LandingTransition,
            LandingStage::Slope => Place::LandingSlope,
            LandingStage::Flare => Place::LandingFlare,
            LandingStage::Decrab => Place::LandingDecrab,
            LandingStage::Touchdown => Place::LandingTouchdown,
        },
        PlaneMemory::Taxiing(mode) => match mode.stage() {
            TaxiingStage::Stop => Place::TaxiingStop,
            TaxiingStage::TurnOff => Place::TaxiingTurnOff,
            TaxiingStage::Park => Place::TaxiingPark,
            TaxiingStage::Return => Place::TaxiingReturn,
            TaxiingStage::LineUp => Place::TaxiingLineUp,
        },
    }
}
