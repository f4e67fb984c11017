//! The real drivers on the emulated chips: identification, settings, data, self-tests, timing.
//!
//! Emulators and drivers were written independently from the data sheets, so agreement means two
//! equal readings.

mod bmi270;
mod bmi270_interrupt;
mod bmm150;
mod bmp280;
mod display;
mod flow_restarts;
mod ina3221;
mod linux;
mod neighbours;
mod pmw3901;
mod polarity;
mod self_tests;
mod slots;
mod spi;
mod spoilt;
mod starts;
mod vl53l3cx;
mod vl53l3cx_histogram;

use crate::pilot;
use core::cell::RefCell;
use embedded_hal_async::spi::{ErrorType, Operation, SpiDevice};
use stampfly_drivers::MotorOutputs;
use stampfly_sim::World;
use stampfly_sim::chips::{Attached, Chip};
use stampfly_sim::sensors::MotorModel;
use stampfly_sim::time::{Clock, Tasks};
use stampfly_types::{Duration, Instant};
use std::rc::Rc;

/// A display interface that accepts all data and shows nothing.
#[derive(Debug)]
struct Display;

impl Chip for Display {
    fn read(&mut self, _: u16, _: Instant) -> u16 {
        0
    }
    fn write(&mut self, _: u16, _: u16, _: Instant) {}
    fn reset(&mut self, _: Instant) {}
    fn set_id(&mut self, _: u16) {}
}

/// Registers from this one on.
fn registers<const N: usize>(chip: &Attached, first: u16) -> [u8; N] {
    core::array::from_fn(|n| chip.peek(first + n as u16) as u8)
}

/// Keeps the vehicle 0.8 m above the floor in any wind.
fn hover(tasks: &mut Tasks<'_>, clock: Clock, world: World, mut motors: MotorModel) {
    tasks.spawn(async move {
        loop {
            let now = clock.now();
            let Ok(()) = motors.write(&pilot::fly(&world.truth_at(now), -0.8));
            clock.sleep_until(now + Duration::from_micros(2_500)).await;
        }
    });
}

/// Traffic of a device: first byte written, and all bytes read.
type Transfers = Rc<RefCell<Vec<(u8, Vec<u8>)>>>;

/// A device whose transfers are recorded.
struct Tap<S> {
    device: S,
    transfers: Transfers,
}

impl<S> Tap<S> {
    fn new(device: S) -> (Self, Transfers) {
        let transfers = Transfers::default();
        (Self { device, transfers: transfers.clone() }, transfers)
    }
}

impl<S: SpiDevice> ErrorType for Tap<S> {
    type Error = S::Error;
}

impl<S: SpiDevice> SpiDevice for Tap<S> {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), S::Error> {
        self.device.transaction(operations).await?;
        let command = match operations.first() {
            Some(Operation::Write(bytes)) => bytes[0],
            other => panic!("every transfer begins with a write: {other:?}"),
        };
        let answer = operations.iter().flat_map(|operation| match operation {
            Operation::Read(bytes) => bytes.to_vec(),
            _ => Vec::new(),
        });
        self.transfers.borrow_mut().push((command, answer.collect()));
        Ok(())
    }
}
