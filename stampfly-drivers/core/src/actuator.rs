//! Traits for motors and servos, and brushed motors on PWM channels.

use crate::{ArmToken, Interlock};
use core::error::Error;
use core::fmt;
use embedded_hal::pwm::SetDutyCycle;
use stampfly_types::Duration;
use stampfly_types::messages::{MotorOutput, ServoOutput};

/// Motors that take a duty cycle, 0 to 1.
///
/// # Contract
/// * `armed: false` stops every motor, whatever the duties are.
/// * On real motors `armed: true` takes effect only after an `armed: false`: see [`Interlock`].
/// * A duty that is not finite counts as zero; other duties are clamped to 0..=1.
/// * `write` returns within microseconds. The caller calls it once per control period.
pub trait MotorOutputs {
    /// The driver's error.
    type Error: core::fmt::Debug;

    /// Applies the duties.
    ///
    /// # Errors
    /// When a motor could not be set. The other motors have been set nevertheless.
    fn write(&mut self, output: &MotorOutput) -> Result<(), Self::Error>;
}

/// Servos of control surfaces, which take a deflection of −1 to 1.
///
/// # Contract
/// * A deflection that is not finite counts as zero; others are clamped to −1..=1.
/// * `write` returns within microseconds. The caller calls it once per control period.
pub trait ServoOutputs {
    /// The driver's error.
    type Error: core::fmt::Debug;

    /// Moves the servos.
    ///
    /// # Errors
    /// When a servo could not be set. The other servos have been set nevertheless.
    fn write(&mut self, output: &ServoOutput) -> Result<(), Self::Error>;
}

/// A motor channel refused its duty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MotorError {
    /// Index of the first channel that refused.
    pub channel: usize,
}

impl fmt::Display for MotorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "motor channel {} refused its duty", self.channel)
    }
}

impl Error for MotorError {}

/// Brushed motors behind transistors, one PWM channel each.
///
/// The motors turn only after an output that was not armed ([`Interlock`]): a driver that is
/// created in the middle of a flight leaves them off. Dropping the driver stops them.
///
/// The channels keep their last duty when outputs stop coming. Cutting off stale commands is the
/// board's task, with [`stop`](Self::stop).
///
/// ```
/// # use core::convert::Infallible;
/// # use embedded_hal::pwm::{ErrorType, SetDutyCycle};
/// # struct Channel(u16);
/// # impl ErrorType for Channel { type Error = Infallible; }
/// # impl SetDutyCycle for Channel {
/// #     fn max_duty_cycle(&self) -> u16 { 255 }
/// #     fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> { self.0 = duty; Ok(()) }
/// # }
/// use stampfly_driver_core::{MotorOutputs, PwmMotors};
/// use stampfly_types::{Duration, messages::MotorOutput};
///
/// // At 400 outputs per second a motor takes an eighth of a second to full power.
/// let mut motors = PwmMotors::new([Channel(9), Channel(9)]).with_slew_limit(8.0, Duration::from_micros(2_500));
/// let mut output = MotorOutput { count: 2, ..Default::default() };
/// motors.write(&output)?;
/// output.armed = true;
/// output.duty[1] = 0.5;
/// motors.write(&output)?;
/// assert_eq!(motors.channels().map(|c| c.0).collect::<Vec<_>>(), [0, 5]);
/// for _ in 0..100 {
///     motors.write(&output)?;
/// }
/// assert_eq!(motors.channels().map(|c| c.0).collect::<Vec<_>>(), [0, 128]);
/// # Ok::<(), stampfly_driver_core::MotorError>(())
/// ```
pub struct PwmMotors<P: SetDutyCycle, const N: usize> {
    channels: [P; N],
    interlock: Interlock,
    /// Duties last written to the channels, 0 to 1.
    duties: [f32; N],
    /// Largest rise of a duty from one output to the next.
    rise: f32,
}

impl<P: SetDutyCycle, const N: usize> PwmMotors<P, N> {
    /// Takes the channels, in motor order, and stops them.
    pub fn new(channels: [P; N]) -> Self {
        let mut motors = Self { channels, interlock: Interlock::default(), duties: [0.0; N], rise: f32::INFINITY };
        motors.stop();
        motors
    }

    /// Limits the rise of a duty to `duty_per_second`, given outputs that come every `period`; with
    /// a longer period the rise is slower. A falling duty is never limited. A limit that is zero,
    /// negative or NaN keeps the motors off.
    #[must_use]
    pub fn with_slew_limit(mut self, duty_per_second: f32, period: Duration) -> Self {
        // `f32::max` returns zero for NaN.
        self.rise = (duty_per_second * period.seconds()).max(0.0);
        self
    }

    /// Stops every motor. The next armed output turns them again, and the slew limit starts from
    /// zero.
    pub fn stop(&mut self) {
        self.duties = [0.0; N];
        for channel in &mut self.channels {
            // Errors are ignored here; the board's hardware cut-off is the backstop.
            let _ = channel.set_duty_cycle_fully_off();
        }
    }

    /// Stops every motor and blocks all of them until an output that is not armed has been written.
    pub fn lock(&mut self) {
        self.interlock.lock();
        self.stop();
    }

    /// The channels, in motor order.
    pub fn channels(&self) -> impl Iterator<Item = &P> {
        self.channels.iter()
    }
}

/// The next duty of a channel. Takes a token, so that no duty above zero exists without one.
fn turn(_: &ArmToken<'_>, wanted: f32, before: f32, rise: f32) -> f32 {
    let wanted = if wanted.is_finite() { wanted.clamp(0.0, 1.0) } else { 0.0 };
    wanted.min(before + rise)
}

