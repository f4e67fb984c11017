//! Tests of the BMP280 driver on a chip made of closures that converts on command.

use stampfly_bmp280::{Bmp280, Config};
use stampfly_driver_core::blocking::block_on;
use stampfly_driver_core::chip::{ChipError, I2cRegisters};
use stampfly_driver_core::{Barometer, Timebase};
use stampfly_driver_fakes::closure::{Access, AnyChip, Clock, Fault, I2cBus, SpiBus, cancel};
use stampfly_types::{Duration, Instant};
use std::cell::RefCell;
use std::rc::Rc;

struct Chip {
    clock: Clock,
    registers: [u8; 256],
    /// End of the conversion in progress.
    busy_until: Instant,
    conversions: u32,
    duration: u64,
    fault: Option<Fault>,
    /// Number of conversion commands that arrive as a command to sleep.
    deaf: u32,
}

impl Chip {
    fn new(clock: &Clock) -> Self {
        let mut registers = [0; 256];
        registers[0xD0] = 0x58;
        let words: [i16; 12] =
            [27_504, 26_435, -1_000, 36_477u16 as i16, -10_685, 3_024, 2_855, 140, -7, 15_500, -14_600, 6_000];
        for (pair, word) in registers[0x88..0xA0].chunks_mut(2).zip(words) {
            pair.copy_from_slice(&word.to_le_bytes());
        }
        // The example of the data sheet: 415 148 and 519 888.
        registers[0xF7..0xFD].copy_from_slice(&[0x65, 0x5A, 0xC0, 0x7E, 0xED, 0x00]);
        Self {
            clock: clock.clone(),
            registers,
            busy_until: Instant::ZERO,
            conversions: 0,
            duration: 13_500,
            fault: None,
            deaf: 0,
        }
    }

    fn access(&mut self, access: Access<'_>) -> Result<(), Fault> {
        let now = self.clock.now();
        match access {
            Access::Write(0xE0, [0xB6]) => self.registers[0xF4..0xF6].fill(0),
            Access::Write(0xF4, [control]) if self.deaf > 0 => {
                self.deaf -= 1;
                self.registers[0xF4] = control & 0xFC;
            }
            Access::Write(0xF4, [control]) => {
                assert!(now >= self.busy_until, "a conversion is still running");
                assert_eq!(control & 3, 1, "forced mode");
                self.registers[0xF4] = control & 0xFC;
                self.conversions += 1;
                self.busy_until = now + Duration::from_micros(self.duration);
            }
            Access::Write(register, data) => self.registers[usize::from(register)] = data[0],
            Access::Read(register, into) => {
                if let Some(fault) = self.fault.take() {
                    return Err(fault);
                }
                self.registers[0xF3] = if now < self.busy_until { 8 } else { 0 };
                into.copy_from_slice(&self.registers[usize::from(register)..][..into.len()]);
            }
        }
        Ok(())
    }
}

type Shared = Rc<RefCell<Chip>>;
type Bus = I2cRegisters<I2cBus<AnyChip>>;

fn bench() -> (Clock, Shared, Bmp280<Bus, Clock>) {
    let clock = Clock::default();
    let chip = Rc::new(RefCell::new(Chip::new(&clock)));
    let shared = chip.clone();
    let access: AnyChip = Box::new(move |access| shared.borrow_mut().access(access));
    let bus = I2cBus { address: 0x76, clock: clock.clone(), chip: access };
    let driver = Bmp280::i2c(bus, Bmp280::SDO_LOW, clock.clone(), Config::default());
    (clock, chip, driver)
}

#[test]
fn every_sample_is_a_conversion_of_its_own_at_the_instant_it_was_made() {
    let (clock, chip, mut baro) = bench();
    let first = block_on(baro.next()).expect("a sample");
    assert_eq!(first.data.pressure, 100_653.25);
    assert!((first.data.temperature - 25.08).abs() < 1e-4);
    assert!((first.data.altitude - 56.0).abs() < 0.5, "{}", first.data.altitude);
    let age = clock.now().since(first.at);
    assert!((5_000..8_000).contains(&age.as_micros()), "half the conversion and its margin: {age}");
    let mut before = first.at;
    for count in 2..50 {
        let sample = block_on(baro.next()).expect("a sample");
        assert_eq!(sample.at.since(before), Duration::from_millis(40));
        assert_eq!(chip.borrow().conversions, count);
        before = sample.at;
    }
}

