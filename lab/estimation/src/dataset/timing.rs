//! Putting the stamps of inertial samples in order.
//!
//! Captures over a radio link stamp a sample with the whole millisecond in which its packet was made, send several
//! samples under one stamp, and repeat the last sample while a task starves. An estimator needs distinct samples at
//! distinct times.

use stampfly_drivers::Sample;
use stampfly_types::messages::ImuData;
use stampfly_types::{Duration, Instant};

/// What was done to the time stamps, and how even they are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Timing {
    /// Inertial rows in the file.
    pub rows: usize,
    /// Rows dropped because all six values equal those of the row before: the same sample sent again.
    pub repeated: usize,
    /// Rows dropped because a value is not finite.
    pub not_finite: usize,
    /// Rows dropped at the end because they only continue straight lines: whoever resampled the recording ran past
    /// the end of this sensor's data.
    pub extrapolated: usize,
    /// Rows dropped because their stamp lies before an earlier row's.
    pub backwards: usize,
    /// Rows kept but moved, because they shared a stamp: spread over the time before it, at most at the usual rate.
    pub spread: usize,
    /// Intervals longer than three usual ones.
    pub gaps: usize,
    /// The longest interval.
    pub longest: Duration,
}

/// Who stamped the samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Clock {
    /// A program that evened them out. Equal samples in a row are real or interpolated, and kept.
    Even,
    /// Whoever sent or received them. Equal samples in a row are one sample, sent again.
    Raw,
}

/// Gives every distinct sample a stamp of its own, in ascending order.
pub(super) fn put_in_order(rows: Vec<Sample<ImuData>>, clock: Clock) -> (Vec<Sample<ImuData>>, Timing) {
    let mut timing = Timing { rows: rows.len(), ..Default::default() };
    let mut kept: Vec<Sample<ImuData>> = Vec::with_capacity(rows.len());
    for row in rows {
        let finite = values(&row).iter().all(|value| value.is_finite());
        match kept.last() {
            _ if !finite => timing.not_finite += 1,
            Some(last) if clock == Clock::Raw && values(last) == values(&row) => timing.repeated += 1,
            Some(last) if row.at < last.at => timing.backwards += 1,
            _ => kept.push(row),
        }
    }

    let intervals = kept.len().saturating_sub(1).max(1) as u64;
    let usual = match (kept.first(), kept.last()) {
        (Some(first), Some(last)) => last.at.since(first.at).as_micros() / intervals,
        _ => 0,
    };
    let mut before = None;
    for batch in kept.chunk_by_mut(|a, b| a.at == b.at) {
        let Some(stamp) = batch.first().map(|row| row.at) else { continue };
        let count = batch.len() as u64;
        let room = before.map_or(stamp.as_micros(), |before: Instant| stamp.since(before).as_micros());
        let step = usual.min(room / count);
        timing.spread += batch.len() - 1;
        for (row, behind) in batch.iter_mut().zip((0..count).rev()) {
            row.at = stamp - Duration::from_micros(behind * step);
        }
        before = Some(stamp);
    }
    // Only where there is no room at all, such as two samples in the first microsecond, is one dropped.
    let total = kept.len();
    kept.dedup_by(|later, earlier| later.at <= earlier.at);
    timing.spread -= (total - kept.len()).min(timing.spread);
    timing.backwards += total - kept.len();

    let mut gaps: Vec<u64> = kept.windows(2).map(|pair| pair[1].at.since(pair[0].at).as_micros()).collect();
    timing.longest = Duration::from_micros(gaps.iter().copied().max().unwrap_or(0));
    gaps.sort_unstable();
    let median = gaps.get(gaps.len() / 2).copied().unwrap_or(0);
    timing.gaps = gaps.iter().filter(|gap| **gap > 3 * median).count();
    (kept, timing)
}

fn values(row: &Sample<ImuData>) -> [f32; 6] {
    let (accel, gyro) = (row.data.accel, row.data.gyro);
    [accel.x, accel.y, accel.z, gyro.x, gyro.y, gyro.z]
}

/// How many rows at the end lie on straight lines in all six values. No sensor is that quiet.
pub(super) fn straight_end(rows: &[Sample<ImuData>]) -> usize {
    const SHORTEST: usize = 20;
    let straight = rows.windows(3).rev().take_while(|window| {
        let [first, middle, last] = window else { return false };
        let share = middle.at.since(first.at).seconds() / last.at.since(first.at).seconds();
        let between = values(first).into_iter().zip(values(middle)).zip(values(last));
        between.into_iter().all(|((first, middle), last)| {
            let expected = first + share * (last - first);
            (middle - expected).abs() <= 1e-5 * (1.0 + middle.abs())
        })
    });
    let count = straight.count();
    if count < SHORTEST { 0 } else { count }
}

