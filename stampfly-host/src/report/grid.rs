//! One time axis for everything on the page, and numbers small enough to send.

use crate::flight::Series;
use serde::Serialize;
use stampfly_sim::vehicle::Pick;
use stampfly_types::{Duration, Instant};

/// The most points a channel has; a screen has fewer columns.
const MAX_POINTS: u64 = 6_000;
/// The shortest step.
const MIN_STEP: u64 = 10_000;
/// A value is shown for this many usual intervals, and at least for [`HOLD`], before it is called missing.
const HOLD_INTERVALS: u64 = 6;
/// See [`HOLD_INTERVALS`].
const HOLD: u64 = 150_000;

/// Evenly spaced instants.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    pub(super) start: Instant,
    pub(super) step: u64,
    pub(super) points: u64,
}

impl Grid {
    pub(super) fn new((start, end): (Instant, Instant)) -> Self {
        let span = end.since(start).as_micros();
        let step = (span / MAX_POINTS).max(MIN_STEP);
        Self { start, step, points: span / step + 1 }
    }

    /// The instants.
    pub(super) fn stamps(self) -> impl Iterator<Item = Instant> {
        (0..self.points).map(move |point| self.start + Duration::from_micros(point * self.step))
    }

    /// Brings values of a series onto the grid. Where there is none: NaN.
    pub(super) fn resample(self, series: &Series, values: &[f64], pick: Pick) -> Vec<f64> {
        let hold = hold_of(series);
        let (mut from, mut to) = (0, 0);
        let mut resampled = Vec::new();
        for at in self.stamps() {
            while series.at.get(to).is_some_and(|stamp| *stamp <= at) {
                to += 1;
            }
            let between = values.get(from..to).unwrap_or_default();
            from = to;
            let newest = to.checked_sub(1).and_then(|index| Some((*series.at.get(index)?, *values.get(index)?)));
            let fresh = newest.filter(|(stamp, _)| pick == Pick::Latched || at.since(*stamp).as_micros() <= hold);
            let newest = fresh.map_or(f64::NAN, |(_, value)| value);
            let value = match pick {
                Pick::Mean if !between.is_empty() => between.iter().sum::<f64>() / between.len() as f64,
                Pick::Peak => between.iter().copied().fold(newest, |a, b| if b.abs() > a.abs() { b } else { a }),
                _ => newest,
            };
            resampled.push(value);
        }
        resampled
    }
}

/// For how long a value of this series counts as present.
fn hold_of(series: &Series) -> u64 {
    let span = series.at.last().zip(series.at.first()).map_or(0, |(last, first)| last.since(*first).as_micros());
    let interval = span / (series.at.len().saturating_sub(1).max(1) as u64);
    (interval * HOLD_INTERVALS).max(HOLD)
}

/// The largest code; one more means "no value".
const TOP: f64 = 65_534.0;

/// Values as 16-bit codes between a lowest and a highest one.
#[derive(Debug, Serialize)]
pub(super) struct Channel {
    low: f64,
    /// Value of one code step.
    step: f64,
    /// Base 64 of little-endian codes; 65 535 is no value.
    codes: String,
}

impl Channel {
    /// Packs values; `None` when there is not one finite value among them.
    pub(super) fn pack(values: &[f64]) -> Option<Self> {
        let finite = || values.iter().copied().filter(|value| value.is_finite());
        let (low, high) = (finite().reduce(f64::min)?, finite().reduce(f64::max)?);
        let step = if high > low { (high - low) / TOP } else { 1.0 };
        let code = |value: &f64| if value.is_finite() { ((value - low) / step).round() as u16 } else { u16::MAX };
        let bytes: Vec<u8> = values.iter().map(code).flat_map(u16::to_le_bytes).collect();
        Some(Self { low, step, codes: base64(&bytes) })
    }
}

/// RFC 4648 section 4.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let word = (0..3).fold(0u32, |word, place| word << 8 | u32::from(chunk.get(place).copied().unwrap_or(0)));
        for place in 0..4 {
            let digit = DIGITS[(word >> (18 - 6 * place) & 63) as usize];
            text.push(if place <= chunk.len() { digit.into() } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn series(stamps: &[u64]) -> Series {
        Series { at: stamps.iter().map(|millis| Instant::from_millis(*millis)).collect(), ..Default::default() }
    }

    #[test]
    fn base64_is_the_one_of_the_rfc() {
        let cases =
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("fooba", "Zm9vYmE=")];
        for (plain, coded) in cases {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }

    #[test]
    fn every_way_to_pick() {
        let grid = Grid::new((Instant::ZERO, Instant::from_millis(40)));
        let series = series(&[0, 4, 8, 12, 40]);
        let values = [1.0, -9.0, 2.0, 3.0, 4.0];
        assert_eq!(grid.resample(&series, &values, Pick::Newest), [1.0, 2.0, 3.0, 3.0, 4.0]);
        assert_eq!(grid.resample(&series, &values, Pick::Mean), [1.0, -3.5, 3.0, 3.0, 4.0]);
        assert_eq!(grid.resample(&series, &values, Pick::Peak), [1.0, -9.0, 3.0, 3.0, 4.0]);
    }

    #[test]
    fn old_values_are_missing_unless_they_are_latched() {
        let grid = Grid::new((Instant::ZERO, Instant::from_millis(1_000)));
        let series = series(&[100, 110, 120]);
        let newest = grid.resample(&series, &[1.0, 2.0, 3.0], Pick::Newest);
        assert!(newest[9].is_nan() && newest[12] == 3.0 && newest[27] == 3.0 && newest[28].is_nan());
        let latched = grid.resample(&series, &[1.0, 2.0, 3.0], Pick::Latched);
        assert!(latched[9].is_nan() && latched[100] == 3.0);
    }

    #[test]
    fn a_long_flight_has_no_more_points_than_a_screen_can_show() {
        assert_eq!(Grid::new((Instant::ZERO, Instant::from_secs(30))).points, 3_001);
        assert!(Grid::new((Instant::ZERO, Instant::from_secs(86_400))).points <= MAX_POINTS + 1);
        assert_eq!(Grid::new((Instant::from_micros(5), Instant::from_micros(5))).points, 1);
    }

    proptest! {
        #[test]
        fn packing_keeps_sixteen_bits(values in prop::collection::vec(prop_oneof![Just(f64::NAN), -1e3..1e3f64], 1..50)) {
            let Some(channel) = Channel::pack(&values) else {
                prop_assert!(values.iter().all(|value| value.is_nan()));
                return Ok(());
            };
            let digit = |c: u8| b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/".iter().position(|d| *d == c);
            let bits: Vec<usize> = channel.codes.bytes().map_while(digit).collect();
            let bytes: Vec<u8> = bits.chunks(4).flat_map(|four| {
                let word = four.iter().enumerate().fold(0, |word, (place, bits)| word | bits << (18 - 6 * place));
                [(word >> 16) as u8, (word >> 8) as u8, word as u8].into_iter().take(four.len() - 1).collect::<Vec<_>>()
            }).collect();
            for (value, code) in values.iter().zip(bytes.chunks(2).map(|b| u16::from(b[0]) | u16::from(b[1]) << 8)) {
                if value.is_nan() {
                    prop_assert_eq!(code, u16::MAX);
                } else {
                    prop_assert!((channel.low + channel.step * f64::from(code) - value).abs() <= 0.51 * channel.step);
                }
            }
        }
    }
}
