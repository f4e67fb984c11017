//! The motor curve: which voltage makes a motor with its propeller push how hard.
//!
//! Thrust T = Ct ω² gives the speed, V(ω) = Am ω² + Bm ω + Cm the voltage at which a brushed motor turns its propeller
//! at that speed. The constants belong together: a curve measured on the bench without airflow promises 11 to 13 % more
//! thrust than the vehicle has in flight. Not for motors whose controller regulates the speed: those need no voltage.

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
        // False for NaN as well.
        if thrust > 0.0 {
            let squared = thrust / self.ct;
            self.am * squared + self.bm * math::sqrt(squared) + self.cm
        } else {
            0.0
        }
    }

    /// Thrust, N, at a voltage: the inverse of [`Self::voltage`].
    #[must_use]
    pub fn thrust(&self, voltage: f32) -> f32 {
        let above = voltage - self.cm;
        if above <= 0.0 {
            return 0.0;
        }
        let speed = (math::sqrt(self.bm * self.bm + 4.0 * self.am * above) - self.bm) / (2.0 * self.am);
        self.ct * speed * speed
    }
}

#[cfg(test)]
mod tests {
    use crate::airframe::Airframe;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_curve_and_its_inverse_agree(share in 1e-3f32..1.2) {
            let Airframe { motor: curve, motor_thrust_max, .. } = Airframe::EXAMPLE;
            let thrust = share * motor_thrust_max;
            prop_assert!((curve.thrust(curve.voltage(thrust)) / thrust - 1.0).abs() < 1e-2);
        }
    }
}
