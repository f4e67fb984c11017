//! A PID loop with filtered derivative and an integrator that knows when to stop.
//!
//! C(s) = Kp (1 + 1/(Ti s) + Td s/(η Td s + 1)), discretised with the bilinear transform. The derivative acts on the
//! measurement, so a step of the set-point does not kick. The integrator holds output units (it survives a change
//! of gains without a jump) and is stopped by three things: its own clamp, the loop's own output limit, and
//! [`Integration`], by which the caller passes on what saturated further down.
//!
//! Use it for every linear loop of one input and one output. A quantity that wraps, such as heading, must be
//! unwrapped first; a vector that is limited by its norm needs the limit outside.

use num_traits::float::FloatCore;

/// Gains of a [`Pid`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PidGains<T = f32> {
    /// Proportional gain, output units per measured unit.
    pub kp: T,
    /// Integral time in seconds. Zero, negative or infinite means no integral.
    pub ti: T,
    /// Derivative time in seconds. Zero or negative means no derivative.
    pub td: T,
    /// Derivative filter: its time constant as a share of `td`. One eighth is the customary value.
    pub eta: T,
}

impl<T: FloatCore> PidGains<T> {
    /// A proportional loop.
    #[must_use]
    pub fn proportional(kp: T) -> Self {
        Self { kp, ti: T::zero(), td: T::zero(), eta: T::one() }
    }
}

/// What the integrator may do in this step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integration {
    /// Integrate.
    #[default]
    Free,
    /// Something down the line is at its upper limit: do not integrate upwards.
    NotUp,
    /// Something down the line is at its lower limit: do not integrate downwards.
    NotDown,
    /// Keep the integral as it is.
    Hold,
}

/// One loop with its state.
///
/// ```
/// use stampfly_control::pid::{Integration, Pid, PidGains};
/// let mut pid = Pid::new(PidGains { kp: 2.0, ti: 0.5, td: 0.0, eta: 0.125 }, 10.0);
/// // A tank that empties at 1 unit per second and is filled by the loop.
/// let mut level = 0.0f32;
/// for _ in 0..4000 {
///     level += (pid.step(3.0, level, 0.0025, Integration::Free) - 1.0) * 0.0025;
/// }
/// assert!((level - 3.0).abs() < 1e-3, "the integral has learned the leak");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pid<T = f32> {
    gains: PidGains<T>,
    limit: T,
    integral_limit: T,
    integral: T,
    derivative: T,
    error: T,
    measurement: Option<T>,
    output: T,
    discrete: Discrete<T>,
}

/// Coefficients that depend on the gains and the step length only; kept, because the step length hardly changes.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Discrete<T> {
    dt: T,
    integral: T,
    derivative_decay: T,
    derivative_gain: T,
}

impl<T: FloatCore> Discrete<T> {
    fn new(gains: &PidGains<T>, dt: T) -> Self {
        let two = T::one() + T::one();
        let integral = if gains.ti > T::zero() { gains.kp * dt / (two * gains.ti) } else { T::zero() };
        let (derivative_decay, derivative_gain) = if gains.td > T::zero() {
            // Numerator and denominator times the step: one division for both.
            let double = two * gains.td;
            let smooth = gains.eta * double;
            let scale = T::one() / (smooth + dt);
            ((smooth - dt) * scale, double * scale)
        } else {
            (T::zero(), T::zero())
        };
        Self { dt, integral, derivative_decay, derivative_gain }
    }
}

impl<T: FloatCore> Pid<T> {
    /// A loop at rest whose output and integral stay within ±`limit`.
    #[must_use]
    pub fn new(gains: PidGains<T>, limit: T) -> Self {
        let zero = T::zero();
        Self {
            gains,
            limit: limit.abs(),
            integral_limit: limit.abs(),
            integral: zero,
            derivative: zero,
            error: zero,
            measurement: None,
            output: zero,
            discrete: Discrete { dt: zero, integral: zero, derivative_decay: zero, derivative_gain: zero },
        }
    }

    /// The same, with an integral that stays within ±`limit`: what it may have learned while something held the plant.
    #[must_use]
    pub fn with_integral_limit(self, limit: T) -> Self {
        Self { integral_limit: limit.abs().min(self.limit), ..self }
    }

