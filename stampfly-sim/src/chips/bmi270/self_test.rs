//! The self tests of the BMI270 (DS 4.9): a force on the mass of the accelerometer, a check of the gyroscope's drive.
//!
//! Bosch's Sensor API for this chip names the bits and wants, at ±16 g and 50 ms after each change, that the positive
//! less the negative deflection is more than 16 g along x, less than −15 g along y and more than 10 g along z. The
//! gyroscope's test wants bit 2 of 0x69 set, the gyroscope off and the accelerometer on, and the test selected in the
//! features' word at 0x32 of page 1 before command 0x02; it has ended when the chip clears that bit, and then bits 5:3 of
//! 0x38 of page 0 are zero.
//!
//! *Unverified*: that a command without all this ends at once with a code of one in those bits; by how much this
//! specimen exceeds those limits, a small deflection of a quarter of the large one, a mass that moves evenly and arrives
//! after 45 ms at the latest, 85 ms for the test of the gyroscope. Retrimming is not modelled.

use stampfly_types::{Duration, GRAVITY, Instant};

/// Deflection by the positive force, chip axes, g.
const DEFLECTION: [f64; 3] = [9.0, -8.5, 6.0];
/// Share of the way between the two ends in one sample at 1600 Hz.
const STEP: f64 = 2.0 * 0.000_625 / 0.045;
/// Deflection of the small amplitude.
const SMALL: f64 = 0.25;
const GYRO_DURATION: Duration = Duration::from_micros(85_000);

#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct SelfTest {
    /// Where the mass is, −1 to 1.
    place: f64,
    /// End of the running test of the gyroscope.
    gyro: Option<Instant>,
}

impl SelfTest {
    /// One sample on: what the force adds, m/s², chip axes. `setting` is register 0x6D.
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

    /// Whether a test of the gyroscope has ended, told once.
    pub(super) fn gyro_ends(&mut self, now: Instant) -> bool {
        self.gyro.take_if(|end| *end <= now).is_some()
    }
}
