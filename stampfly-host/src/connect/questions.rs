//! Questions to a vehicle on the secure link that are asked until they are answered: parameters, and lines of the console.
//!
//! A question for a parameter is asked again as it was: to write a value twice is to write it once. A line has a number, so that the vehicle does once what it says, and is asked for
//! the part of its answer that is missing. Commands are [`Commands`](stampfly_link::secure::Commands)'. No socket, no clock, no key.

use stampfly_link::secure::{FRESH, Payload};
use stampfly_types::{Duration, Instant};
use std::collections::VecDeque;

/// Questions whose answers are still to come. The station gives up after a while, and asks fewer in that time.
const ASKED: usize = 128;
/// A question is asked again after this long: the vehicle makes two answers every 20 ms, and eight wait.
const AGAIN: Duration = Duration::from_millis(300);
/// When a part of an answer is missing: the parts behind it that are on their way come before the one that is asked for.
const GAP: Duration = Duration::from_millis(60);
/// For this long. A station that gives up after three seconds has given up on none that may still be answered.
const PATIENCE: Duration = Duration::from_secs(2);
/// A question that changes something is asked again after this long, as long as it is [`FRESH`].
const CHANGE_AGAIN: Duration = Duration::from_millis(150);

/// Seals a payload and sends it. Returns the counter of its frame; `None` when it could not be sealed.
pub(super) type Send<'s> = &'s mut dyn FnMut(&Payload<'_>) -> Option<u32>;

/// A question for a parameter.
#[derive(Clone, Copy, Debug)]
struct Parameter {
    number: u16,
    index: u16,
    /// What it is to be, if it is to be changed.
    written: Option<f32>,
    /// From when on it is not said any more, and from when on no answer is awaited.
    said_until: Instant,
    until: Instant,
    again_at: Instant,
}

impl Parameter {
    const fn payload(&self) -> Payload<'static> {
        let index = self.index;
        match self.written {
            Some(value) => Payload::WriteParameter { index, value },
            None => Payload::ReadParameter { index },
        }
    }

    /// The parameter has this value: is that what became of the question? To a write, the answer to a reading before it is none.
    fn is_answer(&self, value: f32, taken: bool) -> bool {
        // A time is rounded to whole microseconds.
        self.written.is_none_or(|written| !taken || (value - written).abs() <= 1e-6 * written.abs().max(1.0))
    }
}

/// A line that is being answered.
#[derive(Debug)]
struct Line {
    /// The question's, and that which the vehicle knows it by.
    question: u16,
    number: u32,
    text: String,
    /// Bytes of the answer that have come.
    had: u16,
    /// Has the vehicle begun with it?
    is_begun: bool,
    /// From when on it is not said any more, unless the vehicle has begun.
    said_until: Instant,
    until: Instant,
    again_at: Instant,
}

/// Questions of one station.
#[derive(Debug, Default)]
pub(super) struct Questions {
    parameters: VecDeque<Parameter>,
    line: Option<Line>,
    /// What a vehicle refuses while it is armed: counters of frames, and numbers of the questions in them.
    refusable: VecDeque<(u32, u16)>,
}

impl Questions {
    /// Takes a question that was asked then, and which a line's vehicle knows by another number. `false` when it is none of these.
    pub fn ask(&mut self, now: Instant, asked: Instant, (number, of_line): (u16, u32), payload: &Payload<'_>) -> bool {
        let (said_until, until, again_at) = (asked + FRESH, now + PATIENCE, now);
        match *payload {
            Payload::ReadParameter { index } => {
                let question = Parameter { number, index, written: None, said_until: until, until, again_at };
                remember(&mut self.parameters, question);
            }
            Payload::WriteParameter { index, value } => {
                // The newer value is the one that stays: the older is not said again.
                let is_older = |question: &&mut Parameter| question.index == index && question.written.is_some();
                self.parameters.iter_mut().filter(is_older).for_each(|older| older.again_at = older.until);
                let question = Parameter { number, index, written: Some(value), said_until, until, again_at };
                remember(&mut self.parameters, question);
            }
            Payload::Line(text) => {
                let text = text.to_owned();
                let (question, number) = (number, of_line);
                self.line = Some(Line { question, number, text, had: 0, is_begun: false, said_until, until, again_at });
            }
            _ => return false,
        }
        true
    }

    /// Asks what is due to be asked, for the first time or again.
    pub fn poll(&mut self, now: Instant, send: Send<'_>) {
        let Self { parameters, line, refusable } = self;
        parameters.retain(|question| now < question.until);
        for question in parameters.iter_mut().filter(|question| (question.again_at..question.said_until).contains(&now))
        {
            question.again_at = now + if question.written.is_some() { CHANGE_AGAIN } else { AGAIN };
            let counter = send(&question.payload());
            if let Some(counter) = counter.filter(|_| question.written.is_some()) {
                remember(refusable, (counter, question.number));
            }
        }
        line.take_if(|line| now >= line.until);
        let is_due = |line: &&mut Line| now >= line.again_at && (line.is_begun || now < line.said_until);
        if let Some(line) = line.as_mut().filter(is_due) {
            line.again_at = now + if line.is_begun { AGAIN } else { CHANGE_AGAIN };
            let question = Payload::Question { number: line.number, from: line.had, line: &line.text };
            if let Some(counter) = send(&question) {
                remember(refusable, (counter, line.question));
            }
        }
    }

    /// The number of the question that is answered with a parameter's value. Zero, which no question has, when nobody has asked.
    pub fn parameter(&mut self, index: u16, value: f32, taken: bool) -> u16 {
        let is_asked = |question: &Parameter| question.index == index && question.is_answer(value, taken);
        let place = self.parameters.iter().position(is_asked);
        place.and_then(|place| self.parameters.remove(place)).map_or(0, |question| question.number)
    }

    /// The number of the question that the next part of an answer belongs to. Behind a gap it is none, and is asked for once more.
    pub fn part(&mut self, now: Instant, number: u32, from: u16, text: &str, last: bool) -> Option<u16> {
        let line = self.line.as_mut().filter(|line| line.number == number)?;
        let begins = !core::mem::replace(&mut line.is_begun, true);
        // That the vehicle works on it is no progress, but for the first time: it is not waited for
        // without end.
        if begins || (from == line.had && !text.is_empty()) {
            line.until = now + PATIENCE;
        }
        if from != line.had {
            if from > line.had {
                line.again_at = line.again_at.min(now + GAP);
            }
            return None;
        }
        let question = line.question;
        line.again_at = now + AGAIN;
        match u16::try_from(text.len()).ok().and_then(|length| from.checked_add(length)) {
            Some(had) if !last => line.had = had,
            // No answer is so long.
            _ => self.line = None,
        }
        Some(question)
    }

    /// The line is not said again.
    pub fn end_line(&mut self) {
        self.line = None;
    }

    /// The number of the question that was in a frame which was refused.
    pub fn refused(&mut self, counter: u32) -> Option<u16> {
        // The newest: sessions before this one had the same counters.
        let place = self.refusable.iter().rposition(|(refused, _)| *refused == counter)?;
        let (_, number) = self.refusable.remove(place)?;
        self.parameters.retain(|question| question.number != number);
        self.line.take_if(|line| line.question == number);
        Some(number)
    }

    #[cfg(test)]
    pub fn parameters(&self) -> usize {
        self.parameters.len()
    }
}

/// Takes the place of the oldest, where there are many.
pub(super) fn remember<T>(asked: &mut VecDeque<T>, question: T) {
    if asked.len() >= ASKED {
        asked.pop_front();
    }
    asked.push_back(question);
}
