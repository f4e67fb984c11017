//! A chip on a board that does not connect XSHUT.

use crate::bench::{Bench, Xshut};
use stampfly_driver_core::blocking::block_on;
use stampfly_driver_fakes::closure::{Fault, cancel};
use stampfly_vl53l3cx::{BootAddress, ChipError, Config, RangeFinder, Timebase, Vl53l3cx};

/// Addresses of chip and driver: at the boot address, at another one, and after a reset at either.
const CASES: [(u8, u8, bool); 6] = [
    (0x29, 0x29, false),
    (0x29, 0x30, false),
    (0x30, 0x30, false),
    (0x30, 0x30, true),
    (0x29, 0x30, true),
    (0x29, 0x29, true),
];

/// A bench whose second chip stays in reset.
fn alone() -> Bench {
    let bench = Bench::new();
    bench.chips[1].borrow_mut().up = None;
    bench
}

#[test]
fn it_is_found_and_reset_wherever_it_is() {
    for (is, wanted, keeps_address) in CASES {
        let bench = alone();
        {
            let mut chip = bench.chips[0].borrow_mut();
            (chip.address, chip.keeps_address, chip.registers[0x30]) = (is, keeps_address, 0xA5);
        }
        let mut sensor = bench.without_pin(wanted);
        assert!(!block_on(sensor.next()).expect("a measurement").data.valid);
        assert_eq!(block_on(sensor.next()).expect("a measurement").data.distance, 1.234);
        let chip = bench.chips[0].borrow();
        assert_eq!((chip.address, chip.resets), (wanted, 1), "was at {is:#04x}");
        assert!(!bench.boot.is_taken());
    }
}

#[test]
fn one_that_lost_its_power_is_found_again() {
    let bench = alone();
    let mut sensor = bench.without_pin(0x30);
    block_on(sensor.next()).expect("a measurement");
    bench.clock.advance(5_000);
    bench.chips[0].borrow_mut().restart();
    bench.clock.advance(5_000);
    assert_eq!(block_on(sensor.next()), Err(ChipError::Restarted));
    assert!(block_on(sensor.next()).is_ok());
}

#[test]
fn a_start_dropped_while_the_chip_stands_still_leaves_it_to_the_next() {
    let bench = alone();
    let mut sensor = bench.without_pin(0x30);
    // Delays return, except for the pause of the reset.
    bench.chips[0].borrow_mut().stops_clock = true;
    cancel(sensor.start());
    assert!(bench.chips[0].borrow().held_by_register);
    bench.clock.stop(false);
    assert!(block_on(sensor.next()).is_ok());
    assert!(!bench.chips[0].borrow().held_by_register && !bench.boot.is_taken());
}

#[test]
fn one_that_has_its_power_since_just_now_is_waited_for() {
    let bench = alone();
    bench.chips[0].borrow_mut().up = Some(bench.clock.now().as_micros());
    let mut sensor = bench.without_pin(0x29);
    assert!(block_on(sensor.next()).is_ok());
}

#[test]
fn nobody_there_is_said_at_once() {
    let bench = alone();
    bench.chips[0].borrow_mut().up = None;
    let mut sensor = bench.without_pin(0x30);
    let (outcome, time) = bench.timed(sensor.next());
    assert_eq!(outcome, Err(ChipError::Bus(Fault::Nack)));
    assert!(time.as_micros() < 10_000, "{time}");
}

#[test]
fn a_neighbour_that_came_back_at_the_first_address_is_not_met_there() {
    let bench = Bench::new();
    bench.chips[0].borrow_mut().address = 0x30;
    let mut sensor = bench.without_pin(0x30);
    assert_eq!(block_on(sensor.start()), Err(ChipError::AddressTaken));
    assert_eq!(bench.chips[0].borrow().resets, 0);
    // The neighbour's own driver moves it away.
    let mut neighbour = Vl53l3cx::new(
        crate::bench::Bus(bench.clock.clone(), bench.chips.clone()),
        Xshut(bench.chips[1].clone()),
        &bench.boot,
        0x31,
        bench.clock.clone(),
        Config::default(),
    );
    assert!(block_on(neighbour.next()).is_ok());
    assert!(block_on(sensor.next()).is_ok());
    assert!(block_on(neighbour.next()).is_ok());
}

#[test]
fn the_first_address_may_be_a_static() {
    static BOOT: BootAddress = BootAddress::new();
    fn lives_for_ever<T: Send + Sync + 'static>(_: T) {}
    lives_for_ever(&BOOT);
    assert!(!BOOT.is_taken());
}
