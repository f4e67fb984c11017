//! The watch: what is wrong, as long as it is. What follows is the path manager's decision.
//!
//! | trouble | what the aircraft does |
//! |---|---|
//! | the link is silent for `limits.link_lost` | comes home and circles, and after `limits.link_land` lands, also when the link is back, unless somebody wants something else; armed and standing, it disarms |
//! | outside of the fence | comes home and lands in the same way |
//! | no position, ten seconds after the last fix | circles at its height, with the wind, and goes round if it lands; does not arm; after `limits.blind`, or when it has to land, comes down where it is, against the wind |
//! | airspeed not to be believed | flies by the velocity less the last wind; a take-off whose tube shows less than half of the speed over the ground is given up, and it parks |
//! | battery at its warning level for five seconds | lands |
//! | height not known: five seconds 30 m from barometer and receiver | as attitude not known |
//! | it has crashed | stops the propeller, and does not arm until it was disarmed by command |
//! | attitude not known | closes the throttle within 35 ms and glides in a wide turn, for good; disarmed by command, a second later if there is none again, or after two minutes |

use crate::Config;
use crate::crash::{Crash, CrashInput};
use crate::heights::{Height, Heights};
use crate::messages::{AirState, Place, Safety, Troubles};
use stampfly_types::messages::{PowerData, StateEstimate, Validity};
use stampfly_types::text::is_finite;
use stampfly_types::{Duration, Instant};

/// A battery that was under its level for so long is, s: a climb's load is not it.
const SAGGED: f32 = 5.0;

/// What it looks at.
#[derive(Clone, Copy, Debug)]
pub struct Watched<'a> {
    /// The estimate; `None` when it is old. One with a number that is none is as good as none.
    pub estimate: Option<&'a StateEstimate>,
    /// The air.
    pub air: &'a AirState,
    /// The battery, if it is measured.
    pub power: Option<&'a PowerData>,
    /// When somebody was last heard.
    pub heard: Option<Instant>,
    /// Heights above home that barometer and receiver have shown last, as
    /// [`MeasuredHeights`](crate::messages::MeasuredHeights) has them.
    pub heights: [Height; 2],
    /// What it does, and may its propeller turn?
    pub place: Place,
    /// See `place`.
    pub armed: bool,
    /// Who sees every inertial sample has seen a blow.
    pub blow: bool,
    /// The limits.
    pub config: &'a Config,
}

/// The watch.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Watch {
    /// Since when the position is not known.
    lost: Option<Instant>,
    /// For how long the battery has been low, s.
    sagged: f32,
    last: Option<Instant>,
    crash: Crash,
    heights: Heights,
}

impl Watch {
    /// Looks.
    pub fn step(&mut self, now: Instant, watched: &Watched<'_>) -> Safety {
        let Watched { estimate, air, power, heard, heights, place, armed, blow, config: p } = *watched;
        let dt = self.last.map_or(0.0, |last| now.since(last).seconds());
        self.last = Some(now);
        let estimate = estimate.filter(|estimate| is_finite(*estimate));
        let valid = estimate.map_or(Validity::NONE, |estimate| estimate.valid);
        let position = estimate.filter(|_| valid.contains(Validity::POSITION_XY | Validity::HEADING));
        self.lost = if position.is_some() { None } else { self.lost.or(Some(now)) };
        let low = power.is_some_and(|power| power.voltage < p.limits.battery);
        self.sagged = if low { self.sagged + dt } else { 0.0 };
        let silence = heard.map_or(Duration::ZERO, |at| now.since(at)).seconds();
        let is_outside = position.is_some_and(|estimate| {
            let away = estimate.position.horizontal().norm();
            away > p.limits.fence_radius || -estimate.position.z > p.limits.fence_height
        });
        let stall = p.speed.stall;
        let crashed = self.crash.step(now, &CrashInput { estimate, air, power, place, stall, armed, blow }, &p.crash);
        let [barometer, receiver] = heights;
        let runs_away =
            estimate.is_some_and(|estimate| self.heights.step(now, -estimate.position.z, barometer, receiver));
        let troubles = [
            (Troubles::LINK, silence > p.limits.link_lost),
            (Troubles::FENCE, is_outside),
            (Troubles::POSITION, position.is_none()),
            (Troubles::AIRSPEED, !air.measured),
            (Troubles::BATTERY, self.sagged > SAGGED),
            (Troubles::ATTITUDE, !valid.contains(Validity::TILT)),
            (Troubles::CRASH, crashed),
            (Troubles::HEIGHT, runs_away),
        ];
        Safety {
            troubles: troubles.iter().fold(Troubles::NONE, |all, (trouble, holds)| all.set(*trouble, *holds)),
            link: (silence - p.limits.link_lost).max(0.0),
            position: self.lost.map_or(0.0, |since| now.since(since).seconds()),
        }
    }
}
