//! Writes the script of a flight for the flight core: `stampfly-core1-script FILE [MISSION]`. Flies it over emulated chips on this PC.

#[allow(dead_code, reason = "the other program reads")]
mod script;

use script::{Transfer, Writer, hash_of};
use stampfly_board::devices;
use stampfly_board::schedule::Runnables;
use stampfly_board::simulation::flight::Surroundings;
use stampfly_board::simulation::mission::Mission;
use stampfly_board::simulation::sensing::{IMAGE, Sensing};
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_board::topics::{Id, TOPICS};
use stampfly_flight::Observer;
use stampfly_sim::chips::{Latency, Seen};
use stampfly_sim::vehicle::{self, Vehicle, Verdict, Witness};
use stampfly_types::{Duration, Instant};
use std::process::ExitCode;

/// What is flown.
const MISSION: &str = "arm\ntakeoff 0.3\nhover 1\ngoto 0.3 0 0.3\nland\n";
/// What the software of a transfer takes before its first bit, and from an interrupt to the task that waits for it, us.
/// *Unverified*: no StampFly was measured. It decides on instants, not on instructions.
const SOFTWARE: [u64; 2] = [5, 15];

/// Collects what the other core published.
struct Collector {
    clock: Instant,
    script: Writer,
}

impl Observer for Collector {}

impl Witness<Runnables> for Collector {
    fn turn(&mut self, clock: Instant) {
        self.clock = clock;
    }

    fn published(&mut self, topic: usize, at: Instant, _: u32, words: &[u32]) {
        let is_this_core = [Id::sensor_imu, Id::sensor_flow].iter().any(|id| *id as usize == topic);
        if TOPICS[topic].is_outside && !is_this_core {
            self.script.sample(self.clock, at, topic, words);
        }
    }
}

fn main() -> ExitCode {
    let Some(path) = std::env::args().nth(1) else {
        eprintln!("usage: stampfly-core1-script FILE [MISSION]");
        return ExitCode::from(2);
    };
    let mission = std::env::args().nth(2).unwrap_or_else(|| MISSION.to_owned());
    let mission = match Mission::parse(&mission) {
        Ok(mission) => mission,
        Err(error) => {
            eprintln!("{error}");
            return ExitCode::from(2);
        }
    };
    let setup = Setup { mission, sensing: Sensing::Chips, ..Setup::reference(1) };
    let mut surroundings = Surroundings::new(&setup);
    let bus = surroundings.spi().expect("the flight has not begun");
    let [setup_time, wake] = SOFTWARE.map(Duration::from_micros);
    bus.set_latency(Latency {
        setup: setup_time,
        wake,
        alarm: wake,
        polled: devices::SPI_DMA_FROM - 1,
        spun: devices::SPI_SPUN,
        jitter: Duration::ZERO,
    });
    let analyser = bus.analyse();
    let mut collector = Collector { clock: setup.simulation.start, script: Writer::default() };
    let options = StampFly::options(&setup);
    let ended = vehicle::fly(&setup.vehicle, &options, &mut surroundings, &mut collector, &mut |_, _| {});
    if !ended.outcome.succeeded() {
        eprintln!("the flight did not succeed");
        return ExitCode::FAILURE;
    }
    let mut script = collector.script;
    for seen in analyser.take() {
        match seen {
            Seen::Transfer { chip, ended, blocked, wrote, read, .. } => script.transfer(&Transfer {
                chip: chip as u8,
                blocked,
                wrote: hash_of(wrote.iter().copied()),
                ended,
                read: &read,
            }),
            Seen::PinHigh(at) => script.pin(at),
            _ => {}
        }
    }
    match std::fs::write(&path, script.finish(setup.simulation.start, &IMAGE)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{path}: {error}");
            ExitCode::FAILURE
        }
    }
}
