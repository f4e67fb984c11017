//! A driver on a blocking bus, without an executor.

use core::cell::Cell;
use core::convert::Infallible;
use embedded_hal::delay::DelayNs;
use embedded_hal::i2c::{ErrorType, I2c, Operation};
use stampfly_drivers::PowerMonitor;
use stampfly_drivers::blocking::{Blocking, BlockingClock, block_on};
use stampfly_drivers::chip::ina3221::{Config, Ina3221};
use stampfly_types::Instant;

thread_local! {
    static NOW: Cell<u64> = const { Cell::new(0) };
}

/// Not `Clone`, like the delays of many boards.
struct Delay;

impl DelayNs for Delay {
    fn delay_ns(&mut self, ns: u32) {
        NOW.set(NOW.get() + u64::from(ns));
    }
}

/// An INA3221 that always has a result.
struct Wire {
    configuration: [u8; 2],
}

impl ErrorType for Wire {
    type Error = Infallible;
}

impl I2c for Wire {
    fn transaction(&mut self, _: u8, operations: &mut [Operation<'_>]) -> Result<(), Infallible> {
        match operations {
            [Operation::Write([0, data @ ..])] => self.configuration.copy_from_slice(data),
            [Operation::Write([register]), Operation::Read(into)] => into.copy_from_slice(&match register {
                0 => self.configuration,
                0xFE => [0x54, 0x49],
                0xFF => [0x32, 0x20],
                0x0F => [0, 1],
                3 => (25u16 << 3).to_be_bytes(),
                _ => (500u16 << 3).to_be_bytes(),
            }),
            other => panic!("not a register access: {other:?}"),
        }
        Ok(())
    }
}

#[test]
fn a_driver_runs_to_its_end_without_an_executor() {
    let clock = BlockingClock::new(Delay, || Instant::from_micros(NOW.get() / 1_000));
    let wire = Blocking(Wire { configuration: [0; 2] });
    let mut battery = Ina3221::new(wire, Ina3221::A0_GROUND, clock, Config::default());
    let sample = block_on(battery.next()).expect("a sample");
    assert!((sample.data.current - 0.1).abs() < 1e-6);
    assert!((sample.data.voltage - 4.0).abs() < 1e-6);
    assert!(NOW.get() / 1_000 >= 75_000, "the chip's time has been waited for");
}
