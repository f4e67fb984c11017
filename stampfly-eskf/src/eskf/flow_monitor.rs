//! Does optical flow agree with what the accelerometer felt?
//!
//! Flow that lies is not rejected: it moves tilt, accelerometer bias and gyro bias until acceleration and flow agree
//! again. So the comparison undoes what flow did to the predicted acceleration over the last seconds: at once through
//! tilt and accelerometer bias, and second after second through the gyro bias, which goes on turning the tilt. What
//! remains of flow's velocity less the integral of that acceleration, over half a second, is what no motion explains: a
//! frozen reading while the vehicle accelerates, axes swapped or reversed, an offset that begins.
//!
//! The limit is the root of a sum of squares, one for each reason why honest readings differ:
//!
//! | term | reason |
//! |---|---|
//! | constant, and for each metre of distance | accelerometer and tilt; resolution of the picture |
//! | share of the picture's motion, and of the motion that the body's turning gives it | a reading holds one frame, two or none |
//! | standard deviation that was added to the tilt | the filter found its own tilt to be wrong, so the acceleration that is restored is wrong, too |
//!
//! A picture that stands still while the body turns says that the vehicle moves by turn times distance the opposite
//! way. A vehicle that is carried does so by millimetres.
//!
//! Not for an error of scale of some tens of per cent, nor for a constant offset that was there from the beginning: no
//! other sensor on board measures a constant velocity.

use stampfly_types::{GRAVITY, Vec3};

/// Time constant over which velocities are compared, s, and of the low-pass on their difference.
const OVER: f32 = 0.5;
const SMOOTH: f32 = 0.06;
/// Time constants with which flow's corrections of tilt and accelerometer bias are forgotten, s, and those of the gyro
/// bias. The latter act through the former, so they have to outlast them.
const FORGOTTEN: f32 = 2.0;
const BIAS_FORGOTTEN: f32 = 4.0;
/// Largest difference, m/s, and for each metre of distance. Over [`OVER`] 0.55 m/s are 1.1 m/s², as much as a tilt that
/// is wrong by 6.4°.
const DIFFERENCE: f32 = 0.55;
const PER_METRE: f32 = 0.15;
/// Share of the picture's motion. A PMW3901 takes 121 frames a second: of 100 readings every fifth holds two frames, and
/// one that is read early none. Such a single reading is wrong by all of the motion, of which [`SMOOTH`] lets a seventh
/// through, and a quarter of two that follow each other.
const SHARE: f32 = 0.25;
/// Largest difference for each radian that is added to the tilt's standard deviation, m/s: two deviations of the
/// velocity that gravity brings about over [`OVER`].
const PER_RADIAN: f32 = 2.0 * GRAVITY * OVER;
/// For how long, s.
const LASTS: f32 = 0.1;
/// Both velocities begin with the mean of so many readings: a single one may hold two frames, and what it is wrong by would
/// stay in every difference for [`OVER`].
const BEGINNING: u32 = 10;
/// Readings running that are equal and not zero: frozen. At 100 Hz 0.4 s.
const REPEATED: u32 = 40;
/// The picture cannot stand still while the body turns by this much, rad: three counts of a PMW3901. Nearer to the floor
/// than [`SHARP`], m, it may be blurred.
const TURNED: f32 = 0.007;
const SHARP: f32 = 0.15;
/// Nor if the vehicle would have to move by this much, m, to keep it still. Over a quarter of a second 5 mm are
/// 0.16 m/s², as much as a tilt that is wrong by 1°: the accelerometer contradicts no less.
const COMPENSATED: f32 = 0.005;
/// For so many readings running, at least.
const ZEROS: u32 = 20;
/// After a start in the air the filter first has to find tilt and biases, s. A gyro bias of 3°/s takes as long.
const UNKNOWN: f32 = 20.0;
/// A vehicle that turns over moves the picture faster than a PMW3901 follows, 7.4 rad/s. Its readings are wrong by metres a second
/// until it hardly turns any more, rad/s, for so long, s.
const FAST: f32 = 7.0;
const CALM: f32 = 1.0;
const SETTLES: f32 = 0.1;
/// To be believed again flow has to agree with a motion of this much, m/s, for this long, s.
const MOTION: f32 = 0.2;
const AGREES_FOR: f32 = 0.5;
/// Largest mean rate of the picture on a vehicle that stands, rad/s, over [`OVER`] and over the second time, s. The second is
/// for what begins while the motors spool up.
const STANDING_RATE: [f32; 2] = [0.6, 1.0];
const STANDING_SOON: f32 = 0.1;
/// Means of so many readings are compared with those two before: one of five holds two frames.
const BLOCK: u32 = 5;
/// Largest jump of such a mean, m/s, and for each metre of distance: 1 m/s² over 0.15 s, and the picture's noise.
const JUMP: f32 = 0.2;
const JUMP_PER_METRE: f32 = 0.5;
/// A jump convicts flow after this time, s: one of the gyro's zero looks the same, and is found and undone until then.
const JUMP_WAITS: f32 = 0.1;

