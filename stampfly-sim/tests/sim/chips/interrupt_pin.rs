//! Interrupt pin 1 of the BMI270, on virtual time.

use super::bmi270::Chip;
use core::cell::RefCell;
use embedded_hal::digital::InputPin;
use embedded_hal_async::digital::Wait;
use stampfly_sim::time::{Tasks, block_on};
use stampfly_types::Duration;

/// Period of the highest rate, within the tolerance of the chip's clock, µs.
const PERIOD: core::ops::RangeInclusive<u64> = 612..=638;
const FRAME: u8 = 13;

/// A running chip with an empty FIFO and these settings of pin, latch and map.
fn chip(pin: u8, latch: u8, map: u8, watermark: u8) -> Chip {
    let mut chip = Chip::running();
    for (register, value) in [(0x46, watermark), (0x47, 0), (0x53, pin), (0x55, latch), (0x58, map)] {
        chip.write(register, value);
        chip.wait(2);
    }
    chip.wait(100_000);
    chip.write(0x7E, 0xB0);
    chip.wait(2);
    chip.read::<1>(0x1D);
    chip
}

fn high(chip: &Chip) -> bool {
    chip.port.interrupt_pin().is_high().unwrap()
}

/// Waits with `waiting` and returns the duration, µs.
fn timed(chip: &Chip, waiting: impl Future<Output = Result<(), core::convert::Infallible>>) -> u64 {
    let begun = chip.simulation.clock.now();
    block_on(&chip.simulation.clock, waiting).unwrap();
    chip.simulation.clock.now().since(begun).as_micros()
}

#[test]
fn it_is_pulled_up_until_it_is_an_output_and_then_has_the_chosen_polarity() {
    let mut chip = chip(0x00, 0, 0x02, 4 * FRAME);
    assert!(high(&chip), "no output");
    chip.write(0x53, 0x0A);
    assert!(!high(&chip), "active high, nothing to say");
    chip.wait(2);
    chip.write(0x53, 0x08);
    assert!(high(&chip), "active low, nothing to say");
    chip.wait(4 * 640);
    assert!(!high(&chip), "active low, four frames");
    chip.write(0x53, 0x0E);
    assert!(high(&chip), "active high, open drain");
    chip.attached.reset();
    assert!(high(&chip), "no output after a reset");
}

#[test]
fn the_watermark_is_told_at_its_sample_and_taken_back_by_reading() {
    let mut chip = chip(0x0A, 0, 0x02, 4 * FRAME);
    let mut pin = chip.port.interrupt_pin();
    block_on(&chip.simulation.clock, pin.wait_for_high()).unwrap();
    assert_eq!(chip.read::<2>(0x24), [4 * FRAME, 0], "at the fourth frame and not later");
    assert_eq!(chip.read::<1>(0x1D)[0] & 2, 2);
    for _ in 0..50 {
        chip.read_fifo(usize::from(4 * FRAME));
        assert!(!high(&chip));
        // Reading has taken part of the period.
        let took = timed(&chip, pin.wait_for_rising_edge());
        assert!((4 * PERIOD.start() - 120..=4 * PERIOD.end()).contains(&took), "{took} µs");
    }
}

#[test]
fn data_ready_is_a_pulse_per_sample() {
    let chip = chip(0x0A, 0, 0x04, 0);
    let mut pin = chip.port.interrupt_pin();
    block_on(&chip.simulation.clock, pin.wait_for_rising_edge()).unwrap();
    for _ in 0..10 {
        let low = timed(&chip, pin.wait_for_falling_edge());
        let rise = timed(&chip, pin.wait_for_any_edge());
        assert!(PERIOD.contains(&(low + rise)) && low == 312, "{low} µs high, {rise} µs low");
    }
    assert_eq!(timed(&chip, pin.wait_for_low()), 312);
}

#[test]
fn a_latched_one_stays_until_its_status_is_read() {
    let mut chip = chip(0x0A, 1, 0x04, 0);
    chip.wait(10_000);
    assert!(high(&chip));
    chip.wait(400);
    chip.read::<1>(0x1D);
    chip.wait(200);
    let mut pin = chip.port.interrupt_pin();
    if pin.is_low().unwrap() {
        assert!(timed(&chip, pin.wait_for_high()) <= *PERIOD.end());
    }
    chip.wait(5_000);
    assert!(high(&chip), "no pulse any more");
}

#[test]
fn a_task_that_waits_runs_at_the_instant_of_the_edge_and_after_transfers() {
    let mut chip = chip(0x0A, 0, 0x00, 4 * FRAME);
    let (clock, mut pin) = (chip.simulation.clock.clone(), chip.port.interrupt_pin());
    let begun = clock.now();
    let woken = RefCell::new(Vec::new());
    let (log, time) = (&woken, &clock);
    let mut tasks = Tasks::new(clock.clone());
    tasks.spawn(async move {
        pin.wait_for_high().await.unwrap();
        log.borrow_mut().push(time.now());
        pin.wait_for_low().await.unwrap();
        log.borrow_mut().push(time.now());
    });
    tasks.spawn(async move {
        use embedded_hal_async::spi::SpiDevice;
        time.sleep_until(begun + Duration::from_micros(10_000)).await;
        chip.port.write(&[0x58, 0x02]).await.unwrap();
        log.borrow_mut().push(time.now());
        time.sleep_until(begun + Duration::from_micros(20_000)).await;
        chip.port.write(&[0x7E, 0xB0]).await.unwrap();
        log.borrow_mut().push(time.now());
    });
    tasks.run_until(begun + Duration::from_micros(30_000));
    drop(tasks);
    let [mapped, rose, emptied, fell] = woken.into_inner()[..] else { panic!("four events") };
    assert_eq!((mapped, emptied), (rose, fell), "the writes change the level at once");
}

#[test]
fn no_edge_is_missed_by_a_task_that_runs_late() {
    let chip = chip(0x0A, 0, 0x04, 0);
    let (clock, mut pin) = (chip.simulation.clock.clone(), chip.port.interrupt_pin());
    let mut edge = core::pin::pin!(pin.wait_for_rising_edge());
    let mut context = core::task::Context::from_waker(core::task::Waker::noop());
    chip.wait(320);
    if edge.as_mut().poll(&mut context).is_pending() {
        // Several pulses pass while another task blocks the processor.
        clock.advance_to(clock.now() + Duration::from_micros(2_000));
        assert!(edge.as_mut().poll(&mut context).is_ready());
    }
}