/// Tells new samples of a slow sensor from repetitions of the last one in a fast log.
pub(super) struct Held<T> {
    period: Duration,
    row: Option<Instant>,
    last: Option<(Instant, T)>,
}

impl<T: PartialEq + Copy> Held<T> {
    /// A sensor that has a new sample about every `period`.
    pub(super) fn new(period: Duration) -> Self {
        Self { period, row: None, last: None }
    }

    /// Is this a new sample? A changed value is. So is an unchanged one where the log itself is no faster than the sensor,
    /// and otherwise once half a period more than one has passed.
    pub(super) fn is_new(&mut self, at: Instant, value: T) -> bool {
        let slow_log =
            self.row.replace(at).is_some_and(|row| at.since(row).as_micros() * 10 >= self.period.as_micros() * 9);
        let new = self.last.is_none_or(|(since, last)| {
            let overdue = at.since(since).as_micros() >= self.period.as_micros() + self.period.as_micros() / 2;
            at > since && (last != value || slow_log || overdue)
        });
        if new {
            self.last = Some((at, value));
        }
        new
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use stampfly_types::Vec3;

    fn row(millis: u64, value: f32) -> Sample<ImuData> {
        let data = ImuData { accel: Vec3::new(value, 0.0, -9.8), ..Default::default() };
        Sample { at: Instant::from_millis(millis), data }
    }

    #[test]
    fn a_batch_is_spread_over_the_time_before_its_stamp() {
        let rows = vec![row(100, 1.0), row(110, 2.0), row(110, 3.0), row(110, 4.0), row(110, 5.0), row(120, 6.0)];
        let (samples, timing) = put_in_order(rows, Clock::Raw);
        let stamps: Vec<_> = samples.iter().map(|sample| sample.at.as_micros()).collect();
        assert_eq!(stamps, [100_000, 102_500, 105_000, 107_500, 110_000, 120_000]);
        assert_eq!((timing.spread, timing.longest), (3, Duration::from_micros(10_000)));
    }

    #[test]
    fn repetitions_and_steps_back_are_dropped_and_counted() {
        let rows = vec![row(10, 1.0), row(12, 1.0), row(14, 2.0), row(11, 3.0), row(16, f32::NAN), row(16, 4.0)];
        let (samples, timing) = put_in_order(rows, Clock::Raw);
        assert_eq!(samples.iter().map(|s| s.data.accel.x).collect::<Vec<_>>(), [1.0, 2.0, 4.0]);
        assert_eq!((timing.rows, timing.repeated, timing.backwards, timing.not_finite), (6, 1, 1, 1));
    }

    #[test]
    fn evened_out_samples_may_be_equal() {
        let (samples, timing) = put_in_order(vec![row(10, 1.0), row(12, 1.0), row(14, 1.0)], Clock::Even);
        assert_eq!((samples.len(), timing.repeated), (3, 0));
    }

    #[test]
    fn a_straight_end_is_found_and_a_quiet_sensor_is_not_one() {
        let noise = |n: u64| row(n * 10, ((n * 7) % 13) as f32 * 0.001);
        let mut rows: Vec<_> = (0..100).map(noise).collect();
        assert_eq!(straight_end(&rows), 0);
        rows.extend((100..150).map(|n| row(n * 10, 0.07 * n as f32)));
        assert!((48..=50).contains(&straight_end(&rows)));
    }

    #[test]
    fn a_held_value_is_new_when_it_changes_or_is_overdue() {
        let mut tof = Held::new(Duration::from_millis(33));
        let new: Vec<_> = (0..12).filter(|i| tof.is_new(Instant::from_millis(i * 10), i32::from(*i >= 3))).collect();
        assert_eq!(new, [0, 3, 8]);
    }

    #[test]
    fn in_a_log_slower_than_the_sensor_every_row_is_a_sample() {
        let mut flow = Held::new(Duration::from_millis(10));
        assert!((0..20).all(|row| flow.is_new(Instant::from_millis(row * 11), 0)));
    }

    proptest! {
        #[test]
        fn order_is_strict_and_nothing_is_lost_uncounted(stamps in prop::collection::vec(0u64..50, 0..60)) {
            let rows: Vec<_> = stamps.iter().enumerate().map(|(n, millis)| row(*millis, n as f32)).collect();
            let (samples, timing) = put_in_order(rows, Clock::Raw);
            prop_assert!(samples.windows(2).all(|pair| pair[0].at < pair[1].at));
            prop_assert_eq!(samples.len() + timing.repeated + timing.backwards + timing.not_finite, timing.rows);
        }
    }
}
