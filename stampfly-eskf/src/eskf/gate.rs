//! Innovation gates: recent acceptance, lock-out and reset counter of each sensor.
//!
//! A measurement with a test ratio above one is rejected. That is right for an outlier and wrong
//! for a diverged filter, whose gates would reject the sensors that could correct it. The state is
//! therefore reset to a sensor that has been rejected for longer than
//! [`lockout`](crate::EskfConfig::lockout), and for several samples in sequence. Many resets in
//! sequence report divergence.
//!
//! | each sensor | condition |
//! |---|---|
//! | start | first measurement with a test ratio of at most one |
//! | continue ([`Gates::is_recent`]) | last accepted measurement less than a second old |
//! | stop | one second without an accepted measurement |
//! | reset ([`GateResult::Reset`]) | all rejected for longer than `lockout`, at least `lockout_samples` |
//! | divergence ([`Gates::count_reset`]) | eight resets, each within 1.5 s of the last |

use stampfly_types::{Duration, Instant};

/// Time after the last accepted measurement for which a sensor counts as active.
const AIDING_TIMEOUT: Duration = Duration::from_micros(1_000_000);
/// Number of resets, each within [`RESET_INTERVAL`] of the one before, that means divergence.
const MAX_RESETS: u32 = 8;
const RESET_INTERVAL: Duration = Duration::from_micros(1_500_000);

/// Measurements with a gate of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sensor {
    Tof,
    Flow,
    Baro,
    Mag,
    Gravity,
    Velocity,
    Position,
    Attitude,
    /// Any external measurement of horizontal position or velocity (`Level`), and of the vertical
    /// ones (`Down`).
    Level,
    Down,
}

/// Number of [`Sensor`]s.
const SENSORS: usize = Sensor::Down as usize + 1;

/// Time stamps of one sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct SensorRecord {
    /// Time stamp of the newest measurement.
    stamp: Option<Instant>,
    /// Time of the last accepted measurement.
    fused: Option<Instant>,
    /// Start of the present series of rejections.
    gated_since: Option<Instant>,
    /// Length of that series.
    gated: u16,
}

/// Decision of a gate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum GateResult {
    /// Fuse it.
    Fuse,
    /// Reject it.
    Reject,
    /// The lock-out time is over: reset the state to this sensor.
    Reset,
}

/// The gates of all sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Gates {
    records: [SensorRecord; SENSORS],
    last_reset: Instant,
    /// Resets, each within [`RESET_INTERVAL`] of the one before.
    resets: u32,
}

impl Gates {
    #[inline]
    fn record(&mut self, sensor: Sensor) -> &mut SensorRecord {
        &mut self.records[sensor as usize]
    }

    /// Whether the stamp is newer than the sensor's last one, which it then replaces.
    #[inline]
    pub(super) fn is_new(&mut self, sensor: Sensor, stamp: Instant) -> bool {
        let record = self.record(sensor);
        let new = record.stamp.is_none_or(|last| stamp > last);
        if new {
            record.stamp = Some(stamp);
        }
        new
    }

    /// Whether a measurement has been accepted within the last second.
    #[inline]
    pub(super) fn is_recent(&self, sensor: Sensor, now: Instant) -> bool {
        self.records[sensor as usize].fused.is_some_and(|at| now.since(at) < AIDING_TIMEOUT)
    }

    /// Whether a measurement has been accepted within this time.
    #[inline]
    pub(super) fn is_recent_within(&self, sensor: Sensor, now: Instant, within: Duration) -> bool {
        self.records[sensor as usize].fused.is_some_and(|at| now.since(at) < within)
    }

    /// Tests a ratio against the gate. `lockout` is in seconds, `samples` the number of rejections
    /// a reset requires.
    #[inline(always)]
    pub(super) fn test(&mut self, sensor: Sensor, now: Instant, ratio: f32, lockout: f32, samples: u16) -> GateResult {
        let record = self.record(sensor);
        if ratio <= 1.0 {
            self.accept(sensor, now);
            return GateResult::Fuse;
        }
        let since = *record.gated_since.get_or_insert(now);
        record.gated = record.gated.saturating_add(1);
        // Both conditions: a fast sensor reaches the number at once, a slow one the time.
        let locked_out = now.since(since).seconds() > lockout && record.gated >= samples;
        if locked_out { GateResult::Reset } else { GateResult::Reject }
    }

