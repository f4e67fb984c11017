//! The VL53L3CX driver against two chips on one bus: pins, addresses, a measurement that takes its time, and faults.

mod common;

use common::{Clock, Fault, cancel, finish};
use embedded_hal::digital::{ErrorType as PinErrorType, OutputPin};
use embedded_hal_async::i2c::{self, I2c, Operation};
use stampfly_drivers::blocking::block_on;
use stampfly_drivers::chip::ChipError;
use stampfly_drivers::chip::vl53l3cx::{BootAddress, Config, DistanceMode, RangeStatus, Vl53l3cx};
use stampfly_drivers::{RangeFinder, SensorError, SensorErrorKind, Timebase};
use stampfly_types::Duration;
use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;

/// What the chip needs from the release of its reset.
const BOOT: u64 = 1_200;

struct Chip {
    clock: Clock,
    registers: Vec<u8>,
    /// Out of reset since.
    up: Option<u64>,
    address: u8,
    /// Resets so far.
    resets: u32,
    /// Measuring since, period.
    ranging: Option<(u64, u64)>,
    /// Measurements whose interrupt has been taken back.
    cleared: u64,
    /// Measurements that have been read.
    read: Vec<u64>,
    identification: [u8; 2],
    /// Status code, distance in mm.
    target: (u8, i16),
    blind: bool,
    boots: bool,
    /// How often the interrupt was looked at.
    looks: u32,
    /// A bit that changes on the way to the ranging parts' registers.
    flip: u8,
    /// The next clear of the interrupt is acknowledged and does nothing.
    deaf: bool,
    /// Until the interrupt is taken back the chip has this measurement and makes no other.
    held: Option<u64>,
    /// Faults of the next accesses to a register.
    faults: Vec<(u16, Fault)>,
}

impl Chip {
    fn new(clock: &Clock) -> Self {
        Self {
            clock: clock.clone(),
            registers: vec![0; 0x120],
            up: Some(0),
            address: 0x29,
            resets: 0,
            ranging: None,
            cleared: 0,
            read: Vec::new(),
            identification: [0xEA, 0xAA],
            target: (9, 1_234),
            blind: false,
            boots: true,
            looks: 0,
            flip: 0,
            deaf: false,
            held: None,
            faults: Vec::new(),
        }
    }

    /// What a loss of power does: everything forgotten, back at the first address.
    fn restart(&mut self) {
        self.registers.fill(0);
        self.registers[0x30] = 0x11;
        (self.address, self.ranging) = (0x29, None);
        self.up = self.up.map(|_| self.clock.now().as_micros());
    }

    /// Finished measurements, and when the newest was.
    fn measured(&self) -> (u64, u64) {
        if let Some(held) = self.held {
            return (held, 0);
        }
        let Some((begun, period)) = self.ranging.filter(|_| !self.blind) else { return (self.cleared, 0) };
        // One budget of 33 ms for the first, then one per period.
        let Some(since) = (self.clock.now().as_micros()).checked_sub(begun + 33_000) else { return (0, 0) };
        (1 + since / period, begun + 33_000 + since / period * period)
    }

    fn answers(&self, address: u8) -> bool {
        self.up.is_some_and(|up| self.clock.now().as_micros() >= up + BOOT) && self.address == address
    }

    fn write(&mut self, register: u16, data: &[u8]) {
        for (offset, value) in data.iter().enumerate() {
            self.registers[usize::from(register) + offset] = *value;
        }
        if register == 0x5E {
            self.registers[0x60] ^= core::mem::take(&mut self.flip);
        }
        match (register, data) {
            (0x0001, [address]) => self.address = *address,
            (0x0086, [1]) if core::mem::take(&mut self.deaf) => {}
            (0x0086, [1]) => {
                self.held = None;
                self.cleared = self.measured().0;
            }
            (0x0087, [0x40]) => {
                let ticks = u32::from_be_bytes(self.registers[0x6C..0x70].try_into().expect("four bytes"));
                assert_eq!(self.registers[0x30], 0x01, "configured");
                self.cleared = 0;
                self.ranging = Some((self.clock.now().as_micros(), u64::from(ticks) * 40_000 / 43 / 1_000));
            }
            (0x0087, [0x00]) => self.ranging = None,
            _ => {}
        }
    }

