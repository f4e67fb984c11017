//! The limit set by the receiver's noise: per axis, the steady state of a Kalman filter in `f64`
//! that knows attitude and biases, so that only the accelerometer's noise acts between two fixes.

/// Standard deviation of the position just before and just after a fix, as the root of their mean
/// square, m.
///
/// `accel`: noise density of the accelerometer, m/s²/√Hz; `period` between fixes with standard
/// deviations `position` and `velocity`; `delay` of the newest fix.
pub fn position_sigma(accel: f64, period: f64, position: f64, velocity: f64, delay: f64) -> f64 {
    let grow = |[pp, pv, vv]: [f64; 3], t: f64| {
        let q = accel * accel;
        [pp + 2.0 * t * pv + t * t * vv + q * t * t * t / 3.0, pv + t * vv + q * t * t / 2.0, vv + q * t]
    };
    let mut p = [position * position, 0.0, velocity * velocity];
    let mut prior = p;
    for _ in 0..10_000 {
        prior = grow(p, period);
        // Position first, then velocity.
        let [pp, pv, vv] = prior;
        let s = pp + position * position;
        let [pp, pv, vv] = [pp - pp * pp / s, pv - pp * pv / s, vv - pv * pv / s];
        let s = vv + velocity * velocity;
        p = [pp - pv * pv / s, pv - pv * vv / s, vv - vv * vv / s];
    }
    let [after, before] = [grow(p, delay)[0], grow(prior, delay)[0]];
    (0.5 * (after + before)).sqrt()
}

#[test]
fn without_motion_it_is_the_mean_of_the_fixes() {
    // At rest with a noise-free accelerometer the estimate improves with every fix.
    assert!(position_sigma(1e-9, 0.2, 0.5, 0.1, 0.0) < 0.01);
    // With a useless accelerometer it is nearly the receiver's own noise.
    let noisy = position_sigma(1e3, 0.2, 0.5, 0.1, 0.0);
    assert!(noisy > 0.5, "{noisy}");
    assert!(position_sigma(0.1, 0.2, 0.5, 0.1, 0.3) > position_sigma(0.1, 0.2, 0.5, 0.1, 0.0));
}
