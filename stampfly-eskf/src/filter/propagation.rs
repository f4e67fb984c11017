//! Propagation between two instants, from the inertial samples in between.
//!
//! Pre-integration (Forster et al., "On-Manifold Preintegration for Real-Time Visual-Inertial
//! Odometry", IEEE TRO 33(1), 2017) in its smallest form: the rotation of the body, and the
//! integrals of its specific force. It has two uses. The covariance is propagated over several
//! inertial samples at once. And a late measurement is compared with the state at its own time: the
//! present state and the step since then give that state ([`PropagationStep::state_at_start`]) and
//! the Jacobian by the present errors ([`PropagationStep::propagate_jacobians`]).
//!
//! With τ the duration, s `delta_velocity`, r `delta_position`, ΔR `delta_rotation` and R the
//! attitude at the start:
//!
//! | at the start | from the end, "now" |
//! |---|---|
//! | attitude | R = R(now)·ΔRᵀ |
//! | velocity | v = v(now) − s − g·τ |
//! | position | p = p(now) − v·τ − r − g·τ²/2 |
//! | δθ | ΔR·(δθ(now) + τ·δb_g) |
//! | δv | δv(now) + \[s\]×·R·δθ + τ·R·δb_a |
//! | δp | δp(now) − τ·δv + \[r\]×·R·δθ + τ²/2·R·δb_a |
//!
//! Neglected: a bias acts along the changing attitude, not the first one, and the process noise of
//! the step. Within a tenth of a second both are far below any sensor's noise.

use super::layout::{ACCEL_BIAS, ATTITUDE, GYRO_BIAS, N, POSITION, VELOCITY};
use super::state::{Motion, NominalState, Rotation, conjugate, multiply, rotate_back, rotation_matrix};
use stampfly_types::{GRAVITY, Vec3};

/// Pre-integrated inertial samples between two instants. See the [module](self) documentation.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PropagationStep {
    /// Duration τ, s. Negative for an extrapolation.
    pub duration: f32,
    /// Rotation of the body, as w, x, y, z: attitude at the end = attitude at the start ⊗
    /// delta_rotation.
    pub delta_rotation: [f32; 4],
    /// Integral s of the specific force, world, m/s: the velocity change without gravity.
    pub delta_velocity: Vec3,
    /// Double integral r, world, m: the position change without the initial velocity and gravity.
    pub delta_position: Vec3,
}

impl Default for PropagationStep {
    fn default() -> Self {
        Self {
            duration: 0.0,
            delta_rotation: [1.0, 0.0, 0.0, 0.0],
            delta_velocity: Vec3::zeros(),
            delta_position: Vec3::zeros(),
        }
    }
}

impl PropagationStep {
    /// Appends one inertial sample.
    #[inline]
    pub fn extend(&mut self, motion: &Motion) {
        self.delta_position += (self.delta_velocity + motion.delta_velocity * 0.5) * motion.dt;
        self.delta_velocity += motion.delta_velocity;
        // Saves a product: the first rotation is the whole one.
        self.delta_rotation = if self.duration == 0.0 {
            motion.delta_rotation
        } else {
            multiply(self.delta_rotation, motion.delta_rotation)
        };
        self.duration += motion.dt;
    }

    /// Prepends an interval of constant force: `length` seconds with a velocity change of
    /// `delta_velocity`. The caller sets the rotation.
    #[inline]
    pub(crate) fn prepend(&mut self, length: f32, delta_velocity: Vec3) {
        self.delta_position += delta_velocity * (self.duration + 0.5 * length);
        self.delta_velocity += delta_velocity;
        self.duration += length;
    }

    /// The state at the start of a step that ends in the state `now`.
    #[inline]
    #[must_use]
    pub fn state_at_start(&self, now: &NominalState) -> NominalState {
        let tau = self.duration;
        let gravity = Vec3::new(0.0, 0.0, GRAVITY * tau);
        let velocity = now.velocity - self.delta_velocity - gravity;
        NominalState {
            attitude: multiply(now.attitude, conjugate(self.delta_rotation)),
            velocity,
            position: now.position - velocity * tau - self.delta_position - gravity * (0.5 * tau),
            ..*now
        }
    }

    /// Converts Jacobians by the errors at the start into Jacobians by the errors at the end.
    /// `rotation` is the attitude at the start.
    #[inline(always)]
    pub fn propagate_jacobians(&self, rotation: &Rotation, jacobians: &mut [[f32; N]]) {
        let turn = rotation_matrix(self.delta_rotation);
        for jacobian in jacobians {
            *jacobian = self.propagated(&turn, rotation, jacobian);
        }
    }

