//! Four seconds of a small vehicle's sensors, for ever: what estimators are measured with.
//!
//! The vehicle flies an eight of 0.6 m by 0.2 m, 0.55 to 0.95 m above the floor, and turns its nose a little. Sensors
//! read what they should, with biases and noise of their usual size, stamped as late as they are in flight, so that a
//! filter with its gates on accepts every sample. Path and noise end as they begin: the stream can be repeated without a
//! seam, with time going on.
//!
//! | sensor | when | a step |
//! |---|---|---|
//! | inertial | 400 Hz | 1 |
//! | flow | 100 Hz | 0.25 |
//! | range | 30 Hz | 0.075 |
//! | barometer | 50 Hz | 0.125 |
//! | magnetometer | 25 Hz | 0.0625 |
//!
//! Compiled into the benchmark and into the firmware that counts instructions; needs nothing but our two crates. Not for
//! tests of accuracy: nothing in it is hard.

use stampfly_eskf::{Aiding, EskfConfig, Estimator, Fusion, GravityUse, MagModel, Measurements, feed};
use stampfly_types::messages::{BaroData, CalibrationResult, FlowData, ImuData, MagData, StateEstimate, TofData};
use stampfly_types::{Duration, GRAVITY, Instant, Message, Quat, Stamped, Vec3, math};

/// Steps until the stream repeats: four seconds.
pub const STEPS: usize = 1_600;
/// Length of a step.
const PERIOD: Duration = Duration::from_micros(2_500);
/// When the first step begins. Not zero, so that the first samples can be older than it.
pub const START: Instant = Instant::from_micros(1_000_000);

/// What comes with one inertial sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// The inertial sample.
    pub imu: ImuData,
    /// The range, when there is one.
    pub tof: Option<TofData>,
    /// The flow, when there is one.
    pub flow: Option<FlowData>,
    /// The barometric altitude, when there is one.
    pub baro: Option<BaroData>,
    /// The magnetic field, when there is one.
    pub mag: Option<MagData>,
    /// Where the vehicle really is at the end of the step.
    pub truth: Truth,
}

/// A point of the path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// World NED, m.
    pub position: Vec3,
    /// World NED, m/s.
    pub velocity: Vec3,
    /// Body → world.
    pub attitude: Quat,
    /// The norm of the specific force, m/s²; a multirotor's points along −z of the body.
    force: f32,
}

