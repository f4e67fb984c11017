//! Tests of the PMW3901 driver on a chip with register banks that enforces the minimum pauses.

mod start_sequence;

use embedded_hal_async::spi::{self, Operation};
use stampfly_driver_core::blocking::block_on;
use stampfly_driver_core::chip::{Axis, AxisMap, ChipError, TransferLimit};
use stampfly_driver_core::{OpticalFlow, Timebase};
use stampfly_driver_fakes::closure::{Clock, Fault, TRANSFER, cancel, finish};
use stampfly_pmw3901::{Config, Pmw3901, codec};
use stampfly_types::{Duration, Instant};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

/// Mounting of the chip, which always faces down: body = (y, −x) of the chip.
const AXES: AxisMap = AxisMap::new(Axis::PlusY, Axis::MinusX, Axis::PlusZ).expect("a rotation");

struct Chip {
    registers: BTreeMap<(u8, u8), u8>,
    bank: u8,
    writes: Vec<(u8, u8)>,
    /// Counts that have not been read.
    counts: [i16; 2],
    quality: u8,
    shutter: u8,
    absent: bool,
    fault: Option<Fault>,
    /// Earliest time of the next access.
    ready: Instant,
    /// Number of further reads of register 0x47 that return "not ready".
    refusals: u32,
    /// A register that is write-only.
    forgets_witness: bool,
    /// Number of writes until one arrives with another value.
    garbles: Option<u32>,
}

impl Chip {
    fn new() -> Self {
        let registers = [
            ((0, 0x00), 0x49),
            ((0, 0x5F), 0xB6),
            ((0x0E, 0x73), 0x00),
            ((0x0E, 0x67), 0x00),
            ((0x0E, 0x70), 20),
            ((0x0E, 0x71), 80),
        ];
        Self {
            registers: registers.into(),
            bank: 0,
            writes: Vec::new(),
            counts: [0; 2],
            quality: 100,
            shutter: 2,
            absent: false,
            fault: None,
            ready: Instant::ZERO,
            refusals: 0,
            forgets_witness: false,
            garbles: None,
        }
    }

    fn write(&mut self, register: u8, value: u8) {
        self.writes.push((register, value));
        let garbled = self.garbles == Some(0);
        self.garbles = self.garbles.and_then(|writes| writes.checked_sub(1));
        let value = value ^ if garbled { 0x04 } else { 0 };
        match register {
            0x7F => self.bank = value,
            _ => drop(self.registers.insert((self.bank, register), value)),
        }
    }

    fn read(&mut self, register: u8, into: &mut [u8]) {
        if self.absent {
            return into.fill(0xFF);
        }
        match (self.bank, register) {
            (0, 0x16) => {
                let [x, y] = self.counts.map(i16::to_le_bytes);
                let moved = if self.counts == [0; 2] { 0 } else { 0x80 };
                into.copy_from_slice(&[moved, 0xBF, x[0], x[1], y[0], y[1], self.quality, 9, 90, 9, self.shutter, 7]);
                self.counts = [0; 2];
            }
            (0x0E, 0x47) => {
                into[0] = if self.refusals == 0 { 8 } else { 0 };
                self.refusals = self.refusals.saturating_sub(1);
            }
            (0, 0x4E) if self.forgets_witness => into[0] = 0,
            // A register that was never written has no valid setting.
            key => into[0] = self.registers.get(&key).copied().unwrap_or(0xEE),
        }
    }
}

struct Device(Clock, Rc<RefCell<Chip>>);

impl spi::ErrorType for Device {
    type Error = Fault;
}

impl spi::SpiDevice for Device {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Fault> {
        let outcome = {
            let mut chip = self.1.borrow_mut();
            assert!(self.0.now() >= chip.ready, "the pause between two accesses is too short");
            let fault = chip.fault.take();
            let pause = match operations {
                [Operation::Write([register, value]), Operation::DelayNs(35_000..)] if register & 0x80 != 0 => {
                    chip.write(register & 0x7F, *value);
                    45
                }
                [Operation::Write([register]), Operation::DelayNs(35_000..), Operation::Read(into)] => {
                    chip.read(*register, into);
                    20
                }
                other => panic!("not an access that keeps the data sheet's times: {other:?}"),
            };
            chip.ready = self.0.now() + Duration::from_micros(TRANSFER + pause);
            fault.map_or(Ok(()), Err)
        };
        finish(&self.0, outcome).await
    }
}

type Shared = Rc<RefCell<Chip>>;

