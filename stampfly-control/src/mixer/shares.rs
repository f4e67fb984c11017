//! Throttle, roll, pitch and yaw to shares of a motor's range, by where the motors are: the mixer of small flight controllers.
//!
//! A row says what a share of roll, pitch and yaw adds to a motor's share: 1 is the motor that acts most. Nothing is known of thrust, so nothing is in
//! newtons, and what does not fit is cut off motor by motor, which bends the torque. Use it where a vehicle flies with gains in shares, as hobby flight controllers do;
//! [`MultirotorMixer`](super::MultirotorMixer) knows forces, and says what it could not do.

use crate::airframe::{Rotor, Spin};
use stampfly_types::messages::MAX_MOTORS;

const fn magnitude(value: f32) -> f32 {
    if value < 0.0 { -value } else { value }
}

/// The rows of these rotors: roll by −y, pitch by x, yaw against the sense in which a propeller turns.
///
/// ```
/// use stampfly_control::Rotor;
/// use stampfly_control::mixer::shares;
/// const ROWS: [[f32; 3]; 4] = shares::rows(Rotor::quadrotor_x_px4(0.1, 0.01));
/// assert_eq!(ROWS[0], [-1.0, 1.0, 1.0], "front right, counter-clockwise");
/// let motors = shares::mix(&ROWS, 0.5, [0.1, 0.0, 0.0]);
/// assert_eq!(motors[..4], [0.4, 0.6, 0.6, 0.4], "the left ones lift: it rolls right");
/// ```
#[must_use]
pub const fn rows<const N: usize>(rotors: [Rotor; N]) -> [[f32; 3]; N] {
    let (mut n, mut x, mut y) = (0, 0.0, 0.0);
    while n < N {
        x = if magnitude(rotors[n].x) > x { magnitude(rotors[n].x) } else { x };
        y = if magnitude(rotors[n].y) > y { magnitude(rotors[n].y) } else { y };
        n += 1;
    }
    let mut rows = [[0.0; 3]; N];
    n = 0;
    while n < N {
        let yaw = match rotors[n].spin {
            Spin::CounterClockwise => 1.0,
            Spin::Clockwise => -1.0,
        };
        rows[n] = [-rotors[n].y / y, rotors[n].x / x, yaw];
        n += 1;
    }
    rows
}

/// The share of each motor, not limited; zero for motors that a frame does not have.
#[must_use]
pub fn mix(rows: &[[f32; 3]], throttle: f32, demand: [f32; 3]) -> [f32; MAX_MOTORS] {
    let mut motors = [0.0; MAX_MOTORS];
    for (motor, row) in motors.iter_mut().zip(rows) {
        *motor = row.iter().zip(demand).fold(throttle, |sum, (share, wanted)| sum + share * wanted);
    }
    motors
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_axis_moves_what_it_should() {
        const ROWS: [[f32; 3]; 4] = rows(Rotor::quadrotor_x_px4(0.2, 0.01));
        let [front_right, rear_left, front_left, rear_right, none @ ..] = mix(&ROWS, 0.5, [0.25, 0.125, 0.0625]);
        assert_eq!([front_right, rear_left, front_left, rear_right], [0.4375, 0.6875, 0.8125, 0.0625]);
        assert_eq!(none, [0.0; 4]);
    }

    #[test]
    fn every_axis_is_balanced_and_reaches_one() {
        fn check<const N: usize>(rotors: [Rotor; N]) {
            let rows = rows(rotors);
            for axis in 0..3 {
                let shares = rows.iter().map(|row| row[axis]);
                assert!(shares.clone().sum::<f32>().abs() < 1e-6, "axis {axis} of {rows:?} lifts");
                assert_eq!(shares.fold(0.0f32, |most, share| most.max(share.abs())), 1.0);
                // And leaves the others alone.
                for other in (0..3).filter(|other| *other != axis) {
                    let both = rows.iter().map(|row| row[axis] * row[other]).sum::<f32>();
                    assert!(both.abs() < 1e-6, "axes {axis} and {other} of {rows:?}");
                }
            }
        }
        check(Rotor::quadrotor_x_px4(0.2, 0.01));
        check(Rotor::quadrotor_h(0.2, 0.01));
        check(Rotor::hexarotor_x(0.2, 0.01));
        check(Rotor::octorotor_x(0.2, 0.01));
    }
}
