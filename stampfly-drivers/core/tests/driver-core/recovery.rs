//! A bus of two open-drain lines, and a device that was interrupted at every possible point.

use embedded_hal::digital::{ErrorKind, ErrorType, InputPin, OutputPin};
use stampfly_driver_core::blocking::block_on;
use stampfly_driver_core::{Recovery, RecoveryError, Timebase, recover_i2c};
use stampfly_driver_fakes::closure::Clock;
use stampfly_types::Duration;
use std::cell::RefCell;
use std::rc::Rc;

/// A device that sends bytes until an acknowledge is missing or a STOP arrives.
#[derive(Default)]
struct Bus {
    scl: bool,
    sda: bool,
    /// State of the device: the byte that it sends repeatedly, and the next bit; 8 is the
    /// acknowledge.
    sending: Option<(u8, u32)>,
    holds_clock: bool,
    holds_data: bool,
    broken: bool,
}

impl Bus {
    fn device_pulls(&self) -> bool {
        self.holds_data || self.sending.is_some_and(|(byte, bit)| bit < 8 && byte.rotate_left(bit) & 0x80 == 0)
    }

    fn levels(&self) -> (bool, bool) {
        (self.scl && !self.holds_clock, self.sda && !self.device_pulls())
    }

    fn set(&mut self, change: impl FnOnce(&mut Self)) {
        let before = self.levels();
        change(self);
        let after = self.levels();
        match (before, after) {
            // The clock falls: the next bit.
            ((true, _), (false, data)) => {
                if let Some((byte, bit)) = self.sending {
                    // At the end of the ninth clock: high was no acknowledgement.
                    // A high level at the end of the ninth clock is a missing acknowledge.
                    self.sending = if bit == 8 && data { None } else { Some((byte, (bit + 1) % 9)) };
                }
            }
            // A STOP that the device sees.
            ((true, false), (true, true)) => self.sending = None,
            _ => {}
        }
    }
}

#[derive(Debug)]
struct Refused;

impl embedded_hal::digital::Error for Refused {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

#[derive(Clone)]
struct Line(Rc<RefCell<Bus>>, bool);

impl ErrorType for Line {
    type Error = Refused;
}

impl Line {
    fn drive(&self, high: bool) -> Result<(), Refused> {
        let mut bus = self.0.borrow_mut();
        if bus.broken {
            return Err(Refused);
        }
        let clock = self.1;
        bus.set(|bus| *(if clock { &mut bus.scl } else { &mut bus.sda }) = high);
        Ok(())
    }
}

impl OutputPin for Line {
    fn set_low(&mut self) -> Result<(), Refused> {
        self.drive(false)
    }
    fn set_high(&mut self) -> Result<(), Refused> {
        self.drive(true)
    }
}

impl InputPin for Line {
    fn is_high(&mut self) -> Result<bool, Refused> {
        let (scl, sda) = self.0.borrow().levels();
        Ok(if self.1 { scl } else { sda })
    }
    fn is_low(&mut self) -> Result<bool, Refused> {
        self.is_high().map(|high| !high)
    }
}

fn recover(bus: Bus) -> (Result<Recovery, RecoveryError>, Duration, Rc<RefCell<Bus>>) {
    let bus = Rc::new(RefCell::new(Bus { scl: true, sda: true, ..bus }));
    let mut clock = Clock::default();
    let begun = clock.now();
    let outcome = block_on(recover_i2c(&mut Line(bus.clone(), true), &mut Line(bus.clone(), false), &mut clock));
    (outcome, clock.now().since(begun), bus)
}

#[test]
fn a_device_interrupted_at_any_bit_of_any_byte_lets_go() {
    let mut most = 0;
    for byte in 0..=255 {
        for bit in 0..9 {
            let held = Bus { sending: Some((byte, bit)), ..Bus::default() };
            let stuck = held.device_pulls();
            let (outcome, time, bus) = recover(held);
            match outcome {
                Ok(Recovery::Freed { clocks }) => {
                    assert!((1..=9).contains(&clocks));
                    most = most.max(clocks);
                }
                Ok(Recovery::WasFree) => assert!(!stuck),
                Err(error) => panic!("{error:?} at bit {bit} of {byte:#04x}"),
            }
            assert!(time < Duration::from_micros(300), "{time}");
            assert!(bus.borrow().sending.is_none() && bus.borrow().levels() == (true, true));
        }
    }
    assert_eq!(most, 8, "a byte of zeros from its first bit");
}

#[test]
fn what_cannot_be_freed_is_told_in_time_and_the_lines_are_let_go() {
    for (bus, error) in [
        (Bus { holds_data: true, ..Bus::default() }, RecoveryError::DataStuck),
        (Bus { holds_clock: true, ..Bus::default() }, RecoveryError::ClockStuck),
        (Bus { holds_clock: true, holds_data: true, ..Bus::default() }, RecoveryError::ClockStuck),
    ] {
        let (outcome, time, bus) = recover(bus);
        assert_eq!(outcome, Err(error));
        assert!(time < Duration::from_millis(1), "{time}");
        assert!(bus.borrow().scl && bus.borrow().sda);
    }
    assert_eq!(recover(Bus { broken: true, ..Bus::default() }).0, Err(RecoveryError::Pin));
}