fn bench() -> (Clock, Shared, Pmw3901<Device, Clock>) {
    let (clock, chip) = (Clock::default(), Rc::new(RefCell::new(Chip::new())));
    let device = Device(clock.clone(), chip.clone());
    let driver =
        Pmw3901::new(device, clock.clone(), AXES, Config::default()).with_transfer_limit(TransferLimit::SPI_GUEST);
    (clock, chip, driver)
}

#[test]
fn the_whole_list_is_written_with_the_chips_own_calibration() {
    let (_, chip, mut flow) = bench();
    block_on(flow.start()).expect("starts");
    let chip = chip.borrow();
    assert_eq!(chip.writes[..2], [(0x7F, 0x00), (0x3A, 0x5A)]);
    assert_eq!(chip.writes[2..7], codec::PREPARE);
    assert_eq!(chip.writes[7], (0x48, 0x02));
    assert_eq!(chip.writes[8..13], codec::PREPARE_CALIBRATION);
    assert_eq!(chip.writes[13..19], [(0x7F, 0), (0x61, 0xAD), (0x51, 0x70), (0x7F, 0x0E), (0x70, 34), (0x71, 36)]);
    let rest: Vec<_> = codec::PERFORMANCE
        .iter()
        .filter_map(|step| match step {
            codec::Step::Write(register, value) => Some((*register, *value)),
            codec::Step::Wait(_) => None,
        })
        .collect();
    assert_eq!(chip.writes[19..][..rest.len()], rest);
    assert!(chip.writes[19 + rest.len()..].iter().all(|(register, _)| *register == 0x7F), "only read back after that");
    assert_eq!(chip.bank, 0);
}

#[test]
fn a_chip_with_a_calibration_of_its_own_keeps_it() {
    let (_, chip, mut flow) = bench();
    chip.borrow_mut().registers.insert((0x0E, 0x73), 1);
    chip.borrow_mut().registers.insert((0x0E, 0x67), 0x80);
    block_on(flow.start()).expect("starts");
    let chip = chip.borrow();
    assert_eq!(chip.writes[7], (0x48, 0x04));
    assert!(!chip.writes.iter().any(|write| write.0 == 0x51 && write.1 != 0x7B));
}

#[test]
fn it_asks_again_for_the_calibration_but_not_for_ever() {
    let (_, chip, mut flow) = bench();
    chip.borrow_mut().refusals = 3;
    block_on(flow.start()).expect("starts at the fourth attempt");
    let (_, chip, mut flow) = bench();
    chip.borrow_mut().refusals = 1_000;
    assert_eq!(block_on(flow.start()), Err(ChipError::Configuration { status: 0 }));
}

#[test]
fn both_identifications_have_to_match() {
    let (_, chip, mut flow) = bench();
    chip.borrow_mut().registers.insert((0, 0x5F), 0x00);
    assert_eq!(block_on(flow.next()), Err(ChipError::Identification { found: 0x4900 }));
    let (_, chip, mut flow) = bench();
    chip.borrow_mut().absent = true;
    assert_eq!(block_on(flow.next()), Err(ChipError::Identification { found: 0xFFFF }));
}

#[test]
fn every_count_is_delivered_once_in_body_axes_and_radians() {
    let (clock, chip, mut flow) = bench();
    block_on(flow.start()).expect("starts");
    chip.borrow_mut().counts = [1_000, 1_000];
    let mut total = [0.0; 2];
    let mut before = None;
    for round in 0..100 {
        if round == 50 {
            clock.advance(35_000);
        }
        let sample = block_on(flow.next()).expect("a sample");
        if let Some(before) = before {
            assert_eq!(sample.data.interval, sample.at.since(before).seconds());
        }
        assert!((sample.data.interval - if round == 50 { 0.035 } else { 0.01 }).abs() < 1e-4);
        before = Some(sample.at);
        total[0] += sample.data.delta_x;
        total[1] += sample.data.delta_y;
        chip.borrow_mut().counts = [2, -3];
    }
    // Counts before the first interval are discarded; 99 reads carry (2, −3): body = (y, −x).
    assert!((total[0] + 99.0 * 3.0 * 0.00222).abs() < 1e-4, "{total:?}");
    assert!((total[1] + 99.0 * 2.0 * 0.00222).abs() < 1e-4, "{total:?}");
}

#[test]
fn blind_samples_are_delivered_but_not_vouched_for() {
    let (_, chip, mut flow) = bench();
    assert!(block_on(flow.next()).expect("a sample").data.valid);
    chip.borrow_mut().quality = 10;
    let sample = block_on(flow.next()).expect("a sample");
    assert!(!sample.data.valid && sample.data.quality == 10);
    chip.borrow_mut().counts = [4, 4];
    assert!(block_on(flow.next()).expect("a sample").data.valid);
    chip.borrow_mut().counts = [4, 4];
    chip.borrow_mut().shutter = 0x1F;
    assert!(!block_on(flow.next()).expect("a sample").data.valid);
}

