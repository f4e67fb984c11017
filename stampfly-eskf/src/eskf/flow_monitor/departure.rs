//! Has flow's velocity grown as the accelerometer's has, since the vehicle stood?
//!
//! On the ground tilt, gyro bias and velocity are known better than anywhere else. The integral of the acceleration from there on, with
//! everything undone that flow has done to it, is a second velocity that no lie of flow's has touched. It is worth something for some
//! seconds: a tilt that is wrong by 1.5° makes 0.25 m/s of it in each. So what lies from the take-off on is found that grows too slowly
//! for the comparison over half a second: an offset of the picture's motion, which is the larger a velocity the higher the
//! vehicle is; axes reversed or swapped, of which the vehicle circles faster and faster.
//!
//! It accuses and does not judge, since a shift of the gyro's zero looks the same for a second: [`gyro`](super::gyro) tells them
//! apart. Not for lies that begin in flight: the comparison over half a second, and jumps.

use stampfly_types::{GRAVITY, math};

/// For so long it is compared, s.
const LASTS: f32 = 3.0;
/// Time constant of the low-pass on the difference, s: a reading holds one frame, two or none.
const SMOOTH: f32 = 0.1;
/// Largest difference, m/s, and for each second. In 120 flights with the recorded vibration it was 0.30 m/s after half a second, 0.42
/// after one, 0.53 after two and 0.72 after three; with a third of that vibration and with twice as much, a third and twice that.
const DIFFERENCE: f32 = 0.42;
const PER_SECOND: f32 = 0.2;
/// Mean square change of the accelerometer from sample to sample for which that holds, (m/s²)², and the least that counts: what else
/// there is does not shrink with it.
const RECORDED: f32 = 17.0;
const LEAST: f32 = 6.0;
/// For so long, s.
const CONVICTS: f32 = 0.1;
/// After a jump of the gyro's zero a vehicle that stands knows its tilt no better than one that flies, for so long, s.
const UNSURE: f32 = 5.0;

/// What is remembered since the vehicle stood, world, north and east.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Departure {
    /// How long ago that was, s; `None` for a vehicle that has not stood since the filter started, or no longer counts.
    time: Option<f32>,
    /// Integral of the acceleration without what flow added to it, m/s.
    inertial: [f32; 2],
    /// What flow added to the acceleration, m/s², and to the gyro's bias, rad/s.
    added: [f32; 2],
    gyro_bias: [f32; 2],
    /// Integral of the accelerometer's mean square change, (m/s²)²·s, over the time of the readings, s.
    shaken: f32,
    readings: f32,
    difference: [f32; 2],
    differs: f32,
    /// Flow was found to lie. What agrees from then on may be an offset, so this stays until the vehicle stands.
    convicted: bool,
    /// How long what is known of a vehicle that stands is worth nothing, s.
    unsure: f32,
}

impl Departure {
    /// The vehicle stands, for another `dt` seconds.
    pub(super) fn stand(&mut self, dt: f32) {
        let unsure = math::larger(self.unsure - dt, 0.0);
        *self = Self { time: (unsure == 0.0).then_some(0.0), unsure, ..Self::default() };
    }

    /// The gyro's zero has jumped: what was put right is not what it was on the ground.
    pub(super) fn gyro_jumped(&mut self) {
        self.end();
        self.unsure = UNSURE;
    }

    /// Flow changed the predicted acceleration and the gyro's bias by this much.
    pub(super) fn corrected(&mut self, acceleration: [f32; 2], gyro_bias: [f32; 2]) {
        for axis in 0..2 {
            self.added[axis] += acceleration[axis];
            self.gyro_bias[axis] += gyro_bias[axis];
        }
    }

    /// Takes the change of velocity that was felt over `dt` seconds.
    pub(super) fn felt(&mut self, change: [f32; 2], dt: f32) {
        let Some(time) = &mut self.time else { return };
        *time += dt;
        let [x, y] = self.gyro_bias;
        // A bias is subtracted from the rate, so it turns the tilt the opposite way.
        self.added[0] += GRAVITY * y * dt;
        self.added[1] -= GRAVITY * x * dt;
        for ((inertial, change), added) in self.inertial.iter_mut().zip(change).zip(self.added) {
            *inertial += change - added * dt;
        }
        if *time > LASTS {
            self.end();
        }
    }

    /// Takes a reading: flow's velocity over `interval`. `uncertain`: square of what a single one may be wrong by, m²/s²; `shaken`: mean
    /// square change of the accelerometer from sample to sample, (m/s²)².
    pub(super) fn reading(&mut self, flow: [f32; 2], interval: f32, uncertain: f32, shaken: f32) {
        let Some(time) = self.time else { return };
        let share = interval / (SMOOTH + interval);
        let mut square = 0.0;
        for ((difference, flow), inertial) in self.difference.iter_mut().zip(flow).zip(self.inertial) {
            *difference += (flow - inertial - *difference) * share;
            square += *difference * *difference;
        }
        self.shaken += shaken * interval;
        self.readings += interval;
        let shaken = (self.shaken / self.readings).max(LEAST);
        let limit = DIFFERENCE + PER_SECOND * time;
        let limit = limit * limit * (shaken / RECORDED) + uncertain;
        self.differs = if square > limit { self.differs + interval } else { 0.0 };
    }

