//! Distance from a photon histogram: ambient light, pulse, sub-bin position, noise, status.
//!
//! Pure functions without a bus. Use them to process recorded histograms; the driver uses them in
//! [`Ranging::Histogram`](crate::Ranging). Not for the light mode, in which the chip computes the
//! distance ([`Reading::decode`](crate::Reading::decode)).
//!
//! The chip counts photons in bins of one PLL clock, 1.3 ns or 20 cm of distance. A laser pulse is
//! 2.5 bins long. Two kinds of measurements alternate: the [first part](Part::First) has four bins
//! of ambient light followed by the 20 bins of its laser period, the [second](Part::Second) has the
//! 24 bins of its own. A target beyond a laser period appears too close, and at different distances
//! in the two parts; comparing them detects it.
//!
//! **Unverified** on a chip. The meaning of the registers, the laser periods, the phase at zero
//! distance and the gain are from the core that ST publishes for this part under BSD-3-Clause
//! (VL53LX bare driver: `vl53lx_hist_map.h`, `vl53lx_api_core.c`, `vl53lx_core.c`,
//! `vl53lx_hist_funcs.c`). The pulse detection and the noise estimate are original.

use crate::codec::{RangeStatus, Reading};
use stampfly_types::math;

/// Length of the block from the interrupt status at 0x0088 to the last byte of the last bin at
/// 0x00DA (`vl53lx_hist_map.h`).
pub const BLOCK_BYTES: usize = 83;
/// Bins of a histogram.
pub const BINS: usize = 24;
/// Maximum count of a bin: 24 bits. Four times the sum of all bins has 31 bits.
const FULL: u32 = 0xFF_FFFF;
/// Number of bins of ambient light at the start of the first part.
const AMBIENT_BINS: usize = 4;
/// Laser periods per macro period in which photons are counted
/// (`VL53LX_RANGING_WINDOW_VCSEL_PERIODS`).
const COUNTED_PERIODS: f32 = 2048.0;
/// Phase units per bin (`VL53LX_hist_calc_zero_distance_phase`).
const PHASES: f32 = 2048.0;
/// Length of the laser pulse in bins: registers 0x004A and 0x0034 of the preset, in sixteenths
/// (`VL53LX_get_histogram_bin_data`).
const PULSE: f32 = 2.5;
/// Distance per microsecond of time of flight in air, m, half the way of the light
/// (`VL53LX_SPEED_OF_LIGHT_IN_AIR`).
const HALF_LIGHT: f32 = 149.852;
/// Gain that ST applies to every histogram distance, 1987/2048
/// (`VL53LX_TUNINGPARM_HIST_GAIN_FACTOR_DEFAULT`).
const GAIN: f32 = 1_987.0 / 2_048.0;
/// Detection threshold of a bin in standard deviations of the ambient light: a false alarm
/// probability of 10⁻⁹. ST uses 6.25.
const THRESHOLD: f32 = 6.0;
/// Minimum of that threshold, counts (`VL53LX_TUNINGPARM_HIST_MIN_AMB_THRESH_EVENTS_DEFAULT`).
const FEWEST: f32 = 16.0;
/// Minimum counts of a pulse that is accepted as a target
/// (`VL53LX_TUNINGPARM_HIST_SIGNAL_TOTAL_EVENTS_LIMIT_DEFAULT`).
const WEAKEST: f32 = 100.0;
/// Maximum width of a pulse in bins, including the adjacent bins.
const WIDEST: usize = 6;
/// Lower bound of the standard deviation, m (`VL53LX_TUNINGPARM_HIST_SIGMA_EST_REF_MM_DEFAULT`).
const BEST_SIGMA: f32 = 0.001;
/// Standard deviation above which a distance is invalid, m
/// (`VL53LX_TUNINGPARM_HIST_SIGMA_THRESH_MM_DEFAULT`, in quarters).
const WORST_SIGMA: f32 = 0.045;
/// Accepted range of a target in bins; negative values are apparent positions behind the sensor
/// (`VL53LX_preset_mode_histogram_long_range`).
const SHORTEST: f32 = -1.0;
const FURTHEST: f32 = 17.0;
/// Tolerance between the two parts, bins
/// (`VL53LX_TUNINGPARM_CONSISTENCY_HIST_PHASE_TOLERANCE_DEFAULT`).
const TOLERANCE: f32 = 1.0;

