//! What each rotor adds to thrust, roll, pitch and yaw, and the inverse of it.
//!
//! All of it is `const`: it runs when a mixer is made, never in flight.

use stampfly_types::messages::MAX_MOTORS;

use crate::airframe::Rotor;

/// Why an airframe cannot be flown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum GeometryError {
    /// Fewer than four rotors, or more than [`MAX_MOTORS`].
    Count,
    /// Some combination of thrust, roll, pitch and yaw cannot be produced, or a number is not finite.
    Uncontrollable,
    /// Equal thrust on all rotors would tip it over: some rotor has no positive share in collective thrust.
    Unbalanced,
}

impl core::fmt::Display for GeometryError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Count => "between four and eight rotors are needed",
            Self::Uncontrollable => "the rotors cannot produce every torque",
            Self::Unbalanced => "every rotor must share in collective thrust",
        })
    }
}

impl core::error::Error for GeometryError {}

/// Each rotor's share of each demand, one demand after the other: what is done to all rotors alike reads them side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Shares {
    pub thrust: [f32; MAX_MOTORS],
    /// One over `thrust`.
    pub collective: [f32; MAX_MOTORS],
    pub roll: [f32; MAX_MOTORS],
    pub pitch: [f32; MAX_MOTORS],
    pub yaw: [f32; MAX_MOTORS],
}

impl Shares {
    /// The shares of four to [`MAX_MOTORS`] rotors; zero beyond them.
    pub const fn of(rotors: &[Rotor]) -> Result<Self, GeometryError> {
        if rotors.len() < 4 || rotors.len() > MAX_MOTORS {
            return Err(GeometryError::Count);
        }
        // Torque in units of the airframe's own size, or the inverse of a small vehicle drowns in rounding.
        let (mut arm, mut drag) = (0.0f32, 0.0f32);
        let mut n = 0;
        while n < rotors.len() {
            arm = arm.max(rotors[n].x.abs()).max(rotors[n].y.abs());
            drag = drag.max(rotors[n].kappa.abs());
            n += 1;
        }
        // Without an arm or drag, or with one that is not finite, a column holds no numbers, and has no inverse.
        let Some(inverse) = inverse(gram(rotors, arm, drag)) else { return Err(GeometryError::Uncontrollable) };
        let none = [0.0; MAX_MOTORS];
        let mut shares = Self { thrust: none, collective: none, roll: none, pitch: none, yaw: none };
        let mut n = 0;
        while n < rotors.len() {
            let column = column(&rotors[n], arm, drag);
            let thrust = product(&inverse[0], &column);
            if thrust < 1e-3 {
                return Err(GeometryError::Unbalanced);
            }
            shares.thrust[n] = thrust;
            shares.collective[n] = 1.0 / thrust;
            shares.roll[n] = product(&inverse[1], &column) / arm;
            shares.pitch[n] = product(&inverse[2], &column) / arm;
            shares.yaw[n] = product(&inverse[3], &column) / drag;
            n += 1;
        }
        Ok(shares)
    }
}

type Matrix = [[f32; 4]; 4];

/// What one rotor adds to thrust, roll, pitch and yaw, torque in units of `arm` and `drag`.
const fn column(rotor: &Rotor, arm: f32, drag: f32) -> [f32; 4] {
    [1.0, -rotor.y / arm, rotor.x / arm, rotor.yaw_arm() / drag]
}

const fn product(a: &[f32; 4], b: &[f32; 4]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
}

/// The sum of each rotor's column times itself.
const fn gram(rotors: &[Rotor], arm: f32, drag: f32) -> Matrix {
    let mut gram = [[0.0; 4]; 4];
    let mut n = 0;
    while n < rotors.len() {
        let column = column(&rotors[n], arm, drag);
        let mut row = 0;
        while row < 4 {
            let mut place = 0;
            while place < 4 {
                gram[row][place] += column[row] * column[place];
                place += 1;
            }
            row += 1;
        }
        n += 1;
    }
    gram
}

/// The inverse by Gauss and Jordan, without exchanging rows: the matrix is symmetric and not negative, so its diagonal
/// holds the pivots. `None` when it is nearly singular or holds no numbers.
const fn inverse(mut matrix: Matrix) -> Option<Matrix> {
    let mut inverse = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
    let mut determinant = 1.0f32;
    let mut pivot = 0;
    while pivot < 4 {
        let diagonal = matrix[pivot][pivot];
        if diagonal.is_nan() || diagonal <= 0.0 {
            return None;
        }
        determinant *= diagonal;
        let mut place = 0;
        while place < 4 {
            matrix[pivot][place] /= diagonal;
            inverse[pivot][place] /= diagonal;
            place += 1;
        }
        let mut row = 0;
        while row < 4 {
            let factor = matrix[row][pivot];
            let mut place = 0;
            while row != pivot && place < 4 {
                matrix[row][place] -= factor * matrix[pivot][place];
                inverse[row][place] -= factor * inverse[pivot][place];
                place += 1;
            }
            row += 1;
        }
        pivot += 1;
    }
    // The determinant of a well-spread airframe is of the order of N⁴; a singular one leaves only rounding.
    if determinant < 1e-4 { None } else { Some(inverse) }
}