#[test]
fn a_conversion_that_did_not_start_is_started_again_and_never_delivered_twice() {
    let (clock, chip, mut baro) = bench();
    for round in 0..10 {
        chip.borrow_mut().deaf = round % 2;
        let sample = block_on(baro.next()).expect("a sample");
        assert_eq!(chip.borrow().conversions, round + 1);
        assert!(clock.now().since(sample.at) < Duration::from_millis(8));
    }
    chip.borrow_mut().deaf = 2;
    assert_eq!(block_on(baro.next()), Err(ChipError::NoSample));
    assert_eq!(chip.borrow().conversions, 10);
    block_on(baro.next()).expect("set up again");
}

#[test]
fn only_barometers_of_this_kind_are_accepted() {
    for (id, accepted) in [(0x58, true), (0x60, true), (0x55, false), (0x00, false), (0xFF, false)] {
        let (_, chip, mut baro) = bench();
        chip.borrow_mut().registers[0xD0] = id;
        let outcome = block_on(baro.start());
        assert_eq!(outcome, if accepted { Ok(()) } else { Err(ChipError::Identification { found: u16::from(id) }) });
    }
}

#[test]
fn a_chip_without_calibration_or_without_a_measurement_gives_no_data() {
    let (_, chip, mut baro) = bench();
    chip.borrow_mut().registers[0x88..0xA0].fill(0);
    assert_eq!(block_on(baro.next()), Err(ChipError::Data));
    let (_, chip, mut baro) = bench();
    chip.borrow_mut().registers[0xF7..0xFA].copy_from_slice(&[0x80, 0, 0]);
    assert_eq!(block_on(baro.next()), Err(ChipError::Data), "skipped");
    chip.borrow_mut().registers[0xF7..0xFA].copy_from_slice(&[0xFF, 0xFF, 0xF0]);
    assert_eq!(block_on(baro.next()), Err(ChipError::Data), "outside of what the chip can measure");
    chip.borrow_mut().registers[0xF7..0xFA].copy_from_slice(&[0x65, 0x5A, 0xC0]);
    block_on(baro.next()).expect("a sample");
}

#[test]
fn a_brown_out_is_noticed_and_healed() {
    let (_, chip, mut baro) = bench();
    block_on(baro.next()).expect("a sample");
    chip.borrow_mut().registers[0xF5] = 0;
    assert_eq!(block_on(baro.next()), Err(ChipError::Restarted));
    block_on(baro.next()).expect("a sample");
    assert_eq!(chip.borrow().registers[0xF5], 0x08);
}

#[test]
fn a_conversion_that_does_not_end_is_given_up() {
    let (clock, chip, mut baro) = bench();
    chip.borrow_mut().duration = 1_000_000;
    let before = clock.now();
    assert_eq!(block_on(baro.next()), Err(ChipError::NoSample));
    assert!(clock.now().since(before) < Duration::from_millis(50));
}

#[test]
fn bus_faults_cost_one_call_each() {
    let (_, chip, mut baro) = bench();
    block_on(baro.next()).expect("a sample");
    for (fault, expected) in [(Fault::Nack, ChipError::Bus(Fault::Nack)), (Fault::Hang, ChipError::BusTimeout)] {
        chip.borrow_mut().fault = Some(fault);
        assert_eq!(block_on(baro.next()), Err(expected));
        block_on(baro.next()).expect("a sample");
    }
}

#[test]
fn after_a_cancelled_call_the_next_one_waits_for_the_conversion_it_left_behind() {
    let (clock, chip, mut baro) = bench();
    block_on(baro.next()).expect("a sample");
    clock.advance(40_000);
    clock.stop(true);
    cancel(baro.next());
    clock.stop(false);
    assert_eq!(chip.borrow().conversions, 2);
    // The chip asserts that no conversion is in progress when the third one starts.
    let sample = block_on(baro.next()).expect("a sample");
    assert_eq!(chip.borrow().conversions, 3);
    assert!(clock.now().since(sample.at) < Duration::from_millis(8));
}

#[test]
fn it_works_on_spi_too() {
    let clock = Clock::default();
    let chip = Rc::new(RefCell::new(Chip::new(&clock)));
    let shared = chip.clone();
    // The address has seven bits.
    let access = move |access: Access<'_>| {
        shared.borrow_mut().access(match access {
            Access::Read(register, into) => Access::Read(register | 0x80, into),
            Access::Write(register, data) => Access::Write(register | 0x80, data),
        })
    };
    let mut baro = Bmp280::spi(SpiBus { clock: clock.clone(), chip: access }, clock, Config::default());
    assert_eq!(block_on(baro.next()).expect("a sample").data.pressure, 100_653.25);
    assert_eq!(chip.borrow().registers[0xF5], 0x08, "four wires");
}
