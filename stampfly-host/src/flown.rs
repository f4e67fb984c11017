//! One simulated flight, with its figures.

use stampfly_sim::vehicle::{Ended, Vehicle, Witness};
use stampfly_types::Duration;
use std::time::Instant as WallInstant;

/// A flight that has been flown.
#[derive(Clone, Debug)]
pub struct Flown<O> {
    /// How it went.
    pub outcome: O,
    /// Simulated time.
    pub duration: Duration,
    /// Simulated time over wall time.
    pub realtime_factor: f64,
    /// Samples the log missed.
    pub log_lost: u32,
}

/// Flies once. `report` is called about ten times a simulated second with the share that is done and what goes on.
///
/// # Panics
/// Never by design; a panic here is a defect of the flight stack.
pub fn fly<V: Vehicle>(
    setup: &V::Setup,
    witness: &mut dyn Witness<V::Runnables>,
    report: &mut dyn FnMut(f32, &'static str),
) -> Flown<V::Outcome> {
    let begun = WallInstant::now();
    let Ended { outcome, duration, log_lost } = V::fly(setup, witness, report);
    let realtime_factor = duration.seconds_f64() / begun.elapsed().as_secs_f64();
    Flown { outcome, duration, realtime_factor, log_lost }
}
