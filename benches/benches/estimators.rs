//! One 400 Hz step of a state estimator: ours beside those of the registry.
//!
//! Everybody gets the same stream ([`stream`]): an inertial sample at every step and flow, range, barometer and
//! magnetometer at their rates. Ours is given samples and stamps and does everything a user asks for: gates, late samples,
//! validity, the finished estimate. The peers have no models of these sensors and no gates; what their interface takes
//! instead is prepared for them before the clock runs:
//!
//! | peer | flow | range, barometer | magnetometer |
//! |---|---|---|---|
//! | `eskf`, 18 error states | horizontal velocity | height | attitude |
//! | `kfilter`, 15 states, the model is in [`euler`] | horizontal velocity | height | attitude |
//!
//! The attitude filters are a class of their own, with inertial samples and the magnetometer at its rate. All compute
//! with `f32`, except the low-pass filter inside `vqf-rs`, which is always `f64`.
//!
//! Before anything is measured each contender must follow the path, and ours must accept every sample.
//! `cargo xtask peers` runs this several times and makes a table of the medians.

#[path = "estimators/euler.rs"]
mod euler;

use ahrs::Ahrs as _;
use criterion::{Criterion, criterion_group};
use kfilter::measurement::LinearMeasurement;
use kfilter::{KalmanFilter as _, KalmanPredictInput as _, KalmanUpdate as _};
use nalgebra_025 as na25;
use nalgebra_034 as na34;
use stampfly_benches::acceptance::{MIX, fused_per_step};
use stampfly_benches::stream::{self, Step, Truth};
use stampfly_eskf::attitude::{AttitudeConfig, AttitudeFilter, Mahony};
use stampfly_eskf::{Eskf, Estimator};
use stampfly_types::{Quat, Vec3};
use std::hint::black_box;
use std::time::Duration;

const PERIOD: f32 = 0.0025;

