//! The detectors: what they must find, and what they must let pass.

use proptest::prelude::*;
use stampfly_mode::{Dated, Failsafe, FailsafeInput};
use stampfly_types::messages::{
    Alerts, EstimatorStatus, FlightMode, FlightState, GroundContact, ImuData, PowerData, StateEstimate, SystemMode,
    Validity, VehicleStatus,
};
use stampfly_types::{Micros, Quat, Vec3};

const PERIOD: Micros = Micros(2_500);
const STILL: ImuData = ImuData { accel: Vec3::new(0.0, 0.0, -9.81), gyro: Vec3::new(0.0, 0.0, 0.0), temperature: 25.0 };

/// A failsafe with everything in order around it.
struct Bench {
    failsafe: Failsafe,
    now: Micros,
    imu: ImuData,
    imu_at: Option<Micros>,
    estimate: StateEstimate,
    estimator: EstimatorStatus,
    voltage: Option<f32>,
    last_command: Option<Micros>,
    last_range: Option<Micros>,
    last_flow: Option<Micros>,
    mode: SystemMode,
    status: VehicleStatus,
    seen: Alerts,
}

impl Bench {
    fn flying() -> Self {
        let estimate = StateEstimate { height: 1.0, valid: Validity::ALL, ..StateEstimate::default() };
        let now = Micros::from_secs(10);
        Self {
            failsafe: Failsafe::default(),
            now,
            imu: STILL,
            imu_at: None,
            estimate,
            estimator: EstimatorStatus::default(),
            voltage: Some(4.0),
            last_command: None,
            last_range: None,
            last_flow: None,
            mode: SystemMode {
                state: FlightState::Flying,
                mode: FlightMode::PosHold,
                armed: true,
                ..SystemMode::default()
            },
            status: VehicleStatus { contact: GroundContact::Air, ..VehicleStatus::default() },
            seen: Alerts::NONE,
        }
    }

    fn standing() -> Self {
        let mut bench = Self::flying();
        bench.mode = SystemMode { state: FlightState::IdleGround, ..SystemMode::default() };
        bench.status.contact = GroundContact::Ground;
        bench.estimate.height = 0.03;
        bench
    }

    /// One period in which every source delivers, except those that `with` silences.
    fn step(&mut self, with: impl FnOnce(&mut Self)) -> Alerts {
        self.now += PERIOD;
        let now = Some(self.now);
        (self.imu_at, self.last_command, self.last_range, self.last_flow) = (now, now, now, now);
        with(self);
        let imu = self.imu;
        let power = |voltage| PowerData { voltage, ..PowerData::default() };
        let input = FailsafeInput {
            imu: self.imu_at.map(|at| Dated { at, data: &imu }),
            estimate: &self.estimate,
            estimator: &self.estimator,
            power: self.voltage.map(|voltage| Dated { at: self.now, data: power(voltage) }),
            last_command: self.last_command,
            last_range: self.last_range,
            last_flow: self.last_flow,
            mode: &self.mode,
            status: &self.status,
        };
        let alert = self.failsafe.step(self.now, &input);
        self.seen = alert.seen;
        alert.active
    }

    fn run(&mut self, seconds: f32, mut with: impl FnMut(&mut Self)) -> Alerts {
        let mut active = Alerts::NONE;
        for _ in 0..(seconds / PERIOD.seconds()) as u32 {
            active = self.step(&mut with);
        }
        active
    }

    fn force(&mut self, forces: &[f32]) -> Alerts {
        forces.iter().fold(Alerts::NONE, |_, force| {
            self.step(|bench| bench.imu = ImuData { accel: Vec3::new(0.0, 0.0, -force), ..STILL })
        })
    }
}

#[test]
fn all_quiet() {
    assert_eq!(Bench::flying().run(10.0, |_| ()), Alerts::NONE);
    assert_eq!(Bench::standing().run(10.0, |_| ()), Alerts::NONE);
}

