//! The smallest control law that can hover, climb and land, on the true state.
//!
//! Proportional and derivative action on quantities that no real vehicle knows; it exists to test
//! the simulator.

use stampfly_sim::Truth;
use stampfly_sim::plant::PlantParameters;
use stampfly_types::messages::MotorOutput;
use stampfly_types::{GRAVITY, Vec3};

const VEHICLE: PlantParameters = PlantParameters::EXAMPLE;
const MASS: f32 = VEHICLE.mass as f32;
const INERTIA: Vec3 = Vec3::new(VEHICLE.inertia_x as f32, VEHICLE.inertia_y as f32, VEHICLE.inertia_z as f32);
const OFFSET: f32 = VEHICLE.rotor_offset as f32;
const YAW_ARM: f32 = (VEHICLE.torque_coefficient / VEHICLE.thrust_coefficient) as f32;

/// Motor duties that bring the example vehicle above the origin at `down` metres (negative is up).
pub fn fly(truth: &Truth, down: f32) -> MotorOutput {
    let error = Vec3::new(-truth.position.x, -truth.position.y, (down - truth.position.z).clamp(-0.3, 0.3));
    let wanted =
        error.component_mul(&Vec3::new(1.5, 1.5, 6.0)) - truth.velocity.component_mul(&Vec3::new(2.0, 2.0, 4.0));
    // Thrust direction in the body frame, as a small tilt error.
    let force = truth.attitude.inverse_transform_vector(&(wanted.map(|a| a.clamp(-3.0, 3.0)) - Vec3::z() * GRAVITY));
    let north = truth.attitude.inverse_transform_vector(&Vec3::x());
    let thrust = -force.z * MASS;
    let (roll, pitch) = (force.y / GRAVITY, -force.x / GRAVITY);
    let rate = truth.angular_rate;
    let torque = Vec3::new(
        INERTIA.x * (300.0 * roll - 25.0 * rate.x),
        INERTIA.y * (300.0 * pitch - 25.0 * rate.y),
        INERTIA.z * (20.0 * north.y - 10.0 * rate.z),
    );
    let mut output = MotorOutput { count: 4, armed: true, ..Default::default() };
    let signs = [(-1.0, 1.0, 1.0), (-1.0, -1.0, -1.0), (1.0, -1.0, 1.0), (1.0, 1.0, -1.0)];
    for (duty, (x, y, z)) in output.duty.iter_mut().zip(signs) {
        let share = 0.25 * (thrust + (x * torque.x + y * torque.y) / OFFSET + z * torque.z / YAW_ARM);
        let speed = (f64::from(share.max(0.0)) / VEHICLE.thrust_coefficient).sqrt();
        let voltage = (VEHICLE.motor_voltage_a * speed + VEHICLE.motor_voltage_b) * speed + VEHICLE.motor_voltage_c;
        *duty = voltage as f32 / truth.battery_voltage.max(2.5);
    }
    output
}
