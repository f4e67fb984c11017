//! Gains that change in flight: what a controller has learned and filtered stays, and nothing moves but by the gains.

use proptest::prelude::*;
use stampfly_control::indi::{IndiConfig, IndiRate};
use stampfly_control::pid::{Integration, Pid, PidGains};
use stampfly_control::rate::{RateConfig, RateController};
use stampfly_control::{
    Airframe, CascadeConfig, CascadeController, ControlInput, Controller, FlipConfig, FlipController, IndiController,
};
use stampfly_types::messages::{
    CommandSetpoint, ControlOutput, FlightMode, FlightPhase, FlightStatus, GroundContact, LandDetected, Setpoint,
    SetpointAxes, StateEstimate, Validity,
};
use stampfly_types::{Instant, Quat, Vec3, math};

const AIRFRAME: &Airframe = &Airframe::EXAMPLE;
const DT: f32 = 0.0025;
const PERIOD: u64 = 2_500;

/// Where the vehicle is at one instant: position, velocity, rate, two parts of the attitude.
type Sight = ([f32; 3], [f32; 3], [f32; 3], [f32; 2]);

fn sight() -> impl Strategy<Value = Sight> {
    use prop::array::{uniform2, uniform3};
    (uniform3(-1f32..1.0), uniform3(-1f32..1.0), uniform3(-1f32..1.0), uniform2(-0.2f32..0.2))
}

fn step(controller: &mut impl Controller, number: usize, (position, velocity, rate, [x, y]): &Sight) -> ControlOutput {
    let estimate = StateEstimate {
        position: Vec3::from(*position),
        velocity: Vec3::from(*velocity),
        angular_rate: Vec3::from(*rate),
        attitude: Quat::new_unchecked(math::sqrt(1.0 - x * x - y * y), *x, *y, 0.0),
        valid: Validity::ALL,
        height: 1.0,
        ..Default::default()
    };
    let flight_status =
        FlightStatus { phase: FlightPhase::Flying, mode: FlightMode::PosHold, armed: true, ..Default::default() };
    let land_detected = LandDetected { contact: GroundContact::Air, thrust_ceiling: f32::MAX, ..Default::default() };
    let axes = SetpointAxes::POSITION_XY | SetpointAxes::POSITION_Z | SetpointAxes::YAW;
    let input = ControlInput {
        estimate: &estimate,
        command: &CommandSetpoint::default(),
        setpoint: &Setpoint { axes, ..Default::default() },
        flight_status: &flight_status,
        land_detected: &land_detected,
        unmet: [0.0; 4],
    };
    controller.step(Instant::from_micros(PERIOD * (number as u64 + 1)), &input)
}

fn bits(output: &ControlOutput) -> [u32; 4] {
    let Vec3 { x, y, z, .. } = output.torque;
    [output.thrust, x, y, z].map(f32::to_bits)
}

/// Every gain by a factor of its own; limits and everything else that is no gain, too.
fn other(config: &CascadeConfig, factor: f32) -> CascadeConfig {
    let mut other = *config;
    for (place, gains) in [
        &mut other.rate.roll,
        &mut other.rate.pitch,
        &mut other.rate.yaw,
        &mut other.position.velocity,
        &mut other.altitude.velocity,
    ]
    .into_iter()
    .enumerate()
    {
        let factor = factor + 0.01 * place as f32;
        (gains.kp, gains.ti, gains.td) = (gains.kp * factor, gains.ti / factor, gains.td * factor);
    }
    other.attitude.tilt_gain *= factor;
    other.attitude.heading_gain *= factor;
    other.position.position_gain *= factor;
    other.altitude.height_gain *= factor;
    other
}

