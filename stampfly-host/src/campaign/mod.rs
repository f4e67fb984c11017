//! A campaign: many missions in parallel, each with its own seed, and what they say together.
//!
//! [`run`] flies the same mission many times. A *fault campaign* flies through what can go wrong:
//!
//! | module | what it is |
//! |---|---|
//! | [`case`] | which flight is number N |
//! | [`flight`], [`row`] | flies one; a flight as a row of a table |
//! | [`shard`], [`mod@file`] | the part of a campaign that one task flies, and its Parquet file |
//! | [`rate`] | how often, and how well that is known |
//! | [`summary`], [`page`] | faults × moments, failures; as CSV and HTML |
//! | [`shrink`] | the smallest flight in which the same goes wrong |
//! | [`sticks`] | every stick file in every mode that makes sense |
//! | [`envelope`] | sound vehicles through everything that may be flown and met |
//! | [`parallel`] | work on every core |

pub mod case;
pub mod envelope;
pub mod file;
pub mod flight;
pub mod page;
pub mod parallel;
pub mod rate;
pub mod row;
pub mod shard;
pub mod shrink;
pub mod sticks;
pub mod summary;

use crate::flown::{Flown, fly};
use serde::Serialize;
use stampfly_sim::vehicle::{Vehicle, Verdict, Witness};

/// Median, 95th percentile and worst of a figure over the flights that have it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Half of the flights are at or below.
    pub p50: f64,
    /// 95 % of the flights are at or below.
    pub p95: f64,
    /// The worst.
    pub max: f64,
}

impl Spread {
    /// Nearest-rank percentiles; `None` without values.
    ///
    /// ```
    /// use stampfly_host::campaign::Spread;
    /// let spread = Spread::of((1..=100).map(f64::from).collect()).expect("values");
    /// assert_eq!((spread.p50, spread.p95, spread.max), (50.0, 95.0, 100.0));
    /// ```
    #[must_use]
    pub fn of(mut values: Vec<f64>) -> Option<Self> {
        values.sort_by(f64::total_cmp);
        let rank = |share: f64| {
            let index = (share * values.len() as f64).ceil() as usize;
            values.get(index.saturating_sub(1)).copied()
        };
        Some(Self { p50: rank(0.5)?, p95: rank(0.95)?, max: rank(1.0)? })
    }
}

/// One flight of a campaign.
pub struct Flight<V: Vehicle, W> {
    /// Its seed.
    pub seed: u64,
    /// How it went.
    pub flown: Flown<V::Outcome>,
    /// What its witness has seen.
    pub witness: W,
}

impl<V: Vehicle, W> Flight<V, W> {
    /// Did the vehicle do what it was to do?
    #[must_use]
    pub fn succeeded(&self) -> bool {
        self.flown.outcome.succeeded()
    }
}

/// Flies these setups, each with its seed, on as many threads as there are cores. Flights come back in the order of the
/// setups. Each has a witness of its own; `done` is called after each.
pub fn run<V: Vehicle, W: Witness<V::Runnables> + Send>(
    setups: &[(u64, V::Setup)],
    witness: &(dyn Fn(u64, &V::Setup) -> W + Sync),
    done: &(dyn Fn(&Flight<V, W>) + Sync),
) -> Vec<Flight<V, W>> {
    parallel::each(setups.len(), parallel::workers(setups.len(), None), &|place| {
        let (seed, setup) = setups.get(place)?;
        let mut witness = witness(*seed, setup);
        let flown = fly::<V>(setup, &mut witness, &mut |_, _| {});
        let flight = Flight { seed: *seed, flown, witness };
        done(&flight);
        Some(flight)
    })
    .into_iter()
    .flatten()
    .collect()
}

/// Figures over all flights: name, unit, spread.
#[must_use]
pub fn spreads<V: Vehicle, W>(flights: &[Flight<V, W>]) -> Vec<(&'static str, &'static str, Option<Spread>)> {
    let figures: Vec<_> = flights.iter().map(|flight| flight.flown.outcome.figures()).collect();
    let Some(first) = figures.first() else { return Vec::new() };
    let spread = |place: usize| Spread::of(figures.iter().filter_map(|figures| figures.get(place)?.value).collect());
    first.iter().enumerate().map(|(place, figure)| (figure.name, figure.unit, spread(place))).collect()
}
