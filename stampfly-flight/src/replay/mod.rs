//! Replay: the flight again, from what came from outside.
//!
//! A log holds the samples that drivers and links published, and for every activation which samples it saw. From those
//! and the parameters alone every runnable is run again, in the recorded order. Everything it publishes is compared with
//! the log, bit for bit; the first difference is named.
//!
//! A replay starts at power-on, or at the first key frame after a given instant. Where the log has
//! lost something, the replay stops comparing and goes on at the next key frame; [`Replay::gaps`]
//! counts that. A key frame that comes up while the replay runs is compared with the vehicle's
//! state, too. A log that was cut off is repeated up to its last whole message, a damaged one in
//! the parts that are whole; [`Replay::end`] says which it is.
//!
//! Needs a heap. Not for firmware: the golden flight is a replay without one.

mod compare;
mod memory;
mod script;

pub use compare::Difference;
pub use memory::Memory;
pub use script::{ReplayError, vehicle_name};

use crate::flight_loop::Assembled;
use crate::key_frame;
use alloc::vec;
use compare::Comparison;
use script::{Entry, Script};
use serde::{Serialize, de::DeserializeOwned};
use stampfly_bus::{PublishWords, Schedule, Taps, TopicTable};
use stampfly_log::ulog::{End, ParameterValue};
use stampfly_types::{ActivationRecord, Duration, Instant};

/// What came out of a replay that could be made.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Replay {
    /// Activations repeated.
    pub activations: u64,
    /// Samples compared.
    pub samples: u64,
    /// Key frames that were compared with the state of the vehicle.
    pub key_frames: u64,
    /// The first sample or key frame that differs.
    pub difference: Option<Difference>,
    /// How often the replay went on at a key frame because the log had lost something.
    pub gaps: u64,
    /// Activations that were not repeated: before the start, or in a gap.
    pub skipped: u64,
    /// Time between the first and the last activation that were repeated.
    pub duration: Duration,
    /// How far the log is whole. What is behind its end was not repeated.
    pub end: End,
}

/// How to replay.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReplayOptions {
    /// Start at the first key frame at or after this instant, instead of at power-on.
    pub from: Option<Instant>,
    /// Not every sample that runnables published is in the log, so those that are missing say nothing.
    pub is_thinned: bool,
}

/// Room for a key frame, bytes. Grows as needed.
const KEY_FRAME_ROOM: usize = 64 * 1024;

/// Flies a log again.
///
/// `config` is the configuration at power-on; `set` applies a parameter of the log to it, and says whether there is such
/// a parameter and the value is in range.
///
/// # Errors
/// When it is no log, is not of this vehicle, has no key frame to start from, or its writer has
/// lost something and no key frame follows. A difference is no error: see [`Replay::difference`].
/// Nor is an end within a message, or damage behind something that could be repeated: see
/// [`Replay::end`].
pub fn replay<R: Schedule + Serialize + DeserializeOwned>(
    log: &[u8],
    config: R::Config,
    mut set: impl FnMut(&mut R::Config, &str, ParameterValue) -> bool,
    options: ReplayOptions,
) -> Result<Replay, ReplayError> {
    let mut config = config;
    let script = Script::read::<R>(log, |name, value| set(&mut config, name, value))?;
    let mut player = Player::<R> {
        config,
        start: script.start,
        is_thinned: options.is_thinned || script.is_head_damaged,
        outcome: Replay { end: script.end, ..Replay::default() },
        first: None,
        state: None,
    };
    let mut place = match options.from {
        None => Some((0, None)),
        Some(from) => player.next_key_frame(&script.entries, 0, Some(from))?,
    };
    if place.is_none() {
        return Err(ReplayError::NoKeyFrame);
    }
    while let Some((from, frame)) = place {
        let Some((lost_at, why)) = player.play(&script.entries, from, frame)? else { break };
        player.outcome.gaps += 1;
        place = player.next_key_frame(&script.entries, lost_at, None)?;
        let is_damage = !script.end.is_whole() || matches!(why, ReplayError::Damaged { .. });
        if place.is_none() && !(is_damage && player.outcome.activations > 0) {
            return Err(why);
        }
    }
    let Player { outcome, state, .. } = player;
    Ok(Replay { difference: outcome.difference.or(state), ..outcome })
}

/// Plays the stretches of a log between its gaps.
struct Player<R: Schedule> {
    config: R::Config,
    start: Instant,
    is_thinned: bool,
    outcome: Replay,
    first: Option<Instant>,
    /// The first key frame that differed.
    state: Option<Difference>,
}

