//! The vehicle has risen above the estimate since it stood, by the barometer.
//!
//! A range that wraps below the height of a leg reports during the whole take-off that the vehicle
//! has hardly left the floor, and the controller raises the thrust until it flies seven metres
//! higher. The barometer shows that late, because starting propellers change the pressure by up to
//! 0.6 m in either direction, most near the floor, and a door by 1.5 m within a second. A climb
//! differs from a door in that the accelerometer measures it: it has gained a share of the climb
//! rate that the estimate lacks. Vibration hides the rest, and all of it on a vehicle that vibrates
//! strongly. A rise beyond the effect of propellers and doors is reported without that condition.
//!
//! Active for ten seconds after the take-off, because the weather changes the pressure, too. Not
//! for a vehicle that is lower than the estimate.

use crate::config::MonitorConfig;
use crate::evidence::Evidence;
use crate::hypothesis::{Hypothesis, Opinion, Sensor};
use stampfly_types::messages::Finding;

/// Time after the take-off for which it is active, s.
const LASTS: f32 = 10.0;
/// Smallest rise above the estimate, m: the effect of propellers on the pressure plus half a metre
/// for gusts and noise; and the addition for a door.
const ABOVE: f32 = 0.6 + 0.5;
const DOOR: f32 = 1.5;
/// A climb counts as measured if the accelerometer has gained the share `FELT` of it over `GAINS`
/// seconds. Recorded StampFlys lose 1.1 m/s² to vibration; a take-off with a thrust one fifth above
/// the weight has 2.
const FELT: f32 = 1.0 / 3.0;
const GAINS: f32 = 2.0;
/// Smallest climb rate that is distinguished from barometer noise, m/s.
const CLIMBS: f32 = 0.5;
/// Time constant of the altitude of the place where the vehicle stands, s. Slow, because the
/// pressure change of propellers that start before the take-off must count.
const STANDS: f32 = 2.0;
/// Time constant of the tracker, s. A reading has 0.1 m of noise; a climb with full thrust gains 1
/// m/s in this time.
const TRACKS: f32 = 0.2;
/// Lower bound on the interval between readings, s.
const SHORTEST: f32 = 0.005;
/// Largest change of altitude between two readings of a climb, m. A larger one is a step of the
/// pressure, after which the barometer is not used until the vehicle stands again.
const STEP: f32 = 0.35;

/// Tests whether the vehicle has risen higher since it stood than the ranges show. Details are at
/// the head of the file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RangeWrapped {
    /// Time since the vehicle stood, s; `None` if it has not stood.
    time: Option<f32>,
    /// Rise of the altitude above the place where the vehicle stood, m.
    risen: f32,
    /// The same after the tracker, m, and its rate, m/s.
    tracked: f32,
    climb: f32,
    /// Excess over the estimated height, m.
    above: f32,
    /// Bias of the upward acceleration on the ground, m/s², and recent gain of upward velocity with
    /// it, m/s.
    bias: f32,
    gained: f32,
    /// Estimated climb rate, m/s.
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
            // Already found, or no range to compare with: wait until the vehicle stands again.
            *self = Self { bias: self.bias, ..Self::default() };
        }
        match self.is_above().filter(|_| seen.trusts_range && !seen.stands) {
            Some((higher, climb)) => Opinion::Holds(Some(seen.climbs(higher, climb))),
            None => Opinion::Unknown,
        }
    }
}

impl RangeWrapped {
    /// Takes the change of the upward velocity within `dt` seconds, bias included, and the
    /// estimated climb rate, m/s.
    fn felt(&mut self, change: f32, climb: f32, dt: f32) {
        // A leaky integral: errors of the bias do not accumulate beyond `GAINS` seconds.
        self.gained += change - (self.bias + self.gained * (1.0 / GAINS)) * dt;
        self.believed = climb;
    }

    /// Takes the change of the altitude of a standing vehicle, m, within `dt` seconds.
    fn stand(&mut self, change: f32, dt: f32) {
        if change > STEP {
            *self = Self { bias: self.bias, ..Self::default() };
            return;
        }
        let risen = (self.risen + change) * (STANDS / (STANDS + dt));
        *self = Self { time: Some(0.0), risen, tracked: risen, bias: self.bias, ..Self::default() };
    }

    /// Takes the change of the altitude in flight, m, within `dt` seconds, and the estimated height
    /// above the place where the vehicle stood, m.
    fn baro(&mut self, change: f32, height: f32, dt: f32) {
        let Some(time) = &mut self.time else { return };
        *time += dt;
        if *time > LASTS || change > STEP {
            *self = Self { bias: self.bias, ..Self::default() };
            return;
        }
        self.risen += change;
        // Two equal poles, so that an accelerating climb is followed without much lag.
        let pole = TRACKS / (TRACKS + dt);
        self.tracked += self.climb * dt;
        let off = self.risen - self.tracked;
        self.tracked += (1.0 - pole * pole) * off;
        self.climb += (1.0 - pole) * (1.0 - pole) * off / dt.max(SHORTEST);
        self.above = self.tracked - height;
    }

    /// If the vehicle is too far above the estimate: the difference, m, and the climb rate, m/s.
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

    /// Time at which the finding is made; altitude, height, m, and measured acceleration, m/s², are
    /// functions of the time since the take-off, s.
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

    /// The same with the acceleration that vibration leaves of a hover.
    fn found(altitude: impl Fn(f32) -> f32, height: impl Fn(f32) -> f32) -> Option<f32> {
        found_feeling(altitude, height, |_| -1.1)
    }

    /// Effect of starting propellers and of the floor on the altitude, m.
    fn wash(height: f32) -> f32 {
        -0.2 - 0.4 * (1.0 - height / 0.5).clamp(0.0, 1.0)
    }

    #[test]
    fn a_vehicle_that_climbs_while_the_filter_believes_it_stands_is_found() {
        // A climb with 2 m/s², of which vibration hides half.
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
