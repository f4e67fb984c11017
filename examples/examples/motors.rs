//! The driver of the motors, on PWM channels that turn the simulated ones: which rotor turns when?

mod emulated;

use core::cell::Cell;
use core::convert::Infallible;
use embassy_futures::select::select;
use embedded_hal::pwm::{ErrorType, SetDutyCycle};
use emulated::Terminal;
use examples::drivers::{Failure, motors};
use stampfly_drivers::{MotorError, MotorOutputs, PwmMotors};
use stampfly_sim::Simulation;
use stampfly_sim::time::block_on;
use stampfly_types::Duration;
use stampfly_types::messages::MotorOutput;

/// A timer's channel of 8 bits, wired to one of the simulated motors.
struct Channel<'a> {
    duties: &'a Cell<[f64; 4]>,
    motor: usize,
    simulation: &'a Simulation,
}

impl ErrorType for Channel<'_> {
    type Error = Infallible;
}

impl SetDutyCycle for Channel<'_> {
    fn max_duty_cycle(&self) -> u16 {
        255
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        let mut duties = self.duties.get();
        duties[self.motor] = f64::from(duty) / 255.0;
        self.duties.set(duties);
        self.simulation.world.set_duty(self.simulation.clock.now(), duties);
        Ok(())
    }
}

fn main() -> Result<(), Failure<MotorError>> {
    let (simulation, _, _) = emulated::vehicle(None);
    let (clock, duties) = (&simulation.clock, Cell::default());
    let mut motors =
        PwmMotors::new([0, 1, 2, 3].map(|motor| Channel { duties: &duties, motor, simulation: &simulation }));

    let armed = MotorOutput { duty: [0.2; 8], count: 4, armed: true, ..Default::default() };
    motors.write(&armed).map_err(Failure::Driver)?;
    assert_eq!(duties.get(), [0.0; 4], "armed, but nobody saw it disarmed before: nothing turns");

    // Which rotor is the fastest, whenever one is fast, and how fast was each?
    let (mut order, mut fastest) = (Vec::new(), [0.0f32; 4]);
    let watch = async {
        loop {
            let speed = simulation.truth().rotor_speed;
            for (motor, speed) in speed.into_iter().enumerate() {
                fastest[motor] = fastest[motor].max(speed);
                if speed > 300.0 && order.last() != Some(&motor) {
                    order.push(motor);
                }
            }
            clock.sleep_until(clock.now() + Duration::from_millis(20)).await;
        }
    };
    let mut terminal = Terminal;
    block_on(clock, select(watch, async { motors::run(&mut motors, clock.clone(), &mut terminal).await }));
    println!("in truth the rotors reached {fastest:.0?} rad/s, in this order: {order:?}");
    assert_eq!(order, [0, 1, 2, 3], "each motor in turn, one at a time");
    assert_eq!(duties.get(), [0.0; 4], "the motors still turn");
    Ok(())
}
