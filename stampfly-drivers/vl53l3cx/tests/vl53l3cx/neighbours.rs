//! Two chips on a bus: their moves, and the effect of one chip's restart on the other.

use super::bench::{Bench, Bus, Xshut};
use stampfly_driver_core::blocking::block_on;
use stampfly_driver_core::chip::ChipError;
use stampfly_driver_core::{RangeFinder, SensorError, SensorErrorKind};
use stampfly_driver_fakes::closure::cancel;
use stampfly_types::Duration;
use stampfly_vl53l3cx::{Config, Vl53l3cx};

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
        // The emulated bus fails this test when both chips answer at the same time. They would
        // until the first is in reset, so no driver may use the boot address before that.
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
fn a_driver_that_exists_holds_its_chip_in_reset() {
    let bench = Bench::new();
    // If no driver is created for the second sensor, that sensor is found at the boot address.
    let bus = Bus(bench.clock.clone(), bench.chips.clone());
    let pin = Xshut(bench.chips[0].clone());
    let mut below = Vl53l3cx::new(bus, pin, &bench.boot, 0x30, bench.clock.clone(), Config::default());
    assert_eq!(block_on(below.next()), Err(ChipError::AddressTaken));
    let [mut below, mut ahead] = bench.drivers();
    assert!(block_on(below.next()).is_ok() && block_on(ahead.next()).is_ok());
}