    /// Records an accepted measurement.
    #[inline]
    pub(super) fn accept(&mut self, sensor: Sensor, now: Instant) {
        let record = self.record(sensor);
        record.fused = Some(now);
        record.gated_since = None;
        record.gated = 0;
    }

    /// Whether the last measurement was rejected.
    pub(super) fn is_rejected(&self, sensor: Sensor) -> bool {
        self.records[sensor as usize].gated_since.is_some()
    }

    /// Restarts the lock-out time after an inflation that should let the sensor pass.
    pub(super) fn restart_lockout(&mut self, sensor: Sensor, now: Instant) {
        let record = self.record(sensor);
        record.gated_since = Some(now);
        record.gated = 0;
    }

    /// Records a reset of the state to this sensor. Returns true if the filter has diverged.
    pub(super) fn record_reset(&mut self, sensor: Sensor, now: Instant) -> bool {
        self.accept(sensor, now);
        self.count_reset(now)
    }

    /// Counts a reset or an inflation. Returns true for too many in sequence: divergence.
    pub(super) fn count_reset(&mut self, now: Instant) -> bool {
        self.resets = if now.since(self.last_reset) > RESET_INTERVAL { 1 } else { self.resets.saturating_add(1) };
        self.last_reset = now;
        self.resets >= MAX_RESETS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sensor_rejected_for_the_lockout_time_resets_the_state() {
        let mut gates = Gates::default();
        let at = |millis: u64| Instant::from_millis(millis);
        assert_eq!(gates.test(Sensor::Tof, at(0), 0.5, 0.2, 1), GateResult::Fuse);
        assert!(gates.is_recent(Sensor::Tof, at(900)) && !gates.is_recent(Sensor::Tof, at(1_100)));
        for millis in [1_100, 1_200, 1_300] {
            assert_eq!(gates.test(Sensor::Tof, at(millis), 9.0, 0.2, 1), GateResult::Reject, "{millis}");
        }
        assert_eq!(gates.test(Sensor::Tof, at(1_301), 9.0, 0.2, 1), GateResult::Reset);
        // An accepted measurement in between restarts the count.
        gates.test(Sensor::Tof, at(1_310), 0.1, 0.2, 1);
        assert_eq!(gates.test(Sensor::Tof, at(1_600), 9.0, 0.2, 1), GateResult::Reject);
    }

    #[test]
    fn a_slow_sensor_is_not_locked_out_by_two_measurements() {
        let mut gates = Gates::default();
        let at = |seconds: u64| Instant::from_millis(10_000 + 1_000 * seconds);
        let told = [0, 1, 2, 3].map(|second| gates.test(Sensor::Position, at(second), 9.0, 0.2, 4));
        assert_eq!(told, [GateResult::Reject, GateResult::Reject, GateResult::Reject, GateResult::Reset]);
        gates.accept(Sensor::Position, at(4));
        assert_eq!(gates.test(Sensor::Position, at(5), 9.0, 0.2, 4), GateResult::Reject, "the count begins anew");
    }

    #[test]
    fn many_resets_in_a_row_report_divergence_and_rare_ones_do_not() {
        let diverged = |period: u64| {
            let mut gates = Gates::default();
            (1..20u64).any(|n| gates.record_reset(Sensor::Flow, Instant::from_millis(10_000 + n * period)))
        };
        assert!(diverged(220) && diverged(1_000) && !diverged(2_000));
    }

    #[test]
    fn a_stamp_is_new_only_once_per_sensor() {
        let mut gates = Gates::default();
        assert!(
            gates.is_new(Sensor::Baro, Instant::from_micros(10))
                && !gates.is_new(Sensor::Baro, Instant::from_micros(10))
        );
        assert!(
            !gates.is_new(Sensor::Baro, Instant::from_micros(9))
                && gates.is_new(Sensor::Baro, Instant::from_micros(11))
        );
        assert!(gates.is_new(Sensor::Tof, Instant::ZERO), "every sensor has its own");
    }
}
