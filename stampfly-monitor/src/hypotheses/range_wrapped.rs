//! The vehicle is higher than the estimate, by the barometer and since it stood.
//!
//! A range that wraps below the height of a leg says for the whole of a take-off that the vehicle has
//! hardly left the floor, and the controller pushes until it flies seven metres higher.
//! The barometer shows it late, because propellers
//! that start change the pressure, and the more the nearer the floor is: by up to 0.6 m, in either
//! direction. So does a door, by 1.5 m within a second. What tells a climb from a door is that it is
//! felt: of the climb rate that the estimate does not have, the accelerometer has gained a share.
//! Vibration takes the rest, and more than all of it from a vehicle that shakes hard. What neither
//! propellers nor doors make is believed without it.
//!
//! For ten seconds after the take-off, because weather changes the pressure as well. Not for a vehicle
//! that is lower than the estimate.

use crate::config::MonitorConfig;
use crate::evidence::Evidence;
use crate::hypothesis::{Hypothesis, Opinion, Sensor};
use stampfly_types::messages::Finding;

/// For so long after the vehicle stood, s.
const LASTS: f32 = 10.0;
/// How much higher, m: what propellers do to the pressure, and half a metre for gusts and noise;
/// and what a door does besides.
const ABOVE: f32 = 0.6 + 0.5;
const DOOR: f32 = 1.5;
/// A climb is felt when the accelerometer has gained this share of it, over this time, s. Recorded
/// StampFlys lose 1.1 m/s² to vibration; a take-off that is given a fifth more thrust than its
/// weight has 2.
const FELT: f32 = 1.0 / 3.0;
const GAINS: f32 = 2.0;
/// A slower climb than this, m/s, is not told from what readings of the barometer are noisy by.
const CLIMBS: f32 = 0.5;
/// Time constant with which the place where the vehicle stands is followed, s. Propellers that start
/// do it before the vehicle rises, and what they do then has to count.
const STANDS: f32 = 2.0;
/// Time constant of the tracker, s: a reading is noisy by 0.1 m, and what climbs with full thrust
/// gains 1 m/s in it.
const TRACKS: f32 = 0.2;
/// Time between two readings counts as this long at least, s.
const SHORTEST: f32 = 0.005;
/// No climb makes so much between two readings, m: the pressure has stepped, and says nothing until
/// the vehicle stands again.
const STEP: f32 = 0.35;

/// See the head of this file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RangeWrapped {
    /// How long ago the vehicle stood, s; `None` for one that has not stood.
    time: Option<f32>,
    /// How far the altitude has risen above where the vehicle stood, m.
    risen: f32,
    /// The same tracked, m, and how fast it rises, m/s.
    tracked: f32,
    climb: f32,
    /// By how much more than the estimated height, m.
    above: f32,
    /// Bias of the upward acceleration where the vehicle stood, m/s², and the speed upwards that
    /// was felt lately with it, m/s.
    bias: f32,
    gained: f32,
    /// The estimated climb rate, m/s.
    believed: f32,
}

impl Hypothesis for RangeWrapped {
    const SENSOR: Sensor = Sensor::Range;
    const FINDING: Finding = Finding::Disagrees;

    fn step(&mut self, config: &MonitorConfig, seen: &Evidence<'_>) -> Opinion {
        if seen.stands {
            self.bias = -seen.estimate.accel_bias.z;
        }
        if let Some(block) = &seen.block {
            self.felt(block.change, -seen.estimate.velocity.z, block.dt);
        }
        let Some(altitude) = &seen.altitude else { return Opinion::Unknown };
        if altitude.stuck {
            *self = Self { bias: self.bias, ..Self::default() };
        } else if seen.stands {
            self.stand(altitude.change, altitude.dt);
        } else if seen.trusts_range {
            self.baro(altitude.change, seen.estimate.height - config.ground_clearance_m, altitude.dt);
        } else {
            // Found, or without a range to compare: until it stands again.
            *self = Self { bias: self.bias, ..Self::default() };
        }
        match self.is_above().filter(|_| seen.trusts_range && !seen.stands) {
            Some((higher, climb)) => Opinion::Holds(Some(seen.climbs(higher, climb))),
            None => Opinion::Unknown,
        }
    }
}

impl RangeWrapped {
    /// The upward velocity has changed by this much within `dt` seconds, no bias removed; the
    /// estimated climb rate.
    fn felt(&mut self, change: f32, climb: f32, dt: f32) {
        self.gained += change - (self.bias + self.gained * (1.0 / GAINS)) * dt;
        self.believed = climb;
    }

    /// The altitude of a vehicle that stands has changed by this much within `dt` seconds.
    fn stand(&mut self, change: f32, dt: f32) {
        if change > STEP {
            *self = Self { bias: self.bias, ..Self::default() };
            return;
        }
        let risen = (self.risen + change) * (STANDS / (STANDS + dt));
        *self = Self { time: Some(0.0), risen, tracked: risen, bias: self.bias, ..Self::default() };
    }

    /// The altitude has changed by this much within `dt` seconds; the estimate is so high above where
    /// the vehicle stood.
    fn baro(&mut self, change: f32, height: f32, dt: f32) {
        let Some(time) = &mut self.time else { return };
        *time += dt;
        if *time > LASTS || change > STEP {
            *self = Self { bias: self.bias, ..Self::default() };
            return;
        }
        self.risen += change;
        // Both poles at one place, so that what climbs faster and faster is not followed too late.
        let pole = TRACKS / (TRACKS + dt);
        self.tracked += self.climb * dt;
        let off = self.risen - self.tracked;
        self.tracked += (1.0 - pole * pole) * off;
        self.climb += (1.0 - pole) * (1.0 - pole) * off / dt.max(SHORTEST);
        self.above = self.tracked - height;
    }

