//! Compact record of a local flight, as a vehicle streams it.

use serde::Serialize;
use stampfly_bus::{AnyTopic, Schedule, TopicTable};
use stampfly_flight::FlightLoop;
use stampfly_flight::compact::{Chunks, Compact, Kept, Ring, Streamer, Watching};
use stampfly_types::Duration;
use std::cell::RefCell;

/// Words buffered between flight and receiver: several key frames.
const WORDS: usize = 32 * 1024;
/// Largest chunk, bytes: fits into a datagram on any network.
const CHUNK: usize = 1200;
/// Least length of a chunk before the end of the flight, bytes.
const LEAST: usize = 1000;
/// Number of topics of which samples are kept for comparison: the last periodic ones in the table
/// that runnables publish.
const KEPT: usize = 8;
/// Passes between two kept samples.
const EVERY: u32 = 80;
/// Period of key frames.
const KEY_FRAMES: Duration = Duration::from_secs(10);

/// Buffer of the record.
pub(super) type RecordRing = Ring<WORDS>;
type Record<'b, R> = Compact<'b, 'b, R, WORDS>;
/// Function that takes a key frame; a pointer, because the state is serialisable only where it is
/// set.
type Frame<'b, R> = fn(&mut Record<'b, R>, &FlightLoop<'b, R>) -> Option<usize>;

/// Receiver of the record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Taker {
    /// The witness receives all of it.
    Witness,
    /// The surroundings receive it on request.
    Around,
}

/// A record in progress.
pub(super) struct Recording<'b, R: Schedule> {
    compact: RefCell<Record<'b, R>>,
    streamer: Streamer<'b, WORDS>,
    room: [u8; CHUNK],
    take: Frame<'b, R>,
    taker: Taker,
}

impl<'b, R: Schedule> Recording<'b, R> {
    pub(super) fn new(
        ring: &'b mut RecordRing,
        heads: &[&'b dyn AnyTopic],
        (taker, name): (Taker, &'static str),
    ) -> Self
    where
        R: Serialize,
    {
        let (writer, mut reader) = ring.split();
        // Surroundings request the record when a client asks for it.
        reader.want(taker == Taker::Witness);
        let table = <R::Topics as TopicTable>::TOPICS.iter().enumerate();
        // Periodic topics of runnables: samples from outside are recorded completely anyway.
        let fast = table.filter(|(_, info)| !info.is_outside && info.period.is_some());
        let mut topics: Vec<usize> = fast.map(|(place, _)| place).collect();
        topics.drain(..topics.len().saturating_sub(KEPT));
        let kept = Kept { topics: &topics, every: EVERY, key_frames: KEY_FRAMES };
        Self {
            compact: RefCell::new(Compact::new(writer, heads, name, kept)),
            streamer: Streamer::new(reader),
            room: [0; CHUNK],
            take: Compact::key_frame,
            taker,
        }
    }

    /// Observer for the flight loop.
    pub(super) const fn watching(&self) -> Watching<'_, 'b, 'b, R, WORDS> {
        Watching(&self.compact)
    }

    pub(super) const fn taker(&self) -> Taker {
        self.taker
    }

    pub(super) const fn chunks(&mut self) -> &mut dyn Chunks {
        &mut self.streamer
    }

    /// Takes a key frame if one is due and no activation is pending.
    pub(super) fn take(&mut self, at_rest: Option<&FlightLoop<'b, R>>) {
        let compact = self.compact.get_mut();
        if let Some(flight_loop) = at_rest.filter(|_| compact.wants_key_frame()) {
            (self.take)(compact, flight_loop);
        }
    }

    /// Passes on chunks of at least [`LEAST`] bytes.
    pub(super) fn pass_on(&mut self, chunk: &mut dyn FnMut(&[u8])) {
        self.stream(LEAST, chunk);
    }

    /// Passes on the remaining chunks at the end of the flight.
    pub(super) fn end(&mut self, chunk: &mut dyn FnMut(&[u8])) {
        self.stream(1, chunk);
    }

    fn stream(&mut self, least: usize, chunk: &mut dyn FnMut(&[u8])) {
        let Self { streamer, room, .. } = self;
        while let Some(length) = streamer.chunk(room, least) {
            chunk(room.get(..length).unwrap_or_default());
        }
    }
}
