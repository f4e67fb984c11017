//! The whole flight stack while anything that it is given is changed.
//!
//! A flight in simulation is recorded once: every sample from outside, every turn of the executor. It is played to a new
//! vehicle with the edits that the input describes. The loop is open, so what cannot hold there is not asked for: that
//! instants go on (`I9`, they are edited) and that a landing ends (`I10`, nothing sinks). Faults in a closed loop are the
//! campaign's.

use crate::Input;
use stampfly_board::VehicleConfig;
use stampfly_board::schedule::Runnables;
use stampfly_board::simulation::judge::Invariants;
use stampfly_board::simulation::mission::Mission;
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_board::topics::{Bus, Id};
use stampfly_bus::{Band, PublishWords, Taps, TopicTable};
use stampfly_flight::newest::message;
use stampfly_flight::{Assembled, Observer};
use stampfly_sim::vehicle::{Vehicle, Witness};
use stampfly_types::messages::{FlightMode, MotorOutput};
use stampfly_types::{Duration, Instant};
use std::sync::OnceLock;

/// Edits of one input.
const EDITS: usize = 12;
/// Instants are earlier by less than this, ms. The time of the flight band is that of its sample, so a vehicle cannot know that all
/// its inertial samples are older than the 57.5 ms that `I7` allows.
const LATE: u64 = 20;
/// Longest time without a turn, turns of the simulation: 20 ms. The cut-off that comes after 60 ms is no part of this.
const HELD_UP: usize = 8;

/// What a vehicle was given.
#[derive(Clone, Debug)]
enum Event {
    Sample { topic: usize, at: Instant, words: Vec<u32> },
    Turn(Instant),
}

/// What happens to the samples of a topic, or to the executor.
#[derive(Clone, Copy, Debug)]
enum Change {
    Silent,
    Stuck,
    Zero,
    /// A word of it is this.
    Word(usize, u32),
    /// A bit of it is turned.
    Flip(usize, u32),
    /// It comes this late, and is stamped so.
    Stamped(Duration),
    /// Another one with random words follows each.
    Forged(u32),
    /// The executor does nothing.
    HeldUp,
}

/// From one turn to another.
#[derive(Clone, Copy, Debug)]
struct Edit {
    topic: usize,
    turns: [usize; 2],
    change: Change,
}

/// Which of two flights, then edits: when, how long, of what, how.
pub fn whole_stack(data: &[u8]) {
    let mut input = Input(data);
    let flight = &flights()[usize::from(input.byte() & 1)];
    let turns = flight.iter().filter(|event| matches!(event, Event::Turn(_))).count();
    let mut edits = Vec::new();
    while !input.is_empty() && edits.len() < EDITS {
        edits.push(edit(&mut input, turns));
    }
    let violations = play(flight, &edits, |_, _| {});
    assert!(violations.is_empty(), "{violations:?} with {edits:?}");
}

fn edit(input: &mut Input, turns: usize) -> Edit {
    let from = usize::from(u16::from_le_bytes([input.byte(), input.byte()])) * turns / 65_536;
    let (lasts, topic, what) = (usize::from(input.byte()), usize::from(input.byte()), input.byte());
    let topics = outside();
    let (lasts, change) = match what % 8 {
        0 => (lasts, Change::Silent),
        1 => (lasts, Change::Stuck),
        2 => (lasts, Change::Zero),
        3 => {
            let scale = [1e-3, 1.0, 30.0, 1e6][usize::from(input.byte() % 4)];
            (lasts, Change::Word(usize::from(input.byte()), input.number(scale).to_bits()))
        }
        4 => (lasts, Change::Flip(usize::from(input.byte()), 1 << (input.byte() % 32))),
        5 => (lasts, Change::Stamped(Duration::from_millis(u64::from(input.byte()) % LATE))),
        6 => (lasts, Change::Forged(u32::from(input.byte()))),
        _ => (lasts % HELD_UP, Change::HeldUp),
    };
    Edit { topic: topics[topic % topics.len()], turns: [from, from + lasts], change }
}

/// Places of the topics that come from outside.
fn outside() -> Vec<usize> {
    let table = <Bus as TopicTable>::TOPICS.iter().enumerate();
    table.filter(|(_, info)| info.is_outside).map(|(place, _)| place).collect()
}