    /// If the vehicle is too much higher than the estimate: by how much at least, m, and how fast it
    /// climbs, m/s.
    fn is_above(&self) -> Option<(f32, f32)> {
        let unknown = self.climb - self.believed;
        let felt = unknown > CLIMBS && self.gained - self.believed > FELT * unknown;
        let limit = if felt { ABOVE } else { ABOVE + DOOR };
        (self.above > limit).then_some((self.above, self.climb))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_types::math;

    const DT: f32 = 0.04;

    /// Altitude and height as functions of the time since the take-off, s, and the acceleration
    /// that is felt, m/s². When is the vehicle found to be too high?
    fn found_feeling(
        altitude: impl Fn(f32) -> f32,
        height: impl Fn(f32) -> f32,
        acceleration: impl Fn(f32) -> f32,
    ) -> Option<f32> {
        let mut rise = RangeWrapped { bias: 0.2, ..Default::default() };
        rise.stand(0.0, DT);
        (1..500u16).map(|n| f32::from(n) * DT).find(|now| {
            let believed = (height(*now) - height(now - DT)) / DT;
            rise.felt((acceleration(*now) + 0.2) * DT, believed, DT);
            rise.baro(altitude(*now) - altitude(now - DT), height(*now), DT);
            rise.is_above().is_some()
        })
    }

    /// The same of one that feels what vibration leaves of a hover.
    fn found(altitude: impl Fn(f32) -> f32, height: impl Fn(f32) -> f32) -> Option<f32> {
        found_feeling(altitude, height, |_| -1.1)
    }

    /// Propellers that start, and the floor below them.
    fn wash(height: f32) -> f32 {
        -0.2 - 0.4 * (1.0 - height / 0.5).clamp(0.0, 1.0)
    }

    #[test]
    fn a_vehicle_that_climbs_while_the_filter_believes_it_stands_is_found() {
        // Two metres a second faster every second, of which vibration takes half.
        let climbs = |now: f32| now * now;
        let altitude = |now: f32| climbs(now) + wash(climbs(now));
        let when = found_feeling(altitude, |_| 0.02, |_| 0.9).expect("found");
        assert!(climbs(when) < 1.8, "{} m", climbs(when));
        let when = found_feeling(altitude, |_| 0.02, |_| -1.0).expect("found, though it shakes so hard");
        assert!(climbs(when) < 3.4, "{} m", climbs(when));
    }

    #[test]
    fn neither_doors_nor_propellers_that_suck_are_a_rise() {
        let climbs = |now: f32| (0.4 * now).min(0.8);
        for begins in [0.0, 0.5, 2.0, 5.0] {
            let door = |now: f32| 1.5 * ((now - begins) / 0.8).clamp(0.0, 1.0);
            assert_eq!(found(|now| climbs(now) + 0.6 + door(now), climbs), None, "after {begins} s");
            let calm = |now: f32| if now < 0.3 { 1.3 } else { 0.0 };
            assert_eq!(found_feeling(|now| climbs(now) + door(now), climbs, calm), None, "after {begins} s, calm");
        }
        let fan = |now: f32| 0.7 * (math::sin(2.1 * now) + 0.5 * math::sin(5.3 * now));
        assert_eq!(found(|now| climbs(now) + fan(now), climbs), None);
    }

    #[test]
    fn what_propellers_and_the_floor_do_to_the_pressure_is_no_rise() {
        let climbs = |now: f32| (0.4 * now).min(0.8);
        let starts = |now: f32| if now > 0.0 { climbs(now) + wash(climbs(now)) } else { 0.0 };
        assert_eq!(found(starts, climbs), None, "though they start within a reading");
        assert_eq!(found(|now| if now > 1.0 { 2.0 } else { 0.0 }, |_| 0.0), None, "nor a step");
        let mut stepped = RangeWrapped::default();
        stepped.stand(0.0, DT);
        // Propellers have started within the same reading.
        stepped.stand(2.4, DT);
        (0..20).for_each(|_| stepped.baro(0.05, 0.0, DT));
        assert_eq!(stepped.is_above(), None, "nor one on the ground");
        assert_eq!(found(|_| 0.0, |now| 0.4 * now), None, "nor one that is lower");
    }

    #[test]
    fn propellers_that_start_while_it_stands_are_no_rise_when_it_leaves_the_ground() {
        let mut rise = RangeWrapped::default();
        rise.stand(-0.6, DT);
        (0..3).for_each(|_| rise.stand(0.0, DT));
        let climbs = |n: u16| (0.02 * f32::from(n)).min(0.5);
        for n in 1..100 {
            let change = [n, n - 1].map(|n| climbs(n) + 0.8 * climbs(n));
            rise.baro(change[0] - change[1], climbs(n), DT);
            assert_eq!(rise.is_above(), None, "reading {n}");
        }
    }

    #[test]
    fn what_begins_later_is_left_to_others() {
        assert_eq!(found(|now| 0.3 * (now - LASTS).max(0.0), |_| 0.0), None);
        let mut rise = RangeWrapped::default();
        (0..20).for_each(|_| rise.baro(0.2, 0.0, DT));
        assert_eq!(rise.is_above(), None, "it has not stood");
    }
}
