//! This aircraft's autopilot: its gains, and which servo moves what.

use crate::Parameters;
use stampfly_control::fixed_wing::{AutopilotConfig, EnergyConfig, Flown, TrackConfig, WingConfig};
use stampfly_control::surfaces::{Surface, deflections};
use stampfly_types::messages::{MotorOutput, ServoOutput};

/// The servos of the surfaces, in the order of their outputs; behind them is that of the brakes.
pub const SURFACES: [Surface; 4] = [Surface::AILERON_LEFT, Surface::AILERON_RIGHT, Surface::ELEVATOR, Surface::RUDDER];

/// The gains that these parameters have.
#[must_use]
pub fn config(p: &Parameters) -> AutopilotConfig {
    AutopilotConfig {
        track: TrackConfig {
            line_gain: p.path.line_gain,
            orbit_gain: p.path.orbit_gain,
            course_gain: p.path.course_gain,
            bank_max: p.path.bank_max,
        },
        energy: EnergyConfig {
            throttle_trim: p.energy.throttle_trim,
            throttle_feed: p.energy.throttle_feed,
            pitch_trim: p.energy.pitch_trim,
            height_gain: p.energy.height_gain,
            speed_gain: p.energy.speed_gain,
            climb_max: p.climb.rate_max,
            sink_max: p.climb.sink_max,
            speed_min: p.speed.stall * 1.15,
            ..EnergyConfig::default()
        },
        wing: WingConfig {
            airspeed: p.speed.cruise,
            roll_gain: p.roll.attitude,
            pitch_gain: p.pitch.attitude,
            feed: [p.roll.feed, 0.0, 0.0],
            gain: [p.roll.rate, p.pitch.rate, p.yaw.rate],
            integral: [p.roll.integral, p.pitch.integral, 0.0],
            side_force: p.yaw.side_force,
            heading_gain: p.yaw.heading,
            ..WingConfig::default()
        },
    }
}

/// What propeller and servos are told. Disarmed, the propeller stands.
#[must_use]
pub fn outputs(flown: &Flown, brake: bool, armed: bool) -> (MotorOutput, ServoOutput) {
    let mut motor = MotorOutput { count: 1, armed, ..MotorOutput::default() };
    let [first, ..] = &mut motor.duty;
    *first = if armed { flown.throttle } else { 0.0 };
    let mut servos = ServoOutput { count: SURFACES.len() as u8 + 1, ..ServoOutput::default() };
    let brakes = if brake { 1.0 } else { 0.0 };
    let deflected = deflections(&SURFACES, &flown.surfaces).into_iter().chain([brakes]);
    servos.deflection.iter_mut().zip(deflected).for_each(|(servo, deflection)| *servo = deflection);
    (motor, servos)
}
