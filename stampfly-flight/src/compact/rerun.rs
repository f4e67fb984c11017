//! Runs a part of a compact record again: the scheduler decides what is due, from the recorded time and topics.

use super::contents::{Contents, ReadError, Samples};
use super::entry::WHOLE_PASS;
use super::words::{Entry, Words};
use crate::flight_loop::{Assembled, FlightLoop, Pending};
use crate::key_frame;
use crate::recorder::Recorder;
use alloc::collections::BTreeMap;
use alloc::vec::Vec;
use serde::{Serialize, de::DeserializeOwned};
use stampfly_bus::{ActivationState, Band, PublishWords, Schedule, Taps, TopicTable};
use stampfly_log::ulog::Sink;
use stampfly_types::{ActivationRecord, Instant};

/// Where a part ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stop {
    /// With the words.
    End,
    /// Something is missing before the next part.
    Lost,
}

/// A log that grows.
pub(super) struct Rerun<'r, R: Schedule, S> {
    pub(super) config: &'r R::Config,
    pub(super) samples: Samples,
    pub(super) log: &'r mut Recorder<R, S>,
    pub(super) contents: Contents,
    /// Parts before which something is missing, and the first.
    pub(super) breaks: u32,
}

/// A part's beginning.
struct Begin {
    lost: u32,
    positions: Vec<(ActivationRecord, ActivationState)>,
    frame: Vec<u8>,
}

/// A sample whose pass is not known yet.
struct Sample<'w> {
    topic: usize,
    line: usize,
    generation: u32,
    at: Instant,
    words: &'w [u32],
}

/// What comes before the pass that it belongs to.
#[derive(Default)]
struct Before<'w> {
    samples: Vec<Sample<'w>>,
    refused: BTreeMap<usize, u32>,
}

impl<'r, R: Schedule + Serialize + DeserializeOwned, S: Sink> Rerun<'r, R, S> {
    /// What a part begins with. `None` when the words end before the key frame.
    fn begin(&self, words: &mut Words<'_>) -> Result<Option<Begin>, ReadError> {
        let mut begun: Option<Begin> = None;
        loop {
            let damaged = words.damaged();
            match (words.entry::<R>()?, &mut begun) {
                (None, _) => return Ok(None),
                (Some(Entry::Part { lost }), _) => {
                    begun = Some(Begin { lost, positions: Vec::new(), frame: Vec::new() });
                }
                (Some(Entry::Position(record, state)), Some(begun)) => begun.positions.push((record, state)),
                (Some(Entry::Frame(frame)), Some(begun)) => {
                    let positions = core::mem::take(&mut begun.positions);
                    return Ok(Some(Begin { lost: begun.lost, positions, frame }));
                }
                _ => return Err(damaged),
            }
        }
    }

    /// Runs a part again, and those behind it as long as nothing is missing between them.
    pub(super) fn part(&mut self, words: &mut Words<'_>) -> Result<Stop, ReadError> {
        let Some(begin) = self.begin(words)? else { return Ok(Stop::End) };
        let mut bus = R::Topics::new();
        let Assembled { mut flight_loop, mut outside, mut taps } =
            Assembled::<R>::new(&mut bus, None, self.config, Instant::ZERO);
        let mut clock =
            key_frame::restore(&begin.frame, &mut flight_loop, &mut outside).map_err(ReadError::KeyFrame)?;
        for (record, state) in begin.positions {
            if !flight_loop.set_position(record, state) {
                return Err(words.damaged());
            }
        }
        taps.drain(&mut |_, _, _, _| {});
        // Says nothing the first time.
        self.log.taps_lost(clock, self.breaks);
        self.breaks += 1;
        self.frame(clock, begin.lost, &begin.frame)?;
        let mut flight = Flight { flight_loop, outside: &mut outside, taps: &mut taps, pending: Vec::new() };
        let mut before = Before::default();
        // What was published before the key frame has been published by nothing that runs again.
        let mut kept: Vec<u32> = flight.flight_loop.heads().iter().map(|topic| topic.head()).collect();
        loop {
            let (damaged, place) = (words.damaged(), words.place());
            let Some(entry) = words.entry::<R>()? else { return Ok(Stop::End) };
            match entry {
                Entry::Sample { topic, line, generation, at, words } => {
                    let head = flight.flight_loop.heads().get(topic).map_or(0, |topic| topic.head());
                    let waiting = before.samples.iter().filter(|sample| sample.topic == topic).count() as u32;
                    let ahead = generation.wrapping_sub(head).wrapping_sub(waiting) << 18;
                    // One that came while the key frame was made is in there already.
                    if ahead as i32 > 0 {
                        let generation = head.wrapping_add(waiting).wrapping_add(ahead >> 18);
                        let at = near(clock, at);
                        before.samples.push(Sample { topic, line, generation, at, words });
                    }
                }
                Entry::Refused { line, refused } => _ = before.refused.insert(line, refused),
                Entry::Pass { band, since } => {
                    clock = Instant::from_micros(clock.as_micros().saturating_add(since.into()));
                    self.pass(&mut flight, band, clock, core::mem::take(&mut before)).ok_or(damaged)?;
                }
                Entry::LatePass { band, clock: at } => {
                    clock = at;
                    self.pass(&mut flight, band, clock, core::mem::take(&mut before)).ok_or(damaged)?;
                }
                Entry::Started { band, clock: at } => {
                    clock = at;
                    self.start(&mut flight, band, clock, core::mem::take(&mut before)).ok_or(damaged)?;
                }
                Entry::Resumed(line) => {
                    let refused = before.refused.remove(&line).unwrap_or_default();
                    let place = flight.pending.iter().position(|(of, _)| *of == line);
                    // There is none when nothing was due, which has been noted.
                    if let Some(place) = place {
                        let (_, pending) = flight.pending.swap_remove(place);
                        self.finish(&mut flight, pending, refused);
                    }
                }
                Entry::Kept { topic, at, generation, words } => {
                    // The newest of a topic may be the one that it was the last time.
                    let known = kept.get_mut(topic).ok_or(damaged)?;
                    if core::mem::replace(known, generation) != generation {
                        self.contents.kept += 1;
                        if self.samples == Samples::Recorded {
                            self.log.sample(topic, at, generation, words);
                        }
                    }
                }
                Entry::Part { lost } if lost == begin.lost => {
                    // They are in the key frame.
                    let samples = core::mem::take(&mut before.samples);
                    self.publish(&mut flight, &samples, None).ok_or(damaged)?;
                    words.go_to(place);
                    let Some(begin) = self.begin(words)? else { return Ok(Stop::End) };
                    let made = key_frame::clock_of::<R>(&begin.frame).map_err(ReadError::KeyFrame)?;
                    self.frame(made, begin.lost, &begin.frame)?;
                    clock = made;
                }
                Entry::Part { .. } => {
                    words.go_to(place);
                    return Ok(Stop::Lost);
                }
                Entry::Position(..) | Entry::Frame(_) => return Err(damaged),
            }
        }
    }

