//! Emulated chips, accessed byte by byte as their data sheets prescribe.
#![allow(clippy::unusual_byte_groupings, reason = "digits are grouped as the fields of the register")]

mod bmi270;
mod bmm150;
mod bmp280;
mod bus;
mod floating_select;
mod ina3221;
mod interrupt_pin;
mod latency;
mod mpu6000;
mod nrf24l01;
mod pmw3901;
mod vl53l3cx;
mod wire;

use stampfly_sim::Simulation;
use stampfly_types::Duration;

/// Advances the clock.
fn wait(simulation: &Simulation, microseconds: u64) {
    simulation.clock.advance_to(simulation.clock.now() + Duration::from_micros(microseconds));
}
