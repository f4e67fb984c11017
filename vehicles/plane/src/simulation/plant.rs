//! The aircraft as a body, the field where it flies, and the parameters that belong to both.

use crate::Parameters;
use stampfly_sim::plant::AeroplaneParameters;
use stampfly_sim::sensors::GnssConfig;
use stampfly_sim::{Simulation, SimulationConfig};
use stampfly_types::Origin;

/// What flies.
pub const PLANT: AeroplaneParameters = AeroplaneParameters::ULTRA_STICK_25E;

/// The middle of the strip.
pub const FIELD: Origin = Origin { latitude: 365_600_000, longitude: 1_367_000_000, altitude: 30_000 };
/// Direction of the strip, rad. People put the aircraft against the wind, so this way round or the other.
pub const STRIP: f64 = 0.6;

/// The receiver, under an open sky without houses: its error wanders less than in a town. An assumption, as every such number is.
pub const RECEIVER: GnssConfig =
    GnssConfig { rate: 5.0, wander: [0.7, 1.2], correlation: 300.0, ..GnssConfig::m8(FIELD) };

/// What a calibration of the compass leaves of the hard iron: a twentieth.
const LEFT: f32 = 0.05;

/// The parameters of a new aircraft.
#[must_use]
pub fn parameters() -> Parameters {
    Parameters::default()
}

/// Calibrates the compass of this specimen, as somebody has done who flies it.
pub fn calibrate(parameters: &mut Parameters, simulation: &SimulationConfig<AeroplaneParameters>) {
    let iron = Simulation::new(simulation).world.specimen().hard_iron.map(|axis| (1.0 - LEFT) * axis as f32);
    let compass = &mut parameters.compass;
    [compass.x, compass.y, compass.z] = iron.into();
}
