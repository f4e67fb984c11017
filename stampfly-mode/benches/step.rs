//! What judging costs per control period. `cargo bench -p stampfly-mode`

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;

use stampfly_mode::{
    Authority, AuthorityInput, Dated, Failsafe, FailsafeInput, LandingInput, LandingManager, ModeInput, ModeMachine,
};
use stampfly_types::messages::{
    ButtonGesture, CalibrationResult, CommandSetpoint, CommandSource, EstimatorStatus, FlightMode, FlightState,
    GroundContact, GuidedCommand, GuidedKind, ImuData, PilotInput, PowerData, Setpoint, StateEstimate, SystemAlert,
    SystemMode, Validity, VehicleStatus,
};
use stampfly_types::{Micros, Vec3};

fn judging(c: &mut Criterion) {
    let estimate = StateEstimate {
        position: Vec3::new(0.1, 0.0, -1.0),
        specific_force: Vec3::new(0.1, 0.2, -9.7),
        height: 1.0,
        valid: Validity::ALL,
        ..StateEstimate::default()
    };
    let mode =
        SystemMode { state: FlightState::Flying, mode: FlightMode::PosHold, armed: true, ..SystemMode::default() };
    let status = VehicleStatus { contact: GroundContact::Air, thrust_ceiling: 2.0, ..VehicleStatus::default() };
    let imu = ImuData { accel: Vec3::new(0.3, -0.2, -9.9), gyro: Vec3::new(0.1, 0.0, 0.0), temperature: 30.0 };
    let calibration = CalibrationResult { complete: true, ..CalibrationResult::default() };
    let pilot = PilotInput { mode: FlightMode::PosHold, arm: true, ..PilotInput::default() };
    let command = CommandSetpoint { source: CommandSource::Guided, ..CommandSetpoint::default() };
    let (estimator, setpoint) = (EstimatorStatus::default(), Setpoint::default());

    let failsafe_step = |failsafe: &mut Failsafe, now: Micros| {
        failsafe.step(
            now,
            &FailsafeInput {
                imu: Some(Dated { at: now, data: &imu }),
                estimate: &estimate,
                estimator: &estimator,
                power: Some(Dated { at: now, data: PowerData { voltage: 3.9, ..PowerData::default() } }),
                last_command: Some(now),
                last_range: Some(now),
                last_flow: Some(now),
                mode: &mode,
                status: &status,
            },
        )
    };
    let landing_step = |manager: &mut LandingManager, now: Micros| {
        manager.step(now, &LandingInput { mode: &mode, estimate: &estimate, setpoint: &setpoint, thrust: 1.0 })
    };
    let machine_step = |machine: &mut ModeMachine, now: Micros, alert: &SystemAlert, status: &VehicleStatus| {
        machine.step(
            now,
            &ModeInput {
                alert,
                estimate: &estimate,
                calibration: &calibration,
                status,
                command: &command,
                pilot: Some(&pilot),
                guided: &[],
                button: ButtonGesture::None,
                paired: false,
            },
        )
    };

    /// A machine that flies: the state in which time is short.
    fn airborne(step: impl Fn(&mut ModeMachine, Micros, &[GuidedCommand], bool)) -> (ModeMachine, Micros) {
        let mut machine = ModeMachine::default();
        let command = |kind| GuidedCommand { kind, ..GuidedCommand::default() };
        let start = Micros::from_secs(1);
        step(&mut machine, start, &[], false);
        step(&mut machine, start, &[command(GuidedKind::Arm), command(GuidedKind::TakeOff)], false);
        step(&mut machine, start + Micros::from_secs(1), &[], false);
        step(&mut machine, start + Micros::from_secs(2), &[], true);
        (machine, start + Micros::from_secs(2))
    }
    let prepare = |machine: &mut ModeMachine, now: Micros, guided: &[GuidedCommand], complete: bool| {
        let contact = if complete { GroundContact::Air } else { GroundContact::Ground };
        let status = VehicleStatus { contact, takeoff_complete: complete, ..VehicleStatus::default() };
        machine.step(
            now,
            &ModeInput {
                alert: &SystemAlert::default(),
                estimate: &estimate,
                calibration: &calibration,
                status: &status,
                command: &command,
                pilot: None,
                guided,
                button: ButtonGesture::None,
                paired: false,
            },
        );
    };

    let (mut failsafe, mut now) = (Failsafe::default(), Micros::ZERO);
    c.bench_function("failsafe", |b| {
        b.iter(|| {
            now += Micros(2_500);
            failsafe_step(black_box(&mut failsafe), now)
        });
    });
    let mut manager = LandingManager::default();
    c.bench_function("landing", |b| {
        b.iter(|| {
            now += Micros(2_500);
            landing_step(black_box(&mut manager), now)
        });
    });
    let (mut machine, mut now) = airborne(prepare);
    c.bench_function("machine", |b| {
        b.iter(|| {
            now += Micros(2_500);
            let output = machine_step(black_box(&mut machine), now, &SystemAlert::default(), &status);
            assert_eq!(output.mode.state, FlightState::Flying);
            output
        });
    });
    let (mut machine, mut now) = airborne(prepare);
    let (mut failsafe, mut manager) = (Failsafe::default(), LandingManager::default());
    c.bench_function("failsafe, landing and machine", |b| {
        b.iter(|| {
            now += Micros(2_500);
            let alert = failsafe_step(black_box(&mut failsafe), now);
            let status = landing_step(black_box(&mut manager), now);
            machine_step(black_box(&mut machine), now, &alert, &status)
        });
    });
    let mut authority = Authority::default();
    c.bench_function("authority", |b| {
        b.iter(|| {
            now += Micros(2_500);
            let pilot = Some(Dated { at: now, data: pilot });
            authority.step(now, &AuthorityInput { pilot, guided: &[], guided_at: Some(now), mode: black_box(&mode) })
        });
    });
}

criterion_group!(benches, judging);
criterion_main!(benches);