/// Our filter, in the ways it is measured: a name and a configuration. The first is what the peers are compared with.
/// One line each is all it takes.
#[must_use]
pub fn configurations() -> [(&'static str, EskfConfig); 2] {
    let all_sensors = EskfConfig { mag_enable: true, mag_model: MagModel::Field, ..EskfConfig::default() };
    let gravity = EskfConfig { gravity_use: GravityUse::Always, ..all_sensors };
    [("stampfly-eskf", all_sensors), ("stampfly-eskf, gravity at every step", gravity)]
}

/// What a still-calibration just before the first step would have found.
#[must_use]
pub fn calibration() -> CalibrationResult {
    let to_body = path(0).attitude.inverse();
    CalibrationResult {
        specific_force: to_body * Vec3::new(0.0, 0.0, -GRAVITY),
        field: to_body * FIELD,
        complete: true,
        ..CalibrationResult::default()
    }
}

/// The instant at the end of step `k`.
#[must_use]
pub fn end_of(k: u64) -> Instant {
    START + PERIOD * (k + 1)
}

/// Everything a user does at 400 Hz, for the step that ends at `at`, in the vehicle's order. Returns what became of range,
/// flow, barometer and magnetometer.
#[inline]
pub fn advance(estimator: &mut impl Estimator, at: Instant, step: &Step) -> [Option<Fusion>; 4] {
    let imu = [Stamped { at, generation: 0, data: step.imu }];
    let (tof, flow) = (stamped(at - TOF_AGE, step.tof), stamped(at - FLOW_AGE, step.flow));
    let (mag, baro) = (stamped(at, step.mag), stamped(at - BARO_AGE, step.baro));
    let measurements = Measurements {
        imu: &imu,
        tof: tof.as_slice(),
        flow: flow.as_slice(),
        mag: mag.as_slice(),
        baro: baro.as_slice(),
        pose: &[],
    };
    let mut fusions = [None; 4];
    let [tof, flow, baro, mag] = &mut fusions;
    feed(estimator, &measurements, |aiding, _, fusion| match aiding {
        Aiding::Tof => *tof = Some(fusion),
        Aiding::Flow => *flow = Some(fusion),
        Aiding::Baro => *baro = Some(fusion),
        Aiding::Mag => *mag = Some(fusion),
        _ => {}
    });
    fusions
}

/// A sample as the bus hands it over, if there is one.
fn stamped<M>(at: Instant, data: Option<M>) -> Option<Stamped<M>> {
    data.map(|data| Stamped { at, generation: 0, data })
}

/// One number for all bits of all estimates so far (FNV-1a): start with [`HASH`].
#[must_use]
pub fn hash(before: u64, estimate: &StateEstimate) -> u64 {
    let words = estimate.to_words();
    words.iter().fold(before, |hash, word| (hash ^ u64::from(*word)).wrapping_mul(0x0000_0100_0000_01b3))
}

/// The hash of nothing.
pub const HASH: u64 = 0xcbf2_9ce4_8422_2325;

/// How old a sample is when it comes in. A range is the middle of its integration, a flow sample is stamped when it is
/// read.
const TOF_AGE: Duration = Duration::from_micros(10_000);
const FLOW_AGE: Duration = Duration::from_micros(2_000);
const BARO_AGE: Duration = Duration::from_micros(5_000);
/// From the middle of what a flow sample saw to its coming in, in half steps: half its interval, the sensor's delay of
/// 12 ms, the age of the stamp.
const FLOW_MIDDLE: i32 = 15;

const GYRO_BIAS: Vec3 = Vec3::new(0.002, -0.003, 0.001);
const ACCEL_BIAS: Vec3 = Vec3::new(0.05, -0.03, 0.04);
/// The field of central Europe, µT.
const FIELD: Vec3 = Vec3::new(21.0, 1.2, 43.0);
/// World down coordinate of the floor, m.
const FLOOR: f32 = 0.55;

/// Step `k` of the stream, `k` below [`STEPS`]. Takes some microseconds: prepare them all before measuring.
#[must_use]
pub fn step(k: usize) -> Step {
    let end = 2 * (k as i32 + 1);
    let middle = path(end - 1);
    let truth = path(end);
    let noise = |channel: u32, size: f32| size * noise(k as u32, channel);
    let noise3 =
        |channel: u32, size: f32| Vec3::new(noise(channel, size), noise(channel + 1, size), noise(channel + 2, size));
    let imu = ImuData {
        accel: Vec3::new(0.0, 0.0, -middle.force) + ACCEL_BIAS + noise3(0, 0.3),
        gyro: rate(end - 2, end) + GYRO_BIAS + noise3(3, 0.01),
        temperature: 25.0,
        ..Default::default()
    };
    let distance = |at: &Truth| (FLOOR - at.position.z) / (at.attitude * Vec3::z()).z;
    // Odd steps for the range and the magnetometer, even ones for flow and barometer, which alternate.
    let tof = matches!(k % 40, 1 | 15 | 27).then(|| TofData {
        distance: distance(&path(end - 8)) + noise(6, 0.005),
        sigma: 0.005,
        status: 0,
        valid: true,
    });
    let flow = (k % 4 == 2).then(|| {
        let seen = path(end - FLOW_MIDDLE);
        let velocity = seen.attitude.inverse() * seen.velocity / distance(&seen);
        let turning = rate(end - FLOW_MIDDLE - 4, end - FLOW_MIDDLE + 4);
        FlowData {
            delta_x: 0.01 * (velocity.x + turning.y + noise(7, 0.05)),
            delta_y: 0.01 * (velocity.y - turning.x + noise(8, 0.05)),
            interval: 0.01,
            quality: 120,
            valid: true,
        }
    });
    let baro = k
        .is_multiple_of(8)
        .then(|| BaroData { altitude: 40.0 - path(end - 4).position.z + noise(9, 0.1), ..BaroData::default() });
    let mag = (k % 16 == 3).then(|| MagData { field: truth.attitude.inverse() * FIELD + noise3(10, 0.5) });
    Step { imu, tof, flow, baro, mag, truth }
}

/// The path at a number of half steps: sines, and the attitude that a multirotor needs to fly them.
fn path(half_steps: i32) -> Truth {
    let turn = math::TAU / (2 * STEPS) as f32;
    let omega = turn / (0.5 * PERIOD.seconds());
    let (s1, c1) = math::sin_cos(turn * half_steps as f32);
    let (s2, c2) = (2.0 * s1 * c1, 1.0 - 2.0 * s1 * s1);
    let size = Vec3::new(0.3, 0.1, -0.2);
    // From the rate of each sine: the sideways one is twice as fast.
    let fast = Vec3::new(omega, 2.0 * omega, omega);
    let position = size.component_mul(&Vec3::new(1.0 - c1, 1.0 - c2, 1.0 - c1));
    let velocity = size.component_mul(&fast).component_mul(&Vec3::new(s1, s2, s1));
    let acceleration = size.component_mul(&fast).component_mul(&fast).component_mul(&Vec3::new(c1, c2, c1));
    let thrust = Vec3::new(0.0, 0.0, GRAVITY) - acceleration;
    let force = math::sqrt(thrust.dot(&thrust));
    let down = thrust / force;
    let (sin_yaw, cos_yaw) = math::sin_cos(0.3 * s1);
    let right = down.cross(&Vec3::new(cos_yaw, sin_yaw, 0.0));
    let right = right / math::sqrt(right.dot(&right));
    let forward = right.cross(&down);
    // Near level, so the real part is far from zero.
    let w = 0.5 * math::sqrt(1.0 + forward.x + right.y + down.z);
    let vector = Vec3::new(right.z - down.y, down.x - forward.z, forward.y - right.x) / (4.0 * w);
    let attitude = Quat::new_unchecked(w, vector.x, vector.y, vector.z);
    Truth { position, velocity, attitude, force }
}

/// Mean body rate between two points of the path, rad/s: the turn is so small that its sine is the angle.
fn rate(from: i32, to: i32) -> Vec3 {
    let turn = path(from).attitude.inverse() * path(to).attitude;
    turn.imag() * (2.0 / (0.5 * PERIOD.seconds() * (to - from) as f32))
}

/// Even noise, −1 to 1, the same for the same step and channel.
fn noise(k: u32, channel: u32) -> f32 {
    let mut bits = (k + 1).wrapping_mul(0x9e37_79b9) ^ (channel + 1).wrapping_mul(0x85eb_ca6b);
    for _ in 0..3 {
        bits ^= bits << 13;
        bits ^= bits >> 17;
        bits ^= bits << 5;
    }
    (bits >> 8) as f32 * (2.0 / 16_777_216.0) - 1.0
}
