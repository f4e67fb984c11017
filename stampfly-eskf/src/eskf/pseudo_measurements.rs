//! Pseudo-measurements: updates and resets without a sensor of position or velocity.
//!
//! | pseudo-measurement | active while | stops | gated |
//! |---|---|---|---|
//! | [`constrain_stationary`](Eskf::constrain_stationary): velocity zero, position where it stood | commanded `on_ground`, every fourth sample | take-off; an origin reset moves the position to zero | no |
//! | [`update_gravity`](Eskf::update_gravity): gravity as the vertical | stationary; with [`GravityUse::WhenUnaided`] while nothing holds the velocity, drag included; with [`GravityUse::Always`] all samples in flight, by their mean over a step of the covariance | the other cases | yes, reset in `aid/gravity.rs` |
//! | [`update_drag`](Eskf::update_drag): the velocity that the body's drag shows | flying with a known `drag` and nothing that holds the velocity, instead of gravity | the other cases | no |
//! | [`constrain_heading`](Eskf::constrain_heading): heading zero | once, at initialisation | | no |
//! | [`reset_unobserved_motion`](Eskf::reset_unobserved_motion): velocity to zero at the largest deviation | nothing holds the velocity | flow, velocity or position within the last second, or on the ground | no |
//! | [`constrain_unobserved_velocity`](Eskf::constrain_unobserved_velocity): velocity near zero | tilt beyond `min_cos_tilt`, flow within the last second, no external velocity or position | the other cases | no |

use super::gate::{GateResult, Sensor};
use super::*;

/// For how long a gust lasts, s (MIL-F-8785C's low-altitude turbulence has a length of some metres at this height).
const GUST: f32 = 2.0;
/// Standard deviation of what else the accelerometer feels along x and y, m/s².
const FELT: f32 = 0.1;
/// Variance of an angle that may be any, rad²: π²/3, and some more.
pub(super) const ANY_ATTITUDE: f32 = 4.0;
/// Standard deviation of the heading where it is defined to be zero, rad.
const HEADING_SIGMA: f32 = 1e-3;

impl Eskf {
    /// Zero-velocity and zero-displacement update (ZUPT) of a stationary vehicle, which makes the accelerometer's bias
    /// observable.
    // On the ground only.
    #[inline(never)]
    pub(super) fn constrain_stationary(&mut self, anchor: Vec3) {
        let sigma = self.config.stationary_velocity_sigma;
        self.constrain(aid::velocity::world(&self.state), [0.0; 3], sigma);
        self.constrain(aid::position::world(&self.state), anchor.into(), self.config.stationary_position_sigma);
    }

    /// Update with gravity as the vertical, for a body whose own acceleration is known.
    pub(super) fn update_gravity(&mut self, accel: Vec3, acceleration: &Vec3, sigma: f32) {
        // The farther from one g, the more it is motion or vibration and the less it is tilt.
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
                // Nothing else corrects the attitude: inflate it, once per lock-out, until gravity passes the gate
                // again.
                self.gates.restart_lockout(Sensor::Gravity, self.now);
                for axis in 0..3 {
                    self.covariance.inflate(ATTITUDE + axis, 0.1);
                    // A wrong tilt turned gravity into velocity, and into accelerometer bias.
                    self.state.velocity[axis] = 0.0;
                    self.covariance.reset(VELOCITY + axis, self.config.unaided_velocity * self.config.unaided_velocity);
                    self.reset_accel_bias(axis);
                }
                Fusion::Gated { ratio }
            }
        };
        _ = self.count(Counter::Gravity, fusion);
    }

    /// Update with the drag of a multirotor in the air, which shows its horizontal velocity, for `dt` seconds.
    pub(super) fn update_drag(&mut self, accel: Vec3, dt: f32) {
        let delayed = self.current_state();
        let rows = aid::drag::specific_force(&delayed.state, &delayed.rotation, self.config.drag);
        // A gust is the same error in many readings: together they count as one for each of its durations.
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

    /// Constrains the heading at initialisation, where it is zero by definition. With a larger variance every error of
    /// the flow sensor would turn it.
    pub(super) fn constrain_heading(&mut self) {
        let [x, y, z] = self.state.rotation()[2];
        let row = Row::new(0.0, [(ATTITUDE, x), (ATTITUDE + 1, y), (ATTITUDE + 2, z)]);
        self.constrain([row], [0.0], HEADING_SIGMA);
    }

    /// Limits the variance of velocity and position, and sets a velocity at its limit to zero. Without a measurement
    /// the velocity is the integral of a small tilt error and soon larger than any that the vehicle can fly; at zero it
    /// waits for the next measurement.
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

    /// Limits the variance of the attitude. A gyro that is shaken beyond its range says nothing, and soon the attitude could be anything;
    /// more than that would only be large beside the other variances, whose digits it takes.
    #[inline]
    pub(super) fn limit_attitude(&mut self) {
        for axis in ATTITUDE..GYRO_BIAS {
            if self.covariance.get(axis, axis) > ANY_ATTITUDE {
                self.covariance.reset(axis, ANY_ATTITUDE);
            }
        }
    }

    /// Constrains the velocity near zero, for `dt` seconds, while the tilt hides the ground from range and flow: the
    /// integral of a tilt error grows by the second. Vehicles that use their velocity do not fly like this; they are
    /// carried so by hand, slowly.
    pub(super) fn constrain_unobserved_velocity(&mut self, dt: f32) {
        let sigma = self.config.unobserved_velocity / math::sqrt(dt.max(1e-3));
        self.constrain(aid::velocity::world(&self.state), [0.0; 3], sigma);
    }
}