    /// One step of `dt` seconds. Inputs that are not finite, or a `dt` that is not positive, change nothing and
    /// repeat the last output.
    #[inline]
    pub fn step(&mut self, setpoint: T, measurement: T, dt: T, integration: Integration) -> T {
        let error = setpoint - measurement;
        if !(error.is_finite() && dt > T::zero()) {
            return self.output;
        }
        if dt != self.discrete.dt {
            // Asked here only: the one before it was finite.
            if !dt.is_finite() {
                return self.output;
            }
            self.discrete = Discrete::new(&self.gains, dt);
        }

        let change = measurement - self.measurement.unwrap_or(measurement);
        let derivative = self.discrete.derivative_decay * self.derivative - self.discrete.derivative_gain * change;
        self.derivative = if derivative.is_finite() { derivative } else { T::zero() };
        self.measurement = Some(measurement);

        let step = self.discrete.integral * (error + self.error);
        self.error = error;
        let direct = self.gains.kp * (error + self.derivative);
        let allowed = match integration {
            Integration::Free => true,
            Integration::NotUp => step <= T::zero(),
            Integration::NotDown => step >= T::zero(),
            Integration::Hold => false,
        };
        // The loop's own limit counts like one further down: stop when saturated and pushing further.
        let before = direct + self.integral;
        let winds_up = (before >= self.limit && step > T::zero()) || (before <= -self.limit && step < T::zero());
        if allowed && !winds_up && step.is_finite() {
            self.integral = clamp(self.integral + step, self.integral_limit);
        }

        let output = direct + self.integral;
        if !output.is_nan() {
            self.output = clamp(output, self.limit);
        }
        self.output
    }

    /// Forgets everything but gains and limit.
    pub fn reset(&mut self) {
        *self = Self::new(self.gains, self.limit).with_integral_limit(self.integral_limit);
    }

    /// The integral, in output units.
    #[must_use]
    pub fn integral(&self) -> T {
        self.integral
    }

    /// Sets the integral, for a take-over without a jump. Clamped to the limit; not finite counts as zero.
    pub fn set_integral(&mut self, integral: T) {
        self.integral = if integral.is_finite() { clamp(integral, self.integral_limit) } else { T::zero() };
    }

    /// Changes the gains in flight. The integral and the filtered derivative stay, so the output moves only by what the gains change; the same gains
    /// change nothing, bit for bit.
    pub fn set_gains(&mut self, gains: PidGains<T>) {
        if gains != self.gains {
            self.gains = gains;
            self.discrete.dt = T::zero();
        }
    }

    /// Bound of the output and of the integral.
    #[must_use]
    pub fn limit(&self) -> T {
        self.limit
    }
}

