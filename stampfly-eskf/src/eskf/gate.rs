//! Who has been heard lately, who has been refused for too long, and what follows from that.
//!
//! A measurement whose squared distance from the prediction is beyond the gate is left out. That is right for an
//! outlier and wrong for a filter that has gone astray: its gates would keep out the very sensors that could put it
//! right. So a sensor that keeps disagreeing for [`lockout`](crate::EskfConfig::lockout) seconds is believed, and
//! a filter that has to be put right again and again says that it is lost.

use stampfly_types::{Duration, Instant};

/// A sensor counts as taking part this long after its last accepted sample.
const AIDING_TIMEOUT: Duration = Duration::from_micros(1_000_000);
/// So many resets, each within [`CALM`] of the one before, and the estimate is lost.
const TOO_MANY_RESETS: u32 = 8;
const CALM: Duration = Duration::from_micros(1_500_000);

/// The measurements, by what they are kept apart for.
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
}

/// Number of [`Sensor`]s.
const SENSORS: usize = Sensor::Attitude as usize + 1;

/// What one sensor has been doing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Record {
    /// Stamp of its newest measurement.
    stamp: Option<Instant>,
    /// When one was accepted last.
    fused: Option<Instant>,
    /// Since when it has been refused without a break.
    gated_since: Option<Instant>,
}

/// What to do with a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// Absorb it.
    Fuse,
    /// Leave it out.
    Leave,
    /// It has been left out for too long: believe it.
    Believe,
}

/// The records of all sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Gates {
    records: [Record; SENSORS],
    last_reset: Instant,
    /// Resets since things were last calm.
    resets: u32,
}

impl Gates {
    #[inline]
    fn record(&mut self, sensor: Sensor) -> &mut Record {
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

    /// Judges a measurement by its test ratio.
    #[inline]
    pub(super) fn judge(&mut self, sensor: Sensor, now: Instant, ratio: f32, lockout: f32) -> Verdict {
        let record = self.record(sensor);
        if ratio <= 1.0 {
            self.accept(sensor, now);
            return Verdict::Fuse;
        }
        let since = *record.gated_since.get_or_insert(now);
        if now.since(since).seconds() > lockout { Verdict::Believe } else { Verdict::Leave }
    }

    /// Notes that a measurement went in.
    #[inline]
    pub(super) fn accept(&mut self, sensor: Sensor, now: Instant) {
        let record = self.record(sensor);
        record.fused = Some(now);
        record.gated_since = None;
    }

    /// Gives a sensor that was locked out another [`lockout`](crate::EskfConfig::lockout) to fit in by itself.
    pub(super) fn wait(&mut self, sensor: Sensor, now: Instant) {
        self.record(sensor).gated_since = Some(now);
    }

    /// Notes that the state was moved to a sensor. True when that has happened too often: the estimate is lost.
    pub(super) fn reset(&mut self, sensor: Sensor, now: Instant) -> bool {
        self.accept(sensor, now);
        self.doubt(now)
    }

    /// Notes that the estimate could not be right as it was. True when that has happened too often: it is lost.
    pub(super) fn doubt(&mut self, now: Instant) -> bool {
        self.resets = if now.since(self.last_reset) > CALM { 1 } else { self.resets.saturating_add(1) };
        self.last_reset = now;
        self.resets >= TOO_MANY_RESETS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lockout_ends_in_belief() {
        let mut gates = Gates::default();
        let at = |millis: u64| Instant::from_millis(millis);
        assert_eq!(gates.judge(Sensor::Tof, at(0), 0.5, 0.2), Verdict::Fuse);
        assert!(gates.is_recent(Sensor::Tof, at(900)) && !gates.is_recent(Sensor::Tof, at(1_100)));
        for millis in [1_100, 1_200, 1_300] {
            assert_eq!(gates.judge(Sensor::Tof, at(millis), 9.0, 0.2), Verdict::Leave, "{millis}");
        }
        assert_eq!(gates.judge(Sensor::Tof, at(1_301), 9.0, 0.2), Verdict::Believe);
        // One that fits in between starts the count anew.
        gates.judge(Sensor::Tof, at(1_310), 0.1, 0.2);
        assert_eq!(gates.judge(Sensor::Tof, at(1_600), 9.0, 0.2), Verdict::Leave);
    }

    #[test]
    fn resets_in_a_row_are_a_lost_estimate_and_rare_ones_are_not() {
        let lost = |period: u64| {
            let mut gates = Gates::default();
            (1..20u64).any(|n| gates.reset(Sensor::Flow, Instant::from_millis(10_000 + n * period)))
        };
        assert!(lost(220) && lost(1_000) && !lost(2_000));
    }

    #[test]
    fn a_stamp_counts_once() {
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
