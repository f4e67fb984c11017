//! What one control period costs. `cargo bench -p stampfly-control`

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;

use stampfly_control::guidance::{Axis, Bounds, Navigator, NavigatorInput};
use stampfly_control::indi::IndiRate;
use stampfly_control::{
    Airframe, CascadeConfig, CascadeController, ControlInput, Controller, GeometricConfig, GeometricController,
    IndiConfig, IndiController, Mixer, MotorConfig, MotorStage, MultirotorMixer,
};
use stampfly_types::messages::{
    CommandSetpoint, CommandSource, FlightMode, FlightPhase, FlightStatus, GroundContact, GuidedCommand, GuidedKind,
    LandDetected, Setpoint, SetpointAxes, StateEstimate, Validity,
};
use stampfly_types::{Duration, Instant, Quat, Vec3};

struct Situation {
    estimate: StateEstimate,
    setpoint: Setpoint,
    mode: FlightStatus,
    land_detected: LandDetected,
    command: CommandSetpoint,
}

fn situation() -> Situation {
    Situation {
        estimate: StateEstimate {
            attitude: Quat::from_euler_angles(0.1, -0.05, 0.7),
            position: Vec3::new(0.02, -0.03, -0.98),
            velocity: Vec3::new(0.1, 0.05, -0.02),
            angular_rate: Vec3::new(0.3, -0.2, 0.1),
            valid: Validity::ALL,
            ..StateEstimate::default()
        },
        setpoint: Setpoint {
            position: Vec3::new(0.05, 0.0, -1.0),
            velocity: Vec3::new(0.2, 0.0, 0.0),
            acceleration: Vec3::new(0.5, 0.0, 0.0),
            yaw: 0.72,
            axes: SetpointAxes::POSITION_XY | SetpointAxes::POSITION_Z | SetpointAxes::YAW,
            ..Setpoint::default()
        },
        mode: FlightStatus {
            phase: FlightPhase::Flying,
            mode: FlightMode::PosHold,
            armed: true,
            ..FlightStatus::default()
        },
        land_detected: LandDetected {
            contact: GroundContact::Air,
            thrust_ceiling: f32::MAX,
            ..LandDetected::default()
        },
        command: CommandSetpoint { source: CommandSource::Guided, ..CommandSetpoint::default() },
    }
}

fn control(c: &mut Criterion) {
    let s = situation();
    let airframe = Airframe::EXAMPLE;
    let mixer = MultirotorMixer::for_airframe(&airframe).expect("flies");
    // Errors of alternating sign: a flight that is under control, no integrator at its limit.
    let other_side = StateEstimate {
        position: 2.0 * s.setpoint.position - s.estimate.position,
        velocity: 2.0 * s.setpoint.velocity - s.estimate.velocity,
        angular_rate: -s.estimate.angular_rate,
        ..s.estimate
    };
    let input = |now: Instant, unmet| ControlInput {
        estimate: if (now.as_micros() / 2_500).is_multiple_of(2) { &s.estimate } else { &other_side },
        command: &s.command,
        setpoint: &s.setpoint,
        flight_status: &s.mode,
        land_detected: &s.land_detected,
        unmet,
    };
    let mut cascade = CascadeController::new(&CascadeConfig::for_airframe(&airframe));
    let mut now = Instant::ZERO;
    c.bench_function("cascade and mixer", |b| {
        let mut unmet = [0.0; 4];
        b.iter(|| {
            now += Duration::from_micros(2_500);
            let mixed = mixer.mix(&cascade.step(now, &black_box(input(now, unmet))));
            unmet = mixed.unmet;
            mixed
        });
    });
    let mut geometric = GeometricController::new(&GeometricConfig::for_airframe(&airframe));
    c.bench_function("geometric and mixer", |b| {
        b.iter(|| {
            now += Duration::from_micros(2_500);
            mixer.mix(&geometric.step(now, &black_box(input(now, [0.0; 4]))))
        });
    });
    let rate = IndiRate::new(&IndiConfig::for_airframe(&airframe));
    let mut incremental = IndiController::with_rate_law(&CascadeConfig::for_airframe(&airframe), rate);
    c.bench_function("incremental and mixer", |b| {
        let mut unmet = [0.0; 4];
        b.iter(|| {
            now += Duration::from_micros(2_500);
            let mixed = mixer.mix(&incremental.step(now, &black_box(input(now, unmet))));
            unmet = mixed.unmet;
            mixed
        });
    });
    let output = cascade.step(now, &input(now, [0.0; 4]));
    c.bench_function("mixer", |b| b.iter(|| mixer.mix(&black_box(output))));
    let mixed = mixer.mix(&output);
    let mut motors = MotorStage::new(&MotorConfig::for_airframe(&airframe));
    c.bench_function("motor stage", |b| {
        b.iter(|| {
            now += Duration::from_micros(2_500);
            motors.step(now, &black_box(mixed), Some(7.6), true)
        });
    });
}

fn guidance(c: &mut Criterion) {
    let s = situation();
    let mut navigator = Navigator::default();
    let mut now = Instant::ZERO;
    let mut estimate = s.estimate;
    let mut north = 0.0;
    c.bench_function("navigator on a route", |b| {
        b.iter(|| {
            now += Duration::from_micros(2_500);
            let input = NavigatorInput {
                flight_status: &s.mode,
                estimate: &estimate,
                land_detected: &s.land_detected,
                command: &s.command,
            };
            let setpoint = navigator.step(now, &input);
            estimate.position = setpoint.position;
            if setpoint.remaining == 0 {
                north = 1.0 - north;
                let position = Vec3::new(north, 0.5 * north, -1.0);
                let _ = navigator.accept(&GuidedCommand {
                    kind: GuidedKind::WayPoint,
                    position,
                    ..GuidedCommand::default()
                });
            }
            setpoint
        });
    });
    let bounds = Bounds { speed: 1.0, acceleration: 1.5, jerk: 8.0 };
    c.bench_function("axis there and back", |b| {
        let (mut axis, mut goal) = (Axis::at(0.0), 1.0);
        b.iter(|| {
            axis.step_to(black_box(goal), &bounds, 0.0025);
            if axis.rests_at(goal) {
                goal = 1.0 - goal;
            }
            axis
        });
    });
}

criterion_group!(benches, control, guidance);
criterion_main!(benches);