proptest! {
    #[test]
    fn the_same_gains_change_nothing_bit_for_bit(sights in prop::collection::vec(sight(), 2..60), when in 0usize..60) {
        let config = CascadeConfig::for_airframe(AIRFRAME);
        let indi = IndiConfig::for_airframe(AIRFRAME);
        let mut left = (CascadeController::new(&config), IndiController::with_rate_law(&config, IndiRate::new(&indi)));
        let mut told = left.clone();
        for (number, sight) in sights.iter().enumerate() {
            if number == when % sights.len() {
                told.0.set_gains(&config);
                told.1.set_gains(&config, &indi);
                prop_assert_eq!(&told, &left);
            }
            prop_assert_eq!(bits(&step(&mut told.0, number, sight)), bits(&step(&mut left.0, number, sight)));
            prop_assert_eq!(bits(&step(&mut told.1, number, sight)), bits(&step(&mut left.1, number, sight)));
        }
    }

    /// And what has learned with the first gains learns on with the others: there and back again is as if nothing had been.
    #[test]
    fn gains_that_come_back_before_a_step_leave_no_trace(sights in prop::collection::vec(sight(), 2..40), factor in 0.3f32..3.0) {
        let config = CascadeConfig::for_airframe(AIRFRAME);
        let mut left = CascadeController::new(&config);
        let mut told = left.clone();
        for (number, sight) in sights.iter().enumerate() {
            told.set_gains(&other(&config, factor));
            told.set_gains(&config);
            prop_assert_eq!(bits(&step(&mut told, number, sight)), bits(&step(&mut left, number, sight)));
        }
    }

    /// From rest there is nothing to keep, so these are the gains of one that was made with them: none is forgotten.
    #[test]
    fn every_gain_is_taken(sights in prop::collection::vec(sight(), 2..40), factor in 0.3f32..3.0) {
        let config = CascadeConfig::for_airframe(AIRFRAME);
        let wanted = other(&config, factor);
        let (mut told, mut made) = (CascadeController::new(&config), CascadeController::new(&wanted));
        told.set_gains(&wanted);
        prop_assert_eq!(&told, &made);
        for (number, sight) in sights.iter().enumerate() {
            prop_assert_eq!(bits(&step(&mut told, number, sight)), bits(&step(&mut made, number, sight)));
        }
        let indi = IndiConfig::for_airframe(AIRFRAME);
        let quicker = IndiConfig { bandwidth: indi.bandwidth * factor, smoothing: indi.smoothing * factor, ..indi };
        let mut told = IndiController::with_rate_law(&config, IndiRate::new(&indi));
        told.set_gains(&wanted, &quicker);
        prop_assert_eq!(&told, &IndiController::with_rate_law(&wanted, IndiRate::new(&quicker)));
        let flips = FlipConfig::for_airframe(AIRFRAME);
        let mut told = FlipController::new(&flips, &indi);
        told.set_gains(&quicker);
        prop_assert_eq!(&told, &FlipController::new(&flips, &quicker));
    }

    #[test]
    fn another_kp_alone_keeps_the_integral(errors in prop::collection::vec(-1f32..1.0, 10..100), factor in 0.3f32..3.0) {
        let gains = PidGains { kp: 2.0, ti: 0.5, td: 0.02, eta: 0.125 };
        let mut pid = Pid::new(gains, 1e3);
        for error in &errors {
            pid.step(*error, 0.5 * error, DT, Integration::Free);
        }
        let integral = pid.integral();
        pid.set_gains(PidGains { kp: factor * gains.kp, ..gains });
        prop_assert_eq!(pid.integral().to_bits(), integral.to_bits());
        // A proportional part of zero is left, and a derivative that has died away: the output is what was learned.
        let mut output = 0.0;
        for _ in 0..2_000 {
            output = pid.step(0.0, 0.0, DT, Integration::Hold);
        }
        prop_assert!((output - integral).abs() < 1e-5, "{} {}", output, integral);
    }
}

/// A weak motor that the integrals have learned to hold against is held against in the very next step, too.
#[test]
fn the_torque_that_was_learned_is_there_in_the_next_step() {
    let config = RateConfig::for_airframe(AIRFRAME);
    let mut rate = RateController::new(&config);
    for _ in 0..400 {
        rate.step(&Vec3::new(0.2, 0.0, 0.0), &Vec3::zeros(), DT, [0.0; 4], [false; 3]);
    }
    let held = [true; 3];
    let learned = rate.step(&Vec3::zeros(), &Vec3::zeros(), DT, [0.0; 4], held);
    assert!(learned.x > 1e-4, "{learned}");
    let mut config = config;
    config.roll.kp *= 2.0;
    rate.set_gains(&config);
    assert_eq!(rate.step(&Vec3::zeros(), &Vec3::zeros(), DT, [0.0; 4], held), learned);
}
