//! Detection of corrupt inertial samples, by values that a rigid body cannot reach.
//!
//! For estimators and failsafe. Does not detect a failed sensor whose samples are plausible one by
//! one.

use crate::messages::ImuData;
use crate::{Duration, Vec3};

impl ImuData {
    /// After a gap of this length the previous rate is of no use for a comparison.
    const GAP: Duration = Duration::from_millis(50);
    /// Lower bound of the time between two samples, for samples that arrive together.
    const PERIOD: Duration = Duration::from_millis(2);
    /// Upper bound of the time over which the rate may change. Across a longer gap the rate stays
    /// about constant; only an impact changes it by more.
    const STEADY: Duration = Duration::from_millis(5);
    /// Share of full scale at which an accelerometer axis counts as saturated, below one because
    /// calibration and decimation change the value.
    const FULL: f32 = 0.9;

    /// Whether the sample is corrupt: a shifted frame, a register of `0x8000`, a spike.
    ///
    /// Two tests. The rate of a body with inertia changes no faster than `angular_acceleration`,
    /// rad/s²; `before` is the age and the rate of the last valid sample. All three axes of an
    /// accelerometer are not at its full scale, `accel_full_scale` in m/s², at the same time.
    ///
    /// A fault that lasts longer than a short burst is not a glitch; the caller has to count
    /// samples for that.
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
        // An impact saturates one or two axes; all three at once come from stuck or shifted bits.
        let full = self.accel.to_array().iter().all(|axis| axis.abs() >= Self::FULL * accel_full_scale);
        let jumps = before.is_some_and(|(elapsed, rate)| {
            let limit = angular_acceleration * elapsed.clamp(Self::PERIOD, Self::STEADY).seconds();
            elapsed < Self::GAP && (self.gyro - rate).amax() > limit
        });
        full || jumps
    }
}
