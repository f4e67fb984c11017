//! Recursive least squares with a triangular (QR) factor and Givens rotations.
//!
//! Normal equations would square the condition number, which `f32` cannot represent. This factor
//! keeps the condition of the equations and gives the residual without cancellation. Golub, Van
//! Loan, "Matrix Computations", 4th edition, sections 5.1.8 and 6.5.

use stampfly_types::math;

/// A pivot below this share of its column means that the column depends on the preceding ones.
const DEPENDENT: f32 = 1e-4;

/// Equations in `WIDTH` − 1 unknowns, as the triangular factor of their QR decomposition. The last
/// column is the right-hand side; its last element is the norm of the residual.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(
        serialize = "[[f32; WIDTH]; WIDTH]: serde::Serialize",
        deserialize = "[[f32; WIDTH]; WIDTH]: serde::Deserialize<'de>"
    ))
)]
pub(super) struct LeastSquares<const WIDTH: usize> {
    rows: [[f32; WIDTH]; WIDTH],
}

impl<const WIDTH: usize> Default for LeastSquares<WIDTH> {
    fn default() -> Self {
        Self { rows: [[0.0; WIDTH]; WIDTH] }
    }
}

impl<const WIDTH: usize> LeastSquares<WIDTH> {
    /// Adds an equation: the coefficients of the unknowns, then the right-hand side.
    pub(super) fn add(&mut self, mut equation: [f32; WIDTH]) {
        for (i, row) in self.rows.iter_mut().enumerate() {
            let (Some(&pivot), Some(&value)) = (row.get(i), equation.get(i)) else { return };
            let length = math::sqrt(pivot * pivot + value * value);
            if length > 0.0 {
                let (cos, sin) = (pivot / length, value / length);
                for (kept, new) in row.iter_mut().zip(&mut equation).skip(i) {
                    (*kept, *new) = (cos * *kept + sin * *new, cos * *new - sin * *kept);
                }
            }
        }
    }

    /// The unknowns, by back substitution; the element of the right-hand side stays zero. `None` if
    /// an unknown is not determined.
    pub(super) fn solve(&self) -> Option<[f32; WIDTH]> {
        let mut unknowns = [0.0; WIDTH];
        for (i, row) in self.rows.iter().enumerate().rev().skip(1) {
            let column: f32 = self.rows.iter().map(|row| row.get(i).map_or(0.0, |cell| cell * cell)).sum();
            let pivot = *row.get(i)?;
            if pivot.is_nan() || pivot.abs() <= DEPENDENT * math::sqrt(column) {
                return None;
            }
            let known: f32 = row.iter().zip(&unknowns).skip(i + 1).map(|(factor, unknown)| factor * unknown).sum();
            *unknowns.get_mut(i)? = (row.last()? - known) / pivot;
        }
        Some(unknowns)
    }

    /// Norm of the residual of the best solution.
    pub(super) fn residual(&self) -> f32 {
        self.rows.last().and_then(|row| row.last()).map_or(0.0, |norm| norm.abs())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    const UNKNOWNS: usize = 9;
    const WIDTH: usize = UNKNOWNS + 1;

    /// An equation with known coefficients, the solution 1, 2, … 9, and this error.
    fn equation(n: u16, error: f32) -> [f32; WIDTH] {
        let mut equation = [0.0; WIDTH];
        let mut sum = error;
        for (k, factor) in equation.iter_mut().take(UNKNOWNS).enumerate() {
            *factor = math::sin(f32::from(n) * (k as f32 + 1.0) * 0.7 + k as f32);
            sum += *factor * (k as f32 + 1.0);
        }
        equation[UNKNOWNS] = sum;
        equation
    }

    #[test]
    fn solution_and_residual_of_known_equations_are_found() {
        let mut fit = LeastSquares::<WIDTH>::default();
        for n in 0..8 {
            fit.add(equation(n, 0.0));
        }
        assert_eq!(fit.solve(), None, "eight equations in nine unknowns");
        for n in 8..400 {
            fit.add(equation(n, if n % 2 == 0 { 0.1 } else { -0.1 }));
        }
        for (found, true_value) in fit.solve().unwrap().iter().take(UNKNOWNS).zip(1u8..) {
            assert_abs_diff_eq!(*found, f32::from(true_value), epsilon = 0.02);
        }
        let rms = fit.residual() / math::sqrt(400.0);
        assert_abs_diff_eq!(rms, 0.1, epsilon = 0.005);
    }
}