    fn read(&mut self, register: u16, into: &mut [u8]) {
        let (measured, _) = self.measured();
        self.registers[0x31] = u8::from(measured > self.cleared);
        self.registers[0xE5] = u8::from(self.boots);
        self.registers[0xDE..0xE0].copy_from_slice(&1_000u16.to_be_bytes());
        self.registers[0x10F..0x111].copy_from_slice(&self.identification);
        self.looks += u32::from(register == 0x30);
        if register == 0x89 {
            self.read.push(measured);
            assert_eq!(into.len(), 17, "a short read");
            self.registers[0x89] = self.target.0;
            self.registers[0x8B] = measured as u8;
            self.registers[0x92..0x94].copy_from_slice(&10u16.to_be_bytes());
            self.registers[0x96..0x98].copy_from_slice(&self.target.1.to_be_bytes());
        }
        into.copy_from_slice(&self.registers[usize::from(register)..][..into.len()]);
    }
}

type Shared = Rc<RefCell<Chip>>;

#[derive(Clone)]
struct Bus(Clock, [Shared; 2]);

impl i2c::ErrorType for Bus {
    type Error = Fault;
}

impl I2c for Bus {
    async fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), Fault> {
        let mut outcome = Err(Fault::Nack);
        let answering: Vec<&Shared> = self.1.iter().filter(|chip| chip.borrow().answers(address)).collect();
        assert!(answering.len() < 2, "two chips answer at {address:#04x}");
        for chip in answering {
            let mut chip = chip.borrow_mut();
            let [Operation::Write([high, low]), data] = operations else { panic!("not a register access") };
            let register = u16::from_be_bytes([*high, *low]);
            outcome = match chip.faults.iter().position(|fault| fault.0 == register) {
                Some(position) => Err(chip.faults.remove(position).1),
                None => Ok(()),
            };
            match data {
                _ if outcome.is_err() => {}
                Operation::Read(into) => chip.read(register, into),
                Operation::Write(data) => chip.write(register, data),
            }
        }
        finish(&self.0, outcome).await
    }
}

struct Xshut(Shared);

impl PinErrorType for Xshut {
    type Error = Infallible;
}

impl OutputPin for Xshut {
    fn set_low(&mut self) -> Result<(), Infallible> {
        let mut chip = self.0.borrow_mut();
        chip.restart();
        chip.resets += u32::from(chip.up.take().is_some());
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        let mut chip = self.0.borrow_mut();
        chip.up = Some(chip.clock.now().as_micros());
        Ok(())
    }
}

type Driver<'b> = Vl53l3cx<'b, Bus, Xshut, Clock>;

struct Bench {
    clock: Clock,
    chips: [Shared; 2],
    boot: BootAddress,
}

impl Bench {
    fn new() -> Self {
        let clock = Clock::new();
        let chips = [(); 2].map(|()| Rc::new(RefCell::new(Chip::new(&clock))));
        Self { clock, chips, boot: BootAddress::new() }
    }

    fn drivers_with(&self, config: Config) -> [Driver<'_>; 2] {
        [0, 1].map(|index| {
            let bus = Bus(self.clock.clone(), self.chips.clone());
            let pin = Xshut(self.chips[index].clone());
            Vl53l3cx::new(bus, pin, &self.boot, 0x30 + index as u8, self.clock.clone(), config)
        })
    }

    fn drivers(&self) -> [Driver<'_>; 2] {
        self.drivers_with(Config::default())
    }

    fn timed<T>(&self, call: impl Future<Output = T>) -> (T, Duration) {
        let begun = self.clock.now();
        (block_on(call), self.clock.now().since(begun))
    }
}

#[test]
fn two_on_a_bus_are_moved_one_by_one_and_range_side_by_side() {
    let bench = Bench::new();
    let [mut below, mut ahead] = bench.drivers();
    bench.chips[1].borrow_mut().target = (9, 500);
    let (first, time) = bench.timed(below.next());
    assert!(first.is_ok() && time < Duration::from_micros(80_000), "{first:?} after {time}");
    block_on(ahead.next()).expect("a sample");
    assert_eq!(bench.chips.each_ref().map(|chip| chip.borrow().address), [0x30, 0x31]);
    for _ in 0..30 {
        let (down, front) = (block_on(below.next()).expect("a sample"), block_on(ahead.next()).expect("a sample"));
        assert!((down.data.distance - 1.234).abs() < 1e-6 && (front.data.distance - 0.5).abs() < 1e-6);
        assert!(down.data.valid && front.data.valid);
        assert_eq!((down.data.sigma, down.data.status), (0.0025, 0));
    }
    assert_eq!(bench.chips.each_ref().map(|chip| chip.borrow().resets), [1, 1]);
}

