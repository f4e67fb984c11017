//! Records a flight on a PC: always its hash; on request a log, run times and inputs.

use crate::inputs::{Event, Inputs};
use crate::vehicle::{Vehicle, Witness};
use stampfly_bus::{Activation, Schedule};
use stampfly_flight::key_frame::{self, KeyFrameError};
use stampfly_flight::{FlightLoop, LogSchema, Observer};
use stampfly_log::FlightHash;
use stampfly_log::ulog::{Definitions, ParameterValue, Sink, WriteError};
use stampfly_types::{Duration, Instant};
use std::convert::Infallible;

/// Period of key frames in a log. A replay that starts at any instant begins at most this much
/// later.
const KEY_FRAME_PERIOD: Duration = Duration::from_secs(1);

/// A log sink in memory.
#[derive(Debug, Default)]
pub struct Memory(pub Vec<u8>);

impl Sink for Memory {
    type Error = Infallible;
    fn write(&mut self, bytes: &[u8]) -> Result<(), Infallible> {
        self.0.extend_from_slice(bytes);
        Ok(())
    }
}

/// Writes the head of a log: the vehicle's name, `facts`, and all parameters, so that a replay uses
/// the same ones.
///
/// # Errors
/// If the sink refuses the data.
pub fn head<V: Vehicle, S: Sink>(
    sink: S,
    start: Instant,
    config: &<V::Runnables as Schedule>::Config,
    facts: &[(String, String)],
) -> Result<Definitions<S>, WriteError<S::Error>> {
    let mut head = Definitions::start(sink, start)?;
    head.info("sys_name", V::NAME)?;
    for setting in V::parameters(config) {
        head.parameter(setting.name, ParameterValue::Float(setting.value as f32))?;
    }
    for (key, value) in facts {
        head.info(key, value)?;
    }
    Ok(head)
}

/// Wall-clock run time of one runnable over a flight.
#[derive(Clone, Copy, Debug, Default)]
pub struct Timing {
    /// Number of activations.
    pub count: u64,
    /// Total time, ns.
    pub total_ns: u64,
    /// Longest time, ns.
    pub longest_ns: u64,
}

/// Records one flight of a vehicle. The log is in memory unless another sink is given.
pub struct Recorder<V: Vehicle, S: Sink = Memory> {
    hash: FlightHash,
    log: Option<stampfly_flight::Recorder<V::Runnables, S>>,
    /// The log after the flight.
    written: Option<S>,
    timing: Option<Vec<Timing>>,
    started: Option<std::time::Instant>,
    inputs: Option<Inputs>,
    key_frame_due: Instant,
    /// Samples lost by the taps, and replacements of the state.
    samples_lost: u32,
    replaced: u32,
    frame: Vec<u8>,
}

impl<V: Vehicle> Default for Recorder<V> {
    fn default() -> Self {
        Self::hash_only()
    }
}

impl<V: Vehicle> Recorder<V> {
    /// Records the hash only.
    #[must_use]
    pub fn hash_only() -> Self {
        Self::on(None)
    }

    /// Records the hash, and a ULog in memory with `facts` in its head.
    #[must_use]
    pub fn with_log(setup: &V::Setup, facts: &[(String, String)]) -> Self {
        // A sink in memory accepts everything, and the schema comes from the vehicle: this cannot
        // fail.
        Self::with_sink(Memory::default(), setup, facts).unwrap_or_default()
    }

    /// The log after the flight; empty without one.
    #[must_use]
    pub fn log(&self) -> &[u8] {
        self.written.as_ref().map_or(&[], |memory| &memory.0)
    }
}

impl<V: Vehicle, S: Sink> Recorder<V, S> {
    fn on(log: Option<stampfly_flight::Recorder<V::Runnables, S>>) -> Self {
        Self {
            hash: FlightHash::new(),
            log,
            written: None,
            timing: None,
            started: None,
            inputs: None,
            key_frame_due: Instant::ZERO,
            samples_lost: 0,
            replaced: 0,
            frame: Vec::new(),
        }
    }

    /// Records the hash, and a ULog into `sink` with `facts` in its head.
    ///
    /// # Errors
    /// If the sink refuses the head.
    pub fn with_sink(sink: S, setup: &V::Setup, facts: &[(String, String)]) -> Result<Self, WriteError<S::Error>> {
        let head = head::<V, _>(sink, V::options(setup).start, V::config(setup), facts)?;
        let log = head.data(LogSchema::new(V::BESIDE))?;
        Ok(Self::on(Some(stampfly_flight::Recorder::new(log))))
    }

    /// The sink with the log so far, during or after the flight.
    #[must_use]
    pub fn so_far(&self) -> Option<&S> {
        self.log.as_ref().map(stampfly_flight::Recorder::sink).or(self.written.as_ref())
    }