#[test]
fn a_recorded_flight_raises_nothing() {
    // Three seconds around the hardest vibration of a real flight at 398 Hz (MIT, © 2026 Kouhei Ito).
    let mut bench = Bench::flying();
    let mut samples = 0;
    for line in include_str!("vectors/flight_vibration.csv").lines().skip(1) {
        let number: Vec<f32> = line.split(',').map(|field| field.parse().expect("a number")).collect();
        let [p, q, r, x, y, z] = number[..] else { panic!("six columns") };
        bench.imu = ImuData { gyro: Vec3::new(p, q, r), accel: Vec3::new(x, y, z), temperature: 25.0 };
        assert_eq!(bench.step(|_| ()), Alerts::NONE, "{line}");
        samples += 1;
    }
    assert!(samples > 1_000);
}

#[test]
fn heavy_vibration_raises_nothing() {
    // Ten metres per second squared RMS over all axes, white: the worst reported, for ten minutes.
    let mut bench = Bench::flying();
    let mut seed = 1u64;
    let mut uniform = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 40) as f32 / (1u64 << 24) as f32
    };
    let mut normal = || (0..12).map(|_| uniform()).sum::<f32>() - 6.0;
    for _ in 0..240_000 {
        let noise = Vec3::new(normal(), normal(), normal()) * 5.77;
        let alerts = bench.step(|bench| bench.imu.accel = STILL.accel + noise);
        assert_eq!(alerts, Alerts::NONE);
    }
    // And a tone at half the sample rate, as propellers alias to: large on every sample, nothing in the mean.
    for n in 0..1_000 {
        let sign = if n % 2 == 0 { 35.0 } else { -35.0 };
        assert_eq!(bench.step(|bench| bench.imu.accel = STILL.accel + Vec3::new(sign, 0.0, 0.0)), Alerts::NONE);
    }
}

#[test]
fn impacts_in_the_air_take_two_samples() {
    assert_eq!(Bench::flying().force(&[9.8, 200.0, 9.8, 9.8]), Alerts::NONE, "one sample is a glitch");
    assert_eq!(Bench::flying().force(&[9.8, 31.0, 31.0]), Alerts::IMPACT);
    let mut bench = Bench::flying();
    bench.force(&[9.8, 40.0, 40.0]);
    assert_eq!(bench.run(5.0, |b| b.imu = STILL), Alerts::IMPACT, "kept until disarmed");
    bench.mode.armed = false;
    assert_eq!(bench.step(|_| ()), Alerts::NONE);
}

#[test]
fn a_repeated_sample_counts_once() {
    let mut bench = Bench::flying();
    bench.force(&[9.8, 40.0]);
    let at = bench.imu_at;
    assert_eq!(bench.step(|b| b.imu_at = at), Alerts::NONE);
}

#[test]
fn touchdowns_are_no_impacts_and_crashes_are() {
    for landing in [true, false] {
        let near = || {
            let mut bench = Bench::flying();
            if landing {
                bench.mode.state = FlightState::Landing;
            } else {
                bench.estimate.height = 0.05;
            }
            bench
        };
        // Half a metre per second with a rebound of half of it, over one to five periods.
        for periods in 1..=5usize {
            let mut blow = vec![9.81];
            blow.extend(vec![9.81 + 0.75 / (0.0025 * periods as f32); periods]);
            assert_eq!(near().force(&blow), Alerts::NONE, "touchdown over {periods} periods");
        }
        assert_eq!(near().force(&[9.8, 250.0, 250.0, 9.8]), Alerts::IMPACT, "1.2 m/s into the ground");
    }
}

#[test]
fn spinning_needs_two_samples() {
    let spin = |bench: &mut Bench| bench.imu.gyro.z = 14.5;
    let mut bench = Bench::flying();
    bench.step(|_| ());
    assert_eq!(bench.step(spin), Alerts::NONE);
    assert_eq!(bench.step(spin), Alerts::GYRO_ANOMALY);
    let mut bench = Bench::flying();
    assert_eq!(bench.run(1.0, |b| b.imu.gyro.z = 13.0), Alerts::NONE, "fast, but possible");
}

