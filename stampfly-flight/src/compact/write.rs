//! Writes a compact record while the vehicle flies: the flight core's half.

use super::entry::{Kind, MOST, VERSION};
use super::packed::Packed;
use super::ring::RingWriter;
use super::watch::{READERS, Taking, Watch, have_moved};
use crate::flight_loop::{Ended, FlightLoop, Observer, Positions};
use crate::key_frame::Place as _;
use core::cell::RefCell;
use core::marker::PhantomData;
use heapless::Vec;
use stampfly_bus::{Activation, ActivationState, AnyTopic, Band, Schedule};
use stampfly_types::{Duration, Instant};

/// Most topics of which samples are kept for comparison.
const KEPT: usize = 8;

/// Samples of runnables by which a replay is judged, and how often the state of the vehicle is recorded.
#[derive(Clone, Copy, Debug)]
pub struct Kept<'t> {
    /// Of these topics, eight at most, the newest sample is kept.
    pub topics: &'t [usize],
    /// After every so many passes of the flight band.
    pub every: u32,
    /// Between two key frames.
    pub key_frames: Duration,
}

/// Records a vehicle into a ring, as long as the other end of it [wants that](super::RingReader::want).
///
/// [`Watching`] is the flight loop's observer. Where the vehicle is [at rest](Self::wants_key_frame), [`key_frame`](Self::key_frame)
/// takes its state: recording begins there, and goes on there after something was lost. A topic that activates a runnable has to be
/// published by the executor of that runnable, as [`fly`](crate::task::fly) demands.
pub struct Compact<'b, 'r, R, const WORDS: usize> {
    ring: RingWriter<'r, WORDS>,
    watch: Watch<'b>,
    name: &'static str,
    /// See [`Kept`].
    every: u32,
    period: Duration,
    kept_topics: Vec<(u8, &'b dyn AnyTopic), KEPT>,
    until_kept: u32,
    clock: Instant,
    /// Of the last pass that is in the record.
    last: Instant,
    is_on: bool,
    /// The reader wanted it when it was last asked.
    is_wanted: bool,
    /// Positions are in the ring, not committed; nothing has happened since.
    is_at_rest: bool,
    is_due: bool,
    unfinished: u8,
    resumed: Option<u8>,
    due: Instant,
    /// What the last key frame took, in words.
    frame_words: u32,
    lost: u32,
    vehicle: PhantomData<fn() -> R>,
}

impl<'b, 'r, R: Schedule, const WORDS: usize> Compact<'b, 'r, R, WORDS> {
    /// Records nothing before the first key frame, which is due at once. `heads` are those of the flight loop, `name` is the vehicle's.
    pub fn new(ring: RingWriter<'r, WORDS>, heads: &[&'b dyn AnyTopic], name: &'static str, kept: Kept<'_>) -> Self {
        let is_wanted = ring.is_wanted();
        let topics = kept.topics.iter().take(KEPT).filter_map(|place| Some((*place as u8, *heads.get(*place)?)));
        Self {
            ring,
            watch: Watch::new::<R>(heads),
            name,
            every: kept.every.max(1),
            period: kept.key_frames,
            kept_topics: topics.collect(),
            until_kept: kept.every.max(1),
            clock: Instant::ZERO,
            last: Instant::ZERO,
            is_on: false,
            is_wanted,
            is_at_rest: false,
            is_due: is_wanted,
            unfinished: 0,
            resumed: None,
            due: Instant::ZERO,
            frame_words: 0,
            lost: 0,
            vehicle: PhantomData,
        }
    }

    /// Passes and activations that are not in the record, since the first key frame.
    #[must_use]
    pub const fn lost(&self) -> u32 {
        self.lost
    }

    /// Something did not fit. Recording goes on at the next key frame, which is due at once.
    #[cold]
    fn lose(&mut self) {
        self.ring.discard();
        (self.is_on, self.is_at_rest, self.is_due) = (false, false, true);
    }

    /// A runnable [began again](FlightLoop::renew): what comes does not follow from what was.
    /// The record goes on from a key frame.
    #[cold]
    pub fn renewed(&mut self) {
        if self.is_on || self.is_at_rest {
            self.lost += 1;
            self.lose();
        }
    }

    /// Nobody wants it any more. What was not committed is none of it.
    #[cold]
    fn stop(&mut self) {
        if self.is_on {
            self.lost += 1;
        }
        self.ring.discard();
        (self.is_on, self.is_at_rest, self.is_due, self.is_wanted) = (false, false, false, false);
    }

    /// Nothing of what was written for a key frame is valid any more.
    #[cold]
    fn no_rest(&mut self) {
        self.ring.discard();
        self.is_at_rest = false;
    }

    /// What is new and what every line of a pass will see.
    #[inline(always)]
    fn begin(&mut self, band: Band, clock: Instant) {
        self.clock = clock;
        if self.resumed.is_some() {
            self.put_resumed();
        }
        if !self.is_on {
            return;
        }
        let mut taking = Taking { ring: &mut self.ring, is_at_rest: self.is_at_rest, is_whole: true };
        self.watch.of(band).iter_mut().for_each(|watched| taking.take_new(watched));
        self.is_at_rest = taking.is_at_rest;
        if !taking.is_whole {
            self.lose();
        }
    }

