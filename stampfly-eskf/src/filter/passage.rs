//! What happened between two instants, as the inertial sensor saw it.
//!
//! Pre-integration (Forster et al., "On-Manifold Preintegration for Real-Time Visual-Inertial Odometry", IEEE TRO
//! 33(1), 2017) in its smallest form: how far the body turned, and what its specific force added to velocity and
//! position. Two things need it. The covariance moves over a few inertial samples at once. And a measurement that is
//! late is compared with the state of its own time: from the present state and the passage since follow the state of
//! then ([`Passage::before`]) and what an error of today means for it ([`Passage::carry`]).
//!
//! With τ its length, s its impulse, r its reach, ΔR its turn and R the attitude at its beginning:
//!
//! | then | from now |
//! |---|---|
//! | attitude | R = R(now)·ΔRᵀ |
//! | velocity | v = v(now) − s − g·τ |
//! | position | p = p(now) − v·τ − r − g·τ²/2 |
//! | δθ | ΔR·(δθ(now) + τ·δb_g) |
//! | δv | δv(now) + \[s\]×·R·δθ + τ·R·δb_a |
//! | δp | δp(now) − τ·δv + \[r\]×·R·δθ + τ²/2·R·δb_a |
//!
//! What is neglected: that a bias acts along the changing, not the first, attitude, and the process noise of the
//! passage itself. Within a tenth of a second both are far below any sensor's noise.

use super::layout::{ACCEL_BIAS, ATTITUDE, GYRO_BIAS, N, POSITION, VELOCITY};
use super::state::{Motion, Nominal, Rotation, multiply, rotate_back, rotation_matrix};
use stampfly_types::{GRAVITY, Vec3};

/// What the inertial sensor saw between two instants. See the [module](self) documentation.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Passage {
    /// Length τ, s. Negative for a look ahead.
    pub duration: f32,
    /// Rotation of the body, as w, x, y, z: attitude at the end = attitude at the beginning ⊗ turn.
    pub turn: [f32; 4],
    /// Integral s of the specific force, world, m/s.
    pub impulse: Vec3,
    /// Integral r of the integral of the specific force, world, m.
    pub reach: Vec3,
}

impl Default for Passage {
    fn default() -> Self {
        Self { duration: 0.0, turn: [1.0, 0.0, 0.0, 0.0], impulse: Vec3::zeros(), reach: Vec3::zeros() }
    }
}

impl Passage {
    /// Goes on by one inertial sample.
    #[inline]
    pub fn extend(&mut self, motion: &Motion) {
        self.reach += (self.impulse + motion.impulse * 0.5) * motion.dt;
        self.impulse += motion.impulse;
        self.turn = multiply(self.turn, motion.turn);
        self.duration += motion.dt;
    }

    /// Puts a stretch of even motion before it: `length` seconds in which the body turned by `turn` and gained
    /// `impulse`.
    #[inline]
    pub(crate) fn prepend(&mut self, length: f32, turn: [f32; 4], impulse: Vec3) {
        self.reach += impulse * (self.duration + 0.5 * length);
        self.impulse += impulse;
        self.turn = multiply(turn, self.turn);
        self.duration += length;
    }

    /// The state at the beginning of a passage that ends in the state `now`.
    #[inline]
    #[must_use]
    pub fn before(&self, now: &Nominal) -> Nominal {
        let [w, x, y, z] = self.turn;
        let tau = self.duration;
        let gravity = Vec3::new(0.0, 0.0, GRAVITY * tau);
        let velocity = now.velocity - self.impulse - gravity;
        Nominal {
            attitude: multiply(now.attitude, [w, -x, -y, -z]),
            velocity,
            position: now.position - velocity * tau - self.reach - gravity * (0.5 * tau),
            ..*now
        }
    }