#[test]
fn a_silent_imu_degrades_after_ten_and_is_lost_after_twenty_five_milliseconds() {
    let mut bench = Bench::flying();
    bench.step(|_| ());
    let last = bench.imu_at;
    for (step, expected) in [
        (1, Alerts::NONE),
        (2, Alerts::NONE),
        (3, Alerts::NONE),
        (4, Alerts::IMU_DEGRADED),
        (9, Alerts::IMU_DEGRADED),
        (10, Alerts::IMU_DEGRADED | Alerts::IMU_LOST),
    ] {
        while bench.now.since(last.expect("sampled")) < Micros(2_500 * step) {
            let alerts = bench.step(|b| b.imu_at = last);
            if bench.now.since(last.expect("sampled")) == Micros(2_500 * step) {
                assert_eq!(alerts, expected, "after {step} periods");
            }
        }
    }
    assert_eq!(bench.step(|_| ()), Alerts::IMU_LOST, "coming back does not undo it in flight");
    // One that sends only garbage is as good as silent.
    let mut bench = Bench::flying();
    let alerts = bench.run(0.05, |b| b.imu.accel.x = f32::NAN);
    assert!(alerts.contains(Alerts::IMU_LOST));
}

#[test]
fn links_and_sensors_go_silent_and_come_back() {
    let mut bench = Bench::flying();
    bench.step(|_| ());
    let last = bench.last_command;
    assert_eq!(bench.run(0.495, |b| b.last_command = last), Alerts::NONE);
    assert_eq!(bench.run(0.01, |b| b.last_command = last), Alerts::COMM_LOST);
    assert_eq!(bench.step(|_| ()), Alerts::NONE);
    let last = (bench.last_range, bench.last_flow);
    let lost = bench.run(0.31, |b| (b.last_range, b.last_flow) = last);
    assert_eq!(lost, Alerts::TOF_LOST | Alerts::FLOW_LOST);
    assert_eq!(bench.step(|_| ()), Alerts::NONE);
    // On the ground both may be out of range, but a range finder that never spoke is missed.
    let mut bench = Bench::standing();
    let quiet = bench.run(2.0, |b| (b.last_range, b.last_flow) = (Some(Micros::ZERO), None));
    assert_eq!(quiet, Alerts::NONE);
    assert_eq!(bench.step(|b| b.last_range = None), Alerts::TOF_LOST);
    assert_eq!(bench.step(|b| b.last_command = None), Alerts::COMM_LOST);
}

#[test]
fn battery_levels_under_load() {
    let mut bench = Bench::flying();
    bench.step(|_| ());
    assert_eq!(bench.run(0.1, |b| b.voltage = Some(1e30)), Alerts::NONE, "what is impossible is not filtered in");
    assert_eq!(bench.run(0.1, |b| b.voltage = Some(3.2)), Alerts::NONE, "a short sag is no warning");
    assert_eq!(bench.run(6.0, |b| b.voltage = Some(3.2)), Alerts::LOW_BATTERY);
    assert_eq!(bench.run(6.0, |b| b.voltage = Some(3.45)), Alerts::LOW_BATTERY, "hysteresis");
    assert_eq!(bench.run(6.0, |b| b.voltage = Some(3.55)), Alerts::NONE);
    let critical = Alerts::LOW_BATTERY | Alerts::CRITICAL_BATTERY;
    assert_eq!(bench.run(8.0, |b| b.voltage = Some(2.9)), critical, "both levels, each with a latch of its own");
    assert!(bench.run(8.0, |b| b.voltage = Some(4.0)).contains(Alerts::CRITICAL_BATTERY), "sticky in flight");
    let mut bench = Bench::flying();
    assert_eq!(
        bench.run(8.0, |b| b.voltage = Some(0.0)),
        Alerts::NONE,
        "no flying cell reads zero: the sensor is dead"
    );
    let mut bench = Bench::standing();
    assert!(bench.step(|b| b.voltage = Some(3.2)).contains(Alerts::USB_POWER), "no battery is seen at once");
    assert_eq!(Bench::standing().run(1.0, |b| b.voltage = None), Alerts::NONE, "a board without a meter flies");
}

