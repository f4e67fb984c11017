//! Records a flight: the hash always, the log when somebody wants it.
//!
//! Samples come from the bus's taps, activations from the flight loop, the truth from the simulator. The order of the
//! file is the order in which things became visible: what a runnable reads is in the file before the activation that
//! reads it. Replay relies on that.

use crate::consistency::{FlightConsistency, Observation};
use crate::golden::{Event, Inputs};
use stampfly_board::vehicle::assemble;
use stampfly_board::{Observer, VehicleConfig, black_box, plan, wiring};
use stampfly_bus::Activation;
use stampfly_log::ulog::{Sample, Sink, Topic, Writer};
use stampfly_log::{ActivationTopic, FlightHash, Input};
use stampfly_sim::Truth;
use stampfly_types::{Instant, Message};
use std::convert::Infallible;
use std::sync::LazyLock;

/// Place of the truth in the log's topics: behind the bus's.
const TRUTH: usize = wiring::COUNT;

/// The log's topics: the bus's, and the truth.
pub static TOPICS: LazyLock<Vec<Topic>> = LazyLock::new(|| {
    let bus = wiring::TOPICS.iter().map(|info| Topic { name: info.name, fields: info.fields });
    bus.chain([Topic { name: "truth", fields: Truth::FIELDS }]).collect()
});

/// The log's activations. How many inputs each has is counted on a vehicle that never flies.
static ACTIVATIONS: LazyLock<Vec<ActivationTopic>> = LazyLock::new(|| {
    let mut bus = wiring::Bus::new();
    let wiring::Split { ports, heads, .. } = bus.split(None);
    let inputs = assemble(ports, heads, &VehicleConfig::default(), Instant::ZERO).flight_loop.count_inputs();
    let rows = plan::ACTIVATIONS.iter().zip(inputs).enumerate();
    rows.map(|(index, (info, inputs))| ActivationTopic { name: info.name, index: index as u8, inputs }).collect()
});

/// A log in memory.
#[derive(Debug, Default)]
struct Memory(Vec<u8>);

impl Sink for Memory {
    type Error = Infallible;
    fn write(&mut self, bytes: &[u8]) -> Result<(), Infallible> {
        self.0.extend_from_slice(bytes);
        Ok(())
    }
}

/// Records one flight.
pub struct Recorder {
    hash: FlightHash,
    wanted: bool,
    facts: Vec<(String, String)>,
    log: Option<Writer<'static, Memory>>,
    bytes: Vec<u8>,
    timing: Option<Vec<Timing>>,
    started: Option<std::time::Instant>,
    consistency: Consistency,
    inputs: Option<Inputs>,
}

/// Is somebody to look at the estimator's covariance?
enum Consistency {
    /// No.
    No,
    /// Yes, when the flight begins, with this seed.
    Wanted(u64),
    /// It is being done.
    Yes(Box<Observation>),
}

/// Wall time one runnable took, over a flight.
#[derive(Clone, Copy, Debug, Default)]
pub struct Timing {
    /// Activations.
    pub count: u64,
    /// Sum, ns.
    pub total_ns: u64,
    /// Longest, ns.
    pub longest_ns: u64,
}

impl Recorder {
    /// Only the hash.
    #[must_use]
    pub fn hash_only() -> Self {
        Self {
            hash: FlightHash::new(),
            wanted: false,
            facts: Vec::new(),
            log: None,
            bytes: Vec::new(),
            timing: None,
            started: None,
            consistency: Consistency::No,
            inputs: None,
        }
    }

    /// The hash and a ULog in memory. `facts` are written into its head.
    #[must_use]
    pub fn with_log(facts: Vec<(String, String)>) -> Self {
        Self { wanted: true, facts, ..Self::hash_only() }
    }

    /// Measures how long each runnable takes, too. Costs some tens of nanoseconds an activation.
    #[must_use]
    pub fn with_timing(self) -> Self {
        Self { timing: Some(vec![Timing::default(); plan::COUNT]), ..self }
    }

    /// Compares the estimate's errors with its covariance, too. `seed` chooses the instant that is looked at alone.
    #[must_use]
    pub fn with_consistency(self, seed: u64) -> Self {
        Self { consistency: Consistency::Wanted(seed), ..self }
    }

