//! A flight that never was, to develop and to test the page with.

use stampfly_host::{Flight, flight::Event};
use stampfly_types::messages::{
    Alerts, ControlOutput, EstimatorStatus, FlightMode, FlightPhase, FlightStatus, ImuData, MotorOutput, PowerData,
    Setpoint, SetpointAxes, StateEstimate, SystemAlert, TofData,
};
use stampfly_types::{GRAVITY, Instant, Quat, Vec3, math, message};

message! {
    /// What the made-up world knows.
    struct Truth {
        /// Body FRD → world NED.
        attitude: Quat,
        /// World NED.
        position: Vec3 ["m"],
        /// World NED.
        velocity: Vec3 ["m/s"],
    }
}

/// Rise, fly two figures of eight, land: kinematics with errors that look like errors, to develop the page with.
pub fn flight() -> Flight {
    let mut flight = Flight::default();
    let mut phases = Vec::new();
    for step in 0..24_000u64 {
        let at = Instant::from_micros(step * 2_500);
        let t = at.since(Instant::ZERO).seconds();
        let height = 0.6 * (smooth((t - 4.0) / 3.0) - smooth((t - 52.0) / 5.0));
        let phase = math::TAU * (t - 10.0).clamp(0.0, 40.0) / 20.0;
        let place = |phase: f32| Vec3::new(0.8 * math::sin(phase), 0.5 * math::sin(2.0 * phase), -height);
        let position = place(phase);
        let moving = (10.0..50.0).contains(&t);
        let rate = if moving { math::TAU / 20.0 } else { 0.0 };
        let climb = 0.6 * (slope((t - 4.0) / 3.0) / 3.0 - slope((t - 52.0) / 5.0) / 5.0);
        let velocity = Vec3::new(0.8 * rate * math::cos(phase), rate * math::cos(2.0 * phase), -climb);
        let accel = Vec3::new(-0.8 * rate * rate * math::sin(phase), -2.0 * rate * rate * math::sin(2.0 * phase), 0.0);
        let wobble = |speed: f32, size: f32| size * math::sin(speed * t) * math::sin(0.37 * speed * t + 1.0);
        let flying = height > 0.03;
        let shake = if flying { 1.0 } else { 0.05 };
        let roll = accel.y / GRAVITY + shake * wobble(9.0, 0.01);
        let pitch = -accel.x / GRAVITY + shake * wobble(7.0, 0.01);
        let yaw = 0.4 * math::sin(0.2 * t) * smooth((t - 8.0) / 4.0);
        let truth = Truth { attitude: Quat::from_euler_angles(roll, pitch, yaw), position, velocity };
        let drift = Vec3::new(wobble(0.3, 0.06), wobble(0.23, 0.05), wobble(0.9, 0.01)) * shake;

        let noise = |seed: f32| math::sin(t * 431.0 + seed) * math::sin(t * 1_237.0 * seed + 2.0);
        let imu = ImuData {
            accel: truth.attitude.inverse() * (accel - Vec3::new(0.0, 0.0, GRAVITY))
                + shake * 0.6 * Vec3::new(noise(1.0), noise(2.0), noise(3.0)),
            gyro: shake * 0.12 * Vec3::new(noise(4.0) + wobble(9.0, 0.6), noise(5.0), 0.3 * noise(6.0)),
            temperature: 32.0,
            ..Default::default()
        };
        flight.push("sensor_imu", at, &imu);
        let estimate = StateEstimate {
            attitude: Quat::from_euler_angles(roll + wobble(1.3, 0.006), pitch + wobble(1.1, 0.006), yaw + 0.0006 * t),
            position: position + drift,
            velocity: velocity + 0.4 * drift,
            height,
            ..Default::default()
        };
        flight.push("estimate_state", at, &estimate);
        flight.push("truth", at, &truth);
        let throttle = if flying { 0.56 + 0.04 * (t - 4.0) / 56.0 } else { 0.0 };
        let mut motors = MotorOutput { count: 4, armed: flying, ..Default::default() };
        for (motor, (duty, [r, p])) in
            motors.duty.iter_mut().zip([[-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [1.0, 1.0]]).enumerate()
        {
            *duty = (throttle + shake * 0.05 * (r * imu.gyro.x + p * imu.gyro.y + 0.5 * noise(motor as f32 + 7.0)))
                .clamp(0.0, 1.0);
        }
        flight.push("actuator_motor", at, &motors);
        let thrust = if flying { 0.36 + 0.02 * noise(11.0) } else { 0.0 };
        let torque = 1e-3 * Vec3::new(noise(12.0), noise(13.0), 0.3 * noise(14.0)) * shake;
        flight.push("control_output", at, &ControlOutput { thrust, torque });
        let status = EstimatorStatus {
            tof_innovation: 0.004 * noise(21.0),
            tof_ratio: 0.2 * noise(22.0) * noise(22.0),
            flow_innovation: [0.05 * noise(23.0), 0.05 * noise(24.0)],
            flow_ratio: 0.5 * noise(25.0) * noise(25.0) + if (31.0..31.4).contains(&t) { 2.0 } else { 0.0 },
            baro_innovation: 0.1 * noise(26.0),
            baro_ratio: 0.05 * noise(27.0) * noise(27.0),
            mag_innovation: 0.02 * noise(28.0),
            mag_ratio: 0.1 * noise(28.0) * noise(28.0),
            accel_innovation: 0.01 * noise(29.0),
            accel_ratio: 0.1 * noise(29.0) * noise(29.0),
            ..Default::default()
        };
        flight.push("estimate_status", at, &status);
        if step % 4 == 0 {
            let axes = SetpointAxes::POSITION_XY | SetpointAxes::POSITION_Z | SetpointAxes::YAW;
            let axes = if flying { axes } else { SetpointAxes::NONE };
            let ahead = place(phase + 0.6 * rate);
            flight.push("setpoint", at, &Setpoint { position: ahead, velocity, yaw, axes, ..Default::default() });
        }
        if step % 13 == 0 {
            let distance = height + 0.03 + 0.003 * noise(41.0);
            flight.push("sensor_tof", at, &TofData { distance, valid: true, ..Default::default() });
        }
        if step % 40 == 0 {
            let current = if flying { 2.9 + 0.15 * noise(51.0) } else { 0.25 };
            let voltage = 4.15 - 0.008 * t - 0.08 * current;
            flight.push("sensor_power", at, &PowerData { voltage, current, power: voltage * current });
        }
        let phase = match t {
            ..1.5 => FlightPhase::Init,
            1.5..3.0 => FlightPhase::IdleGround,
            3.0..4.0 => FlightPhase::Armed,
            4.0..8.0 => FlightPhase::TakeOff,
            8.0..52.0 => FlightPhase::Flying,
            52.0..57.5 => FlightPhase::Landing,
            _ => FlightPhase::IdleGround,
        };
        let flight_mode = if t < 8.0 { FlightMode::AltHold } else { FlightMode::PosHold };
        if phases.last() != Some(&phase) {
            phases.push(phase);
            let text = format!("phase {}", phase.name());
            flight.events.push(Event { at, text });
        }
        if step % 40 == 0 {
            let armed = (3.0..57.5).contains(&t);
            flight.push("flight_status", at, &FlightStatus { phase, mode: flight_mode, armed, ..Default::default() });
            let active = if t > 49.0 { Alerts::LOW_BATTERY } else { Alerts::NONE };
            let active = active.set(Alerts::FLOW_LOST, (31.0..31.4).contains(&t));
            flight.push("system_alert", at, &SystemAlert { active, seen: active });
        }
    }
    flight
}

/// From 0 to 1 without a jerk at either end.
fn smooth(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    x * x * x * (x * (6.0 * x - 15.0) + 10.0)
}

/// The derivative of [`smooth`].
fn slope(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    30.0 * x * x * (x - 1.0) * (x - 1.0)
}