#[test]
fn after_a_failed_or_cancelled_read_a_new_interval_begins() {
    let (clock, chip, mut flow) = bench();
    block_on(flow.next()).expect("a sample");
    for fault in [Fault::Nack, Fault::Hang] {
        chip.borrow_mut().fault = Some(fault);
        let before = clock.now();
        let error = block_on(flow.next()).expect_err("the bus failed");
        assert_eq!(error, if fault == Fault::Nack { ChipError::Bus(fault) } else { ChipError::BusTimeout });
        assert!(clock.now().since(before) <= Duration::from_millis(21));
        clock.advance(100_000);
        chip.borrow_mut().counts = [500, 500];
        let sample = block_on(flow.next()).expect("a sample");
        assert_eq!((sample.data.delta_x, sample.data.delta_y), (0.0, 0.0), "counted while nobody knew since when");
        assert!(sample.data.interval < 0.011);
    }
    clock.advance(10_000);
    chip.borrow_mut().fault = Some(Fault::Hang);
    clock.stop(true);
    cancel(flow.next());
    clock.stop(false);
    clock.advance(100);
    chip.borrow_mut().counts = [500, 500];
    let sample = block_on(flow.next()).expect("a sample");
    assert_eq!((sample.data.delta_x, sample.data.delta_y), (0.0, 0.0));
}

#[test]
fn a_chip_that_falls_off_the_bus_is_set_up_again_when_it_is_back() {
    let (_, chip, mut flow) = bench();
    block_on(flow.next()).expect("a sample");
    chip.borrow_mut().absent = true;
    assert_eq!(block_on(flow.next()), Err(ChipError::Data));
    assert_eq!(block_on(flow.next()), Err(ChipError::Identification { found: 0xFFFF }));
    chip.borrow_mut().absent = false;
    chip.borrow_mut().writes.clear();
    block_on(flow.next()).expect("a sample");
    assert!(chip.borrow().writes.len() > 70);
}

#[test]
fn a_chip_that_restarts_in_flight_is_noticed_within_a_second_and_set_up_again() {
    let (clock, chip, mut flow) = bench();
    for _ in 0..150 {
        block_on(flow.next()).expect("a sample");
    }
    // Restarted with its default values, and counting.
    chip.borrow_mut().registers = Chip::new().registers;
    let begun = clock.now();
    let error = loop {
        if let Err(error) = block_on(flow.next()) {
            break error;
        }
    };
    assert_eq!(error, ChipError::Restarted);
    assert!(clock.now().since(begun) <= Duration::from_micros(1_011_000));
    chip.borrow_mut().writes.clear();
    block_on(flow.next()).expect("a sample");
    assert!(chip.borrow().writes.len() > 70);
}

#[test]
fn a_chip_that_does_not_give_the_witness_back_is_left_alone() {
    let (_, chip, mut flow) = bench();
    chip.borrow_mut().forgets_witness = true;
    for _ in 0..300 {
        block_on(flow.next()).expect("a sample");
    }
}

#[test]
fn a_setting_that_is_garbled_on_its_way_is_noticed_and_the_list_written_again() {
    // The list: 73 writes after the first nineteen.
    for write in 19..19 + 73 {
        let (_, chip, mut flow) = bench();
        chip.borrow_mut().garbles = Some(write);
        block_on(flow.start()).expect("starts");
        let chip = chip.borrow();
        for (bank, register, value) in codec::settings() {
            assert_eq!(chip.registers.get(&(bank, register)), Some(&value), "write {write}: {register:#04x} of {bank}");
        }
    }
}

#[test]
fn a_chip_that_sees_nothing_for_ten_seconds_is_set_up_again() {
    let (clock, chip, mut flow) = bench();
    block_on(flow.next()).expect("a sample");
    chip.borrow_mut().quality = 0;
    let begun = clock.now();
    let error = loop {
        if let Err(error) = block_on(flow.next()) {
            break error;
        }
    };
    assert_eq!(error, ChipError::NoSample);
    assert!((9_900_000..10_100_000).contains(&clock.now().since(begun).as_micros()), "{}", clock.now().since(begun));
    chip.borrow_mut().writes.clear();
    block_on(flow.next()).expect("a sample, blind or not");
    assert!(chip.borrow().writes.len() > 70);
}
