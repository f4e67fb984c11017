//! Motors.

use embedded_hal::pwm::SetDutyCycle;
use stampfly_types::messages::MotorOutput;

/// Motors that take a duty cycle.
///
/// # Contract
/// * `armed: false` stops every motor, whatever the duties say.
/// * A duty that is not finite counts as zero; others are clamped to 0..=1.
/// * Returns within microseconds; called once per control period.
pub trait MotorOutputs {
    /// The driver's error.
    type Error: core::fmt::Debug;

    /// Applies the duties.
    ///
    /// # Errors
    /// When a motor could not be set. The others have been set nevertheless.
    fn write(&mut self, output: &MotorOutput) -> Result<(), Self::Error>;
}

/// A motor channel refused its duty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MotorError {
    /// Index of the first channel that refused.
    pub channel: usize,
}

/// Brushed motors behind transistors, one PWM channel each.
///
/// The motors stop when this is dropped.
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
/// use stampfly_drivers::{MotorOutputs, PwmMotors};
/// use stampfly_types::messages::MotorOutput;
///
/// let mut motors = PwmMotors::new([Channel(9), Channel(9), Channel(9), Channel(9)]);
/// let mut output = MotorOutput { count: 4, armed: true, ..Default::default() };
/// output.duty[1] = 0.5;
/// motors.write(&output)?;
/// assert_eq!(motors.channels().map(|c| c.0).collect::<Vec<_>>(), [0, 128, 0, 0]);
/// # Ok::<(), stampfly_drivers::MotorError>(())
/// ```
pub struct PwmMotors<P: SetDutyCycle, const N: usize> {
    channels: [P; N],
}

impl<P: SetDutyCycle, const N: usize> PwmMotors<P, N> {
    /// Takes the channels, in motor order, and stops them.
    pub fn new(channels: [P; N]) -> Self {
        let mut motors = Self { channels };
        motors.stop();
        motors
    }

    /// Stops every motor.
    pub fn stop(&mut self) {
        for channel in &mut self.channels {
            // A channel that cannot be stopped has nobody left to tell; the board's own cut-off remains.
            let _ = channel.set_duty_cycle_fully_off();
        }
    }

    /// The channels, in motor order.
    pub fn channels(&self) -> impl Iterator<Item = &P> {
        self.channels.iter()
    }
}

impl<P: SetDutyCycle, const N: usize> MotorOutputs for PwmMotors<P, N> {
    type Error = MotorError;

    fn write(&mut self, output: &MotorOutput) -> Result<(), MotorError> {
        let mut result = Ok(());
        for (index, (channel, duty)) in self.channels.iter_mut().zip(output.duty).enumerate() {
            let duty = if output.armed && duty.is_finite() { duty.clamp(0.0, 1.0) } else { 0.0 };
            let max = channel.max_duty_cycle();
            let counts = (duty * f32::from(max) + 0.5) as u16;
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
        assert_eq!(motors.write(&output), Err(MotorError { channel: 0 }));
        assert_eq!(seen[1].get(), 255);
    }
}
