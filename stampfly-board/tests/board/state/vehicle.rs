//! The whole vehicle: a key frame in the middle of a flight, and the rest of the flight from there.

use super::{Numbers, at, bytes};
use stampfly_board::messages::ButtonContact;
use stampfly_board::schedule::Runnables;
use stampfly_board::topics;
use stampfly_board::{ControllerKind, EstimatorKind, VehicleConfig};
use stampfly_bus::{Activation, Band};
use stampfly_flight::{Assembled, Observer, key_frame};
use stampfly_types::messages::*;
use stampfly_types::{ActivationRecord, Instant, Vec3};

/// Keeps what a replay repeats.
#[derive(Default)]
struct Records(Vec<ActivationRecord>);

impl Observer for Records {
    fn finished(&mut self, activation: &Activation) {
        self.0.push(*activation.record());
    }
}

/// What comes from outside in one step.
fn publish(outside: &mut topics::Outside<'_>, k: u64, n: &mut Numbers) {
    let accel = Vec3::new(0.0, 0.0, -9.80665) + n.vector(0.02);
    outside
        .imu
        .sensor_imu
        .publish(at(k), &ImuData { accel, gyro: n.vector(0.003), temperature: 25.0, ..Default::default() });
    if k.is_multiple_of(13) {
        outside.tof.sensor_tof.publish(at(k), &TofData { distance: 0.03, sigma: 0.005, status: 0, valid: true });
    }
    if k.is_multiple_of(4) {
        let flow = FlowData { delta_x: n.number(1e-3), delta_y: 0.0, interval: 0.01, quality: 200, valid: true };
        outside.flow.sensor_flow.publish(at(k), &flow);
    }
    if k.is_multiple_of(16) {
        outside.baro.sensor_baro.publish(at(k), &BaroData { pressure: 101_325.0, ..Default::default() });
    }
    if k.is_multiple_of(28) {
        outside.power.sensor_power.publish(at(k), &PowerData { voltage: 4.0 + n.number(0.01), ..Default::default() });
    }
    if k.is_multiple_of(8) {
        let pilot = PilotInput { arm: k > 1_600, mode: FlightMode::AltHold, roll: n.number(0.1), ..Default::default() };
        outside.link.command_pilot.publish(at(k), &pilot);
        outside.button_pin.button_contact.publish(at(k), &ButtonContact { pressed: k % 2_300 < 40 });
    }
}

/// Everything that is in the runnables, whether it is serialised or not.
fn shown(runnables: &Runnables) -> String {
    let Runnables { estimation, failsafe, landing, mode, navigation, control, actuation, .. } = runnables;
    let Runnables { calibration, command, button, notification, telemetry, .. } = runnables;
    let flight = format!("{estimation:?} {failsafe:?} {landing:?} {mode:?} {navigation:?} {control:?} {actuation:?}");
    format!("{flight} {calibration:?} {command:?} {button:?} {notification:?} {telemetry:?}")
}

/// Starts up, is calibrated, armed and takes off; key frames are made on the way. From each the vehicle goes on, on a
/// fresh bus, as it went on.
fn goes_on(config: &VehicleConfig) {
    const FRAMES: [u64; 4] = [1, 700, 1_650, 1_900];
    let mut bus = topics::Bus::new();
    let mut live = Assembled::<Runnables>::new(&mut bus, None, config, Instant::ZERO);
    let mut buses = FRAMES.map(|_| topics::Bus::new());
    let mut restored = buses.each_mut().map(|bus| Assembled::<Runnables>::new(bus, None, config, Instant::ZERO));
    let (mut numbers, mut frame, mut duty) = (Numbers::new(), vec![0; 1 << 16], 0.0f32);
    for k in 1..=2_400 {
        let same_numbers = numbers.clone();
        let mut records = Records::default();
        publish(&mut live.outside, k, &mut numbers);
        live.flight_loop.run_band(Band::Flight, at(k), &mut records);
        live.flight_loop.run_band(Band::Background, at(k), &mut records);
        let expected = bytes(live.flight_loop.runnables());
        let told = |outside: &mut topics::Outside<'_>| outside.motors.actuator_motor.latest().map(|output| output.data);
        let expected_output = told(&mut live.outside);
        duty = expected_output.map_or(duty, |output| duty.max(output.duty[0]));
        for (place, Assembled { flight_loop, outside, .. }) in FRAMES.into_iter().zip(&mut restored) {
            if k == place {
                let length = key_frame::encode(&live.flight_loop, at(k), &mut frame).expect("room");
                assert_eq!(key_frame::restore(&frame[..length], flight_loop, outside), Ok(at(k)));
                assert_eq!(shown(flight_loop.runnables()), shown(live.flight_loop.runnables()));
            }
            if k > place {
                publish(outside, k, &mut same_numbers.clone());
                for record in &records.0 {
                    assert_eq!(*flight_loop.replay(*record).record(), *record);
                }
                assert_eq!(told(outside), expected_output, "step {k} from the key frame of {place}");
            }
            if k >= place {
                assert_eq!(bytes(flight_loop.runnables()), expected, "step {k} from the key frame of {place}");
            }
        }
    }
    assert!(duty > 0.1, "it never turned a motor");
}

#[test]
fn a_vehicle_goes_on_from_a_key_frame() {
    goes_on(&VehicleConfig::default());
}

#[test]
fn with_other_components_too() {
    goes_on(&VehicleConfig {
        estimator: EstimatorKind::Complementary,
        controller: ControllerKind::Geometric,
        ..VehicleConfig::default()
    });
}
