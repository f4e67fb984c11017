//! Four brushed motors: a gentle ramp of each in turn, to see which one it is and which way it turns.
//!
//! **Take the propellers off.** Nothing turns before an output that is not armed, followed by one that is: see
//! [`Interlock`](stampfly_drivers::Interlock).

use super::Failure;
use super::show::Bar;
use core::fmt::Write;
use stampfly_drivers::{MotorOutputs, Timebase};
use stampfly_types::messages::MotorOutput;

/// In motor order.
const NAMES: [&str; 4] = ["M1 front right", "M2 rear right", "M3 rear left", "M4 front left"];
/// The most a motor is given: turns it, lifts nothing.
const PEAK: f32 = 0.2;
/// Time between two outputs. Whoever watches the motors stops them after 25 ms without one.
const STEP_MS: u32 = 5;
/// Outputs on the way up, and on the way down.
const RAMP: u32 = 160;
/// Outputs at zero after each motor, until it stands again.
const PAUSE: u32 = 100;
/// Outputs per line.
const LINE: u32 = 80;

/// Turns each motor, one after the other. The last output is not armed, whatever happens.
///
/// # Errors
/// The motors'.
pub async fn run<M: MotorOutputs, T: Timebase>(
    motors: &mut M,
    mut clock: T,
    out: &mut impl Write,
) -> Result<(), Failure<M::Error>> {
    writeln!(out, "Motors up to {:.0} % each, one after the other. Propellers off!", PEAK * 100.0)?;
    let disarmed = MotorOutput { count: NAMES.len() as u8, ..Default::default() };
    let outcome = match motors.write(&disarmed) {
        Ok(()) => ramps(motors, &mut clock, out).await,
        Err(error) => Err(Failure::Driver(error)),
    };
    motors.write(&disarmed).map_err(Failure::Driver)?;
    outcome?;
    Ok(writeln!(out, "disarmed")?)
}

async fn ramps<M: MotorOutputs>(
    motors: &mut M,
    clock: &mut impl Timebase,
    out: &mut impl Write,
) -> Result<(), Failure<M::Error>> {
    for (index, name) in NAMES.into_iter().enumerate() {
        for step in 0..2 * RAMP + PAUSE {
            let mut output = MotorOutput { count: NAMES.len() as u8, armed: true, ..Default::default() };
            let duty = PEAK * step.min((2 * RAMP).saturating_sub(step)) as f32 / RAMP as f32;
            if let Some(motor) = output.duty.get_mut(index) {
                *motor = duty;
            }
            motors.write(&output).map_err(Failure::Driver)?;
            if step.is_multiple_of(LINE) && step <= 2 * RAMP {
                writeln!(out, "{name:<15} {:5.1} % {}", duty * 100.0, Bar { value: duty, full: PEAK })?;
            }
            clock.delay_ms(STEP_MS).await;
        }
    }
    Ok(())
}
