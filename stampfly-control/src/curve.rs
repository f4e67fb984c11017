//! The motor curve: which voltage makes a motor with its propeller push how hard.
//!
//! Thrust T = Ct ω² gives the speed, V(ω) = Am ω² + Bm ω + Cm the voltage at which a brushed motor turns its propeller
//! at that speed. The constants belong together: a curve measured on the bench without airflow promises 11 to 13 % more
//! thrust than the vehicle has in flight. A motor without [`am`](MotorCurve::am), whose speed follows its voltage, is one as well. Not for motors
//! whose controller regulates the speed: those need no voltage.
//!
//! What cannot be, such as a curve of zeros or a thrust that is no number, is no thrust and no voltage.

use stampfly_types::math;

/// How a motor with its propeller turns voltage into thrust.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MotorCurve {
    /// Thrust per squared speed, N/(rad/s)².
    pub ct: f32,
    /// Voltage per squared speed, V/(rad/s)².
    pub am: f32,
    /// Voltage per speed, V/(rad/s).
    pub bm: f32,
    /// Voltage to overcome friction, V.
    pub cm: f32,
}

impl MotorCurve {
    /// Voltage at which the motor pushes with `thrust` N. Zero for no thrust: a motor that need not turn gets nothing.
    #[must_use]
    #[inline]
    pub fn voltage(&self, thrust: f32) -> f32 {
        let [voltage] = self.voltages([thrust]);
        voltage
    }

    /// The same for motors side by side. Each step is taken for all of them before the next, and none of them branches: that is what
    /// compilers make vectors of.
    #[inline(always)]
    pub(crate) fn voltages<const N: usize>(&self, thrust: [f32; N]) -> [f32; N] {
        // No thrust for NaN as well.
        let thrust = thrust.map(|thrust| if thrust > 0.0 { thrust } else { 0.0 });
        let squared = thrust.map(|thrust| thrust / self.ct);
        let mut voltage = squared.map(math::sqrt);
        for ((voltage, squared), thrust) in voltage.iter_mut().zip(squared).zip(thrust) {
            let wanted = self.am * squared + self.bm * *voltage + self.cm;
            *voltage = if (thrust > 0.0) & wanted.is_finite() { wanted } else { 0.0 };
        }
        voltage
    }

    /// Thrust, N, at a voltage: the inverse of [`Self::voltage`].
    #[must_use]
    pub fn thrust(&self, voltage: f32) -> f32 {
        // The root that does not divide by what may be nothing.
        let above = (voltage - self.cm).max(0.0);
        let speed = 2.0 * above / (self.bm + math::sqrt(self.bm * self.bm + 4.0 * self.am * above));
        let thrust = self.ct * speed * speed;
        if thrust.is_finite() { thrust } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::airframe::Airframe;
    use proptest::prelude::*;

    #[test]
    fn a_motor_whose_speed_follows_its_voltage_has_an_inverse() {
        // A brushless motor's 8 N at 14.8 V.
        let curve = MotorCurve { ct: 1e-5, am: 0.0, bm: 14.8 / math::sqrt(8e5), cm: 0.0 };
        assert!((curve.voltage(8.0) - 14.8).abs() < 1e-3 && (curve.thrust(14.8) - 8.0).abs() < 1e-3);
    }

    proptest! {
        #[test]
        fn nothing_that_goes_in_makes_what_is_no_number(
            ct in any::<f32>(), am in any::<f32>(), bm in any::<f32>(), cm in any::<f32>(), input in any::<f32>(),
        ) {
            let curve = MotorCurve { ct, am, bm, cm };
            prop_assert!(curve.voltage(input).is_finite() && curve.thrust(input).is_finite(), "{curve:?} {input}");
        }

        #[test]
        fn the_curve_and_its_inverse_agree(share in 1e-3f32..1.2) {
            let Airframe { motor: curve, motor_thrust_max, .. } = Airframe::EXAMPLE;
            let thrust = share * motor_thrust_max;
            prop_assert!((curve.thrust(curve.voltage(thrust)) / thrust - 1.0).abs() < 1e-4);
        }
    }
}
