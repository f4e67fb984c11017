//! Records a flight as a log that can be flown again.
//!
//! Feed it every sample from the log's taps and make it an observer of the flight loop. The order of the log is the order
//! in which things became visible: drain the taps before the flight loop runs, so that a sample is in the log before the
//! activation that reads it.
//!
//! | in the log | when |
//! |---|---|
//! | one sample | published, by anybody |
//! | one activation | has read its inputs |
//! | the same activation again, with what was refused | has finished, and a queue was full |
//! | a mark to find the way back, and a key frame | the caller asks for one |
//! | a dropout mark | the sink, or a tap, has lost something before |
//!
//! For a log of the last seconds in memory, see the black box.

use crate::flight_loop::{FlightLoop, Observer};
use crate::log_schema::LogSchema;
use stampfly_bus::{Activation, Band, Schedule, Taps};
use stampfly_log::ulog::{Definitions, Sample, Sink, WriteError, Writer};
use stampfly_types::Instant;

/// The key under which a log holds key frames.
pub const KEY_FRAME: &str = "key_frame";

/// Records one flight into a sink. What the sink refuses is counted and marked, never retried.
pub struct Recorder<R: Schedule, S> {
    log: Writer<S, LogSchema<R>>,
    taps_lost: u32,
}

impl<R: Schedule, S: Sink> Recorder<R, S> {
    /// Goes on with a log whose head is written: `Definitions::data(LogSchema::new(…))`.
    pub const fn new(log: Writer<S, LogSchema<R>>) -> Self {
        Self { log, taps_lost: 0 }
    }

    /// Begins a log of a vehicle of this name. One that has parameters begins with [`Definitions`], which takes them, and [`new`](Self::new).
    ///
    /// # Errors
    /// When the sink refuses the head.
    pub fn start(sink: S, vehicle: &str, now: Instant) -> Result<Self, WriteError<S::Error>> {
        let mut head = Definitions::start(sink, now)?;
        head.info("sys_name", vehicle)?;
        Ok(Self::new(head.data(LogSchema::new(&[]))?))
    }

    /// Records one sample of the topic in this line of the table, or of a topic beside the bus.
    pub fn sample(&mut self, topic: usize, at: Instant, generation: u32, words: &[u32]) {
        // The writer counts what the sink refuses, and marks it.
        let _ = self.log.sample(topic, &Sample { at, generation, words });
    }

    /// Runs what is due at `now` in both bands and records it in order: what came from outside, the activations, what they published.
    ///
    /// For programs with one thread, which call it whenever their clock has moved. Firmware runs each band in a task of its own.
    pub fn pass(&mut self, flight_loop: &mut FlightLoop<'_, R>, taps: &mut impl Taps, now: Instant) {
        taps.drain(&mut |topic, at, generation, words| self.sample(topic, at, generation, words));
        for band in [Band::Flight, Band::Background] {
            flight_loop.run_band(band, now, self);
        }
        taps.drain(&mut |topic, at, generation, words| self.sample(topic, at, generation, words));
        self.taps_lost(now, taps.lost());
    }

    /// Notes how many samples the taps have lost so far. A loss is marked in the log: a replay goes on after it only from
    /// a key frame.
    pub fn taps_lost(&mut self, now: Instant, lost: u32) {
        if lost != self.taps_lost {
            self.taps_lost = lost;
            self.log.mark_loss(now);
        }
    }

    /// Records a key frame, as [`encode`](crate::key_frame::encode) makes it. Ask for it between
    /// two passes of the flight loop, with the taps drained and no activation pending. A mark
    /// stands before it: in a damaged file a reader finds its way back there, and a replay goes on.
    ///
    /// # Errors
    /// When the sink refuses. The writer has counted it.
    pub fn key_frame(&mut self, now: Instant, frame: &[u8]) -> Result<(), WriteError<S::Error>> {
        // Without the mark the frame is still worth having.
        let _ = self.log.sync();
        self.log.blob(now, KEY_FRAME, frame)
    }

    /// Messages the sink has refused so far.
    #[must_use]
    pub const fn lost(&self) -> u32 {
        self.log.lost()
    }

    /// Where it goes.
    #[must_use]
    pub const fn sink(&self) -> &S {
        self.log.sink()
    }

    /// Ends the log. It is complete at every moment; nothing is written here.
    #[must_use]
    pub fn into_sink(self) -> S {
        self.log.into_sink()
    }
}

impl<R: Schedule, S: Sink> Observer for Recorder<R, S> {
    fn has_read(&mut self, activation: &Activation) {
        let _ = self.log.activation(activation.record());
    }

    fn finished(&mut self, activation: &Activation) {
        if activation.record().refused != 0 {
            let _ = self.log.activation(activation.record());
        }
    }
}