#[test]
fn samples_come_at_30_hz_once_each_and_are_stamped_in_the_middle() {
    let bench = Bench::new();
    let [mut below, _] = bench.drivers();
    let first = block_on(below.next()).expect("a sample");
    assert!(!first.data.valid && first.data.status == 0, "nothing to check the first one against");
    let mut before = first.at;
    for _ in 0..300 {
        let sample = block_on(below.next()).expect("a sample");
        assert!(sample.at.since(before).as_micros().abs_diff(33_333) <= 2_200, "{}", sample.at.since(before));
        let (_, finished) = bench.chips[0].borrow().measured();
        assert!(sample.at.as_micros().abs_diff(finished - 16_500) <= 1_200, "{} and {finished}", sample.at);
        before = sample.at;
    }
    let mean = before.since(first.at).seconds() / 300.0;
    assert!((mean - 0.033333).abs() < 1e-4, "{mean}");
    let read = bench.chips[0].borrow().read.clone();
    assert!(read.windows(2).all(|pair| pair[0] != pair[1]), "no measurement twice");
}

#[test]
fn what_the_chip_does_not_vouch_for_is_a_sample_that_is_not_valid() {
    let bench = Bench::new();
    let [mut below, _] = bench.drivers_with(Config { offset: 0.01, ..Config::default() });
    block_on(below.next()).expect("a sample");
    for (code, millimetres, valid, status) in [
        (9, 1_000, true, RangeStatus::Valid),
        (9, 0, false, RangeStatus::Valid),
        (9, -5, false, RangeStatus::Valid),
        (9, 3_989, true, RangeStatus::Valid),
        (9, 4_100, false, RangeStatus::Valid),
        (4, 700, false, RangeStatus::SignalTooLow),
        (5, 700, false, RangeStatus::OutOfBounds),
        (6, 700, false, RangeStatus::SigmaTooHigh),
        (7, 700, false, RangeStatus::WrapAround),
        (1, 700, false, RangeStatus::Hardware),
        (19, 700, false, RangeStatus::NotCheckedForWrap),
    ] {
        bench.chips[0].borrow_mut().target = (code, millimetres);
        let sample = block_on(below.next()).expect("a sample");
        assert_eq!((sample.data.valid, sample.data.status), (valid, status.number()), "{millimetres} mm");
        assert_eq!(below.reading().map(|reading| reading.status()), Some(status));
        let expected = (f32::from(millimetres) / 1_000.0 + 0.01).max(0.0);
        assert!((sample.data.distance - expected).abs() < 1e-6, "the offset is added");
    }
}

#[test]
fn a_measurement_whose_clear_was_garbled_is_not_delivered_again() {
    let bench = Bench::new();
    let [mut below, _] = bench.drivers();
    block_on(below.next()).expect("a sample");
    for _ in 0..5 {
        bench.chips[0].borrow_mut().deaf = true;
        let before = block_on(below.next()).expect("a sample");
        let held = bench.chips[0].borrow().measured().0;
        bench.chips[0].borrow_mut().held = Some(held);
        let sample = block_on(below.next()).expect("a sample");
        assert!(below.reading().is_some_and(|reading| reading.count > held as u8), "another one");
        assert!(
            sample.at.since(before.at) > Duration::from_micros(50_000),
            "{} after the one before",
            sample.at.since(before.at)
        );
    }
}

#[test]
fn a_reader_that_comes_late_gets_a_fresh_measurement() {
    let bench = Bench::new();
    let [mut below, _] = bench.drivers();
    for late in [10_000, 20_000, 60_000, 123_456, 1_000_000] {
        block_on(below.next()).expect("a sample");
        bench.clock.advance(late);
        bench.chips[0].borrow_mut().looks = 0;
        let sample = block_on(below.next()).expect("a sample");
        let (age, looks) = (bench.clock.now().since(sample.at), bench.chips[0].borrow().looks);
        assert!(age < Duration::from_micros(19_500), "{age} after {late} us");
        assert!(looks <= if late <= 123_456 { 6 } else { 19 }, "{looks} looks after {late} us");
    }
}

#[test]
fn a_reader_that_comes_a_little_late_knows_when_the_measurement_was() {
    let bench = Bench::new();
    let [mut below, _] = bench.drivers();
    for round in 0..75 {
        block_on(below.next()).expect("a sample");
        bench.clock.advance(30_000 + round * 97);
        let sample = block_on(below.next()).expect("a sample");
        let (_, finished) = bench.chips[0].borrow().measured();
        assert!(
            sample.at.as_micros().abs_diff(finished - 16_500) <= 1_500,
            "{} and {finished} in round {round}",
            sample.at
        );
    }
}

