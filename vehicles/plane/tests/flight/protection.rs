//! What the inertial sensor of this airframe may show and what it may not: blows, rates, a sensor
//! that does not measure.

use stampfly_mode::{Failsafe, FailsafeInput};
use stampfly_plane::Parameters;
use stampfly_plane::protection::{BLOW, above_any_ground, config};
use stampfly_types::messages::*;
use stampfly_types::{Duration, GRAVITY, Instant, Stamped, Vec3};

struct Rig {
    failsafe: Failsafe,
    now: Instant,
    noise: u32,
    estimate: StateEstimate,
    phase: FlightPhase,
}

impl Rig {
    fn new(phase: FlightPhase, sink: f32) -> Self {
        let velocity = Vec3::new(14.0, 0.0, sink);
        let mut rig = Self {
            failsafe: Failsafe::new(config(&Parameters::default())),
            now: Instant::ZERO,
            noise: 1,
            estimate: StateEstimate { velocity, valid: Validity::ALL, ..StateEstimate::default() },
            phase,
        };
        for _ in 0..400 {
            assert_eq!(rig.feels(1, [0.0, 0.0, -1.0], 0.0), Alerts::NONE);
        }
        rig
    }

    /// So many samples of this force, g, and this rate: every alert of it.
    fn feels(&mut self, samples: u32, force: [f32; 3], rate: f32) -> Alerts {
        let force = Vec3::from(force) * GRAVITY;
        // The chip's full scale.
        let force = Vec3::from_fn(|axis| force[axis].clamp(-8.0 * GRAVITY, 8.0 * GRAVITY));
        (0..samples).fold(Alerts::NONE, |all, _| {
            let noise = Vec3::from_fn(|_| {
                self.noise = self.noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (self.noise >> 8) as f32 / (1 << 24) as f32 - 0.5
            });
            all | self.sample(force + noise * 0.5, Vec3::new(rate, 0.0, 0.0) + noise * 0.02)
        })
    }

    fn sample(&mut self, accel: Vec3, gyro: Vec3) -> Alerts {
        self.now += Duration::from_micros(2_500);
        let data = ImuData { accel, gyro, ..ImuData::default() };
        let status = FlightStatus { phase: self.phase, mode: FlightMode::PosHold, armed: true, ..Default::default() };
        let power = PowerData { voltage: 11.5, ..PowerData::default() };
        let input = FailsafeInput {
            imu: &[Stamped { at: self.now, generation: 1, data }],
            estimate: &above_any_ground(&self.estimate),
            status: &EstimatorStatus::default(),
            findings: &SensorFindings::default(),
            power: Some((self.now, &power)),
            command: Some(self.now),
            tof: Some(self.now),
            flow: Some(self.now),
            baro: Some(self.now),
            output: &ControlOutput::default(),
            unmet: [0.0; 4],
            thrust: None,
            self_test: SelfTestVerdict::NotRun,
            flight_status: &status,
        };
        self.failsafe.step(self.now, &input).active
    }
}

/// Samples of a tenth of a second, and of a blow of 20 ms.
const WHILE: u32 = 40;
const BLOW_LASTS: u32 = 8;

#[test]
fn wheels_wing_thrust_and_brakes_are_no_blow() {
    let calm = |phase, sink, force, rate| {
        let mut rig = Rig::new(phase, sink);
        rig.feels(WHILE, force, rate)
    };
    for _ in 0..3 {
        let mut rig = Rig::new(FlightPhase::Landing, 2.0);
        assert_eq!(rig.feels(BLOW_LASTS, [0.0, 3.5, -12.0], 0.5), Alerts::NONE, "a hard touch with a crab");
        assert_eq!(rig.feels(WHILE, [0.0, 0.5, -0.5], 0.5), Alerts::NONE, "a bounce");
    }
    assert_eq!(calm(FlightPhase::Armed, 0.3, [-1.0, 1.0, -4.0], 0.5), Alerts::NONE, "a bump at taxiing speed");
    assert_eq!(calm(FlightPhase::TakeOff, 0.0, [1.0, 0.3, -1.0], 0.2), Alerts::NONE, "a start");
    assert_eq!(calm(FlightPhase::Armed, 0.0, [-0.5, 0.0, -1.0], 0.0), Alerts::NONE, "brakes");
    assert_eq!(calm(FlightPhase::Flying, 4.0, [0.0, 0.5, -4.3], 1.0), Alerts::NONE, "a gust in a dive");
    assert_eq!(calm(FlightPhase::Flying, -3.0, [0.2, 0.0, 0.3], 2.0), Alerts::NONE, "over the crest");
    assert_eq!(calm(FlightPhase::Flying, 0.0, [0.0, 0.0, -2.0], 5.0), Alerts::NONE, "a roll");
}

#[test]
fn what_it_runs_into_and_what_its_wheels_do_not_bear_is_a_blow() {
    let struck = |sink, force: [f32; 3]| {
        let mut rig = Rig::new(FlightPhase::Flying, sink);
        rig.feels(BLOW_LASTS, force, 0.5).intersects(BLOW)
    };
    assert!(struck(0.5, [-60.0, 0.0, -5.0]), "nose first");
    // With every axis at full scale the chip may have no sensor, and 50 ms decide.
    assert!(struck(0.5, [-20.0, 12.0, -6.0]), "a wing first");
    assert!(struck(0.0, [0.0, 0.0, 9.0]), "on its back");
    assert!(struck(3.5, [0.0, 0.0, -20.0]), "wheels first, and hard");
    assert!(!struck(2.0, [0.0, 0.0, -20.0]), "what its wheels bear");
    let mut rig = Rig::new(FlightPhase::Flying, 0.0);
    assert!(rig.feels(WHILE, [0.0, 0.0, -1.0], 16.0).contains(Alerts::GYRO_ANOMALY), "a cartwheel");
}

#[test]
fn a_sensor_that_repeats_itself_does_not_measure() {
    let mut rig = Rig::new(FlightPhase::Flying, 0.0);
    let [accel, gyro] = [Vec3::new(0.1, 0.0, -9.8), Vec3::new(0.01, 0.02, 0.0)];
    let after = (1..=400).find(|_| rig.sample(accel, gyro).contains(Alerts::IMU_FAULTY));
    assert!(after.is_some_and(|samples| samples <= 24), "{after:?}");
}