    /// It no longer counts. What was found stays.
    pub(super) fn end(&mut self) {
        *self = Self { convicted: self.convicted, unsure: self.unsure, ..Self::default() };
    }

    /// Flow it was, and not the gyro.
    pub(super) fn convict(&mut self) {
        self.convicted = true;
    }

    /// Time since the vehicle stood, s, while that counts.
    pub(super) fn time(&self) -> Option<f32> {
        self.time
    }

    /// Does it grow in another way?
    pub(super) fn contradicts(&self) -> bool {
        self.differs > CONVICTS
    }

    /// Was flow found to lie?
    pub(super) fn is_convicted(&self) -> bool {
        self.convicted
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_types::math;

    const DT: f32 = 0.01;

    fn standing() -> Departure {
        let mut departure = Departure::default();
        departure.stand(DT);
        departure
    }

    /// Flies for three seconds from the ground on. Flow's velocity and the acceleration that is felt are functions of the time since then;
    /// flow makes the filter believe another acceleration by `corrects`, m/s³. When is it found to lie, s?
    fn found(flow: impl Fn(f32) -> f32, felt: impl Fn(f32) -> f32, corrects: f32, shaken: f32) -> Option<f32> {
        let mut departure = standing();
        (1..=300u16).map(|n| f32::from(n) * DT).find(|time| {
            departure.felt([felt(*time) * DT, 0.0], DT);
            departure.corrected([corrects * DT, 0.0], [0.0; 2]);
            departure.reading([flow(*time), 0.0], DT, 0.0, shaken);
            departure.contradicts()
        })
    }

    /// 1 m/s, reached within 1.3 s: an offset of the picture's motion, while the vehicle climbs to half a metre.
    fn ramp(time: f32) -> f32 {
        (time / 1.3).min(1.0)
    }

    #[test]
    fn an_offset_that_grows_with_the_height_is_found_as_the_climb_ends() {
        let when = found(ramp, |_| 0.0, 0.0, RECORDED).expect("found");
        assert!((0.8..1.4).contains(&when), "{when} s");
        // The filter comes to believe it, and what it then feels is what flow says.
        let when = found(ramp, |time| 0.8 * time, 0.8, RECORDED).expect("found");
        assert!((0.8..1.4).contains(&when), "{when} s");
    }

    #[test]
    fn a_motion_that_is_felt_is_none() {
        assert_eq!(found(|time| 0.5 * time * time, |time| time, 0.0, RECORDED), None);
        // A tilt that is wrong by a degree and a half, and corrected.
        let wrong = 0.026 * GRAVITY;
        assert_eq!(found(|_| 0.0, |_| wrong, 0.0, RECORDED), None);
    }

    #[test]
    fn the_limit_grows_with_the_vibration() {
        assert_eq!(found(ramp, |_| 0.0, 0.0, 4.0 * RECORDED), None);
    }

    #[test]
    fn reversed_axes_of_a_vehicle_that_circles_ever_faster_are_found_within_a_second() {
        let velocity = |time: f32| 0.05 * math::exp(2.5 * time);
        let when = found(|time| -velocity(time), |time| 2.5 * velocity(time), 0.0, RECORDED).expect("found");
        assert!(when < 1.0, "{when} s");
    }

    #[test]
    fn what_was_found_stays_and_what_begins_later_is_left_to_others() {
        let mut departure = standing();
        for n in 0..1_000 {
            departure.felt([0.0; 2], DT);
            departure.reading([if n < 200 { 1.0 } else { 0.0 }, 0.0], DT, 0.0, RECORDED);
            assert!(n != 150 || departure.contradicts());
            if departure.contradicts() {
                departure.convict();
            }
        }
        assert!(departure.is_convicted() && !departure.contradicts() && departure.time().is_none());
        departure.stand(DT);
        assert!(!departure.is_convicted() && departure.time().is_some());
        assert_eq!(Departure::default().time(), None, "it has not stood");
        assert_eq!(found(|time| if time > 2.9 { 5.0 } else { 0.0 }, |_| 0.0, 0.0, RECORDED), None);
    }

    #[test]
    fn after_a_jump_of_the_gyro_standing_counts_for_nothing_for_a_while() {
        let mut departure = standing();
        departure.gyro_jumped();
        assert_eq!(departure.time(), None);
        departure.stand(1.0);
        assert_eq!(departure.time(), None, "the tilt is still wrong");
        departure.stand(UNSURE);
        assert_eq!(departure.time(), Some(0.0));
    }
}
