//! What the second opinion makes of ranges, beside a barometer that tells the truth.

use super::*;

/// Between two steps, s; a range comes with every third, and an altitude with every second.
const DT: f32 = 0.01;

/// A monitor, and the time.
struct Watched {
    monitor: VerticalMonitor,
    steps: u32,
}

impl Watched {
    /// One that stands, after this many readings of 3 cm.
    fn standing(readings: u32, alike: bool) -> Self {
        let mut watched = Self { monitor: VerticalMonitor::default(), steps: 0 };
        for reading in 0..readings {
            watched.steps += 3;
            watched.monitor.stand(0.0);
            watched.monitor.stand_range(watched.now(), if alike { 0.03 } else { distance(0.03, reading) });
            watched.monitor.baro(watched.now(), 100.0, CLEARANCE, true);
        }
        watched
    }

    fn now(&self) -> Instant {
        Instant::from_millis(10 * u64::from(self.steps))
    }

    /// A step in which nothing accelerates, with this climb rate and height of the filter's, the range in a third of them, and the
    /// barometer at rest.
    fn step(&mut self, climb: f32, height: f32, range: Option<f32>) -> Option<Use> {
        self.steps += 1;
        let now = self.now();
        self.monitor.predict(DT, 0.0, climb, 0.0, height);
        if self.steps.is_multiple_of(2) {
            self.monitor.baro(now, 100.0 + 1e-3 * (self.steps % 7) as f32, height, false);
        }
        let range = range.filter(|_| self.steps.is_multiple_of(3))?;
        Some(self.monitor.range(now, range, height, false))
    }

    /// Is the range implausible after so many seconds of such steps?
    fn is_implausible_after(
        &mut self,
        seconds: f32,
        climb: f32,
        height: f32,
        range: impl Fn(u32) -> Option<f32>,
    ) -> bool {
        for step in 0..(seconds / DT) as u32 {
            self.step(climb, height, range(step));
            self.monitor.judge(self.now(), height);
        }
        self.monitor.is_implausible()
    }
}

/// A range that lives.
fn distance(of: f32, reading: u32) -> f32 {
    of + 1e-3 * (reading % 5) as f32
}

#[test]
fn a_range_that_repeats_itself_from_the_ground_on_is_stuck_after_three_seconds_in_all() {
    // 1.8 s on the ground leave 1.2 s of the take-off, in which it would take 1.5 s by itself.
    let mut watched = Watched::standing(60, true);
    assert!(!watched.is_implausible_after(0.8, 0.0, 0.1, |_| Some(0.03)), "not yet");
    assert!(watched.is_implausible_after(0.5, 0.0, 0.1, |_| Some(0.03)));
    // One that has changed meanwhile begins anew.
    let mut watched = Watched::standing(60, true);
    watched.is_implausible_after(0.1, 0.0, 0.1, |step| Some(distance(0.03, step)));
    assert!(!watched.is_implausible_after(1.3, 0.0, 0.1, |_| Some(0.03)));
    let mut watched = Watched::standing(60, false);
    assert!(!watched.is_implausible_after(1.3, 0.0, 0.1, |_| Some(0.03)), "on the ground it lived");
}

#[test]
fn what_the_filter_does_without_a_range_convicts_none() {
    let lives = |step| Some(distance(0.5, step));
    let flown = || {
        let mut watched = Watched::standing(10, false);
        assert!(!watched.is_implausible_after(5.0, 0.0, 0.5, lives));
        watched
    };
    // It takes 0.4 m/s for its climb rate that the barometer does not see.
    assert!(flown().is_implausible_after(4.0, 0.4, 0.5, lives), "with a range it is the range's");
    let mut silent = flown();
    assert!(!silent.monitor.is_silent());
    assert!(!silent.is_implausible_after(3.0, 0.4, 0.5, |_| None));
    assert!(silent.monitor.is_silent());
    assert!(!silent.is_implausible_after(0.5, 0.4, 0.5, lives), "and when it comes back");
    assert!(!silent.monitor.is_silent());
}

/// Six seconds of a sound range at half a metre, and then a pressure that changes by this much
/// within so many seconds. Is the range implausible within four more?
fn beside_a_door(size: f32, seconds: f32) -> bool {
    let mut watched = Watched::standing(10, false);
    assert!(!watched.is_implausible_after(6.0, 0.0, 0.5, |step| Some(distance(0.5, step))));
    (0..400).any(|step| {
        watched.steps += 1;
        let now = watched.now();
        watched.monitor.predict(DT, 0.0, 0.0, 0.0, 0.5);
        if watched.steps.is_multiple_of(7) {
            let altitude = 100.0 + size * (step as f32 * DT / seconds).min(1.0);
            watched.monitor.baro(now, altitude + 1e-3 * (watched.steps % 5) as f32, 0.5, false);
        }
        if watched.steps.is_multiple_of(3) {
            watched.monitor.range(now, distance(0.5, step), 0.5, false);
        }
        watched.monitor.judge(now, 0.5);
        watched.monitor.is_implausible()
    })
}

#[test]
fn a_pressure_that_no_motion_explains_convicts_none() {
    for size in [1.5, -1.5, 2.4, -2.4] {
        for seconds in [0.05, 0.3, 0.8, 1.0] {
            assert!(!beside_a_door(size, seconds), "{size} m in {seconds} s");
        }
    }
}

#[test]
fn a_range_after_a_silence_does_not_jump() {
    let after = |silence: u32| {
        let mut watched = Watched::standing(10, false);
        watched.is_implausible_after(5.0, 0.0, 0.5, |step| Some(distance(0.5, step)));
        watched.steps += silence;
        watched.monitor.range(watched.now(), 0.8, 0.5, false)
    };
    assert_eq!([3, 30].map(after), [Use::Reject, Use::Gate]);
}
