//! The compact record of a flight here, as a vehicle streams it.

use serde::Serialize;
use stampfly_bus::{AnyTopic, Schedule, TopicTable};
use stampfly_flight::FlightLoop;
use stampfly_flight::compact::{Chunks, Compact, Kept, Ring, Streamer, Watching};
use stampfly_types::Duration;
use std::cell::RefCell;

/// Words between the flight and whoever streams: several key frames.
const WORDS: usize = 32 * 1024;
/// A chunk fits into a datagram on any network.
const CHUNK: usize = 1200;
/// There is a chunk when it is this long, or at the end.
const LEAST: usize = 1000;
/// Topics of which samples are kept for comparison, the last ones of the table that runnables publish for others.
const KEPT: usize = 8;
/// Passes between two of these samples.
const EVERY: u32 = 80;
/// Between two key frames.
const KEY_FRAMES: Duration = Duration::from_secs(10);

/// Where the record waits.
pub(super) type RecordRing = Ring<WORDS>;
type Record<'b, R> = Compact<'b, 'b, R, WORDS>;
/// Takes a key frame: known where the state can be written.
type Frame<'b, R> = fn(&mut Record<'b, R>, &FlightLoop<'b, R>) -> Option<usize>;

/// Who takes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Taker {
    /// The witness, all of it.
    Witness,
    /// Whoever is around the vehicle, when somebody asks for it.
    Around,
}

/// A record that is being written.
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
        reader.want(taker == Taker::Witness);
        let table = <R::Topics as TopicTable>::TOPICS.iter().enumerate();
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

    /// The flight loop's observer.
    pub(super) const fn watching(&self) -> Watching<'_, 'b, 'b, R, WORDS> {
        Watching(&self.compact)
    }

    pub(super) const fn taker(&self) -> Taker {
        self.taker
    }

    pub(super) const fn chunks(&mut self) -> &mut dyn Chunks {
        &mut self.streamer
    }

    /// A turn is over: takes a key frame if one is due and nothing is pending.
    pub(super) fn take(&mut self, at_rest: Option<&FlightLoop<'b, R>>) {
        let compact = self.compact.get_mut();
        if let Some(flight_loop) = at_rest.filter(|_| compact.wants_key_frame()) {
            (self.take)(compact, flight_loop);
        }
    }

    /// Passes chunks on.
    pub(super) fn pass_on(&mut self, chunk: &mut dyn FnMut(&[u8])) {
        self.stream(LEAST, chunk);
    }

    /// The flight is over.
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
