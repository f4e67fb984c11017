//! Embassy's clock on a PC: waits have the requested length, and a transfer that hangs is given up.

// The clock's timer queue requires an implementation of critical sections.
use critical_section as _;
use embedded_hal_async::delay::DelayNs;
use stampfly_driver_core::blocking::block_on;
use stampfly_driver_core::chip::{ChipError, bounded};
use stampfly_driver_core::{EmbassyClock, Timebase};
use stampfly_types::Duration;
use std::convert::Infallible;

#[test]
fn no_wait_is_shorter_than_asked() {
    let mut clock = EmbassyClock;
    for _ in 0..50 {
        let begun = std::time::Instant::now();
        block_on(clock.delay_us(300));
        assert!(begun.elapsed().as_micros() >= 300, "{:?}", begun.elapsed());
        let begun = clock.now();
        block_on(clock.delay_ns(1));
        assert!(clock.now() > begun, "a tick has passed");
    }
    let begun = clock.now();
    block_on(clock.delay_ms(3));
    assert!(clock.now().since(begun) >= Duration::from_millis(3));
}

#[test]
fn a_transfer_that_hangs_is_given_up() {
    let begun = EmbassyClock.now();
    let hangs = std::future::pending::<Result<(), Infallible>>();
    let outcome = block_on(bounded(&mut EmbassyClock, Duration::from_millis(2), hangs));
    assert_eq!(outcome, Err(ChipError::BusTimeout));
    assert!(EmbassyClock.now().since(begun) >= Duration::from_millis(2));
}