    /// The sink with the log, after the flight.
    #[must_use]
    pub const fn written(&self) -> Option<&S> {
        self.written.as_ref()
    }

    /// As [`written`](Self::written), by value.
    #[must_use]
    pub fn into_written(self) -> Option<S> {
        self.written
    }

    /// Messages refused by the sink so far.
    #[must_use]
    pub fn refused(&self) -> u32 {
        self.log.as_ref().map_or(0, stampfly_flight::Recorder::lost)
    }

    /// Also measures the run time of each runnable, at a cost of some tens of nanoseconds per
    /// activation.
    #[must_use]
    pub fn with_timing(self) -> Self {
        Self { timing: Some(vec![Timing::default(); V::Runnables::ACTIVATIONS.len()]), ..self }
    }

    /// Also collects the vehicle's inputs.
    #[must_use]
    pub fn with_inputs(self) -> Self {
        Self { inputs: Some(Inputs::default()), ..self }
    }

    /// Hash over all samples published so far.
    #[must_use]
    pub fn hash(&self) -> u64 {
        self.hash.finish()
    }

    /// The vehicle's inputs in order; empty if they were not collected.
    #[must_use]
    pub fn into_inputs(self) -> Vec<Event> {
        self.inputs.unwrap_or_default().into_collected()
    }

    /// Run time per runnable in table order; empty if it was not measured.
    #[must_use]
    pub fn timing(&self) -> &[Timing] {
        self.timing.as_deref().unwrap_or_default()
    }
}

impl<V: Vehicle, S: Sink> Observer for Recorder<V, S> {
    fn has_read(&mut self, activation: &Activation) {
        if let Some(inputs) = &mut self.inputs {
            inputs.activation();
        }
        if let Some(log) = &mut self.log {
            log.has_read(activation);
        }
        // Taken last, so that writing the log is not included in the measurement.
        if self.timing.is_some() {
            self.started = Some(std::time::Instant::now());
        }
    }

    fn finished(&mut self, activation: &Activation) {
        let index = usize::from(activation.record().index);
        let row = self.timing.as_mut().and_then(|rows| rows.get_mut(index));
        if let (Some(row), Some(started)) = (row, self.started) {
            let took = started.elapsed().as_nanos() as u64;
            row.count += 1;
            row.total_ns += took;
            row.longest_ns = row.longest_ns.max(took);
        }
        if let Some(log) = &mut self.log {
            log.finished(activation);
        }
    }
}

impl<V: Vehicle, S: Sink> Witness<V::Runnables> for Recorder<V, S> {
    fn turn(&mut self, clock: Instant) {
        if let Some(inputs) = &mut self.inputs {
            inputs.turn(clock);
        }
    }

    fn published(&mut self, topic: usize, at: Instant, generation: u32, words: &[u32]) {
        self.hash.publish(topic as u16, generation, at, words);
        if let Some(inputs) = &mut self.inputs {
            inputs.sample::<V::Runnables>(topic, at, words);
        }
        if let Some(log) = &mut self.log {
            log.sample(topic, at, generation, words);
        }
    }

    fn beside(&mut self, place: usize, at: Instant, generation: u32, words: &[u32]) {
        if let Some(log) = &mut self.log {
            log.sample(LogSchema::<V::Runnables>::BESIDE + place, at, generation, words);
        }
    }

    fn at_rest(&mut self, clock: Instant, flight_loop: &mut FlightLoop<'_, V::Runnables>) {
        let Some(log) = self.log.as_mut().filter(|_| clock >= self.key_frame_due) else { return };
        self.key_frame_due = clock + KEY_FRAME_PERIOD;
        loop {
            match key_frame::encode(flight_loop, clock, &mut self.frame) {
                Ok(length) => {
                    // The log counts messages that the sink refuses.
                    let _ = log.key_frame(clock, self.frame.get(..length).unwrap_or_default());
                    return;
                }
                // The size of the state is unknown in advance: the buffer grows until it fits and
                // is reused afterwards.
                Err(KeyFrameError::NoRoom) => self.frame.resize(2 * self.frame.len().max(4096), 0),
                Err(_) => return,
            }
        }
    }

    fn replaced(&mut self, clock: Instant) {
        // The log marks the replacement like a loss, followed by a key frame from which a replay
        // continues.
        self.replaced += 1;
        self.key_frame_due = clock;
        self.lost(clock, self.samples_lost);
    }

    fn lost(&mut self, clock: Instant, samples: u32) {
        self.samples_lost = samples;
        if let Some(log) = &mut self.log {
            log.taps_lost(clock, samples.wrapping_add(self.replaced));
        }
    }

    fn ends(&mut self) {
        if let Some(log) = self.log.take() {
            self.written = Some(log.into_sink());
        }
    }
}
