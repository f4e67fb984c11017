//! Is the estimator as good as it says? Its errors and innovations over simulated flights, against its own covariance.
//!
//! A consistent filter's normalised estimation error squared (NEES), eᵀ·P⁻¹·e, and normalised innovation squared (NIS),
//! yᵀ·S⁻¹·y, are χ²-distributed with as many degrees of freedom as the vectors have axes (Bar-Shalom, Li and Kirubarajan,
//! "Estimation with Applications to Tracking and Navigation", 2001, section 5.4). Larger means overconfident, smaller
//! means that information is given away.
//!
//! | | what |
//! |---|---|
//! | error | truth less estimate at the stamp of an inertial sample, every 100 ms while flying |
//! | observable | height, velocity, tilt, both biases: what range and flow show |
//! | dead-reckoned | horizontal position and heading: nobody measures them, their errors only grow, so they are measured against their own growing covariance and are in no bar |
//! | band | 95 % of single samples of a χ² variable of so many degrees of freedom, 2.5 % on either side |
//! | mean | over the samples of a flight, then over flights |
//! | inside, above | share of flights whose sample at one random instant lies in the band, or above it |
//!
//! Not for recordings: they have no truth of biases.

pub mod chi_square;
mod flight;
mod shadow;

pub use flight::{FlightConsistency, Observation, Squares};
pub use shadow::{Sensor, Shadow};

use serde::Serialize;

/// Parts of the state that are looked at, as indices of the error state with the attitude in world axes.
pub const BLOCKS: [(&str, &[usize]); 8] = [
    ("observable state", &[2, 3, 4, 5, 6, 7, 9, 10, 11, 12, 13, 14]),
    ("height", &[2]),
    ("velocity", &[3, 4, 5]),
    ("tilt", &[6, 7]),
    ("gyro bias", &[9, 10, 11]),
    ("accelerometer bias", &[12, 13, 14]),
    ("position, dead-reckoned", &[0, 1]),
    ("heading, dead-reckoned", &[8]),
];

/// How many of [`BLOCKS`], from the first, must be inside their bands.
const JUDGED: usize = 6;

/// Sensors whose innovations are looked at, and their axes.
pub const SENSORS: [(&str, usize); 3] = [("range", 1), ("flow", 2), ("barometer", 1)];

/// Share of the flights whose sample at a random instant must lie in the band. Of a perfect filter 95 % do. This one takes
/// vibration as alike along all axes and a gyro's error of scale for a bias, so quiet flights lie below the band.
pub const INSIDE: f64 = 0.8;
/// Share of the flights whose error at a random instant may lie above the band. Of a perfect filter 2.5 % do.
pub const ABOVE: f64 = 0.05;

/// One row of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Line {
    /// What.
    pub name: &'static str,
    /// Degrees of freedom.
    pub freedom: usize,
    /// Mean over the flights of the means over a flight.
    pub mean: f64,
    /// 95 % of single samples lie between these.
    pub band: [f64; 2],
    /// Share of the flights whose sample at a random instant lies in the band.
    pub inside: f64,
    /// Share of the flights whose sample at a random instant lies above it: overconfidence.
    pub above: f64,
    /// Share that may lie there.
    pub allowed: f64,
    /// Does it have to be inside?
    pub judged: bool,
}

impl Line {
    /// Is the mean in the band, and are enough of the single samples?
    #[must_use]
    pub fn is_good(&self) -> bool {
        let [low, high] = self.band;
        !self.judged || low <= self.mean && self.mean <= high && self.inside >= INSIDE && self.above <= self.allowed
    }
}

/// Many flights together.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Errors, then innovations.
    pub errors: Vec<Line>,
    /// Innovations.
    pub innovations: Vec<Line>,
    /// Resets after a lock-out, all flights together.
    pub resets: u32,
    /// Lock-outs that neither ended nor were reported, and errors beyond use that were called valid.
    pub unresolved: u32,
    /// Flights whose estimator said it was lost.
    pub diverged: usize,
    /// Flights in which the second estimator did not repeat the first bit for bit.
    pub different: usize,
}

impl Summary {
    /// Summarises flights.
    #[must_use]
    pub fn of(flights: &[FlightConsistency]) -> Self {
        let line = |name, freedom, judged, allowed, squares: Vec<Squares>| {
            let (count, band) = (squares.len().max(1) as f64, chi_square::band(freedom));
            let inside = squares.iter().filter(|s| (band[0]..=band[1]).contains(&s.once)).count();
            let mean = squares.iter().map(|s| s.mean).sum::<f64>() / count;
            let above = squares.iter().filter(|s| s.once > band[1]).count();
            Line {
                name,
                freedom,
                mean,
                band,
                inside: inside as f64 / count,
                above: above as f64 / count,
                allowed,
                judged,
            }
        };
        let errors = BLOCKS.iter().enumerate().map(|(block, (name, states))| {
            let squares = flights.iter().filter_map(|flight| flight.errors[block]).collect();
            line(*name, states.len(), block < JUDGED, ABOVE, squares)
        });
        let innovations = SENSORS.iter().enumerate().map(|(sensor, (name, axes))| {
            let squares = flights.iter().filter_map(|flight| flight.innovations[sensor]).collect();
            // A picture more or less in a flow reading makes tails: beyond the band, within the gate.
            line(*name, *axes, true, 1.0 - INSIDE, squares)
        });
        Self {
            errors: errors.collect(),
            innovations: innovations.collect(),
            resets: flights.iter().map(|flight| flight.resets).sum(),
            unresolved: flights.iter().map(|flight| flight.unresolved).sum(),
            diverged: flights.iter().filter(|flight| flight.diverged).count(),
            different: flights.iter().filter(|flight| !flight.identical).count(),
        }
    }

    /// Is every bar met?
    #[must_use]
    pub fn is_good(&self) -> bool {
        let lines = self.errors.iter().chain(&self.innovations);
        lines.into_iter().all(Line::is_good) && self.unresolved == 0 && self.different == 0
    }
}