    fn frame(&mut self, at: Instant, lost: u32, frame: &[u8]) -> Result<(), ReadError> {
        self.log.key_frame(at, frame).map_err(|_| ReadError::Full)?;
        self.contents.key_frames += 1;
        self.contents.lost = lost;
        self.reached(at);
        Ok(())
    }

    fn reached(&mut self, at: Instant) {
        let [from, _] = self.contents.span.unwrap_or([at; 2]);
        self.contents.span = Some([from, at]);
    }

    /// Everything of a band that is due, each line once. `None` when a sample is none of its topic's.
    fn pass(
        &mut self,
        flight: &mut Flight<'_, '_, '_, R>,
        band: Band,
        clock: Instant,
        before: Before<'_>,
    ) -> Option<()> {
        if band == Band::Background {
            return match self.start(flight, band, clock, before)? {
                Some((index, refused)) => {
                    let place = flight.pending.iter().position(|(of, _)| *of == index)?;
                    let (_, pending) = flight.pending.swap_remove(place);
                    self.finish(flight, pending, refused);
                    Some(())
                }
                None => Some(()),
            };
        }
        let Before { samples, refused } = before;
        let mut ran = false;
        self.publish(flight, &samples, Some(WHOLE_PASS as usize))?;
        for (index, info) in R::ACTIVATIONS.iter().enumerate() {
            if info.band != band {
                continue;
            }
            self.publish(flight, &samples, Some(index))?;
            if let Some(pending) = flight.flight_loop.start_line(index, clock, self.log) {
                self.contents.activations += 1;
                self.finish(flight, pending, refused.get(&index).copied().unwrap_or_default());
                ran = true;
            }
        }
        self.ended(clock, ran);
        Some(())
    }

    /// The first of a band that is due reads its inputs. Returns it, if there is one, with what it was refused.
    fn start(
        &mut self,
        flight: &mut Flight<'_, '_, '_, R>,
        band: Band,
        clock: Instant,
        before: Before<'_>,
    ) -> Option<Option<(usize, u32)>> {
        let Before { samples, refused } = before;
        // One line runs, which has seen all of them.
        self.publish(flight, &samples, None)?;
        let due = flight.flight_loop.first_due(band, clock);
        let started = due.and_then(|index| {
            let pending = flight.flight_loop.start_line(index, clock, self.log)?;
            self.contents.activations += 1;
            flight.pending.push((index, pending));
            Some((index, refused.get(&index).copied().unwrap_or_default()))
        });
        self.ended(clock, started.is_some());
        Some(started)
    }

    fn ended(&mut self, clock: Instant, ran: bool) {
        self.reached(clock);
        if !ran {
            self.contents.idle_since.get_or_insert(clock);
        }
    }

    /// Publishes the samples that this line is the first to see, or all.
    fn publish(
        &mut self,
        flight: &mut Flight<'_, '_, '_, R>,
        samples: &[Sample<'_>],
        line: Option<usize>,
    ) -> Option<()> {
        for sample in samples.iter().filter(|sample| line.is_none_or(|line| sample.line == line)) {
            let Sample { topic, generation, at, words, .. } = *sample;
            if flight.outside.publish_words(topic, at, words)? != generation {
                return None;
            }
            self.contents.samples += 1;
            self.log.sample(topic, at, generation, words);
        }
        Some(())
    }

    fn finish(&mut self, flight: &mut Flight<'_, '_, '_, R>, pending: Pending, refused: u32) {
        flight.flight_loop.finish_with(pending, refused, self.log);
        let topics = <R::Topics as TopicTable>::TOPICS;
        flight.taps.drain(&mut |topic, at, generation, words| {
            if self.samples == Samples::Again && topics.get(topic).is_some_and(|info| !info.is_outside) {
                self.log.sample(topic, at, generation, words);
            }
        });
    }
}

/// The vehicle that flies again.
struct Flight<'f, 'b, 'o, R: Schedule> {
    flight_loop: FlightLoop<'b, R>,
    outside: &'f mut <R::Topics as TopicTable>::Outside<'o>,
    taps: &'f mut <R::Topics as TopicTable>::Taps<'o>,
    /// Has read, and not run.
    pending: Vec<(usize, Pending)>,
}

/// The instant with these low bits that is nearest to the clock.
fn near(clock: Instant, low: u32) -> Instant {
    let clock = clock.as_micros();
    let ahead = low.wrapping_sub(clock as u32) as i32;
    Instant::from_micros(clock.saturating_add_signed(ahead.into()))
}