/// Largest valid distance, m: 17 bins.
pub const REACH: f32 = 3.2;

/// One of the two alternating kinds of measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Part {
    /// Even numbers: a laser period of 20 bins, after four bins of ambient light.
    First,
    /// Odd numbers: a laser period of 24 bins.
    Second,
}

impl Part {
    /// The part of the measurement with this number.
    #[must_use]
    pub const fn of(count: u8) -> Self {
        if count & 1 == 0 { Self::First } else { Self::Second }
    }

    /// Laser period in bins.
    #[must_use]
    pub const fn period(self) -> usize {
        match self {
            Self::First => BINS - AMBIENT_BINS,
            Self::Second => BINS,
        }
    }
}

/// Timing of a histogram measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Exposure {
    /// Frequency of the fast oscillator, measured by the factory, register 0x0006: MHz with 12
    /// fractional bits.
    pub oscillator: u16,
    /// Number of macro periods of the first and of the second part.
    pub macro_periods: [u16; 2],
    /// Start of the laser pulse within its period as configured, register 0x0047, bins.
    pub laser_start: u8,
}

impl Exposure {
    /// Duration of a bin, µs: one period of the PLL, which multiplies the oscillator by 64.
    #[must_use]
    pub fn bin(&self) -> f32 {
        64.0 / f32::from(self.oscillator.max(1))
    }

    /// Distance of a bin, m.
    #[must_use]
    pub fn bin_length(&self) -> f32 {
        self.bin() * HALF_LIGHT * GAIN
    }

    /// Total counting time of a bin in this part, µs.
    fn counted(&self, part: Part) -> f32 {
        let [first, second] = self.macro_periods;
        let periods = match part {
            Part::First => first,
            Part::Second => second,
        };
        f32::from(periods) * COUNTED_PERIODS * self.bin()
    }
}

/// A histogram as read from the chip.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Histogram {
    /// Code of the status register.
    pub code: u8,
    /// Number of the measurement since the start; 255 is followed by 128.
    pub count: u8,
    /// Number of detectors in use.
    pub detectors: f32,
    /// Photon count of each bin, at most 24 bits.
    pub bins: [u32; BINS],
    /// Position of the chip's reference pulse, in 2048ths of a bin.
    pub reference_phase: u16,
    /// Start of the laser pulse for the reference, bins.
    pub reference_start: u8,
}

/// A detected pulse.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pulse {
    /// Median position of the pulse, in bins from the start of the period.
    middle: f32,
    /// Variance of the position, bins².
    variance: f32,
    /// Counts above the ambient light.
    counts: f32,
}

impl Histogram {
    /// Decodes the block. `None` when no chip drives the bus: all bytes ones or all zeros.
    ///
    /// ```
    /// use stampfly_vl53l3cx::bins::{BLOCK_BYTES, Histogram, Part};
    /// let mut block = [0; BLOCK_BYTES];
    /// block[3] = 7;
    /// block[8] = 90; // lowest byte of bin 0
    /// let histogram = Histogram::decode(&block).expect("a measurement");
    /// assert_eq!((histogram.part(), histogram.bins[0], histogram.bins[1]), (Part::Second, 90, 0));
    /// ```
    #[must_use]
    // Keeps one copy in flash: compilers inline and unroll it in the state machine of each caller.
    #[inline(never)]
    pub fn decode(block: &[u8; BLOCK_BYTES]) -> Option<Self> {
        if *block == [0xFF; BLOCK_BYTES] || *block == [0; BLOCK_BYTES] {
            return None;
        }
        let [_interrupt, status, _report, count, d1, d0, rest @ ..] = *block;
        let mut bins = [0; BINS];
        for (bin, bytes) in bins.iter_mut().zip(rest.chunks_exact(3)) {
            *bin = bytes.iter().fold(0, |sum, byte| sum << 8 | u32::from(*byte));
        }
        let [.., p1, p0, start, high, low] = *block;
        // The phase occupies the place of the last bin's lowest byte
        // (`VL53LX_get_histogram_bin_data`).
        if let Some(last) = bins.last_mut() {
            *last = (*last & !0xFF) | u32::from((high << 2).wrapping_add(low));
        }
        Some(Self {
            code: status & 0x1F,
            count,
            detectors: f32::from(u16::from_be_bytes([d1, d0])) / 256.0,
            bins,
            reference_phase: u16::from_be_bytes([p1, p0]),
            reference_start: start,
        })
    }

