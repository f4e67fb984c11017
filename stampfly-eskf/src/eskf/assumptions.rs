//! What the filter assumes where nothing measures: standing on the ground, held up by nothing but gravity, out of sight
//! of everything.

use super::gate::{Sensor, Verdict};
use super::*;

/// Doubt beyond which a velocity and a position count as unknown, m/s and m.
const UNKNOWN_VELOCITY: f32 = 3.0;
const UNKNOWN_POSITION: f32 = 10.0;
/// How well the heading is known where it is defined to be zero, rad.
const HEADING_SIGMA: f32 = 1e-3;

impl Eskf {
    /// While standing: velocity and position are known, so the accelerometer shows its bias.
    pub(super) fn absorb_standing(&mut self, anchor: Vec3) {
        let sigma = self.config.still_velocity_sigma;
        self.know(aid::velocity::world(&self.state), [0.0; 3], sigma);
        self.know(aid::position::world(&self.state), anchor.into(), self.config.still_position_sigma);
    }

    /// Gravity as the vertical, for a body whose own acceleration is known.
    pub(super) fn absorb_gravity(&mut self, accel: Vec3, acceleration: &Vec3, sigma: f32) {
        // The farther from one g, the more it is motion or vibration and the less it is tilt.
        let excess = accel.norm() - (acceleration - Vec3::new(0.0, 0.0, GRAVITY)).norm();
        let variance = sigma * sigma + 10.0 * excess * excess;
        let then = self.present();
        let rows = aid::gravity::specific_force(&then.state, &then.rotation, acceleration);
        let projection = self.compare(&then, rows, accel.into(), [variance; 3]);
        let ratio = self.ratio(&projection);
        self.gravity = [accel, Vec3::new(rows[0].predicted, rows[1].predicted, rows[2].predicted)];
        self.status.accel_ratio = ratio;
        let fusion = match self.gates.judge(Sensor::Gravity, self.now, ratio, 4.0 * self.config.lockout) {
            Verdict::Fuse => self.absorb(&projection, ratio),
            Verdict::Leave => Fusion::Gated { ratio },
            Verdict::Believe => {
                // It never rights itself otherwise: doubt the attitude, once per lock-out, until gravity fits in again.
                self.gates.wait(Sensor::Gravity, self.now);
                for axis in 0..3 {
                    self.covariance.inflate(ATTITUDE + axis, 0.1);
                    // Gravity turned into motion by a wrong tilt, and what was learned from that.
                    self.state.velocity[axis] = 0.0;
                    self.covariance.reset(VELOCITY + axis, UNKNOWN_VELOCITY * UNKNOWN_VELOCITY);
                    self.forget_accel_bias(axis);
                }
                Fusion::Gated { ratio }
            }
        };
        self.count(Counter::Gravity, fusion);
    }

    /// Takes the accelerometer for as good as when it was started.
    pub(super) fn forget_accel_bias(&mut self, axis: usize) {
        self.state.accel_bias[axis] = 0.0;
        self.covariance.reset(ACCEL_BIAS + axis, self.config.initial_accel_bias * self.config.initial_accel_bias);
    }

    /// Heading counts from where the vehicle was initialised, so it is known there. Doubting it would let every error of
    /// the flow sensor turn the vehicle's idea of north.
    pub(super) fn know_heading(&mut self) {
        let [x, y, z] = self.state.rotation()[2];
        let row = Row::new(0.0, [(ATTITUDE, x), (ATTITUDE + 1, y), (ATTITUDE + 2, z)]);
        self.know([row], [0.0], HEADING_SIGMA);
    }

    /// Without anything that measures it, a velocity is the integral of a small error of the tilt and soon larger than
    /// any that the vehicle can fly. From there on it is not estimated: it stays at zero, and the position where it is,
    /// until somebody measures it again.
    pub(super) fn forget_motion(&mut self) {
        const LIMITS: [(usize, f32); 2] = [(VELOCITY, UNKNOWN_VELOCITY), (POSITION, UNKNOWN_POSITION)];
        for (block, limit) in LIMITS {
            for axis in 0..3 {
                if self.covariance.get(block + axis, block + axis) > limit * limit {
                    self.covariance.reset(block + axis, limit * limit);
                    if block == VELOCITY {
                        self.state.velocity[axis] = 0.0;
                    }
                }
            }
        }
    }

    /// Tilted out of sight of the ground, for `dt` seconds: nothing measures the velocity, and the integral of a tilt
    /// error grows by the second. Vehicles that use their velocity do not fly like this; hands carry them so, slowly.
    pub(super) fn absorb_blind(&mut self, dt: f32) {
        let sigma = self.config.blind_velocity / math::sqrt(dt.max(1e-3));
        self.know(aid::velocity::world(&self.state), [0.0; 3], sigma);
    }
}
