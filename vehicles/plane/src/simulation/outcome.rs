//! What is measured of a flight of the aircraft.

use super::plant::STRIP;
use stampfly_sim::touchdown::Touchdowns;
use stampfly_sim::vehicle::Figure;
use stampfly_sim::watched::{self, Watched};
use stampfly_sim::{Rms, Truth};
use std::prelude::v1::*;

/// How a flight went.
pub type Outcome = Watched<Measured>;

/// Half of the strip's width, m.
const STRIP_HALF: f32 = 8.0;
/// From the aiming point to where the aircraft stops, m.
const ROLLING: f32 = 10.0;

/// What is measured of a flight.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Beside its path between way-points, m.
    pub beside: Rms,
    /// Height against the demanded one there, m.
    pub height: Rms,
    /// Estimated heading and horizontal position against the truth, rad and m.
    pub heading: Rms,
    /// See `heading`.
    pub position: Rms,
    /// Every touchdown.
    pub touchdowns: Touchdowns,
}

impl Default for Measured {
    fn default() -> Self {
        let [beside, height, heading, position] = core::array::from_fn(|_| Rms::default());
        Self { beside, height, heading, position, touchdowns: Touchdowns::new(STRIP as f32, ROLLING) }
    }
}

impl watched::Measured for Measured {
    /// Outside of its fence, at which it turns: three of its turns.
    const AWAY: f64 = 200.0;

    fn is_degraded(&self) -> bool {
        let beside_strip = self.touchdowns.all().iter().any(|touch| touch.across.abs() > STRIP_HALF);
        beside_strip || self.beside.value().is_some_and(|rms| rms > 6.0)
    }

    /// A landing is fast over the ground; what breaks an aircraft is the sink.
    fn touch(truth: &Truth) -> f32 {
        truth.velocity.z.abs()
    }

    fn figures(&self) -> Vec<Figure> {
        let figure = |name, unit, value| Figure { name, unit, value };
        let mut figures = vec![
            figure("cross_track_rms_m", "m", self.beside.value()),
            figure("height_rms_m", "m", self.height.value()),
            figure("heading_error_rms_deg", "deg", self.heading.value().map(f64::to_degrees)),
            figure("position_error_rms_m", "m", self.position.value()),
        ];
        figures.extend(self.touchdowns.figures());
        figures
    }
}
