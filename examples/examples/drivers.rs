//! Motors on any PWM channel: off until armed, never driven by nonsense, off when nobody drives them any more.

use embedded_hal::pwm::{ErrorType, SetDutyCycle};
use stampfly_drivers::{MotorOutputs, PwmMotors};
use stampfly_types::messages::MotorOutput;
use std::cell::Cell;
use std::convert::Infallible;

/// A timer's channel: on a board this comes from its HAL.
struct Channel<'a>(&'a Cell<u16>);

impl ErrorType for Channel<'_> {
    type Error = Infallible;
}

impl SetDutyCycle for Channel<'_> {
    fn max_duty_cycle(&self) -> u16 {
        255
    }
    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.0.set(duty);
        Ok(())
    }
}

fn show(what: &str, pins: &[Cell<u16>; 4]) {
    println!("{what}");
    for (name, pin) in ["front right", "rear right", "rear left", "front left"].iter().zip(pins) {
        println!("  {name:<12} {:>3} {}", pin.get(), "#".repeat(usize::from(pin.get() / 8)));
    }
}

fn main() -> Result<(), stampfly_drivers::MotorError> {
    // Whatever the pins did at power-on …
    let pins = [const { Cell::new(99) }; 4];
    let mut motors = PwmMotors::new(pins.each_ref().map(Channel));
    show("… taking them stops them:", &pins);

    let mut output = MotorOutput { count: 4, ..Default::default() };
    output.duty[..4].copy_from_slice(&[0.6, 0.5, 0.7, 0.65]);
    motors.write(&output)?;
    show("not armed, whatever the duty says:", &pins);

    output.armed = true;
    motors.write(&output)?;
    show("armed:", &pins);

    output.duty[..2].copy_from_slice(&[f32::NAN, 7.0]);
    motors.write(&output)?;
    show("a duty of NaN and one of seven:", &pins);

    drop(motors);
    show("dropped:", &pins);
    Ok(())
}
