//! Buses with software latency.

use super::wait;
use crate::standing;
use embedded_hal::spi::{Operation, SpiDevice};
use stampfly_sim::Simulation;
use stampfly_sim::chips::{Bmp280, I2cBus, Latency, Pmw3901, SpiBus, SpiPort};
use stampfly_sim::time::{Tasks, block_on};
use stampfly_types::{Duration, Instant};

const fn us(microseconds: u64) -> Duration {
    Duration::from_micros(microseconds)
}

fn flow() -> (Simulation, SpiPort<Pmw3901>) {
    let simulation = standing();
    let (port, _) =
        SpiBus::new(&simulation.clock, 1).attach(2_000_000, Pmw3901::new(&simulation.world, &simulation.clock, 1));
    wait(&simulation, 50_000);
    (simulation, port)
}

/// Duration of a burst, µs, and its third byte, which is the identity when it is a read.
fn burst(simulation: &Simulation, port: &mut SpiPort<Pmw3901>) -> (u64, u8) {
    let (begun, mut bytes) = (simulation.clock.now(), [0; 12]);
    let mut operations = [Operation::Write(&[0x00]), Operation::DelayNs(35_000), Operation::Read(&mut bytes)];
    port.transaction(&mut operations).unwrap();
    let took = simulation.clock.now().since(begun).as_micros();
    wait(simulation, 100);
    (took, bytes[0])
}

#[test]
fn each_cause_is_charged_where_it_applies() {
    let (simulation, mut port) = flow();
    let mut takes = |latency| {
        port.bus().set_latency(latency);
        let (took, identity) = burst(&simulation, &mut port);
        assert_eq!(identity, 0x49, "a chip that is asked late answers the same");
        took
    };
    let late = Latency { setup: us(7), wake: us(100), alarm: us(1_000), ..Latency::default() };
    assert_eq!(takes(Latency::default()), 87);
    assert_eq!(takes(late), 87 + 7 + 2 * 100 + 1_000);
    assert_eq!(takes(Latency { polled: 1, ..late }), 87 + 7 + 100 + 1_000, "the address is polled");
    assert_eq!(takes(Latency { polled: 12, ..late }), 87 + 7 + 1_000);
    assert_eq!(takes(Latency { spun: us(34), ..late }), 87 + 7 + 2 * 100 + 1_000);
    assert_eq!(takes(Latency { spun: us(35), polled: 12, ..late }), 87 + 7);
}

#[test]
fn jitter_stays_within_its_bound_and_repeats() {
    let run = || {
        let (simulation, mut port) = flow();
        port.bus().set_latency(Latency { setup: us(10), wake: us(20), jitter: us(30), ..Latency::default() });
        (0..100).map(|_| burst(&simulation, &mut port).0).collect::<Vec<_>>()
    };
    let took = run();
    // Three causes, each with up to 30 µs of jitter.
    assert!(took.iter().all(|took| (87 + 50..87 + 50 + 4 * 30).contains(took)), "{took:?}");
    assert!(took.iter().max() > took.iter().min().map(|least| least + 60).as_ref(), "{took:?}");
    assert_eq!(took, run());
}

#[test]
fn a_transfer_that_the_processor_does_itself_keeps_other_tasks_waiting() {
    for (polled, seen) in [(12, 50_100), (0, 50_020)] {
        let (simulation, mut port) = flow();
        let clock = simulation.clock.clone();
        port.bus().set_latency(Latency { setup: us(13), polled, spun: us(50), ..Latency::default() });
        let woken = core::cell::Cell::new(Instant::ZERO);
        let mut tasks = Tasks::new(clock.clone());
        tasks.spawn(async {
            clock.sleep_until(Instant::from_micros(50_020)).await;
            woken.set(clock.now());
        });
        tasks.spawn(async {
            let mut bytes = [0; 12];
            let mut burst = [Operation::Write(&[0x16]), Operation::DelayNs(35_000), Operation::Read(&mut bytes)];
            embedded_hal_async::spi::SpiDevice::transaction(&mut port, &mut burst).await.unwrap();
        });
        tasks.run_until(Instant::from_millis(51));
        drop(tasks);
        assert_eq!(woken.get(), Instant::from_micros(seen), "up to {polled} bytes");
    }
}

#[test]
fn on_i2c_every_transfer_is_set_up_and_every_operation_woken_from() {
    let simulation = standing();
    let clock = &simulation.clock;
    let mut bus = I2cBus::new(clock, 1);
    bus.attach(0x76, Bmp280::new(&simulation.world, clock, 1));
    let mut read = |latency| {
        bus.set_latency(latency);
        let (begun, mut id) = (clock.now(), [0]);
        block_on(clock, embedded_hal_async::i2c::I2c::write_read(&mut bus, 0x76, &[0xD0], &mut id)).unwrap();
        assert_eq!(id, [0x58]);
        clock.now().since(begun).as_micros()
    };
    assert_eq!(read(Latency::default()), 98);
    assert_eq!(read(Latency { setup: us(11), wake: us(100), ..Latency::default() }), 98 + 11 + 2 * 100);
}