/// Within ±`limit`. Comparisons, not `max` and `min`: those spend instructions on NaN, which does not get here.
fn clamp<T: FloatCore>(value: T, limit: T) -> T {
    if value > limit {
        limit
    } else if value < -limit {
        -limit
    } else {
        value
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const GAINS: PidGains = PidGains { kp: 2.0, ti: 0.5, td: 0.02, eta: 0.125 };
    const DT: f32 = 0.0025;

    #[test]
    fn the_derivative_of_a_ramp_is_its_slope() {
        let mut pid = Pid::new(PidGains { ti: 0.0, ..GAINS }, 100.0);
        let mut out = 0.0;
        for n in 0..200 {
            let measurement = n as f32 * DT * 3.0;
            out = pid.step(measurement, measurement, DT, Integration::Free);
        }
        assert!((out + GAINS.kp * GAINS.td * 3.0).abs() < 1e-3, "-Kp Td dy/dt, got {out}");
    }

    #[test]
    fn a_setpoint_step_does_not_kick() {
        let mut pid = Pid::new(PidGains { ti: 0.0, ..GAINS }, 100.0);
        pid.step(0.0, 0.0, DT, Integration::Free);
        assert_eq!(pid.step(1.0, 0.0, DT, Integration::Free), 2.0);
    }

    #[test]
    fn the_integral_of_a_constant_error_is_a_ramp() {
        // A Ti of 10 ms must integrate as well as any other.
        for ti in [0.01f32, 0.5, 10.0] {
            let mut pid = Pid::new(PidGains { kp: 1.0, ti, td: 0.0, eta: 0.125 }, 1e6);
            for _ in 0..401 {
                pid.step(1.0, 0.0, DT, Integration::Free);
            }
            let expected = (400.0 + 0.5) * DT / ti;
            assert!((pid.integral() / expected - 1.0).abs() < 1e-3, "Ti {ti}: {} for {expected}", pid.integral());
        }
    }

    #[test]
    fn works_in_f64_as_well() {
        let mut pid = Pid::new(PidGains::proportional(3.0f64), 100.0);
        assert_eq!(pid.step(2.0, 1.0, 0.01, Integration::Free), 3.0);
    }

    #[test]
    fn new_gains_do_not_jump_the_integral() {
        let mut pid = Pid::new(GAINS, 10.0);
        for _ in 0..100 {
            pid.step(1.0, 0.0, DT, Integration::Free);
        }
        let before = pid.integral();
        pid.set_gains(PidGains { ti: 5.0, ..GAINS });
        pid.step(0.0, 0.0, DT, Integration::Free);
        assert!((pid.integral() - before).abs() < 2e-3);
    }

    fn any_float() -> impl Strategy<Value = f32> {
        prop_oneof![4 => -1e3f32..1e3, 1 => any::<f32>()]
    }

    proptest! {
        #[test]
        fn output_and_integral_are_finite_and_bounded_whatever_comes_in(
            steps in prop::collection::vec((any_float(), any_float(), prop_oneof![Just(DT), any_float()]), 1..100),
            limit in 0.1f32..10.0,
        ) {
            let mut pid = Pid::new(GAINS, limit);
            for (setpoint, measurement, dt) in steps {
                let out = pid.step(setpoint, measurement, dt, Integration::Free);
                prop_assert!(out.is_finite() && out.abs() <= limit);
                prop_assert!(pid.integral().is_finite() && pid.integral().abs() <= limit);
            }
            // And it still works afterwards.
            for _ in 0..8000 {
                pid.step(0.0, 0.0, DT, Integration::Free);
            }
            prop_assert!(pid.step(0.0, 0.0, DT, Integration::Hold) == pid.integral());
        }

        #[test]
        fn saturation_stops_the_integral_in_its_direction_only(errors in prop::collection::vec(-5f32..5.0, 1..100)) {
            let (mut up, mut down, mut held) = (Pid::new(GAINS, 1e3), Pid::new(GAINS, 1e3), Pid::new(GAINS, 1e3));
            for error in errors {
                let (was_up, was_down) = (up.integral(), down.integral());
                up.step(error, 0.0, DT, Integration::NotUp);
                down.step(error, 0.0, DT, Integration::NotDown);
                held.step(error, 0.0, DT, Integration::Hold);
                prop_assert!(up.integral() <= was_up && down.integral() >= was_down);
            }
            prop_assert_eq!(held.integral(), 0.0);
        }

        #[test]
        fn after_long_saturation_it_comes_back_at_once(error in 1f32..100.0, steps in 1usize..4000) {
            let mut pid = Pid::new(PidGains { td: 0.0, ..GAINS }, 1.0);
            for _ in 0..steps {
                pid.step(error, 0.0, DT, Integration::Free);
            }
            pid.step(-0.6, 0.0, DT, Integration::Free);
            prop_assert!(pid.step(-0.6, 0.0, DT, Integration::Free) < 0.0);
        }

        #[test]
        fn mirrored_inputs_give_mirrored_outputs(steps in prop::collection::vec((-9f32..9.0, -9f32..9.0), 1..50)) {
            let (mut one, mut other) = (Pid::new(GAINS, 5.0), Pid::new(GAINS, 5.0));
            for (setpoint, measurement) in steps {
                let out = one.step(setpoint, measurement, DT, Integration::Free);
                prop_assert_eq!(out, -other.step(-setpoint, -measurement, DT, Integration::Free));
            }
        }
    }
}
