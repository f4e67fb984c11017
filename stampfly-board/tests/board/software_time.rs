//! What the deadlines of the two sensors on SPI leave to the software: how late it may be, and where they fail.
//!
//! The emulated bus takes no time for software unless it is told to, so a deadline that leaves none would pass everywhere else. Here it is
//! told. The order of size is that of code that no cache holds: a hundred lines of 32 bytes are 105 µs from flash over four wires at
//! 80 MHz, and 380 µs over two at 40 MHz (`docs/explain/hardware-status.md`). It has not been measured on a StampFly.

use stampfly_board::devices;
use stampfly_board::simulation::sensing::SPI;
use stampfly_drivers::slot::Slots;
use stampfly_drivers::task::{Backoff, SensorHealth, run_sensor};
use stampfly_drivers::{Barometer, Imu, OpticalFlow, PowerMonitor, SensorErrorKind};
use stampfly_sim::chips::{Board, Latency, SpiSetup, stand_in_image};
use stampfly_sim::time::{Tasks, block_on};
use stampfly_sim::{Simulation, SimulationConfig};
use stampfly_types::{Duration, Instant};
use std::cell::Cell;

/// How both sensors did in two seconds.
#[derive(Debug)]
struct Done {
    imu: SensorHealth,
    flow: SensorHealth,
    /// How often the inertial sensor had to wait for the flow sensor.
    delays: u32,
    /// The longest time from an inertial sample to its delivery, after the start.
    age: Duration,
}

impl Done {
    fn flow_works(&self) -> bool {
        self.flow.errors() == 0 && self.flow.samples() > 180
    }

    fn imu_works(&self) -> bool {
        self.imu.errors() == 0 && self.imu.samples() > 700
    }
}

fn two_seconds(latency: Latency) -> Done {
    let config = SimulationConfig::example();
    let Simulation { clock, world, .. } = Simulation::new(&config);
    let image = stand_in_image();
    let Board { imu, flow, .. } = Board::on(&SPI, &world, &clock, &config, &image);
    imu.bus().set_latency(latency);
    let pin = imu.interrupt_pin();
    let mut slots = Slots::new(clock.clone(), devices::RHYTHM);
    let (lead, guest, bus) = slots.split(imu, flow, devices::LONGEST_FLOW);
    let mut imu = devices::imu(lead, clock.clone(), &image).with_interrupt(pin);
    let mut flow = devices::flow(guest, clock.clone());
    let (imu_health, flow_health) = (SensorHealth::new(), SensorHealth::new());
    let age = Cell::new(Duration::ZERO);
    let mut tasks = Tasks::new(clock.clone());
    tasks.spawn(async {
        let note = |at, _: &_| {
            if clock.now() > Instant::from_secs(1) {
                age.set(age.get().max(clock.now().since(at)));
            }
        };
        match run_sensor(async || imu.next().await, note, clock.clone(), Backoff::CRITICAL, &imu_health).await {}
    });
    tasks.spawn(async {
        match run_sensor(async || flow.next().await, |_, _| (), clock.clone(), Backoff::SHARED, &flow_health).await {}
    });
    tasks.run_until(Instant::from_secs(2));
    drop(tasks);
    Done { imu: imu_health, flow: flow_health, delays: bus.delays(), age: age.get() }
}

/// A hundred lines of code that no cache holds, µs: four wires at 80 MHz, two at 40 MHz.
const COLD: [u64; 2] = [105, 380];

/// As the firmware moves bytes: short operations by the processor, short pauses spun away.
fn firmware(setup: u64, wake: u64) -> Latency {
    let [setup, wake] = [setup, wake].map(Duration::from_micros);
    let polled = devices::SPI_DMA_FROM - 1;
    Latency { setup, wake, alarm: wake, polled, spun: devices::SPI_SPUN, jitter: Duration::ZERO }
}

/// As it moved them once: DMA from eight bytes on, and every pause of a transfer by an alarm of the executor's.
fn by_interrupt(setup: u64, wake: u64) -> Latency {
    Latency { polled: 7, spun: Duration::from_micros(9), ..firmware(setup, wake) }
}

/// As a bus whose task gives way in every transfer, so that deadlines hold.
fn giving_way(setup: u64) -> Latency {
    Latency { setup: Duration::from_micros(setup), ..Latency::default() }
}

