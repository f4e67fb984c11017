//! Self-tests of the BMI270 (DS 4.9): a force on the accelerometer's mass, and a check of the
//! gyroscope's drive.
//!
//! Bosch's Sensor API for this chip defines the bits. At ±16 g and 50 ms after each change it
//! requires a difference between positive and negative deflection of more than 16 g along x, less
//! than −15 g along y and more than 10 g along z. The gyroscope's test requires bit 2 of 0x69 set,
//! the gyroscope off and the accelerometer on, and the test selected in the features' word at 0x32
//! of page 1 before command 0x02. The chip clears that bit at the end, and then bits 5:3 of 0x38 of
//! page 0 are zero.
//!
//! *Unverified*: a command without this preparation ends immediately with a code of one in those
//! bits; the margin by which this specimen exceeds the limits; a small deflection of a quarter of
//! the large one; a mass that moves at constant speed and arrives after at most 45 ms; 85 ms for
//! the test of the gyroscope. Retrimming is not modelled.

use stampfly_types::{Duration, GRAVITY, Instant};

/// Deflection by the positive force, chip axes, g.
const DEFLECTION: [f64; 3] = [9.0, -8.5, 6.0];
/// Movement per sample at 1600 Hz, as a share of the range −1 to 1.
const STEP: f64 = 2.0 * 0.000_625 / 0.045;
/// Deflection at the small amplitude, relative to the large one.
const SMALL: f64 = 0.25;
const GYRO_DURATION: Duration = Duration::from_micros(85_000);

#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct SelfTest {
    /// Position of the mass, −1 to 1.
    place: f64,
    /// End of the running gyroscope test.
    gyro: Option<Instant>,
}

impl SelfTest {
    /// Advances by one sample and returns the additional specific force, m/s², chip axes. `setting`
    /// is register 0x6D.
    pub(super) fn deflect(&mut self, setting: u8) -> [f64; 3] {
        let sign = if setting & 0x04 != 0 { 1.0 } else { -1.0 };
        let size = if setting & 0x08 != 0 { 1.0 } else { SMALL };
        let aim = if setting & 0x01 != 0 { sign * size } else { 0.0 };
        self.place += (aim - self.place).clamp(-STEP, STEP);
        DEFLECTION.map(|deflection| self.place * deflection * f64::from(GRAVITY))
    }

    pub(super) fn begin_gyro(&mut self, now: Instant) {
        self.gyro = Some(now + GYRO_DURATION);
    }

    /// Returns true once when a gyroscope test has ended.
    pub(super) fn gyro_ends(&mut self, now: Instant) -> bool {
        self.gyro.take_if(|end| *end <= now).is_some()
    }
}