/// Somebody who measures. A trait, so that each contender is measured by code of its own, without a call in between.
trait Measure<Output> {
    /// Measures one step. What it returns goes into a black box.
    fn contender(&mut self, name: &'static str, step: impl FnMut(u64) -> Output);
}

/// Hands the step of every filter for the whole state to `measure`, in turn. A step returns the velocity: the
/// position is nobody's to know without a landmark.
fn filters(steps: &[Step], measure: &mut impl Measure<[f32; 3]>) {
    for (name, configuration) in stream::configurations() {
        let mut filter = Eskf::new(configuration);
        filter.initialize(stream::START, &stream::calibration());
        measure.contender(name, |k| {
            black_box(stream::advance(&mut filter, stream::end_of(k), at(steps, k)));
            black_box(filter.estimate()).velocity.into()
        });
    }

    let inputs: Vec<EskfInput> = steps.iter().map(EskfInput::new).collect();
    let mut filter = eskf::Builder::new()
        .acceleration_variance(0.3)
        .rotation_variance(0.003)
        .acceleration_bias(1e-3)
        .rotation_bias(3e-5)
        .initial_covariance(1e-2)
        .build();
    filter.orientation = na25::UnitQuaternion::from_quaternion(inputs[steps.len() - 1].truth);
    let [flow, range, baro] = [0.0056, 1e-4, 0.09];
    // Its attitude observation has the wrong sign away from zero. A large variance keeps that out of the estimate; the
    // work is the same.
    let attitude = na25::Matrix3::from_diagonal_element(1e4);
    measure.contender("eskf 0.2", |k| {
        let input = at(&inputs, k);
        filter.predict(input.accel, input.gyro, Duration::from_micros(2_500));
        if input.tof {
            filter.observe_height(input.height, range).expect("invertible");
        }
        if input.flow {
            let variance = na25::Matrix2::from_diagonal_element(flow);
            filter.observe_velocity2d(input.velocity, variance).expect("invertible");
        }
        if input.baro {
            filter.observe_height(input.height, baro).expect("invertible");
        }
        if input.mag {
            filter.observe_orientation(input.attitude, attitude).expect("invertible");
        }
        black_box((filter.position, filter.orientation));
        filter.velocity.into()
    });

    let mut filter = euler::filter(&steps[steps.len() - 1].truth);
    let mut velocity = LinearMeasurement::new(euler::rows::<2>(3), na34::SMatrix::identity() * flow, na34::zero());
    let mut range = LinearMeasurement::new(euler::rows::<1>(2), na34::SMatrix::identity() * range, na34::zero());
    let mut baro = LinearMeasurement::new(euler::rows::<1>(2), na34::SMatrix::identity() * baro, na34::zero());
    let mut attitude = LinearMeasurement::new(euler::rows::<3>(6), na34::SMatrix::identity() * 0.01, na34::zero());
    let inputs: Vec<euler::Input> = steps.iter().map(euler::Input::new).collect();
    measure.contender("kfilter 0.5", |k| {
        let input = at(&inputs, k);
        filter.predict(input.imu).expect("never fails");
        if let Some(z) = input.tof {
            range.z = z;
            filter.update(&range).expect("invertible");
        }
        if let Some(z) = input.flow {
            velocity.z = z;
            filter.update(&velocity).expect("invertible");
        }
        if let Some(z) = input.baro {
            baro.z = z;
            filter.update(&baro).expect("invertible");
        }
        if let Some(z) = input.mag {
            attitude.z = z;
            filter.update(&attitude).expect("invertible");
        }
        let state = black_box(filter.state());
        [state[3], state[4], state[5]]
    });
}

/// Hands the step of every attitude filter to `measure`, in turn. A step returns the attitude, w first, from body FLU
/// (x forward, y left, z up) to a world whose z is up.
fn attitudes(steps: &[Step], measure: &mut impl Measure<[f32; 4]>) {
    let inputs: Vec<Upwards> = steps.iter().map(Upwards::new).collect();

    // The first is what the others are compared with.
    let upwards = |q: Quat| {
        let [w, x, y, z] = q.wxyz();
        [w, x, -y, -z]
    };
    let mut filter = AttitudeFilter::from_calibration(AttitudeConfig::default(), &stream::calibration());
    measure.contender("AttitudeFilter", |k| {
        let step = at(steps, k);
        filter.step(&step.imu.accel, &step.imu.gyro, PERIOD);
        if let Some(mag) = &step.mag {
            let _ = black_box(filter.field(&mag.field, 0.0, 16.0 * PERIOD));
        }
        upwards(filter.attitude())
    });

    let mut filter = Mahony::new(0.5);
    measure.contender("Mahony", |k| {
        let step = at(steps, k);
        filter.step(&step.imu.accel, &step.imu.gyro, PERIOD);
        upwards(filter.attitude())
    });

    let vector = |v: [f32; 3]| na34::Vector3::from(v);
    let mut filter = ahrs::Madgwick::new(PERIOD, 0.1f32);
    measure.contender("ahrs 0.8, Madgwick", |k| {
        let Upwards { accel, gyro, mag } = at(&inputs, k);
        let attitude = match mag {
            Some(mag) => filter.update(&vector(*gyro), &vector(*accel), &vector(*mag)),
            None => filter.update_imu(&vector(*gyro), &vector(*accel)),
        };
        let q = attitude.expect("never zero");
        [q.w, q.i, q.j, q.k]
    });

    let mut filter = ahrs::Mahony::new(PERIOD, 0.5f32, 0.0);
    measure.contender("ahrs 0.8, Mahony", |k| {
        let Upwards { accel, gyro, mag } = at(&inputs, k);
        let attitude = match mag {
            Some(mag) => filter.update(&vector(*gyro), &vector(*accel), &vector(*mag)),
            None => filter.update_imu(&vector(*gyro), &vector(*accel)),
        };
        let q = attitude.expect("never zero");
        [q.w, q.i, q.j, q.k]
    });

    let vector = |v: [f32; 3]| fusion_ahrs::Vector::new(v[0], v[1], v[2]);
    let degrees_and_g: Vec<Upwards> = inputs.iter().map(Upwards::in_degrees_and_g).collect();
    let mut filter =
        fusion_ahrs::Ahrs::with_settings(fusion_ahrs::AhrsSettings { sample_rate: 400.0, ..Default::default() });
    measure.contender("fusion-ahrs 1.0", |k| {
        let Upwards { accel, gyro, mag } = at(&degrees_and_g, k);
        match mag {
            Some(mag) => filter.update(vector(*gyro), vector(*accel), vector(*mag)),
            None => filter.update_no_magnetometer(vector(*gyro), vector(*accel)),
        }
        let q = filter.quaternion();
        [q.w, q.x, q.y, q.z]
    });

    let mut filter = vqf_rs::VQF::new(PERIOD, None, Some(16.0 * PERIOD), None);
    measure.contender("vqf-rs 0.3", |k| {
        let Upwards { accel, gyro, mag } = at(&inputs, k);
        filter.update(*gyro, *accel, *mag);
        let vqf_rs::Quaternion(w, x, y, z) = filter.quat_9d();
        [w, x, y, z]
    });
}

/// What belongs to step `k`.
#[inline]
fn at<T>(steps: &[T], k: u64) -> &T {
    &steps[(k % stream::STEPS as u64) as usize]
}

/// A step as the crate `eskf` takes it: its world z and its accelerometer have our signs.
struct EskfInput {
    accel: na25::Vector3<f32>,
    gyro: na25::Vector3<f32>,
    height: f32,
    velocity: na25::Vector2<f32>,
    attitude: na25::UnitQuaternion<f32>,
    truth: na25::Quaternion<f32>,
    tof: bool,
    flow: bool,
    baro: bool,
    mag: bool,
}

impl EskfInput {
    fn new(step: &Step) -> Self {
        let Truth { position, velocity, attitude, .. } = &step.truth;
        let vector = |v: &Vec3| na25::Vector3::new(v.x, v.y, v.z);
        let [w, x, y, z] = attitude.wxyz();
        let truth = na25::Quaternion::new(w, x, y, z);
        Self {
            accel: vector(&step.imu.accel),
            gyro: vector(&step.imu.gyro),
            height: position.z,
            velocity: na25::Vector2::new(velocity.x, velocity.y),
            // It multiplies with the estimate where it means the difference.
            attitude: na25::UnitQuaternion::from_quaternion(truth).inverse(),
            truth,
            tof: step.tof.is_some(),
            flow: step.flow.is_some(),
            baro: step.baro.is_some(),
            mag: step.mag.is_some(),
        }
    }
}

/// A step in the axes most attitude filters expect: x forward, y left, z up.
struct Upwards {
    accel: [f32; 3],
    gyro: [f32; 3],
    mag: Option<[f32; 3]>,
}

impl Upwards {
    fn new(step: &Step) -> Self {
        let turned = |v: &Vec3| [v.x, -v.y, -v.z];
        Self {
            accel: turned(&step.imu.accel),
            gyro: turned(&step.imu.gyro),
            mag: step.mag.map(|mag| turned(&mag.field)),
        }
    }

