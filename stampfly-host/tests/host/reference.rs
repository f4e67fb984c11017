//! How well the stack must fly, as bars over twenty seeds, in the small size over five. A seed is a specimen: its own motors, sensor errors, gusts.
//!
//! The bars are promises to whoever reads the figures in the documentation, not the best that was ever seen. A change
//! that breaks one has made the vehicle fly worse; see `stampfly fly --seed N` for the flight it names.

use crate::flown::reference;
use crate::thorough::thorough;
use stampfly_board::simulation::metrics::FIGURES;
use stampfly_board::simulation::mission::{HOVER, Mission};
use stampfly_board::simulation::{Outcome, Setup, StampFly};
use stampfly_host::campaign::{self, run};
use stampfly_sim::vehicle::Verdict;

/// Mission, figure, statistic, bar.
const BARS: [(&str, &str, &str, f64); 7] = include!("../../bars.rs");
/// A flight that was not watched.
type Flight = campaign::Flight<StampFly, ()>;

fn seeds() -> std::ops::RangeInclusive<u64> {
    1..=thorough(5, 20)
}

fn campaign(change: impl Fn(&mut Setup)) -> Vec<Flight> {
    campaign_of(seeds(), change)
}

fn campaign_of(seeds: impl IntoIterator<Item = u64>, change: impl Fn(&mut Setup)) -> Vec<Flight> {
    let setups: Vec<(u64, Setup)> = seeds
        .into_iter()
        .map(|seed| {
            let mut setup = Setup::reference(seed);
            change(&mut setup);
            (seed, setup)
        })
        .collect();
    let flights = run(&setups, &|_, _| (), &|_| {});
    assert_eq!(flights.len(), setups.len());
    flights
}

fn outcomes(flights: &[Flight]) -> impl Iterator<Item = (u64, &Outcome)> {
    flights.iter().map(|flight| (flight.seed, &flight.flown.outcome))
}

/// Figures of a mission and their bars. With so few seeds every flight has to keep them, whatever the statistic.
fn bars(mission: &str) -> Vec<(&'static str, f64)> {
    BARS.iter().filter(|(of, ..)| *of == mission).map(|(_, figure, _, bar)| (*figure, *bar)).collect()
}

/// Every flight lands, and none of these figures is missing or above its bar in any of them.
fn expect<'f>(flights: impl IntoIterator<Item = (u64, &'f Outcome)>, bars: &[(&str, f64)]) {
    let mut broken = Vec::new();
    for (seed, outcome) in flights {
        if !outcome.succeeded() {
            broken.push(format!("seed {seed}: did not land, disarm and finish: {:?}", outcome.phases));
        }
        for (name, bar) in bars {
            let (.., figure) = FIGURES.iter().find(|(figure, ..)| figure == name).expect("a figure of that name");
            match figure(&outcome.metrics) {
                Some(value) if value <= *bar => {}
                other => broken.push(format!("seed {seed}: {name} is {other:?}, the bar is {bar}")),
            }
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn the_square_is_flown_within_the_bars() {
    let flights = reference(thorough(5, 20)).into_iter().map(|flight| (flight.seed, &flight.flown.outcome));
    expect(flights, &[bars("square"), vec![("land_error_m", 0.3)]].concat());
}

#[test]
fn a_minute_of_hovering_stays_in_place() {
    let mission = Mission::parse(HOVER).expect("a mission");
    let flights = campaign(|setup| setup.mission = mission.clone());
    expect(outcomes(&flights), &[bars("hover"), vec![("alt_rms_m", 0.03)]].concat());
    for flight in &flights {
        assert!(flight.flown.duration.seconds_f64() > 60.0, "it did hover for a minute");
    }
}

/// A badly bent propeller: nobody asks for grace, but the vehicle must come down and know that it has.
#[test]
fn four_times_the_vibration_still_lands() {
    // In the last three the filter loses the range for a moment, which is no fault of the range's.
    let flights = campaign_of(seeds().chain([30, 67, 141]), |setup| setup.simulation.vibration = 4.0);
    expect(outcomes(&flights), &[("touchdown_speed_mps", 1.0), ("land_error_m", 1.0), ("alt_rms_m", 0.15)]);
    for flight in &flights {
        assert!(
            flight.flown.outcome.worst_tilt_deg < 35.0,
            "seed {}: {}°",
            flight.seed,
            flight.flown.outcome.worst_tilt_deg
        );
    }
}

/// The figures can tell a bad flight from a good one; if they could not, the bars above would prove nothing.
#[test]
fn six_times_the_gusts_break_the_bars() {
    let flights = campaign(|setup| setup.simulation.wind.gust = 3.0);
    for flight in &flights {
        let metrics = &flight.flown.outcome.metrics;
        assert!(metrics.hover_tilt_max_deg.is_some_and(|tilt| tilt > 6.0), "seed {}: {metrics:?}", flight.seed);
    }
    let bars = bars("square");
    let (_, bar) = bars.iter().find(|(figure, _)| *figure == "pos_rms_m").expect("a bar");
    let off_path = |flight: &&Flight| flight.flown.outcome.metrics.pos_rms_m.is_some_and(|value| value > *bar);
    // Three of four.
    assert!(4 * flights.iter().filter(off_path).count() >= 3 * flights.len());
}
