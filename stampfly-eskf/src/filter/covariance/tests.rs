//! Covariance arithmetic compared with the textbook form, dense and in double precision.

use super::*;
use crate::filter::PropagationStep;
use crate::filter::state::{NominalState, Rotation, rotation_matrix};
use nalgebra::SMatrix;
use proptest::prelude::*;
use stampfly_types::Vec3;

type Dense = SMatrix<f64, 15, 15>;

fn dense(p: &Covariance) -> Dense {
    Dense::from_fn(|i, j| f64::from(p.get(i, j)))
}

/// The same step in the textbook form, dense and in double precision.
fn reference(p: &Dense, rotation: &Rotation, step: &PropagationStep, noise: &ProcessNoise) -> Dense {
    let dt = f64::from(step.duration);
    let matrix = |m: &Rotation| nalgebra::Matrix3::from_fn(|i, j| f64::from(m[i][j]));
    let r = matrix(rotation);
    let mut transition = Dense::identity();
    let eye = nalgebra::Matrix3::identity();
    transition.fixed_view_mut::<3, 3>(0, 3).copy_from(&(eye * dt));
    transition
        .fixed_view_mut::<3, 3>(3, 6)
        .copy_from(&-(nalgebra::Vector3::from(step.delta_velocity).map(f64::from).cross_matrix() * r));
    transition.fixed_view_mut::<3, 3>(3, 12).copy_from(&(-r * dt));
    transition.fixed_view_mut::<3, 3>(6, 6).copy_from(&matrix(&rotation_matrix(step.delta_rotation)).transpose());
    transition.fixed_view_mut::<3, 3>(6, 9).copy_from(&(-eye * dt));
    let mut next = transition * p * transition.transpose();
    for i in 0..3 {
        next[(3 + i, 3 + i)] += f64::from(noise.velocity) * dt;
        next[(6 + i, 6 + i)] += f64::from(noise.attitude) * dt;
        next[(9 + i, 9 + i)] += f64::from(noise.gyro_bias) * dt;
        next[(12 + i, 12 + i)] += f64::from(noise.accel_bias) * dt;
    }
    next
}

const NOISE: ProcessNoise = ProcessNoise { velocity: 0.09, attitude: 1e-4, gyro_bias: 1e-9, accel_bias: 1e-7 };

fn scaled_difference(a: &Dense, b: &Dense) -> f64 {
    let mut worst = 0.0f64;
    for i in 0..15 {
        for j in 0..15 {
            let scale = (b[(i, i)] * b[(j, j)]).sqrt();
            worst = worst.max((a[(i, j)] - b[(i, j)]).abs() / scale);
        }
    }
    worst
}

fn jacobian(entries: &[(usize, f32)]) -> [f32; N] {
    let mut jacobian = [0.0; N];
    for (state, value) in entries {
        jacobian[*state] = *value;
    }
    jacobian
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn a_thousand_steps_and_updates_match_the_dense_reference(
        rates in prop::collection::vec((-3f32..3.0, -3f32..3.0, -3f32..3.0, -3f32..3.0), 20),
    ) {
        let mut p = Covariance::from_sigmas([0.1, 0.1, 0.1, 0.01, 0.1]);
        // The variant of the update that this machine does not use.
        let mut other = p;
        let mut exact = dense(&p);
        let mut state = NominalState::default();
        for n in 0..1000usize {
            let (x, y, z, a) = rates[n / 50];
            let (rotation, mut step) = (state.rotation(), PropagationStep::default());
            for _ in 0..2 {
                step.extend(&state.propagate(&Vec3::new(a, -a, -9.8 + z), &Vec3::new(x, y, z), 0.0025));
            }
            exact = reference(&exact, &rotation, &step, &NOISE);
            p.propagate(&rotation, &step, &NOISE);
            other.propagate(&rotation, &step, &NOISE);
            if n % 4 == 0 {
                let h = [
                    jacobian(&[(0, 0.2), (4, 0.9), (6, a), (7, x), (10, 0.3)]),
                    jacobian(&[(3, 0.7), (4, -0.2), (8, z)]),
                    jacobian(&[(6, 1.0), (7, 0.4), (12, 1.0)]),
                ];
                let (y, r) = ([0.1, -0.05, 0.02], [0.01, 0.02, 0.05]);
                let dense_h = SMatrix::<f64, 3, 15>::from_fn(|i, j| f64::from(h[i][j]));
                let noise = nalgebra::Matrix3::from_diagonal(&nalgebra::Vector3::from(r.map(f64::from)));
                let innovation = nalgebra::Vector3::from(y.map(f64::from));
                let s = (dense_h * exact * dense_h.transpose() + noise).try_inverse().unwrap();
                let gain = exact * dense_h.transpose() * s;

                let whitened = p.innovation(&h, y, r);
                let distance = (innovation.transpose() * s * innovation)[0];
                prop_assert!((f64::from(whitened.nis()) / distance - 1.0).abs() < 1e-2);
                let correction = p.update_with::<3, true>(&whitened).unwrap();
                prop_assert_eq!(Some(correction), other.update_with::<3, false>(&whitened));
                for (i, (ours, theirs)) in correction.iter().zip((gain * innovation).iter()).enumerate() {
                    let sigma = exact[(i, i)].sqrt();
                    prop_assert!((f64::from(*ours) - theirs).abs() < 5e-3 * sigma, "{i}: {ours}, not {theirs}");
                }
                exact -= gain * dense_h * exact;
            }
        }
        prop_assert!(scaled_difference(&dense(&p), &exact) < 2e-3, "{}", scaled_difference(&dense(&p), &exact));
        for i in 0..15 { for j in 0..15 { prop_assert_eq!(p.get(i, j).to_bits(), p.get(j, i).to_bits()) } }
        for i in 0..15 { for j in 0..15 { prop_assert_eq!(p.get(i, j).to_bits(), other.get(i, j).to_bits()) } }
        prop_assert!(p.is_healthy());
        prop_assert!(dense(&p).cholesky().is_some(), "positive definite");
    }
}

