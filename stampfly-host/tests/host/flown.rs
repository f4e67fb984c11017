//! Flights that several tests read: each is flown once, when the first of them asks for it.
//!
//! A test that changes a flight, or that asks whether a flight is the same again, flies its own.

use stampfly_board::simulation::metrics::Metrics;
use stampfly_board::simulation::mission::Mission;
use stampfly_board::simulation::{Outcome, PhaseChange, Setup, StampFly};
use stampfly_host::campaign::parallel;
use stampfly_host::flown::{Flown, fly};
use stampfly_host::recorder::Recorder;
use stampfly_host::serve::RecordOut;
use stampfly_sim::vehicle::Vehicle;
use stampfly_types::Duration;
use std::sync::{LazyLock, OnceLock};

/// The reference mission on a specimen.
pub struct Reference {
    pub seed: u64,
    pub flown: Flown<Outcome>,
    pub hash: u64,
}

/// How many specimens fly the reference mission.
const SPECIMENS: usize = 20;

/// The reference mission on the specimens 1 to `last`.
pub fn reference(last: usize) -> Vec<&'static Reference> {
    static FLIGHTS: [OnceLock<Reference>; SPECIMENS] = [const { OnceLock::new() }; SPECIMENS];
    let flights = &FLIGHTS[..last];
    parallel::each(last, parallel::workers(last, None), &|place| {
        flights[place].get_or_init(|| {
            let (seed, mut recorder) = (1 + place as u64, Recorder::<StampFly>::hash_only());
            let flown = fly::<StampFly>(&Setup::reference(seed), &mut recorder, &mut |_, _| {});
            Reference { seed, flown, hash: recorder.hash() }
        })
    })
}

/// A short flight with everything that makes the stack do something: up, a step aside with a turn,
/// down.
pub fn hop(seed: u64, jitter: Option<u64>) -> Setup {
    let mission = Mission::parse("arm\ntakeoff 0.4\ngoto 0.5 -0.3 0.6 yaw 60\nland").expect("a mission");
    Setup { mission, jitter, ..Setup::reference(seed) }
}

/// What is left of a hop.
#[derive(PartialEq)]
pub struct Hop {
    pub log: Vec<u8>,
    /// The compact record.
    pub record: Vec<u8>,
    pub hash: u64,
    pub metrics: Metrics,
    pub phases: Vec<PhaseChange>,
    pub duration: Duration,
}

impl Hop {
    pub fn fly(setup: &Setup) -> Self {
        let facts = [("seed".to_owned(), setup.simulation.seed.to_string())];
        let mut witness = (RecordOut::memory(StampFly::NAME), Recorder::<StampFly>::with_log(setup, &facts));
        let Flown { outcome, duration, .. } = fly::<StampFly>(setup, &mut witness, &mut |_, _| {});
        let (log, record, hash) = (witness.1.log().to_vec(), witness.0.file().to_vec(), witness.1.hash());
        Self { log, record, hash, metrics: outcome.metrics, phases: outcome.phases, duration }
    }
}

/// A hop that landed.
pub static HOP: LazyLock<Hop> = LazyLock::new(|| Hop::fly(&hop(1, None)));

/// The same with an executor that is late.
pub static LATE: LazyLock<Hop> = LazyLock::new(|| Hop::fly(&hop(1, Some(1))));
