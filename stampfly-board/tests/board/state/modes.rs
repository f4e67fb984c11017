//! State management: modes, failsafe, landing, authority, signals, button.

use super::{Numbers, at, goes_on};
use stampfly_mode::{
    Authority, ButtonDecoder, Failsafe, FailsafeInput, LandingConfig, LandingInput, ModeInput, ModeMachine, Signaller,
    TakeoffLanding,
};
use stampfly_types::messages::*;
use stampfly_types::{Stamped, Vec3};

const PHASES: [FlightPhase; 4] = [FlightPhase::Armed, FlightPhase::TakeOff, FlightPhase::Flying, FlightPhase::Landing];

fn phase_of(k: u64) -> FlightPhase {
    PHASES[(k / 90) as usize % PHASES.len()]
}

fn pilot(k: u64, n: &mut Numbers) -> PilotInput {
    PilotInput {
        roll: n.number(1.0),
        pitch: n.number(0.2),
        yaw: n.number(0.2),
        throttle: if k % 400 < 60 { 0.0 } else { n.number(1.0) },
        mode: FlightMode::AltHold,
        arm: k % 400 > 50,
        kill: false,
    }
}

#[test]
fn mode_machine_goes_on() {
    let machine = goes_on(ModeMachine::default(), 800, |machine, k, n| {
        let flies = k % 400 > 200;
        let height = if flies { 0.5 } else { 0.03 } + n.number(0.01);
        let estimate = StateEstimate { height, valid: Validity::ALL, ..Default::default() };
        let calibration = CalibrationResult { complete: k > 20, ..Default::default() };
        let contact = if flies { GroundContact::Air } else { GroundContact::Ground };
        let land_detected = LandDetected {
            contact,
            takeoff_complete: flies && k % 400 > 260,
            landed: k % 400 > 390,
            thrust_ceiling: f32::MAX,
            descent_rate: 0.3,
        };
        let commands = if k.is_multiple_of(230) { &[GuidedKind::Arm, GuidedKind::TakeOff][..] } else { &[] };
        let pilot = pilot(k, n);
        let input = ModeInput {
            alerts: if k % 400 > 330 { Alerts::COMM_LOST | Alerts::LOW_BATTERY } else { Alerts::NONE },
            estimate: &estimate,
            calibration: &calibration,
            land_detected: &land_detected,
            pilot: Some((at(k - k % 8), &pilot)).filter(|_| k % 400 < 330),
            sticks: CommandSource::Pilot,
            commands,
            button: n.once_in(150).then_some(ButtonGesture::Click),
            cut_off: false,
        };
        let output = machine.step(at(k), &input);
        (output.flight_status, output.estimator)
    });
    assert!(format!("{machine:?}").contains("transitions"), "{machine:?}");
}

#[test]
fn failsafe_goes_on() {
    goes_on(Failsafe::default(), 800, |failsafe, k, n| {
        let blow = if k % 150 < 4 { 60.0 } else { 1.0 };
        let data = ImuData {
            accel: Vec3::new(0.0, 0.0, -9.81) + n.vector(blow),
            gyro: n.vector(2.0),
            temperature: 25.0,
            ..Default::default()
        };
        let imu = [Stamped { at: at(k), generation: 0, data }];
        let estimate = StateEstimate { valid: Validity::ALL, ..Default::default() };
        let status = EstimatorStatus { accel_innovation: n.number(0.5).abs(), ..Default::default() };
        let power = PowerData { voltage: 3.7 - 0.0004 * k as f32 + n.number(0.1), ..Default::default() };
        let armed = k % 330 > 60;
        let phase = if armed { FlightPhase::Flying } else { FlightPhase::IdleGround };
        let input = FailsafeInput {
            imu: if k % 200 > 15 { &imu } else { &[] },
            estimate: &estimate,
            status: &status,
            findings: &SensorFindings::default(),
            power: (k.is_multiple_of(28)).then_some((at(k), &power)),
            command: Some(at(k - k % 250)),
            tof: Some(at(k - k % 350)),
            flow: None,
            baro: None,
            output: &ControlOutput::default(),
            unmet: [0.0; 4],
            thrust: None,
            self_test: SelfTestVerdict::NotRun,
            flight_status: &FlightStatus { phase, armed, ..Default::default() },
        };
        failsafe.step(at(k), &input)
    });
}

#[test]
fn landing_goes_on() {
    goes_on(TakeoffLanding::new(LandingConfig::default()), 600, |manager, k, n| {
        let height = 0.5 * stampfly_types::math::sin(k as f32 * 0.02).abs();
        let estimate = StateEstimate { height, velocity: n.vector(0.05), valid: Validity::ALL, ..Default::default() };
        let setpoint = Setpoint { position: Vec3::new(0.0, 0.0, -0.5), ..Default::default() };
        let demand = ControlOutput { thrust: 0.25 + n.number(0.1), ..Default::default() };
        let input = LandingInput {
            felt: true,
            estimate: &estimate,
            phase: phase_of(k),
            setpoint: &setpoint,
            demand: &demand,
            unmet: 0.0,
        };
        manager.step(at(k), &input)
    });
}

#[test]
fn authority_goes_on() {
    goes_on(Authority::default(), 600, |authority, k, n| {
        if k.is_multiple_of(8) && k % 300 < 200 {
            authority.pilot(at(k), &pilot(k, n));
        }
        authority.step(at(k), if k % 100 < 70 { CommandSource::Pilot } else { CommandSource::Guided }, k % 3 > 0)
    });
}

#[test]
fn signals_go_on() {
    goes_on(Signaller::default(), 600, |signaller, k, n| {
        let mode = FlightStatus { phase: phase_of(k), armed: k % 90 > 45, ..Default::default() };
        let alerts = if n.once_in(20) { Alerts::NONE } else { Alerts::LOW_BATTERY };
        signaller.step(at(k), &mode, alerts)
    });
}

#[test]
fn button_goes_on() {
    let mut events = 0;
    goes_on(ButtonDecoder::default(), 900, |button, k, _| {
        // Clicks, and one long hold that is restored in the middle.
        let pressed = if (700..1_400).contains(&k) { true } else { k % 120 < 40 };
        let event = button.step(at(k), pressed);
        events += u32::from(event.is_some());
        event
    });
    assert!(events > 6, "{events}");
}
