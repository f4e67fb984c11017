//! What is measured of a flight of the quadcopter.

use stampfly_sim::Rms;
use stampfly_sim::vehicle::Figure;
use stampfly_sim::watched::{self, Watched};
use std::prelude::v1::*;

/// How a flight went.
pub type Outcome = Watched<Measured>;

/// What is measured of it.
#[derive(Clone, Debug, Default)]
pub struct Measured {
    /// Roll and pitch against what the sticks asked for while it stays at a place, rad.
    pub attitude: Rms,
    /// Roll and pitch of the estimate against the truth, rad.
    pub estimate: Rms,
    /// Distance from its place while it stays there, m.
    pub position: Rms,
    /// Packets in a second, while one was armed.
    pub packets: Option<f64>,
}

impl watched::Measured for Measured {
    /// A pilot who flies by sight in the wind that the tests have is within 2 m.
    const AWAY: f64 = 10.0;

    fn is_degraded(&self) -> bool {
        self.attitude.value().is_some_and(|rms| rms > 0.1)
    }

    fn figures(&self) -> Vec<Figure> {
        let degrees = |rms: &Rms| rms.value().map(f64::to_degrees);
        let figure = |name, unit, value| Figure { name, unit, value };
        vec![
            figure("attitude_rms_deg", "deg", degrees(&self.attitude)),
            figure("estimate_rms_deg", "deg", degrees(&self.estimate)),
            figure("position_rms_m", "m", self.position.value()),
            figure("packets_hz", "Hz", self.packets),
        ]
    }
}