#[test]
fn a_flow_transfer_that_gives_way_stands_113_us_of_software() {
    // 4 µs for the address, 35 of pause, 48 for twelve bytes: the rest of `LONGEST_FLOW`.
    assert_eq!(devices::LONGEST_FLOW, Duration::from_micros(87 + 113));
    for (latency, stands) in [(0, true), (105, true), (113, true), (114, false), (200, false)] {
        let done = two_seconds(giving_way(latency));
        assert_eq!(done.flow_works(), stands, "{latency} µs: {done:?}");
        assert!(done.imu_works(), "{latency} µs: {done:?}");
    }
}

#[test]
fn by_interrupts_that_find_no_code_in_the_cache_the_flow_sensor_never_measures() {
    for wake in COLD {
        let done = two_seconds(by_interrupt(0, wake));
        assert!(done.flow.samples() == 0 && done.flow.errors() > 10, "{wake} µs: {done:?}");
    }
    // Two wakes in each burst: more than half of the 113 µs is too much, and a warm cache was not.
    assert!(two_seconds(by_interrupt(0, 56)).flow_works());
    assert!(!two_seconds(by_interrupt(0, 57)).flow_works());
}

#[test]
fn as_the_firmware_moves_bytes_the_flow_sensor_measures_with_wakes_and_set_ups_that_are_cold() {
    for wake in COLD {
        let done = two_seconds(firmware(0, wake));
        assert!(done.flow_works(), "{wake} µs: {done:?}");
    }
    // What it takes before the first bit cannot end a transfer either, for its task does not give way. At 380 µs the inertial sensor
    // fails, and a slot may not come in time.
    for setup in COLD {
        let done = two_seconds(firmware(setup, 0));
        assert!(
            done.flow.samples() > 140 && done.flow.last_error() != Some(SensorErrorKind::Bus),
            "{setup} µs: {done:?}"
        );
    }
}

#[test]
fn with_a_cold_set_up_a_flow_transfer_still_keeps_its_promise_by_8_us() {
    let [cold, _] = COLD;
    let burst = Duration::from_micros(87 + cold);
    assert_eq!(devices::LONGEST_FLOW, burst + Duration::from_micros(8));
    // Beyond that the inertial sensor's guard begins: 250 µs more before it is late.
    assert_eq!(devices::RHYTHM.guard, Duration::from_micros(250));
    let done = two_seconds(firmware(cold, cold));
    assert!(done.flow_works() && done.imu_works() && done.delays == 0, "{done:?}");
}

#[test]
fn the_inertial_sensor_stands_368_us_of_software_in_a_transfer_by_dma() {
    let [quad, dual] = COLD;
    for (wake, stands) in [(2 * quad, true), (368, true), (368 + 1, false), (2 * dual, false)] {
        let done = two_seconds(firmware(0, wake));
        assert_eq!(done.imu_works(), stands, "{wake} µs: {done:?}");
    }
    // Twice a hundred cold lines, one half before the first bit: flown from flash as the runner sets it, and not by two wires at 40 MHz.
    assert!(two_seconds(firmware(quad, quad)).imu_works());
    assert_eq!(two_seconds(firmware(dual, dual)).imu.samples(), 0);
}

#[test]
fn a_latency_at_random_is_the_same_with_the_same_seed() {
    let jitter = Duration::from_micros(60);
    let told = |latency| {
        let done = two_seconds(latency);
        (done.imu.samples(), done.flow.samples(), done.age, done.flow_works() && done.imu_works())
    };
    let jittered = told(Latency { jitter, ..firmware(40, 80) });
    assert_eq!(jittered, told(Latency { jitter, ..firmware(40, 80) }));
    assert!(jittered.3 && jittered != told(firmware(40, 80)), "{jittered:?}");
}

#[test]
fn sensors_on_i2c_have_a_hundred_times_as_much() {
    let config = SimulationConfig::example();
    let Simulation { clock, world, .. } = Simulation::new(&config);
    let Board { i2c, .. } = Board::on(&SPI, &world, &clock, &config, &stand_in_image());
    let late = Duration::from_micros(COLD[1]);
    i2c.set_latency(Latency { setup: late, wake: late, ..Latency::default() });
    let mut barometer = devices::barometer(i2c.clone(), clock.clone());
    let mut power = devices::power(i2c, clock.clone());
    for _ in 0..20 {
        block_on(&clock, barometer.next()).expect("a pressure");
        block_on(&clock, power.next()).expect("a voltage");
    }
}

#[test]
fn what_the_emulated_chips_hang_on_is_what_the_firmware_has() {
    assert_eq!(SPI, SpiSetup::default());
}