/// What is remembered of flow and acceleration, horizontal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct FlowMonitor {
    /// Integral of the acceleration since the last reading, and over which time.
    change: [f32; 2],
    elapsed: f32,
    /// What flow added to the acceleration lately, and to the gyro bias.
    added: [f32; 2],
    gyro_bias: [f32; 2],
    /// Standard deviation that was added to the tilt lately.
    tilt: f32,
    /// Flow's and the accelerometer's velocity above their mean of the last half second.
    flow: [f32; 2],
    inertial: [f32; 2],
    last: Option<[f32; 2]>,
    /// Readings since the comparison began, and how far apart the velocities were in the first of them.
    readings: u32,
    apart: [f32; 2],
    /// The last two means of [`BLOCK`] differences, and the sum of the next.
    means: [[f32; 2]; 2],
    sum: [f32; 2],
    /// Time since a jump, s, while it is none of the gyro's.
    jumped: Option<f32>,
    difference: [f32; 2],
    differs: f32,
    agrees: f32,
    reading: [f32; 2],
    repeats: u32,
    /// Readings of nothing, and the largest turn of the body beside them.
    zeros: u32,
    turn: [f32; 2],
    turned: f32,
    standing: [[f32; 2]; 2],
    implausible: bool,
    /// How long it has to hold back, s.
    waits: f32,
    /// The same after a fast turn.
    settles: f32,
}

impl FlowMonitor {
    /// Of a filter that starts in the air, with errors of every kind.
    pub(super) fn airborne() -> Self {
        Self { waits: UNKNOWN, ..Self::default() }
    }

    /// The vehicle stands: what moves it from here on is felt.
    #[inline]
    pub(super) fn ready(&mut self) {
        self.waits = 0.0;
    }

    /// Is flow not to be believed?
    pub(super) fn is_implausible(&self) -> bool {
        self.implausible
    }

    /// Integrates the change of the velocity, world, in `dt`.
    #[inline]
    pub(super) fn predict(&mut self, change: &Vec3, dt: f32) {
        self.elapsed += dt;
        self.change[0] += change.x;
        self.change[1] += change.y;
    }

    /// Flow changed the predicted acceleration and the gyro bias by this much, world.
    pub(super) fn corrected(&mut self, acceleration: &Vec3, gyro_bias: &Vec3) {
        self.added[0] += acceleration.x;
        self.added[1] += acceleration.y;
        self.gyro_bias[0] += gyro_bias.x;
        self.gyro_bias[1] += gyro_bias.y;
    }

    /// The filter found its tilt to be wrong, and added this standard deviation, rad.
    pub(super) fn inflated(&mut self, tilt: f32) {
        self.tilt = tilt;
    }

    /// Takes the turning of the picture that the body makes, rad/s. Is it, or was it a moment ago, faster than the sensor follows? Then
    /// the reading says nothing.
    #[inline]
    pub(super) fn turns_fast(&mut self, turning: [f32; 2], interval: f32) -> bool {
        let [x, y] = turning;
        // Nothing but a fast turn begins it.
        let limit = if self.settles > 0.0 { CALM } else { FAST };
        let fast = x * x + y * y > limit * limit;
        self.settles = if fast { SETTLES } else { (self.settles - interval).max(0.0) };
        let unusable = self.settles > 0.0;
        if unusable {
            self.last = None;
            self.forget();
        }
        unusable
    }