#[test]
fn considered_states_stay_and_the_rest_is_josephs_form_without_their_gain() {
    let mut p = Covariance::from_sigmas([0.1, 0.5, 0.1, 0.01, 3.0]);
    let mut state = NominalState::default();
    for _ in 0..40 {
        let (rotation, mut step) = (state.rotation(), PropagationStep::default());
        step.extend(&state.propagate(&Vec3::new(1.0, 0.0, -9.0), &Vec3::new(0.3, 1.0, 0.0), 0.005));
        p.propagate(&rotation, &step, &NOISE);
    }
    let before = p;
    let considered = [2, 5, 14];
    let h = [jacobian(&[(3, 0.9), (5, 0.4), (7, 1.0)]), jacobian(&[(4, 1.0), (5, -0.1), (6, -1.0)])];
    let (y, r) = ([0.3, -0.2], [0.01, 0.02]);
    let innovation = p.innovation(&h, y, r);
    let mut correction = p.update(&innovation);
    p.consider(&innovation, considered, &mut correction);

    let exact = dense(&before);
    let h = SMatrix::<f64, 2, 15>::from_fn(|i, j| f64::from(h[i][j]));
    let noise = nalgebra::Matrix2::from_diagonal(&nalgebra::Vector2::from(r.map(f64::from)));
    let mut gain = exact * h.transpose() * (h * exact * h.transpose() + noise).try_inverse().unwrap();
    for state in considered {
        gain.row_mut(state).fill(0.0);
    }
    let left = Dense::identity() - gain * h;
    let joseph = left * exact * left.transpose() + gain * noise * gain.transpose();
    assert!(scaled_difference(&dense(&p), &joseph) < 1e-4, "{}", scaled_difference(&dense(&p), &joseph));
    let expected = gain * nalgebra::Vector2::from(y.map(f64::from));
    for (i, (ours, theirs)) in correction.iter().zip(expected.iter()).enumerate() {
        assert!((f64::from(*ours) - theirs).abs() < 1e-4, "{i}: {ours}, not {theirs}");
    }
    assert!(considered.iter().all(|i| correction[*i] == 0.0));
    let innovation = p.innovation(&[[f32::NAN; N]], [0.0], [1.0]);
    let mut broken = p.update(&innovation);
    p.consider(&innovation, considered, &mut broken);
    assert!(broken.iter().all(|value| value.is_nan()), "and is not hidden");
}

#[test]
fn reset_clears_the_covariances_of_the_state() {
    let mut p = Covariance::from_sigmas([1.0; 5]);
    p.update(&p.innovation(&[jacobian(&[(0, 1.0), (3, 1.0)])], [0.0], [0.1]));
    assert!(p.get(0, 3) != 0.0);
    p.reset(3, 4.0);
    assert_eq!((p.get(0, 3), p.get(3, 0), p.get(3, 3)), (0.0, 0.0, 4.0));
}

/// Two states whose covariance exceeds both variances, among valid ones.
fn contradicting(covariance: f32) -> Covariance {
    let mut p = Covariance::from_sigmas([1.0, 1.0, 0.1, 0.01, 0.1]);
    p.change(0, 3, |_| covariance);
    p.change(3, 0, |_| covariance);
    p
}

#[test]
fn covariances_that_cannot_be_are_dropped_and_teach_nothing() {
    for covariance in [3.0, 10.0, 1e10, 1e18, 1e25, -1e38] {
        let mut p = contradicting(covariance);
        let innovation = p.innovation(&[jacobian(&[(0, 1.0)])], [0.5], [0.01]);
        let mut other = p;
        assert_eq!(p.update(&innovation), [0.0; N], "{covariance}");
        assert_eq!(other.try_update(&innovation), None, "{covariance}");
        assert_eq!(p, other);
        let expected = Covariance::from_sigmas([1.0, 1.0, 0.1, 0.01, 0.1]);
        for state in 0..N {
            let (left, before) = (p.get(state, state), expected.get(state, state));
            assert!((left / before - 1.0).abs() < 1e-4, "{covariance}: {left}, not {before}");
        }
        assert_eq!(p.get(0, 3), 0.0);
        // The next measurement has its normal effect.
        let innovation = p.innovation(&[jacobian(&[(0, 1.0)])], [0.5], [0.01]);
        assert!((p.update(&innovation)[0] - 0.5).abs() < 0.01 && p.is_healthy());
    }
}

/// A kilometre, then a tenth of a millimetre: the difference is below the last digit of an `f32`.
#[test]
fn an_update_by_more_digits_than_there_are_leaves_a_variance() {
    for sigma in [1e3, 1e5, 1e9] {
        let mut p = Covariance::from_sigmas([sigma, 1.0, 0.1, 0.01, 0.1]);
        for _ in 0..3 {
            let h = [jacobian(&[(0, 1.0)]), jacobian(&[(1, 1.0)])];
            let innovation = p.innovation(&h, [5.0, -5.0], [1e-8; 2]);
            _ = p.update(&innovation);
            assert!(p.is_healthy(), "{sigma}: {p:?}");
        }
        assert!(p.get(0, 0) < 1e-5 * sigma * sigma, "{sigma}: {}", p.get(0, 0));
    }
}
