//! A campaign: many missions in parallel, each with its own seed, and what they say together.

use crate::consistency::FlightConsistency;
use crate::metrics::{FIGURES, Metrics};
use crate::recorder::Recorder;
use crate::simulate::{FlightConfig, Outcome, fly};
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

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
#[derive(Clone, Debug)]
pub struct Flight {
    /// Its seed.
    pub seed: u64,
    /// How it went.
    pub outcome: Outcome,
    /// How the estimate's errors compared with its covariance, if that was asked for.
    pub consistency: Option<FlightConsistency>,
}

impl Flight {
    /// Did it fly its mission, land and disarm, without ever sending nonsense to a motor?
    #[must_use]
    pub fn succeeded(&self) -> bool {
        let Metrics { landed, disarmed, .. } = self.outcome.metrics;
        landed && disarmed && self.outcome.finished && self.outcome.motors_sane
    }
}

/// Flies `configs` on as many threads as there are cores. Flights come back in the order of the configurations.
/// `done` is called after each.
pub fn run(configs: &[FlightConfig], done: &(dyn Fn(&Flight) + Sync)) -> Vec<Flight> {
    run_recorded(configs, &|_| Recorder::hash_only(), done)
}

/// On how many cores that many flights are flown at once: all there are.
#[must_use]
pub fn workers(flights: usize) -> usize {
    std::thread::available_parallelism().map_or(1, usize::from).min(flights.max(1))
}

/// The same with a recorder of one's own for each flight.
pub fn run_recorded(
    configs: &[FlightConfig],
    recorder: &(dyn Fn(&FlightConfig) -> Recorder + Sync),
    done: &(dyn Fn(&Flight) + Sync),
) -> Vec<Flight> {
    let next = AtomicUsize::new(0);
    let flights = Mutex::new(BTreeMap::new());
    let workers = workers(configs.len());
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                while let Some((index, config)) = {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    configs.get(index).map(|config| (index, config))
                } {
                    let mut recorder = recorder(config);
                    let outcome = fly(config, &mut recorder, &mut |_, _| {});
                    let (seed, consistency) = (config.simulation.seed, recorder.into_consistency());
                    let flight = Flight { seed, outcome, consistency };
                    done(&flight);
                    if let Ok(mut flights) = flights.lock() {
                        flights.insert(index, flight);
                    }
                }
            });
        }
    });
    flights.into_inner().unwrap_or_default().into_values().collect()
}

/// Figures over all flights, by name.
#[must_use]
pub fn spreads(flights: &[Flight]) -> Vec<(&'static str, &'static str, Option<Spread>)> {
    FIGURES
        .iter()
        .map(|(name, unit, figure)| {
            let values = flights.iter().filter_map(|flight| figure(&flight.outcome.metrics)).collect();
            (*name, *unit, Spread::of(values))
        })
        .collect()
}