/// Plays a flight with edits and returns the names of the invariants that did not hold. `watch` is told after each turn whether the
/// motors are on.
fn play(flight: &[Event], edits: &[Edit], mut watch: impl FnMut(usize, bool)) -> Vec<&'static str> {
    let config = VehicleConfig::default();
    let start = flight.iter().find_map(|event| if let Event::Turn(clock) = event { Some(*clock) } else { None });
    let mut bus = Bus::new();
    let Assembled { mut flight_loop, mut outside, mut taps } =
        Assembled::<Runnables>::new(&mut bus, None, &config, start.unwrap_or(Instant::ZERO));
    let mut invariants = Invariants::new(config.mode.hover_without_link);
    let mut last: Vec<Vec<u32>> = vec![Vec::new(); <Bus as TopicTable>::TOPICS.len()];
    let (mut turn, mut motors_on) = (0, false);
    for event in flight {
        let now = turn;
        let mut active = edits.iter().filter(|edit| (edit.turns[0]..edit.turns[1]).contains(&now));
        match event {
            Event::Sample { topic, at, words } => {
                let (mut at, mut edited, mut forged) = (*at, Some(words.clone()), None);
                for Edit { change, .. } in active.filter(|edit| edit.topic == *topic) {
                    let Some(words) = &mut edited else { break };
                    let length = words.len();
                    match *change {
                        Change::Silent => edited = None,
                        Change::Stuck if last[*topic].is_empty() => {}
                        Change::Stuck => words.clone_from(&last[*topic]),
                        Change::Zero => words.fill(0),
                        Change::Word(index, word) => words[index % length] = word,
                        Change::Flip(index, bit) => words[index % length] ^= bit,
                        Change::Stamped(late) => {
                            at = Instant::from_micros(at.as_micros().saturating_sub(late.as_micros()))
                        }
                        Change::Forged(seed) => forged = Some(random_words(seed, length)),
                        Change::HeldUp => {}
                    }
                }
                for words in edited.into_iter().chain(forged) {
                    // What is none of the topic's messages is refused, as it is by a driver's types.
                    if outside.publish_words(*topic, at, &words).is_some() {
                        last[*topic] = words;
                    }
                }
            }
            Event::Turn(clock) => {
                turn += 1;
                if active.any(|edit| matches!(edit.change, Change::HeldUp)) {
                    continue;
                }
                for band in [Band::Flight, Band::Background] {
                    flight_loop.run_band(band, *clock, &mut ());
                }
                taps.drain(&mut |topic, at, _, words| {
                    let Some(id) = Id::ALL.get(topic) else { return };
                    invariants.published(*id, at, words);
                    if let Some(output) = message::<MotorOutput>(words).filter(|_| *id == Id::actuator_motor) {
                        motors_on = output.duty.iter().any(|duty| *duty > 0.0);
                    }
                });
                invariants.motors(motors_on);
                invariants.see(*clock, 0.0);
                watch(turn, motors_on);
            }
        }
    }
    invariants.violations().filter(|name| !["I9", "I10"].contains(name)).collect()
}

/// Words of any bits, always the same from a seed: a linear congruential generator (Knuth, The Art of Computer
/// Programming 2, section 3.3.4, with Lavaux's multiplier).
fn random_words(seed: u32, length: usize) -> Vec<u32> {
    let mut state = seed;
    let words = (0..length).map(|_| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state.rotate_left(16)
    });
    words.collect()
}

/// A flight by a program and one by a pilot, flown once.
fn flights() -> &'static [Vec<Event>; 2] {
    static FLIGHTS: OnceLock<[Vec<Event>; 2]> = OnceLock::new();
    FLIGHTS.get_or_init(|| [None, Some(FlightMode::PosHold)].map(record))
}

fn record(pilot: Option<FlightMode>) -> Vec<Event> {
    let mission = Mission::parse("arm\ntakeoff 0.5\nhover 1\nland\n").expect("a mission");
    let setup = Setup { mission, pilot, limit: Duration::from_secs(20), ..Setup::reference(1) };
    let mut recorder = Recorder::default();
    StampFly::fly(&setup, &mut recorder, &mut |_, _| {});
    recorder.0
}

#[derive(Default)]
struct Recorder(Vec<Event>);

impl Observer for Recorder {}

impl Witness<Runnables> for Recorder {
    fn turn(&mut self, clock: Instant) {
        // Most turns of a simulation find nothing to do; the vehicle's own come with its inertial samples.
        if matches!(self.0.last(), Some(Event::Sample { .. })) {
            self.0.push(Event::Turn(clock));
        }
    }

    fn published(&mut self, topic: usize, at: Instant, _: u32, words: &[u32]) {
        if <Bus as TopicTable>::TOPICS[topic].is_outside {
            self.0.push(Event::Sample { topic, at, words: words.to_vec() });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The place in the flight at which a share of its turns is over.
    fn turn(flight: &[Event], share: f64) -> usize {
        (flight.iter().filter(|event| matches!(event, Event::Turn(_))).count() as f64 * share) as usize
    }

    /// The last turn after which the motors were on.
    fn last_on(flight: &[Event], edits: &[Edit]) -> usize {
        let mut last = 0;
        let violations = play(flight, edits, |turn, on| {
            if on {
                last = turn
            }
        });
        assert!(violations.is_empty(), "{violations:?}");
        last
    }

    #[test]
    fn what_is_played_flies_and_lands() {
        for flight in flights() {
            let last = last_on(flight, &[]);
            assert!((turn(flight, 0.6)..turn(flight, 0.99)).contains(&last), "{last}");
        }
    }

    #[test]
    fn an_edit_reaches_the_vehicle() {
        let flight = &flights()[0];
        let from = turn(flight, 0.6);
        let silent = Edit { topic: Id::sensor_imu as usize, turns: [from, usize::MAX], change: Change::Silent };
        let last = last_on(flight, &[silent]);
        assert!((from..turn(flight, 0.65)).contains(&last), "{from} to {last}");
    }
}
