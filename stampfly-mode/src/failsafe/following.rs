//! Does the vehicle turn as its controller wants it to?
//!
//! A multirotor in the air answers a demanded rate within some lags of its motors, whatever the air
//! does. One that lies against the floor, or has lost a rotor, does not, however long it is asked.
//! That is the one thing which tells a vehicle that can still be flown from one that cannot, and
//! needs no height, no velocity and no attitude.
//!
//! Use it where the controller says which rate it wants. Step it while the motors turn, and not
//! while they stand: what has no thrust follows nothing, and may be given thrust again. A vehicle
//! on its feet does not turn either, so the demand has to be larger than any that one on a slope
//! makes. Not about yaw: the torque about it is a tenth of the others.

use crate::lasting::lasts;
use stampfly_types::math::{larger, smaller, sqrt};
use stampfly_types::{Duration, Instant, Vec3};

/// Time constant of the mean error, s: a stick that swings to and fro faster than the vehicle can
/// asks for nothing in the mean.
const MEAN: f32 = 0.1;
/// A step that is longer counts as this long, s.
const LONGEST_STEP: f32 = 0.02;

/// When a vehicle does not follow. Values of an airframe.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FollowingConfig {
    /// Mean rate about roll and pitch that is missing, rad/s: more than is asked of a vehicle which
    /// stands on the steepest slope that it takes off from.
    pub missing: f32,
    /// And share of the rate that is wanted: a sound vehicle may be slower than its demand.
    pub share: f32,
    /// For how long, beyond the time that a full turn of the demand takes.
    pub time: Duration,
}

/// What is remembered of demand and rate.
///
/// ```
/// use stampfly_mode::failsafe::{Following, FollowingConfig};
/// use stampfly_types::{Duration, Instant, Vec3};
/// let config = FollowingConfig { missing: 1.5, share: 0.5, time: Duration::from_millis(200) };
/// let (mut following, wanted) = (Following::default(), Vec3::new(4.0, 0.0, 0.0));
/// // It lies on its side, and its controller wants it upright.
/// let lost = (1..=200).find(|step| following.step(Instant::from_micros(2_500 * step), &config, &wanted, &Vec3::zeros()));
/// assert!(lost.is_some_and(|step| step < 120), "within 0.3 s");
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Following {
    last: Option<Instant>,
    /// Means about roll and pitch, rad/s: of what is missing, and of what is wanted.
    missing: [f32; 2],
    wanted: [f32; 2],
    since: Option<Instant>,
}

impl Following {
    /// Takes the rate that is wanted and the one that is measured, body FRD, rad/s. Does it not
    /// follow? A number that is none is not looked at.
    pub fn step(&mut self, now: Instant, config: &FollowingConfig, wanted: &Vec3, rate: &Vec3) -> bool {
        let dt = self.last.replace(now).map_or(0.0, |last| smaller(now.since(last).seconds(), LONGEST_STEP));
        let weight = dt / (MEAN + dt);
        let sides = [(wanted.x, rate.x), (wanted.y, rate.y)];
        if sides.iter().all(|(wanted, rate)| (wanted - rate).is_finite()) {
            for ((missing, mean), (wanted, rate)) in self.missing.iter_mut().zip(&mut self.wanted).zip(sides) {
                *missing += (wanted - rate - *missing) * weight;
                *mean += (wanted - *mean) * weight;
            }
        }
        let limit = larger(config.missing, config.share * norm(&self.wanted));
        lasts(&mut self.since, now, norm(&self.missing) > limit, config.time)
    }

    /// The motors stand.
    pub fn rest(&mut self) {
        *self = Self::default();
    }
}

fn norm([roll, pitch]: &[f32; 2]) -> f32 {
    sqrt(roll * roll + pitch * pitch)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame of a palm's size, whose rates follow within 20 ms, and one of 220 mm, within 60 ms.
    const AIRFRAMES: [(f32, FollowingConfig); 2] = [
        (0.02, FollowingConfig { missing: 2.0, share: 0.5, time: Duration::from_millis(150) }),
        (0.06, FollowingConfig { missing: 1.5, share: 0.5, time: Duration::from_millis(200) }),
    ];
    const PERIOD: f32 = 0.0025;

    /// After how many seconds does this demand, to which the vehicle answers with a lag, count as
    /// not followed?
    fn lost(lag: f32, config: &FollowingConfig, seconds: f32, mut demand: impl FnMut(f32) -> [f32; 3]) -> Option<f32> {
        let (mut following, mut rate) = (Following::default(), Vec3::zeros());
        (1..=(seconds / PERIOD) as u32).map(|step| step as f32 * PERIOD).find(|time| {
            let wanted = Vec3::from(demand(*time));
            rate += (wanted - rate) * (PERIOD / (lag + PERIOD));
            following.step(Instant::from_micros((*time * 1e6) as u64), config, &wanted, &rate)
        })
    }

    #[test]
    fn full_sticks_to_and_fro_are_followed_however_fast_they_swing() {
        for (lag, config) in AIRFRAMES {
            for half in [0.02, 0.05, 0.1, 0.2, 0.4, 1.0] {
                let swings = |time: f32| {
                    let side = if ((time / half) as u32).is_multiple_of(2) { 12.0 } else { -12.0 };
                    [side, -side, 0.0]
                };
                assert_eq!(lost(lag, &config, 10.0, swings), None, "{lag} s, {half} s");
            }
        }
    }

    #[test]
    fn a_vehicle_that_lies_on_its_side_does_not_follow() {
        for (_, config) in AIRFRAMES {
            let never = f32::INFINITY;
            let after = lost(never, &config, 2.0, |_| [3.0, 2.0, 0.0]).expect("noticed");
            assert!(after < 0.35, "{after} s");
            assert_eq!(lost(never, &config, 5.0, |_| [0.8, -0.8, 0.0]), None, "on a slope");
            assert_eq!(lost(never, &config, 5.0, |_| [0.0, 0.0, 9.0]), None, "about yaw");
        }
    }

    /// Motors that stand follow nothing, and are asked anew when they turn again.
    #[test]
    fn what_was_missing_before_a_rest_does_not_count_after_it() {
        let (_, config) = AIRFRAMES[1];
        let (mut following, mut millis) = (Following::default(), 0);
        let mut asked = |following: &mut Following| {
            (0..2_000).find(|_| {
                millis += 1;
                following.step(Instant::from_millis(millis), &config, &Vec3::new(4.0, 0.0, 0.0), &Vec3::zeros())
            })
        };
        let (first, on) = (asked(&mut following), asked(&mut following));
        assert!(first > Some(200) && on == Some(0), "{first:?}, {on:?}");
        following.rest();
        assert_eq!(asked(&mut following), first);
    }

    #[test]
    fn a_spin_that_nothing_stops_is_not_followed_and_numbers_that_are_none_say_nothing() {
        let (_, config) = AIRFRAMES[1];
        let mut following = Following::default();
        let mut step = |millis: u64, rate: f32| {
            following.step(Instant::from_millis(millis), &config, &Vec3::zeros(), &Vec3::new(0.0, rate, 0.0))
        };
        assert!(!(0..200).any(|millis| step(millis, f32::NAN)));
        assert!((200..500).any(|millis| step(millis, 8.0)));
        assert!(!(500..900).map(|millis| step(millis, 0.0)).last().unwrap_or(true), "it follows again");
    }
}
