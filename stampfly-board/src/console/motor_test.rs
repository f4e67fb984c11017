//! One motor for two seconds, to see which one it is and which way it turns.

use core::sync::atomic::{AtomicU32, Ordering};
use stampfly_types::messages::MotorOutput;
use stampfly_types::{Duration, Instant};

/// How long a motor turns.
const SPAN: Duration = Duration::from_secs(2);
/// Largest duty that is tested, share. Enough to turn without propellers, too little to lift with them.
const LIMIT: f32 = 0.3;

/// Why no motor turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MotorTestRefused {
    /// The vehicle is armed.
    Armed,
    /// There is no such motor.
    NoSuchMotor,
    /// No share from 0 to the most that is tested.
    Duty,
}

impl core::fmt::Display for MotorTestRefused {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Armed => f.write_str("the vehicle is armed"),
            Self::NoSuchMotor => f.write_str("there is no such motor"),
            Self::Duty => write!(f, "from 0 to {} per cent", LIMIT * 100.0),
        }
    }
}

impl core::error::Error for MotorTestRefused {}

/// The motor test: asked for by a console, applied where duties go to the motors, on another core even.
///
/// Arming ends it at once. So does time, by the clock of whoever applies it.
///
/// ```
/// use stampfly_board::console::MotorTest;
/// use stampfly_types::{Instant, messages::MotorOutput};
/// let test = MotorTest::new();
/// let off = MotorOutput { count: 4, ..Default::default() };
/// test.start(Instant::ZERO, false, 3, 0.125)?;
/// assert_eq!(test.apply(Instant::from_secs(1), off).duty[..4], [0.0, 0.0, 0.125, 0.0]);
/// assert_eq!(test.apply(Instant::from_secs(3), off), off, "two seconds are over");
/// # Ok::<(), stampfly_board::console::MotorTestRefused>(())
/// ```
#[derive(Debug, Default)]
pub struct MotorTest {
    /// Motor in the low byte, 1 to 4, or zero when there is no test; above it the duty in 1/65536.
    what: AtomicU32,
    /// Low bits of the instant in milliseconds at which the test ends.
    until: AtomicU32,
}

fn millis(at: Instant) -> u32 {
    (at.as_micros() / 1_000) as u32
}

impl MotorTest {
    /// No motor turns.
    #[must_use]
    pub const fn new() -> Self {
        Self { what: AtomicU32::new(0), until: AtomicU32::new(0) }
    }

    /// Turns a motor, 1 to 4, with this duty, for two seconds from now. A second test takes the place of the first.
    ///
    /// # Errors
    /// When it is not allowed; nothing has changed then.
    pub fn start(&self, now: Instant, armed: bool, motor: u8, duty: f32) -> Result<(), MotorTestRefused> {
        if armed {
            return Err(MotorTestRefused::Armed);
        }
        if !(1..=4).contains(&motor) {
            return Err(MotorTestRefused::NoSuchMotor);
        }
        if !(0.0..=LIMIT).contains(&duty) {
            return Err(MotorTestRefused::Duty);
        }
        self.stop();
        self.until.store(millis(now + SPAN), Ordering::Relaxed);
        self.what.store(u32::from(motor) | ((duty * 65_536.0) as u32) << 8, Ordering::Release);
        Ok(())
    }

    /// Stops it.
    pub fn stop(&self) {
        self.what.store(0, Ordering::Release);
    }

    /// What the motors get: the output itself, or the test's while there is one and the vehicle is disarmed.
    #[must_use]
    pub fn apply(&self, now: Instant, output: MotorOutput) -> MotorOutput {
        let what = self.what.load(Ordering::Acquire);
        let left = self.until.load(Ordering::Relaxed).wrapping_sub(millis(now));
        let [motor, ..] = what.to_le_bytes();
        if motor == 0 {
            return output;
        }
        // The clock has gone past the end: what is left is huge.
        if output.armed || left == 0 || u64::from(left) > SPAN.as_millis() {
            self.stop();
            return output;
        }
        let duty = (what >> 8) as f32 / 65_536.0;
        let mut test = MotorOutput { armed: true, count: output.count, ..Default::default() };
        if let Some(place) = test.duty.get_mut(usize::from(motor) - 1) {
            *place = duty;
        }
        test
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OFF: MotorOutput = MotorOutput { duty: [0.0; 8], count: 4, armed: false, unmet: [0.0; 4] };

    #[test]
    fn a_test_is_short_small_and_never_of_an_armed_vehicle() {
        let test = MotorTest::new();
        assert_eq!(test.start(Instant::ZERO, true, 1, 0.1), Err(MotorTestRefused::Armed));
        for motor in [0, 5, 255] {
            assert_eq!(test.start(Instant::ZERO, false, motor, 0.1), Err(MotorTestRefused::NoSuchMotor));
        }
        for duty in [-0.1, 0.31, f32::NAN, f32::INFINITY] {
            assert_eq!(test.start(Instant::ZERO, false, 1, duty), Err(MotorTestRefused::Duty));
        }
        assert_eq!(test.apply(Instant::ZERO, OFF), OFF, "nothing was allowed, nothing turns");
        assert_eq!(test.start(Instant::ZERO, false, 4, 0.25), Ok(()));
        let turning = test.apply(Instant::from_micros(1), OFF);
        assert_eq!((turning.armed, turning.duty), (true, [0.0, 0.0, 0.0, 0.25, 0.0, 0.0, 0.0, 0.0]));
        assert!(test.apply(Instant::from_micros(1_999_999), OFF).armed);
        assert_eq!(test.apply(Instant::from_micros(2_000_000), OFF), OFF);
        assert_eq!(test.apply(Instant::from_micros(1), OFF), OFF, "and does not come back");
    }

    #[test]
    fn arming_ends_it() {
        let test = MotorTest::new();
        assert_eq!(test.start(Instant::ZERO, false, 1, 0.2), Ok(()));
        let armed = MotorOutput { armed: true, ..OFF };
        assert_eq!(test.apply(Instant::from_micros(1), armed), armed);
        assert_eq!(test.apply(Instant::from_micros(2), OFF), OFF);
    }

    #[test]
    fn it_ends_in_time_when_the_milliseconds_wrap() {
        let start = Instant::from_millis(u64::from(u32::MAX) - 500);
        let test = MotorTest::new();
        assert_eq!(test.start(start, false, 2, 0.1), Ok(()));
        assert!(test.apply(start + Duration::from_millis(1_999), OFF).armed);
        assert!(!test.apply(start + Duration::from_millis(2_000), OFF).armed);
    }
}
