//! Innovation gates: which sensor was fused lately, which has been locked out, and how often the state was reset.
//!
//! A measurement with a test ratio above one is rejected. That is right for an outlier and wrong for a filter that has
//! diverged: its gates would reject the very sensors that could correct it. So the state is reset to a sensor that has
//! been rejected for longer than [`lockout`](crate::EskfConfig::lockout), and several times running, and many resets in a row report divergence.
//!
//! | of any sensor | condition |
//! |---|---|
//! | start | its first measurement with a test ratio of at most one |
//! | continue ([`Gates::is_recent`]) | the last accepted measurement is less than a second old |
//! | stop | a second without an accepted measurement |
//! | reset ([`GateResult::Reset`]) | every measurement rejected for longer than `lockout`, and at least `lockout_samples` of them |
//! | divergence ([`Gates::count_reset`]) | eight resets, each within 1.5 s of the one before |

use stampfly_types::{Duration, Instant};

/// A sensor counts as active this long after its last accepted measurement.
const AIDING_TIMEOUT: Duration = Duration::from_micros(1_000_000);
/// So many resets, each within [`RESET_INTERVAL`] of the one before, mean divergence.
const MAX_RESETS: u32 = 8;
const RESET_INTERVAL: Duration = Duration::from_micros(1_500_000);

/// The measurements that are gated, each by itself.
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
    /// Anything from outside that shows the horizontal position or velocity, and the vertical one.
    Level,
    Down,
}

/// Number of [`Sensor`]s.
const SENSORS: usize = Sensor::Down as usize + 1;

/// Time stamps of one sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct SensorRecord {
    /// Stamp of its newest measurement.
    stamp: Option<Instant>,
    /// When one was last accepted.
    fused: Option<Instant>,
    /// Since when every one has been rejected.
    gated_since: Option<Instant>,
    /// How many.
    gated: u16,
}

/// What the gate decides about a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum GateResult {
    /// Update with it.
    Fuse,
    /// Reject it.
    Reject,
    /// The sensor has been locked out: reset the state to it.
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

    /// Is this stamp newer than the sensor's last one? Remembers it.
    #[inline]
    pub(super) fn is_new(&mut self, sensor: Sensor, stamp: Instant) -> bool {
        let record = self.record(sensor);
        let new = record.stamp.is_none_or(|last| stamp > last);
        if new {
            record.stamp = Some(stamp);
        }
        new
    }

    /// Has one of its measurements been accepted within the last second?
    #[inline]
    pub(super) fn is_recent(&self, sensor: Sensor, now: Instant) -> bool {
        self.records[sensor as usize].fused.is_some_and(|at| now.since(at) < AIDING_TIMEOUT)
    }

    /// Has one of its measurements been accepted within this time?
    #[inline]
    pub(super) fn is_recent_within(&self, sensor: Sensor, now: Instant, within: Duration) -> bool {
        self.records[sensor as usize].fused.is_some_and(|at| now.since(at) < within)
    }

    /// Tests a measurement's ratio against its gate, with a lock-out time in seconds and how many rejected ones it takes.
    #[inline(always)]
    pub(super) fn test(&mut self, sensor: Sensor, now: Instant, ratio: f32, lockout: f32, samples: u16) -> GateResult {
        let record = self.record(sensor);
        if ratio <= 1.0 {
            self.accept(sensor, now);
            return GateResult::Fuse;
        }
        let since = *record.gated_since.get_or_insert(now);
        record.gated = record.gated.saturating_add(1);
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

    /// Was its last measurement rejected?
    pub(super) fn is_rejected(&self, sensor: Sensor) -> bool {
        self.records[sensor as usize].gated_since.is_some()
    }

    /// Restarts the lock-out time of a sensor, after an inflation that should let it pass.
    pub(super) fn restart_lockout(&mut self, sensor: Sensor, now: Instant) {
        let record = self.record(sensor);
        record.gated_since = Some(now);
        record.gated = 0;
    }

    /// Records a reset of the state to a sensor. True when the resets mean divergence.
    pub(super) fn record_reset(&mut self, sensor: Sensor, now: Instant) -> bool {
        self.accept(sensor, now);
        self.count_reset(now)
    }

    /// Counts a reset or an inflation. True when there were too many in a row: divergence.
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
        // One that fits in between starts the count anew.
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