    /// A Jacobian by the errors at the beginning, as a Jacobian by the errors at the end. `rotation` is the attitude
    /// at the beginning.
    #[inline]
    #[must_use]
    pub fn carry(&self, rotation: &Rotation, jacobian: &[f32; N]) -> [f32; N] {
        let block = |first: usize| Vec3::new(jacobian[first], jacobian[first + 1], jacobian[first + 2]);
        let tau = self.duration;
        let position = block(POSITION);
        let velocity = block(VELOCITY) - position * tau;
        let by_turn = position.cross(&self.reach) + velocity.cross(&self.impulse);
        let attitude = rotate_back(&rotation_matrix(self.turn), &(block(ATTITUDE) + rotate_back(rotation, &by_turn)));
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

    fn flown(samples: &[(f32, f32, f32, f32)]) -> (Nominal, Nominal, Passage) {
        let first = numeric::awkward_state();
        let mut state = first;
        let mut passage = Passage::default();
        for (x, y, z, a) in samples {
            passage.extend(&state.propagate(&Vec3::new(*a, -*a, -9.8 + a), &Vec3::new(*x, *y, *z), 0.0025));
        }
        (first, state, passage)
    }

    proptest! {
        #[test]
        fn the_way_back_ends_where_it_began(
            samples in prop::collection::vec((-4f32..4.0, -4f32..4.0, -4f32..4.0, -5f32..5.0), 1..40),
        ) {
            let (first, last, passage) = flown(&samples);
            let back = passage.before(&last);
            prop_assert!((back.position - first.position).amax() < 1e-5);
            prop_assert!((back.velocity - first.velocity).amax() < 1e-5);
            for (a, b) in back.attitude.iter().zip(first.attitude) {
                prop_assert!((a - b).abs() < 1e-5);
            }
        }

        /// The carried Jacobian is the derivative of "go back, then measure". Biases change what the inertial samples
        /// meant, so they are moved before the flight, not after.
        #[test]
        fn a_carried_jacobian_is_the_derivative(
            samples in prop::collection::vec((-2f32..2.0, -2f32..2.0, -2f32..2.0, -3f32..3.0), 1..40),
        ) {
            let (_, last, passage) = flown(&samples);
            let measure = |state: &Nominal| aid::tof::range(state, &state.rotation(), 0.05);
            let then = passage.before(&last);
            let carried = passage.carry(&then.rotation(), &measure(&then).jacobian);
            for (i, stated) in carried.iter().enumerate().take(GYRO_BIAS) {
                let step = 1e-2;
                let shifted = |sign: f32| {
                    let mut by = [0.0; N];
                    by[i] = sign * step;
                    let mut moved = last;
                    moved.correct(&by);
                    // An error of the attitude now is one of the whole passage: it turns what was gained, too.
                    let mut turned = passage;
                    let rotation = multiply(moved.attitude, conjugate(last.attitude));
                    let rotation = rotation_matrix(rotation);
                    turned.impulse = super::super::state::rotate(&rotation, &passage.impulse);
                    turned.reach = super::super::state::rotate(&rotation, &passage.reach);
                    measure(&turned.before(&moved)).predicted
                };
                let numeric = (shifted(1.0) - shifted(-1.0)) / (2.0 * step);
                prop_assert!((numeric - stated).abs() < 3e-3, "state {i}: numeric {numeric}, stated {stated}");
            }
            // A bias, seen from the end: the samples meant something else all along.
            for i in GYRO_BIAS..N {
                let step = 2e-2;
                let shifted = |sign: f32| {
                    let mut state = numeric::awkward_state();
                    let mut by = [0.0; N];
                    by[i] = sign * step;
                    state.correct(&by);
                    let mut passage = Passage::default();
                    for (x, y, z, a) in &samples {
                        passage.extend(&state.propagate(&Vec3::new(*a, -*a, -9.8 + a), &Vec3::new(*x, *y, *z), 0.0025));
                    }
                    let rotation = rotation_matrix(multiply(last.attitude, conjugate(state.attitude)));
                    passage.impulse = super::super::state::rotate(&rotation, &passage.impulse);
                    passage.reach = super::super::state::rotate(&rotation, &passage.reach);
                    measure(&passage.before(&last)).predicted
                };
                let numeric = (shifted(1.0) - shifted(-1.0)) / (2.0 * step);
                prop_assert!((numeric - carried[i]).abs() < 6e-3, "state {i}: numeric {numeric}, stated {}", carried[i]);
            }
        }
    }

    fn conjugate([w, x, y, z]: [f32; 4]) -> [f32; 4] {
        [w, -x, -y, -z]
    }
}