#[test]
fn the_same_measurement_is_never_delivered_twice_whatever_happens_to_its_end() {
    let bench = Bench::new();
    let [mut below, _] = bench.drivers();
    block_on(below.next()).expect("a sample");
    // Read, but the chip was not told.
    bench.chips[0].borrow_mut().faults = vec![(0x86, Fault::Nack)];
    assert_eq!(block_on(below.next()), Err(ChipError::Bus(Fault::Nack)));
    block_on(below.next()).expect("a sample");
    // Cancelled in the read-out.
    bench.clock.advance(34_000);
    bench.chips[0].borrow_mut().faults = vec![(0x89, Fault::Hang)];
    bench.clock.stop(true);
    cancel(below.next());
    bench.clock.stop(false);
    assert!(bench.chips[0].borrow().faults.is_empty(), "it was the read-out that hung");
    let sample = block_on(below.next()).expect("a sample");
    assert!(bench.clock.now().since(sample.at) < Duration::from_micros(19_500));
    let read = bench.chips[0].borrow().read.clone();
    assert_eq!(read.len(), 4);
    assert!(read.windows(2).all(|pair| pair[0] < pair[1]), "{read:?}");
}

#[test]
fn a_chip_that_restarts_is_noticed_and_moved_again_without_its_neighbour() {
    let bench = Bench::new();
    let [mut below, mut ahead] = bench.drivers();
    block_on(below.next()).expect("a sample");
    block_on(ahead.next()).expect("a sample");
    bench.chips[0].borrow_mut().restart();
    let (outcome, time) = bench.timed(below.next());
    let error = outcome.expect_err("it is gone");
    assert_eq!((error, error.kind()), (ChipError::Restarted, SensorErrorKind::Restarted));
    assert!(time < Duration::from_micros(40_000), "{time}");
    block_on(ahead.next()).expect("the neighbour goes on");
    let (outcome, time) = bench.timed(below.next());
    assert!(outcome.is_ok() && time < Duration::from_micros(80_000), "{outcome:?} after {time}");
    block_on(ahead.next()).expect("the neighbour goes on");
    assert_eq!(bench.chips.each_ref().map(|chip| chip.borrow().resets), [2, 1]);
    assert_eq!(bench.chips.each_ref().map(|chip| chip.borrow().address), [0x30, 0x31]);
}

#[test]
fn two_that_restart_together_sort_themselves_out() {
    for first in [0, 1] {
        let bench = Bench::new();
        let mut drivers = bench.drivers();
        for driver in &mut drivers {
            block_on(driver.next()).expect("a sample");
        }
        for chip in &bench.chips {
            chip.borrow_mut().restart();
        }
        bench.clock.advance(2_000);
        // The emulated bus fails this test when both ever answer at once. They do until the first is in reset, so
        // nobody may talk to the boot address before that.
        let outcomes: Vec<_> = (0..6).map(|turn| block_on(drivers[(first + turn) % 2].next())).collect();
        assert_eq!(outcomes[0], Err(ChipError::Restarted));
        assert_eq!(outcomes[1], Err(ChipError::Restarted));
        assert_eq!(outcomes[2], Err(ChipError::AddressTaken), "the other one is there");
        assert!(outcomes[3].is_ok() && outcomes[4].is_ok() && outcomes[5].is_ok(), "{outcomes:?}");
        assert_eq!(bench.chips.each_ref().map(|chip| chip.borrow().address), [0x30, 0x31]);
    }
}

#[test]
fn a_start_that_is_cancelled_leaves_the_boot_address_free() {
    let bench = Bench::new();
    let [mut below, mut ahead] = bench.drivers();
    bench.clock.stop(true);
    cancel(below.next());
    assert!(!bench.boot.is_taken());
    bench.clock.stop(false);
    assert!(bench.chips[0].borrow().up.is_none(), "back in reset");
    block_on(ahead.next()).expect("a sample");
    block_on(below.next()).expect("a sample");
}

#[test]
fn one_refusal_is_a_glitch() {
    let bench = Bench::new();
    let [mut below, _] = bench.drivers();
    block_on(below.next()).expect("a sample");
    bench.chips[0].borrow_mut().faults = vec![(0x30, Fault::Nack)];
    assert!(block_on(below.next()).is_ok());
    assert_eq!(bench.chips[0].borrow().resets, 1);
}

#[test]
fn a_chip_that_sees_nothing_new_times_out_and_is_set_up_again() {
    let bench = Bench::new();
    let [mut below, _] = bench.drivers();
    block_on(below.next()).expect("a sample");
    bench.chips[0].borrow_mut().blind = true;
    let (outcome, time) = bench.timed(below.next());
    assert_eq!(outcome, Err(ChipError::NoSample));
    assert!(time < Duration::from_micros(2 * 33_333 + 20_000 + 33_333), "{time}");
    let (outcome, time) = bench.timed(below.next());
    assert_eq!(outcome, Err(ChipError::NoSample));
    assert!(time < Duration::from_micros(4 * 33_333 + 350_000), "{time}");
    bench.chips[0].borrow_mut().blind = false;
    assert!(block_on(below.next()).is_ok());
}

