//! What a sensor has done to the state within the last seconds, so that it can be undone.
//!
//! A sensor is convicted some tenths of a second after it began to lie. Until then it has moved velocity, tilt and gyro bias, and
//! the wrong tilt has moved the velocity further. All of it is linear, so it is kept as sums and subtracted. What
//! remains is the integral of the inertial sensors over that time. Not for a sensor that lies for longer before it is found.

use crate::filter::state::{Rotation, rotate, rotate_back};
use crate::filter::{ATTITUDE, GYRO_BIAS, N, VELOCITY};
use stampfly_types::{GRAVITY, Vec3};

/// Sums over so many stretches of time, and how long each is, s: three seconds in all.
const STRETCHES: usize = 12;
const STRETCH: f32 = 0.25;

/// Corrections of one stretch of time, world: velocity, m/s, tilt, rad, and gyro bias, rad/s, north and east.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Sum {
    velocity: [f32; 2],
    tilt: [f32; 2],
    gyro_bias: [f32; 2],
}

/// Corrections of the last seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Influence {
    /// A ring; `newest` is being added to.
    sums: [Sum; STRETCHES],
    newest: usize,
    /// How long the newest stretch has lasted, s.
    elapsed: f32,
}

impl Influence {
    /// Remembers a correction of the state, `interval` after the one before. `before` is the attitude until then.
    #[inline]
    pub(super) fn add(&mut self, correction: &[f32; N], before: &Rotation, interval: f32) {
        self.elapsed += interval;
        if self.elapsed > STRETCH {
            // After a pause the older ones are as old as they were believed to be, or older and undone by too little.
            self.elapsed = 0.0;
            self.newest = (self.newest + 1) % STRETCHES;
            self.sums[self.newest % STRETCHES] = Sum::default();
        }
        let world =
            |first: usize| rotate(before, &Vec3::new(correction[first], correction[first + 1], correction[first + 2]));
        let (tilt, gyro_bias) = (world(ATTITUDE), world(GYRO_BIAS));
        let sum = &mut self.sums[self.newest % STRETCHES];
        for axis in 0..2 {
            sum.velocity[axis] += correction[VELOCITY + axis];
            sum.tilt[axis] += tilt[axis];
            sum.gyro_bias[axis] += gyro_bias[axis];
        }
    }

    /// The correction that undoes those of the last `seconds`, for the present attitude.
    pub(super) fn undo(&mut self, now: &Rotation, seconds: f32) -> [f32; N] {
        let ([mut velocity, mut tilt, mut bias], mut age) = ([Vec3::zeros(); 3], 0.5 * self.elapsed);
        let mut next = 0.5 * (self.elapsed + STRETCH);
        for back in 0..STRETCHES {
            if age > seconds {
                break;
            }
            let sum = &self.sums[(self.newest + STRETCHES - back) % STRETCHES];
            // A gyro bias is subtracted from the rate: it turned the body the other way.
            let turn = |axis: usize, age: f32| sum.tilt[axis] - sum.gyro_bias[axis] * age;
            // Tilt that is turned by w changes the acceleration by w times gravity, a quarter turn about the vertical on.
            velocity.x += sum.velocity[0] - GRAVITY * turn(1, 0.5 * age) * age;
            velocity.y += sum.velocity[1] + GRAVITY * turn(0, 0.5 * age) * age;
            for axis in 0..2 {
                tilt[axis] += turn(axis, age);
                bias[axis] += sum.gyro_bias[axis];
            }
            age += next;
            next = STRETCH;
        }
        *self = Self::default();
        let mut correction = [0.0; N];
        for (first, world) in [(ATTITUDE, tilt), (GYRO_BIAS, bias)] {
            let body = rotate_back(now, &world);
            for (place, turn) in correction.iter_mut().skip(first).zip([-body.x, -body.y, -body.z]) {
                *place = turn;
            }
        }
        correction[VELOCITY..VELOCITY + 2].copy_from_slice(&[-velocity.x, -velocity.y]);
        correction
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::NominalState;

    const DT: f32 = 0.01;

    /// Hovers for this long; a lie corrects tilt, bias and velocity at every step from the beginning. So much of it is undone, s.
    fn lied_to(seconds: f32, correction: &[f32; N], undone: f32) -> NominalState {
        let (mut state, mut influence) = (NominalState::default(), Influence::default());
        for _ in 0..(seconds / DT) as u32 {
            state.propagate(&Vec3::new(0.0, 0.0, -GRAVITY), &Vec3::zeros(), DT);
            influence.add(correction, &state.rotation(), DT);
            state.correct(correction);
        }
        let undo = influence.undo(&state.rotation(), undone);
        state.correct(&undo);
        assert_eq!(influence, Influence::default(), "it is undone once");
        state
    }

    #[test]
    fn a_lie_that_is_undone_leaves_no_trace() {
        for (place, rate) in
            [(VELOCITY, 1.0), (ATTITUDE, 0.2), (ATTITUDE + 1, 0.2), (GYRO_BIAS, 0.1), (GYRO_BIAS + 1, -0.1)]
        {
            for (seconds, share) in [(0.9, 1.0), (2.6, 0.2)] {
                let mut correction = [0.0; N];
                correction[place] = rate * share * DT;
                let state = lied_to(seconds, &correction, seconds);
                assert!(state.velocity.horizontal().norm() < 0.06, "{place}: {:?}", state.velocity);
                assert!(state.gyro_bias.norm() < 1e-5 && 1.0 - state.cos_tilt() < 2e-4, "{place}: {state:?}");
            }
        }
    }

    #[test]
    fn of_a_longer_one_its_last_second_is_undone() {
        let mut correction = [0.0; N];
        correction[VELOCITY] = DT;
        let state = lied_to(3.0, &correction, 1.0);
        assert!((1.7..2.2).contains(&state.velocity.x), "{:?}", state.velocity);
    }
}
