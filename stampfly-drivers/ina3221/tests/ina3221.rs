//! Tests of the INA3221 driver on a chip made of closures that averages with its own period.

use stampfly_driver_core::blocking::block_on;
use stampfly_driver_core::chip::{ChipError, I2cRegisters};
use stampfly_driver_core::{PowerMonitor, Sample, Timebase};
use stampfly_driver_fakes::closure::{Access, AnyChip, Clock, Fault, I2cBus, cancel};
use stampfly_ina3221::{Config, Ina3221};
use stampfly_types::{Duration, Instant};
use std::cell::RefCell;
use std::rc::Rc;

struct Chip {
    clock: Clock,
    registers: [u16; 256],
    begun: Instant,
    /// Number of results that have been reported.
    reported: u64,
    cycle: u64,
    fault: Option<Fault>,
}

impl Chip {
    fn new(clock: &Clock) -> Self {
        let mut registers = [0; 256];
        registers[0xFE] = 0x5449;
        registers[0xFF] = 0x3220;
        // 2.00 A over 10 mΩ: 500 counts of 40 µV; 3.8 V: 475 counts of 8 mV.
        registers[3] = 500 << 3;
        registers[4] = 475 << 3;
        Self { clock: clock.clone(), registers, begun: Instant::ZERO, reported: 0, cycle: 2 * 64 * 588, fault: None }
    }

    fn access(&mut self, access: Access<'_>) -> Result<(), Fault> {
        match access {
            Access::Write(0, &[high, low]) => {
                let word = u16::from_be_bytes([high, low]);
                self.registers[0] = if word & 0x8000 != 0 { 0x7127 } else { word };
                self.begun = self.clock.now();
                self.reported = 0;
            }
            Access::Write(register, _) => panic!("nothing to write at {register:#04x}"),
            Access::Read(register, into) => {
                if let Some(fault) = self.fault.take() {
                    return Err(fault);
                }
                if register == 0x0F {
                    let done = self.clock.now().since(self.begun).as_micros() / self.cycle;
                    self.registers[0x0F] = u16::from(done > self.reported);
                    self.reported = done;
                }
                into.copy_from_slice(&self.registers[usize::from(register)].to_be_bytes());
            }
        }
        Ok(())
    }
}

type Shared = Rc<RefCell<Chip>>;

fn bench(config: Config) -> (Clock, Shared, Ina3221<I2cRegisters<I2cBus<AnyChip>>, Clock>) {
    let clock = Clock::default();
    let chip = Rc::new(RefCell::new(Chip::new(&clock)));
    let shared = chip.clone();
    let access: AnyChip = Box::new(move |access| shared.borrow_mut().access(access));
    let bus = I2cBus { address: 0x40, clock: clock.clone(), chip: access };
    let driver = Ina3221::new(bus, Ina3221::A0_GROUND, clock.clone(), config);
    (clock, chip, driver)
}

#[test]
fn samples_are_amperes_and_volts_and_every_result_is_read_once() {
    for percent in [97, 100, 103] {
        let (clock, chip, mut battery) = bench(Config::default());
        chip.borrow_mut().cycle = 2 * 64 * 588 * percent / 100;
        let first = block_on(battery.next()).expect("a sample");
        assert!((first.data.current - 2.0).abs() < 1e-5, "0.01 Ω, not 0.1 Ω");
        assert!((first.data.voltage - 3.8).abs() < 1e-5);
        assert!((first.data.power - 7.6).abs() < 1e-4);
        assert_eq!(chip.borrow().registers[0], 0x26DF);
        let mut before = first.at;
        for _ in 0..50 {
            let sample = block_on(battery.next()).expect("a sample");
            let step = sample.at.since(before).as_micros().abs_diff(chip.borrow().cycle);
            assert!(step <= 2_200, "off by no more than a look at the flag: {step}");
            before = sample.at;
        }
        let mean = before.since(first.at).as_micros() / 50;
        assert!(mean.abs_diff(chip.borrow().cycle) < 50, "none twice, none lost: {mean}");
        assert!(clock.now().since(before) < Duration::from_millis(41));
    }
}

#[test]
fn current_into_the_battery_is_negative() {
    let (_, chip, mut battery) = bench(Config::default());
    chip.borrow_mut().registers[3] = (-250i16 << 3) as u16;
    let sample = block_on(battery.next()).expect("a sample");
    assert!((sample.data.current + 1.0).abs() < 1e-5);
    assert!((sample.data.power + 3.8).abs() < 1e-4);
}

