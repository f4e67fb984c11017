//! Writes a compact record while the vehicle flies.

use super::model::{
    ACTIVATION, FRAME, INPUTS, LINE, LOST, Line, NOW, Now, PASS, REFUSED, TOPICS, Topic, width, zigzag, zigzag32,
};
use super::ring::Store;
use crate::flight_loop::Observer;
use core::cell::RefCell;
use stampfly_bus::{Activation, AnyTopic, TopicInfo};
use stampfly_types::activation::MAX_INPUTS;
use stampfly_types::{ActivationRecord, Instant};

/// Longest entry but a key frame: a message of 64 words, or an activation with all of its inputs.
const ENTRY: usize = 384;
/// Entries that go to the store at once, as long as there is room for one more: those of a pass, most often.
const ENTRIES: usize = 3 * ENTRY;

/// Entries that are being made.
struct Entry {
    bytes: [u8; ENTRIES],
    length: usize,
}

impl Entry {
    const fn new() -> Self {
        Self { bytes: [0; ENTRIES], length: 0 }
    }

    #[inline]
    fn byte(&mut self, byte: u8) {
        if let Some(place) = self.bytes.get_mut(self.length) {
            *place = byte;
        }
        self.length += 1;
    }

    #[inline]
    fn number(&mut self, mut number: u64) {
        while number >= 0x80 {
            self.byte(number as u8 | 0x80);
            number >>= 7;
        }
        self.byte(number as u8);
    }

    /// The same, for less: a register holds it.
    #[inline]
    fn number32(&mut self, mut number: u32) {
        while number >= 0x80 {
            self.byte(number as u8 | 0x80);
            number >>= 7;
        }
        self.byte(number as u8);
    }

    /// A difference of instants, which is mostly less than a minute.
    #[inline]
    fn difference64(&mut self, difference: u64) {
        match i32::try_from(difference as i64) {
            Ok(short) if short.unsigned_abs() < 0x4000_0000 => self.number32(zigzag32(short as u32)),
            _ => self.number(zigzag(difference)),
        }
    }

    /// The low bytes of a difference: all are written, and those that are too many overwritten.
    #[inline]
    fn difference(&mut self, difference: u32, width: u8) {
        if let Some(place) = self.bytes.get_mut(self.length..).and_then(<[u8]>::first_chunk_mut) {
            *place = difference.to_le_bytes();
        }
        self.length += usize::from(width);
    }

    /// `None` when it was too long.
    fn written(&self) -> Option<&[u8]> {
        self.bytes.get(..self.length)
    }
}

/// Records a vehicle with so many topics and lines into a store.
///
/// Call [`pass`](Self::pass) after every pass of the flight band, and [`key_frame`](Self::key_frame) after it, the first time to
/// begin. [`Watching`] is the flight loop's observer. What the store does not take is counted, and recording goes on at the next key
/// frame.
pub struct Compact<S, const COUNT: usize, const LINES: usize> {
    store: S,
    /// Every how many samples of a topic one is kept; zero for none.
    every: [u32; COUNT],
    seen: [Topic; COUNT],
    /// The newest generation of each topic that was looked at.
    heads: [u32; COUNT],
    lines: [Line; LINES],
    now: Now,
    is_on: bool,
    lost: u32,
    /// How many of them a reader knows of.
    told: u32,
    beyond: [u32; MAX_INPUTS],
    entry: Entry,
}

impl<S: Store, const COUNT: usize, const LINES: usize> Compact<S, COUNT, LINES> {
    /// Records nothing before the first key frame. `every` says of a topic that runnables publish every how many samples one
    /// is kept for comparison; all from outside are.
    pub fn new(store: S, topics: &'static [TopicInfo], every: fn(usize) -> u32) -> Self {
        const { assert!(COUNT < TOPICS && LINES <= LINE as usize + 1, "more topics or lines than an entry can name") };
        Self {
            store,
            every: core::array::from_fn(|place| match topics.get(place) {
                Some(info) if info.is_outside => 1,
                Some(_) => every(place),
                None => 0,
            }),
            seen: [Topic::NEW; COUNT],
            heads: [0; COUNT],
            lines: [Line::NEW; LINES],
            now: Now::NEW,
            is_on: false,
            lost: 0,
            told: 0,
            beyond: [0; MAX_INPUTS],
            entry: Entry::new(),
        }
    }

    /// Passes and samples that are missing: refused by the store, or overwritten on the bus before they were looked at.
    #[must_use]
    pub const fn lost(&self) -> u32 {
        self.lost
    }

    /// Where it goes.
    #[must_use]
    pub const fn store(&self) -> &S {
        &self.store
    }

    /// An entry is complete.
    #[inline]
    fn put(&mut self) {
        if self.entry.length > ENTRIES - ENTRY {
            self.flush();
        }
    }

    fn flush(&mut self) {
        let taken = self.is_on && self.entry.written().is_some_and(|bytes| self.store.put(bytes));
        if !taken {
            self.lost += 1;
            self.is_on = false;
        }
        self.entry.length = 0;
    }