    /// Collects what the vehicle is given, too.
    #[must_use]
    pub fn with_inputs(self) -> Self {
        Self { inputs: Some(Inputs::default()), ..self }
    }

    pub(crate) fn begin(&mut self, start: Instant, config: &VehicleConfig) {
        if let Consistency::Wanted(seed) = self.consistency {
            self.consistency = Consistency::Yes(Box::new(Observation::new(config.eskf, seed)));
        }
        if !self.wanted {
            return;
        }
        let facts = &self.facts;
        let open = || {
            let mut head = black_box::head(Memory::default(), start, config)?;
            for (key, value) in facts {
                head.info(key, value)?;
            }
            head.data(&TOPICS, &ACTIVATIONS)
        };
        self.log = open().ok();
    }

    /// The executor is about to look what is due.
    pub(crate) fn turn(&mut self, clock: Instant) {
        if let Some(inputs) = &mut self.inputs {
            inputs.turn(clock);
        }
    }

    pub(crate) fn sample(&mut self, id: wiring::Id, at: Instant, generation: u32, words: &[u32]) {
        self.hash.publish(id as u16, generation, at, words);
        if let Some(inputs) = &mut self.inputs {
            inputs.sample(id, at, words);
        }
        if let Consistency::Yes(observation) = &mut self.consistency {
            observation.sample(id, at, generation, words);
        }
        if let Some(log) = &mut self.log {
            // The sink is memory and the schema is the bus's own: this cannot fail.
            let _ = log.sample(id as usize, &Sample { at, generation, words });
        }
    }

    pub(crate) fn truth(&mut self, at: Instant, generation: u32, truth: &Truth) {
        if let Consistency::Yes(observation) = &mut self.consistency {
            observation.truth(at, truth);
        }
        if let Some(log) = &mut self.log {
            let _ = log.sample(TRUTH, &Sample { at, generation, words: truth.to_words().as_ref() });
        }
    }

    pub(crate) fn end(&mut self) {
        if let Some(log) = self.log.take() {
            self.bytes = log.into_sink().0;
        }
    }

    /// Hash over everything published so far.
    #[must_use]
    pub fn hash(&self) -> u64 {
        self.hash.finish()
    }

    /// The log, once the flight is over; empty when none was wanted.
    #[must_use]
    pub fn log(&self) -> &[u8] {
        &self.bytes
    }

    /// How the estimate's errors compared with its covariance, once the flight is over; `None` when nobody wanted to know.
    #[must_use]
    pub fn into_consistency(self) -> Option<FlightConsistency> {
        if let Consistency::Yes(observation) = self.consistency { Some(observation.finish()) } else { None }
    }

    /// What the vehicle was given, in order; empty when nobody wanted to know.
    #[must_use]
    pub fn into_inputs(self) -> Vec<Event> {
        self.inputs.unwrap_or_default().into_collected()
    }

    /// Wall time per runnable, in table order; empty when it was not measured.
    #[must_use]
    pub fn timing(&self) -> &[Timing] {
        self.timing.as_deref().unwrap_or_default()
    }
}

impl Observer for Recorder {
    fn has_read(&mut self, index: usize, activation: &Activation) {
        if let Consistency::Yes(observation) = &mut self.consistency {
            observation.activation(index, activation);
        }
        if let Some(inputs) = &mut self.inputs {
            inputs.activation();
        }
        if let Some(log) = &mut self.log {
            let mut record = stampfly_log::Activation::new(index as u8, activation.now());
            for input in activation.inputs() {
                let _ = record.read(Input { generation: input.generation, taken: input.taken });
            }
            let _ = log.activation(&record);
        }
        // From here, so that writing the log is not counted.
        if self.timing.is_some() {
            self.started = Some(std::time::Instant::now());
        }
    }

    fn finished(&mut self, index: usize, activation: &Activation) {
        debug_assert_eq!(activation.refused(), 0, "no runnable of this vehicle publishes on a queue");
        let row = self.timing.as_mut().and_then(|rows| rows.get_mut(index));
        if let (Some(row), Some(started)) = (row, self.started) {
            let took = started.elapsed().as_nanos() as u64;
            row.count += 1;
            row.total_ns += took;
            row.longest_ns = row.longest_ns.max(took);
        }
    }
}