    /// What was compared until now says nothing.
    pub(super) fn forget(&mut self) {
        (self.flow, self.inertial, self.difference) = Default::default();
        (self.differs, self.agrees) = (0.0, 0.0);
        (self.readings, self.apart, self.sum, self.means) = Default::default();
        // What has convicted stays: an offset agrees with every motion that follows, until the vehicle stands.
        self.jumped = self.jumped.filter(|time| *time > JUMP_WAITS);
    }

    /// Takes a reading of a standing vehicle: rate of the picture less the gyro's without its bias, rad/s.
    pub(super) fn stand(&mut self, rate: [f32; 2], dt: f32) {
        let mut standing = self.standing;
        let mut implausible = false;
        for ((mean, over), limit) in standing.iter_mut().zip([OVER, STANDING_SOON]).zip(STANDING_RATE) {
            let share = dt / (over + dt);
            *mean = core::array::from_fn(|axis| mean[axis] + (rate[axis] - mean[axis]) * share);
            let [x, y] = *mean;
            implausible |= x * x + y * y > limit * limit;
        }
        *self = Self { standing, implausible, ..Self::default() };
    }

    /// Square of the jump that a mean of [`BLOCK`] differences has made since the one two before, m²/s²; zero between blocks.
    fn jump(&mut self, begins: bool) -> f32 {
        if begins || !self.readings.is_multiple_of(BLOCK) {
            return 0.0;
        }
        let mean = core::mem::take(&mut self.sum);
        let [before, last] = self.means;
        self.means = [last, mean];
        let [x, y] = [mean[0] - before[0], mean[1] - before[1]];
        // Before the third block there is nothing to compare with.
        if self.readings < BEGINNING + 3 * BLOCK { 0.0 } else { x * x + y * y }
    }

