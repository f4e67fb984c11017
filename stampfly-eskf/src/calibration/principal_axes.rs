//! Principal axes of a symmetric 3 × 3 matrix.

use nalgebra::Matrix3;
use stampfly_types::{Vec3, math};

/// Eigenvectors, as columns, and eigenvalues of a symmetric matrix by Jacobi rotations (Golub, Van
/// Loan, 4th edition, section 8.5). Each step rotates the first two axes and then permutes the
/// axes, so no element is indexed.
pub(super) fn principal_axes(mut matrix: Matrix3<f32>) -> (Matrix3<f32>, Vec3) {
    let pass_on = Matrix3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
    let mut axes = Matrix3::identity();
    // Five sweeps over the three pairs; convergence is quadratic.
    for _ in 0..15 {
        // At most 45°, otherwise the axes would be exchanged in every step.
        let (across, apart) = (2.0 * matrix.m12, matrix.m11 - matrix.m22);
        let angle = 0.5 * if apart < 0.0 { math::atan2(-across, -apart) } else { math::atan2(across, apart) };
        let (sin, cos) = math::sin_cos(angle);
        let turn = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0) * pass_on;
        matrix = turn.transpose() * matrix * turn;
        axes *= turn;
    }
    (axes, Vec3::new(matrix.m11, matrix.m22, matrix.m33))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn principal_axes_make_the_matrix_again(values in prop::array::uniform6(-1.0f32..1.0)) {
            let [a, b, c, d, e, f] = values;
            let matrix = Matrix3::new(a, d, e, d, b, f, e, f, c);
            let (axes, squares) = principal_axes(matrix);
            prop_assert!((axes * axes.transpose() - Matrix3::identity()).amax() < 1e-5);
            prop_assert!((axes * Matrix3::from_diagonal(&squares.into()) * axes.transpose() - matrix).amax() < 1e-5);
        }
    }
}
