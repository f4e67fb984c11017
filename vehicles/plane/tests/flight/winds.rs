//! Whole flights, many of them. With `--nocapture` it prints each, and the worst of all. `FLIGHTS` and `MISSION` fly others.

use crate::recorded::Flown;
use stampfly_fixed_wing::messages::Place;
use stampfly_plane::simulation::{Outcome, Plane};
use stampfly_sim::vehicle::{Options, Vehicle, Verdict};
use std::thread;

fn fly(options: &Options, seed: u64) -> Outcome {
    let setup = Plane::setup(options, seed).expect("options");
    Plane::fly(&setup, &mut (), &mut |_, _| {}).outcome
}

/// Wind of 0 to 5 m/s from anywhere: another one for each seed.
fn windy(seed: u64, mission: &str) -> Options {
    let speed = 5.0 * ((seed * 37) % 100) as f32 / 99.0;
    let direction = seed as f32 * 2.399_963;
    let (sin, cos) = stampfly_types::math::sin_cos(direction);
    let wind = Some([speed * cos, speed * sin]);
    Options { wind, mission: Some(mission.into()), ..Options::default() }
}

/// What the bars are about, over all flights.
#[derive(Clone, Copy, Debug)]
struct Worst {
    landings: usize,
    past: [f32; 2],
    across: f32,
    sink: f32,
    beside: f64,
}

impl Worst {
    const NONE: Self = Self { landings: 0, past: [f32::MAX, f32::MIN], across: 0.0, sink: 0.0, beside: 0.0 };

    fn of(outcome: &Outcome) -> Self {
        let start = Self { beside: outcome.measured.beside.value().unwrap_or(f64::INFINITY), ..Self::NONE };
        outcome.measured.touchdowns.all().iter().fold(start, |worst, touch| Self {
            landings: worst.landings + 1,
            past: [worst.past[0].min(touch.past), worst.past[1].max(touch.past)],
            across: worst.across.max(touch.across.abs()),
            sink: worst.sink.max(touch.sink),
            ..worst
        })
    }

    fn and(self, other: Self) -> Self {
        Self {
            landings: self.landings + other.landings,
            past: [self.past[0].min(other.past[0]), self.past[1].max(other.past[1])],
            across: self.across.max(other.across),
            sink: self.sink.max(other.sink),
            beside: self.beside.max(other.beside),
        }
    }

    fn is_within(&self, landings: usize) -> bool {
        let [least, most] = self.past;
        let on_strip = least >= 0.0 && most <= 60.0 && self.across <= 5.0;
        self.landings == landings && on_strip && self.sink <= 1.5 && self.beside <= 3.0
    }
}

#[test]
fn it_flies_round_and_lands_in_any_wind() {
    let flights: u64 = std::env::var("FLIGHTS").ok().and_then(|number| number.parse().ok()).unwrap_or(6);
    let mission = std::env::var("MISSION").unwrap_or_else(|_| "twice".into());
    let landings = if mission == "twice" { 2 } else { 1 };
    let half = |first: u64| {
        let (mut worst, mut failed) = (Worst::NONE, Vec::new());
        for seed in (first..=flights).step_by(2) {
            let options = windy(seed, &mission);
            let outcome = fly(&options, seed);
            let here = Worst::of(&outcome);
            let wind = options.wind.unwrap_or_default();
            let told = format!("seed {seed} wind {wind:.1?}: {}, {here:.2?}", outcome.sentence());
            println!("{told}");
            worst = worst.and(here);
            if !(outcome.succeeded() && here.is_within(landings)) {
                failed.push(told);
            }
        }
        (worst, failed)
    };
    let [(one, mut failed), (other, more)] = thread::scope(|scope| {
        let halves = [1, 2].map(|first| scope.spawn(move || half(first)));
        halves.map(|half| half.join().expect("no panic"))
    });
    failed.extend(more);
    println!("{} of {flights} flights, worst of all {:.2?}", flights - failed.len() as u64, one.and(other));
    assert!(failed.is_empty(), "{} of {flights}:\n{}", failed.len(), failed.join("\n"));
}

#[test]
fn the_second_landing_goes_through_the_stages_of_the_first() {
    let options = windy(3, "twice");
    let places = Flown::with(&options, 3).places();
    let take_offs = places.iter().enumerate().filter(|(_, place)| **place == Place::TakeOffRoll);
    let starts: Vec<usize> = take_offs.map(|(index, _)| index).collect();
    let [first, second] = starts[..] else { panic!("two flights: {places:?}") };
    let end =
        |from: usize| places[from..].iter().position(|place| *place == Place::TaxiingPark).map(|length| from + length);
    let [one, two] = [first, second].map(|start| &places[start..=end(start).expect("it parks")]);
    let wanted = [
        Place::TakeOffRoll,
        Place::TakeOffClimb,
        Place::CruisingCruise,
        Place::LandingTransition,
        Place::LandingSlope,
        Place::LandingFlare,
        Place::LandingDecrab,
        Place::LandingTouchdown,
        Place::TaxiingStop,
        Place::TaxiingTurnOff,
        Place::TaxiingPark,
    ];
    assert_eq!(one, wanted);
    assert_eq!(two, wanted);
}
