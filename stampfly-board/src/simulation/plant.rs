//! The StampFly as a simulated body: what its [airframe](crate::airframe) does not say, and the two together.

use crate::airframe::{
    AIRFRAME, DRAG, DRAG_SQUARE, DRAG_VERTICAL, FOOT_OFFSET, GROUND_HEIGHT, INERTIA, MASS, MOTOR_VOLTAGE,
    ROTOR_INERTIA, ROTOR_OFFSET, THRUST_COEFFICIENT, TORQUE_COEFFICIENT,
};
use stampfly_sim::plant::PlantParameters;

/// The StampFly on Earth, with the usual differences between one motor and the next.
pub const PLANT: PlantParameters = PlantParameters {
    mass: MASS,
    inertia_x: INERTIA[0],
    inertia_y: INERTIA[1],
    inertia_z: INERTIA[2],
    gravity: 9.80665,
    rotor_offset: ROTOR_OFFSET,
    // The propeller's, as it is sold.
    rotor_radius: 0.01499,
    thrust_coefficient: THRUST_COEFFICIENT,
    torque_coefficient: TORQUE_COEFFICIENT,
    motor_voltage_a: MOTOR_VOLTAGE[0],
    motor_voltage_b: MOTOR_VOLTAGE[1],
    motor_voltage_c: MOTOR_VOLTAGE[2],
    // Chosen so that the battery lasts the four minutes it does, since the voltage curve leaves it free.
    motor_resistance: 0.76,
    // Gives a lag of 20 ms at hover.
    rotor_inertia: ROTOR_INERTIA,
    manufacturing_spread: 1.0,
    centre_x: 0.0,
    centre_y: 0.0,
    drag_horizontal: DRAG,
    drag_vertical: DRAG_VERTICAL,
    drag_quadratic: DRAG_SQUARE,
    drag_rotation: 1.0e-6,
    battery_cells: AIRFRAME.cells as f64,
    // The label.
    battery_capacity: 0.300,
    battery_charge: 1.0,
    battery_resistance: 0.06,
    battery_polarisation: 0.03,
    battery_time_constant: 10.0,
    board_current: 0.15,
    ground_height: GROUND_HEIGHT,
    foot_offset: FOOT_OFFSET,
    foot_stiffness: 700.0,
    foot_damping: 2.0,
    foot_friction: 0.6,
    // Half extents of the product.
    corner_offset: 0.0408,
    corner_height: 0.0103,
    // They turn inside of the frame's extents.
    propeller_radius: 0.0,
    ground_effect_gain: 0.10,
    ground_effect_height: 0.05,
};

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_sim::plant::{Plant, Pose, WindConfig};

    #[test]
    fn every_number_is_in_its_range() {
        assert_eq!(stampfly_param::parameters::validate(&PLANT), Ok(()));
    }

    /// Where the loop over the voltage of the step before swung between 1.4 and 4.3 V.
    #[test]
    fn a_published_pack_of_0_28_ohm_is_steady() {
        let weak = PlantParameters { manufacturing_spread: 0.0, battery_resistance: 0.28, ..PLANT };
        let mut plant = Plant::new(&weak, &WindConfig::CALM, Some(&Pose::hovering(1000.0)), 1);
        plant.set_duty([0.95; 4]);
        (0..3200).for_each(|_| plant.step());
        let mut voltages = [(); 50].map(|()| {
            plant.step();
            plant.battery().voltage()
        });
        voltages.sort_by(f64::total_cmp);
        assert!(voltages[49] - voltages[0] < 1e-3 && voltages[0] > 2.0, "{} to {} V", voltages[0], voltages[49]);
    }

    #[test]
    fn a_hover_needs_two_thirds_of_the_duty_and_drains_the_battery_in_four_minutes() {
        let pose = Pose::hovering(1000.0);
        let ideal = PlantParameters { manufacturing_spread: 0.0, ..PLANT };
        let mut plant = Plant::new(&ideal, &WindConfig::CALM, Some(&pose), 1);
        let w = plant.rotors().hover_speed();
        let [a, b, c] = MOTOR_VOLTAGE;
        let voltage = a * w * w + b * w + c;
        assert!((voltage / 3.7 - 0.69).abs() < 0.01 && (voltage / 4.2 - 0.61).abs() < 0.01, "{voltage} V");
        let mut seconds = 0;
        while plant.battery().charge() > 0.1 && seconds < 1000 {
            plant.set_duty([(voltage / plant.battery().voltage()).min(1.0); 4]);
            (0..1600).for_each(|_| plant.step());
            seconds += 1;
        }
        assert!((200..=300).contains(&seconds), "{seconds} s");
    }
}
