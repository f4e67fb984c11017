//! The vertical axis in a take-off and in flight without a range: the effect of propellers on
//! barometer and accelerometer is not motion.

use stampfly_eskf::{Eskf, EskfConfig, Estimator};
use stampfly_types::messages::{BaroData, CalibrationResult, EstimatorCommand, FlowData, ImuData, TofData};
use stampfly_types::{Duration, GRAVITY, Instant, Quat, Vec3};

/// Time between inertial samples.
const STEP: Duration = Duration::from_micros(2_500);

/// A filter that has stood for two seconds, and its sensors.
struct Rig {
    eskf: Eskf,
    at: Instant,
    steps: u32,
    attitude: Quat,
    /// Height above the floor, m, and error of the barometer, m.
    height: f32,
    pressure: f32,
    /// Range on the ground, m.
    clearance: f32,
    /// Upward error of the accelerometer's zero, m/s².
    zero: f32,
    /// Whether there is a range.
    range: bool,
    /// Image rate about body y, rad/s.
    slips: Option<f32>,
}

impl Rig {
    fn standing(config: EskfConfig) -> Self {
        let mut eskf = Eskf::new(config);
        let command = EstimatorCommand { on_ground: true, ..EstimatorCommand::default() };
        eskf.command(Instant::ZERO, &command);
        let specific_force = Vec3::new(0.0, 0.0, -GRAVITY);
        eskf.initialize(
            Instant::ZERO,
            &CalibrationResult { specific_force, complete: true, ..CalibrationResult::default() },
        );
        let mut rig = Self {
            eskf,
            at: Instant::ZERO,
            steps: 0,
            attitude: Quat::identity(),
            height: 0.0,
            pressure: 0.0,
            clearance: 0.03,
            zero: 0.0,
            range: true,
            slips: None,
        };
        rig.fly(2.0);
        rig
    }

    /// The propellers start: from here on it may fly.
    fn leave_the_ground(&mut self) {
        self.eskf.command(self.at, &EstimatorCommand { flying: true, ..EstimatorCommand::default() });
    }

    fn fly(&mut self, seconds: f32) {
        for _ in 0..(seconds * 400.0) as u32 {
            self.step();
        }
    }

    fn step(&mut self) {
        self.at += STEP;
        self.steps += 1;
        let at = self.at;
        // A working sensor never repeats itself.
        let dither = (self.steps * 7_919 % 101) as f32 / 50.0 - 1.0;
        let accel = self.attitude.inverse() * Vec3::new(0.0, 0.0, -GRAVITY - self.zero + 0.02 * dither);
        self.eskf.predict(at, &ImuData { accel, temperature: 25.0, ..ImuData::default() });
        if self.steps.is_multiple_of(13) && self.range {
            let distance = self.height + self.clearance + 0.5e-3 * dither;
            _ = self.eskf.fuse_tof(at, &TofData { distance, valid: true, ..TofData::default() });
        }
        if let Some(rate) = self.slips.filter(|_| self.steps.is_multiple_of(4)) {
            let flow =
                FlowData { delta_x: 0.01 * rate, delta_y: 2e-5 * dither, interval: 0.01, quality: 100, valid: true };
            _ = self.eskf.fuse_flow(at, &flow);
        }
        if self.steps.is_multiple_of(8) {
            let altitude = 100.0 + self.height + self.pressure + 0.05 * dither;
            _ = self.eskf.fuse_baro(at, &BaroData { altitude, ..BaroData::default() });
        }
    }

    fn climb(&self) -> f32 {
        -self.eskf.estimate().velocity.z
    }
}

#[test]
fn the_pressure_of_starting_propellers_is_no_motion() {
    let mut rig = Rig::standing(EskfConfig::default());
    rig.range = false;
    rig.leave_the_ground();
    // A StampFly reads 0.6 m lower near the floor.
    rig.pressure = -0.6;
    for _ in 0..20 {
        rig.fly(0.05);
        assert!(rig.climb().abs() < 0.05, "{} m/s", rig.climb());
    }
    // And 0.2 m lower above it; the vehicle has not moved.
    for _ in 0..20 {
        rig.pressure += 0.02;
        rig.fly(0.05);
        assert!(rig.climb().abs() < 0.2, "{} m/s", rig.climb());
    }
}

#[test]
fn without_a_range_the_barometer_finds_the_zero_that_thrust_has_moved() {
    let mut rig = Rig::standing(EskfConfig::default());
    rig.leave_the_ground();
    rig.height = 1.0;
    rig.fly(6.0);
    rig.range = false;
    rig.fly(1.0);
    rig.zero = 1.0;
    rig.fly(3.0);
    assert!(rig.climb().abs() < 0.2, "{} m/s", rig.climb());
}

#[test]
fn a_picture_that_slips_below_a_leaning_camera_is_no_climb() {
    let leaning = |slips: f32| {
        let mut rig = Rig::standing(EskfConfig::default());
        rig.attitude = Quat::from_euler_angles(0.0, 0.15, 0.0);
        rig.clearance = 0.3;
        rig.slips = Some(0.0);
        rig.fly(2.0);
        rig.range = false;
        rig.leave_the_ground();
        rig.slips = Some(slips);
        core::array::from_fn::<f32, 4, _>(|_| {
            rig.fly(0.05);
            rig.climb()
        })
    };
    for (slips, still) in leaning(0.5).into_iter().zip(leaning(0.0)) {
        assert!((slips - still).abs() < 0.005, "{slips} m/s, {still} m/s where it does not");
    }
}
