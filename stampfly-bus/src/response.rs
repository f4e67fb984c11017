//! Response times: how long after its trigger a runnable has published at the latest, computed while compiling.
//!
//! The model is the cooperative executor that flies: one pass through the flight band is never interrupted, and while it
//! has nothing to do one background activation runs at a time, the first that is due in table order. So an activation
//! waits for the longest background activation that may just have begun, and for what comes before it in the table, as
//! often as that can be due meanwhile. That is response-time analysis with fixed priorities: Joseph and Pandya, "Finding
//! Response Times in a Real-Time System", The Computer Journal 29(5), 1986; for what cannot be interrupted, Davis, Burns,
//! Bril and Lukkien, "Controller Area Network (CAN) schedulability analysis", Real-Time Systems 35(3), 2007, in its
//! sufficient form, where an activation may also find the one before it still at work. Waiting is counted until the end of
//! an activation, not until its start, so the bounds hold as well where the flight band interrupts the background.
//!
//! | counted | as |
//! |---|---|
//! | a topic `@ N Hz` | samples with that period, each up to a [tenth](JITTER) of it late |
//! | `every` | its period |
//! | `or at latest` | one more source of activations, beside the trigger, for it and all that follow |
//! | an activation | its budget |
//! | its deadline | the shortest time between two of its triggers |
//!
//! Not counted: interrupts, and drivers that share the executor. What is left between response and deadline is theirs.

use crate::line::{ActivationInfo, Band, MAX_TRIGGERS, Trigger};
use crate::table::TopicInfo;
use stampfly_types::Duration;

/// A sample may be late by this part of its topic's period: one over this number.
pub const JITTER: u64 = 10;

/// Why an activation has no bounded response time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Unbounded {
    /// It is activated by a topic without a rate.
    NoRate,
    /// It may not have finished when it is due again.
    TooLate,
}

/// What may activate one line of the table: sources with a period, each late by up to its jitter, µs.
#[derive(Clone, Copy)]
struct Arrivals {
    sources: [(u64, u64); MAX_TRIGGERS + 1],
    count: usize,
    /// Shortest time between two triggers of one source, deadlines of silence left out.
    deadline: u64,
}

impl Arrivals {
    const fn add(mut self, period: u64, jitter: u64) -> Self {
        self.sources[self.count] = (period, jitter);
        self.count += 1;
        self
    }

    const fn trigger(mut self, period: u64, jitter: u64) -> Self {
        if period - jitter < self.deadline {
            self.deadline = period - jitter;
        }
        self.add(period, jitter)
    }

    /// Of the line `index`, or of the line that activates it.
    const fn of(table: &[ActivationInfo], topics: &[TopicInfo], index: usize) -> Result<Self, Unbounded> {
        let mut arrivals = Self { sources: [(1, 0); MAX_TRIGGERS + 1], count: 0, deadline: u64::MAX };
        let (mut line, mut silence) = (index, u64::MAX);
        loop {
            if let Some(late) = table[line].at_latest
                && late.as_micros() < silence
            {
                silence = late.as_micros();
            }
            match table[line].trigger {
                Trigger::After(before) if before < line => line = before,
                // The table refuses it in words of its own.
                Trigger::After(_) => break,
                Trigger::Every(period) => {
                    arrivals = arrivals.trigger(period.as_micros(), 0);
                    break;
                }
                Trigger::On(on) => {
                    let mut topic = 0;
                    while topic < on.len() {
                        let Some(period) = topics[on[topic]].period else { return Err(Unbounded::NoRate) };
                        let period = period.as_micros();
                        arrivals = arrivals.trigger(period, period / JITTER);
                        topic += 1;
                    }
                    break;
                }
            }
        }
        Ok(if silence < u64::MAX { arrivals.add(silence, 0) } else { arrivals })
    }

    /// How often it can be activated within a closed stretch of time.
    const fn within(&self, time: u64) -> u64 {
        let (mut source, mut times) = (0, 0);
        while source < self.count {
            let (period, jitter) = self.sources[source];
            times += (time + jitter) / period + 1;
            source += 1;
        }
        times
    }
}

const fn is_flight(info: &ActivationInfo) -> bool {
    matches!(info.band, Band::Flight)
}

/// The longest budget of the background from the line `first` on, µs.
const fn longest_background(table: &[ActivationInfo], first: usize) -> u64 {
    let (mut line, mut longest) = (first, 0);
    while line < table.len() {
        if !is_flight(&table[line]) && table[line].budget.as_micros() > longest {
            longest = table[line].budget.as_micros();
        }
        line += 1;
    }
    longest
}

/// The line whose trigger starts the chain of `after`s that this one belongs to.
const fn first_of_chain(table: &[ActivationInfo], mut line: usize) -> usize {
    while let Trigger::After(before) = table[line].trigger
        && before < line
    {
        line = before;
    }
    line
}

/// What one pass through the whole flight band takes, µs.
const fn longest_pass(table: &[ActivationInfo]) -> u64 {
    let (mut line, mut sum) = (0, 0);
    while line < table.len() {
        if is_flight(&table[line]) {
            sum += table[line].budget.as_micros();
        }
        line += 1;
    }
    sum
}

/// How long after its trigger one line of the table has published at the latest.
///
/// # Errors
/// When nothing can be promised: see [`Unbounded`].
pub const fn response_time(
    table: &[ActivationInfo],
    topics: &[TopicInfo],
    index: usize,
) -> Result<Duration, Unbounded> {
    let own = match Arrivals::of(table, topics, index) {
        Ok(own) => own,
        Err(error) => return Err(error),
    };
    let flies = is_flight(&table[index]);
    let chain = first_of_chain(table, index);
    // In the background the activation before it counts as well: it may have kept waiting what now comes first.
    let begun = longest_background(table, if flies { 0 } else { index });
    let mut response = 0;
    loop {
        let mut next = begun + if flies { 0 } else { table[index].budget.as_micros() };
        let mut line = 0;
        while line < table.len() {
            if is_flight(&table[line]) || !flies && line < index {
                let arrivals = match Arrivals::of(table, topics, line) {
                    Ok(arrivals) => arrivals,
                    Err(error) => return Err(error),
                };
                let times = if !flies {
                    arrivals.within(response)
                } else if first_of_chain(table, line) == chain {
                    // Of its own pass it does not wait for what comes after it.
                    arrivals.within(response) - if line > index { 1 } else { 0 }
                } else {
                    // What another trigger starts may have waited for the pass before.
                    arrivals.within(response + longest_pass(table))
                };
                next += times * table[line].budget.as_micros();
            }
            line += 1;
        }
        if next > own.deadline {
            return Err(Unbounded::TooLate);
        }
        if next == response {
            return Ok(Duration::from_micros(response));
        }
        response = next;
    }
}
