//! An aeroplane: what its modes are told, what they demand, and which mode follows which.
//!
//! This file is the whole table. Each mode is a file of its own, names no other one, and was added from outside of the crate
//! that runs them. Speeds, heights and angles are those of the public path manager of ZeroPilot, branch `pathManRestructure`, where
//! no comment says otherwise; times are chosen, several times what a stage needs.

pub mod autopilot;
pub mod cruising;
pub mod geometry;
pub mod landing;
pub mod model;
pub mod path_manager;
pub mod take_off;
pub mod taxiing;

use core::convert::Infallible;
use cruising::{Cruising, CruisingEnd};
use geometry::{Point, Runway};
use landing::{Landing, LandingEnd};
use stampfly_mode::stage::{Active, HandOver, Instant, Mode, Vehicle};
use take_off::{TakeOff, TakeOffEnd};
use taxiing::{Taxiing, TaxiingEnd};

/// An aeroplane, seen from its modes.
pub struct Aeroplane;

impl Vehicle for Aeroplane {
    type Input<'a> = Seen<'a>;
    type Output = Demand;
}

/// What every mode is told: telemetry and the fused estimate.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a> {
    /// Where to start and where to stop.
    pub runway: &'a Runway,
    /// Way-points of the cruise.
    pub route: &'a [Point],
    /// The ground station wants it down.
    pub begin_landing: bool,
    /// The ground station lets it take off.
    pub cleared: bool,
    /// Where it is, m; `None` without a fix.
    pub position: Option<Point>,
    /// Altitude by the barometer, m.
    pub altitude: f32,
    /// Speed through the air, m/s.
    pub airspeed: f32,
    /// Direction of its motion over the ground, rad.
    pub track: f32,
    /// The wheels carry it.
    pub on_ground: bool,
}

/// What a mode demands. The autopilot makes bank, path angle and throttle of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Demand {
    pub course: Course,
    pub path: Path,
    pub thrust: Thrust,
    pub brake: bool,
}

/// Where to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Course {
    /// Along the line from one point through the other.
    Along(Point, Point),
    /// To a point.
    To(Point),
    /// The track over the ground, rad.
    Track(f32),
    /// Where the nose points, rad: with a wind, not where it flies.
    Heading(f32),
}

/// Up and down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Path {
    /// To an altitude, m, which changes by this angle, rad.
    Altitude(f32, f32),
    /// At this angle, rad.
    Angle(f32),
}

/// How fast.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Thrust {
    /// At this airspeed, m/s.
    Airspeed(f32),
    /// With this share of full throttle.
    Throttle(f32),
}

/// All that it does, one mode after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// Landings so far: what outlives the modes.
    pub landings: u32,
}

impl Mode for Plane {
    type Vehicle = Aeroplane;
    type Stage = PlaneMode;
    type End = Infallible;
    const FIRST: PlaneMode = PlaneMode::TakeOff;

    fn enter(_: Instant, _: &Seen<'_>) -> Self {
        Self { landings: 0 }
    }
}

stampfly_mode::stages! {
    /// The modes of an aeroplane.
    pub enum PlaneMode for Plane {
        TakeOff: Active<TakeOff>,
        Cruising: Active<Cruising>,
        Landing: Active<Landing>,
        Taxiing: Active<Taxiing>,
    }
    pub enum PlaneMemory;
}

impl HandOver<TakeOff> for Plane {
    fn after(&mut self, end: TakeOffEnd) -> PlaneMode {
        match end {
            TakeOffEnd::Climbed => PlaneMode::Cruising,
            TakeOffEnd::TooSlow => PlaneMode::Taxiing,
            TakeOffEnd::TooLow => PlaneMode::Landing,
        }
    }
}

impl HandOver<Cruising> for Plane {
    fn after(&mut self, end: CruisingEnd) -> PlaneMode {
        match end {
            CruisingEnd::Called => PlaneMode::Landing,
        }
    }
}

impl HandOver<Landing> for Plane {
    fn after(&mut self, end: LandingEnd) -> PlaneMode {
        match end {
            LandingEnd::Landed => {
                self.landings += 1;
                PlaneMode::Taxiing
            }
            LandingEnd::Missed => PlaneMode::TakeOff,
        }
    }
}

impl HandOver<Taxiing> for Plane {
    fn after(&mut self, end: TaxiingEnd) -> PlaneMode {
        match end {
            TaxiingEnd::Cleared => PlaneMode::TakeOff,
        }
    }
}
