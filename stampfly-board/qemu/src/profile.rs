//! Counts instructions: of every runnable, and of the flight band from an inertial sample to the motors.
//!
//! A runnable's are those of its whole activation: finding out that it is due, reading its inputs, computing,
//! publishing. What is written into the flight record meanwhile is counted apart.

use crate::machine::{self, Ticks};
use crate::marks;
use crate::record::Record;
use core::fmt::Display;
use stampfly_board::schedule::{COUNT, Id};
use stampfly_board::topics;
use stampfly_bus::{Activation, Band};
use stampfly_flight::Observer;
use stampfly_flight::golden::PlayObserver;
use stampfly_flight::newest::message;
use stampfly_types::Instant;
use stampfly_types::messages::FlightStatus;

/// Inputs of the estimation that are sensors of the vehicle: inertial, range, flow, field, pressure.
const SENSORS: usize = 5;

/// How much something took, over a flight.
#[derive(Clone, Copy, Default)]
pub struct Tally {
    /// Ticks and number while the motors could turn: on the ground there is less to do.
    sum: u64,
    count: u64,
    /// The most, whenever it was.
    most: u64,
}

impl Tally {
    fn add(&mut self, ticks: u64, armed: bool) {
        self.most = self.most.max(ticks);
        if armed {
            self.sum += ticks;
            self.count += 1;
        }
    }

    /// One line.
    pub fn print(&self, name: impl Display) {
        let mean = machine::instructions(self.sum) / self.count.max(1);
        outln!("{name}: mean {mean} most {} count {}", machine::instructions(self.most), self.count);
    }
}

/// Watches a golden flight.
pub struct Profile<'t> {
    /// By place in the schedule.
    pub runnables: [Tally; COUNT],
    /// The flight band, from one sample to the duties that follow from it.
    pub chain: Tally,
    /// The same where every sensor of the vehicle had something new.
    pub everything: Tally,
    /// Writing the flight record, per turn of the executor.
    pub recording: Tally,
    /// The flight record.
    pub record: Record<'t>,
    armed: bool,
    all_new: bool,
    /// The reading since which ticks belong to the present runnable.
    since: Ticks,
    runnable: u64,
    pass: u64,
    /// Did anything run in this pass?
    ran: bool,
    recorded: u64,
    /// What looking at the counter takes by itself.
    looking: u64,
    /// What watching an activation takes by itself: two calls and two looks.
    watching: u64,
}

impl<'t> Profile<'t> {
    /// Nothing counted yet.
    pub fn new(record: Record<'t>) -> Self {
        let look = |_| machine::ticks().until(machine::ticks());
        let mut profile = Self {
            runnables: [Tally::default(); COUNT],
            chain: Tally::default(),
            everything: Tally::default(),
            recording: Tally::default(),
            record,
            armed: false,
            all_new: false,
            since: machine::ticks(),
            runnable: 0,
            pass: 0,
            ran: false,
            recorded: 0,
            looking: (0..16).map(look).min().unwrap_or(0),
            watching: 0,
        };
        // An activation of nobody in which nothing happens.
        let nothing = Activation::live(COUNT as u8, Instant::ZERO);
        let watch = |_| {
            profile.band_starts(Band::Background, Instant::ZERO);
            profile.has_read(&nothing);
            profile.finished(&nothing);
            profile.pass
        };
        profile.watching = (0..16).map(watch).min().unwrap_or(0);
        profile.recorded = 0;
        profile
    }

    /// Ticks since `since`.
    #[inline(always)]
    fn elapsed(&self) -> u64 {
        self.since.until(machine::ticks())
    }

    /// Writes into the flight record and counts that apart.
    fn write(&mut self, what: impl FnOnce(&mut Record<'t>)) {
        let before = machine::ticks();
        marks::aside_begins();
        what(&mut self.record);
        marks::aside_ends();
        self.recorded += before.until(machine::ticks()).saturating_sub(self.looking);
    }
}

// Never inlined, so that watching always takes the same.
impl Observer for Profile<'_> {
    #[inline(never)]
    fn has_read(&mut self, activation: &Activation) {
        self.runnable += self.elapsed();
        if usize::from(activation.record().index) == Id::estimation as usize {
            let sensors = activation.record().inputs().get(..SENSORS).unwrap_or_default();
            self.all_new = sensors.len() == SENSORS && sensors.iter().all(|input| input.taken > 0);
        }
        self.write(|record| record.has_read(activation));
        self.since = machine::ticks();
    }

    #[inline(never)]
    fn finished(&mut self, activation: &Activation) {
        self.runnable = (self.runnable + self.elapsed()).saturating_sub(self.watching);
        let armed = self.armed;
        if let Some(tally) = self.runnables.get_mut(usize::from(activation.record().index)) {
            tally.add(self.runnable, armed);
        }
        self.pass += self.runnable;
        self.ran = true;
        self.runnable = 0;
        self.write(|record| {
            for _ in 0..=activation.record().index {
                marks::counts();
            }
            record.finished(activation);
        });
        self.since = machine::ticks();
    }
}

impl PlayObserver for Profile<'_> {
    fn band_starts(&mut self, band: Band, _: Instant) {
        if band == Band::Flight {
            self.recording.add(self.recorded, self.armed);
            self.recorded = 0;
        }
        (self.pass, self.ran, self.all_new) = (0, false, false);
        if band == Band::Flight {
            marks::pass_begins();
        }
        self.since = machine::ticks();
    }

    fn band_finished(&mut self, band: Band) {
        // Finding out that nothing more is due is part of it.
        let looked = self.elapsed().saturating_sub(self.looking);
        if band == Band::Flight && self.ran {
            if self.armed {
                marks::pass_ends_armed()
            } else {
                marks::pass_ends_on_ground()
            }
            self.chain.add(self.pass + looked, self.armed);
            if self.all_new {
                self.everything.add(self.pass + looked, self.armed);
            }
        }
    }

    fn published(&mut self, topic: usize, at: Instant, generation: u32, words: &[u32]) {
        if topic == topics::Id::flight_status as usize
            && let Some(mode) = message::<FlightStatus>(words)
        {
            self.armed = mode.armed;
        }
        self.write(|record| record.sample(topic, at, generation, words));
    }
}
