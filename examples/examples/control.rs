//! A hexacopter's roll rate: a PID loop that learns a disturbance, and a mixer made from the rotors' places.

use stampfly_control::pid::{Integration, Pid, PidGains};
use stampfly_control::{Mixer, MultirotorMixer, Rotor, Spin};
use stampfly_types::messages::ControlOutput;
use stampfly_types::{Vec3, math};

/// Roll inertia, kg·m².
const INERTIA: f32 = 4e-5;
/// Weight, N.
const WEIGHT: f32 = 0.6;
/// A propeller that is bent, N·m.
const DISTURBANCE: f32 = -4e-4;
const DT: f32 = 0.0025;

fn main() -> Result<(), stampfly_control::GeometryError> {
    let rotors: [Rotor; 6] = std::array::from_fn(|k| {
        let (sin, cos) = math::sin_cos(math::TAU * (k as f32 + 0.5) / 6.0);
        let spin = if k % 2 == 0 { Spin::Clockwise } else { Spin::CounterClockwise };
        Rotor { x: 0.04 * cos, y: 0.04 * sin, spin, kappa: 5e-3 }
    });
    let mixer = MultirotorMixer::from_rotors(&rotors, 0.2)?;

    let gains = PidGains { kp: 1.2e-3, ti: 0.08, td: 0.002, eta: 0.125 };
    let mut pid = Pid::new(gains, 3e-3);
    let mut rate = 0.0f32;
    println!("   time  demanded     rate    integral  roll rate");
    for step in 0..200 {
        let demanded = if step < 20 { 0.0 } else { 2.0 };
        let torque = pid.step(demanded, rate, DT, Integration::Free);
        let mixed = mixer.mix(&ControlOutput { thrust: WEIGHT, torque: Vec3::new(torque, 0.0, 0.0) });

        // What the rotors do with it, seen from the physics' side.
        let roll: f32 = rotors.iter().zip(mixed.thrust).map(|(rotor, thrust)| -rotor.y * thrust).sum();
        rate += (roll + DISTURBANCE) / INERTIA * DT;

        if step % 10 == 9 {
            let bar = "#".repeat((rate.max(0.0) * 12.0) as usize);
            println!(
                "{:4.0} ms {demanded:5.1} rad/s {rate:6.2} rad/s {:8.1} µNm  {bar}",
                step as f32 * DT * 1e3,
                pid.integral() * 1e6
            );
        }
    }
    println!("the integral has learned the bent propeller: {:.0} µNm", -DISTURBANCE * 1e6);

    let thrusts = mixer.mix(&ControlOutput { thrust: WEIGHT, torque: Vec3::new(16e-3, 0.0, 3e-3) });
    let [roll, pitch, yaw, thrust] = thrusts.unmet;
    println!("\nmore than the motors can do: {:.3?} N", &thrusts.thrust[..6]);
    println!(
        "given up: {:.0} % of roll, {:.0} % of pitch, {:.0} % of yaw, {:.0} % of thrust",
        roll * 100.0,
        pitch * 100.0,
        yaw * 100.0,
        thrust * 100.0
    );
    Ok(())
}
