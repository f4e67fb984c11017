//! Garbage among inertial samples, by what no body does. For who flies or judges by samples; not for a sensor that has died, whose
//! samples are possible one by one.

use crate::messages::ImuData;
use crate::{Duration, Vec3};

impl ImuData {
    /// After a gap this long nothing is known about what the rate was.
    const GAP: Duration = Duration::from_millis(50);
    /// Two samples that came together are a period apart, this long at least.
    const PERIOD: Duration = Duration::from_millis(2);
    /// A body whose samples are missing for longer goes on as it did: only a blow changes its rate by more.
    const STEADY: Duration = Duration::from_millis(5);
    /// Share of full scale at which the accelerometer's axes count as full: calibration and decimation move it.
    const FULL: f32 = 0.9;

    /// Is this garbage: a shifted frame, a register of `0x8000`, a spike?
    ///
    /// A body with a moment of inertia does not change its rate by more than its torque allows, `angular_acceleration` in rad/s².
    /// `before` is how long ago the last sample was taken that was believed, and its rate. All three axes of an accelerometer are
    /// never at its full scale, `accel_full_scale` in m/s², at once. What goes on for longer than a burst is no glitch, which the
    /// caller has to count.
    ///
    /// ```
    /// use stampfly_types::{Duration, Vec3, messages::ImuData};
    /// let sample = |rate| ImuData { gyro: Vec3::new(rate, 0.0, 0.0), ..ImuData::default() };
    /// let before = Some((Duration::from_micros(2_500), Vec3::zeros()));
    /// assert!(!sample(2.0).is_garbled(before, 3_000.0, 78.5));
    /// assert!(sample(20.0).is_garbled(before, 3_000.0, 78.5));
    /// ```
    #[inline]
    #[must_use]
    pub fn is_garbled(
        &self,
        before: Option<(Duration, Vec3)>,
        angular_acceleration: f32,
        accel_full_scale: f32,
    ) -> bool {
        let full = self.accel.to_array().iter().all(|axis| axis.abs() >= Self::FULL * accel_full_scale);
        let jumps = before.is_some_and(|(elapsed, rate)| {
            let limit = angular_acceleration * elapsed.clamp(Self::PERIOD, Self::STEADY).seconds();
            elapsed < Self::GAP && (self.gyro - rate).amax() > limit
        });
        full || jumps
    }
}
