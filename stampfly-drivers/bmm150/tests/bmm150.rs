//! Tests of the BMM150 driver on a chip made of closures that samples with its own period.

use stampfly_bmm150::{Bmm150, Config, Preset, Rate};
use stampfly_driver_core::blocking::block_on;
use stampfly_driver_core::chip::{ChipError, I2cRegisters};
use stampfly_driver_core::{Magnetometer, Timebase};
use stampfly_driver_fakes::closure::{AXES, Access, AnyChip, Clock, Fault, I2cBus, SpiBus};
use stampfly_types::{Duration, Instant};
use std::cell::RefCell;
use std::rc::Rc;

/// Registers 0x5D to 0x71.
const TRIM: [u8; 21] = [0, 0, 9, 9, 9, 0, 0, 26, 26, 9, 9, 0xFB, 0x02, 0xAB, 0x60, 0x8D, 0x1B, 0, 0, 0xFD, 29];

struct Chip {
    clock: Clock,
    registers: [u8; 128],
    begun: Instant,
    period: u64,
    reported: u64,
    /// Lowest bits of x, y and z after a self test.
    self_test: [u8; 3],
    fault: Option<Fault>,
}

impl Chip {
    fn new(clock: &Clock) -> Self {
        let mut registers = [0; 128];
        registers[0x40] = 0x32;
        registers[0x5D..0x72].copy_from_slice(&TRIM);
        let mut chip = Self {
            clock: clock.clone(),
            registers,
            begun: Instant::ZERO,
            period: 40_000,
            reported: 0,
            self_test: [1; 3],
            fault: None,
        };
        chip.set_field([100, 200, 500]);
        chip
    }

    fn set_field(&mut self, [x, y, z]: [i16; 3]) {
        self.registers[0x42..0x44].copy_from_slice(&(x << 3).to_le_bytes());
        self.registers[0x44..0x46].copy_from_slice(&(y << 3).to_le_bytes());
        self.registers[0x46..0x48].copy_from_slice(&(z << 1).to_le_bytes());
        self.registers[0x48..0x4A].copy_from_slice(&(7_053u16 << 2).to_le_bytes());
    }

    fn access(&mut self, access: Access<'_>) -> Result<(), Fault> {
        match access {
            Access::Write(0x4B, [0x83]) => {
                self.registers[0x4B] = 1;
                self.registers[0x4C] = 6;
            }
            Access::Write(0x4C, [0x07]) => {
                assert_eq!(self.registers[0x4C] & 6, 6, "the self test starts from sleep");
                for (axis, bit) in self.self_test.into_iter().enumerate() {
                    self.registers[0x42 + 2 * axis] = self.registers[0x42 + 2 * axis] & !1 | bit;
                }
                self.registers[0x4C] = 6;
            }
            Access::Write(register, &[value]) => {
                assert!(register == 0x4B || self.registers[0x4B] & 1 != 0, "written to without power");
                self.registers[usize::from(register)] = value;
                self.begun = self.clock.now();
                self.reported = 0;
            }
            Access::Write(register, _) => panic!("one byte at a time: {register:#04x}"),
            Access::Read(register, into) => {
                if let Some(fault) = self.fault.take() {
                    return Err(fault);
                }
                if register == 0x42 && into.len() == 11 {
                    let done = self.clock.now().since(self.begun).as_micros() / self.period;
                    self.registers[0x48] = self.registers[0x48] & !1 | u8::from(done > self.reported);
                    self.reported = done;
                }
                let powered = self.registers[0x4B] & 1 != 0;
                into.copy_from_slice(&self.registers[usize::from(register)..][..into.len()]);
                if !powered {
                    into.fill(0);
                }
            }
        }
        Ok(())
    }
}

type Shared = Rc<RefCell<Chip>>;

fn bench(config: Config) -> (Clock, Shared, Bmm150<I2cRegisters<I2cBus<AnyChip>>, Clock>) {
    let clock = Clock::default();
    let chip = Rc::new(RefCell::new(Chip::new(&clock)));
    let shared = chip.clone();
    let access: AnyChip = Box::new(move |access| shared.borrow_mut().access(access));
    let bus = I2cBus { address: 0x10, clock: clock.clone(), chip: access };
    let driver = Bmm150::i2c(bus, Bmm150::ALL_LOW, clock.clone(), AXES, config);
    (clock, chip, driver)
}

