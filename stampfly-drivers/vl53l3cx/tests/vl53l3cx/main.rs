//! Tests of the VL53L3CX driver on two chips on one bus: pins, addresses, measurements in virtual
//! time, and faults.

mod bench;
mod neighbours;
mod no_pin;

use bench::{Bench, Bus, Chip, Xshut};
use stampfly_driver_core::blocking::block_on;
use stampfly_driver_core::chip::ChipError;
use stampfly_driver_core::{RangeFinder, Timebase};
use stampfly_driver_fakes::closure::{Fault, cancel};
use stampfly_types::Duration;
use stampfly_vl53l3cx::{BootAddress, Config, DistanceMode, RangeStatus, Vl53l3cx};
use std::cell::RefCell;
use std::rc::Rc;

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
    // The measurement was read, but the clear failed.
    bench.chips[0].borrow_mut().faults = vec![(0x86, Fault::Nack)];
    assert_eq!(block_on(below.next()), Err(ChipError::Bus(Fault::Nack)));
    block_on(below.next()).expect("a sample");
    // Dropped during the read.
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
fn a_configuration_that_arrives_garbled_is_told_and_sent_again() {
    let bench = Bench::new();
    let [mut below, _] = bench.drivers();
    bench.chips[0].borrow_mut().flip = 0x08;
    assert_eq!(block_on(below.next()), Err(ChipError::Configuration { status: 0x07 }));
    assert!(block_on(below.next()).is_ok());
}

#[test]
fn what_the_factory_found_missing_is_added_by_the_chip() {
    for missing in [0i16, 5, -12] {
        let bench = Bench::new();
        bench.chips[0].borrow_mut().factory = missing;
        let [mut below, _] = bench.drivers();
        block_on(below.next()).expect("a sample");
        let chip = bench.chips[0].borrow();
        let added = i16::from_be_bytes([chip.registers[0x1E], chip.registers[0x1F]]);
        assert_eq!(added, 4 * missing, "in quarters of a millimetre");
    }
}
