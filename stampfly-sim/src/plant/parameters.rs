//! What the vehicle and its surroundings are made of: one table, settable by name.
//!
//! A vehicle's crate writes down its own [`PlantParameters`], with the sources of its numbers. There is no default, since a
//! simulation of some other vehicle would look right and be wrong.

use super::battery::BatterySpec;
use super::table::parameters;
use crate::conditions::Conditions;
use crate::noise::{Noise, Stream};

parameters! {
    /// Airframe, motors, propellers, battery, ground and air of a quadrotor in X.
    ///
    /// ```
    /// use stampfly_sim::param::{Parameters, parameters};
    /// use stampfly_sim::plant::PlantParameters;
    ///
    /// let mut plant = PlantParameters::EXAMPLE;
    /// let index = parameters::set(&mut plant, "mass", 0.040)?;
    /// assert_eq!(plant.mass, 0.040);
    /// assert!(parameters::set(&mut plant, "mass", -1.0).is_err());
    /// assert!(parameters::set(&mut plant, "colour", 1.0).is_err());
    /// assert!(plant.describe(index).is_some_and(|info| info.name == "mass" && info.unit == "kg"));
    /// # Ok::<(), stampfly_sim::param::ParameterError<f64>>(())
    /// ```
    PlantParameters,
    /// A quadrotor of 50 g that nobody built, in round numbers: for examples and tests.
    EXAMPLE {
        mass = 0.05 ["kg"] in 0.01 ..= 2.0, "Take-off mass, battery included.";
        inertia_x = 2.0e-5 ["kg*m^2"] in 1e-6 ..= 0.1, "Moment of inertia about body x.";
        inertia_y = 2.5e-5 ["kg*m^2"] in 1e-6 ..= 0.1, "Moment of inertia about body y.";
        inertia_z = 4.0e-5 ["kg*m^2"] in 1e-6 ..= 0.1, "Moment of inertia about body z.";
        gravity = 9.80665 ["m/s^2"] in 0.0 ..= 20.0, "Gravity (ISO 80000-3).";
        rotor_offset = 0.03 ["m"] in 0.005 ..= 0.5, "Distance of each rotor from the body's x and y axis.";
        rotor_radius = 0.02 ["m"] in 0.005 ..= 0.3, "Radius of a propeller.";
        thrust_coefficient = 1.5e-8 ["N*s^2/rad^2"] in 1e-9 ..= 1e-4, "Thrust over rotor speed squared.";
        torque_coefficient = 7.5e-11 ["N*m*s^2/rad^2"] in 1e-13 ..= 1e-6, "Rotor drag torque over rotor speed squared.";
        motor_voltage_a = 7.0e-8 ["V*s^2/rad^2"] in 1e-9 ..= 1e-4, "Steady motor voltage: coefficient of speed squared.";
        motor_voltage_b = 6.0e-4 ["V*s/rad"] in 1e-5 ..= 1.0, "Steady motor voltage: coefficient of speed.";
        motor_voltage_c = 0.02 ["V"] in 0.0 ..= 1.0, "Steady motor voltage: constant part, friction.";
        motor_resistance = 0.5 ["ohm"] in 0.01 ..= 5.0, "Winding, switch and leads of one motor.";
        rotor_inertia = 2.0e-8 ["kg*m^2"] in 1e-10 ..= 1e-4, "Moment of inertia of motor and propeller.";
        manufacturing_spread = 1.0 ["1"] in 0.0 ..= 5.0, "Scales the per-seed differences between rotors and the offset of the centre of mass; 0 is the perfect vehicle.";
        centre_x = 0.0 ["m"] in -0.02 ..= 0.02, "How far the centre of mass lies ahead of the middle of rotors and feet, beside the difference that the seed makes.";
        centre_y = 0.0 ["m"] in -0.02 ..= 0.02, "The same to the right.";
        drag_horizontal = 0.02 ["N*s/m"] in 0.0 ..= 1.0, "Rotor drag along body x and y at hover speed of the rotors.";
        drag_vertical = 0.07 ["N*s/m"] in 0.0 ..= 1.0, "Loss of thrust with climb speed at hover.";
        drag_quadratic = 0.005 ["N*s^2/m^2"] in 0.0 ..= 1.0, "Drag of the body over air speed squared.";
        drag_rotation = 1.0e-6 ["N*m*s^2/rad^2"] in 0.0 ..= 1e-3, "Drag torque over angular rate squared.";
        battery_cells = 1.0 ["1"] in 1.0 ..= 12.0, "Lithium cells in series.";
        battery_capacity = 0.35 ["A*h"] in 0.01 ..= 10.0, "Capacity of the battery.";
        battery_charge = 1.0 ["1"] in 0.0 ..= 1.0, "State of charge at the start.";
        battery_resistance = 0.05 ["ohm"] in 0.0 ..= 1.0, "Internal resistance that acts at once, leads included.";
        battery_polarisation = 0.02 ["ohm"] in 0.0 ..= 1.0, "Internal resistance that acts with the time constant.";
        battery_time_constant = 10.0 ["s"] in 0.1 ..= 1000.0, "Time constant of the polarisation.";
        board_current = 0.2 ["A"] in 0.0 ..= 2.0, "What everything but the motors draws.";
        ground_height = 0.03 ["m"] in 0.005 ..= 0.5, "Height of the body's origin, and of the bottom range finder, when standing.";
        foot_offset = 0.035 ["m"] in 0.005 ..= 0.5, "Distance of each foot from the body's x and y axis.";
        foot_stiffness = 800.0 ["N/m"] in 10.0 ..= 1000.0, "Spring of one foot or corner on the floor.";
        foot_damping = 2.0 ["N*s/m"] in 0.0 ..= 3.0, "Damper of one foot or corner on the floor.";
        foot_friction = 0.6 ["1"] in 0.0 ..= 2.0, "Friction coefficient of feet and corners.";
        corner_offset = 0.05 ["m"] in 0.005 ..= 0.5, "Distance of each upper corner of the frame from the body's x and y axis.";
        corner_height = 0.01 ["m"] in 0.0 ..= 0.5, "Height of the upper corners, and of the propellers, above the body's origin.";
        propeller_radius = 0.0 ["m"] in 0.0 ..= 0.5, "Radius of the propellers, which stop where they touch the floor; 0 in a frame that is as wide and as high.";
        ground_effect_gain = 0.10 ["1"] in 0.0 ..= 1.0, "Extra thrust with the rotors at the floor.";
        ground_effect_height = 0.05 ["m"] in 0.001 ..= 1.0, "Height over which the ground effect fades by e.";
    }
}

