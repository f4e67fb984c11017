//! A hexacopter of 1.8 kg from its mass, inertia and motors alone: for `docs/guide/controller.md`.

use stampfly_control::{
    Airframe, CascadeConfig, Mixer, MotorConfig, MotorCurve, MotorStage, MultirotorMixer, Rotor, Spin,
};
use stampfly_types::messages::ControlOutput;
use stampfly_types::{Instant, Vec3};

// ANCHOR: airframe
const fn rotor(x: f32, y: f32, spin: Spin) -> Rotor {
    // Drag torque over thrust of a 10 inch propeller, m.
    Rotor { x, y, spin, kappa: 0.016 }
}

const HEXACOPTER: Airframe = Airframe {
    mass: 1.8,
    inertia: Vec3::new(0.022, 0.024, 0.042),
    rotors: &[
        rotor(0.28, 0.0, Spin::CounterClockwise),
        rotor(0.14, 0.2425, Spin::Clockwise),
        rotor(-0.14, 0.2425, Spin::CounterClockwise),
        rotor(-0.28, 0.0, Spin::Clockwise),
        rotor(-0.14, -0.2425, Spin::CounterClockwise),
        rotor(0.14, -0.2425, Spin::Clockwise),
    ],
    motor: MotorCurve { ct: 1.2e-5, am: 4.0e-6, bm: 1.3e-2, cm: 0.2 },
    motor_lag: 0.045,
    motor_thrust_max: 7.0,
    cells: 4,
};
// ANCHOR_END: airframe

fn main() -> Result<(), stampfly_control::GeometryError> {
    // ANCHOR: derived
    let config = CascadeConfig::for_airframe(&HEXACOPTER);
    let mixer = MultirotorMixer::for_airframe(&HEXACOPTER)?;
    let mut motors = MotorStage::new(&MotorConfig::for_airframe(&HEXACOPTER));
    // ANCHOR_END: derived
    println!(
        "hovers at {:.1} N; roll {:.3}, pitch {:.3} Nm per rad/s",
        HEXACOPTER.hover_thrust(),
        config.rate.roll.kp,
        config.rate.pitch.kp
    );

    // ANCHOR: mix
    let demand = ControlOutput { thrust: HEXACOPTER.hover_thrust(), torque: Vec3::new(0.3, 0.0, 0.0) };
    let mixed = mixer.mix(&demand);
    // A quarter of a second at 400 Hz: duties rise slowly, so that motors do not stall.
    let output = (0..100).map(|k| motors.step(Instant::from_micros(2_500 * k), &mixed, Some(15.2), true)).last();
    let output = output.unwrap_or_default();
    for (number, (thrust, duty)) in mixed.thrust.iter().zip(output.duty).take(6).enumerate() {
        println!("motor {}: {thrust:.2} N, {:.0} %", number + 1, 100.0 * duty);
    }
    // ANCHOR_END: mix
    let total: f32 = mixed.thrust.iter().sum();
    assert!((total - HEXACOPTER.hover_thrust()).abs() < 0.01 && mixed.unmet == [0.0; 4], "all of it is met");
    Ok(())
}