    /// Takes a reading over `interval`: counts as they came, rad, what the body's own turning makes of the picture,
    /// rad/s, velocity, world, and the distance to the floor. `known` says that the distance is certain. True when it
    /// has just become implausible.
    pub(super) fn flow(
        &mut self,
        counts: [f32; 2],
        turning: [f32; 2],
        velocity: &Vec3,
        distance: f32,
        interval: f32,
        known: bool,
    ) -> bool {
        let velocity = [velocity.x, velocity.y];
        let change = core::mem::take(&mut self.change);
        let dt = core::mem::take(&mut self.elapsed);
        let Some(last) = self.last.replace(velocity).filter(|_| known && dt > 0.0 && interval > 0.0) else {
            // Where the distance jumps, the velocity does.
            self.forget();
            return false;
        };
        let fade = OVER / (OVER + dt);
        let forget = FORGOTTEN / (FORGOTTEN + dt);
        let smooth = dt / (SMOOTH + dt);
        let [x, y] = self.gyro_bias;
        // A tilt that is turned by w changes the acceleration by gravity times w, a quarter turn about the vertical on.
        // The bias is subtracted from the rate, so it turns the opposite way.
        self.added[0] += GRAVITY * y * dt;
        self.added[1] -= GRAVITY * x * dt;
        self.gyro_bias = self.gyro_bias.map(|bias| bias * (BIAS_FORGOTTEN / (BIAS_FORGOTTEN + dt)));
        self.tilt *= forget;
        let [mut difference, mut motion, mut picture] = [0.0; 3];
        let begins = self.readings < BEGINNING;
        self.readings = self.readings.wrapping_add(1);
        for axis in 0..2 {
            self.flow[axis] = (self.flow[axis] + velocity[axis] - last[axis]) * fade;
            self.inertial[axis] = (self.inertial[axis] + change[axis] - self.added[axis] * dt) * fade;
            self.added[axis] *= forget;
            let apart = self.flow[axis] - self.inertial[axis];
            if begins {
                self.apart[axis] += apart / BEGINNING as f32;
                self.flow[axis] -= if self.readings == BEGINNING { self.apart[axis] } else { 0.0 };
            } else {
                self.difference[axis] += (apart - self.difference[axis]) * smooth;
                self.sum[axis] += apart / BLOCK as f32;
            }
            difference += self.difference[axis] * self.difference[axis];
            motion += self.inertial[axis] * self.inertial[axis];
            let rate = counts[axis] / interval;
            picture += rate * rate + turning[axis] * turning[axis];
        }
        let repeated = counts == self.reading && counts != [0.0; 2];
        self.repeats = if repeated { self.repeats.saturating_add(1) } else { 0 };
        self.reading = counts;
        if counts == [0.0; 2] && distance > SHARP {
            self.zeros = self.zeros.saturating_add(1);
            for (turn, rate) in self.turn.iter_mut().zip(turning) {
                *turn += rate * interval;
                self.turned = self.turned.max(turn.abs());
            }
        } else {
            (self.zeros, self.turn, self.turned) = Default::default();
        }
        let blind = self.zeros >= ZEROS && self.turned > TURNED && self.turned * distance > COMPENSATED;
        let [base, share, tilt] = [DIFFERENCE + PER_METRE * distance, SHARE * distance, PER_RADIAN * self.tilt];
        let (jump, jumping) = (self.jump(begins), JUMP + JUMP_PER_METRE * distance);
        let jumps = distance > SHARP && self.waits == 0.0 && jump > jumping * jumping + share * share * picture;
        self.jumped = self.jumped.map(|time| time + interval).or(jumps.then_some(0.0));
        // Of squares: a sum would do as well, and costs a root.
        let limit = base * base + share * share * picture + tilt * tilt;
        self.differs = if difference > limit { self.differs + interval } else { 0.0 };
        if self.implausible {
            if motion > MOTION * MOTION && !begins {
                let agrees = difference < 0.2 * motion && self.repeats < REPEATED && self.zeros < ZEROS;
                self.agrees = if agrees { self.agrees + interval } else { 0.0 };
            }
            self.implausible = self.agrees < AGREES_FOR || self.jumped > Some(JUMP_WAITS);
            return false;
        }
        self.waits = (self.waits - interval).max(0.0);
        self.implausible = (self.differs > LASTS && self.waits == 0.0)
            || self.jumped > Some(JUMP_WAITS)
            || self.repeats >= REPEATED
            || blind;
        self.agrees = 0.0;
        self.implausible
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f32 = 0.01;

    /// A vehicle that stands still in the air, as flow tells; after each reading flow corrects the acceleration by this
    /// much. After how many of 200 readings is flow not believed?
    fn found(mut monitor: FlowMonitor, correction: Vec3) -> Option<u32> {
        monitor.ready();
        (0..200).find(|n| {
            monitor.predict(&Vec3::zeros(), DT);
            // Not frozen.
            let counts = [if n % 2 == 0 { 0.002 } else { -0.002 }, 0.0];
            let implausible = monitor.flow(counts, [0.0; 2], &Vec3::zeros(), 0.3, DT, true);
            monitor.corrected(&correction, &Vec3::zeros());
            implausible
        })
    }

    #[test]
    fn a_gyro_bias_that_flow_moved_explains_the_tilt_that_flow_goes_on_correcting() {
        // A bias of (0.2, -0.1) rad/s tips the acceleration by gravity times as much each second.
        let moved = |sign: f32| {
            let mut monitor = FlowMonitor::airborne();
            monitor.corrected(&Vec3::zeros(), &(Vec3::new(0.2, -0.1, 0.0) * sign));
            monitor
        };
        let correction = Vec3::new(0.1, 0.2, 0.0) * GRAVITY * DT;
        assert!(found(moved(1.0), correction).is_none());
        let unmoved = found(moved(0.0), correction).unwrap();
        assert!(found(moved(-1.0), correction).unwrap() < unmoved);
    }

    #[test]
    fn a_tilt_that_was_found_to_be_wrong_may_be_corrected() {
        let inflated = |tilt: f32| {
            let mut monitor = FlowMonitor::airborne();
            monitor.inflated(tilt);
            monitor
        };
        // One and a half m/s² within two seconds.
        let correction = Vec3::new(0.015, 0.0, 0.0);
        let sure = found(inflated(0.0), correction).unwrap();
        assert!(found(inflated(0.1), correction).is_none_or(|found| found > sure));
        assert!(found(inflated(0.0), 0.25 * correction).is_none());
    }

    #[test]
    fn a_picture_stands_still_for_millimetres_not_for_centimetres() {
        let found = |distance: f32| {
            let mut monitor = FlowMonitor::airborne();
            (0..30).any(|_| {
                monitor.predict(&Vec3::zeros(), DT);
                // 0.012 rad in all.
                monitor.flow([0.0; 2], [0.04, 0.0], &Vec3::new(0.0, -0.04 * distance, 0.0), distance, DT, true)
            })
        };
        assert!(!found(0.3) && found(1.0));
    }

    /// After how many of 300 readings is flow not believed on a vehicle whose accelerometer feels no motion? `reading` makes
    /// flow's velocity and the picture's rate, and may change the monitor before it takes them.
    fn convicted(distance: f32, reading: impl Fn(u32, &mut FlowMonitor) -> (f32, f32)) -> Option<u32> {
        let mut monitor = FlowMonitor::default();
        (0..300).find(|n| {
            monitor.predict(&Vec3::zeros(), DT);
            let (velocity, rate) = reading(*n, &mut monitor);
            // Not frozen.
            let counts = [rate * DT, if n % 2 == 0 { 0.002 } else { -0.002 }];
            monitor.flow(counts, [0.0; 2], &Vec3::new(velocity, 0.0, 0.0), distance, DT, true)
        })
    }

    #[test]
    fn a_first_reading_that_holds_two_frames_convicts_nobody() {
        // The last one before flow's past is forgotten, and the first one after it.
        for double in [99, 100] {
            let found = convicted(0.3, |n, monitor| {
                if n == 100 {
                    monitor.forget();
                }
                (if n == double { 1.2 } else { 0.0 }, 0.0)
            });
            assert_eq!(found, None, "reading {double}");
        }
    }

    #[test]
    fn a_jump_convicts_flow_unless_it_was_the_gyros() {
        // The smaller one is less than the difference may be for long.
        for jump in [1.0, 0.6] {
            for at in 100..105 {
                let steps = |n: u32| (if n < at { 0.0 } else { jump }, 0.0);
                let found = convicted(0.5, |n, _| steps(n));
                assert!(
                    found.is_some_and(|found| (at + 10..at + 30).contains(&found)),
                    "{jump} m/s at {at}: {found:?}"
                );
                let undone = convicted(0.5, |n, monitor| {
                    if n == at + 10 {
                        monitor.forget();
                    }
                    steps(n)
                });
                assert_eq!(undone, None, "{jump} m/s at {at}");
            }
        }
        assert_eq!(convicted(0.5, |n, _| (if n < 100 { 0.0 } else { 0.3 }, 0.0)), None, "none at all");
    }

    /// It was believed for one reading after each half second of agreement, and convicted again.
    #[test]
    fn an_offset_that_began_with_a_jump_is_not_believed_again_in_the_air() {
        let mut monitor = FlowMonitor::default();
        let mut convictions = 0;
        for n in 0..1_000_u32 {
            // It swings to and fro, and flow says so, too much by 1 m/s from the second on.
            let velocity = 0.5 * stampfly_types::math::sin(0.03 * n as f32);
            let before = 0.5 * stampfly_types::math::sin(0.03 * (n as f32 - 1.0));
            monitor.predict(&Vec3::new(velocity - before, 0.0, 0.0), DT);
            let flow = Vec3::new(velocity + if n < 100 { 0.0 } else { 1.0 }, 0.0, 0.0);
            let counts = [flow.x * DT / 0.5, if n % 2 == 0 { 0.002 } else { -0.002 }];
            convictions += u32::from(monitor.flow(counts, [0.0; 2], &flow, 0.5, DT, true));
            if !(100..130).contains(&n) {
                assert_eq!(monitor.is_implausible(), n >= 130, "reading {n}");
            }
        }
        assert_eq!(convictions, 1);
        monitor.stand([0.0; 2], DT);
        assert!(!monitor.is_implausible());
    }

    #[test]
    fn nothing_jumps_where_every_fifth_reading_holds_two_frames() {
        for distance in [0.3, 0.5, 1.0, 2.0] {
            let found = convicted(distance, |n, _| {
                let rate = if n % 5 == 0 { 2.0 } else { 1.0 };
                (rate * distance, rate)
            });
            assert_eq!(found, None, "{distance} m");
        }
    }

    #[test]
    fn the_picture_of_a_vehicle_that_stands_may_creep_and_not_run() {
        let found = |rate: f32, readings: u32| {
            let mut monitor = FlowMonitor::default();
            (0..readings).for_each(|_| monitor.stand([0.0, -rate], DT));
            monitor.is_implausible()
        };
        assert!(found(2.0, 10), "while motors spool up");
        assert!(found(0.7, 150) && !found(0.3, 100) && !found(0.7, 50));
    }
}
