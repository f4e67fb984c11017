//! Cruising: one stage. Along the way-points, or in an orbit: where somebody wants it to hold, at home, and behind the last way-point.

use super::seen::{Aircraft, Order, Seen};
use crate::messages::{Demand, Lateral, Vertical};
use stampfly_control::fixed_wing::runway::SLOPE;
use stampfly_control::fixed_wing::{Follower, Track};
use stampfly_mode::stage::{Instant, Limit, Mode, Stage, Step};
use stampfly_types::math;

/// Below this height it comes down against the wind and no longer in a circle, m: half a turn is over long before the ground.
const AGAINST_WIND: f32 = 25.0;

/// Along the way-points.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Cruising;

/// How a cruise ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CruisingEnd {
    /// Somebody wants it down.
    Called,
    /// It is down, somewhere.
    Down,
}

impl Mode for Cruising {
    type Vehicle = Aircraft;
    type Stage = CruisingStage;
    type End = CruisingEnd;
    const FIRST: CruisingStage = CruisingStage::Cruise;

    fn enter(_: Instant, _: &Seen<'_>) -> Self {
        Self
    }
}

stampfly_mode::stages! {
    /// The stage.
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    pub enum CruisingStage for Cruising {
        /// There is only one.
        Cruise: Cruise,
    }
    /// The same, with what it remembers.
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    pub enum CruisingMemory;
}

/// From way-point to way-point.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Cruise {
    follower: Follower,
    /// Where it holds when nothing else is to be done, and at which height.
    place: Option<[f32; 2]>,
    height: f32,
}

impl Cruise {
    /// What it flies to: number, how many are ahead.
    #[must_use]
    pub fn ahead(&self, seen: &Seen<'_>) -> (u32, usize) {
        let remaining = self.follower.remaining(seen.way_points);
        let list = seen.way_points.list();
        (list.len().checked_sub(remaining).and_then(|place| list.get(place)).map_or(0, |point| point.id), remaining)
    }
}

impl Stage<Cruising> for Cruise {
    fn enter(_: &mut Cruising, _: Instant, seen: &Seen<'_>) -> Self {
        Self { follower: Follower::default(), place: None, height: seen.height }
    }

    fn limit(&self, _: &Cruising) -> Limit<Cruising> {
        Limit::Unlimited("a cruise lasts until somebody wants it down")
    }

    fn execute(&mut self, _: &mut Cruising, _: Instant, seen: &Seen<'_>) -> Step<Cruising> {
        let p = seen.config;
        let Some(here) = seen.position else {
            if seen.order == Order::Down {
                return come_down(seen);
            }
            // It circles with the wind until somebody knows again where it is, and can neither cruise nor land meanwhile.
            let circle = Demand {
                lateral: Lateral::Bank,
                bank: p.path.bank_lost,
                bank_max: p.path.bank_max,
                ..Default::default()
            };
            return Step::Stay(circle.at(self.height, 0.0).fast(p.speed.cruise));
        };
        if seen.order != Order::Fly {
            return Step::End(CruisingEnd::Called);
        }
        let radius = p.path.radius;
        let followed =
            if seen.hold.is_none() { self.follower.follow(seen.way_points, here, seen.course, radius) } else { None };
        let track = match followed {
            Some(followed) => {
                (self.place, self.height) = (Some(followed.way_point.place), followed.way_point.height);
                followed.track
            }
            None => {
                let centre = seen.hold.unwrap_or(*self.place.get_or_insert(here));
                Track::Orbit { centre, radius, clockwise: true }
            }
        };
        Step::Stay(Demand::track(track, p.path.bank_max).at(self.height, 0.0).fast(p.speed.cruise))
    }
}

/// Down without knowing where it is: in a circle, the last metres straight against the last wind, as a landing does them. Fields are taken to be flat.
fn come_down(seen: &Seen<'_>) -> Step<Cruising> {
    let p = seen.config;
    // No wing carries it so slowly; and where nobody knows how slow it is, it has not sunk for a while.
    if seen.airspeed < 0.7 * p.speed.stall || seen.on_ground && !seen.is_measured {
        return Step::End(CruisingEnd::Down);
    }
    let height = seen.height - seen.runway.map_or(0.0, |strip| strip.height);
    let [north, east] = seen.wind;
    let sink = p.flare.sink + height.max(0.0) / p.flare.time;
    let climb = -sink.min(seen.ground_speed.max(p.speed.stall) * math::tan(SLOPE));
    let against = 0.8 * math::wrap_angle(math::atan2(-east, -north) - seen.heading);
    let most = p.path.bank_lost;
    // `clamp` panics when a limit is no number.
    let bank = if height > AGAINST_WIND { most } else { math::larger(math::smaller(against, most), -most) };
    let down = Demand { bank, bank_max: p.path.bank_max, vertical: Vertical::Climb, climb, ..Demand::default() };
    if height < p.height.flare {
        // The throttle is closed, and a wing must not touch first.
        return Step::Stay(Demand { bank: bank.clamp(-0.05, 0.05), on_ground: seen.on_ground, ..down });
    }
    Step::Stay(down.fast(p.speed.approach_share * p.speed.stall))
}