impl PlantParameters {
    /// The specimen of this seed under these conditions, as far as numbers of this table say it.
    #[must_use]
    pub fn under(&self, conditions: &Conditions, seed: u64) -> Self {
        let battery = self.battery().worn(conditions.battery_age).at(conditions.battery_temperature);
        let mut noise = Noise::stream(seed, Stream::Frame);
        let mut share = |bound: f64| 1.0 + noise.within(bound);
        let (mass, thrust) = (share(conditions.mass_spread), share(conditions.thrust_spread));
        let [x, y] = [(); 2].map(|()| share(conditions.inertia_spread));
        let lag = share(conditions.rotor_lag_spread);
        Self {
            mass: self.mass * mass,
            inertia_x: self.inertia_x * x,
            inertia_y: self.inertia_y * y,
            // What is farther from x or from y is farther from z: it goes with them, as in every flat body.
            inertia_z: self.inertia_z * (0.5 * (x + y)),
            thrust_coefficient: self.thrust_coefficient * thrust,
            rotor_inertia: self.rotor_inertia * lag,
            battery_charge: battery.charge * (1.0 - conditions.battery_drained),
            battery_capacity: battery.capacity,
            battery_resistance: battery.resistance,
            battery_polarisation: battery.polarisation,
            ..self.clone()
        }
    }

    pub(super) fn battery(&self) -> BatterySpec {
        BatterySpec {
            cells: self.battery_cells,
            charge: self.battery_charge,
            capacity: self.battery_capacity,
            resistance: self.battery_resistance,
            polarisation: self.battery_polarisation,
            time_constant: self.battery_time_constant,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_param::parameters::{iter, set, validate};
    use stampfly_param::{ParameterError, Parameters};

    #[test]
    fn the_example_lies_in_every_range_and_every_name_can_be_set() {
        let mut parameters = PlantParameters::EXAMPLE;
        assert_eq!(validate(&parameters), Ok(()));
        for (index, (info, _)) in iter(&PlantParameters::EXAMPLE).enumerate() {
            assert_eq!(set(&mut parameters, info.name, info.max), Ok(index), "the upper end is allowed");
            assert_eq!(parameters.get(index), Some(info.max));
            assert!(matches!(set(&mut parameters, info.name, f64::NAN), Err(ParameterError::OutOfRange { .. })));
        }
    }
}
