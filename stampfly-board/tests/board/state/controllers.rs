//! Controllers, filters, guidance, mixer and motors.

use super::{Numbers, at, bytes, goes_on};
use serde::{Serialize, de::DeserializeOwned};
use stampfly_board::airframe::{AIRFRAME, MIXER};
use stampfly_control::filter::{Biquad, BiquadChain, BiquadCoefficients, DynamicNotch, LowPass};
use stampfly_control::guidance::{Navigator, NavigatorInput};
use stampfly_control::indi::IndiRate;
use stampfly_control::{
    CascadeConfig, CascadeController, ControlInput, Controller, GeometricConfig, GeometricController, IndiConfig,
    IndiController, Mixer, MotorConfig, MotorStage, MultirotorMixer,
};
use stampfly_types::Quat;
use stampfly_types::messages::*;

const MODES: [FlightMode; 4] = [FlightMode::PosHold, FlightMode::AltHold, FlightMode::Stabilize, FlightMode::Acro];

/// Stands, takes off, flies in one mode after the other, lands.
fn mode_of(k: u64) -> FlightStatus {
    let phase = match k {
        0..50 => FlightPhase::Armed,
        50..150 => FlightPhase::TakeOff,
        150..1_050 => FlightPhase::Flying,
        _ => FlightPhase::Landing,
    };
    FlightStatus {
        phase,
        mode: MODES[(k / 130) as usize % MODES.len()],
        armed: true,
        control_resets: u32::from(k > 300) + u32::from(k > 850),
        ..Default::default()
    }
}

fn estimate(n: &mut Numbers) -> StateEstimate {
    StateEstimate {
        attitude: Quat::from_euler_angles(n.number(0.3), n.number(0.3), n.number(0.5)),
        position: n.vector(0.5),
        velocity: n.vector(0.5),
        angular_rate: n.vector(1.0),
        height: 0.5 + n.number(0.2),
        valid: if n.once_in(20) { Validity::TILT } else { Validity::ALL },
        ..Default::default()
    }
}

fn sticks(n: &mut Numbers) -> CommandSetpoint {
    let source = if n.once_in(3) { CommandSource::Pilot } else { CommandSource::Guided };
    CommandSetpoint { throttle: n.number(1.0), roll: n.number(1.0), pitch: n.number(1.0), yaw: n.number(1.0), source }
}

fn fly<C: Controller>(controller: &mut C, k: u64, n: &mut Numbers) -> ControlOutput {
    let setpoint = Setpoint {
        position: n.vector(0.5),
        velocity: n.vector(0.3),
        acceleration: n.vector(0.5),
        yaw: n.number(0.5),
        yaw_rate: n.number(0.5),
        axes: SetpointAxes::ALL,
        ..Default::default()
    };
    let land_detected = LandDetected { thrust_ceiling: f32::MAX, ..Default::default() };
    let input = ControlInput {
        estimate: &estimate(n),
        command: &sticks(n),
        setpoint: &setpoint,
        flight_status: &mode_of(k),
        land_detected: &land_detected,
        unmet: [0.0, 0.0, n.number(0.2), n.number(0.2)],
    };
    controller.step(at(k), &input)
}

#[test]
fn controllers_go_on() {
    goes_on(CascadeController::new(&CascadeConfig::for_airframe(&AIRFRAME)), 600, fly);
    goes_on(GeometricController::new(&GeometricConfig::for_airframe(&AIRFRAME)), 600, fly);
    let rate = IndiRate::new(&IndiConfig::for_airframe(&AIRFRAME));
    goes_on(IndiController::with_rate_law(&CascadeConfig::for_airframe(&AIRFRAME), rate), 600, fly);
}

#[test]
fn navigator_goes_on() {
    let navigator = goes_on(Navigator::default(), 600, |navigator, k, n| {
        if k.is_multiple_of(10) {
            let (position, yaw) = (n.vector(1.0), n.number(3.0));
            let kind = if k.is_multiple_of(400) { GuidedKind::Hold } else { GuidedKind::WayPoint };
            let _ = navigator.accept(&GuidedCommand { kind, position, yaw, speed: 0.5, dwell: 0.1 });
        }
        let mode =
            FlightStatus { mode: if k < 1_000 { FlightMode::PosHold } else { FlightMode::AltHold }, ..mode_of(k) };
        let land_detected = LandDetected { descent_rate: 0.3, ..Default::default() };
        let estimate = StateEstimate { valid: Validity::ALL, ..estimate(n) };
        let command = CommandSetpoint { source: CommandSource::Guided, ..sticks(n) };
        let command = if (700..760).contains(&k) { sticks(n) } else { command };
        navigator.step(
            at(k),
            &NavigatorInput {
                flight_status: &mode,
                estimate: &estimate,
                land_detected: &land_detected,
                command: &command,
            },
        )
    });
    assert!(navigator.refused() > 0, "the route was full once");
}

#[test]
fn motors_go_on() {
    goes_on(MotorStage::new(&MotorConfig::for_airframe(&AIRFRAME)), 500, |motors, k, n| {
        let demand = ControlOutput { thrust: 0.36 + n.number(0.3), torque: n.vector(1e-3) };
        let voltage = (!n.once_in(10)).then(|| 3.7 + n.number(0.6));
        motors.step(at(k), &MIXER.mix(&demand), voltage, !(300..320).contains(&k))
    });
}

#[test]
fn the_mixer_comes_back() {
    let mixer = MIXER;
    let mut written = bytes(&mixer);
    assert_eq!(postcard::from_bytes(&written), Ok(mixer));
    // The number of rotors, before the largest thrust.
    let count = written.len() - 5;
    assert_eq!(written[count], 4);
    written[count] = 9;
    assert!(postcard::from_bytes::<MultirotorMixer>(&written).is_err());
}

fn filters_on<F>(filter: F, mut step: impl FnMut(&mut F, f32) -> f32)
where
    F: Serialize + DeserializeOwned + PartialEq + core::fmt::Debug,
{
    goes_on(filter, 500, |filter, k, n| {
        step(filter, stampfly_types::math::sin(k as f32 * 117.0 / 400.0 * core::f32::consts::TAU) + n.number(0.1))
    });
}

#[test]
fn filters_go_on() {
    let design = BiquadCoefficients::low_pass(50.0, 400.0, BiquadCoefficients::BUTTERWORTH).expect("possible");
    filters_on(LowPass::with_corner(40.0, 400.0).expect("possible"), LowPass::step);
    filters_on(Biquad::new(design), Biquad::step);
    filters_on(BiquadChain::<f32, 3>::new(design), BiquadChain::step);
    filters_on(DynamicNotch::<16>::new([60.0, 180.0], 400.0, 3.0).expect("possible"), DynamicNotch::step);
}

#[test]
fn a_count_out_of_range_is_harmless() {
    let mut notch = DynamicNotch::<16>::new([60.0, 180.0], 400.0, 3.0).expect("possible");
    let mut written = bytes(&notch);
    // Sixteen resonators of four numbers, then four numbers.
    let count = 4 * (16 * 4 + 4);
    for _ in 0..5 {
        notch.step(0.0);
    }
    assert_eq!((written[count], bytes(&notch)[count]), (0, 5));
    written[count] = u8::MAX;
    let mut notch: DynamicNotch<16> = postcard::from_bytes(&written).expect("no number is refused");
    assert!((0..100).all(|k| notch.step(k as f32).is_finite()));
}