    /// A runnable has read its inputs.
    pub fn activation(&mut self, record: &ActivationRecord) {
        let Self { lines, now, entry, beyond, is_on: true, .. } = self else { return };
        let Some(line) = lines.get_mut(usize::from(record.index)) else { return };
        let unexpected = line.set(record, beyond);
        let is_other = record.now.as_micros() != now.last();
        let flags = if is_other { NOW } else { 0 } | if unexpected != 0 { INPUTS } else { 0 };
        entry.byte(ACTIVATION | flags | record.index & LINE);
        if is_other {
            entry.difference64(record.now.as_micros().wrapping_sub(now.expected()));
            now.set(record.now);
        }
        if unexpected != 0 {
            entry.number32(unexpected.into());
            for (place, (input, beyond)) in record.inputs().iter().zip(beyond).enumerate() {
                if unexpected >> place & 1 == 1 {
                    entry.number32(zigzag32(*beyond));
                    entry.number32(input.taken.into());
                }
            }
        }
        self.put();
    }

    /// A runnable was refused what it published.
    pub fn refused(&mut self, record: &ActivationRecord) {
        if self.is_on {
            self.entry.byte(REFUSED);
            self.entry.byte(record.index);
            self.entry.number(record.refused.into());
            self.put();
        }
    }

    /// A pass is over: takes the samples that have come since the last one.
    pub fn pass(&mut self, heads: &[&dyn AnyTopic]) {
        for (place, topic) in heads.iter().enumerate() {
            let Some((every, looked_at)) = self.every.get(place).copied().zip(self.heads.get_mut(place)) else {
                return;
            };
            if every == 0 {
                continue;
            }
            let head = topic.head();
            let from = core::mem::replace(looked_at, head);
            if from == head || !self.is_on {
                continue;
            }
            let mut generation = from.wrapping_add(1);
            while generation != head.wrapping_add(1) {
                if every == 1 || generation % every == 0 {
                    let is_there = topic.copy(generation, &mut |at, words| self.sample(place, at, generation, words));
                    self.lost += u32::from(!is_there);
                }
                generation = generation.wrapping_add(1);
            }
        }
        if self.is_on {
            self.entry.byte(PASS);
            self.flush();
        }
    }

    fn sample(&mut self, topic: usize, at: Instant, generation: u32, words: &[u32]) {
        let Self { seen, entry, is_on: true, .. } = self else { return };
        let Some(seen) = seen.get_mut(topic) else { return };
        entry.byte(topic as u8);
        entry.difference64(at.as_micros().wrapping_sub(seen.expected()));
        entry.number32(generation.wrapping_sub(seen.generation).wrapping_sub(1));
        seen.set(at.as_micros(), generation);
        for (pair, words) in words.chunks(2).enumerate() {
            let mut differences = [0; 2];
            for (index, (word, difference)) in words.iter().zip(&mut differences).enumerate() {
                *difference = word.wrapping_sub(seen.word(2 * pair + index));
                seen.set_word(2 * pair + index, *word);
            }
            let [low, high] = differences.map(width);
            entry.byte(low | high << 4);
            for (difference, width) in differences.into_iter().zip([low, high]) {
                entry.difference(difference, width);
            }
        }
        self.put();
    }

    /// Takes the state of the vehicle, as [`encode`](crate::key_frame::encode) makes it, right after [`pass`](Self::pass). Recording
    /// begins, or goes on, here.
    pub fn key_frame(&mut self, frame: &[u8]) {
        self.entry.length = 0;
        if self.lost != self.told {
            self.entry.byte(LOST);
        }
        self.entry.byte(FRAME);
        self.entry.number(frame.len() as u64);
        self.is_on = self.store.begin(self.entry.length + frame.len());
        self.flush();
        let has_begun = self.is_on;
        self.is_on = has_begun && self.store.put(frame);
        if self.is_on {
            self.told = self.lost;
        } else if has_begun {
            self.lost += 1;
        }
        self.seen.fill(Topic::NEW);
        self.lines.fill(Line::NEW);
        self.now = Now::NEW;
    }
}

/// The observer: what it observes goes into the record, which whoever flies shares with it.
#[derive(Clone, Copy)]
pub struct Watching<'r, S, const COUNT: usize, const LINES: usize>(pub &'r RefCell<Compact<S, COUNT, LINES>>);

impl<S: Store, const COUNT: usize, const LINES: usize> Observer for Watching<'_, S, COUNT, LINES> {
    fn has_read(&mut self, activation: &Activation) {
        if let Ok(mut record) = self.0.try_borrow_mut() {
            record.activation(activation.record());
        }
    }

    fn finished(&mut self, activation: &Activation) {
        if activation.record().refused != 0
            && let Ok(mut record) = self.0.try_borrow_mut()
        {
            record.refused(activation.record());
        }
    }
}
