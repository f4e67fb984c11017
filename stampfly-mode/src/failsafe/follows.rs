//! Do the measured rates follow the commanded torques?
//!
//! Torque over inertia, through the lag of the motors, is the angular acceleration that the
//! controller makes. The torque is what the motors were told to make: what was unmet turns nothing.
//! What it adds to the rate within [`CHANGE`] is compared with what the gyro says, both less their
//! mean over [`MEAN`], since a load that lies askew asks for torque all the time. The share of the
//! one in the other, by least squares over [`OVER`], is one; inertia and thrust of a specimen make
//! 0.6 to 1.4 of it. Where it is less than a third, the rates are not those of the body, or the
//! body does not answer to its motors, and nothing keeps it level.
//!
//! It is asked only where the torque makes more than noise and vibration do. Not for a judgement of
//! its own: torque that holds off a gust, or pushes against a hand or the ground, makes no rate
//! either.

use super::config::FailsafeConfig;
use stampfly_types::messages::ImuData;
use stampfly_types::{Instant, Vec3, math};

/// Time constants of changes, of their mean, and of the sums, s.
const CHANGE: f32 = 0.1;
const MEAN: f32 = 0.5;
const OVER: f32 = 0.3;
/// Change of the rate that the torque has to make in the root mean square, rad/s: ten times what
/// vibration makes of the torque.
const ASKED: f32 = 1.0;
/// Share of it that has to be measured.
const FOLLOWS: f32 = 0.3;
/// A step that is longer counts as this long, s.
const LONGEST_STEP: f32 = 0.01;

/// What is remembered of torques and rates about roll and pitch.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct FollowsMonitor {
    last: Option<Instant>,
    axes: [Axis; 2],
    /// Means of the square of what the torque makes, and of its product with what is measured,
    /// (rad/s)².
    asked: f32,
    answered: f32,
}

/// One axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Axis {
    /// Torque as the motors make it, N·m, and the last rate, rad/s.
    torque: f32,
    rate: f32,
    /// Changes of the rate within [`CHANGE`], made and measured, and their means, rad/s.
    changes: [f32; 2],
    means: [f32; 2],
}

impl FollowsMonitor {
    /// Takes a sample beside the torque that the motors were told to make, N·m. Do the rates
    /// follow?
    pub(super) fn step(&mut self, config: &FailsafeConfig, at: Instant, imu: &ImuData, torque: Vec3) -> bool {
        let dt = self.last.replace(at).map_or(0.0, |last| math::smaller(at.since(last).seconds(), LONGEST_STEP));
        let (torque, inertia) = (torque.to_array(), config.inertia.to_array());
        let lag = dt / (config.motor_lag + dt);
        let (kept, mean) = (CHANGE / (CHANGE + dt), dt / (MEAN + dt));
        let [mut square, mut product] = [0.0; 2];
        for (place, (axis, rate)) in self.axes.iter_mut().zip(imu.gyro.to_array()).enumerate() {
            axis.torque += (torque[place] - axis.torque) * lag;
            let last = core::mem::replace(&mut axis.rate, rate);
            let turned = [axis.torque / inertia[place] * dt, if dt > 0.0 { rate - last } else { 0.0 }];
            let [made, measured] = axis.change(turned, kept, mean);
            square += made * made;
            product += made * measured;
        }
        let share = dt / (OVER + dt);
        self.asked += (square - self.asked) * share;
        self.answered += (product - self.answered) * share;
        self.asked < ASKED * ASKED || self.answered > FOLLOWS * self.asked
    }
}

impl Axis {
    /// The changes of the rate, less their means: what the torque makes, and what is measured.
    /// `turned`: of both since the last step. So much of a change is kept, and so much of it goes
    /// into its mean.
    fn change(&mut self, turned: [f32; 2], kept: f32, mean: f32) -> [f32; 2] {
        for (place, turned) in turned.into_iter().enumerate() {
            self.changes[place] = (self.changes[place] + turned) * kept;
            self.means[place] += (self.changes[place] - self.means[place]) * mean;
        }
        core::array::from_fn(|place| self.changes[place] - self.means[place])
    }
}