    fn in_degrees_and_g(&self) -> Self {
        Self {
            accel: self.accel.map(|v| v / stampfly_types::GRAVITY),
            gyro: self.gyro.map(f32::to_degrees),
            mag: self.mag,
        }
    }
}

struct ByCriterion<'a>(criterion::BenchmarkGroup<'a, criterion::measurement::WallTime>);

impl<Output> Measure<Output> for ByCriterion<'_> {
    fn contender(&mut self, name: &'static str, mut step: impl FnMut(u64) -> Output) {
        let mut k = 0;
        self.0.bench_function(name, |b| {
            b.iter(|| {
                let output = step(black_box(k));
                k += 1;
                output
            });
        });
    }
}

fn bench(c: &mut Criterion) {
    let steps = steps();
    let mut group = c.benchmark_group("400 Hz step");
    group.measurement_time(Duration::from_secs(2)).warm_up_time(Duration::from_millis(500));
    filters(&steps, &mut ByCriterion(group));
    let mut group = c.benchmark_group("400 Hz step, attitude only");
    group.measurement_time(Duration::from_secs(2)).warm_up_time(Duration::from_millis(500));
    attitudes(&steps, &mut ByCriterion(group));
}

criterion_group!(benches, bench);

/// Steps of a check.
const CALLS: u64 = 200_000;

fn steps() -> Vec<Step> {
    (0..stream::STEPS).map(stream::step).collect()
}

/// Panics unless every contender does what it is measured for.
struct Following<'a, Output> {
    steps: &'a [Step],
    /// How far an output is from the truth.
    error: fn(&Output, &Truth) -> f32,
    allowed: f32,
}

impl<Output> Measure<Output> for Following<'_, Output> {
    fn contender(&mut self, name: &'static str, mut step: impl FnMut(u64) -> Output) {
        let mut worst = 0.0f32;
        for k in 0..CALLS {
            let error = (self.error)(&step(k), &at(self.steps, k).truth);
            assert!(error <= self.allowed, "{name} is off by {error} at step {k}");
            worst = worst.max(error);
        }
        println!("{name:<20} was off by {worst:.3} at most");
    }
}

fn check(steps: &[Step]) {
    let velocity = |output: &[f32; 3], truth: &Truth| (Vec3::from(*output) - truth.velocity).norm();
    filters(steps, &mut Following { steps, error: velocity, allowed: 0.15 });
    // Without a velocity the acceleration counts as tilt: the attitude filters mean well and cannot know.
    let tilt = |[w, x, y, z]: &[f32; 4], truth: &Truth| {
        let up = Vec3::new(2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y));
        let down = truth.attitude.inverse() * Vec3::z();
        (up - Vec3::new(down.x, -down.y, down.z)).norm()
    };
    attitudes(steps, &mut Following { steps, error: tilt, allowed: 0.3 });

    for (name, configuration) in stream::configurations() {
        assert_eq!(fused_per_step(name, configuration, steps, CALLS), MIX, "{name}");
    }
}

fn main() {
    check(&steps());
    benches();
    Criterion::default().configure_from_args().final_summary();
}
