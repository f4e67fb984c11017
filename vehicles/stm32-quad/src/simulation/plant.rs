//! The simulated frame: a quadcopter of 220 mm and 380 g with two cells, 2300 kV motors and propellers of 5 × 3 inches.
//!
//! The document's own vehicle is on a page that it does not print. Its gains say what kind it is: with a share of 0.2 for an error of 1 rad/s they fly a frame that
//! answers a whole share with 600 rad/s² and a motor's lag of 35 ms. One of 50 g, which answers five times as fast, they shake to pieces.

use crate::airframe::AIRFRAME;
use crate::parameters::{BatteryParameters, Parameters};
use stampfly_sim::plant::PlantParameters;

/// The frame on Earth, with the usual differences between one motor and the next.
pub const PLANT: PlantParameters = PlantParameters {
    mass: 0.38,
    // Four motors of 30 g with their arms at 78 mm from either axis, and 0.26 kg within 60 mm.
    inertia_x: 1.1e-3,
    inertia_y: 1.2e-3,
    inertia_z: 2.0e-3,
    gravity: 9.80665,
    rotor_offset: 0.078,
    // 5 inches.
    rotor_radius: 0.0635,
    // Thrust and power coefficients 0.10 and 0.041, air of 1.2 kg/m³: usual for a propeller of this pitch.
    thrust_coefficient: 7.9e-7,
    torque_coefficient: 6.6e-9,
    // 2300 revolutions a minute and volt, 0.15 Ω with the speed controller.
    motor_voltage_a: 2.4e-7,
    motor_voltage_b: 4.2e-3,
    motor_voltage_c: 0.05,
    motor_resistance: 0.15,
    // A propeller of 3 g; a lag of 35 ms at hover.
    rotor_inertia: 4.4e-6,
    manufacturing_spread: 1.0,
    centre_x: 0.0,
    centre_y: 0.0,
    drag_horizontal: 0.12,
    drag_vertical: 0.3,
    drag_quadratic: 0.01,
    drag_rotation: 1.0e-5,
    battery_cells: 2.0,
    battery_capacity: 0.85,
    battery_charge: 1.0,
    battery_resistance: 0.03,
    battery_polarisation: 0.02,
    battery_time_constant: 10.0,
    board_current: 0.1,
    ground_height: 0.04,
    foot_offset: 0.06,
    foot_stiffness: 1000.0,
    foot_damping: 3.0,
    foot_friction: 0.6,
    corner_offset: 0.09,
    corner_height: 0.02,
    // Five inches.
    propeller_radius: 0.0635,
    ground_effect_gain: 0.10,
    ground_effect_height: 0.13,
};

/// The throttle that carries it, as a share, with a full battery: what a pilot knows of it after the first flight.
pub const HOVER: f32 = AIRFRAME.hover;

/// The document's defaults, for two cells.
#[must_use]
pub fn parameters() -> Parameters {
    let defaults = Parameters::default();
    Parameters { battery: BatteryParameters { cells: 2.0, reference: 3.3, ..defaults.battery }, ..defaults }
}
