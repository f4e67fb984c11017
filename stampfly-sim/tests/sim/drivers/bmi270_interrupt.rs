//! Driver of the BMI270 with its interrupt pin: correct, silent or stuck.

use super::bmi270::soldered;
use super::{Tap, registers};
use crate::{mounting, standing};
use core::cell::{Cell, RefCell};
use core::convert::Infallible;
use core::future::pending;
use embedded_hal::digital::ErrorType;
use embedded_hal_async::digital::Wait;
use stampfly_drivers::Imu;
use stampfly_drivers::chip::bmi270::{Bmi270, Config};
use stampfly_sim::Simulation;
use stampfly_sim::chips::{InterruptPin, stand_in_image};
use stampfly_sim::time::Tasks;
use stampfly_types::Instant;

/// Defect of the wire.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Wire {
    Right,
    /// Broken: always low.
    Silent,
    /// Shorted to the supply: always high.
    Stuck,
}

/// The pin at the end of the wire, which fails between two waits.
struct Pin<'w> {
    pin: InterruptPin,
    wire: &'w Cell<Wire>,
}

impl ErrorType for Pin<'_> {
    type Error = Infallible;
}

impl Wait for Pin<'_> {
    async fn wait_for_high(&mut self) -> Result<(), Infallible> {
        match self.wire.get() {
            Wire::Right => self.pin.wait_for_high().await,
            Wire::Silent => pending().await,
            Wire::Stuck => Ok(()),
        }
    }
    async fn wait_for_low(&mut self) -> Result<(), Infallible> {
        unreachable!("the driver waits for the level")
    }
    async fn wait_for_rising_edge(&mut self) -> Result<(), Infallible> {
        unreachable!("the driver waits for the level")
    }
    async fn wait_for_falling_edge(&mut self) -> Result<(), Infallible> {
        unreachable!("the driver waits for the level")
    }
    async fn wait_for_any_edge(&mut self) -> Result<(), Infallible> {
        unreachable!("the driver waits for the level")
    }
}

/// Results of two seconds.
struct Run {
    /// Instants of delivery, and of the samples.
    samples: Vec<(Instant, Instant)>,
    /// Rising edges of the pin: the instants of every fourth sample in the chip.
    rises: Vec<Instant>,
    /// Number of status reads.
    looks: usize,
}

/// A specimen whose wire is `before` for one second and `after` for another.
fn run(seed: u64, before: Wire, after: Wire) -> Run {
    let simulation = standing();
    let (port, attached) = soldered(&simulation, seed);
    let (pin, mut watched) = (port.interrupt_pin(), port.interrupt_pin());
    let (tap, transfers) = Tap::new(port);
    let Simulation { clock, .. } = simulation;
    let (image, wire) = (stand_in_image(), Cell::new(before));
    let imu = Bmi270::spi(tap, clock.clone(), &image, mounting::IMU, Config::default());
    let mut imu = imu.with_interrupt(Pin { pin, wire: &wire });
    let (samples, rises) = (RefCell::new(Vec::new()), RefCell::new(Vec::new()));
    let mut tasks = Tasks::new(clock.clone());
    tasks.spawn(async {
        loop {
            let sample = imu.next().await.expect("a sample");
            samples.borrow_mut().push((clock.now(), sample.at));
        }
    });
    tasks.spawn(async {
        loop {
            let Ok(()) = watched.wait_for_rising_edge().await;
            rises.borrow_mut().push(clock.now());
        }
    });
    tasks.run_until(Instant::from_secs(1));
    wire.set(after);
    tasks.run_until(Instant::from_secs(2));
    drop(tasks);
    // Four frames, push-pull, active high, not latched, watermark on the pin.
    assert_eq!(registers(&attached, 0x46), [52, 0]);
    assert_eq!([0x53, 0x55, 0x58].map(|register| attached.peek(register)), [0x0A, 0x00, 0x02]);
    let looks = transfers.borrow().iter().filter(|(command, _)| *command == 0x98).count();
    Run { samples: samples.into_inner(), rises: rises.into_inner(), looks }
}

/// Longest time from the last chip sample in a delivered one (three samples after its stamp) to the
/// delivery.
fn latest(samples: &[(Instant, Instant)]) -> u64 {
    samples.iter().map(|(seen, at)| seen.since(*at).as_micros().saturating_sub(3 * 625)).max().expect("samples")
}

fn longest_gap(samples: &[(Instant, Instant)]) -> u64 {
    samples.windows(2).map(|pair| pair[1].0.since(pair[0].0).as_micros()).max().expect("samples")
}

#[test]
fn samples_come_by_the_pin_one_look_each() {
    for seed in 1..=8 {
        let run = run(seed, Wire::Right, Wire::Right);
        assert!(run.samples.len() > 700, "{}", run.samples.len());
        assert!(run.looks <= run.samples.len() + 5, "{} looks for {} samples", run.looks, run.samples.len());
        // Three ticks after the edge, and two transfers; three periods of a clock up to 2 % slow.
        assert!(latest(&run.samples) < 117 + 60 + 60 + 38, "seed {seed}: {} µs", latest(&run.samples));
        for (seen, at) in &run.samples {
            let rise = run.rises.iter().rev().find(|rise| *rise <= seen).expect("a rise before every sample");
            // The same clock; one tick; the address on the bus.
            let error = rise.since(*at).as_micros().abs_diff(3 * 625);
            assert!(error <= 38 + 40 + 4, "seed {seed}: stamped {error} µs off");
        }
    }
}

#[test]
fn a_pin_that_is_wrong_from_the_start_costs_a_few_late_samples() {
    for seed in 1..=8 {
        let right = run(seed, Wire::Right, Wire::Right).samples.len();
        for wire in [Wire::Silent, Wire::Stuck] {
            let run = run(seed, wire, wire);
            assert!(run.samples.len() + 3 >= right, "{wire:?}: {} samples instead of {right}", run.samples.len());
            assert!(longest_gap(&run.samples) < 2_500 + 625, "{wire:?}: {} µs", longest_gap(&run.samples));
            // By the driver's own clock: a poll that came too early is followed by another one
            // sample later.
            let settled = latest(&run.samples[20..]);
            assert!(settled < 625, "seed {seed}, {wire:?}: {settled} µs");
        }
    }
}

#[test]
fn a_pin_that_breaks_in_flight_is_not_missed() {
    for seed in 1..=8 {
        for wire in [Wire::Silent, Wire::Stuck] {
            let run = run(seed, Wire::Right, wire);
            let gap = longest_gap(&run.samples);
            assert!(run.samples.len() > 700 && gap < 2_500 + 625, "seed {seed}, {wire:?}: {gap} µs");
        }
    }
}

#[test]
fn the_same_run_gives_the_same_instants() {
    let [one, two] = [(); 2].map(|()| run(1, Wire::Right, Wire::Stuck));
    assert_eq!((one.samples, one.rises, one.looks), (two.samples, two.rises, two.looks));
}