#[test]
fn every_sample_comes_once_in_microtesla_and_body_axes() {
    for percent in [97, 100, 103] {
        let (_, chip, mut compass) = bench(Config::default());
        chip.borrow_mut().period = 40_000 * percent / 100;
        let first = block_on(compass.next()).expect("a sample");
        // Chip (36.33, 72.66, 168.16) µT; body = (z, −x, −y).
        let expected = stampfly_types::Vec3::new(168.157, -36.328, -72.656);
        assert!((first.data.field - expected).norm() < 0.02, "{}", first.data.field);
        assert_eq!((chip.borrow().registers[0x4C], chip.borrow().registers[0x51..0x53].to_vec()), (0x30, vec![4, 14]));
        let mut before = first.at;
        for _ in 0..50 {
            let sample = block_on(compass.next()).expect("a sample");
            assert!(sample.at.since(before).as_micros().abs_diff(chip.borrow().period) <= 2_100);
            before = sample.at;
        }
        assert!((before.since(first.at).as_micros() / 50).abs_diff(chip.borrow().period) < 50, "none twice, none lost");
    }
}

#[test]
fn another_chip_and_one_without_trim_are_told_apart() {
    let (_, chip, mut compass) = bench(Config::default());
    chip.borrow_mut().registers[0x40] = 0x33;
    assert_eq!(block_on(compass.next()), Err(ChipError::Identification { found: 0x33 }));
    let (_, chip, mut compass) = bench(Config::default());
    chip.borrow_mut().registers[0x5D..0x72].fill(0);
    assert_eq!(block_on(compass.next()), Err(ChipError::Data));
}

#[test]
fn a_rate_that_the_preset_cannot_do_is_refused() {
    let (_, _, mut compass) = bench(Config { preset: Preset::HighAccuracy, rate: Rate::Hz25 });
    assert_eq!(block_on(compass.start()), Err(ChipError::InvalidConfiguration));
    let (_, _, mut compass) = bench(Config { preset: Preset::HighAccuracy, rate: Rate::Hz20 });
    assert_eq!(block_on(compass.start()), Ok(()));
}

#[test]
fn overflow_is_an_error_of_one_sample() {
    let (_, chip, mut compass) = bench(Config::default());
    chip.borrow_mut().set_field([-4_096, 0, 0]);
    assert_eq!(block_on(compass.next()), Err(ChipError::Data));
    chip.borrow_mut().set_field([1, 0, 0]);
    block_on(compass.next()).expect("a sample");
}

#[test]
fn faults_are_bounded_and_healed() {
    let (clock, chip, mut compass) = bench(Config::default());
    block_on(compass.next()).expect("a sample");
    chip.borrow_mut().registers[0x4B] = 0;
    assert_eq!(block_on(compass.next()), Err(ChipError::Restarted));
    block_on(compass.next()).expect("a sample");
    for (fault, expected) in [(Fault::Nack, ChipError::Bus(Fault::Nack)), (Fault::Hang, ChipError::BusTimeout)] {
        chip.borrow_mut().fault = Some(fault);
        assert_eq!(block_on(compass.next()), Err(expected));
        block_on(compass.next()).expect("a sample");
    }
    chip.borrow_mut().period = 100_000_000;
    let before = clock.now();
    assert_eq!(block_on(compass.next()), Err(ChipError::NoSample));
    assert!(clock.now().since(before) < Duration::from_millis(85));
}

#[test]
fn a_late_reader_gets_a_sample_whose_instant_is_known() {
    let (clock, chip, mut compass) = bench(Config::default());
    block_on(compass.next()).expect("a sample");
    for late in [70_000, 123_456, 1_000_000] {
        clock.advance(late);
        let at = block_on(compass.next()).expect("a sample").at;
        let into = (at.since(chip.borrow().begun).as_micros() + Preset::Regular.duration().as_micros() / 2) % 40_000;
        assert!(into <= 2_100, "{into}");
    }
}

#[test]
fn a_dead_axis_fails_the_self_test_which_leaves_a_working_chip() {
    for dead in 0..3 {
        let (_, chip, mut compass) = bench(Config::default());
        assert_eq!(block_on(compass.self_test()), Ok(()));
        chip.borrow_mut().self_test[dead] = 0;
        assert_eq!(block_on(compass.self_test()), Err(ChipError::SelfTest));
        block_on(compass.next()).expect("a sample");
    }
}

#[test]
fn it_works_on_spi_too() {
    let clock = Clock::default();
    let chip = Rc::new(RefCell::new(Chip::new(&clock)));
    let shared = chip.clone();
    let access = move |access: Access<'_>| shared.borrow_mut().access(access);
    let mut compass = Bmm150::spi(SpiBus { clock: clock.clone(), chip: access }, clock, AXES, Config::default());
    assert_eq!(block_on(compass.self_test()), Ok(()));
    assert!((block_on(compass.next()).expect("a sample").data.field.x - 168.157).abs() < 0.02);
    assert_eq!(chip.borrow().registers[0x4B], 1, "four wires");
}
