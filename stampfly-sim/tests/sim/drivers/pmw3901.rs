//! Driver of the PMW3901.

use super::{Tap, hover, registers};
use crate::{mounting, standing};
use core::cell::RefCell;
use stampfly_drivers::OpticalFlow;
use stampfly_drivers::chip::ChipError;
use stampfly_drivers::chip::pmw3901::{Config, Pmw3901};
use stampfly_sim::chips::{self, Attached, Faults, SpiBus, SpiPort};
use stampfly_sim::time::{Tasks, block_on};
use stampfly_sim::{Simulation, SimulationConfig};
use stampfly_types::{Duration, Instant};

fn soldered(simulation: &Simulation) -> (SpiPort<chips::Pmw3901>, Attached) {
    let chip = chips::Pmw3901::new(&simulation.world, &simulation.clock, 1);
    SpiBus::new(&simulation.clock, 1).attach(2_000_000, chip)
}

#[test]
fn another_part_is_named() {
    let simulation = standing();
    let (port, attached) = soldered(&simulation);
    attached.set_id(0x42);
    let mut driver = Pmw3901::new(port, simulation.clock.clone(), mounting::FLOW, Config::default());
    let outcome = block_on(&simulation.clock, driver.start());
    assert_eq!(outcome, Err(ChipError::Identification { found: 0x42BD }));
}

#[test]
fn the_start_keeps_every_pause_and_leaves_the_bank_of_the_data() {
    let simulation = standing();
    let (port, attached) = soldered(&simulation);
    let mut driver = Pmw3901::new(port, simulation.clock.clone(), mounting::FLOW, Config::default());
    let begun = simulation.clock.now();
    assert_eq!(block_on(&simulation.clock, driver.start()), Ok(()));
    let took = simulation.clock.now().since(begun);
    assert!((Duration::from_millis(65)..Duration::from_millis(85)).contains(&took), "75 ms: {took}");
    // Writes that came too early would be missing: the last of bank 0, and the identity, readable
    // in this bank only.
    assert_eq!(registers(&attached, 0x4D), [0x11, 0xA8]);
    assert_eq!([0x5A, 0x5B, 0x40].map(|register| attached.peek(register)), [0x50, 0xA0, 0x80]);
    assert_eq!(attached.peek(0x00), 0x49);
    assert!(attached.peek(0x07) > 0, "a chip without its settings sees nothing");
}

#[test]
fn in_flight_every_sample_is_what_the_burst_held() {
    let simulation = Simulation::new(&SimulationConfig::example());
    let (port, _) = soldered(&simulation);
    let (tap, transfers) = Tap::new(port);
    let Simulation { clock, world, sensors } = simulation;
    let mut driver = Pmw3901::new(tap, clock.clone(), mounting::FLOW, Config::default());
    let samples = RefCell::new(Vec::new());
    let mut tasks = Tasks::new(clock.clone());
    hover(&mut tasks, clock.clone(), world, sensors.motors);
    tasks.spawn(async {
        loop {
            let sample = driver.next().await.expect("no fault is simulated");
            assert_eq!(sample.at, clock.now(), "the instant of the read");
            samples.borrow_mut().push(sample);
        }
    });
    tasks.run_until(Instant::from_secs(6));
    drop(tasks);
    let (samples, transfers) = (samples.into_inner(), transfers.borrow());
    // The first burst only empties the counts.
    let bursts = transfers.iter().filter(|(command, _)| *command == 0x16).skip(1);
    let mut moved = 0;
    for (sample, (_, bytes)) in samples.iter().zip(bursts) {
        let word = |place: usize| f32::from(i16::from_le_bytes([bytes[place], bytes[place + 1]]));
        let (x, y) = (word(2), word(4));
        assert!((sample.data.delta_x + y * 0.002_22).abs() < 1e-6, "{sample:?} {bytes:?}");
        assert!((sample.data.delta_y - x * 0.002_22).abs() < 1e-6, "{sample:?} {bytes:?}");
        assert_eq!(sample.data.quality, bytes[6]);
        moved += u32::from((x, y) != (0.0, 0.0));
    }
    assert!(samples.len() > 550 && moved > 300, "{moved} of {} moved", samples.len());
    for pair in samples.windows(2) {
        let interval = pair[1].at.since(pair[0].at);
        assert!((pair[1].data.interval - interval.seconds()).abs() < 1e-6);
        assert!((Duration::from_micros(10_000)..Duration::from_micros(10_300)).contains(&interval), "{interval}");
    }
}

#[test]
fn a_chip_that_lost_its_settings_is_found_out_within_a_second() {
    let simulation = standing();
    let (port, attached) = soldered(&simulation);
    let clock = &simulation.clock;
    let mut driver = Pmw3901::new(port, clock.clone(), mounting::FLOW, Config::default());
    block_on(clock, driver.next()).expect("a sample");
    attached.reset();
    let begun = clock.now();
    let error = (0..200).find_map(|_| block_on(clock, driver.next()).err());
    assert!(matches!(error, Some(ChipError::Restarted | ChipError::Data)), "{error:?}");
    assert!(clock.now().since(begun) < Duration::from_millis(1_020), "{}", clock.now().since(begun));
    assert!(block_on(clock, driver.next()).is_ok(), "set up again");
}

#[test]
fn after_a_start_that_succeeds_on_a_noisy_bus_it_sees() {
    let simulation = standing();
    let (port, attached) = soldered(&simulation);
    let clock = &simulation.clock;
    let mut driver = Pmw3901::new(port, clock.clone(), mounting::FLOW, Config::default());
    let (mut started, mut blind) = (0, 0);
    for _ in 0..600 {
        attached.set_faults(Faults { bit_errors: 1e-3, ..Faults::default() });
        let outcome = block_on(clock, driver.start());
        attached.set_faults(Faults::default());
        if outcome.is_ok() {
            started += 1;
            if block_on(clock, driver.next()).expect("a sample").data.quality > 0 {
                continue;
            }
            // Registers that are written twice or are not in the list cannot be read back.
            blind += 1;
            let begun = clock.now();
            while !block_on(clock, driver.next()).is_ok_and(|sample| sample.data.quality > 0) {
                assert!(
                    clock.now().since(begun) < Duration::from_micros(10_200_000),
                    "start {started} left it blind for ever"
                );
            }
        }
    }
    assert!(started > 30 && blind * 5 < started, "{blind} of {started} starts left it blind for ten seconds");
}