    /// The part of this measurement.
    #[must_use]
    pub const fn part(&self) -> Part {
        Part::of(self.count)
    }

    /// Four times the count of a bin of the laser period, less `ambient`, four times the ambient
    /// count. `place` wraps around at the end of the period.
    fn above(&self, place: usize, ambient: i32) -> i32 {
        let period = self.part().period();
        let bin = self.bins.get(BINS - period + place % period).copied().unwrap_or(0);
        (4 * bin.min(FULL)) as i32 - ambient
    }

    /// Four times the ambient count of a bin, and the variance of that count.
    #[inline(never)]
    fn ambient(&self) -> (i32, f32) {
        match self.part() {
            Part::First => {
                let sum: u32 = self.bins.iter().take(AMBIENT_BINS).map(|bin| (*bin).min(FULL)).sum();
                (sum as i32, sum as f32 / (4 * AMBIENT_BINS) as f32)
            }
            // The median of the bins that a pulse cannot cover.
            Part::Second => {
                let rank = (BINS - WIDEST) / 2;
                let below = |value: &u32| self.bins.iter().filter(|bin| *bin < value).count();
                let middle = self.bins.iter().filter(|bin| below(bin) <= rank).max().copied().unwrap_or(0).min(FULL);
                // The variance of a median is π/2 times that of a mean.
                (4 * middle as i32, middle as f32 * core::f32::consts::FRAC_PI_2 / (BINS - WIDEST) as f32)
            }
        }
    }

    /// The strongest pulse above this ambient light.
    #[inline(never)]
    fn pulse(&self, ambient: i32, of_ambient: f32) -> Option<Pulse> {
        let period = self.part().period();
        let threshold = (4.0 * (THRESHOLD * math::sqrt(ambient as f32 / 4.0)).max(FEWEST)) as i32;
        // Starts outside every pulse, because one may extend across the end of the period.
        let begin = (0..period).find(|place| self.above(*place, ambient) <= threshold)?;
        let (mut most, mut strongest, mut sum, mut from) = (0, None, 0, 0);
        for place in begin..=begin + period {
            let counts = self.above(place, ambient);
            if counts > threshold {
                from = if sum == 0 { place } else { from };
                sum += counts;
            } else {
                if sum > most {
                    (most, strongest) = (sum, Some((from, place)));
                }
                sum = 0;
            }
        }
        // The adjacent bins contain the edges of the pulse.
        let (from, until) = strongest?;
        let window = from + period - 1..from + period + (until - from + 1).min(period - 1);
        let counts: i32 = window.clone().map(|place| self.above(place, ambient)).sum();
        // Finds the bin in which the cumulative count reaches half of the total.
        let (mut before, mut bins) = (0, 0.0);
        for place in window.clone() {
            let own = self.above(place, ambient);
            let after = counts - before - own;
            if own > 0 && before + own >= after {
                // The median is at ½ + (after − before) / 2 own. Its variance has two parts: the
                // Poisson noise of each sum, and the noise of the ambient light that was
                // subtracted.
                let width = window.len() as f32;
                let [before, own, after, ambient] = [before, own, after, ambient].map(|fourfold| fourfold as f32 / 4.0);
                let beside = before + after + (width - 1.0) * ambient;
                let tilt = (after - before) / (2.0 * own);
                let uneven = (width - 1.0) / 2.0 - bins;
                let variance =
                    (beside / 4.0 + tilt * tilt * (own + ambient) + uneven * uneven * of_ambient) / (own * own);
                let middle = (place % period) as f32 + 0.5 + tilt;
                return Some(Pulse { middle, variance: variance.max(0.0), counts: before + own + after });
            }
            before += own;
            bins += 1.0;
        }
        None
    }

