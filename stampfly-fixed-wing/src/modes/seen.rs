//! What every stage is told, and what it demands.

use crate::Config;
use stampfly_control::fixed_wing::runway::Runway;
use stampfly_control::fixed_wing::{Demand, Track, WayPoints};
use stampfly_mode::stage::Vehicle;
use stampfly_types::Origin;

/// Way-points that fit, as in ZeroPilot's path manager.
pub const CAPACITY: usize = 100;

/// What somebody wants of the aircraft.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Order {
    /// To stand.
    #[default]
    Stand,
    /// To fly.
    Fly,
    /// To come down.
    Land,
    /// To come down where it is: nobody has known for too long where that is.
    Down,
}

/// What every stage is told.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a> {
    /// Speeds, heights and so on.
    pub config: &'a Config,
    /// Where the local frame begins.
    pub origin: Origin,
    /// The strip, as soon as it is known.
    pub runway: Option<Runway>,
    /// Where to fly.
    pub way_points: &'a WayPoints<CAPACITY>,
    /// What is wanted.
    pub order: Order,
    /// The middle of an orbit to hold in, instead of the way-points.
    pub hold: Option<[f32; 2]>,
    /// m north and east of home; `None` while nobody knows.
    pub position: Option<[f32; 2]>,
    /// m above home.
    pub height: f32,
    /// True airspeed, m/s.
    pub airspeed: f32,
    /// Does a pitot tube show it?
    pub is_measured: bool,
    /// Of the air, m/s north and east.
    pub wind: [f32; 2],
    /// Speed over the ground, m/s.
    pub ground_speed: f32,
    /// Direction over the ground, rad; of the nose while it hardly moves.
    pub course: f32,
    /// Direction of the nose, rad.
    pub heading: f32,
    /// Do the wheels carry it, as far as it can tell?
    pub on_ground: bool,
}

impl Seen<'_> {
    /// Along a line, with the largest bank.
    #[must_use]
    pub fn along(&self, through: [f32; 2], course: f32) -> Demand {
        Demand::track(Track::Line { through, course }, self.config.path.bank_max)
    }
}

/// The aircraft, for stages.
pub struct Aircraft;

impl Vehicle for Aircraft {
    type Input<'a> = Seen<'a>;
    type Output = Demand;
}
