//! The χ² distribution: between which values a sum of squared standard normal variates lies.

/// Share of the distribution with this many degrees of freedom that lies below `value`.
///
/// The series of the incomplete gamma function (Abramowitz and Stegun, "Handbook of Mathematical Functions", 6.5.29).
///
/// ```
/// use stampfly_lab::consistency::chi_square;
/// assert!((chi_square::below(2, 2.0) - (1.0 - (-1f64).exp())).abs() < 1e-12);
/// ```
#[must_use]
pub fn below(freedom: usize, value: f64) -> f64 {
    let (shape, x) = (0.5 * freedom as f64, 0.5 * value);
    if x <= 0.0 || freedom == 0 {
        return 0.0;
    }
    // ln Γ(shape + 1) for multiples of a half.
    let mut ln_gamma = if freedom.is_multiple_of(2) { 0.0 } else { 0.5 * std::f64::consts::PI.ln() };
    let mut step = if freedom.is_multiple_of(2) { 1.0 } else { 0.5 };
    while step <= shape {
        ln_gamma += step.ln();
        step += 1.0;
    }
    let (mut term, mut sum, mut n) = (1.0, 1.0, 1.0);
    while term > 1e-17 * sum {
        term *= x / (shape + n);
        sum += term;
        n += 1.0;
    }
    (shape * x.ln() - x - ln_gamma + sum.ln()).exp().min(1.0)
}

/// The values that 2.5 % and 97.5 % of the distribution lie below.
///
/// ```
/// use stampfly_lab::consistency::chi_square;
/// let [low, high] = chi_square::band(3);
/// assert!((low - 0.2158).abs() < 1e-3 && (high - 9.3484).abs() < 1e-3);
/// ```
#[must_use]
pub fn band(freedom: usize) -> [f64; 2] {
    [0.025, 0.975].map(|share| {
        let (mut low, mut high) = (0.0, 10.0 * freedom as f64 + 20.0);
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if below(freedom, middle) < share { low = middle } else { high = middle }
        }
        low
    })
}