#[test]
fn a_chip_that_lost_its_configuration_but_not_its_address_is_noticed() {
    let bench = Bench::new();
    let [mut below, _] = bench.drivers();
    block_on(below.next()).expect("a sample");
    bench.chips[0].borrow_mut().registers[0x30] = 0x11;
    assert_eq!(block_on(below.next()), Err(ChipError::Restarted));
    assert!(block_on(below.next()).is_ok());
}

#[test]
fn a_chip_that_is_not_there_or_does_not_start_or_is_another_ends_in_time() {
    let bench = Bench::new();
    let [mut below, _] = bench.drivers();
    bench.chips[0].borrow_mut().boots = false;
    let (outcome, time) = bench.timed(below.next());
    assert_eq!(outcome, Err(ChipError::Configuration { status: 0 }));
    assert!(time < Duration::from_micros(110_000), "{time}");
    assert!(bench.chips[0].borrow().up.is_none(), "kept in reset");

    bench.chips[0].borrow_mut().boots = true;
    bench.chips[0].borrow_mut().identification = [0xEE, 0xAA];
    assert_eq!(block_on(below.next()), Err(ChipError::Identification { found: 0xEEAA }), "a VL53L0X");
    for model in [0xEA, 0xEB, 0xEC] {
        bench.chips[0].borrow_mut().identification = [model, 0xAA];
        block_on(below.start()).expect("a VL53L3CX");
    }

    let clock = bench.clock.clone();
    bench.chips[0].borrow_mut().address = 0x77;
    let nobody = Rc::new(RefCell::new(Chip { up: None, ..Chip::new(&clock) }));
    let bus = Bus(clock.clone(), bench.chips.clone());
    let boot = BootAddress::new();
    let mut absent = Vl53l3cx::new(bus, Xshut(nobody), &boot, 0x32, clock, Config::default());
    let (outcome, time) = bench.timed(absent.next());
    assert_eq!(outcome, Err(ChipError::Bus(Fault::Nack)));
    assert!(time < Duration::from_micros(110_000), "{time}");
}

#[test]
fn a_bus_that_never_answers_ends_every_call_in_time() {
    let bench = Bench::new();
    let [mut below, _] = bench.drivers();
    block_on(below.next()).expect("a sample");
    bench.chips[0].borrow_mut().faults = vec![(0x30, Fault::Hang)];
    let (outcome, time) = bench.timed(below.next());
    assert_eq!(outcome, Err(ChipError::BusTimeout));
    assert!(time < Duration::from_micros(33_333 + 12_000), "{time}");
    assert!(block_on(below.next()).is_ok());
}

#[test]
fn impossible_configurations_are_not_sent() {
    for config in [
        Config { budget: Duration::from_micros(20_000), ..Config::default() },
        Config { period: Duration::from_micros(30_000), ..Config::default() },
        Config { mode: DistanceMode::Short, offset: f32::INFINITY, ..Config::default() },
    ] {
        let bench = Bench::new();
        let [mut below, _] = bench.drivers_with(config);
        assert_eq!(block_on(below.next()), Err(ChipError::InvalidConfiguration));
        assert!(bench.chips[0].borrow().up.is_none());
    }
}

#[test]
fn a_driver_that_exists_holds_its_chip_in_reset() {
    let bench = Bench::new();
    // Somebody who forgets the second sensor finds it at the boot address.
    let bus = Bus(bench.clock.clone(), bench.chips.clone());
    let pin = Xshut(bench.chips[0].clone());
    let mut below = Vl53l3cx::new(bus, pin, &bench.boot, 0x30, bench.clock.clone(), Config::default());
    assert_eq!(block_on(below.next()), Err(ChipError::AddressTaken));
    let [mut below, mut ahead] = bench.drivers();
    assert!(block_on(below.next()).is_ok() && block_on(ahead.next()).is_ok());
}

#[test]
fn a_configuration_that_arrives_garbled_is_told_and_sent_again() {
    let bench = Bench::new();
    let [mut below, _] = bench.drivers();
    bench.chips[0].borrow_mut().flip = 0x08;
    assert_eq!(block_on(below.next()), Err(ChipError::Configuration { status: 0x07 }));
    assert!(block_on(below.next()).is_ok());
}
