//! Calibrations recover the errors put in, and survive impossible samples.
//!
//! `cargo test -p stampfly-eskf --test eskf calibration -- --nocapture` prints their accuracy over
//! seeded vehicles.

mod garbage;
mod inertial;
mod magnetometer;
mod session;
mod temperature;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use stampfly_types::Vec3;
use stampfly_types::messages::ImuData;

/// Noise of one sample, at least that of recorded StampFlys: rad/s, m/s², µT.
const GYRO_NOISE: f32 = 0.002;
const ACCEL_NOISE: f32 = 0.02;
const MAG_NOISE: f32 = 0.5;
/// Number of vehicles.
const CASES: u64 = 100;

struct Random(ChaCha8Rng);

impl Random {
    fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    fn within(&mut self, limit: f32) -> f32 {
        self.0.random_range(-limit..limit)
    }

    fn vector(&mut self, limit: f32) -> Vec3 {
        Vec3::from_fn(|_| self.within(limit))
    }

    fn noise(&mut self, sigma: f32) -> Vec3 {
        Vec3::from_fn(|_| StandardNormal.sample(&mut self.0)) * sigma
    }

    /// A direction, uniformly distributed.
    fn direction(&mut self) -> Vec3 {
        self.noise(1.0).normalize()
    }
}

/// Errors of many vehicles.
#[derive(Default)]
struct Errors(Vec<f32>);

impl Errors {
    /// Prints and returns median and largest.
    fn report(mut self, what: &str, unit: &str) -> (f32, f32) {
        self.0.sort_by(f32::total_cmp);
        let (median, worst) = (self.0[self.0.len() / 2], self.0[self.0.len() - 1]);
        println!("{what:44} median {median:.2e}, worst {worst:.2e} {unit} of {}", self.0.len());
        (median, worst)
    }
}

/// Level, with noise.
fn still(random: &mut Random, gyro: &Vec3, accel: &Vec3, temperature: f32) -> ImuData {
    ImuData {
        gyro: gyro + random.noise(GYRO_NOISE),
        accel: accel + random.noise(ACCEL_NOISE),
        temperature,
        ..Default::default()
    }
}
