//! A simulated flight with the modelled sensor noise: smooth, endless, with known truth.

use nalgebra::{UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use stampfly_eskf::filter::N;
use stampfly_eskf::{Eskf, Estimator};
use stampfly_types::messages::{BaroData, CalibrationResult, FlowData, ImuData, MagData, TofData};
use stampfly_types::{Duration, GRAVITY, Instant, Vec3};

/// Interval of inertial samples, µs.
pub const STEP: Duration = Duration::from_micros(2_500);
/// Delay of a flow reading's end, and its length, s.
const FLOW_DELAY: f64 = 0.004;
const FLOW_INTERVAL: f64 = 0.01;
/// The earth's field, µT, north and down.
pub const FIELD: Vec3 = Vec3::new(20.0, 0.0, 40.0);

/// Position and motion of the vehicle.
#[derive(Clone, Copy, Debug)]
pub struct Pose {
    pub attitude: UnitQuaternion<f64>,
    pub position: Vector3<f64>,
    pub velocity: Vector3<f64>,
    pub acceleration: Vector3<f64>,
}

/// A path, and the errors of its sensors.
#[derive(Clone, Debug)]
pub struct Flight {
    /// Reading of the clock at the start.
    pub start: Instant,
    /// Additional world velocity, which decays within a second.
    pub extra: Vector3<f64>,
    pub gyro_bias: Vec3,
    pub accel_bias: Vec3,
    noise: ChaCha8Rng,
}

impl Flight {
    pub fn new(start: Instant, seed: u64) -> Self {
        Self {
            start,
            extra: Vector3::zeros(),
            gyro_bias: Vec3::zeros(),
            accel_bias: Vec3::zeros(),
            noise: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    /// The instant `steps` inertial samples after the start.
    pub fn at(&self, steps: u64) -> Instant {
        self.start + STEP * steps
    }

    fn seconds(&self, at: Instant) -> f64 {
        at.as_micros().wrapping_sub(self.start.as_micros()).cast_signed() as f64 * 1e-6
    }

    /// Two metres above the floor, half a metre back and forth, tilting by some degrees, changing
    /// the heading.
    pub fn pose(&self, at: Instant) -> Pose {
        const SWINGS: [(f64, f64, f64); 3] = [(0.5, 0.9, 0.0), (0.4, 1.1, 1.0), (0.1, 0.6, 2.0)];
        const DYING: f64 = 0.3;
        let t = self.seconds(at);
        let swing = |derivative: u8| {
            Vector3::from_fn(|axis, _| {
                let (size, rate, phase) = SWINGS[axis];
                let angle = rate * t + phase;
                match derivative {
                    0 => size * angle.sin(),
                    1 => size * rate * angle.cos(),
                    _ => -size * rate * rate * angle.sin(),
                }
            })
        };
        let left = (-t / DYING).exp();
        let extra = self.extra * (DYING * (1.0 - left));
        let speed = self.extra * left;
        let braking = -speed / DYING;
        let roll = 0.08 * (1.3 * t).sin();
        let pitch = 0.06 * (1.7 * t + 0.5).sin();
        let yaw = 0.8 * (0.25 * t).sin();
        Pose {
            attitude: UnitQuaternion::from_euler_angles(roll, pitch, yaw),
            position: swing(0) + extra - Vector3::new(0.0, 0.0, 2.0),
            velocity: swing(1) + speed,
            acceleration: swing(2) + braking,
        }
    }

    fn rate(&self, from: Instant, to: Instant) -> Vector3<f64> {
        let turn = self.pose(from).attitude.inverse() * self.pose(to).attitude;
        turn.scaled_axis() / to.since(from).seconds_f64()
    }

    fn noise(&mut self, sigma: f32) -> f32 {
        let normal: f32 = StandardNormal.sample(&mut self.noise);
        sigma * normal
    }

    fn noise3(&mut self, sigma: f32) -> Vec3 {
        Vec3::from_fn(|_| self.noise(sigma))
    }

    /// The inertial sample that ends at this instant.
    pub fn imu(&mut self, at: Instant) -> ImuData {
        let before = at - STEP;
        let middle = self.pose(at - Duration::from_micros(STEP.as_micros() / 2));
        let gravity = Vector3::new(0.0, 0.0, f64::from(GRAVITY));
        let force = middle.attitude.inverse() * (middle.acceleration - gravity);
        ImuData {
            accel: narrow(force) + self.accel_bias + self.noise3(0.5),
            gyro: narrow(self.rate(before, at)) + self.gyro_bias + self.noise3(0.01),
            temperature: 25.0,
            ..Default::default()
        }
    }

    pub fn tof(&mut self, at: Instant) -> TofData {
        let pose = self.pose(at);
        let distance = -pose.position.z / (pose.attitude * Vector3::z()).z;
        TofData { distance: distance as f32 + self.noise(0.004), valid: true, ..TofData::default() }
    }

    pub fn flow(&mut self, at: Instant) -> FlowData {
        let ago = |seconds: f64| at - Duration::from_micros((seconds * 1e6) as u64);
        let (begin, end) = (ago(FLOW_DELAY + FLOW_INTERVAL), ago(FLOW_DELAY));
        let middle = self.pose(ago(FLOW_DELAY + 0.5 * FLOW_INTERVAL));
        let velocity = middle.attitude.inverse() * middle.velocity;
        let distance = -middle.position.z / (middle.attitude * Vector3::z()).z;
        let rate = self.rate(begin, end);
        let seen = |v: f64| (v * FLOW_INTERVAL) as f32;
        FlowData {
            delta_x: seen(velocity.x / distance + rate.y) + self.noise(0.001),
            delta_y: seen(velocity.y / distance - rate.x) + self.noise(0.001),
            interval: FLOW_INTERVAL as f32,
            quality: 100,
            valid: true,
        }
    }

    pub fn baro(&mut self, at: Instant) -> BaroData {
        let altitude = 100.0 - self.pose(at).position.z as f32 + self.noise(0.06);
        BaroData { altitude, ..BaroData::default() }
    }

    pub fn mag(&mut self, at: Instant) -> MagData {
        let field = self.pose(at).attitude.inverse() * wide(FIELD);
        MagData { field: narrow(field) + self.noise3(0.5) }
    }

    /// The still calibration in the initial attitude.
    pub fn calibration(&self) -> CalibrationResult {
        let attitude = self.pose(self.start).attitude;
        let level = attitude.inverse() * Vector3::new(0.0, 0.0, -f64::from(GRAVITY));
        let field = attitude.inverse() * wide(FIELD);
        CalibrationResult {
            specific_force: narrow(level),
            field: narrow(field),
            gyro_bias: self.gyro_bias,
            complete: true,
            ..CalibrationResult::default()
        }
    }

    /// Feeds the samples due at this step: all sensors at their rates, on time.
    pub fn feed(&mut self, eskf: &mut Eskf, steps: u64) {
        let at = self.at(steps);
        eskf.predict(at, &self.imu(at));
        if steps.is_multiple_of(13) {
            _ = eskf.fuse_tof(at, &self.tof(at));
        }
        if steps.is_multiple_of(4) {
            _ = eskf.fuse_flow(at, &self.flow(at));
        }
        if steps.is_multiple_of(8) {
            _ = eskf.fuse_baro(at, &self.baro(at));
        }
        if steps.is_multiple_of(16) {
            _ = eskf.fuse_mag(at, &self.mag(at));
        }
    }

    /// Errors of the estimate: tilt (rad), velocity (m/s), height (m).
    pub fn errors(&self, eskf: &Eskf, at: Instant) -> [f64; 3] {
        let (pose, estimate) = (self.pose(at), eskf.estimate());
        let down = wide(estimate.attitude.inverse() * Vec3::z());
        let tilt = down.angle(&(pose.attitude.inverse() * Vector3::z()));
        let body = |velocity: Vector3<f64>, attitude: UnitQuaternion<f64>| attitude.inverse() * velocity;
        let [w, x, y, z] = estimate.attitude.wxyz().map(f64::from);
        let attitude = UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z));
        // In body axes, because only a magnetometer observes the heading.
        let velocity = body(wide(estimate.velocity), attitude) - body(pose.velocity, pose.attitude);
        [tilt, velocity.norm(), (f64::from(estimate.height) + pose.position.z).abs()]
    }
}

fn wide(vector: Vec3) -> Vector3<f64> {
    Vector3::from(vector).cast()
}

fn narrow(vector: Vector3<f64>) -> Vec3 {
    vector.cast::<f32>().into()
}

/// Whether the covariance is finite, exactly symmetric and positive definite, by a Cholesky
/// factorisation in double precision.
pub fn is_sound(eskf: &Eskf) -> bool {
    let p = eskf.covariance();
    let symmetric = (0..N).all(|i| (0..i).all(|j| p.get(i, j).to_bits() == p.get(j, i).to_bits()));
    let dense = nalgebra::SMatrix::<f64, N, N>::from_fn(|i, j| f64::from(p.get(i, j)));
    symmetric && dense.iter().all(|v| v.is_finite()) && dense.cholesky().is_some() && eskf.nominal().is_finite()
}