    #[inline(always)]
    fn end(&mut self, band: Band, ended: Ended, positions: &mut dyn Positions) {
        if matches!(ended, Ended::HasRead(_)) {
            self.unfinished += 1;
        }
        if self.is_at_rest {
            self.no_rest();
        }
        if self.is_on {
            if have_moved(self.watch.of(band)) {
                self.middle(band, ended, positions);
            }
            let since = self.clock.as_micros().wrapping_sub(self.last.as_micros());
            match u32::try_from(since) {
                Ok(since)
                    if since <= MOST && !matches!(ended, Ended::HasRead(_)) && self.is_on && self.ring.has_room(1) =>
                {
                    self.ring.word(Kind::Pass.word(band_number(band), since));
                }
                _ => self.put_late(band, ended),
            }
            self.last = self.clock;
        }
        if matches!(band, Band::Flight) {
            self.until_kept = self.until_kept.wrapping_sub(1);
            if self.until_kept == 0 {
                self.now_and_then();
            }
        }
        if self.is_on {
            self.ring.commit();
        } else {
            self.lost += u32::from(self.frame_words != 0 && self.is_wanted);
        }
        if self.is_due && self.unfinished == 0 {
            self.rest(positions);
        }
    }

    /// Something came in the middle of a pass: which line was the first to see it?
    #[inline(never)]
    fn middle(&mut self, band: Band, ended: Ended, positions: &mut dyn Positions) {
        let ran = |line: usize| match ended {
            Ended::Band => R::ACTIVATIONS.get(line).is_some_and(|info| info.band == band),
            Ended::Line(only) | Ended::HasRead(only) => line == only,
        };
        let mut taking = Taking { ring: &mut self.ring, is_at_rest: false, is_whole: true };
        for watched in self.watch.of(band) {
            for reader in 0..READERS {
                let Some((line, input)) = watched.readers.get(reader).copied() else { break };
                if !ran(line.into()) || !watched.has_moved() {
                    continue;
                }
                let known = watched.known;
                let record = positions.inputs(line.into());
                let seen = record.inputs().get(usize::from(input)).map_or(known, |input| input.generation);
                if seen.wrapping_sub(known) < 1 << 31 {
                    taking.take(watched, seen, line.into());
                }
            }
        }
        if !taking.is_whole {
            self.lose();
        }
    }

    /// A pass long after the one before, or one that is not finished.
    #[inline(never)]
    fn put_late(&mut self, band: Band, ended: Ended) {
        if !self.is_on || !self.ring.has_room(3) {
            self.lose();
            return;
        }
        let kind = if !matches!(ended, Ended::HasRead(_)) { Kind::LatePass } else { Kind::Started };
        self.ring.word(kind.word(band_number(band), 0));
        self.put_instant(self.clock);
    }

    fn put_instant(&mut self, at: Instant) {
        self.ring.word(at.as_micros() as u32);
        self.ring.word((at.as_micros() >> 32) as u32);
    }

    #[inline(never)]
    fn put_resumed(&mut self) {
        let Some(line) = self.resumed.take() else { return };
        if self.is_at_rest {
            self.no_rest();
        }
        if self.is_on && self.ring.has_room(1) {
            self.ring.word(Kind::Resumed.word(line.into(), 0));
        } else if self.is_on {
            self.lose();
        }
    }

    /// Samples of runnables, for comparison; and is a key frame due?
    #[inline(never)]
    fn now_and_then(&mut self) {
        self.until_kept = self.every;
        if !self.ring.is_wanted() {
            return self.stop();
        }
        self.is_due |= self.clock >= self.due || !self.is_wanted;
        self.is_wanted = true;
        let Self { ring, kept_topics, watch, is_on: true, .. } = self else { return };
        let mut taking = Taking { ring, is_at_rest: false, is_whole: true };
        watch.topics.get_mut(watch.unread..).unwrap_or_default().iter_mut().for_each(|unread| taking.take_new(unread));
        let Taking { ring, is_whole: mut has_room, .. } = taking;
        for (place, topic) in kept_topics {
            let generation = topic.head();
            // Nobody publishes on it meanwhile: its publisher runs in this task.
            let Some(sample) = topic.in_place(generation) else { continue };
            let words = sample.words();
            has_room = has_room && ring.has_room(words.len() as u32 + 4);
            if has_room {
                let [low, high] = sample.at();
                ring.word(Kind::Kept.word((*place).into(), 0));
                ring.word(generation);
                ring.sample([low, high], &sample);
            }
        }
        if !has_room {
            self.lose();
        }
    }

    /// A runnable was refused what it published.
    #[inline(never)]
    fn refused(&mut self, index: u8, refused: u32) {
        if self.is_at_rest {
            self.no_rest();
        }
        if self.is_on && self.ring.has_room(2) {
            self.ring.word(Kind::Refused.word(index.into(), 0));
            self.ring.word(refused);
        } else if self.is_on {
            self.lose();
        }
    }