impl<P: SetDutyCycle, const N: usize> MotorOutputs for PwmMotors<P, N> {
    type Error = MotorError;

    fn write(&mut self, output: &MotorOutput) -> Result<(), MotorError> {
        let mut result = Ok(());
        // One token per output: without it every duty below is zero.
        let token = self.interlock.token(output);
        let channels = self.channels.iter_mut().zip(&mut self.duties).enumerate();
        for ((index, (channel, duty)), wanted) in channels.zip(output.duty) {
            *duty = token.as_ref().map_or(0.0, |token| turn(token, wanted, *duty, self.rise));
            let max = channel.max_duty_cycle();
            // Rounds to the nearest count; the cast saturates.
            let counts = (*duty * f32::from(max) + 0.5) as u16;
            if channel.set_duty_cycle(counts.min(max)).is_err() && result.is_ok() {
                result = Err(MotorError { channel: index });
            }
        }
        result
    }
}

impl<P: SetDutyCycle, const N: usize> Drop for PwmMotors<P, N> {
    fn drop(&mut self) {
        self.stop();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::cell::Cell;

    struct Channel<'a>(&'a Cell<u16>, bool);

    #[derive(Debug)]
    struct Broken;
    impl embedded_hal::pwm::Error for Broken {
        fn kind(&self) -> embedded_hal::pwm::ErrorKind {
            embedded_hal::pwm::ErrorKind::Other
        }
    }
    impl embedded_hal::pwm::ErrorType for Channel<'_> {
        type Error = Broken;
    }
    impl SetDutyCycle for Channel<'_> {
        fn max_duty_cycle(&self) -> u16 {
            255
        }
        fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Broken> {
            if self.1 {
                return Err(Broken);
            }
            self.0.set(duty);
            Ok(())
        }
    }

    #[test]
    fn only_finite_duties_of_an_armed_vehicle_turn_a_motor() {
        let seen: [Cell<u16>; 4] = core::array::from_fn(|_| Cell::new(7));
        let mut motors = PwmMotors::new(core::array::from_fn::<_, 4, _>(|i| Channel(&seen[i], false)));
        assert_eq!(seen.each_ref().map(Cell::get), [0; 4], "stopped from the first moment");
        let mut output = MotorOutput { count: 4, armed: true, ..Default::default() };
        output.duty[..4].copy_from_slice(&[f32::NAN, 2.0, -1.0, 0.5]);
        motors.write(&output).expect("all channels work");
        assert_eq!(seen.each_ref().map(Cell::get), [0; 4], "nobody decided to arm");
        motors.write(&MotorOutput::default()).expect("all channels work");
        motors.write(&output).expect("all channels work");
        assert_eq!(seen.each_ref().map(Cell::get), [0, 255, 0, 128]);
        output.armed = false;
        motors.write(&output).expect("all channels work");
        assert_eq!(seen.each_ref().map(Cell::get), [0; 4]);
        output.armed = true;
        motors.write(&output).expect("all channels work");
        drop(motors);
        assert_eq!(seen.each_ref().map(Cell::get), [0; 4], "stopped on drop");
    }

    #[test]
    fn a_broken_channel_is_named_and_the_others_still_run() {
        let seen: [Cell<u16>; 2] = core::array::from_fn(|_| Cell::new(0));
        let mut motors = PwmMotors::new([Channel(&seen[0], true), Channel(&seen[1], false)]);
        let output = MotorOutput { duty: [1.0; 8], count: 2, armed: true, unmet: [0.0; 4] };
        let refused = motors.write(&MotorOutput::default());
        assert_eq!(refused, Err(MotorError { channel: 0 }));
        assert_eq!(std::format!("{}", MotorError { channel: 2 }), "motor channel 2 refused its duty");
        assert_eq!(motors.write(&output), Err(MotorError { channel: 0 }));
        assert_eq!(seen[1].get(), 255);
    }

    #[test]
    fn a_rise_is_limited_a_fall_is_not_and_a_stop_begins_at_zero() {
        let seen = Cell::new(7);
        let mut motors = PwmMotors::new([Channel(&seen, false)]).with_slew_limit(4.0, Duration::from_micros(25_000));
        let output = |duty: f32| MotorOutput { duty: [duty; 8], count: 1, armed: true, unmet: [0.0; 4] };
        motors.write(&MotorOutput::default()).expect("works");
        let written = |motors: &mut PwmMotors<_, 1>, duty| {
            motors.write(&output(duty)).expect("works");
            seen.get()
        };
        assert_eq!([1.0; 4].map(|duty| written(&mut motors, duty)), [26, 51, 77, 102], "a tenth per output");
        assert_eq!([0.35, f32::NAN, 0.05, 1.0].map(|duty| written(&mut motors, duty)), [89, 0, 13, 38]);
        motors.stop();
        assert_eq!(seen.get(), 0);
        assert_eq!(written(&mut motors, 1.0), 26);
        motors.write(&MotorOutput::default()).expect("works");
        assert_eq!(written(&mut motors, 1.0), 26, "disarming begins at zero, too");
        motors.lock();
        assert_eq!([1.0; 3].map(|duty| written(&mut motors, duty)), [0; 3], "until it has been disarmed");
        motors.write(&MotorOutput::default()).expect("works");
        assert_eq!(written(&mut motors, 1.0), 26);
        for limit in [f32::NAN, -1.0, 0.0] {
            let mut motors =
                PwmMotors::new([Channel(&seen, false)]).with_slew_limit(limit, Duration::from_micros(2_500));
            motors.write(&MotorOutput::default()).expect("works");
            assert_eq!(written(&mut motors, 1.0), 0, "{limit}");
        }
    }
}