impl<R: Schedule + Serialize + DeserializeOwned> Player<R> {
    /// The next key frame from this entry on, and the entry behind it. Counts the activations before it as skipped.
    fn next_key_frame<'e>(
        &mut self,
        entries: &'e [Entry],
        from: usize,
        since: Option<Instant>,
    ) -> Result<Option<(usize, Option<&'e [u8]>)>, ReplayError> {
        for (place, entry) in entries.iter().enumerate().skip(from) {
            match entry {
                Entry::Activation(_) => self.outcome.skipped += 1,
                Entry::KeyFrame(frame) => {
                    let clock = key_frame::clock_of::<R>(frame).map_err(ReplayError::KeyFrame)?;
                    if since.is_none_or(|since| clock >= since) {
                        return Ok(Some((place + 1, Some(frame))));
                    }
                }
                _ => {}
            }
        }
        Ok(None)
    }

    /// Plays from this entry on, on a vehicle of its own, until the log ends, differs, or has lost something: then the
    /// entry where that was, and what it would mean if nothing came after.
    fn play(
        &mut self,
        entries: &[Entry],
        from: usize,
        frame: Option<&[u8]>,
    ) -> Result<Option<(usize, ReplayError)>, ReplayError> {
        let topics = <R::Topics as TopicTable>::TOPICS;
        let mut bus = R::Topics::new();
        let Assembled { mut flight_loop, mut outside, mut taps } =
            Assembled::<R>::new(&mut bus, None, &self.config, self.start);
        if let Some(frame) = frame {
            key_frame::restore(frame, &mut flight_loop, &mut outside).map_err(ReplayError::KeyFrame)?;
            // What was on the bus already has been published by nothing that is repeated here.
            taps.drain(&mut |_, _, _, _| {});
        }
        let mut comparison = Comparison::new(topics);
        for (place, entry) in entries.iter().enumerate().skip(from) {
            match entry {
                Entry::Outside { topic, at, generation, words } => {
                    let published = outside.publish_words(*topic, *at, words);
                    let name = topics[*topic].name;
                    match published {
                        None => return Err(ReplayError::Schema(name.into())),
                        Some(number) if number != *generation => {
                            return Ok(Some((place, ReplayError::LostSample { topic: name.into(), at: *at })));
                        }
                        Some(_) => {}
                    }
                }
                Entry::Activation(record) => {
                    let again = flight_loop.replay(with_refusals(record, &entries[place + 1..]));
                    if again.is_missing_input() {
                        let activation = R::ACTIVATIONS[usize::from(record.index)].name.into();
                        return Ok(Some((place, ReplayError::Gap { activation, now: record.now })));
                    }
                    self.outcome.activations += 1;
                    self.outcome.duration = record.now.since(*self.first.get_or_insert(record.now));
                    taps.drain(&mut |topic, at, generation, words| {
                        if !topics[topic].is_outside {
                            comparison.published(topic, at, generation, words, record);
                        }
                    });
                }
                Entry::Refusals(_) => {}
                Entry::Inside { topic, at, generation, words } => {
                    self.outcome.samples += 1;
                    self.outcome.difference = comparison.recorded::<R>(*topic, *at, *generation, words);
                }
                Entry::KeyFrame(frame) => {
                    self.outcome.key_frames += 1;
                    let clock = key_frame::clock_of::<R>(frame).map_err(ReplayError::KeyFrame)?;
                    let mut now = vec![0; frame.len().max(KEY_FRAME_ROOM)];
                    let length = key_frame::encode(&flight_loop, clock, &mut now).map_err(ReplayError::KeyFrame)?;
                    if now.get(..length) != Some(frame) {
                        // What it published says more; a state that differs and never shows is told at the end.
                        self.state.get_or_insert_with(|| Difference::of_state(clock));
                    }
                }
                Entry::Lost(at) => return Ok(Some((place + 1, ReplayError::Dropout { at: *at }))),
                Entry::Damaged(at) => return Ok(Some((place + 1, ReplayError::Damaged { at: *at }))),
            }
            if self.outcome.difference.is_some() {
                return Ok(None);
            }
        }
        if !self.is_thinned {
            self.outcome.difference = comparison.unrecorded::<R>();
        }
        Ok(None)
    }
}

/// The record with what was refused, which the log knows only after the activation has finished.
fn with_refusals(record: &ActivationRecord, later: &[Entry]) -> ActivationRecord {
    let next = later.iter().find_map(|entry| match entry {
        Entry::Activation(other) if other.index == record.index => Some(None),
        Entry::Refusals(other) if other.index == record.index => Some(Some(*other)),
        _ => None,
    });
    next.flatten().filter(|amended| amended.now == record.now).unwrap_or(*record)
}
