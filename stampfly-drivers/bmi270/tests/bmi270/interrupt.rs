//! The interrupt pin: used while it is reliable, ignored otherwise.

use super::chip::{PERIOD, Shared, bench, driver};
use embedded_hal_async::digital::Wait;
use stampfly_bmi270::Config;
use stampfly_driver_core::blocking::block_on;
use stampfly_driver_core::chip::ChipError;
use stampfly_driver_core::{Imu, Timebase};
use stampfly_driver_fakes::closure::Clock;
use std::cell::RefCell;
use std::rc::Rc;

/// INT1: high while four frames are in the FIFO. Waiting for it advances the time.
struct Pin {
    clock: Clock,
    chip: Shared,
    behaviour: Behaviour,
    waits: Rc<RefCell<u32>>,
}

#[derive(Clone, Copy)]
enum Behaviour {
    Works,
    Silent,
    Stuck,
    Refuses,
}

impl embedded_hal::digital::ErrorType for Pin {
    type Error = embedded_hal::digital::ErrorKind;
}

impl Wait for Pin {
    async fn wait_for_high(&mut self) -> Result<(), Self::Error> {
        *self.waits.borrow_mut() += 1;
        match self.behaviour {
            Behaviour::Works => {
                let chip = self.chip.borrow();
                assert_eq!(chip.registers[0x46..0x48], [52, 0], "four frames");
                assert_eq!([chip.registers[0x53], chip.registers[0x55], chip.registers[0x58]], [0x0A, 0, 0x02]);
                let high = ((chip.consumed + 4) * chip.period).div_ceil(1_000);
                self.clock.advance(high.saturating_sub(self.clock.now().as_micros()));
                Ok(())
            }
            Behaviour::Silent => std::future::pending().await,
            Behaviour::Stuck => Ok(()),
            Behaviour::Refuses => Err(embedded_hal::digital::ErrorKind::Other),
        }
    }
    async fn wait_for_low(&mut self) -> Result<(), Self::Error> {
        unreachable!()
    }
    async fn wait_for_rising_edge(&mut self) -> Result<(), Self::Error> {
        unreachable!()
    }
    async fn wait_for_falling_edge(&mut self) -> Result<(), Self::Error> {
        unreachable!()
    }
    async fn wait_for_any_edge(&mut self) -> Result<(), Self::Error> {
        unreachable!()
    }
}

#[test]
fn with_the_pin_it_follows_the_chips_clock() {
    for period in [PERIOD * 97 / 100, PERIOD, PERIOD * 103 / 100] {
        let (clock, chip) = bench();
        chip.borrow_mut().period = period;
        chip.borrow_mut().sample = |n| [(n % 8_192) as i16; 6];
        let waits = Rc::default();
        let pin =
            Pin { clock: clock.clone(), chip: chip.clone(), behaviour: Behaviour::Works, waits: Rc::clone(&waits) };
        let mut imu = driver(&clock, &chip, Config::default()).with_interrupt(pin);
        let mut before = block_on(imu.next()).expect("a sample");
        let first = *waits.borrow();
        for _ in 0..500 {
            let sample = block_on(imu.next()).expect("a sample");
            let step = (sample.data.accel.x - before.data.accel.x) / stampfly_types::GRAVITY * 4096.0;
            assert!((step - 4.0).abs() < 1e-2, "{step}");
            let latency = clock.now().since(sample.at).as_micros();
            assert!(latency < 2_150, "no later than without: {latency}");
            before = sample;
        }
        assert_eq!(*waits.borrow() - first, 500, "one wait a sample");
    }
}

#[test]
fn a_pin_that_cannot_be_trusted_is_ignored() {
    for behaviour in [Behaviour::Silent, Behaviour::Stuck, Behaviour::Refuses] {
        let (clock, chip) = bench();
        let waits = Rc::default();
        let pin = Pin { clock: clock.clone(), chip: chip.clone(), behaviour, waits: Rc::clone(&waits) };
        let mut imu = driver(&clock, &chip, Config::default()).with_interrupt(pin);
        let mut before = block_on(imu.next()).expect("a sample").at;
        for round in 0..100 {
            let sample = block_on(imu.next()).expect("a sample");
            assert!((2_450..=2_550).contains(&sample.at.since(before).as_micros()));
            let latency = clock.now().since(sample.at).as_micros();
            assert!(latency < if round < 8 { 2_150 + 312 } else { 2_150 }, "{latency} in round {round}");
            before = sample.at;
        }
        assert_eq!(*waits.borrow(), 4, "and never again");
        chip.borrow_mut().registers[0x21] = 0;
        assert_eq!(block_on(imu.next()), Err(ChipError::Restarted));
        block_on(imu.next()).expect("a sample");
        assert!(*waits.borrow() > 4, "until the chip is set up again");
    }
}