    /// Time of flight to the middle of the pulse in bins, modulo the laser period.
    fn travelled(&self, middle: f32, laser_start: u8) -> f32 {
        let period = self.part().period() as f32;
        // The chip may measure its reference with another start of the laser than the target.
        let start = f32::from(self.reference_start) - f32::from(laser_start);
        let zero = f32::from(self.reference_phase) / PHASES + start;
        let travelled = middle - zero;
        let travelled = travelled - period * math::floor(travelled / period);
        // Noise or an offset can place a target slightly behind the sensor.
        if travelled > period + SHORTEST { travelled - period } else { travelled }
    }

    /// Evaluates the histogram in the terms of the light mode. Also returns the time of flight in
    /// bins, to be passed as `before` to the next evaluation; `None` without a target. `offset` is
    /// the factory's correction, m.
    ///
    /// The status is [`RangeStatus::Valid`] when the previous measurement, which is of the other
    /// part, found the target at the same distance. Without a previous one it is
    /// [`RangeStatus::NotCheckedForWrap`].
    ///
    /// ```
    /// use stampfly_vl53l3cx::RangeStatus;
    /// use stampfly_vl53l3cx::bins::{BINS, Exposure, Histogram};
    /// let exposure = Exposure { oscillator: 48_333, macro_periods: [86, 72], laser_start: 9 };
    /// let mut bins = [100; BINS];
    /// bins[9..12].fill(1_100); // after four bins of ambient light: from 5 to 8, the middle at 6.5
    /// let histogram = Histogram { code: 9, count: 0, detectors: 200.0, bins, reference_phase: 3 * 1024, reference_start: 9 };
    /// let (reading, travelled) = histogram.reading(&exposure, 0.0, None);
    /// assert!((travelled.expect("a target") - 5.0).abs() < 1e-3);
    /// assert_eq!(reading.status(), RangeStatus::NotCheckedForWrap);
    /// assert!((reading.distance - 0.96).abs() < 0.01 && reading.sigma < 0.01);
    /// ```
    #[must_use]
    // Keeps one copy in flash: compilers inline and unroll it in the state machine of each caller.
    #[inline(never)]
    pub fn reading(&self, exposure: &Exposure, offset: f32, before: Option<f32>) -> (Reading, Option<f32>) {
        let (ambient, of_ambient) = self.ambient();
        let counted = exposure.counted(self.part()).max(f32::MIN_POSITIVE);
        let mut reading = Reading {
            code: self.code,
            count: self.count,
            detectors: self.detectors,
            signal_rate: 0.0,
            ambient_rate: ambient as f32 / 4.0 / counted,
            sigma: 0.0,
            distance: 0.0,
        };
        if matches!(RangeStatus::decode(self.code), RangeStatus::Hardware) {
            return (reading, None);
        }
        let Some(pulse) = self.pulse(ambient, of_ambient).filter(|pulse| pulse.counts >= WEAKEST) else {
            reading.code = RangeStatus::SignalTooLow.code();
            return (reading, None);
        };
        let travelled = self.travelled(pulse.middle, exposure.laser_start);
        let length = exposure.bin_length();
        // Per time of the pulse, as the chip reports it in the light mode.
        reading.signal_rate = pulse.counts / (counted * PULSE);
        reading.sigma = math::sqrt(pulse.variance * length * length + BEST_SIGMA * BEST_SIGMA);
        reading.distance = travelled * length + offset * GAIN;
        let status = if !(SHORTEST..=FURTHEST).contains(&travelled) {
            RangeStatus::OutOfBounds
        } else if reading.sigma > WORST_SIGMA {
            RangeStatus::SigmaTooHigh
        } else {
            match before {
                None => RangeStatus::NotCheckedForWrap,
                Some(before) if (before - travelled).abs() < TOLERANCE => RangeStatus::Valid,
                Some(_) => RangeStatus::WrapAround,
            }
        };
        reading.code = status.code();
        (reading, Some(travelled))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXPOSURE: Exposure = Exposure { oscillator: 48_333, macro_periods: [85, 71], laser_start: 9 };
    const AMBIENT: f64 = 40.0;

    /// A rectangular pulse of 2.5 bins with this number of photons, without noise. `middle` is in
    /// bins from the start of the period.
    fn histogram(count: u8, middle: f64, photons: f64) -> Histogram {
        let part = Part::of(count);
        let (first, period) = (BINS - part.period(), part.period() as f64);
        let bins = core::array::from_fn(|place| {
            if place < first {
                return AMBIENT as u32;
            }
            let bin = (place - first) as f64;
            let covered: f64 = [-period, 0.0, period]
                .iter()
                .map(|round| (bin + 1.0).min(middle + round + 1.25) - bin.max(middle + round - 1.25))
                .map(|covered| covered.max(0.0))
                .sum();
            (AMBIENT + photons * covered / 2.5).round() as u32
        });
        Histogram { code: 9, count, detectors: 200.0, bins, reference_phase: 4 * 2_048, reference_start: 9 }
    }

    #[test]
    fn a_pulse_is_found_wherever_it_falls_between_and_around_the_bins() {
        for step in 0..24 * 16 {
            let middle = f64::from(step) / 16.0;
            for count in [0, 1] {
                let period = Part::of(count).period() as f64;
                if middle >= period {
                    continue;
                }
                let (_, travelled) = histogram(count, middle, 50_000.0).reading(&EXPOSURE, 0.0, None);
                let expected = (middle - 4.0).rem_euclid(period);
                let error = f64::from(travelled.expect("a pulse")) - expected;
                // An error of a whole period counts as zero.
                let error = if error.abs() > period / 2.0 { error.abs() - period } else { error };
                assert!(error.abs() < 0.002, "{middle} of part {count}: {error}");
            }
        }
    }

    #[test]
    fn the_same_distance_in_both_parts_is_valid_and_another_is_not() {
        let (first, travelled) = histogram(0, 9.3, 2_000.0).reading(&EXPOSURE, 0.0, None);
        assert_eq!(first.status(), RangeStatus::NotCheckedForWrap);
        let (second, _) = histogram(1, 9.3, 2_000.0).reading(&EXPOSURE, 0.0, travelled);
        assert_eq!(second.status(), RangeStatus::Valid);
        assert!((second.distance - 5.3 * EXPOSURE.bin_length()).abs() < 0.002, "{second:?}");
        // 25 bins: 5 in one part, 1 in the other.
        let (_, near) = histogram(0, 9.0, 2_000.0).reading(&EXPOSURE, 0.0, None);
        let (wrapped, _) = histogram(1, 5.0, 2_000.0).reading(&EXPOSURE, 0.0, near);
        assert_eq!(wrapped.status(), RangeStatus::WrapAround);
        // 18 bins: the same in both parts.
        let (_, far) = histogram(0, 2.0, 2_000.0).reading(&EXPOSURE, 0.0, None);
        let (beyond, _) = histogram(1, 22.0, 2_000.0).reading(&EXPOSURE, 0.0, far);
        assert_eq!(beyond.status(), RangeStatus::OutOfBounds);
    }

    #[test]
    fn offset_rates_and_reference_are_in_their_units() {
        let shifted = |reference_start| Histogram { reference_start, ..histogram(0, 9.0, 3_000.0) };
        let (plain, _) = shifted(9).reading(&EXPOSURE, 0.0, None);
        let (longer, _) = shifted(9).reading(&EXPOSURE, 0.010, None);
        assert!((longer.distance - plain.distance - 0.0097).abs() < 1e-5);
        let (nearer, _) = shifted(11).reading(&EXPOSURE, 0.0, None);
        assert!((plain.distance - nearer.distance - 2.0 * EXPOSURE.bin_length()).abs() < 1e-5);
        // 85 macro periods of 2048 bins of 1.324 ns are 0.2305 ms of ambient light; the laser's
        // rate refers to 2.5 times that.
        assert!((plain.ambient_rate - 40.0 / 230.5).abs() < 1e-3, "{plain:?}");
        assert!((plain.signal_rate - 3_000.0 / 576.3).abs() < 0.02, "{plain:?}");
        assert!((EXPOSURE.bin_length() - 0.1925).abs() < 1e-4);
    }

    #[test]
    fn little_light_or_light_everywhere_is_no_target() {
        for (count, photons) in [(0, 0.0), (1, 0.0), (0, 90.0), (1, 90.0)] {
            let (reading, travelled) = histogram(count, 9.0, photons).reading(&EXPOSURE, 0.0, None);
            assert_eq!((reading.status(), travelled), (RangeStatus::SignalTooLow, None), "{photons}");
        }
        // No bin of the laser period is as dark as the ambient bins.
        let mut bins = [9_000; BINS];
        bins[..4].fill(10);
        let flooded = Histogram { bins, ..histogram(0, 9.0, 0.0) };
        assert_eq!(flooded.reading(&EXPOSURE, 0.0, None).0.status(), RangeStatus::SignalTooLow);
    }

    #[test]
    fn bins_that_are_full_do_not_overflow() {
        for count in [0, 1] {
            for bin in [u32::MAX, 0xFF_FFFF] {
                let mut full = Histogram { bins: [bin; BINS], ..histogram(count, 9.0, 0.0) };
                assert_eq!(full.reading(&EXPOSURE, 0.0, None).1, None);
                full.bins[..12].fill(0);
                let (reading, _) = full.reading(&EXPOSURE, 0.0, None);
                assert!(reading.signal_rate.is_finite() && reading.signal_rate > 0.0, "{reading:?}");
            }
        }
    }

    #[test]
    fn what_the_chip_calls_a_failure_is_one_whatever_it_counted() {
        let failed = Histogram { code: 2, ..histogram(0, 9.0, 5_000.0) };
        let (reading, travelled) = failed.reading(&EXPOSURE, 0.0, Some(5.0));
        assert_eq!((reading.status(), travelled), (RangeStatus::Hardware, None));
    }

    #[test]
    fn a_faint_target_spread_over_metres_is_not_vouched_for() {
        let mut spread = histogram(0, 9.0, 0.0);
        spread.bins.iter_mut().for_each(|bin| *bin = 6_000);
        spread.bins[6..20].iter_mut().for_each(|bin| *bin += 500);
        let (reading, _) = spread.reading(&EXPOSURE, 0.0, Some(5.0));
        assert_eq!(reading.status(), RangeStatus::SigmaTooHigh, "{reading:?}");
    }

    #[test]
    fn the_block_is_taken_apart_with_the_last_byte_from_elsewhere() {
        let mut block = [0; BLOCK_BYTES];
        block[1..4].copy_from_slice(&[0xE9, 0, 3]);
        block[4..6].copy_from_slice(&[0xC8, 0x80]);
        for (bin, bytes) in block[6..78].chunks_exact_mut(3).enumerate() {
            bytes.copy_from_slice(&(70_000 + bin as u32).to_be_bytes()[1..]);
        }
        block[77] = 0xEE;
        block[78..83].copy_from_slice(&[0x12, 0x34, 11, 0x87 >> 2, 0x87 & 3]);
        let histogram = Histogram::decode(&block).expect("a measurement");
        assert_eq!((histogram.code, histogram.count, histogram.detectors), (9, 3, 200.5));
        assert_eq!(
            (histogram.bins[0], histogram.bins[22], histogram.bins[23]),
            (70_000, 70_022, 70_000 & !0xFF | 0x87)
        );
        assert_eq!((histogram.reference_phase, histogram.reference_start), (0x1234, 11));
        assert_eq!(Histogram::decode(&[0xFF; BLOCK_BYTES]), None);
        assert_eq!(Histogram::decode(&[0; BLOCK_BYTES]), None);
    }

    #[test]
    fn no_block_whatever_is_in_it_makes_a_number_that_is_none() {
        let mut state = 1u64;
        for round in 0..200_000u32 {
            let block: [u8; BLOCK_BYTES] = core::array::from_fn(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 56) as u8 & [0xFF, 0x0F, 0x01, 0xC3][round as usize % 4]
            });
            let Some(histogram) = Histogram::decode(&block) else { continue };
            let exposure = Exposure { oscillator: round as u16, ..EXPOSURE };
            let (reading, travelled) = histogram.reading(&exposure, 0.0, Some(3.0));
            let numbers = [reading.distance, reading.sigma, reading.signal_rate, reading.ambient_rate];
            assert!(
                numbers.iter().all(|number| number.is_finite()) && travelled.is_none_or(f32::is_finite),
                "{histogram:?}"
            );
            assert!(reading.status() != RangeStatus::Valid || (reading.sigma > 0.0 && reading.distance < 4_000.0));
        }
    }
}
