//! Pseudo-measurements: updates and resets without a sensor of position or velocity.
//!
//! - [`constrain_stationary`](Eskf::constrain_stationary): velocity zero, position where it stood.
//!   While commanded `on_ground`, every fourth sample, until take-off. An origin reset moves the
//!   position to zero. No gate.
//! - [`update_gravity`](Eskf::update_gravity): gravity as the vertical. While stationary; with
//!   [`GravityUse::WhenUnaided`] while the velocity is not measured, drag included; with
//!   [`GravityUse::Always`] all samples in flight, as their mean over a covariance step. Gated; its
//!   reset is described in `aid/gravity.rs`.
//! - [`update_drag`](Eskf::update_drag): velocity from drag. In flight with a known `drag` while
//!   the velocity is not measured, instead of gravity. No gate.
//! - [`constrain_heading`](Eskf::constrain_heading): heading zero. Once, at initialisation. No
//!   gate.
//! - [`reset_unobserved_motion`](Eskf::reset_unobserved_motion): velocity to zero at its largest
//!   standard deviation. While the velocity is not measured and the vehicle is not on the ground.
//!   No gate.
//! - [`constrain_unobserved_velocity`](Eskf::constrain_unobserved_velocity): velocity near zero.
//!   While the tilt is beyond `min_cos_tilt`, flow was accepted within the last second, and no
//!   external velocity or position is. No gate.

use super::gate::{GateResult, Sensor};
use super::*;

/// Duration of a gust, s. (The low-altitude turbulence of MIL-F-8785C has a length of some metres
/// at this height.)
const GUST: f32 = 2.0;
/// Standard deviation of the other accelerations along body x and y, m/s².
const FELT: f32 = 0.1;
/// Variance of an unknown angle, rad²: π²/3, with a margin.
pub(super) const ANY_ATTITUDE: f32 = 4.0;
/// Standard deviation of the heading where it is defined to be zero, rad.
const HEADING_SIGMA: f32 = 1e-3;

impl Eskf {
    /// Zero-velocity and zero-displacement update (ZUPT) of a stationary vehicle. It makes the
    /// accelerometer bias observable.
    #[inline(never)]
    pub(super) fn constrain_stationary(&mut self, anchor: Vec3) {
        let sigma = self.config.stationary_velocity_sigma;
        self.constrain(aid::velocity::world(&self.state), [0.0; 3], sigma);
        self.constrain(aid::position::world(&self.state), anchor.into(), self.config.stationary_position_sigma);
    }

    /// Update with gravity as the vertical, for a body whose acceleration (world, m/s²) is known.
    pub(super) fn update_gravity(&mut self, accel: Vec3, acceleration: &Vec3, sigma: f32) {
        // The farther the force is from the expected length, the more it is motion or vibration
        // instead of tilt.
        let excess = accel.norm() - (acceleration - Vec3::new(0.0, 0.0, GRAVITY)).norm();
        let variance = sigma * sigma + 10.0 * excess * excess;
        let delayed = self.current_state();
        let rows = aid::gravity::specific_force(&delayed.state, &delayed.rotation, acceleration);
        let innovation = self.innovation(&delayed, rows, accel.into(), [variance; 3]);
        let ratio = self.test_ratio(&innovation);
        let predicted = Vec3::new(rows[0].predicted, rows[1].predicted, rows[2].predicted);
        self.status.accel_innovation = math::atan2(accel.cross(&predicted).norm(), accel.dot(&predicted));
        self.status.accel_ratio = ratio;
        let fusion = match self.gates.test(
            Sensor::Gravity,
            self.now,
            ratio,
            4.0 * self.config.lockout,
            self.config.lockout_samples,
        ) {
            GateResult::Fuse => self.update(&innovation, ratio),
            GateResult::Reject => Fusion::Gated { ratio },
            GateResult::Reset => {
                // No other sensor corrects the attitude here. Inflate it, once per lock-out, until
                // gravity passes the gate.
                self.gates.restart_lockout(Sensor::Gravity, self.now);
                for axis in 0..3 {
                    self.covariance.inflate(ATTITUDE + axis, 0.1);
                    // The wrong tilt turned gravity into velocity and accelerometer bias.
                    self.state.velocity[axis] = 0.0;
                    self.covariance.reset(VELOCITY + axis, self.config.unaided_velocity * self.config.unaided_velocity);
                    self.reset_accel_bias(axis);
                }
                Fusion::Gated { ratio }
            }
        };
        _ = self.count(Counter::Gravity, fusion);
    }

    /// Update with the drag of a multirotor in flight, over `dt` seconds. It measures the
    /// horizontal velocity.
    pub(super) fn update_drag(&mut self, accel: Vec3, dt: f32) {
        let delayed = self.current_state();
        let rows = aid::drag::specific_force(&delayed.state, &delayed.rotation, self.config.drag);
        // A gust is a common error of many samples: weigh them so that they count as one per gust.
        let wind = self.config.drag * self.config.wind;
        let variance = (wind * wind + FELT * FELT) * (2.0 * GUST / dt.max(1e-3));
        let innovation = self.innovation(&delayed, rows, [accel.x, accel.y], [variance; 2]);
        let ratio = self.test_ratio(&innovation);
        _ = self.update(&innovation, ratio);
    }

    /// Resets the accelerometer's bias along one axis to its initial value and variance.
    pub(super) fn reset_accel_bias(&mut self, axis: usize) {
        self.state.accel_bias[axis] = 0.0;
        self.covariance.reset(ACCEL_BIAS + axis, self.config.initial_accel_bias * self.config.initial_accel_bias);
    }

    /// Constrains the heading at initialisation, where it is zero by definition. With a larger
    /// variance, errors of the flow sensor would rotate it.
    pub(super) fn constrain_heading(&mut self) {
        let [x, y, z] = self.state.rotation()[2];
        let row = Row::new(0.0, [(ATTITUDE, x), (ATTITUDE + 1, y), (ATTITUDE + 2, z)]);
        self.constrain([row], [0.0], HEADING_SIGMA);
    }

    /// Limits the variances of velocity and position, and sets a velocity at its limit to zero.
    /// Without a measurement the velocity is the integral of a small tilt error and soon exceeds
    /// any that the vehicle can fly. Zero is the better start for the next measurement.
    pub(super) fn reset_unobserved_motion(&mut self) {
        for (block, limit) in [(VELOCITY, self.config.unaided_velocity), (POSITION, self.config.unaided_position)] {
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

    /// Limits the variance of the attitude to that of an unknown angle. A gyro shaken beyond its
    /// range adds variance without limit, and a much larger value would cost the other covariances
    /// their precision in `f32`.
    #[inline]
    pub(super) fn limit_attitude(&mut self) {
        for axis in ATTITUDE..GYRO_BIAS {
            if self.covariance.get(axis, axis) > ANY_ATTITUDE {
                self.covariance.reset(axis, ANY_ATTITUDE);
            }
        }
    }

    /// Constrains the velocity near zero over `dt` seconds, while the tilt hides the ground from
    /// range and flow and the integral of the tilt error grows. A vehicle that flies by its
    /// velocity does not tilt that far; one carried by a person does, and moves slowly.
    pub(super) fn constrain_unobserved_velocity(&mut self, dt: f32) {
        let sigma = self.config.unobserved_velocity / math::sqrt(dt.max(1e-3));
        self.constrain(aid::velocity::world(&self.state), [0.0; 3], sigma);
    }
}