    /// Writes where every line is: what a key frame does not know. It is committed with the key frame.
    #[inline(never)]
    fn rest(&mut self, positions: &mut dyn Positions) {
        let lines = R::ACTIVATIONS.len();
        let inputs: usize = R::INPUTS.iter().sum();
        let name = self.name.len().div_ceil(4);
        let words = 2 + name + lines * (1 + ActivationState::WORDS) + inputs;
        // What the last key frame took, and a tenth more, so that one that will not fit is not made.
        if !self.ring.has_room(words as u32 + 1 + self.frame_words + self.frame_words / 8) {
            return;
        }
        if self.is_on {
            // Of topics that nobody reads, which no pass takes.
            let mut taking = Taking { ring: &mut self.ring, is_at_rest: false, is_whole: true };
            let unread = self.watch.topics.get_mut(self.watch.unread..).unwrap_or_default();
            unread.iter_mut().for_each(|unread| taking.take_new(unread));
            if !taking.is_whole {
                self.lose();
                return;
            }
            self.ring.commit();
        }
        self.ring.begin_part();
        self.ring.word(Kind::Part.word(VERSION, self.name.len() as u32));
        self.ring.word(self.lost);
        let mut name = Packed::new(&mut self.ring);
        // There is room for all of it.
        let _ = name.put(self.name.as_bytes());
        name.finish();
        for line in 0..lines {
            let record = positions.inputs(line);
            self.ring.word(Kind::Position.word(line as u32, record.inputs().len() as u32));
            let state = positions.state(line).unwrap_or_else(|| ActivationState::new(Instant::ZERO));
            state.to_words().into_iter().for_each(|word| self.ring.word(word));
            record.inputs().iter().for_each(|input| self.ring.word(input.generation));
        }
        self.is_at_rest = true;
    }

    /// Is a key frame due, and has nothing happened since the last pass?
    #[must_use]
    pub const fn wants_key_frame(&self) -> bool {
        self.is_at_rest
    }

    /// Takes the state of the vehicle, if a key frame is [wanted](Self::wants_key_frame). It is made in the ring, in which there has to be
    /// room for it. Returns its length, if there is one.
    pub fn key_frame(&mut self, flight_loop: &FlightLoop<'_, R>) -> Option<usize>
    where
        R: serde::Serialize,
    {
        if !self.is_at_rest {
            return None;
        }
        self.is_at_rest = false;
        if !self.is_on {
            self.watch.topics.iter_mut().for_each(|watched| watched.known = watched.head.newest());
        }
        // What another core has published since the pass comes behind the key frame, not in it. If it has overwritten something
        // there is no key frame, but one after the next pass.
        let topics = &self.watch.topics;
        let head = |place: usize, topic: &dyn AnyTopic| {
            let watched = topics.iter().find(|watched| usize::from(watched.place) == place);
            watched.map_or_else(|| topic.head(), |watched| watched.known)
        };
        let begun = self.ring.place();
        self.ring.word(0);
        let mut packed = Packed::new(&mut self.ring);
        let length = crate::key_frame::encode_up_to(flight_loop, self.clock, head, &mut packed);
        let length = length.ok().filter(|length| *length as u32 <= MOST);
        packed.finish();
        let Some(length) = length else {
            self.ring.discard();
            return None;
        };
        self.ring.change(begun, Kind::Frame.word(0, length as u32));
        self.frame_words = self.frame_words.max(length.div_ceil(4) as u32 + 1);
        self.ring.commit_part();
        (self.is_on, self.is_due) = (true, false);
        self.last = self.clock;
        self.due = self.clock + self.period;
        Some(length)
    }
}

const fn band_number(band: Band) -> u32 {
    matches!(band, Band::Background) as u32
}

/// Observes a flight loop for a record that is written elsewhere in the same task, too: its key frames.
pub struct Watching<'c, 'b, 'r, R, const WORDS: usize>(pub &'c RefCell<Compact<'b, 'r, R, WORDS>>);

impl<R: Schedule, const WORDS: usize> Observer for Watching<'_, '_, '_, R, WORDS> {
    #[inline]
    fn pass_begins(&mut self, band: Band, clock: Instant) {
        if let Ok(mut record) = self.0.try_borrow_mut() {
            record.begin(band, clock);
        }
    }

    #[inline]
    fn pass_ends(&mut self, band: Band, ended: Ended, positions: &mut dyn Positions) {
        if let Ok(mut record) = self.0.try_borrow_mut() {
            record.end(band, ended, positions);
        }
    }

    #[inline]
    fn finished(&mut self, activation: &Activation) {
        let record = activation.record();
        if record.refused != 0
            && let Ok(mut compact) = self.0.try_borrow_mut()
        {
            compact.refused(record.index, record.refused);
        }
    }

    fn renewed(&mut self) {
        if let Ok(mut record) = self.0.try_borrow_mut() {
            record.renewed();
        }
    }

    fn resumes(&mut self, index: usize) {
        if let Ok(mut record) = self.0.try_borrow_mut() {
            record.unfinished = record.unfinished.saturating_sub(1);
            record.resumed = Some(index as u8);
        }
    }
}