    #[inline(always)]
    fn propagated(&self, turn: &Rotation, rotation: &Rotation, jacobian: &[f32; N]) -> [f32; N] {
        let block = |first: usize| Vec3::new(jacobian[first], jacobian[first + 1], jacobian[first + 2]);
        let tau = self.duration;
        let position = block(POSITION);
        let velocity = block(VELOCITY) - position * tau;
        let by_turn = position.cross(&self.delta_position) + velocity.cross(&self.delta_velocity);
        let attitude = rotate_back(turn, &(block(ATTITUDE) + rotate_back(rotation, &by_turn)));
        let gyro_bias = block(GYRO_BIAS) + attitude * tau;
        let pushed = velocity * tau + position * (0.5 * tau * tau);
        let accel_bias = block(ACCEL_BIAS) + rotate_back(rotation, &pushed);
        let [p, v, a, g, b] = [position, velocity, attitude, gyro_bias, accel_bias];
        [p.x, p.y, p.z, v.x, v.y, v.z, a.x, a.y, a.z, g.x, g.y, g.z, b.x, b.y, b.z]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aid::{self, numeric};
    use proptest::prelude::*;

    fn propagated(samples: &[(f32, f32, f32, f32)]) -> (NominalState, NominalState, PropagationStep) {
        let first = numeric::awkward_state();
        let mut state = first;
        let mut step = PropagationStep::default();
        for (x, y, z, a) in samples {
            step.extend(&state.propagate(&Vec3::new(*a, -*a, -9.8 + a), &Vec3::new(*x, *y, *z), 0.0025));
        }
        (first, state, step)
    }

    proptest! {
        #[test]
        fn state_at_start_inverts_the_propagation(
            samples in prop::collection::vec((-4f32..4.0, -4f32..4.0, -4f32..4.0, -5f32..5.0), 1..40),
        ) {
            let (first, last, step) = propagated(&samples);
            let back = step.state_at_start(&last);
            prop_assert!((back.position - first.position).amax() < 1e-5);
            prop_assert!((back.velocity - first.velocity).amax() < 1e-5);
            for (a, b) in back.attitude.iter().zip(first.attitude) {
                prop_assert!((a - b).abs() < 1e-5);
            }
        }

        /// The propagated Jacobian is the derivative of "go back, then measure". Biases affect the
        /// inertial samples, so they are changed before the flight, not after it.
        #[test]
        fn propagated_jacobian_matches_numerical_differentiation(
            samples in prop::collection::vec((-2f32..2.0, -2f32..2.0, -2f32..2.0, -3f32..3.0), 1..40),
        ) {
            let (_, last, step) = propagated(&samples);
            let measure = |state: &NominalState| aid::tof::range(state, &state.rotation(), 0.05);
            let start = step.state_at_start(&last);
            let mut propagated = [measure(&start).jacobian];
            step.propagate_jacobians(&start.rotation(), &mut propagated);
            let [propagated] = propagated;
            for (i, stated) in propagated.iter().enumerate().take(GYRO_BIAS) {
                let delta = 1e-2;
                let shifted = |sign: f32| {
                    let mut by = [0.0; N];
                    by[i] = sign * delta;
                    let mut moved = last;
                    moved.correct(&by);
                    // An attitude error at the end rotates the whole step, including its velocity
                    // change.
                    let mut turned = step;
                    let rotation = multiply(moved.attitude, conjugate(last.attitude));
                    let rotation = rotation_matrix(rotation);
                    turned.delta_velocity = super::super::state::rotate(&rotation, &step.delta_velocity);
                    turned.delta_position = super::super::state::rotate(&rotation, &step.delta_position);
                    measure(&turned.state_at_start(&moved)).predicted
                };
                let numeric = (shifted(1.0) - shifted(-1.0)) / (2.0 * delta);
                prop_assert!((numeric - stated).abs() < 3e-3, "state {i}: numeric {numeric}, stated {stated}");
            }
            // A bias affects every sample, so it is applied from the start.
            for i in GYRO_BIAS..N {
                let delta = 2e-2;
                let shifted = |sign: f32| {
                    let mut state = numeric::awkward_state();
                    let mut by = [0.0; N];
                    by[i] = sign * delta;
                    state.correct(&by);
                    let mut step = PropagationStep::default();
                    for (x, y, z, a) in &samples {
                        step.extend(&state.propagate(&Vec3::new(*a, -*a, -9.8 + a), &Vec3::new(*x, *y, *z), 0.0025));
                    }
                    let rotation = rotation_matrix(multiply(last.attitude, conjugate(state.attitude)));
                    step.delta_velocity = super::super::state::rotate(&rotation, &step.delta_velocity);
                    step.delta_position = super::super::state::rotate(&rotation, &step.delta_position);
                    measure(&step.state_at_start(&last)).predicted
                };
                let numeric = (shifted(1.0) - shifted(-1.0)) / (2.0 * delta);
                prop_assert!((numeric - propagated[i]).abs() < 6e-3, "state {i}: numeric {numeric}, stated {}", propagated[i]);
            }
        }
    }
}