#[test]
fn tumbling_takes_time_except_upside_down() {
    let lean = |degrees: f32| {
        move |b: &mut Bench| b.estimate.attitude = Quat::from_euler_angles(degrees.to_radians(), 0.0, 0.0)
    };
    assert_eq!(Bench::flying().run(0.29, lean(70.0)), Alerts::NONE);
    assert_eq!(Bench::flying().run(0.31, lean(70.0)), Alerts::TUMBLED);
    assert_eq!(Bench::flying().run(0.11, lean(170.0)), Alerts::TUMBLED);
    assert_eq!(Bench::flying().run(5.0, lean(50.0)), Alerts::NONE);
    let mut acro = Bench::flying();
    acro.mode.mode = FlightMode::Acro;
    assert_eq!(acro.run(2.0, lean(170.0)), Alerts::NONE, "where it is meant to");
}

#[test]
fn an_estimate_that_disagrees_with_gravity_is_noticed_on_the_ground() {
    let lean = |degrees: f32| {
        move |b: &mut Bench| b.estimate.attitude = Quat::from_euler_angles(0.0, degrees.to_radians(), 0.0)
    };
    assert_eq!(Bench::standing().run(5.0, lean(8.0)), Alerts::NONE);
    assert_eq!(Bench::standing().run(0.4, lean(15.0)), Alerts::NONE);
    assert_eq!(Bench::standing().run(0.6, lean(15.0)), Alerts::TILT_MISMATCH);
    assert_eq!(Bench::flying().run(2.0, lean(15.0)), Alerts::NONE, "in the air that is no measurement");
    // Standing on a slope: both agree.
    let slope = Quat::from_euler_angles(0.3, 0.0, 1.0);
    let alerts = Bench::standing().run(5.0, |b| {
        b.estimate.attitude = slope;
        b.imu.accel = slope.inverse() * Vec3::new(0.0, 0.0, -9.81);
    });
    assert_eq!(alerts, Alerts::NONE);
}

#[test]
fn a_lost_estimate_is_lost_by_any_sign() {
    let signs: [fn(&mut Bench); 5] = [
        |b| b.estimator.diverged = true,
        |b| b.estimate.position.x = 101.0,
        |b| b.estimate.velocity.z = -51.0,
        |b| b.estimate.angular_rate.y = f32::NAN,
        |b| b.estimate.position.y = f32::INFINITY,
    ];
    for sign in signs {
        assert_eq!(Bench::flying().step(sign), Alerts::ESTIMATE_DIVERGED);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn no_input_leaves_a_lasting_mark(
        garbage in prop::collection::vec((any::<[f32; 6]>(), any::<Option<f32>>(), any::<[f32; 4]>()), 1..40),
    ) {
        let mut bench = Bench::standing();
        for (imu, voltage, [w, x, y, z]) in garbage {
            bench.step(|b| {
                b.imu = ImuData { accel: Vec3::new(imu[0], imu[1], imu[2]), gyro: Vec3::new(imu[3], imu[4], imu[5]), temperature: 0.0 };
                b.voltage = voltage;
                b.estimate.attitude = Quat::new_unchecked(nalgebra::Quaternion::new(w, x, y, z));
            });
        }
        bench.voltage = Some(4.0);
        bench.imu = STILL;
        bench.estimate.attitude = Quat::identity();
        prop_assert_eq!(bench.run(20.0, |_| ()), Alerts::NONE);
    }

    #[test]
    fn what_was_seen_is_never_unseen(forces in prop::collection::vec(0f32..60.0, 1..60)) {
        let mut bench = Bench::flying();
        let mut seen = Alerts::NONE;
        for force in forces {
            seen |= bench.force(&[force]);
            prop_assert!(bench.seen.contains(seen));
        }
    }
}