#[test]
fn both_identifications_are_checked_and_an_impossible_shunt_is_refused() {
    for (register, found) in [(0xFE, 0x1234), (0xFF, 0xFFFF)] {
        let (_, chip, mut battery) = bench(Config::default());
        chip.borrow_mut().registers[register] = found;
        assert_eq!(block_on(battery.next()), Err(ChipError::Identification { found }));
    }
    for shunt_ohms in [0.0, -0.01, f32::NAN, f32::INFINITY] {
        let (_, _, mut battery) =
            bench(Config { shunts_ohms: [Some(shunt_ohms), Some(0.01), None], ..Config::default() });
        assert_eq!(block_on(battery.next()), Err(ChipError::InvalidConfiguration));
    }
    let (_, _, mut battery) = bench(Config { shunts_ohms: [Some(0.1), None, None], ..Config::default() });
    assert_eq!(block_on(battery.next()), Err(ChipError::InvalidConfiguration), "none on the battery's channel");
}

#[test]
fn three_supplies_are_measured_in_one_cycle() {
    let (_, chip, mut monitor) = bench(Config { shunts_ohms: [Some(0.1), Some(0.01), None], ..Config::default() });
    chip.borrow_mut().cycle *= 2;
    // 0.05 A over 100 mΩ: 125 counts; 5.0 V: 625 counts.
    (chip.borrow_mut().registers[1], chip.borrow_mut().registers[2]) = (125 << 3, 625 << 3);
    let mut before = block_on(monitor.next_of_all()).expect("a sample").at;
    for _ in 0..20 {
        let Sample { at, data } = block_on(monitor.next_of_all()).expect("a sample");
        let [Some(first), Some(battery), None] = data else { panic!("{data:?}") };
        assert!((first.current - 0.05).abs() < 1e-6 && (first.voltage - 5.0).abs() < 1e-5, "{first:?}");
        assert!((battery.current - 2.0).abs() < 1e-5 && (battery.voltage - 3.8).abs() < 1e-5, "{battery:?}");
        assert!(at.since(before).as_micros().abs_diff(chip.borrow().cycle) <= 2_200);
        before = at;
    }
    assert_eq!(chip.borrow().registers[0], 0x66DF, "channels 1 and 2");
    let battery = block_on(monitor.next()).expect("the next result").data;
    assert!((battery.power - 7.6).abs() < 1e-4, "{battery:?}");
}

#[test]
fn what_a_driver_is_made_of_is_given_back() {
    let (clock, chip, mut battery) = bench(Config::default());
    let before = block_on(battery.next()).expect("a sample").at;
    let (bus, its_clock) = battery.release();
    assert_eq!(its_clock.now(), clock.now());
    let mut again = Ina3221::new(bus, Ina3221::A0_GROUND, its_clock, Config::default());
    assert!(block_on(again.next()).expect("a sample").at > before);
    assert_eq!(chip.borrow().registers[0], 0x26DF);
}

#[test]
fn faults_are_bounded_and_healed() {
    let (clock, chip, mut battery) = bench(Config::default());
    block_on(battery.next()).expect("a sample");
    chip.borrow_mut().registers[0] = 0x7127;
    assert_eq!(block_on(battery.next()), Err(ChipError::Restarted));
    block_on(battery.next()).expect("a sample");
    for (fault, expected) in [(Fault::Nack, ChipError::Bus(Fault::Nack)), (Fault::Hang, ChipError::BusTimeout)] {
        chip.borrow_mut().fault = Some(fault);
        assert_eq!(block_on(battery.next()), Err(expected));
        block_on(battery.next()).expect("a sample");
    }
    let usual = chip.borrow().cycle;
    chip.borrow_mut().cycle = 100_000_000;
    let before = clock.now();
    assert_eq!(block_on(battery.next()), Err(ChipError::NoSample));
    assert!(clock.now().since(before) < Duration::from_micros(2 * usual + 5_000));
}

#[test]
fn a_cancelled_wait_loses_nothing() {
    let (clock, chip, mut battery) = bench(Config::default());
    let first = block_on(battery.next()).expect("a sample").at;
    clock.stop(true);
    cancel(battery.next());
    clock.stop(false);
    let second = block_on(battery.next()).expect("a sample").at;
    assert!(second.since(first).as_micros().abs_diff(chip.borrow().cycle) <= 2_200);
}

#[test]
fn a_late_reader_gets_a_result_whose_instant_is_known() {
    let (clock, chip, mut battery) = bench(Config::default());
    block_on(battery.next()).expect("a sample");
    for late in [130_000, 200_123, 1_000_000] {
        clock.advance(late);
        let at = block_on(battery.next()).expect("a sample").at;
        let (begun, cycle) = (chip.borrow().begun, chip.borrow().cycle);
        let into = (at.since(begun).as_micros() + cycle / 2) % cycle;
        assert!(into <= 2_200, "the middle of a cycle: {into}");
    }
}
