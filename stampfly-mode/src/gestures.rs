//! Arming by sticks, for transmitters without an arm switch: what the corners of the throttle's stick mean.
//!
//! | left stick (mode 2) | throttle | yaw | what it does |
//! |---|---|---|---|
//! | up and left | high | low | calibrates for a time, when disarmed; once, however long the stick stays there |
//! | down and right | low | high | arms, when nothing is being calibrated |
//! | down and left | low | low | disarms |
//!
//! A transmitter that is not heard disarms, and so does a vehicle that is not ready. One that is heard again arms nothing by itself. Use it where a pilot expects
//! the gestures of hobby flight controllers; [`ModeMachine`](crate::ModeMachine) is for a switch, and knows the air.

use stampfly_types::{Duration, Instant};

/// Which end of its travel a stick is at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    Low,
    Between,
    High,
}

impl End {
    fn of(stick: f32, threshold: f32) -> Self {
        if stick <= threshold {
            Self::Low
        } else if stick >= 1.0 - threshold {
            Self::High
        } else {
            Self::Between
        }
    }
}

/// What the gestures have made of the vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Gestured {
    /// May the motors turn?
    pub armed: bool,
    /// Are the sensors being calibrated?
    pub calibrating: bool,
}

/// Armed or not, calibrating or not.
///
/// ```
/// use stampfly_mode::gestures::Gestures;
/// use stampfly_types::{Duration, Instant};
/// let mut gestures = Gestures::new(Duration::from_secs(2), 0.05);
/// let (low, high) = (0.0, 1.0);
/// assert!(gestures.step(Instant::ZERO, Some([low, high]), true).armed);
/// assert!(!gestures.step(Instant::ZERO, None, true).armed, "the transmitter is gone");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Gestures {
    calibration: Duration,
    threshold: f32,
    armed: bool,
    calibrates_until: Option<Instant>,
    /// The sticks have asked for the calibration that was last done, and still do.
    asked: bool,
}

impl Gestures {
    /// Disarmed. How long a calibration takes, and within which share of its travel a stick is at its end.
    #[must_use]
    pub const fn new(calibration: Duration, threshold: f32) -> Self {
        Self { calibration, threshold, armed: false, calibrates_until: None, asked: false }
    }

    /// From now on a stick is at its end within this share of its travel.
    pub fn set_threshold(&mut self, threshold: f32) {
        self.threshold = threshold;
    }

    /// Looks at throttle and yaw, 0 to 1 each, of a transmitter that is heard. `ready`: can it fly, and be calibrated?
    pub fn step(&mut self, now: Instant, sticks: Option<[f32; 2]>, ready: bool) -> Gestured {
        self.calibrates_until = self.calibrates_until.filter(|until| now < *until);
        let ends = sticks.map(|sticks| sticks.map(|stick| End::of(stick, self.threshold)));
        let asks = ends == Some([End::High, End::Low]);
        match ends {
            Some([End::High, End::Low]) if !self.armed && !self.asked && ready => {
                self.calibrates_until = Some(now + self.calibration);
            }
            Some([End::Low, End::High]) if self.calibrates_until.is_none() && ready => self.armed = true,
            Some([End::Low, End::Low]) | None => self.armed = false,
            _ => {}
        }
        self.asked = asks;
        self.armed &= ready;
        Gestured { armed: self.armed, calibrating: self.calibrates_until.is_some() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const READY: bool = true;

    #[test]
    fn sticks_arm_disarm_and_calibrate() {
        let mut gestures = Gestures::new(Duration::from_secs(2), 0.05);
        let mut step = |ms, throttle, yaw| gestures.step(Instant::from_millis(ms), Some([throttle, yaw]), READY);
        assert!(!step(0, 0.06, 1.0).armed && !step(1, 0.0, 0.94).armed, "nearly there is not there");
        assert!(step(2, 0.95, 0.05).calibrating);
        assert!(!step(3, 0.0, 1.0).armed, "not while it calibrates");
        assert!(step(2_001, 0.5, 0.5).calibrating && !step(2_002, 0.5, 0.5).calibrating);
        assert!(step(2_003, 0.05, 0.95).armed);
        assert!(!step(2_004, 1.0, 0.0).calibrating, "not when armed");
        assert!(step(2_005, 0.5, 0.5).armed && !step(2_006, 0.05, 0.05).armed);
    }

    #[test]
    fn a_calibration_is_asked_for_once() {
        let mut gestures = Gestures::new(Duration::from_secs(2), 0.05);
        let calibrating =
            (0..6_000).filter(|ms| gestures.step(Instant::from_millis(*ms), Some([1.0, 0.0]), READY).calibrating);
        assert_eq!(calibrating.count(), 2_000);
    }

    #[test]
    fn another_threshold_applies_at_once() {
        let mut gestures = Gestures::new(Duration::from_secs(2), 0.05);
        assert!(!gestures.step(Instant::ZERO, Some([0.1, 0.9]), READY).armed);
        gestures.set_threshold(0.1);
        assert!(gestures.step(Instant::ZERO, Some([0.1, 0.9]), READY).armed);
    }

    #[test]
    fn nothing_arms_by_itself() {
        let mut gestures = Gestures::new(Duration::from_secs(2), 0.05);
        assert!(gestures.step(Instant::ZERO, Some([0.0, 1.0]), READY).armed);
        assert!(!gestures.step(Instant::ZERO, None, READY).armed);
        assert!(!gestures.step(Instant::ZERO, Some([0.5, 0.5]), READY).armed);
        assert!(gestures.step(Instant::ZERO, Some([0.0, 1.0]), READY).armed);
        assert!(!gestures.step(Instant::ZERO, Some([0.5, 0.5]), false).armed);
        assert!(!gestures.step(Instant::ZERO, Some([0.5, 0.5]), READY).armed);
        assert!(!gestures.step(Instant::ZERO, Some([f32::NAN, f32::NAN]), READY).armed);
    }
}
